"""Figures of the motion: map, height, attitude, velocity, biases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from liealign.report import thin
from liealign.report.review import Review
from liealign.report.style import (
    COMPONENTS,
    DASHES,
    INK,
    TRACK,
    Figure,
    Panel,
    Trace,
    band,
    broken_band,
    column,
    dots,
    line,
    plane,
    stack,
)
from liealign.report.verdicts import MARKS
from liealign.solution import Array

_MAP_BINS = 2500  # straight stretches keep about one point a bin, and curves have to stay round
_DEG_H, _MG = math.degrees(1.0) * 3600.0, 1e3 / 9.80665


RPY_SIGMAS = ("sigma of roll", "sigma of pitch", "sigma of heading")
_HEADING_LABEL = {
    "aligned": "heading, deg",
    "weak": "heading, deg",
    "ambiguous": "heading, deg (one of several that explain the flight)",
    "unobservable": "heading, deg (an assumption: the flight does not show it)",
}


def time_title(review: Review) -> str:
    """Return the title of the time axis: the clock of the result files."""
    week = review.summary.get("gps_week")
    return "time, s" if week is None else f"time, s (GPS seconds of week {week})"


def in_time(review: Review, panels: Sequence[Panel]) -> Figure:
    """Put panels on the axis of time that all figures of the page share."""
    begin, end = float(review.solution.time_s[0]), float(review.solution.time_s[-1])
    edge = 0.01 * (end - begin)
    return stack(panels, time_title(review), (begin - edge, end + edge))


def at(review: Review, index: Any) -> dict[str, Any]:
    """Pack the times of some epochs."""
    return column(review.solution.time_s[index], float(review.solution.time_s[0]))


def map_figure(review: Review) -> Figure:
    """Trajectory and fixes, north up, with the heading at the start."""
    north, east = review.north_m, review.east_m
    kept = thin.extremes(np.stack([north, east], axis=1), _MAP_BINS)
    traces: list[Trace] = [*_fixes_on_map(review)]
    path = line(column(east[kept]), north[kept], "trajectory", "m north", TRACK)
    path["hovertemplate"] = "%{x:.2f} m east, %{y:.2f} m north<extra>trajectory</extra>"
    traces.append(path)
    for i, name, symbol, place in _ends(review):
        mark = dots(column(east[i : i + 1 or None]), north[i : i + 1 or None], name, "m north", color=INK)
        mark["mode"] = "markers+text"
        mark["marker"] |= {"symbol": symbol, "size": 11, "line": {"color": "#fff", "width": 1.5}}
        mark |= {"text": [name], "textposition": place, "textfont": {"color": INK, "size": 13}}
        traces.append(mark)
    figure = plane(traces, "east, m", "north, m", 600)
    figure["layout"]["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    if review.alignment.heading_std_deg is not None:
        figure["layout"]["annotations"].append(_heading_arrow(review))
    return figure


def _ends(review: Review) -> list[tuple[int, str, str, str]]:
    """Index, name, symbol and place of the label of both ends: away from the arrow and from each other."""
    psi = math.radians(review.alignment.heading_deg)
    side = "bottom" if math.cos(psi) >= 0.0 else "top"
    start, end = ("left", "right") if math.sin(psi) >= 0.0 else ("right", "left")
    return [(0, "start", "circle", f"{side} {start}"), (-1, "end", "square", f"{side} {end}")]


def _fixes_on_map(review: Review) -> list[Trace]:
    verdict = review.solution.innovations.verdict
    traces = []
    for name, mark in MARKS.items():
        rows = np.flatnonzero(verdict == name)
        if not rows.size:
            continue
        both = np.stack([review.fix_north_m[rows], review.fix_east_m[rows]], axis=1)
        kept = rows[thin.marked(both, mark.ordinary)]
        trace = dots(column(review.fix_east_m[kept]), review.fix_north_m[kept], mark.words, "m", **mark.look)
        trace["hovertemplate"] = f"%{{x:.2f}} m east, %{{y:.2f}} m north<extra>{mark.words}</extra>"
        traces.append(trace)
    return traces


def _heading_arrow(review: Review) -> dict[str, Any]:
    """Return an arrow from the start along the aligned heading, an eighth of the map long."""
    extent = max(float(np.ptp(review.north_m)), float(np.ptp(review.east_m)), 1.0) / 8.0
    psi = math.radians(review.alignment.heading_deg)
    begin = int(np.searchsorted(review.solution.time_s, review.alignment.start_time_s))
    begin = min(begin, len(review.north_m) - 1)
    east, north = float(review.east_m[begin]), float(review.north_m[begin])
    head = {"x": east + extent * math.sin(psi), "y": north + extent * math.cos(psi)}
    tail = {"ax": east, "ay": north, "axref": "x", "ayref": "y", "xref": "x", "yref": "y"}
    return {
        **head,
        **tail,
        "arrowhead": 2,
        "arrowwidth": 2.5,
        "arrowcolor": INK,
        "text": "",
        "showarrow": True,
    }


def height_figure(review: Review) -> Figure:
    """Height of the trajectory and of the fixes."""
    height = review.solution.height_m
    kept = thin.extremes(height)
    traces = _fixes_in_time(review, review.fix_height_m)
    traces.append(line(at(review, kept), height[kept], "trajectory", "m", TRACK))
    return in_time(review, [Panel("height above the ellipsoid, m", traces, px=260)])


def _fixes_in_time(review: Review, values: Array) -> list[Trace]:
    innovations = review.solution.innovations
    traces = []
    for name, mark in MARKS.items():
        rows = np.flatnonzero((innovations.verdict == name) & np.isfinite(innovations.time_s))
        if not rows.size:
            continue
        kept = rows[thin.marked(values[rows], mark.ordinary)]
        x = column(innovations.time_s[kept], float(review.solution.time_s[0]))
        traces.append(dots(x, values[kept], mark.words, "m", **mark.look))
    return traces


def _with_band(review: Review, values: Array, std: Array, name: str, unit: str) -> list[Trace]:
    kept = thin.extremes(values)
    x, y, s = at(review, kept), values[kept], std[kept]
    return [*band(x, y - s, y + s), line(x, y, name, unit)]


def attitude_figure(review: Review) -> Figure:
    """Roll, pitch and heading with their bands, and the sigmas by themselves."""
    rpy, std = review.solution.rpy_deg, review.std_rpy_deg
    panels = [
        Panel("roll, deg", _turning(review, rpy[:, 0], std[:, 0], "roll", (-180.0,))),
        Panel("pitch, deg", _with_band(review, rpy[:, 1], std[:, 1], "pitch", "deg")),
        Panel(
            _HEADING_LABEL[review.alignment.verdict],
            _turning(review, rpy[:, 2], std[:, 2], "heading", (0.0, -180.0)),
        ),
        Panel("one sigma, deg", components(review, std, RPY_SIGMAS, "deg"), scale="log"),
    ]
    return in_time(review, panels)


def _turning(review: Review, angle: Array, std: Array, name: str, lowest: tuple[float, ...]) -> list[Trace]:
    """Return an angle and its band as a line that is broken where it jumps by a turn.

    `lowest` are the ends of the scale to choose from, for the fewest jumps: a heading jumps at north, or at
    south where the vehicle points about north most of the time.
    """
    whole = np.unwrap(angle, period=360.0)
    kept = thin.extremes(whole)
    turns = {low: np.floor((whole[kept] - low) / 360.0) for low in lowest}
    low = min(turns, key=lambda start: int(np.count_nonzero(np.diff(turns[start]))))
    y = whole[kept] - 360.0 * turns[low]
    t, s = review.solution.time_s[kept], std[kept]
    jumps = np.flatnonzero(np.diff(turns[low])) + 1
    t, y, s = np.insert(t, jumps, t[jumps]), np.insert(y, jumps, np.nan), np.insert(s, jumps, np.nan)
    origin = float(review.solution.time_s[0])
    return [broken_band(t, y - s, y + s, origin), line(column(t, origin), y, name, "deg")]


def components(review: Review, values: Array, names: tuple[str, ...], unit: str) -> list[Trace]:
    """Draw the columns of an array as lines of one panel."""
    traces = []
    for i, name in enumerate(names):
        if not np.isfinite(values[:, i]).any():
            continue
        kept = thin.extremes(values[:, i])
        traces.append(line(at(review, kept), values[kept, i], name, unit, COMPONENTS[i], DASHES[i]))
    return traces


def velocity_figure(review: Review) -> Figure:
    """North, east and down velocity with their bands."""
    v, std = review.solution.v_n_mps, review.solution.std_v_n_mps
    panels = [
        Panel(f"{name}, m/s", _with_band(review, v[:, i], std[:, i], name, "m/s"))
        for i, name in enumerate(("north", "east", "down"))
    ]
    return in_time(review, panels)


def gyro_bias_figure(review: Review) -> Figure:
    """Gyro biases with their bands."""
    s = review.solution
    return _bias_figure(review, _DEG_H * s.b_g_rps, _DEG_H * s.std_b_g_rps, "deg/h")


def accel_bias_figure(review: Review) -> Figure:
    """Accelerometer biases with their bands."""
    s = review.solution
    return _bias_figure(review, _MG * s.b_a_mps2, _MG * s.std_b_a_mps2, "mg")


def _bias_figure(review: Review, values: Array, std: Array, unit: str) -> Figure:
    panels = [
        Panel(f"{axis}, {unit}", _with_band(review, values[:, i], std[:, i], axis, unit), px=120)
        for i, axis in enumerate(("forward (x)", "right (y)", "down (z)"))
    ]
    return in_time(review, panels)
