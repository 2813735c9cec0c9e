"""The same flight through GTSAM: preintegrated IMU factors, ISAM2, Levenberg-Marquardt, marginals.

Keyframes at the fixes, CombinedImuFactor between them, GPSFactorArm at each; navigation frame ENU at the
first fix, gravity by position, rotation of the Earth. The heading at the start is given (GTSAM does not
look for it), the IMU noise is that of liealign's profile. The samples get the same coning and sculling
corrections, and the force that of the rotation within a sample, which GTSAM leaves out. Python hands GTSAM
each IMU sample in a call of its own, as it offers no other way; --binding measures what as many calls cost
that only keep their arguments. Writes poses.csv at the keyframes and times.json.

Usage: python benchmarks/gtsam_pipeline.py FOLDER OUT --heading DEG --lever-arm X Y Z
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import time

_BEGIN = time.perf_counter()

import argparse  # noqa: E402
import json  # noqa: E402
import resource  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from contextlib import contextmanager  # noqa: E402
from dataclasses import dataclass, field  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import gtsam  # noqa: E402
import numpy as np  # noqa: E402
from gtsam.symbol_shorthand import B, V, X  # noqa: E402

from geodesy import OMEGA_IE_E, Array, c_from_rpy, c_n_e, ecef, geodetic, gravity, rpy_deg  # noqa: E402

# IMU profile adis16495 of liealign, in SI; biases walk by sigma sqrt(2/tau).
GYRO_ARW, ACCEL_VRW = np.deg2rad(0.09) / 60, 0.008 / 60
GYRO_BIAS_RW = np.deg2rad(0.8) / 3600 * np.sqrt(2 / 100)
ACCEL_BIAS_RW = 3.2e-6 * 9.80665 * np.sqrt(2 / 100)
GYRO_TURN_ON, ACCEL_TURN_ON = np.deg2rad(5.0) / 3600, 1e-3 / 3 * 9.80665
TILT_STD, HEADING_STD, VELOCITY_STD = np.deg2rad(1 / 3), np.deg2rad(5 / 3), 1e-3 / 3
REST_S = 55.0  # of the flight's first minute, from which attitude and gyro bias start
C_NED_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass
class Stopwatch:
    """Seconds by stage."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add up what runs inside."""
        begin = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - begin


@dataclass(frozen=True)
class Log:
    """Corrected IMU samples, fixes in ENU about the first one, and the place of that one."""

    imu_time: Array
    omega: Array
    force: Array
    fix_time: Array
    fix: Array
    fix_std: Array
    origin: Array  # ECEF
    c_enu_e: Array
    gravity: Array  # ENU, m/s^2, at each fix


def read_log(folder: Path) -> Log:
    """imu.csv and gnss.csv."""
    imu = np.loadtxt(folder / "imu.csv", delimiter=",", skiprows=1)
    gnss = np.loadtxt(folder / "gnss.csv", delimiter=",", skiprows=1)
    t, w, f = imu[:, 0], imu[:, 1:4], imu[:, 4:7]
    dt = np.diff(t, prepend=t[0] - (t[1] - t[0]))[:, None]
    dw, df = np.diff(w, axis=0, prepend=w[:1]), np.diff(f, axis=0, prepend=f[:1])
    omega = w + dt / 12 * np.cross(w, dw)
    force = f + dt / 12 * (np.cross(w, df) + np.cross(f, dw)) + dt / 2 * np.cross(w, f)
    lat, lon = np.deg2rad(gnss[:, 1:3]).T
    p_e = ecef(lat, lon, gnss[:, 3])
    g_e = c_n_e(lat, lon)[:, :, 2] * gravity(lat, gnss[:, 3])[:, None]
    c_enu_e = c_n_e(lat[0], lon[0]) @ C_NED_ENU
    return Log(
        imu_time=t,
        omega=omega,
        force=force,
        fix_time=gnss[:, 0],
        fix=(p_e - p_e[0]) @ c_enu_e,
        fix_std=gnss[:, [5, 4, 6]],
        origin=p_e[0],
        c_enu_e=c_enu_e,
        gravity=g_e @ c_enu_e,
    )


