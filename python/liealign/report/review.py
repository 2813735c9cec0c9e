"""What the report looks at: the run as arrays, local coordinates, statistics of the residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from liealign import _core
from liealign.frames import ned_rows
from liealign.solution import Alignment, Array, Receiver, Solution, Trajectory

UPDATES = ("used", "weighted", "rejected", "reacquired")
# Of a chi-square variable with three degrees of freedom.
NIS_MEDIAN, NIS_90 = 2.366, 6.251
_KNOWS_NOTHING = 30.0  # a residual's sigma, in usual ones, from which on it is no residual


@dataclass(frozen=True, eq=False)
class Residuals:
    """Innovations of the position or of the velocity, of the fixes that were updates.

    Attributes
    ----------
    of, unit
        "position" or "velocity", and m or m/s.
    time_s, res_n, std_n, nis, verdict
        (k,), vectors (k, 3), NED.
    gate_scale
        Factor by which the chi-square threshold was opened.
    """

    of: str
    unit: str
    gate_scale: float
    time_s: Array = field(repr=False)
    res_n: Array = field(repr=False)
    std_n: Array = field(repr=False)
    nis: Array = field(repr=False)
    verdict: NDArray[np.str_] = field(repr=False)

    @property
    def normalized(self) -> Array:
        """Residuals in their standard deviations, (k, 3)."""
        ratio: Array = self.res_n / self.std_n
        return ratio

    def within(self, sigmas: float) -> float:
        """Share of all components inside so many standard deviations."""
        return float(np.mean(np.abs(self.normalized) <= sigmas))

    @property
    def size_ratio(self) -> float:
        """How many times larger than stated a usual residual is, by the median: outliers do not count."""
        return math.sqrt(float(np.median(self.nis)) / NIS_MEDIAN)

    @property
    def correlation(self) -> float | None:
        """Correlation of normalised residuals of neighbouring fixes; None for too few fixes to say."""
        if self.nis.size < 30:
            return None
        z = np.clip(self.normalized - np.median(self.normalized, axis=0), -5.0, 5.0)
        return float((z[1:] * z[:-1]).sum() / max(float((z * z).sum()), 1e-300))

    @property
    def tail_ratio(self) -> float:
        """The same at the 90 % point: the rough moments of the flight."""
        return math.sqrt(float(np.quantile(self.nis, 0.9)) / NIS_90)


@dataclass(frozen=True, eq=False)
class Review:
    """One run, in the coordinates of the figures: metres north and east of the first epoch.

    `filtered` and `smoothed` are the states of the IMU after each fix and rest update, None where the run did
    not keep them. Heading sigmas are NaN where the verdict states none. `stated_std_m` is the usual sigma of
    the GNSS log, horizontal and down.
    """

    prepared: _core.PreparedFlight
    alignment: Alignment
    solution: Solution
    facts: dict[str, Any]  # alignment.json
    config: dict[str, Any]
    north_m: Array = field(repr=False)
    east_m: Array = field(repr=False)
    fix_north_m: Array = field(repr=False)
    fix_east_m: Array = field(repr=False)
    fix_height_m: Array = field(repr=False)
    std_rpy_deg: Array = field(repr=False)
    stated_std_m: tuple[float, float]
    filtered: Trajectory | None = field(repr=False)
    smoothed: Trajectory | None = field(repr=False)
    position: Residuals | None
    velocity: Residuals | None

    @property
    def summary(self) -> dict[str, Any]:
        """The content of summary.json."""
        return self.solution.summary

    @property
    def states_heading(self) -> bool:
        """Whether the run states a sigma of the heading over the flight, as trajectory.csv does."""
        return self.alignment.verdict in ("aligned", "weak")

    @property
    def receiver(self) -> Receiver | None:
        """What the final run found of the receiver; None where its errors were taken for white."""
        return self.solution.receiver

    @property
    def mismatch(self) -> tuple[str, float] | None:
        """Which residuals are how many times larger than modelled, by the alignment's own measure.

        None where they are not: the limit is that of the engine's warning, what the chance of some tens of
        fixes makes. None as well where the run models the errors of the receiver: that measure is of the
        alignment, which takes them for white.
        """
        if self.receiver is not None:
            return None
        scale, of = max((self.facts[f"gate_scale_{word}"], word) for word in ("position", "velocity"))
        return (of, math.sqrt(scale)) if scale > 2.0 else None

    @property
    def smoothed_at_start(self) -> tuple[float, float] | None:
        """Smoothed heading of the IMU and its sigma [deg] at the instant of the alignment, if known."""
        found: Trajectory | None = self.smoothed
        if found is None and not self.moved_output:
            found = self.solution
        if found is None or not self.states_heading:
            return None
        k = int(np.argmin(np.abs(found.time_s - self.alignment.start_time_s)))
        if abs(found.time_s[k] - self.alignment.start_time_s) > 1.5:
            return None
        return float(found.rpy_deg[k, 2]), float(found.std_rpy_deg[k, 2])

    @property
    def moved_output(self) -> bool:
        """Whether the trajectory is that of another point or other axes than the IMU's."""
        keys = ("output.reference_point_b_m", "output.boresight_deg")
        return any(any(self.config.get(key) or ()) for key in keys)


