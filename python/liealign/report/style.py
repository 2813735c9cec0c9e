"""The look of the figures, and plain dictionaries for plotly.js: columns, lines, bands, dots, stacked panels.

Numbers travel as base64 of float32 with an offset, a third of their size as text; page.js unpacks them.
Colours are told apart with any colour vision, and symbols say the same as they do.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from liealign.solution import Array

Figure = dict[str, Any]
Trace = dict[str, Any]

ACCENT, WARM, GREY, INK, GRID = "#0b62a8", "#d97a00", "#7b8894", "#1d2a36", "#e4e9ee"
ALERT, VIOLET, PALE, TRACK = "#b93a0a", "#7d3c98", "#5ea3d6", "#0a3a63"
COMPONENTS = (ACCENT, WARM, GREY)  # of a vector, in one panel
DASHES = ("solid", "solid", "dot")

_PANEL_PX, _GAP_PX, _TOP_PX, _BOTTOM_PX = 150, 40, 26, 46


def column(values: Array, offset: float = 0.0) -> dict[str, Any]:
    """Pack numbers as float32 of values - offset; NaN is a gap."""
    packed = (np.asarray(values, dtype=np.float64) - offset).astype("<f4").tobytes()
    return {"f32": base64.b64encode(packed).decode("ascii"), "from": offset}


def unpacked(packed: dict[str, Any]) -> Array:
    """Return the numbers of a column."""
    return np.frombuffer(base64.b64decode(packed["f32"]), dtype="<f4") + float(packed["from"])


def line(x: Any, y: Array, name: str, unit: str, color: str = ACCENT, dash: str = "solid") -> Trace:
    """Return a line whose hover text has its name and unit."""
    return {
        "x": x,
        "y": column(y),
        "name": name,
        "mode": "lines",
        "line": {"color": color, "width": 1.4, "dash": dash},
        "hovertemplate": f"%{{y:.4~g}} {unit}<extra>{name}</extra>",
    }


def band(x: Any, low: Array, high: Array, opacity: float = 0.18, color: str = ACCENT) -> list[Trace]:
    """Return the area between two curves."""
    bare = {"x": x, "mode": "lines", "line": {"width": 0, "color": color}, "hoverinfo": "skip"}
    fill = {"fill": "tonexty", "fillcolor": _faint(color, opacity)}
    return [{**bare, "y": column(low)}, {**bare, **fill, "y": column(high)}]


def broken_band(x: Array, low: Array, high: Array, origin: float, opacity: float = 0.18) -> Trace:
    """Return the area between two curves that NaN breaks into pieces, each of them a polygon."""
    there = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    pieces = np.split(np.arange(x.size), np.flatnonzero(~there))
    gap = np.array([np.nan])
    xs: list[Array] = []
    ys: list[Array] = []
    for piece in (rows[there[rows]] for rows in pieces):
        xs += [x[piece], x[piece][::-1], gap]
        ys += [low[piece], high[piece][::-1], gap]
    look = {"mode": "lines", "line": {"width": 0, "color": ACCENT}, "hoverinfo": "skip"}
    fill = {"fill": "toself", "fillcolor": _faint(ACCENT, opacity)}
    return {**look, **fill, "x": column(np.concatenate(xs), origin), "y": column(np.concatenate(ys))}


def _faint(color: str, opacity: float) -> str:
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def dots(
    x: Any, y: Array, name: str, unit: str, *, color: str, symbol: str = "circle", size: float = 5
) -> Trace:
    """Return markers whose hover text has their name and unit."""
    return {
        "x": x,
        "y": column(y),
        "name": name,
        "mode": "markers",
        "marker": {"color": color, "symbol": symbol, "size": size},
        "hovertemplate": f"%{{y:.4~g}} {unit}<extra>{name}</extra>",
    }


def pooled(figures: dict[str, Figure]) -> dict[str, Any]:
    """Return the figures with each packed column once: a band and its line share their times."""
    columns: dict[str, int] = {}

    def of(value: Any) -> Any:
        if isinstance(value, dict):
            if "f32" in value:
                return {"column": columns.setdefault(value["f32"], len(columns)), "from": value["from"]}
            return {name: of(inner) for name, inner in value.items()}
        return [of(inner) for inner in value] if isinstance(value, list) else value

    return {"figures": of(figures), "columns": list(columns)}


@dataclass(frozen=True)
class Panel:
    """One pair of axes: its label with the unit, what it shows, and how."""

    label: str
    traces: list[Trace]
    scale: Literal["linear", "log"] = "linear"
    bounds: tuple[float, float] | None = None  # of the axis; of a log axis its exponents
    lines: list[dict[str, Any]] = field(default_factory=list)  # horizontal lines of layout.shapes
    px: int = _PANEL_PX


def level(y: float, color: str = GREY, dash: str = "dash") -> dict[str, Any]:
    """Return a horizontal line over the whole width."""
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": y,
        "y1": y,
        "line": {"color": color, "width": 1.2, "dash": dash},
    }


def _label(text: str, top: float) -> dict[str, Any]:
    """Return the label of an axis: above it, where it reads without turning the head and costs no width."""
    place = {"xref": "paper", "yref": "paper", "x": 0, "y": top, "xanchor": "left", "yanchor": "bottom"}
    return {**place, "text": text, "showarrow": False, "yshift": 3, "font": {"size": 12.5, "color": INK}}


def _layout(height: int) -> Figure:
    return {
        "height": height,
        "margin": {"l": 56, "r": 14, "t": _TOP_PX, "b": _BOTTOM_PX},
        "font": {
            "family": "system-ui, 'Segoe UI', Roboto, Arial, sans-serif",
            "size": 12,
            "color": "#44525f",
        },
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "#ffffff",
        "showlegend": False,
        "hovermode": "x unified",
        "hoversubplots": "axis",
        "hoverlabel": {"font": {"size": 12}, "bgcolor": "rgba(255,255,255,0.96)", "bordercolor": "#b4c0ca"},
        "modebar": {"bgcolor": "rgba(255,255,255,0)", "color": "#9aa7b2", "activecolor": ACCENT},
        "shapes": [],
        "annotations": [],
    }


def _axis(**more: Any) -> Figure:
    look = {"gridcolor": GRID, "zerolinecolor": "#c4ced6", "linecolor": "#b4c0ca", "showline": True}
    return {
        **look,
        "exponentformat": "none",
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#b4c0ca",
        **more,
    }


def _log_axis(panel: Panel) -> Figure:
    """Return a log axis, its ticks by its decades; within a small part of one, a linear axis."""
    values = np.concatenate([unpacked(trace["y"]) for trace in panel.traces] or [np.ones(1)])
    values = values[np.isfinite(values) & (values > 0.0)]
    ratio = float(values.max() / values.min()) if values.size else 1.0
    if ratio < 3.0 and not panel.lines and panel.bounds is None:
        return {"type": "linear", "rangemode": "tozero"}
    return {"tickformat": "~g", "dtick": 1 if ratio > 60.0 else "D2" if ratio > 10.0 else "D1"}


def stack(panels: Sequence[Panel], x_title: str, x_range: Sequence[float]) -> Figure:
    """Put panels below each other on one common axis of time."""
    inner = sum(panel.px for panel in panels) + _GAP_PX * (len(panels) - 1)
    layout = _layout(inner + _TOP_PX + _BOTTOM_PX)
    traces: list[Trace] = []
    top = inner
    for i, panel in enumerate(panels):
        y = "y" if i == 0 else f"y{i + 1}"
        axis = _axis(domain=[(top - panel.px) / inner, top / inner], type=panel.scale, nticks=6)
        if panel.scale == "log":
            axis |= _log_axis(panel)
        if panel.bounds:
            axis["range"] = list(panel.bounds)
        layout[f"yaxis{i + 1}" if i else "yaxis"] = axis
        layout["annotations"].append(_label(panel.label, top / inner))
        layout["shapes"] += [{**line, "yref": y} for line in panel.lines]
        traces += [{**trace, "xaxis": "x", "yaxis": y} for trace in panel.traces]
        top -= panel.px + _GAP_PX
    last = "y" if len(panels) == 1 else f"y{len(panels)}"
    layout["xaxis"] = _axis(title={"text": x_title, "standoff": 8}, anchor=last, nticks=9, hoverformat=".2f")
    layout["xaxis"]["range"] = list(x_range)
    return {"data": traces, "layout": layout}


def plane(traces: list[Trace], x_title: str, label: str, height: int) -> Figure:
    """Return one pair of axes that is no time series; hovering takes the nearest point."""
    layout = _layout(height) | {"hovermode": "closest"}
    layout["xaxis"] = _axis(title={"text": x_title, "standoff": 8}, nticks=8)
    layout["yaxis"] = _axis(nticks=7)
    layout["annotations"] = [_label(label, 1.0)]
    return {"data": traces, "layout": layout}
