"""report.html: one offline page that shows a run as a survey analyst checks it, the verdict first."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from liealign import _core
from liealign._core import Flight, InputError, PreparedFlight
from liealign.solution import Alignment, Solution

__all__ = ["report_html", "write_report"]


def report_html(
    flight: Flight | PreparedFlight, alignment: Alignment, solution: Solution | _core.Solution
) -> str:
    """Return the report of a run as one HTML page that needs no network.

    Parameters
    ----------
    flight, alignment, solution
        As for `write_results`. The filter is compared with the smoother where the solution was made with
        keep_events.
    """
    # Here, because plotly takes a moment that no other use of the package should wait for.
    from plotly.offline import get_plotlyjs

    from liealign.report.page import render
    from liealign.report.review import make_review

    prepared = flight if isinstance(flight, PreparedFlight) else _core.prepare_flight(flight)
    return render(make_review(prepared, alignment, solution), str(get_plotlyjs()))


def write_report(
    folder: str | PathLike[str],
    flight: Flight | PreparedFlight,
    alignment: Alignment,
    solution: Solution | _core.Solution,
) -> None:
    """Write report.html into a folder, which is made if need be.

    `write_results` removes the report of an earlier run, so write the report after the results.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    page = report_html(flight, alignment, solution)
    path = Path(folder) / "report.html"
    part = path.with_name("report.html.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(page, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise InputError(f"{error.filename or path}: cannot be written: {error.strerror or error}") from None
