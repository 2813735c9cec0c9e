"""Figures of the accuracy: filter against smoother, and the stated standard deviations over time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from liealign.frames import ned_rows
from liealign.report import thin
from liealign.report.motion import RPY_SIGMAS, components, in_time
from liealign.report.review import Review
from liealign.report.style import Figure, Panel, band, column, line
from liealign.solution import Array, Trajectory

_NED = ("north", "east", "down")


@dataclass(frozen=True, eq=False)
class Difference:
    """Filter minus smoother of one quantity at the fixes and rest updates, and the filter's sigma, (k, 3)."""

    of: str
    unit: str
    names: tuple[str, str, str]
    value: Array = field(repr=False)
    std: Array = field(repr=False)

    @property
    def within(self) -> float:
        """Share of the components inside one sigma of the filter."""
        seen = np.isfinite(self.std)
        return float(np.mean(np.abs(self.value[seen]) <= self.std[seen]))


def differences(review: Review) -> list[Difference]:
    """Position NED, velocity NED, and roll, pitch, heading; empty where the run kept no filter states."""
    filtered, smoothed = review.filtered, review.smoothed
    if filtered is None or smoothed is None:
        return []
    C_e_n = ned_rows(smoothed.lat_deg, smoothed.lon_deg)
    position = np.einsum("kij,kj->ki", C_e_n, filtered.p_eb_e_m - smoothed.p_eb_e_m)
    attitude = (filtered.rpy_deg - smoothed.rpy_deg + 180.0) % 360.0 - 180.0
    std_rpy = filtered.std_rpy_deg.copy()
    if not review.states_heading:
        std_rpy[:, 2] = np.nan
    return [
        Difference("position", "m", _NED, position, filtered.std_p_n_m),
        Difference("velocity", "m/s", _NED, filtered.v_n_mps - smoothed.v_n_mps, filtered.std_v_n_mps),
        Difference("attitude", "deg", ("roll", "pitch", "heading"), attitude, std_rpy),
    ]


def difference_figure(review: Review, filtered: Trajectory, difference: Difference) -> Figure:
    """Three differences over the band of one sigma of the filter."""
    origin = float(review.solution.time_s[0])
    panels = []
    for i, name in enumerate(difference.names):
        value, std = difference.value[:, i], difference.std[:, i]
        kept = thin.extremes(np.stack([value, std], axis=1))
        x = column(filtered.time_s[kept], origin)
        traces = [*band(x, -std[kept], std[kept]), line(x, value[kept], name, difference.unit)]
        panels.append(Panel(f"{name}, {difference.unit}", traces, bounds=_bounds(value, std), px=120))
    return in_time(review, panels)


def _bounds(value: Array, std: Array) -> tuple[float, float]:
    """Show all differences, and as much of the band as leaves them to be seen.

    The sigma with which the filter starts is often far above any difference.
    """
    usual = float(np.nanquantile(std, 0.9)) if np.isfinite(std).any() else 0.0
    reach = 1.1 * max(float(np.abs(value).max()), 1.2 * usual, 1e-9)
    return -reach, reach


def sigma_figure(review: Review) -> Figure:
    """Stated sigmas of position, velocity and attitude, each on a log axis."""
    s = review.solution
    position = [Panel("position, m", components(review, s.std_p_n_m, _NED, "m"), scale="log")]
    if review.receiver is not None:
        relative = components(review, s.relative_std_p_n_m, _NED, "m")
        position = [
            replace(position[0], label="position against the Earth, m"),
            Panel("position in the receiver's own datum, m (what blurs an image)", relative, scale="log"),
        ]
    panels = [
        *position,
        Panel("velocity, m/s", components(review, s.std_v_n_mps, _NED, "m/s"), scale="log"),
        Panel(
            "attitude, deg",
            components(review, review.std_rpy_deg, RPY_SIGMAS, "deg"),
            scale="log",
        ),
    ]
    return in_time(review, panels)
