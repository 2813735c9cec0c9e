"""Figures of the fixes: residuals with their bounds, and the normalised innovation squared."""

from __future__ import annotations

from typing import Any

import numpy as np

from liealign.report import thin
from liealign.report.motion import in_time
from liealign.report.review import Residuals, Review, chi_square_3
from liealign.report.style import ALERT, GREY, Figure, Panel, Trace, band, column, dots, level
from liealign.report.verdicts import MARKS
from liealign.solution import Array

_AXES = ("north", "east", "down")
_LOWEST_NIS = 1e-3  # a log axis has no zero
_ROOM = 6.0  # an axis goes no further than so many times what nearly all residuals stay in


def nis_threshold(review: Review) -> float:
    """Return the NIS beyond which a fix counts as an outlier, before the gate is opened."""
    return chi_square_3(float(review.config["gnss.outlier_probability"]))


def residual_figure(review: Review, residuals: Residuals) -> Figure:
    """North, east and down residual of each fix over bands of one and three sigma."""
    origin = float(review.solution.time_s[0])
    panels = []
    for i, axis in enumerate(_AXES):
        res, std = residuals.res_n[:, i], residuals.std_n[:, i]
        reach = axis_reach(res, std)
        traces = [*_sigma_bands(residuals.time_s, std, origin, 3.0, 0.08)]
        traces += _sigma_bands(residuals.time_s, std, origin, 1.0, 0.14)
        traces += _by_verdict(residuals, i, origin, reach)
        panels.append(Panel(f"{axis}, {residuals.unit}", traces, bounds=(-reach, reach), px=170))
    return in_time(review, panels)


def axis_reach(res: Array, std: Array) -> float:
    """Return half the height of an axis: everything, unless a few residuals would press the rest flat."""
    ordinary = float(max(np.quantile(np.abs(res), 0.98), 3.0 * np.quantile(std, 0.5)))
    largest = float(np.max(np.abs(res)))
    return 1.08 * max(min(largest, _ROOM * ordinary), min(3.0 * float(np.max(std)), ordinary))


def _sigma_bands(time: Array, std: Array, origin: float, sigmas: float, opacity: float) -> list[Trace]:
    kept = thin.extremes(std)
    half = sigmas * std[kept]
    return band(column(time[kept], origin), -half, half, opacity, GREY)


def _by_verdict(residuals: Residuals, axis: int, origin: float, reach: float) -> list[Trace]:
    """Draw the markers; those beyond the axis stand at its edge as arrows that know their value."""
    traces = []
    values = residuals.res_n[:, axis]
    for name, mark in MARKS.items():
        rows = np.flatnonzero(residuals.verdict == name)
        if not rows.size:
            continue
        words = f"{_AXES[axis]}, {mark.words}"
        kept = rows[thin.marked(values[rows], mark.ordinary)]
        inside = kept[np.abs(values[kept]) <= reach]
        beyond = kept[np.abs(values[kept]) > reach]
        x = column(residuals.time_s[inside], origin)
        traces.append(dots(x, values[inside], words, residuals.unit, **mark.look))
        if beyond.size:
            traces.append(_arrows(residuals.time_s[beyond], values[beyond], reach, origin, words, mark.color))
    return traces


def _arrows(time: Array, values: Array, reach: float, origin: float, words: str, color: str) -> Trace:
    edge = np.sign(values) * reach * 0.96
    trace: dict[str, Any] = dots(column(time, origin), edge, words, "", color=color, size=10)
    trace["marker"]["symbol"] = ["arrow-up" if value > 0 else "arrow-down" for value in values]
    trace["text"] = [f"{value:.4g}" for value in values]
    trace["hovertemplate"] = f"%{{text}}, beyond the axis<extra>{words}</extra>"
    return trace


def nis_figure(review: Review, residuals: Residuals) -> Figure:
    """NIS of each fix with the threshold of the outlier test, as asked for and as opened for this flight."""
    origin = float(review.solution.time_s[0])
    nis = np.maximum(residuals.nis, _LOWEST_NIS)
    traces = []
    for name, mark in MARKS.items():
        rows = np.flatnonzero(residuals.verdict == name)
        if rows.size:
            kept = rows[thin.marked(nis[rows], mark.ordinary)]
            x = column(residuals.time_s[kept], origin)
            traces.append(dots(x, nis[kept], mark.words, "NIS", **mark.look))
    threshold = nis_threshold(review)
    lines = [level(3.0, GREY, "dot"), level(threshold, ALERT, "dash")]
    if residuals.gate_scale > 1.1:
        lines.append(level(threshold * residuals.gate_scale, ALERT, "solid"))
    panel = Panel("normalised innovation squared, no unit (log)", traces, scale="log", lines=lines, px=250)
    return in_time(review, [panel])
