"""Errors of a trajectory against truth.csv: rms of attitude and position after the first five minutes."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geodesy import Array, c_n_e, ecef

SETTLED_AFTER_S = 300.0


@dataclass(frozen=True)
class Poses:
    """Time, geodetic position (rad, rad, m) and roll-pitch-heading (deg), one row each."""

    time_s: Array
    position: Array
    rpy_deg: Array


@dataclass(frozen=True)
class Accuracy:
    """Root mean squares."""

    heading_deg: float
    roll_deg: float
    pitch_deg: float
    north_m: float
    east_m: float
    down_m: float


def read_poses(path: Path) -> Poses:
    """Of a CSV file with the columns of trajectory.csv, or of truth.csv."""
    with path.open(encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    wanted = ["time_s", "lat_deg", "lon_deg", "height_m", "roll_deg", "pitch_deg", "heading_deg"]
    columns = [names.index(name) for name in wanted]
    table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=columns)
    position = np.column_stack([np.deg2rad(table[:, 1:3]), table[:, 3]])
    return Poses(table[:, 0], position, table[:, 4:7])


def read_sbet(path: Path) -> Poses:
    """Of an SBET with wander angle 0: 17 little-endian doubles a record."""
    records = np.fromfile(path, dtype="<f8").reshape(-1, 17)
    return Poses(records[:, 0], records[:, 1:4], np.rad2deg(records[:, 7:10]))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))


def accuracy(poses: Poses, truth: Poses) -> Accuracy:
    """Compare at the common times, from five minutes after the start of the truth on."""
    index = np.searchsorted(truth.time_s, poses.time_s - 1e-4)
    late = (poses.time_s >= truth.time_s[0] + SETTLED_AFTER_S) & (index < truth.time_s.size)
    index = index[late]
    if not index.size or np.abs(truth.time_s[index] - poses.time_s[late]).max() > 1e-4:
        raise ValueError("the trajectory has times that the truth does not have, or none")
    lat, lon, height = truth.position[index].T
    off_e = ecef(*poses.position[late].T) - ecef(lat, lon, height)
    off_n = np.einsum("nji,nj->ni", c_n_e(lat, lon), off_e)
    off_rpy = (poses.rpy_deg[late] - truth.rpy_deg[index] + 180) % 360 - 180
    return Accuracy(
        heading_deg=_rms(off_rpy[:, 2]),
        roll_deg=_rms(off_rpy[:, 0]),
        pitch_deg=_rms(off_rpy[:, 1]),
        north_m=_rms(off_n[:, 0]),
        east_m=_rms(off_n[:, 1]),
        down_m=_rms(off_n[:, 2]),
    )
