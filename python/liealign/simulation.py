"""Simulated sensors along a trajectory that is given: of a real flight, or made by another program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from liealign import _core
from liealign._core import (
    Config,
    DroneFlight,
    Error,
    GnssErrors,
    ImuErrorSizes,
    InputError,
    SimulatedFlight,
    TypedInErrors,
)
from liealign.flight import make_config
from liealign.track import Track

if TYPE_CHECKING:
    from liealign.comparison import TrackLike

_RATE_HZ, _OVERSAMPLE = DroneFlight().rate_hz, DroneFlight().oversample


def simulate_along(
    track: TrackLike,
    *,
    gnss: GnssErrors | None = None,
    config: Config | Mapping[str, Any] | None = None,
    seed: int = 1,
    imu: ImuErrorSizes | None = None,
    rate_hz: float = _RATE_HZ,
    oversample: int = _OVERSAMPLE,
    typed_in: TypedInErrors | None = None,
) -> SimulatedFlight:
    """Simulate the IMU and GNSS logs of a flight along a trajectory.

    Cubic splines go through position and roll, pitch, heading of the track (Eq. 67); the velocity is the
    derivative of the position, that of the track is not used. The truth of what is returned is at the stamps
    of the simulated IMU, from the first time of the track on.

    Parameters
    ----------
    track
        A `Solution` or `Trajectory`, a `Track` from `read_trajectory`, arrays by the names of a `Track` as
        from `SimulatedFlight.truth()`, or the name of a file (CSV, SBET): of the IMU and its axes,
        forward-right-down. At least four points, (n,) and (n, 3), at most 2 s apart.
    gnss
        Rate, lever arm, latencies and errors of the fixes; without it the defaults.
    config
        A Config, or keys such as {"imu.model": "bmi088"}; `imu.model` says the noise.
    seed
        Same seed, same bits.
    imu
        Sizes of the IMU errors; without it those of TAES table I.
    rate_hz
        Of the IMU [Hz], 1 to 10000.
    oversample
        Steps of the simulator in one IMU sample, 1 or more.
    typed_in
        By how much lever arm and latency of the config are off; without it not at all.

    Raises
    ------
    InputError
        When a file cannot be used, arrays do not fit together, or the points are no flight: fewer than
        four, a value that is not finite, a height outside -1 to 100 km, times that do not increase or are
        more than 2 s apart, a pitch within 0.5 deg of ±90 deg, a roll or heading that turns by more than
        170 deg from one point to the next, or an acceleration above 200 m/s². Says which point, counted
        from 0.
    TypeError
        When `track` is none of these.
    Error
        When a field of `gnss`, `imu` or `typed_in`, the rate or `oversample` is out of range.
    """
    points = Track.of(track)
    try:
        return _core.simulate_track(
            points.time_s,
            points.lat_deg,
            points.lon_deg,
            points.height_m,
            points.rpy_deg,
            rate_hz,
            oversample,
            gnss or GnssErrors(),
            config if isinstance(config, Config) else make_config(config),
            seed,
            imu or ImuErrorSizes(),
            typed_in or TypedInErrors(),
        )
    except Error as error:
        text = str(error)
        if not text.startswith("track: "):
            raise
        raise InputError(f"{points.name}: {text.removeprefix('track: ')}" if points.name else text) from None
