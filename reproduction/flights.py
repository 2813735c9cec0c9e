"""The simulated flights of the experiments, their errors, and sums over many of them."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import liealign
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Json = dict[str, Any]

LEVER_ARM_B_M = (0.1, -0.05, -0.3)
TABLE_1_BIASES = liealign.ImuErrorSizes(turn_on="fixed")  # of just the size in the table, with any sign
PARKED_S = 20.0
OVERSAMPLE = 4  # fine steps of the truth per IMU sample
# The papers take the errors of fixes for white.
GIVEN: Json = {
    "gnss.latency_s": 0.0,
    "gnss.error_model": "white",
    "imu.noise_scale": 1.0,
    "gnss.std_scale": 1.0,
}
# TAES Fig. 7 has no sizes; these have some minutes of each.
SCENARIOS: dict[str, Json] = {
    "helicoidal": {"kind": "helical", "circle_radius_m": 25.0, "helix_climb_mps": 0.5},
    "rectangular": {"kind": "rectangular", "line_length_m": 80.0, "line_spacing_m": 50.0},
    "circular": {"kind": "circles", "circle_radius_m": 25.0},
}
SCENARIO_TEXT = (
    "5 minutes with 20 s parked before and after, 6 m/s, 40 m above the pad, nose 40 deg off the course: "
    "circles of 25 m radius climbing at 0.5 m/s, rectangles of 80 m by 50 m, level circles of 25 m radius"
)


def scenario_flight(name: str, heading_deg: float, seed: int) -> liealign.DroneFlight:
    """One of the three scenarios of TAES, parked at that heading."""
    return liealign.DroneFlight(
        **SCENARIOS[name],
        heading_deg=heading_deg,
        duration_s=300.0,
        parked_before_s=PARKED_S,
        parked_after_s=PARKED_S,
        max_tilt_deg=45.0,
        oversample=OVERSAMPLE,
        seed=seed,
    )


def simulated(
    drone: liealign.DroneFlight, seed: int, keys: Json = GIVEN, **gnss: Any
) -> liealign.SimulatedFlight:
    """A flight with the sensors of TAES Table I and fixes at 1 Hz, if `gnss` says nothing else."""
    errors = liealign.GnssErrors(l_ba_b=LEVER_ARM_B_M, **gnss)
    return liealign.simulate_flight(drone, errors, liealign.make_config(keys), seed, TABLE_1_BIASES)


def airborne_s(drone: liealign.DroneFlight) -> tuple[float, float]:
    """From the take-off to the landing."""
    end_s = drone.start_time_s + drone.duration_s
    return drone.start_time_s + drone.parked_before_s, end_s - drone.parked_after_s


def wrap_deg(angle: float) -> float:
    """To [-180, 180)."""
    return (angle + 180.0) % 360.0 - 180.0


def covers(interval_deg: list[float] | None, heading_deg: float) -> bool:
    """Whether the interval, clockwise from its first to its second end, has the heading; none: the circle."""
    if interval_deg is None:
        return True
    low, high = interval_deg
    width = high - low if high - low >= 360.0 else (high - low) % 360.0
    return (heading_deg - low) % 360.0 <= width


def rms(values: Array | Iterable[float]) -> float:
    """Root mean square; nan for none."""
    array = values if isinstance(values, np.ndarray) else np.array(list(values), dtype=np.float64)
    return math.sqrt(float(np.mean(array**2))) if array.size else math.nan


@dataclass(frozen=True)
class Aligned:
    """What came of the alignment of one flight."""

    error_deg: float
    sigma_deg: float  # nan: the data say nothing
    covered: bool
    verdict: str

    @classmethod
    def of(cls, simulated: liealign.SimulatedFlight, alignment: liealign.Alignment) -> Aligned:
        """Against the truth at the alignment's start_time_s."""
        true_deg = simulated.heading_deg_at(alignment.start_time_s)
        sigma = alignment.heading_std_deg
        return cls(
            wrap_deg(alignment.heading_deg - true_deg),
            math.nan if sigma is None else sigma,
            covers(alignment.to_dict()["heading_95_deg"], true_deg),
            alignment.verdict,
        )


def alignment_figures(trials: list[Aligned]) -> Json:
    """Sums over many alignments."""
    sigmas = [t.sigma_deg for t in trials if not math.isnan(t.sigma_deg)]
    return {
        "flights": len(trials),
        "rms_deg": rms(t.error_deg for t in trials),
        "max_deg": max((abs(t.error_deg) for t in trials), default=math.nan),
        "sigma_rms_deg": rms(sigmas),
        "in_95_interval": float(np.mean([t.covered for t in trials])) if trials else math.nan,
        "aligned": float(np.mean([t.verdict == "aligned" for t in trials])) if trials else math.nan,
    }


@dataclass(frozen=True)
class Errors:
    """A trajectory against the truth in a window of time; (n, 3) each, one sigma in std_."""

    time_s: Array
    p_n_m: Array  # (n, 3) NED
    rpy_deg: Array
    std_p_n_m: Array
    std_rpy_deg: Array

    @classmethod
    def of(cls, truth: Any, found: liealign.Trajectory, window_s: tuple[float, float]) -> Errors:
        """At the epochs of the trajectory inside the window."""
        compared = liealign.compare(truth, found, from_s=window_s[0], to_s=window_s[1])
        rows = np.searchsorted(found.time_s, compared.time_s)
        return cls(
            compared.time_s,
            compared.error_p_n_m,
            compared.error_rpy_deg,
            found.std_p_n_m[rows],
            found.std_rpy_deg[rows],
        )
