"""WGS 84 and attitudes for the scripts of the benchmarks, in numpy. Angles in rad, or as the name says."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Number = Array | float

A_M, E2, FLATTENING = 6378137.0, 6.69437999014e-3, 1 / 298.257223563
OMEGA_IE_E = np.array([0.0, 0.0, 7.292115e-5])


def ecef(lat: Number, lon: Number, height: Number) -> Array:
    """Position in ECEF, m, of geodetic coordinates."""
    n = A_M / np.sqrt(1 - E2 * np.sin(lat) ** 2)
    horizontal = (n + height) * np.cos(lat)
    return np.stack(
        [horizontal * np.cos(lon), horizontal * np.sin(lon), (n * (1 - E2) + height) * np.sin(lat)], -1
    )


def geodetic(p: Array) -> tuple[Array, Array, Array]:
    """Latitude, longitude, height above the ellipsoid of positions in ECEF."""
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    r = np.hypot(x, y)
    lat = np.arctan2(z, r * (1 - E2))
    for _ in range(8):
        n = A_M / np.sqrt(1 - E2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + E2 * n * np.sin(lat), r)
    return lat, np.arctan2(y, x), r / np.cos(lat) - A_M / np.sqrt(1 - E2 * np.sin(lat) ** 2)


def c_n_e(lat: Number, lon: Number) -> Array:
    """Rotation from north-east-down to ECEF."""
    sl, cl, so, co = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    rows = ([-sl * co, -so, -cl * co], [-sl * so, co, -cl * so], [cl, np.zeros_like(sl), -sl])
    return np.stack([np.stack(row, -1) for row in rows], -2)


def gravity(lat: Number, height: Number) -> Array:
    """Normal gravity, m/s^2: Somigliana at the ellipsoid, second order in height."""
    s2 = np.sin(lat) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - E2 * s2)
    m = 0.00344978650684
    linear = 2 / A_M * (1 + FLATTENING + m - 2 * FLATTENING * s2)
    return np.asarray(surface * (1 - linear * height + 3 / A_M**2 * height * height))


def c_from_rpy(rpy: Array) -> Array:
    """Rotations from forward-right-down axes of roll, pitch, yaw (ZYX), n by 3."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy).T, np.sin(rpy).T
    rows = (
        [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
        [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
        [-sp, sr * cp, cr * cp],
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


def rpy_deg(c_b_n: Array) -> Array:
    """Roll, pitch and heading in [0, 360) of rotations to north-east-down, degrees, n by 3."""
    roll = np.arctan2(c_b_n[:, 2, 1], c_b_n[:, 2, 2])
    pitch, yaw = -np.arcsin(c_b_n[:, 2, 0]), np.arctan2(c_b_n[:, 1, 0], c_b_n[:, 0, 0])
    angles: Array = np.rad2deg(np.stack([roll, pitch, yaw], -1))
    angles[:, 2] %= 360
    return angles
