"""The door: a flight from FLIGHT.toml, from native files, or from arrays.

Whatever is refused is refused here or in the engine's readers, with the place, the value and what is allowed.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from liealign import _core
from liealign._core import Config, Flight, InputError
from liealign.toml_entries import read_toml_entries

if TYPE_CHECKING:
    from liealign._core import Entry

# Arrays of times, of standard deviations, those that may hold NaN, and those that need another.
_TIMES = ("imu_time_s", "gnss_time_s", "baro_time_s")
_SIGMAS = ("std_p_n_m", "std_v_n_mps", "std_heading_deg", "baro_std_m")
_MAY_LACK = ("heading_deg", "std_heading_deg")
_NEEDS = {
    "std_v_n_mps": "v_n_mps",
    "heading_deg": "std_heading_deg",
    "std_heading_deg": "heading_deg",
    "baro_time_s": "baro_height_m",
    "baro_height_m": "baro_time_s",
    "baro_std_m": "baro_height_m",
}
FILE_KEYS = ("imu.file", "gnss.file", "baro.file")


def _plain(value: Any) -> Any:
    """Numpy scalars and arrays, and paths, as the plain values that TOML has."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    return fspath(value) if isinstance(value, PathLike) else value


def make_config(
    overrides: Mapping[str, Any] | None = None, *, base: Config | None = None, source: str = ""
) -> Config:
    """Make a configuration from dotted keys, such as {"gnss.latency_s": 0.1}.

    Parameters
    ----------
    overrides
        Values by key; the keys, their units and defaults are listed by `config_fields()`.
    base
        The configuration to start from; without it the defaults.
    source
        What error messages name as the place, for instance a flag.

    Raises
    ------
    ConfigError
        For an unknown key (naming the nearest one), a wrong type, a value out of range.
    """
    entries: list[Entry] = [(key, _plain(value), 0, 0) for key, value in (overrides or {}).items()]
    return _core.apply_config(base or Config(), entries, source)


def read_config(toml: str | PathLike[str]) -> Config:
    """Read the configuration in a FLIGHT.toml. File names in it are relative to its folder.

    Raises
    ------
    InputError
        When the file cannot be read.
    ConfigError
        `FLIGHT.toml:line:column: ...` when it is not valid TOML or a key or value cannot be used.
    """
    file = Path(toml)
    return _core.files_from(str(file), _core.apply_config(Config(), read_toml_entries(file), str(file)))


def read_flight(
    toml: str | PathLike[str] | None = None,
    *,
    imu: str | PathLike[str] | None = None,
    gnss: str | PathLike[str] | None = None,
    baro: str | PathLike[str] | None = None,
    **overrides: Any,
) -> Flight:
    """Read a flight from the files that FLIGHT.toml or the arguments name.

    Parameters
    ----------
    toml
        A FLIGHT.toml; file names in it are relative to its folder.
    imu, gnss, baro
        Native imu.csv, gnss.csv and baro.csv, instead of those that FLIGHT.toml names.
    **overrides
        Configuration keys, stronger than FLIGHT.toml, such as `**{"gnss.latency_s": -0.15}`.

    Raises
    ------
    InputError
        `file:line:column: ...` for the first thing in a file that cannot be used.
    ConfigError
        For a key or value that cannot be used, or when a file is not named.
    """
    config = read_config(toml) if toml is not None else Config()
    files = {key: name for key, name in zip(FILE_KEYS, (imu, gnss, baro), strict=True) if name is not None}
    return _core.read_flight(make_config({**files, **overrides}, base=config))