def make_review(
    prepared: _core.PreparedFlight, alignment: Alignment, solution: Solution | _core.Solution
) -> Review:
    """Bring a run into the coordinates of the report."""
    if not isinstance(solution, Solution):
        solution = Solution.from_engine(prepared, alignment.engine, solution)
    facts = alignment.to_dict()
    to_n = ned_rows(solution.lat_deg[:1], solution.lon_deg[:1])[0]
    local = (solution.p_eb_e_m - solution.p_eb_e_m[0]) @ to_n.T
    fix_e = prepared.fix_p_ea_e_m
    stated = prepared.fix_std_p_n_m
    fix_local = (fix_e - solution.p_eb_e_m[0]) @ to_n.T
    std_rpy = solution.std_rpy_deg.copy()
    if alignment.verdict not in ("aligned", "weak"):
        std_rpy[:, 2] = np.nan
    events = [Trajectory(**columns) for columns in _events(solution)]
    return Review(
        prepared=prepared,
        alignment=alignment,
        solution=solution,
        facts=facts,
        config=_core.config_entries(prepared.config),
        north_m=local[:, 0],
        east_m=local[:, 1],
        fix_north_m=fix_local[:, 0],
        fix_east_m=fix_local[:, 1],
        fix_height_m=_core.geodetic_from_ecef(fix_e)[2],
        std_rpy_deg=std_rpy,
        stated_std_m=(float(np.median(np.hypot(stated[:, 0], stated[:, 1]))), float(np.median(stated[:, 2]))),
        filtered=events[0] if events else None,
        smoothed=events[1] if events else None,
        position=_residuals(solution, "p", "position", "m", _opened(solution, facts, "position")),
        velocity=_residuals(solution, "v", "velocity", "m/s", _opened(solution, facts, "velocity")),
    )


def _opened(solution: Solution, facts: dict[str, Any], of: str) -> float:
    """Return the factor on the outlier threshold; with a model of the receiver it stays as it is."""
    return float(facts[f"gate_scale_{of}"]) if solution.receiver is None else 1.0


def _events(solution: Solution) -> list[_core.TrajectoryColumns]:
    columns = [solution.engine.filtered_at_events(), solution.engine.smoothed_at_events()]
    return columns if columns[0]["time_s"].size else []


def _residuals(solution: Solution, letter: str, of: str, unit: str, gate_scale: float) -> Residuals | None:
    i = solution.innovations
    res, std, nis = (
        (i.res_p_n_m, i.std_p_n_m, i.nis) if letter == "p" else (i.res_v_n_mps, i.std_v_n_mps, i.nis_velocity)
    )
    verdict = i.verdict if letter == "p" else _verdict_of_weight(i.weight_velocity)
    seen = np.isfinite(nis) & np.isfinite(res).all(axis=1) & np.isfinite(std).all(axis=1)
    if not seen.any():
        return None
    # With a model of the receiver the first fix says where the run is: what is predicted of it is nothing.
    seen &= std.max(axis=1, initial=0.0) < _KNOWS_NOTHING * np.median(std[seen].max(axis=1))
    return Residuals(of, unit, gate_scale, i.time_s[seen], res[seen], std[seen], nis[seen], verdict[seen])


def _verdict_of_weight(weight: Array) -> NDArray[np.str_]:
    """innovations.csv has the verdict of the position; that of the velocity follows from its weight."""
    words: NDArray[np.str_] = np.where(weight >= 1.0, "used", np.where(weight > 0.0, "weighted", "rejected"))
    return words


def chi_square_3(probability: float) -> float:
    """Quantile of the chi-square distribution with three degrees of freedom, by bisection."""
    low, high = 0.0, 200.0
    for _ in range(80):
        x = 0.5 * (low + high)
        below = math.erf(math.sqrt(x / 2)) - math.sqrt(2 * x / math.pi) * math.exp(-x / 2)
        low, high = (x, high) if below < probability else (low, x)
    return high
