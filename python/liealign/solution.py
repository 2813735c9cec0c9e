"""What comes out: the alignment and the trajectory, as frozen dataclasses of numpy arrays."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from liealign import _core

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Alignment:
    """The heading at the start of the motion, and how well the flight shows it.

    Attributes
    ----------
    heading_deg
        Clockwise from true north, [0, 360), at `start_time_s`.
    heading_std_deg
        One sigma; None when the data say nothing.
    verdict
        aligned, weak, ambiguous or unobservable.
    advice
        One sentence on what to do about it.
    start_time_s, end_time_s
        The last instant of rest, and the end of the time whose fixes were scored.
    start
        How the run starts: static or moving.
    gnss_latency_s, gnss_latency_std_s
        Of the GNSS stamps, t_true = time_s - latency; its sigma is None where it was given. One latency for
        positions and velocities; the final run tells them apart (`Solution.receiver`).
    evaluations
        Candidate filters that were run.
    mean_deg
        Mean of the posterior over the circle.
    mode_heading_deg, mode_mass
        (k,) the modes of the posterior and their share of it.
    density_heading_deg, density_per_deg
        (n,) the posterior as sampled, ascending in [0, 360).
    triple_heading_deg, triple_cost
        (3,) the points that place the last parabola; cost as of the curve.
    curve_heading_deg, curve_heading_std_deg, curve_cost, curve_gated
        (m,) every candidate in order; std 0: conditional on its heading. Cost: the negative log
        posterior, comparable within wide, open and gated candidates.
    """

    heading_deg: float
    heading_std_deg: float | None
    verdict: str
    advice: str
    start_time_s: float
    end_time_s: float
    start: str
    gnss_latency_s: float
    gnss_latency_std_s: float | None
    evaluations: int
    settled: bool
    mean_deg: float
    mode_heading_deg: Array = field(repr=False)
    mode_mass: Array = field(repr=False)
    density_heading_deg: Array = field(repr=False)
    density_per_deg: Array = field(repr=False)
    triple_heading_deg: Array = field(repr=False)
    triple_cost: Array = field(repr=False)
    curve_heading_deg: Array = field(repr=False)
    curve_heading_std_deg: Array = field(repr=False)
    curve_cost: Array = field(repr=False)
    curve_gated: NDArray[np.bool_] = field(repr=False)
    engine: _core.HeadingResult = field(repr=False)
    json_text: str = field(repr=False)

    @classmethod
    def from_engine(cls, flight: _core.PreparedFlight, result: _core.HeadingResult) -> Alignment:
        """Turn the engine's result into degrees."""
        modes, curve, density, triple = result.modes(), result.curve(), result.density(), result.triple()
        return cls(
            heading_deg=float(np.rad2deg(result.heading_rad)),
            heading_std_deg=None if result.sigma_rad is None else float(np.rad2deg(result.sigma_rad)),
            verdict=result.verdict,
            advice=result.advice,
            start_time_s=flight.t_start_s,
            end_time_s=flight.t_end_s,
            start=flight.start,
            gnss_latency_s=flight.latency_s + result.parameters.latency_s,
            gnss_latency_std_s=result.latency_std_s,
            evaluations=result.evaluations,
            settled=result.settled,
            mean_deg=float(np.rad2deg(result.mean_rad)),
            mode_heading_deg=np.rad2deg(modes["heading_rad"]),
            mode_mass=modes["mass"],
            density_heading_deg=np.rad2deg(density["heading_rad"]),
            density_per_deg=np.deg2rad(density["density_per_rad"]),
            triple_heading_deg=np.rad2deg(triple["heading_rad"]),
            triple_cost=triple["cost"],
            curve_heading_deg=np.rad2deg(curve["heading_rad"]),
            curve_heading_std_deg=np.rad2deg(curve["heading_std_rad"]),
            curve_cost=curve["cost"],
            curve_gated=curve["gated"],
            engine=result,
            json_text=_core.alignment_json(flight, result),
        )

    @property
    def warnings(self) -> list[str]:
        """One sentence each."""
        return list(self.to_dict()["warnings"])

    def to_dict(self) -> dict[str, Any]:
        """Return the content of alignment.json."""
        content: dict[str, Any] = json.loads(self.json_text)
        return content


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States and their standard deviations at n epochs.

    `b` is the IMU (forward, right, down), `n` NED, `e` ECEF. Where `output.reference_point_b_m` or
    `output.boresight_deg` name another point or other axes, `b` is those: position, velocity and attitude
    with their sigmas. The biases stay those of the IMU.

    Attributes
    ----------
    time_s
        (n,) true time.
    lat_deg, lon_deg, height_m
        (n,) WGS 84, height above the ellipsoid.
    v_n_mps
        (n, 3) velocity against the Earth, NED.
    rpy_deg
        (n, 3) roll, pitch, heading (ZYX, body to NED); heading in [0, 360).
    std_p_n_m, std_v_n_mps, std_rpy_deg
        (n, 3) one sigma of position NED, velocity NED, roll, pitch, heading.
    relative_std_p_n_m
        (n, 3) one sigma of the position in the receiver's own datum, NED: without the error that lasts over
        many fixes (Eq. 83). Equal to std_p_n_m where `gnss.error_model` is white.
    b_a_mps2, b_g_rps, std_b_a_mps2, std_b_g_rps
        (n, 3) accelerometer and gyro biases in body axes, and one sigma.
    p_eb_e_m, v_eb_e_mps
        (n, 3) position and velocity in ECEF.
    C_b_e
        (n, 3, 3) takes body components to ECEF components.
    """

    time_s: Array
    lat_deg: Array = field(repr=False)
    lon_deg: Array = field(repr=False)
    height_m: Array = field(repr=False)
    v_n_mps: Array = field(repr=False)
    rpy_deg: Array = field(repr=False)
    std_p_n_m: Array = field(repr=False)
    std_v_n_mps: Array = field(repr=False)
    std_rpy_deg: Array = field(repr=False)
    relative_std_p_n_m: Array = field(repr=False)
    b_a_mps2: Array = field(repr=False)
    b_g_rps: Array = field(repr=False)
    std_b_a_mps2: Array = field(repr=False)
    std_b_g_rps: Array = field(repr=False)
    p_eb_e_m: Array = field(repr=False)
    v_eb_e_mps: Array = field(repr=False)
    C_b_e: Array = field(repr=False)

    def point_e_m(self, lever_arm_b_m: ArrayLike) -> Array:
        """Return ECEF positions (n, 3) [m] of another point of the vehicle: p_eb_e + C_b_e l.

        Parameters
        ----------
        lever_arm_b_m
            (3,) from the IMU to the point, in body axes: the antenna, a camera, a scanner.
        """
        moved: Array = self.p_eb_e_m + self.C_b_e @ np.asarray(lever_arm_b_m, dtype=np.float64)
        return moved

    def point_geodetic(self, lever_arm_b_m: ArrayLike) -> tuple[Array, Array, Array]:
        """Latitude, longitude [deg] and ellipsoidal height [m], each (n,), of another point."""
        return _core.geodetic_from_ecef(self.point_e_m(lever_arm_b_m))

    def to_frame(self) -> pd.DataFrame:
        """Make a pandas DataFrame with the columns of trajectory.csv.

        Raises
        ------
        ImportError
            When pandas is not installed.
        """
        columns: dict[str, Array] = {
            "time_s": self.time_s,
            "lat_deg": self.lat_deg,
            "lon_deg": self.lon_deg,
            "height_m": self.height_m,
        }
        groups = [
            (self.v_n_mps, ("vn_mps", "ve_mps", "vd_mps")),
            (self.rpy_deg, ("roll_deg", "pitch_deg", "heading_deg")),
            (self.std_p_n_m, ("std_n_m", "std_e_m", "std_d_m")),
            (self.std_v_n_mps, ("std_vn_mps", "std_ve_mps", "std_vd_mps")),
            (self.std_rpy_deg, ("std_roll_deg", "std_pitch_deg", "std_heading_deg")),
            (self.relative_std_p_n_m, ("relative_std_n_m", "relative_std_e_m", "relative_std_d_m")),
        ]
        for array, names in groups:
            columns |= {name: array[:, i] for i, name in enumerate(names)}
        return _frame(columns)


@dataclass(frozen=True, eq=False)
class Innovations:
    """What became of each of m GNSS records; NaN where a record was no update.

    Attributes
    ----------
    time_s
        (m,) true time.
    res_p_n_m, std_p_n_m, nis, weight
        Position residual and its standard deviation, (m, 3) NED; normalised innovation squared and
        weight, (m,).
    res_v_n_mps, std_v_n_mps, nis_velocity, weight_velocity
        The same for the velocity.
    verdict
        (m,) used, weighted, rejected, reacquired, averaged_at_rest, quality_not_accepted or outside_imu.
    """

    time_s: Array
    res_p_n_m: Array = field(repr=False)
    std_p_n_m: Array = field(repr=False)
    nis: Array = field(repr=False)
    weight: Array = field(repr=False)
    res_v_n_mps: Array = field(repr=False)
    std_v_n_mps: Array = field(repr=False)
    nis_velocity: Array = field(repr=False)
    weight_velocity: Array = field(repr=False)
    verdict: NDArray[np.str_] = field(repr=False)

    def to_frame(self) -> pd.DataFrame:
        """Make a pandas DataFrame with the columns of innovations.csv; ImportError without pandas."""
        columns: dict[str, Any] = {"time_s": self.time_s}
        for array, name in ((self.res_p_n_m, "res_{}_m"), (self.std_p_n_m, "std_{}_m")):
            columns |= {name.format(axis): array[:, i] for i, axis in enumerate("ned")}
        columns |= {"nis": self.nis, "weight": self.weight}
        for array, name in ((self.res_v_n_mps, "res_v{}_mps"), (self.std_v_n_mps, "std_v{}_mps")):
            columns |= {name.format(axis): array[:, i] for i, axis in enumerate("ned")}
        columns |= {"nis_velocity": self.nis_velocity, "weight_velocity": self.weight_velocity}
        columns["verdict"] = self.verdict
        return _frame(columns)


@dataclass(frozen=True)
class Receiver:
    """What the final run found of the GNSS receiver (Eq. 84); docs/gnss-errors.md says what is behind it.

    Attributes
    ----------
    latency_s, latency_std_s
        Of the stamps of positions, t_true = time_s - latency; the sigma is None where it was given.
    velocity_latency_s, velocity_latency_std_s
        The same of velocities.
    latency_model_spread_s
        By how much the latency of positions differs between models that nobody can rule out.
    stamp_jitter_s
        One sigma of what is random in the stamps.
    white_std_scale
        White part of a position, in units of the sigma that the file states.
    correlation_time_s, smoothing_time_s
        How long the other part lasts, and over how long the receiver smooths it; 0: not at all.
    velocity_correlated_std_mps
        One sigma of the velocity error that lasts; 0: none.
    """

    latency_s: float
    latency_std_s: float | None
    velocity_latency_s: float
    velocity_latency_std_s: float | None
    latency_model_spread_s: float
    stamp_jitter_s: float
    white_std_scale: float
    correlation_time_s: float
    smoothing_time_s: float
    velocity_correlated_std_mps: float

    @classmethod
    def of(cls, summary: dict[str, Any]) -> Receiver | None:
        """Take it from the content of summary.json; None where its errors were taken for white."""
        if summary.get("gnss_error_model") != "correlated":
            return None
        return cls(**{f.name: summary[f"gnss_{f.name}"] for f in fields(cls)})


@dataclass(frozen=True, eq=False)
class Solution(Trajectory):
    """The smoothed trajectory, with the forward filter's where `output.filtered` asks for it.

    Attributes
    ----------
    filtered
        The forward filter alone, or None.
    innovations
        What became of each fix.
    receiver
        What was found of the receiver; None where `gnss.error_model` is white.
    summary
        The content of summary.json: one number per key, units in the keys.
    warnings
        One sentence each.
    """

    filtered: Trajectory | None = field(repr=False)
    innovations: Innovations = field(repr=False)
    summary: dict[str, Any] = field(repr=False)
    engine: _core.Solution = field(repr=False)

    @property
    def warnings(self) -> list[str]:
        """One sentence each."""
        return list(self.summary["warnings"])

    @property
    def receiver(self) -> Receiver | None:
        """What was found of the receiver; None where its errors were taken for white."""
        return Receiver.of(self.summary)

    @classmethod
    def from_engine(
        cls, flight: _core.PreparedFlight, heading: _core.HeadingResult, solution: _core.Solution
    ) -> Solution:
        """Turn the engine's solution into arrays."""
        filtered = Trajectory(**solution.filtered())
        return cls(
            **solution.smoothed(),
            filtered=filtered if filtered.time_s.size else None,
            innovations=Innovations(**solution.innovations()),
            summary=json.loads(_core.summary_json(flight, heading, solution)),
            engine=solution,
        )


def _frame(columns: dict[str, Any]) -> pd.DataFrame:
    try:
        import pandas as pd
    except ImportError:
        raise ImportError('to_frame() needs pandas: pip install "liealign[frame]"') from None
    return pd.DataFrame(columns)
