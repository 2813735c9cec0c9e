"""What the command line prints: the verdict first, then what a user would check; plain text when piped."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from liealign import _core
from liealign.solution import Alignment, Array, Solution, Trajectory

_STYLE = {"aligned": "green", "weak": "yellow", "ambiguous": "red", "unobservable": "red"}
_NOT_USED = ("fixes_averaged_at_rest", "fixes_quality_not_accepted", "fixes_outside_imu")


def _say(label: str, text: str, style: str = "") -> None:
    line = Text.assemble((f"{label:<9} ", "bold"), (text, style))
    Console(highlight=False).print(line, soft_wrap=True)


def print_alignment(alignment: Alignment) -> None:
    """Print the heading, its sigma, its time and verdict, and the warnings."""
    std = alignment.heading_std_deg
    heading = f"{alignment.heading_deg:.3f} deg" if std is not None else "not determined"
    sigma = f", sigma {std:.3f} deg" if std is not None else ""
    verdict = f"{alignment.verdict}: {heading}{sigma}, at {alignment.start_time_s:.3f} s"
    _say("heading", verdict, _STYLE[alignment.verdict])
    if alignment.verdict != "aligned":
        _say("", alignment.advice)
    for warning in alignment.warnings:
        _say("warning", warning, "yellow")


def print_run(
    prepared: _core.PreparedFlight, alignment: Alignment, solution: _core.Solution, folder: Path
) -> None:
    """Print the verdict, the warnings, what became of the fixes, and how good the trajectory is."""
    print_alignment(alignment)
    s = json.loads(_core.summary_json(prepared, alignment.engine, solution))
    parts = [f"{s[f'fixes_{word}']} {word}" for word in ("used", "weighted", "rejected", "reacquired")]
    parts += [
        f"{s[key]} {key.removeprefix('fixes_').replace('_', ' ').replace('imu', 'the IMU log')}"
        for key in _NOT_USED
        if s[key]
    ]
    _say("fixes", f"{s['fixes']}: {', '.join(parts)}")
    if s["p_rms_m"] is not None:
        _say("P_RMS", f"{s['p_rms_m']:.3f} m, of the position innovations")
    _say(
        "sigma",
        f"median {s['median_std_horizontal_m']:.3f} m horizontal, {s['median_std_down_m']:.3f} m vertical, "
        f"{s['median_std_roll_deg']:.3f} deg roll, {s['median_std_pitch_deg']:.3f} deg pitch, "
        f"{s['median_std_heading_deg']:.3f} deg heading",
    )
    _say("span", f"{s['begin_time_s']:.3f} s to {s['end_time_s']:.3f} s, {s['epochs']} epochs")
    trajectory = f"trajectory.{_core.config_entries(prepared.config)['output.formats'][0]}"
    _say("results", f"{folder / trajectory}, summary.json and the other files beside it")


def print_truth(
    simulated: _core.SimulatedFlight,
    prepared: _core.PreparedFlight,
    alignment: Alignment,
    solution: _core.Solution,
    folder: Path,
) -> None:
    """Print the errors of a simulated flight: the heading at the start, and rms over the flight."""
    truth = simulated.truth()
    smoothed = Solution.from_engine(prepared, alignment.engine, solution)
    at_start = int(np.argmin(np.abs(truth["time_s"] - alignment.start_time_s)))
    true_heading = float(truth["rpy_deg"][at_start, 2])
    error = _wrap_deg(np.array(alignment.heading_deg - true_heading))
    _say(
        "truth",
        f"heading {true_heading:.3f} deg at the start; found with an error of {float(error):+.3f} deg",
    )
    table = Table("          rms error", "smoothed", "filter", box=None, pad_edge=False)
    names = ("horizontal, m", "vertical, m", "velocity, m/s", "roll, deg", "pitch, deg", "heading, deg")
    of_filter = (
        rms_errors(smoothed.filtered, truth) if smoothed.filtered is not None else [np.nan] * len(names)
    )
    for name, s, f in zip(names, rms_errors(smoothed, truth), of_filter, strict=True):
        table.add_row(f"{'':10}{name}", f"{s:.4f}", f"{f:.4f}")
    Console(highlight=False).print(table)
    _say("flight", f"{folder / 'FLIGHT.toml'}, imu.csv, gnss.csv and truth.csv beside it")


def rms_errors(found: Trajectory, truth: _core.TruthColumns) -> list[float]:
    """Root mean square over the epochs of `found`.

    Horizontal and vertical position [m], velocity [m/s], roll, pitch and heading [deg]. The truth must have
    an epoch at each time of `found`.
    """
    at = np.searchsorted(truth["time_s"], found.time_s - 1e-6)
    lat, lon = np.deg2rad(truth["lat_deg"][at]), np.deg2rad(truth["lon_deg"][at])
    up_e = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
    position = found.p_eb_e_m - truth["p_eb_e_m"][at]
    vertical = (position * up_e).sum(axis=1)
    horizontal = position - vertical[:, np.newaxis] * up_e
    attitude = _wrap_deg(found.rpy_deg - truth["rpy_deg"][at])
    columns = [horizontal, vertical, found.v_n_mps - truth["v_n_mps"][at], *attitude.T]
    return [float(np.sqrt((column**2).sum() / found.time_s.size)) for column in columns]


def _wrap_deg(angle: Array) -> Array:
    wrapped: Array = (angle + 180.0) % 360.0 - 180.0
    return wrapped
