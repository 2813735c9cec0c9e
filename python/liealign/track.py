"""Trajectories as files hold them, read back: trajectory.csv and its kin, SBET with SMRMSG."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from liealign._core import InputError
from liealign.sbet import read_sbet
from liealign.solution import Array

# Column, unit, lowest and highest value that is believed.
_INF = math.inf
_STATE = (
    ("time_s", "s", -_INF, _INF),
    ("lat_deg", "deg", -90.0, 90.0),
    ("lon_deg", "deg", -180.0, 360.0),
    ("height_m", "m", -_INF, _INF),
    ("vn_mps", "m/s", -_INF, _INF),
    ("ve_mps", "m/s", -_INF, _INF),
    ("vd_mps", "m/s", -_INF, _INF),
    ("roll_deg", "deg", -360.0, 360.0),
    ("pitch_deg", "deg", -90.0, 90.0),
    ("heading_deg", "deg", -360.0, 360.0),
)
_STD = tuple(
    (f"std_{name}", unit, 0.0, _INF)
    for name, unit in (
        *(("n_m", "m"), ("e_m", "m"), ("d_m", "m")),
        *(("vn_mps", "m/s"), ("ve_mps", "m/s"), ("vd_mps", "m/s")),
        *(("roll_deg", "deg"), ("pitch_deg", "deg"), ("heading_deg", "deg")),
    )
)
_RELATIVE_STD = tuple((f"relative_std_{axis}_m", "m", 0.0, _INF) for axis in "ned")
_SIGMAS = (*_STD, *_RELATIVE_STD)
_SBET_ENDINGS = {".sbet", ".out"}


@dataclass(frozen=True, eq=False)
class Track:
    """Position, velocity and attitude at n epochs.

    Attributes
    ----------
    time_s
        (n,) increasing.
    lat_deg, lon_deg, height_m
        (n,) WGS 84, height above the ellipsoid.
    v_n_mps
        (n, 3) velocity against the Earth, NED.
    rpy_deg
        (n, 3) roll, pitch, heading (ZYX, body to NED).
    std_p_n_m, std_v_n_mps, std_rpy_deg
        (n, 3) one sigma of position NED, velocity NED, roll, pitch, heading; NaN where none is stated.
    relative_std_p_n_m
        (n, 3) one sigma of the position in the receiver's own datum, NED; NaN where none is stated.
    name
        Of the file, for messages.
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
    name: str = ""

    @classmethod
    def of(cls, source: Any) -> Track:
        """Take over a Track, a Trajectory, the arrays of `SimulatedFlight.truth()`, or a file by its name.

        Raises
        ------
        InputError
            When a file cannot be used.
        TypeError
            When it is none of these.
        """
        if isinstance(source, Track):
            return source
        if isinstance(source, str | PathLike):
            return read_trajectory(source)
        arrays = source if isinstance(source, Mapping) else getattr(source, "__dict__", {})
        names = [f.name for f in fields(cls) if f.name != "name"]
        lacking = [name for name in names if name not in arrays and "std_" not in name]
        if lacking:
            raise TypeError(f"a {type(source).__name__} is no trajectory: {', '.join(lacking)} missing")
        absent = np.full((len(arrays["time_s"]), 3), np.nan)
        columns: dict[str, Any] = {name: np.asarray(arrays.get(name, absent)) for name in names}
        return cls(**columns)


def read_trajectory(path: str | PathLike[str]) -> Track:
    """Read trajectory.csv, filtered.csv, truth.csv, or SBET (*.sbet, *.out) with the SMRMSG beside it.

    Raises
    ------
    InputError
        `file:line:column: ...` for the first thing in a CSV file that cannot be used, `file: record n: ...`
        in an SBET.
    """
    file = Path(path)
    try:
        if file.is_dir():
            raise InputError(f"{path}: is a folder; name the file in it, such as {file / 'trajectory.csv'}")
        if file.suffix.lower() in _SBET_ENDINGS:
            arrays = read_sbet(file)
            absent = np.full_like(arrays["std_p_n_m"], np.nan)
            return Track(**arrays, relative_std_p_n_m=absent, name=str(path))
        return _read_csv(file)
    except OSError as error:
        raise InputError(f"{error.filename or path}: cannot be read: {error.strerror}") from None


# ---- CSV: the rules of the reader in docs/formats.md -------------------------------------------------------


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of each line that is neither blank nor a comment."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.reader(file)
        try:
            rows = [(reader.line_num, row) for row in reader]
        except UnicodeDecodeError:
            raise InputError(
                f"{path}: is not UTF-8 text; expected a trajectory.csv, or an SBET named *.sbet or *.out"
            ) from None
        except csv.Error as error:
            raise InputError(f"{path}:{reader.line_num}:1: is not a line of a CSV file: {error}") from None
    return [(line, row) for line, row in rows if "".join(row).strip() and not row[0].lstrip().startswith("#")]