def flight_from_arrays(
    *,
    imu_time_s: ArrayLike,
    omega_ib_b_rps: ArrayLike,
    f_ib_b_mps2: ArrayLike,
    gnss_time_s: ArrayLike,
    lat_deg: ArrayLike,
    lon_deg: ArrayLike,
    height_m: ArrayLike,
    std_p_n_m: ArrayLike,
    cov_p_n_m2: ArrayLike | None = None,
    v_n_mps: ArrayLike | None = None,
    std_v_n_mps: ArrayLike | None = None,
    fix: ArrayLike | None = None,
    heading_deg: ArrayLike | None = None,
    std_heading_deg: ArrayLike | None = None,
    baro_time_s: ArrayLike | None = None,
    baro_height_m: ArrayLike | None = None,
    baro_std_m: ArrayLike | None = None,
    config: Config | Mapping[str, Any] | None = None,
) -> Flight:
    """Make a flight from numpy arrays: n IMU samples, m fixes, k heights of a barometer.

    Parameters
    ----------
    imu_time_s
        (n,) s, increasing.
    omega_ib_b_rps, f_ib_b_mps2
        (n, 3) rotation rate [rad/s] and specific force [m/s²], in the sensor axes that `imu.axes` declares.
    gnss_time_s
        (m,) s, increasing, on the scale of the IMU; t_true = gnss_time_s - gnss.latency_s.
    lat_deg, lon_deg, height_m
        (m,) of the antenna; height above the ellipsoid.
    std_p_n_m
        (m, 3) standard deviation north, east, down [m].
    cov_p_n_m2
        (m, 3) covariance NE, ND, ED [m²]; without it zero.
    v_n_mps, std_v_n_mps
        (m, 3) velocity north, east, down [m/s] and its standard deviation.
    fix
        (m,) quality as RTKLIB's Q; see `gnss.accept_fix`.
    heading_deg, std_heading_deg
        (m,) direction of a dual antenna's baseline, clockwise from true north, and its standard deviation
        [deg], NaN where a fix has none; see `gnss.heading_offset_deg`.
    baro_time_s, baro_height_m, baro_std_m
        (k,) times [s], increasing, on the scale of the IMU; heights of a barometer [m], positive up, above a
        level of its own; their standard deviation [m], without it `baro.std_m`.
    config
        A Config, or keys such as {"gnss.lever_arm_b_m": [0.1, -0.05, -0.3]}.

    Raises
    ------
    InputError
        `name[row, column] is value; expected ...` for the first value that cannot be used, or a wrong shape.
    ConfigError
        For a key or value of `config` that cannot be used.
    """
    optional = {
        "cov_p_n_m2": cov_p_n_m2,
        "v_n_mps": v_n_mps,
        "std_v_n_mps": std_v_n_mps,
        "fix": fix,
        "heading_deg": heading_deg,
        "std_heading_deg": std_heading_deg,
        "baro_time_s": baro_time_s,
        "baro_height_m": baro_height_m,
        "baro_std_m": baro_std_m,
    }
    arrays: dict[str, NDArray[np.float64]] = {
        name: _array(name, value)
        for name, value in {
            "imu_time_s": imu_time_s,
            "omega_ib_b_rps": omega_ib_b_rps,
            "f_ib_b_mps2": f_ib_b_mps2,
            "gnss_time_s": gnss_time_s,
            "lat_deg": lat_deg,
            "lon_deg": lon_deg,
            "height_m": height_m,
            "std_p_n_m": std_p_n_m,
            **{name: value for name, value in optional.items() if value is not None},
        }.items()
    }
    lat, lon = arrays["lat_deg"], arrays["lon_deg"]
    for name in (name for name in _TIMES if name in arrays):
        later = np.diff(arrays[name], prepend=-np.inf) > 0
        _check(name, arrays[name], later, "a time later than the one before")
    _check("lat_deg", lat, np.abs(lat) <= 90, "a number from -90 to 90")
    _check("lon_deg", lon, (lon >= -180) & (lon <= 360), "a number from -180 to 360")
    for name in (name for name in _SIGMAS if name in arrays):
        _check(name, arrays[name], ~(arrays[name] <= 0), "a number above 0")
    for name, other in _NEEDS.items():
        if name in arrays and other not in arrays:
            raise InputError(f"{name} is given without {other}; expected both or neither")
    made = config if isinstance(config, Config) else make_config(config)
    if "heading_deg" in arrays:
        both = np.isnan(arrays["heading_deg"]) == np.isnan(arrays["std_heading_deg"])
        _check(
            "std_heading_deg", arrays["std_heading_deg"], both, "NaN where heading_deg is, and nowhere else"
        )
    flight = Flight(config=made, **arrays)
    _check_covariance(flight)
    return flight


def _array(name: str, value: ArrayLike) -> NDArray[np.float64]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of numbers; expected float64, (n,) or (n, 3)") from None
    if array.ndim not in (1, 2) or array.shape[0] == 0:
        raise InputError(f"{name} has shape {array.shape}; expected (n,) or (n, 3) with at least one row")
    good = ~np.isinf(array) if name in _MAY_LACK else np.isfinite(array)
    _check(name, array, good, "a finite number")
    return array


def _check(name: str, array: NDArray[np.float64], good: NDArray[np.bool_], expected: str) -> None:
    if bool(good.all()):
        return
    at = tuple(int(i) for i in np.argwhere(~good)[0])
    raise InputError(f"{name}[{', '.join(map(str, at))}] is {array[at]}; expected {expected}")


def _check_covariance(flight: Flight) -> None:
    covariance = flight.gnss()["P_n_m2"]
    smallest = np.linalg.eigvalsh(covariance)[:, 0]
    if bool((smallest > 0).all()):
        return
    row = int(np.argmin(smallest > 0))
    raise InputError(
        f"cov_p_n_m2[{row}] does not fit std_p_n_m[{row}]: the covariance is not positive definite; "
        "expected NE, ND, ED in m²"
    )
