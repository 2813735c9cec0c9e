"""SBET and SMRMSG, the binary trajectory files of Applanix, read from their published layout.

Records of little-endian doubles without a header. SBET, 17: time, latitude, longitude [rad], height [m],
three velocities [m/s], roll, pitch, platform heading, wander angle [rad], three accelerations, three angular
rates. SMRMSG, 10: time, one sigma of position NED [m], velocity NED [m/s], roll, pitch, heading [arcmin].
Layout: PDAL, io/SbetCommon.hpp and io/SbetSmrmsgReader.cpp.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from liealign._core import InputError
from liealign.solution import Array

_SBET_DOUBLES, _SMRMSG_DOUBLES = 17, 10
_TIME, _LAT, _LON, _HEIGHT = range(4)
_VELOCITY, _RPY, _WANDER = slice(4, 7), slice(7, 10), 10
# What liealign writes where the data say nothing about the heading: 180 deg.
_UNKNOWN_HEADING_ARCMIN = 180.0 * 60.0


def _records(path: Path, doubles: int) -> Array:
    data = path.read_bytes()
    size = 8 * doubles
    if not data:
        raise InputError(f"{path}: the file is empty; expected records of {doubles} doubles")
    if len(data) % size:
        raise InputError(
            f"{path}: has {len(data)} bytes; expected a multiple of {size}: records of {doubles} doubles"
        )
    return np.frombuffer(data, dtype="<f8").reshape(-1, doubles).astype(np.float64)


def _check(path: Path, records: Array, used: int) -> None:
    bad = np.flatnonzero(~np.isfinite(records[:, :used]).all(axis=1))
    if bad.size:
        raise InputError(f"{path}: record {bad[0] + 1}: is not finite; is this the file of another format?")
    back = np.flatnonzero(np.diff(records[:, _TIME]) <= 0)
    if back.size:
        before, after = records[back[0] : back[0] + 2, _TIME]
        raise InputError(
            f"{path}: record {back[0] + 2}: time is {after}, not after {before}; expected increasing times"
        )


def smrmsg_beside(path: Path) -> Path | None:
    """Return the SMRMSG of an SBET: trajectory.smrmsg of trajectory.sbet, smrmsg_x.out of sbet_x.out."""
    names = (path.with_suffix(".smrmsg"), path.with_name(path.name.replace("sbet", "smrmsg", 1)))
    return next((name for name in names if name != path and name.is_file()), None)


def read_sbet(path: Path) -> dict[str, Any]:
    """Read the arrays of a Track by name; sigmas from the SMRMSG beside it, NaN without one.

    Velocities are along the axes of the wander frame, z down, and true heading is platform heading minus
    wander angle a: v_N = v_x cos a + v_y sin a, v_E = -v_x sin a + v_y cos a.
    """
    r = _records(path, _SBET_DOUBLES)
    _check(path, r, _WANDER + 1)
    for name, column, limit in (("latitude", _LAT, 0.5), ("longitude", _LON, 2.0)):
        bad = np.flatnonzero(np.abs(r[:, column]) > limit * np.pi + 1e-12)
        if bad.size:
            raise InputError(
                f"{path}: record {bad[0] + 1}: the {name} is {r[bad[0], column]:g} rad; expected radians: "
                "is this an SBET?"
            )
    cos, sin = np.cos(r[:, _WANDER]), np.sin(r[:, _WANDER])
    v_x, v_y, v_z = r[:, _VELOCITY].T
    rpy = np.rad2deg(r[:, _RPY] - r[:, [_WANDER]] * [0.0, 0.0, 1.0])
    rpy[:, 2] %= 360.0
    arrays = {
        "time_s": r[:, _TIME],
        "lat_deg": np.rad2deg(r[:, _LAT]),
        "lon_deg": np.rad2deg(r[:, _LON]),
        "height_m": r[:, _HEIGHT],
        "v_n_mps": np.stack([v_x * cos + v_y * sin, v_y * cos - v_x * sin, v_z], axis=1),
        "rpy_deg": rpy,
    }
    return arrays | _read_std(smrmsg_beside(path), r[:, _TIME])


def _read_std(path: Path | None, time_s: Array) -> dict[str, Array]:
    """Sigmas at the times wanted: an SMRMSG may have fewer records than its SBET."""
    std = np.full((time_s.size, _SMRMSG_DOUBLES - 1), np.nan)
    if path is not None:
        r = _records(path, _SMRMSG_DOUBLES)
        _check(path, r, _SMRMSG_DOUBLES)
        r[r[:, 9] >= _UNKNOWN_HEADING_ARCMIN, 9] = np.nan
        for k in range(std.shape[1]):
            std[:, k] = np.interp(time_s, r[:, _TIME], r[:, k + 1], left=np.nan, right=np.nan)
    return {"std_p_n_m": std[:, 0:3], "std_v_n_mps": std[:, 3:6], "std_rpy_deg": std[:, 6:9] / 60.0}
