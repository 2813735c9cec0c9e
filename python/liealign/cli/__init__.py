"""The command line: `liealign run | align | compare | config | imus | simulate | demo | montecarlo`.

Flags, files and exit codes are a contract. Exit codes: 0 done; 1 bad input (one line on stderr); 2 usage;
3 numerical failure; 4 heading not aligned where --require-aligned demands it; 130 interrupted.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import liealign
from liealign.cli.compare import compare
from liealign.cli.config import config
from liealign.cli.flags import FLAGS, join_words
from liealign.cli.imus import imus
from liealign.cli.knobs import KNOBS
from liealign.cli.montecarlo import montecarlo
from liealign.cli.run import align, run
from liealign.cli.simulate import demo, simulate
from liealign.cli.work import EXIT_INTERRUPTED, run_to_folder

__all__ = ["FLAGS", "app", "join_words", "main", "run_to_folder"]

app = typer.Typer(
    name="liealign",
    help="Heading alignment and smoothed GNSS/INS trajectories for drones with one antenna.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)
for command in (run, align, compare, config, imus, simulate, demo, montecarlo):
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    print(f"liealign {liealign.__version__}")
    print(f"OpenMP: {'yes' if liealign.has_openmp else 'absent'}")
    print(f"Ceres: {'yes' if liealign.has_ceres else 'absent'}")
    print("liealign-post: the standalone executable is not part of this build")
    raise typer.Exit


@app.callback()
def _top(
    version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Version and what is built in."
        ),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; the entry point of the console script."""
    try:
        app(args=join_words(sys.argv[1:], (*FLAGS.values(), *KNOBS)), prog_name="liealign")
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