def _read_csv(path: Path) -> Track:
    rows = _rows(path)
    wanted = ",".join(column[0] for column in _STATE)
    if not rows:
        raise InputError(f"{path}: the file is empty; expected the header {wanted}")
    header_line, header = rows[0][0], [cell.strip() for cell in rows[0][1]]
    where = f"{path}:{header_line}"
    for name, *_ in (*_STATE, *_SIGMAS):
        if header.count(name) > 1:
            raise InputError(f"{where}:{_last(header, name)}: column {name} is there twice; expected it once")
    for name, unit, *_ in _STATE:
        if name not in header:
            raise InputError(f"{where}:1: column {name} [{unit}] is missing; expected the columns {wanted}")
    columns = [column for column in (*_STATE, *_SIGMAS) if column[0] in header]
    at = [header.index(column[0]) for column in columns]
    if len(rows) == 1:
        raise InputError(f"{where}:1: no row follows the header; expected at least one row of numbers")
    table = np.empty((len(rows) - 1, len(columns)))
    for i, (line, row) in enumerate(rows[1:]):
        if len(row) != len(header):
            raise InputError(
                f"{path}:{line}:{min(len(row), len(header) + 1)}: the row has {len(row)} cells; "
                f"expected {len(header)} as in the header"
            )
        try:
            table[i] = [float(row[k]) for k in at]
        except ValueError:
            table[i] = [_cell(path, line, row, k, column) for k, column in zip(at, columns, strict=True)]
    _check(path, table, columns, at, rows)
    return _track(path, dict(zip((column[0] for column in columns), table.T, strict=True)))


def _last(header: list[str], name: str) -> int:
    return len(header) - header[::-1].index(name)


def _cell(path: Path, line: int, row: list[str], k: int, column: tuple[str, str, float, float]) -> float:
    """Return the number; NaN for a sigma that is not stated."""
    text = row[k].strip()
    if not text and column in _SIGMAS:
        return math.nan
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{path}:{line}:{k + 1}: {_refused(column, text)}") from None


def _refused(column: tuple[str, str, float, float], text: str) -> str:
    name, unit, low, high = column
    allowed = "a finite number"
    if low == 0.0:
        allowed = "a finite number, 0 or more, or nothing"
    elif math.isfinite(low):
        allowed = f"a number from {low:g} to {high:g}"
    return f'{name} is "{text}"; expected {allowed} [{unit}]'


def _check(
    path: Path,
    table: Array,
    columns: list[tuple[str, str, float, float]],
    at: list[int],
    rows: list[tuple[int, list[str]]],
) -> None:
    """Refuse the first value out of range, and a time that is not after the one before."""
    bad: NDArray[np.bool_] = np.zeros(table.shape, dtype=np.bool_)
    for k, column in enumerate(columns):
        good = np.isfinite(table[:, k]) & (table[:, k] >= column[2]) & (table[:, k] <= column[3])
        if column in _SIGMAS:  # NaN stands for an empty cell; the word itself is refused
            texts = (rows[i + 1][1][at[k]] for i in np.flatnonzero(~good))
            good[~good] = [not text.strip() for text in texts]
        bad[:, k] = ~good
    if bad.any():
        i, k = (int(index) for index in np.argwhere(bad)[0])
        line, row = rows[i + 1]
        raise InputError(f"{path}:{line}:{at[k] + 1}: {_refused(columns[k], row[at[k]].strip())}")
    back = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if back.size:
        (before, _), (line, row) = rows[int(back[0]) + 1], rows[int(back[0]) + 2]
        raise InputError(
            f"{path}:{line}:{at[0] + 1}: time_s is {row[at[0]].strip()}, not after that of line {before}; "
            "expected increasing times: sort the file by time_s or remove the line"
        )


def _track(path: Path, columns: dict[str, Array]) -> Track:
    absent = np.full(columns["time_s"].size, np.nan)

    def stacked(*names: str) -> Array:
        return np.stack([columns.get(name, absent) for name in names], axis=1)

    return Track(
        time_s=columns["time_s"],
        lat_deg=columns["lat_deg"],
        lon_deg=columns["lon_deg"],
        height_m=columns["height_m"],
        v_n_mps=stacked("vn_mps", "ve_mps", "vd_mps"),
        rpy_deg=stacked("roll_deg", "pitch_deg", "heading_deg"),
        std_p_n_m=stacked("std_n_m", "std_e_m", "std_d_m"),
        std_v_n_mps=stacked("std_vn_mps", "std_ve_mps", "std_vd_mps"),
        std_rpy_deg=stacked("std_roll_deg", "std_pitch_deg", "std_heading_deg"),
        relative_std_p_n_m=stacked(*(column[0] for column in _RELATIVE_STD)),
        name=str(path),
    )
