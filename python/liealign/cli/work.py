"""What the commands do with a flight, and how what goes wrong becomes an exit code."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from liealign import _core
from liealign._core import Cancelled, Config, Error, InputError, NumericalError
from liealign.drivers import align_heading, write_results
from liealign.progress import ProgressBar
from liealign.report import write_report
from liealign.solution import Alignment

EXIT_BAD_INPUT, EXIT_NUMERICAL, EXIT_NOT_ALIGNED, EXIT_INTERRUPTED = 1, 3, 4, 130


def fail(message: str, code: int) -> typer.Exit:
    """Print the message as one line on stderr; raise what is returned."""
    print(" ".join(message.splitlines()), file=sys.stderr)
    return typer.Exit(code)


@contextmanager
def exit_codes() -> Iterator[None]:
    """Map what the work raises to one line on stderr and an exit code."""
    try:
        yield
    except NumericalError as error:
        raise fail(str(error), EXIT_NUMERICAL) from None
    except (Cancelled, KeyboardInterrupt):
        raise fail("interrupted", EXIT_INTERRUPTED) from None
    except BrokenPipeError:
        raise
    except (Error, MemoryError) as error:
        raise fail(str(error) or "out of memory", EXIT_BAD_INPUT) from None
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        raise fail(f"{where}{error.strerror or error}", EXIT_BAD_INPUT) from None


def align_flight(config: Config, quiet: bool) -> tuple[_core.PreparedFlight, Alignment]:
    """Read, prepare and align."""
    prepared = _core.prepare_flight(_core.read_flight(config))
    with ProgressBar("aligning the heading", quiet=quiet) as progress:
        return prepared, align_heading(prepared, progress)


def demand_aligned(alignment: Alignment, demanded: bool) -> None:
    """Exit with code 4 where the verdict "aligned" is demanded and another one was found."""
    if not demanded or alignment.verdict == "aligned":
        return
    message = f'the heading is "{alignment.verdict}", --require-aligned demands "aligned": {alignment.advice}'
    raise fail(message, EXIT_NOT_ALIGNED)


def check_folder(folder: Path) -> None:
    """Refuse a file where -o expects a folder, before the work."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; -o expects a folder for the results")


def run_to_folder(
    config: Config, folder: Path, *, quiet: bool, require_aligned: bool = False
) -> tuple[_core.PreparedFlight, Alignment, _core.Solution]:
    """Read, align, filter, smooth, and write the results into the folder, once everything is computed."""
    check_folder(folder)
    prepared, alignment = align_flight(config, quiet)
    demand_aligned(alignment, require_aligned)
    with ProgressBar("filtering and smoothing", quiet=quiet) as progress:
        solution = _core.process(prepared, alignment.engine, progress, keep_events=True)
    write_results(folder, prepared, alignment, solution)
    write_report(folder, prepared, alignment, solution)
    return prepared, alignment, solution
