"""How far a trajectory is from a better one, channel by channel, and whether its sigmas say so.

    delta p_n = C_e_n (p_eb_e - p_eb_e,truth),   delta v_n, delta rpy: differences, angles within +-180 deg
    rms / sigma = sqrt(mean((delta / sigma)^2)): 1 where the stated sigma is true

The truth is interpolated to the times of the trajectory: position linearly in ECEF, velocity linearly, angles
linearly along the shorter way. Nothing is extrapolated, and nothing bridged over a gap in the truth.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from liealign import _core
from liealign._core import InputError
from liealign.frames import ned_rows
from liealign.solution import Array, Trajectory
from liealign.track import Track

if TYPE_CHECKING:
    import pandas as pd

    TrackLike = Track | Trajectory | _core.TruthColumns | str | PathLike[str]

# Stamps in files are rounded to the microsecond.
_SLACK_S = 1e-6
# A pause of the truth this many times its usual interval is a gap.
_GAP_INTERVALS = 3.0


@dataclass(frozen=True)
class ChannelError:
    """The errors of one channel over the epochs compared; 95 % and maximum are of their size, mean is signed.

    The next three are None where the trajectory states no sigma: the share of errors inside one and two sigma
    (68 % and 95 % for normal errors), and the rms of error over sigma (1 where the sigma is true).

    `rms_relative_sigma` is the stated sigma in the receiver's own datum, of north, east and down where the
    trajectory states it. It is of another error than the one compared, hence without a ratio: what lasts over
    many fixes moves a trajectory as a whole, and only what is left of it is relative.
    """

    name: str
    unit: str
    mean: float
    rms: float
    p95: float
    max: float
    within_1_sigma: float | None
    within_2_sigma: float | None
    rms_over_sigma: float | None
    rms_relative_sigma: float | None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Errors of a trajectory against truth.

    Attributes
    ----------
    begin_time_s, end_time_s
        First and last epoch compared.
    epochs_outside, epochs_in_gaps
        Epochs of the trajectory left out: outside the truth (or the time asked for), in a gap of the truth.
    channels
        north, east, down, horizontal, the velocity along north, east, down, roll, pitch, heading.
    time_s
        (n,) epochs compared.
    error_p_n_m, error_v_n_mps, error_rpy_deg
        (n, 3) trajectory minus truth: position and velocity NED, roll, pitch, heading.
    """

    begin_time_s: float
    end_time_s: float
    epochs: int
    epochs_outside: int
    epochs_in_gaps: int
    channels: tuple[ChannelError, ...]
    time_s: Array = field(repr=False)
    error_p_n_m: Array = field(repr=False)
    error_v_n_mps: Array = field(repr=False)
    error_rpy_deg: Array = field(repr=False)

    def __getitem__(self, name: str) -> ChannelError:
        """Return the channel of that name."""
        return {channel.name: channel for channel in self.channels}[name]

    def to_dict(self) -> dict[str, Any]:
        """Return what `liealign compare --json` prints."""
        numbers = ("begin_time_s", "end_time_s", "epochs", "epochs_outside", "epochs_in_gaps")
        return {name: getattr(self, name) for name in numbers} | {
            "channels": [asdict(channel) for channel in self.channels]
        }

    def to_frame(self) -> pd.DataFrame:
        """Make a pandas DataFrame with one row for each channel, by its name.

        Raises
        ------
        ImportError
            When pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise ImportError('to_frame() needs pandas: pip install "liealign[frame]"') from None
        return pd.DataFrame([asdict(channel) for channel in self.channels]).set_index("name")


def compare(
    truth: TrackLike, found: TrackLike, *, from_s: float | None = None, to_s: float | None = None
) -> Comparison:
    """Compare a trajectory with truth, at the epochs of the trajectory that the truth covers.

    Parameters
    ----------
    truth, found
        Each a `Solution` or `Trajectory`, a `Track` from `read_trajectory`, the arrays of
        `SimulatedFlight.truth()`, or the name of a file. Both must be of the same point and axes.
    from_s, to_s
        First and last time to compare; without them all.

    Raises
    ------
    InputError
        When a file cannot be used, or the two share no time.
    """
    for which, value in (("first", from_s), ("last", to_s)):
        if value is not None and not math.isfinite(value):
            raise InputError(f"the {which} time to compare is {value}; expected a finite number [s]")
    t, f = Track.of(truth), Track.of(found)
    inside, whole = _epochs(t, f, from_s, to_s)
    time_s = f.time_s[whole]
    position, velocity, attitude = _at(t, time_s)
    p_e = _core.ecef_from_geodetic(f.lat_deg[whole], f.lon_deg[whole], f.height_m[whole])
    errors = np.hstack(
        [
            np.einsum("kij,kj->ki", ned_rows(*_core.geodetic_from_ecef(position)[:2]), p_e - position),
            f.v_n_mps[whole] - velocity,
            wrap_deg(f.rpy_deg[whole] - attitude),
        ]
    )
    std = np.hstack([f.std_p_n_m, f.std_v_n_mps, f.std_rpy_deg])[whole]
    relative = np.hstack([f.relative_std_p_n_m[whole], np.full((time_s.size, 6), np.nan)])
    names = ("north", "east", "down", "vn", "ve", "vd", "roll", "pitch", "heading")
    units = ("m", "m/s", "deg")
    channels = [
        _channel(name, units[k // 3], errors[:, k], std[:, k], relative[:, k]) for k, name in enumerate(names)
    ]
    horizontal = np.hypot(errors[:, 0], errors[:, 1])
    absent = np.full_like(horizontal, np.nan)
    channels.insert(3, _channel("horizontal", "m", horizontal, absent, absent))
    return Comparison(
        begin_time_s=float(time_s[0]),
        end_time_s=float(time_s[-1]),
        epochs=time_s.size,
        epochs_outside=f.time_s.size - int(inside.sum()),
        epochs_in_gaps=int(inside.sum()) - time_s.size,
        channels=tuple(channels),
        time_s=time_s,
        error_p_n_m=errors[:, 0:3],
        error_v_n_mps=errors[:, 3:6],
        error_rpy_deg=errors[:, 6:9],
    )


def wrap_deg(angle: Array) -> Array:
    """Return the angles in [-180, 180)."""
    wrapped: Array = (angle + 180.0) % 360.0 - 180.0
    return wrapped


def _span(track: Track, what: str) -> str:
    name = track.name or what
    return f"{name} covers {track.time_s[0]:.3f} s to {track.time_s[-1]:.3f} s"


def _epochs(
    truth: Track, found: Track, from_s: float | None, to_s: float | None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Epochs inside the truth and the time asked for, and those of them that are in no gap of the truth."""
    for track, what in ((truth, "the truth"), (found, "the trajectory")):
        if track.time_s.size == 0 or not (np.diff(track.time_s) > 0).all():
            raise InputError(f"{track.name or what}: expected at least one epoch, and increasing times")
    low = max(truth.time_s[0] - _SLACK_S, -math.inf if from_s is None else from_s)
    high = min(truth.time_s[-1] + _SLACK_S, math.inf if to_s is None else to_s)
    inside = (found.time_s >= low) & (found.time_s <= high)
    if not inside.any():
        asked = [f"from {from_s:g} s"] if from_s is not None else []
        asked += [f"to {to_s:g} s"] if to_s is not None else []
        wanted = f" {' '.join(asked)}" if asked else ""
        raise InputError(
            f"no epoch to compare{wanted}: {_span(truth, 'the truth')}, {_span(found, 'the trajectory')}; "
            "bring both to one time scale"
        )
    if truth.time_s.size < 2:
        return inside, inside
    steps = np.diff(truth.time_s)
    k, a = _place(truth, found.time_s)
    on_epoch = (a * steps[k] <= _SLACK_S) | ((1.0 - a) * steps[k] <= _SLACK_S)
    whole = inside & (on_epoch | (steps[k] <= _GAP_INTERVALS * float(np.median(steps))))
    if not whole.any():
        raise InputError(f"every epoch to compare is in a gap of {truth.name or 'the truth'}")
    return inside, whole


