"""Makes the flight that speed and accuracy are measured on: imu.csv, gnss.csv and truth.csv.

A minute parked, then a drone on rectangles (nose along track), circles and helices at a fixed heading, again
and again for as long as is wanted. Truth is analytic: quintic splines in an Earth-fixed tangent frame, turned
into exact ECEF kinematics with Earth rotation, Coriolis and normal gravity. An IMU sample is the Simpson
integral of the analytic specific force and rate over its interval, divided by it: a mean rate in
forward-right-down axes. White noise is that of an ADIS16495; biases are Gauss-Markov processes about a
turn-on value. Same seed, same files.

Usage: python benchmarks/common_flight.py FOLDER [--duration 1860] [--gnss-rate 1] [--seed 1] [--no-truth]
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from geodesy import OMEGA_IE_E, Array, c_from_rpy, c_n_e, ecef, geodetic, gravity, rpy_deg

LEVER_ARM_B_M = (0.1, -0.05, -0.3)
START_HEADING_DEG = 137.0
PARKED_S = 60.0
START_TIME_S = 100000.0
IMU_RATE_HZ = 200

_LAT, _LON, _HEIGHT_M = np.deg2rad(48.2), np.deg2rad(16.37), 200.0
_COMMAND_RATE_HZ = 50
_DEG = np.pi / 180.0
_GYRO_ARW = 0.09 * _DEG / 60  # rad/sqrt(s)
_ACCEL_VRW = 0.008 / 60  # m/s/sqrt(s)
_GYRO_TURN_ON = np.array([10.0, -8.0, 12.0]) * _DEG / 3600
_ACCEL_TURN_ON = np.array([500.0, -400.0, 600.0]) * 9.80665e-6
_GYRO_INSTABILITY, _ACCEL_INSTABILITY = 2 * _DEG / 3600, 20 * 9.80665e-6
_BIAS_CORRELATION_S = 3600.0
_FIX_STD_M = np.array([0.01, 0.01, 0.03])
_POINTS_AT_ONCE = 200_000

_IMU_HEADER = "time_s,gyro_x_rps,gyro_y_rps,gyro_z_rps,accel_x_mps2,accel_y_mps2,accel_z_mps2"
_GNSS_HEADER = "time_s,lat_deg,lon_deg,height_m,std_n_m,std_e_m,std_d_m"
_TRUTH_HEADER = "time_s,lat_deg,lon_deg,height_m,vn_mps,ve_mps,vd_mps,roll_deg,pitch_deg,heading_deg"
_IMU_FORMAT = ["%.6f"] + ["%.10f"] * 6
_GNSS_FORMAT = ["%.6f", "%.11f", "%.11f", "%.5f"] + ["%.4f"] * 3
_TRUTH_FORMAT = ["%.6f", "%.11f", "%.11f", "%.5f"] + ["%.6f"] * 6


@dataclass(frozen=True)
class FlightSpec:
    """Which flight: its length, rate of the fixes, seed of every noise, and points of an IMU interval."""

    duration_s: float = 1860.0
    gnss_rate_hz: int = 1
    seed: int = 1
    substeps: int = 10  # even; 2 are within 1e-7 of the rates and make long flights five times as fast
    truth: bool = True

    @property
    def samples(self) -> int:
        """Of the IMU."""
        return int(self.duration_s * IMU_RATE_HZ)


# ---- The tangent frame of the pad ----------------------------------------------------------------

_ORIGIN_E = ecef(_LAT, _LON, np.array(_HEIGHT_M))
_C_0_E = c_n_e(np.asarray(_LAT), np.asarray(_LON))  # from the tangent frame of the pad to ECEF


# ---- What the pilot asks for ---------------------------------------------------------------------

Course = Callable[[Array], Array]


class _Command:
    """Velocity (tangent frame) and yaw [deg] over time, filled leg by leg."""

    def __init__(self, duration_s: float) -> None:
        self.time = np.arange(-10, duration_s + 10, 1 / _COMMAND_RATE_HZ)
        self.velocity = np.zeros((self.time.size, 3))
        self.yaw_deg = np.full(self.time.size, START_HEADING_DEG)
        self.end = PARKED_S
        self.heading_deg = START_HEADING_DEG

    def leg(self, seconds: float, velocity: Course, yaw_deg: Course | None = None) -> None:
        """Fly on for so long; both courses are functions of the time since the leg began."""
        first, last = np.searchsorted(self.time, [self.end, self.end + seconds])
        since = self.time[first:last] - self.end
        self.velocity[first:last] = velocity(since)
        if yaw_deg is not None:
            self.yaw_deg[first:last] = yaw_deg(since)
            self.heading_deg = self.yaw_deg[last - 1]
        self.yaw_deg[first if yaw_deg is None else last :] = self.heading_deg
        self.end += seconds

    def hover(self, seconds: float) -> None:
        self.leg(seconds, lambda s: np.zeros((s.size, 3)))


def _along(speed: float, course: Array | float, down: Array | float, s: Array) -> Array:
    zero = np.zeros_like(s)
    return np.stack([speed * np.cos(course) + zero, speed * np.sin(course) + zero, down + zero], -1)


def _side(command: _Command, speed: float, course: float, seconds: float) -> None:
    """One side of a rectangle, the nose turned along it within three seconds."""
    before = command.heading_deg
    turn = (np.rad2deg(course) - before + 180) % 360 - 180
    command.leg(
        seconds,
        lambda s: _along(speed, course, 0.0, s),
        lambda s: np.asarray(before + turn * np.minimum(s / 3, 1)),
    )


def _manoeuvres(command: _Command, until_s: float) -> None:
    """Rectangle, hover, circle, helix at a fixed heading; again and again at other speeds, to other sides."""
    round_number = 0
    while command.end < until_s:
        speed = (6, 9, 5, 11)[round_number % 4]
        direction = 1 if round_number % 2 == 0 else -1
        for side in range(4):
            course = np.deg2rad(40 * round_number) + direction * side * np.pi / 2
            _side(command, speed, course, 18 if side % 2 == 0 else 10)
            if command.end > until_s:
                return
        command.hover(8)

        rate = direction * speed / (20 + 10 * (round_number % 3))
        before = command.heading_deg
        _circle(command, speed, rate, before)
        if command.end > until_s:
            return
        _helix(command, speed, rate, -1.0 if round_number % 2 == 0 else 1.0)
        command.hover(6)
        round_number += 1


def _circle(command: _Command, speed: float, rate: float, before_deg: float) -> None:
    start = np.deg2rad(before_deg)
    command.leg(
        45,
        lambda s: _along(speed, start + rate * s, 0.0, s),
        lambda s: np.asarray(before_deg + np.rad2deg(rate * s)),
    )


def _helix(command: _Command, speed: float, rate: float, down: float) -> None:
    start = np.deg2rad(command.heading_deg)
    command.leg(50, lambda s: _along(speed, start - rate * s, down + 0.3 * np.sin(s), s))


# ---- Truth ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Truth:
    """Motion in the tangent frame of the pad, roll-pitch-yaw against it and its rate."""

    position: BSpline
    velocity: BSpline
    acceleration: BSpline
    rpy: BSpline
    rpy_rate: BSpline


def _wobble(rng: np.random.Generator, size: int, sigma: float, low_hz: float, high_hz: float) -> Array:
    white = rng.standard_normal(size)
    fc = _COMMAND_RATE_HZ / (2 * np.pi)
    band = gaussian_filter1d(white, fc / high_hz) - gaussian_filter1d(white, fc / low_hz)
    return np.asarray(sigma * band / band.std())


def _tilt(acceleration: Array, velocity: Array, yaw: Array) -> tuple[Array, Array]:
    """Roll and pitch of a multirotor: the thrust carries acceleration, linear drag and weight."""
    force = acceleration + 0.25 * velocity
    force[:, 2] -= gravity(np.asarray(_LAT), np.asarray(_HEIGHT_M))
    c, s = np.cos(yaw), np.sin(yaw)
    fx = c * force[:, 0] + s * force[:, 1]
    fy = -s * force[:, 0] + c * force[:, 1]
    pitch = np.arctan(fx / force[:, 2])
    return np.arctan(-fy * np.cos(pitch) / force[:, 2]), pitch


def _make_truth(spec: FlightSpec, rng: np.random.Generator) -> _Truth:
    command = _Command(spec.duration_s)
    command.leg(20, lambda s: np.stack([0 * s, 0 * s, -2 + 0 * s], -1))  # 40 m up
    command.hover(5)
    _manoeuvres(command, spec.duration_s - 60)

    time, rate = command.time, _COMMAND_RATE_HZ
    velocity = gaussian_filter1d(command.velocity, 0.6 * rate, axis=0)
    yaw_deg = gaussian_filter1d(command.yaw_deg, 0.5 * rate)
    velocity[time < PARKED_S - 2] = 0
    position = make_interp_spline(time, np.cumsum(velocity, 0) / rate, k=5)
    speed, acceleration = position.derivative(1), position.derivative(2)

    yaw = np.deg2rad(yaw_deg)
    roll, pitch = _tilt(acceleration(time), speed(time), yaw)
    flying = gaussian_filter1d((time >= PARKED_S - 2).astype(float), 1.0 * rate)
    flying[time < PARKED_S - 4] = 0
    roll = gaussian_filter1d(roll, 0.15 * rate) + flying * np.deg2rad(_wobble(rng, time.size, 1.0, 0.3, 3))
    pitch = gaussian_filter1d(pitch, 0.15 * rate) + flying * np.deg2rad(_wobble(rng, time.size, 1.0, 0.3, 3))
    yaw = yaw + flying * np.deg2rad(_wobble(rng, time.size, 0.5, 0.3, 2))
    parked_roll = np.deg2rad(0.8)
    roll[time < PARKED_S - 4] = parked_roll
    roll += parked_roll * (1 - flying) * (time >= PARKED_S - 4)
    pitch = pitch * flying + (1 - flying) * np.deg2rad(-1.1)
    rpy = make_interp_spline(time, np.stack([roll, pitch, yaw], -1), k=5)
    return _Truth(position, speed, acceleration, rpy, rpy.derivative())


def _p_e(truth: _Truth, time: Array) -> Array:
    offset: Array = truth.position(time) @ _C_0_E.T
    return _ORIGIN_E + offset


def _rate_and_force(truth: _Truth, time: Array) -> tuple[Array, Array]:
    """omega_ib_b [rad/s] and f_ib_b [m/s^2] at these instants."""
    e, de = truth.rpy(time), truth.rpy_rate(time)
    c_b_e = _C_0_E @ c_from_rpy(e)
    sr, cr, sp, cp = np.sin(e[:, 0]), np.cos(e[:, 0]), np.sin(e[:, 1]), np.cos(e[:, 1])
    omega_0b_b = np.stack(
        [de[:, 0] - de[:, 2] * sp, de[:, 1] * cr + de[:, 2] * sr * cp, -de[:, 1] * sr + de[:, 2] * cr * cp],
        -1,
    )
    v_e, a_e = truth.velocity(time) @ _C_0_E.T, truth.acceleration(time) @ _C_0_E.T
    lat, lon, height = geodetic(_p_e(truth, time))
    g_e = c_n_e(lat, lon)[..., 2] * gravity(lat, height)[:, None]
    f_e = a_e + 2 * np.cross(OMEGA_IE_E, v_e) - g_e
    return (
        omega_0b_b + np.einsum("nji,j->ni", c_b_e, OMEGA_IE_E),
        np.einsum("nji,nj->ni", c_b_e, f_e),
    )


def _increments(truth: _Truth, spec: FlightSpec) -> Iterator[tuple[Array, Array]]:
    """Angle and velocity increments of a stretch of IMU samples after the other, without errors."""
    n = spec.substeps
    simpson = np.ones(n + 1)
    simpson[1:-1:2], simpson[2:-1:2] = 4, 2
    simpson /= 3 * IMU_RATE_HZ * n
    points = spec.samples * n + 1
    rate, force = np.empty((0, 3)), np.empty((0, 3))
    for first in range(0, points, _POINTS_AT_ONCE):
        time = np.arange(first, min(first + _POINTS_AT_ONCE, points)) / (IMU_RATE_HZ * n)
        more_rate, more_force = _rate_and_force(truth, time)
        rate, force = np.concatenate([rate, more_rate]), np.concatenate([force, more_force])
        whole = (len(rate) - 1) // n
        index = np.arange(whole)[:, None] * n + np.arange(n + 1)
        yield np.einsum("nkj,k->nj", rate[index], simpson), np.einsum("nkj,k->nj", force[index], simpson)
        rate, force = rate[whole * n :], force[whole * n :]


# ---- Errors and files ----------------------------------------------------------------------------


def _gauss_markov(rng: np.random.Generator, samples: int, sigma: float) -> Array:
    decay = np.exp(-1 / (IMU_RATE_HZ * _BIAS_CORRELATION_S))
    drive = rng.standard_normal((samples, 3)) * sigma * np.sqrt(1 - decay * decay)
    return np.asarray(lfilter([1], [1, -decay], drive, axis=0))


def _write_rows(file: IO[str], columns: list[str], table: Array) -> None:
    """As numpy.savetxt writes them, a few times as fast."""
    line = ",".join(columns) + "\n"
    for first in range(0, len(table), 10_000):
        rows = table[first : first + 10_000]
        file.write((line * len(rows)) % tuple(rows.ravel().tolist()))


def _write_imu(path: Path, truth: _Truth, spec: FlightSpec, rng: np.random.Generator) -> None:
    dt = 1 / IMU_RATE_HZ
    gyro_bias = _GYRO_TURN_ON + _gauss_markov(rng, spec.samples, _GYRO_INSTABILITY)
    accel_bias = _ACCEL_TURN_ON + _gauss_markov(rng, spec.samples, _ACCEL_INSTABILITY)
    gyro_error = gyro_bias * dt
    white = rng.standard_normal((spec.samples, 3)) * _GYRO_ARW * np.sqrt(dt)
    accel_error = accel_bias * dt
    white_a = rng.standard_normal((spec.samples, 3)) * _ACCEL_VRW * np.sqrt(dt)
    done = 0
    with path.open("w", encoding="ascii") as file:
        file.write(_IMU_HEADER + "\n")
        for dtheta, dv in _increments(truth, spec):
            s = slice(done, done + len(dtheta))
            done = s.stop
            time = START_TIME_S + np.arange(s.start + 1, s.stop + 1) / IMU_RATE_HZ
            rates = (dtheta + gyro_error[s] + white[s]) / dt
            forces = (dv + accel_error[s] + white_a[s]) / dt
            _write_rows(file, _IMU_FORMAT, np.column_stack([time, rates, forces]))


def _write_gnss(path: Path, truth: _Truth, spec: FlightSpec, rng: np.random.Generator) -> None:
    step = IMU_RATE_HZ // spec.gnss_rate_hz
    time = np.arange(step, spec.samples + 1, step) / IMU_RATE_HZ
    p_e = _p_e(truth, time)
    lat, lon, _ = geodetic(p_e)
    c_b_e = _C_0_E @ c_from_rpy(truth.rpy(time))
    antenna = p_e + np.einsum("nij,j->ni", c_b_e, np.array(LEVER_ARM_B_M))
    noise_n = rng.standard_normal((time.size, 3)) * _FIX_STD_M
    lat, lon, height = geodetic(antenna + np.einsum("nij,nj->ni", c_n_e(lat, lon), noise_n))
    std = np.tile(_FIX_STD_M, (time.size, 1))
    with path.open("w", encoding="ascii") as file:
        file.write(_GNSS_HEADER + "\n")
        table = np.column_stack([START_TIME_S + time, np.rad2deg(lat), np.rad2deg(lon), height, std])
        _write_rows(file, _GNSS_FORMAT, table)


def _write_truth(path: Path, truth: _Truth, spec: FlightSpec) -> None:
    with path.open("w", encoding="ascii") as file:
        file.write(_TRUTH_HEADER + "\n")
        for first in range(0, spec.samples + 1, _POINTS_AT_ONCE):
            time = np.arange(first, min(first + _POINTS_AT_ONCE, spec.samples + 1)) / IMU_RATE_HZ
            lat, lon, height = geodetic(_p_e(truth, time))
            axes = c_n_e(lat, lon)
            c_b_n = np.einsum("nji,njk->nik", axes, _C_0_E @ c_from_rpy(truth.rpy(time)))
            v_n = np.einsum("nji,nj->ni", axes, truth.velocity(time) @ _C_0_E.T)
            pose = [np.rad2deg(lat), np.rad2deg(lon), height, v_n, rpy_deg(c_b_n)]
            table = np.column_stack([START_TIME_S + time, *pose])
            _write_rows(file, _TRUTH_FORMAT, table)


def make_flight(folder: Path, spec: FlightSpec) -> None:
    """Write the files of a flight into the folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(spec.seed)
    truth = _make_truth(spec, rng)
    _write_imu(folder / "imu.csv", truth, spec, rng)
    _write_gnss(folder / "gnss.csv", truth, spec, rng)
    if spec.truth:
        _write_truth(folder / "truth.csv", truth, spec)


def main() -> None:
    parser = argparse.ArgumentParser(description="The common flight of the benchmarks.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--duration", type=float, default=1860.0, help="seconds, at least 120")
    parser.add_argument("--gnss-rate", type=int, default=1, choices=(1, 2, 4, 5, 10), help="fixes per second")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--substeps", type=int, default=10, choices=(2, 4, 10), help="points of an IMU interval"
    )
    parser.add_argument("--no-truth", action="store_true")
    a = parser.parse_args()
    make_flight(a.folder, FlightSpec(a.duration, a.gnss_rate, a.seed, a.substeps, not a.no_truth))


if __name__ == "__main__":
    main()