def imu_params(log: Log, i: int) -> Any:
    """Noise, gravity and the Earth's rotation in the navigation frame, on the way to fix i."""
    params = gtsam.PreintegrationCombinedParams(0.5 * (log.gravity[i - 1] + log.gravity[i]))
    eye = np.eye(3)
    params.setGyroscopeCovariance(GYRO_ARW**2 * eye)
    params.setAccelerometerCovariance(ACCEL_VRW**2 * eye)
    params.setIntegrationCovariance(1e-14 * eye)
    params.setBiasOmegaCovariance(GYRO_BIAS_RW**2 * eye)
    params.setBiasAccCovariance(ACCEL_BIAS_RW**2 * eye)
    params.setOmegaCoriolis(log.c_enu_e.T @ OMEGA_IE_E)
    return params


@dataclass(frozen=True)
class Start:
    """Pose, velocity and biases at the first fix, and their sigmas in GTSAM's order."""

    pose: Any
    velocity: Array
    bias: Any
    pose_noise: Any


def initial(log: Log, heading_deg: float, lever_arm: Array) -> Start:
    """Levelled by the rest, at the given heading."""
    rest = log.imu_time <= log.imu_time[0] + REST_S
    f, w = log.force[rest].mean(0), log.omega[rest].mean(0)
    roll, pitch = np.arctan2(-f[1], -f[2]), np.arctan2(f[0], np.hypot(f[1], f[2]))
    c_b_enu = C_NED_ENU @ c_from_rpy(np.array([[roll, pitch, np.deg2rad(heading_deg)]]))[0]
    b_g = w - c_b_enu.T @ (log.c_enu_e.T @ OMEGA_IE_E)
    b_a = f * (1 - np.linalg.norm(log.gravity[0]) / np.linalg.norm(f))
    # Pose3's tangent: rotation, then position, in body axes. The heading turns about down.
    down_b = c_b_enu.T @ np.array([0.0, 0.0, -1.0])
    heading_var, tilt_var = HEADING_STD**2, TILT_STD**2
    covariance = np.diag([tilt_var] * 3 + [0.02**2] * 3)
    covariance[:3, :3] += (heading_var - tilt_var) * np.outer(down_b, down_b)
    return Start(
        gtsam.Pose3(gtsam.Rot3(c_b_enu), log.fix[0] - c_b_enu @ lever_arm),
        np.zeros(3),
        gtsam.imuBias.ConstantBias(b_a, b_g),
        gtsam.noiseModel.Gaussian.Covariance(covariance),
    )


def prior_factors(graph: Any, start: Start) -> None:
    """On the first keyframe."""
    graph.add(gtsam.PriorFactorPose3(X(0), start.pose, start.pose_noise))
    velocity = gtsam.noiseModel.Isotropic.Sigma(3, VELOCITY_STD)
    graph.add(gtsam.PriorFactorVector(V(0), start.velocity, velocity))
    sigmas = np.array([ACCEL_TURN_ON] * 3 + [GYRO_TURN_ON] * 3)
    bias = gtsam.noiseModel.Diagonal.Sigmas(sigmas)
    graph.add(gtsam.PriorFactorConstantBias(B(0), start.bias, bias))


def gps_factor(log: Log, i: int, lever_arm: Array) -> Any:
    """Of one fix."""
    noise = gtsam.noiseModel.Diagonal.Sigmas(log.fix_std[i])
    return gtsam.GPSFactorArm(X(i), log.fix[i], lever_arm, noise)


def binding_seconds(log: Log) -> float:
    """As many calls from Python as there are samples, with the same vectors, that only keep them."""
    begin = time.perf_counter()
    keep = gtsam.imuBias.ConstantBias
    for f, w in zip(log.force, log.omega, strict=True):
        keep(f, w)
    return time.perf_counter() - begin


