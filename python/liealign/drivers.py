"""The two steps of a run: align the heading, then filter and smooth.

Python proposes, shows progress and stops; the engine computes.
"""

from __future__ import annotations

from os import PathLike, fspath

from liealign import _core
from liealign._core import Cancelled, Flight, HeadingResult, PreparedFlight
from liealign.solution import Alignment, Solution

# Conditional candidates that a search usually takes; only the progress display guesses by it.
_USUAL_CONDITIONAL = 10


def _prepared(flight: Flight | PreparedFlight) -> PreparedFlight:
    return flight if isinstance(flight, PreparedFlight) else _core.prepare_flight(flight)


def search_heading(flight: PreparedFlight, progress: _core.ProgressCallback | None = None) -> HeadingResult:
    """Drive the engine's HeadingSearch to its end, each batch of candidates evaluated as one."""
    search = _core.HeadingSearch(_core.heading_search_options(flight))
    candidates = search.ask()
    done, total = 0, len(candidates) + _USUAL_CONDITIONAL
    while not search.done():
        search.tell(_core.evaluate_candidates(flight, candidates))
        done += len(candidates)
        candidates = search.ask()
        total = max(total, done + len(candidates))
        if progress is not None and progress(done, total) is False:
            raise Cancelled("cancelled")
    return _core.with_clock_of_flight(flight, search.result())


def align_heading(
    flight: Flight | PreparedFlight, progress: _core.ProgressCallback | None = None
) -> Alignment:
    """Find the heading at the start from the flight itself.

    Parameters
    ----------
    flight
        From `read_flight` or `flight_from_arrays`, or prepared by `prepare_flight`.
    progress
        Called as progress(done, total) with the number of candidate filters; returning False cancels.
        The total is a guess and may grow.

    Raises
    ------
    InputError
        When IMU and GNSS do not overlap or the flight does not begin at rest.
    NumericalError
        When the filter fails from every heading.
    Cancelled
        When `progress` returned False.
    """
    prepared = _prepared(flight)
    return Alignment.from_engine(prepared, search_heading(prepared, progress))


def process(
    flight: Flight | PreparedFlight,
    alignment: Alignment | None = None,
    progress: _core.ProgressCallback | None = None,
    *,
    keep_events: bool = True,
) -> Solution:
    """Filter and smooth the flight from the aligned heading.

    Parameters
    ----------
    flight
        As for `align_heading`; with an alignment, the same flight that it came from.
    alignment
        From `align_heading`; without it, made here.
    progress
        Called as progress(done, total) now and then; returning False cancels.
    keep_events
        Keep the filter's and the smoother's states at the fixes, which `write_report` compares. They are few;
        False saves their memory where no report is wanted.

    Raises
    ------
    InputError, NumericalError, Cancelled
        As `align_heading`.
    """
    prepared = _prepared(flight)
    heading = alignment.engine if alignment is not None else search_heading(prepared)
    return Solution.from_engine(prepared, heading, _core.process(prepared, heading, progress, keep_events))


def write_results(
    folder: str | PathLike[str],
    flight: Flight | PreparedFlight,
    alignment: Alignment,
    solution: Solution | _core.Solution,
) -> None:
    """Write the result files of a run into a folder, which is made if need be; see docs/formats.md.

    The file names in its config.toml are relative to the folder, so that it runs again from there.

    Raises
    ------
    InputError
        When a file cannot be written.
    """
    prepared = _prepared(flight)
    engine = solution.engine if isinstance(solution, Solution) else solution
    _core.write_results(fspath(folder), prepared, alignment.engine, engine)