def _place(truth: Track, time_s: Array) -> tuple[NDArray[np.intp], Array]:
    """Where times lie: a of the way from epoch k of the truth to the next one."""
    k = np.clip(np.searchsorted(truth.time_s, time_s, side="right") - 1, 0, truth.time_s.size - 2)
    a = (time_s - truth.time_s[k]) / (truth.time_s[k + 1] - truth.time_s[k])
    return k, np.clip(a, 0.0, 1.0)


def _at(truth: Track, time_s: Array) -> tuple[Array, Array, Array]:
    """ECEF position [m], velocity NED [m/s] and angles [deg] of the truth, each (n, 3)."""
    p_e = _core.ecef_from_geodetic(truth.lat_deg, truth.lon_deg, truth.height_m)
    if truth.time_s.size < 2:
        n = time_s.size
        return p_e[[0] * n], truth.v_n_mps[[0] * n], truth.rpy_deg[[0] * n]
    k, fraction = _place(truth, time_s)
    a = fraction[:, np.newaxis]
    position = p_e[k] + a * (p_e[k + 1] - p_e[k])
    velocity = truth.v_n_mps[k] + a * (truth.v_n_mps[k + 1] - truth.v_n_mps[k])
    attitude = truth.rpy_deg[k] + a * wrap_deg(truth.rpy_deg[k + 1] - truth.rpy_deg[k])
    return position, velocity, attitude


def _channel(name: str, unit: str, error: Array, std: Array, relative_std: Array) -> ChannelError:
    size = np.abs(error)
    stated = std > 0
    ratio = size[stated] / std[stated]
    relative = relative_std[np.isfinite(relative_std)]
    return ChannelError(
        name=name,
        unit=unit,
        mean=float(error.mean()),
        rms=float(np.sqrt((error**2).mean())),
        p95=float(np.quantile(size, 0.95)),
        max=float(size.max()),
        within_1_sigma=float((ratio <= 1.0).mean()) if ratio.size else None,
        within_2_sigma=float((ratio <= 2.0).mean()) if ratio.size else None,
        rms_over_sigma=float(np.sqrt((ratio**2).mean())) if ratio.size else None,
        rms_relative_sigma=float(np.sqrt((relative**2).mean())) if relative.size else None,
    )
