"""What the command line prints: the lines of the engine, styled, and tables; plain text when piped."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from liealign import _core
from liealign.comparison import Comparison
from liealign.solution import Alignment

_STYLE = {"aligned": "green", "weak": "yellow", "ambiguous": "red", "unobservable": "red"}
_PIPED_COLUMNS = 200


def console() -> Console:
    """Return a console for stdout; a pipe has no width to fit into."""
    out = Console(highlight=False)
    return out if out.is_terminal else Console(highlight=False, width=_PIPED_COLUMNS)


def say(label: str, text: str, style: str = "") -> None:
    """Print a line under its label."""
    console().print(Text.assemble((f"{label:<9} ", "bold"), (text, style)), soft_wrap=True)


def print_table(table: Table) -> None:
    """Print a table, without blanks at the ends of its lines when piped."""
    out = console()
    if out.is_terminal:
        out.print(table)
        return
    with out.capture() as capture:
        out.print(table)
    for line in capture.get().splitlines():
        print(line.rstrip())


def print_alignment(prepared: _core.PreparedFlight, alignment: Alignment) -> None:
    """Print the heading, its sigma, its time and verdict, and the warnings."""
    _say_lines(_core.alignment_text(prepared, alignment.engine), alignment.verdict)


def print_run(
    prepared: _core.PreparedFlight, alignment: Alignment, solution: _core.Solution, folder: Path
) -> None:
    """Print the verdict, the warnings, what became of the fixes, and how good the trajectory is."""
    _say_lines(_core.run_text(prepared, alignment.engine, solution, str(folder)), alignment.verdict)


def _say_lines(lines: Iterable[tuple[str, str]], verdict: str) -> None:
    styles = {"heading": _STYLE[verdict], "warning": "yellow"}
    for label, text in lines:
        say(label, text, styles.get(label, ""))


def print_comparison(comparison: Comparison) -> None:
    """Print the time compared and the table of errors."""
    c = comparison
    left_out = [
        f"{count} epochs {why} left out"
        for count, why in ((c.epochs_outside, "outside it"), (c.epochs_in_gaps, "in gaps of the truth"))
        if count
    ]
    span = f"{c.begin_time_s:.3f} s to {c.end_time_s:.3f} s, {c.epochs} epochs"
    say("overlap", "; ".join([span, *left_out]))
    table = Table("error", box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in ("mean", "rms", "95 %", "max", "< 1 sigma", "< 2 sigma", "rms/sigma"):
        table.add_column(heading, justify="right", no_wrap=True)
    for e in c.channels:
        shares = [f"{100.0 * s:.1f} %" if s is not None else "" for s in (e.within_1_sigma, e.within_2_sigma)]
        ratio = f"{e.rms_over_sigma:.2f}" if e.rms_over_sigma is not None else ""
        numbers = [f"{number:z.4f}" for number in (e.mean, e.rms, e.p95, e.max)]
        table.add_row(f"{e.name}, {e.unit}", *numbers, *shares, ratio)
    print_table(table)
    if any(e.rms_over_sigma is not None for e in c.channels):
        say("", "rms/sigma is 1 where the stated sigma is true, above 1 where it is too small")
    relative = [
        f"{e.name} {e.rms_relative_sigma:.4f} m" for e in c.channels if e.rms_relative_sigma is not None
    ]
    if relative:
        say("", f"sigma in the receiver's own datum, of another error than these: {', '.join(relative)}")


def print_truth(
    heading: tuple[float, float], smoothed: Comparison, filtered: Comparison | None, folder: Path
) -> None:
    """Print the errors of a simulated flight: true heading and error at the start, rms over the flight."""
    true_heading, error = heading
    say("truth", f"heading {true_heading:.3f} deg at the start; found with an error of {error:+.3f} deg")
    table = Table(f"{'':10}rms error", "smoothed", box=None, pad_edge=False)
    if filtered is not None:
        table.add_column("filter")
    for channel in smoothed.channels:
        row = [f"{'':10}{channel.name}, {channel.unit}", f"{channel.rms:.4f}"]
        table.add_row(*row, *([f"{filtered[channel.name].rms:.4f}"] if filtered is not None else []))
    print_table(table)
    say("flight", f"{folder / 'FLIGHT.toml'}, imu.csv, gnss.csv and truth.csv beside it")
