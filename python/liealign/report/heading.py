"""How the heading was found: the parabola with its 95 % interval, and the search over the circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from liealign.report.review import Review
from liealign.report.style import ACCENT, GREY, INK, WARM, Figure, column, dots, level, line, plane
from liealign.solution import Alignment, Array

SIGMAS_95 = 1.959963984540054
_RIVAL = float(np.log(100.0))  # cost above the lowest at which a heading is 1 % as probable
_LOWEST_COST = 0.1  # a log axis has no zero
_FAR = 40.0  # sigmas: an open minimum further away than this would press the parabola flat


@dataclass(frozen=True, eq=False)
class Curve:
    """Conditional candidates: degrees from the heading found, and cost above the minimum."""

    offset_deg: Array
    cost: Array


def _offsets(alignment: Alignment, headings: Array) -> Array:
    offset: Array = (headings - alignment.heading_deg + 180.0) % 360.0 - 180.0
    return offset


def sampled_curve(alignment: Alignment) -> Curve:
    """Return the posterior as sampled: costs above the minimum, other parameters at their best."""
    density = alignment.density_per_deg
    seen = density > 0.0
    offset, cost = _offsets(alignment, alignment.density_heading_deg[seen]), -np.log(density[seen])
    order = np.argsort(offset, kind="stable")
    return Curve(offset[order], cost[order] - cost.min())


def open_curve(alignment: Alignment) -> Curve:
    """Return the candidates that took every fix in full; they have a minimum of their own.

    None where latency or noise were searched as well: those differ in more than the heading.
    """
    return _curve(alignment, ~alignment.curve_gated & bool(alignment.curve_gated.any()))


def _curve(alignment: Alignment, wanted: NDArray[np.bool_]) -> Curve:
    rows = (alignment.curve_heading_std_deg == 0.0) & wanted & np.isfinite(alignment.curve_cost)
    offset, cost = _offsets(alignment, alignment.curve_heading_deg[rows]), alignment.curve_cost[rows]
    order = np.argsort(offset, kind="stable")
    cost = cost[order]
    return Curve(offset[order], cost - cost.min() if cost.size else cost)


def _triple(alignment: Alignment) -> Curve:
    offset, cost = _offsets(alignment, alignment.triple_heading_deg), alignment.triple_cost
    return Curve(offset, cost - cost.min() if cost.size else cost)


def parabola(alignment: Alignment, offset_deg: Array) -> Array:
    """Cost (psi - psi*)^2 / (2 sigma^2) above the minimum, which a Gaussian heading has."""
    assert alignment.heading_std_deg is not None
    cost: Array = offset_deg**2 / (2.0 * alignment.heading_std_deg**2)
    return cost


def open_minimum(alignment: Alignment) -> float | None:
    """Return the offset [deg] of the best heading when no fix is taken for an outlier."""
    curve = open_curve(alignment)
    return float(curve.offset_deg[np.argmin(curve.cost)]) if curve.cost.size else None


def curve_figure(review: Review) -> Figure:
    """Draw the posterior around the minimum (DRONES Fig. 4); with a sigma, parabola and interval."""
    alignment = review.alignment
    sampled, free = sampled_curve(alignment), open_curve(alignment)
    traces = []
    psi, sigma = alignment.heading_deg, alignment.heading_std_deg
    if sigma is not None:
        width = 4.6 * sigma
        x = np.linspace(-width, width, 121)
        traces.append(line(column(psi + x, psi), parabola(alignment, x), "parabola", "", GREY))
    for curve, name, color, symbol in (
        (free, "every fix in full", WARM, "triangle-up-open"),
        (sampled, "candidates", ACCENT, "circle"),
        (_triple(alignment), "three points of the parabola", INK, "diamond-open"),
    ):
        trace = dots(
            column(psi + curve.offset_deg, psi), curve.cost, name, "", color=color, symbol=symbol, size=9
        )
        trace["hovertemplate"] = f"%{{x:.4f}} deg, cost %{{y:.3f}}<extra>{name}</extra>"
        traces.append(trace)
    figure = plane(traces, "heading at the start, deg", "cost above the minimum, no unit", 340)
    if sigma is not None:
        figure["layout"]["xaxis"]["range"] = _heading_range(alignment, sigma)
        figure["layout"]["yaxis"]["range"] = [-0.5, 11.0]
        figure["layout"]["shapes"] = [_interval(review), _vertical(psi, INK)]
    return figure


def _heading_range(alignment: Alignment, sigma: float) -> list[float]:
    low, high = -4.8 * sigma, 4.8 * sigma
    free = open_minimum(alignment)
    if free is not None and abs(free) < _FAR * sigma:
        low, high = min(low, free - 2.0 * sigma), max(high, free + 2.0 * sigma)
    return [alignment.heading_deg + low, alignment.heading_deg + high]


def _interval(review: Review) -> dict[str, object]:
    """Return the 95 % interval as the engine states it, on an axis that runs on through north."""
    low, high = review.facts["heading_95_deg"]
    psi = review.alignment.heading_deg
    x0, x1 = (psi + float(x) for x in _offsets(review.alignment, np.array([low, high])))
    box = {"type": "rect", "xref": "x", "yref": "paper", "x0": x0, "x1": x1, "y0": 0, "y1": 1}
    return {**box, "fillcolor": "rgba(11,98,168,0.12)", "line": {"width": 0}, "layer": "below"}


def _vertical(x: float, color: str, dash: str = "solid") -> dict[str, object]:
    ends = {"type": "line", "xref": "x", "yref": "paper", "x0": x, "x1": x, "y0": 0, "y1": 1}
    return {**ends, "line": {"color": color, "width": 1.2, "dash": dash}}


def circle_figure(review: Review) -> Figure | None:
    """Draw the candidates of the circle search with the modes; None when a typed-in heading replaced it."""
    alignment = review.alignment
    rows = (alignment.curve_heading_std_deg > 0.0) & np.isfinite(alignment.curve_cost)
    if np.count_nonzero(rows) < 3:
        return None
    heading, cost = alignment.curve_heading_deg[rows], alignment.curve_cost[rows]
    cost = np.maximum(cost - cost.min(), _LOWEST_COST)
    order = np.argsort(heading)
    trace = line(column(heading[order]), cost[order], "candidate", "")
    trace |= {"mode": "lines+markers", "marker": {"size": 6}}
    trace["hovertemplate"] = "%{x:.0f} deg, cost %{y:.4~g}<extra>candidate</extra>"
    sampled = sampled_curve(alignment)
    order = np.argsort((alignment.heading_deg + sampled.offset_deg) % 360.0)
    conditional = line(
        column(((alignment.heading_deg + sampled.offset_deg) % 360.0)[order]),
        np.maximum(sampled.cost, _LOWEST_COST)[order],
        "posterior",
        "",
        ACCENT,
    )
    conditional["hovertemplate"] = "%{x:.2f} deg, cost %{y:.4~g}<extra>posterior</extra>"
    trace["name"] = "wide candidates"
    figure = plane(
        [trace, conditional], "heading at the start, deg", "cost above the lowest, no unit (log)", 340
    )
    figure["layout"]["yaxis"] |= {"type": "log", "dtick": 1, "tickformat": "~g"}
    figure["layout"]["xaxis"] |= {"range": [-5, 365], "tickvals": list(range(0, 361, 45))}
    figure["layout"]["shapes"] = [level(_RIVAL, WARM)]
    for mode, mass in zip(alignment.mode_heading_deg, alignment.mode_mass, strict=True):
        if mass > 0.001 and alignment.verdict != "unobservable":
            figure["layout"]["shapes"].append(_vertical(float(mode), GREY, "dot"))
    if alignment.heading_std_deg is not None:
        figure["layout"]["shapes"].append(_vertical(alignment.heading_deg, INK))
    return figure