def incremental(log: Log, start: Start, lever_arm: Array, watch: Stopwatch) -> tuple[Any, Any]:
    """ISAM2 over the flight; the whole graph and the estimate."""
    graph, new, values = gtsam.NonlinearFactorGraph(), gtsam.NonlinearFactorGraph(), gtsam.Values()
    prior_factors(new, start)
    new.add(gps_factor(log, 0, lever_arm))
    pose, velocity, bias = start.pose, start.velocity, start.bias
    values.insert(X(0), pose)
    values.insert(V(0), velocity)
    values.insert(B(0), bias)
    isam = gtsam.ISAM2(gtsam.ISAM2Params())
    with watch.stage("isam2"):
        isam.update(new, values)
    graph.push_back(new)

    dt = np.diff(log.imu_time, prepend=log.imu_time[0] - (log.imu_time[1] - log.imu_time[0])).tolist()
    ends = np.searchsorted(log.imu_time, log.fix_time + 1e-6)
    for i in range(1, len(log.fix_time)):
        with watch.stage("preintegration"):
            pim = gtsam.PreintegratedCombinedMeasurements(imu_params(log, i), bias)
            integrate = pim.integrateMeasurement
            samples = slice(ends[i - 1], ends[i])
            for f, w, step in zip(log.force[samples], log.omega[samples], dt[samples], strict=True):
                integrate(f, w, step)
        with watch.stage("isam2"):
            new, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
            new.add(gtsam.CombinedImuFactor(X(i - 1), V(i - 1), X(i), V(i), B(i - 1), B(i), pim))
            new.add(gps_factor(log, i, lever_arm))
            predicted = pim.predict(gtsam.NavState(pose, velocity), bias)
            values.insert(X(i), predicted.pose())
            values.insert(V(i), predicted.velocity())
            values.insert(B(i), bias)
            isam.update(new, values)
            pose = isam.calculateEstimatePose3(X(i))
            velocity = isam.calculateEstimateVector(V(i))
            bias = isam.calculateEstimateConstantBias(B(i))
        graph.push_back(new)
    return graph, isam.calculateEstimate()


def write_poses(path: Path, log: Log, values: Any, marginals: list[Array]) -> None:
    """Geodetic position, attitude and the heading's sigma, one row per keyframe."""
    poses = [values.atPose3(X(i)) for i in range(len(log.fix_time))]
    c_b_enu = np.array([pose.rotation().matrix() for pose in poses])
    position = log.origin + np.array([pose.translation() for pose in poses]) @ log.c_enu_e.T
    lat, lon, height = geodetic(position)
    c_b_n = np.einsum("nji,jk,nkl->nil", c_n_e(lat, lon), log.c_enu_e, c_b_enu)
    down_b = c_b_n[:, 2, :]
    variance = np.einsum("ni,nij,nj->n", down_b, np.array(marginals)[:, :3, :3], down_b)
    columns = [log.fix_time, np.rad2deg(lat), np.rad2deg(lon), height, rpy_deg(c_b_n)]
    table = np.column_stack([*columns, np.rad2deg(np.sqrt(variance))])
    header = "time_s,lat_deg,lon_deg,height_m,roll_deg,pitch_deg,heading_deg,std_heading_deg"
    formats = ["%.6f", "%.11f", "%.11f", "%.5f"] + ["%.6f"] * 4
    np.savetxt(path, table, fmt=formats, delimiter=",", header=header, comments="")


def main() -> None:
    parser = argparse.ArgumentParser(description="The common flight through GTSAM.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--heading", type=float, required=True, help="at the start, degrees")
    parser.add_argument("--lever-arm", type=float, nargs=3, required=True)
    parser.add_argument("--binding", action="store_true", help="measure the calls from Python as well")
    a = parser.parse_args()
    lever_arm = np.array(a.lever_arm)
    watch = Stopwatch({"import": time.perf_counter() - _BEGIN})
    with watch.stage("read"):
        log = read_log(a.folder)
    graph, estimate = incremental(log, initial(log, a.heading, lever_arm), lever_arm, watch)
    with watch.stage("levenberg_marquardt"):
        optimizer = gtsam.LevenbergMarquardtOptimizer(graph, estimate, gtsam.LevenbergMarquardtParams())
        values = optimizer.optimize()
    with watch.stage("marginals"):
        marginals = gtsam.Marginals(graph, values)
        covariances = [marginals.marginalCovariance(X(i)) for i in range(len(log.fix_time))]
    with watch.stage("write"):
        a.out.mkdir(parents=True, exist_ok=True)
        write_poses(a.out / "poses.csv", log, values, covariances)
    total = time.perf_counter() - _BEGIN
    result = {
        "version": gtsam.__version__ if hasattr(gtsam, "__version__") else "",
        "keyframes": len(log.fix_time),
        "epochs": len(log.imu_time),
        "stages": watch.seconds,
        "seconds": total,
        "peak_mb": 1024e-6 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "iterations": optimizer.iterations(),
    }
    if a.binding:
        result["binding_seconds"] = binding_seconds(log)
    (a.out / "times.json").write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
