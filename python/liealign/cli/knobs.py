"""The flags of `liealign simulate` that stand for fields of the simulator: one table."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Concatenate, NamedTuple, ParamSpec

import numpy as np
import typer

from liealign._core import DroneFlight, GnssErrors, ImuErrorSizes, InputError, TypedInErrors
from liealign.cli.flags import keyword, with_parameters

P = ParamSpec("P")

# An antenna at the IMU would be no drone.
LEVER_ARM = "0.1 -0.05 -0.3"


class Knob(NamedTuple):
    """A flag, the field that it sets and whose it is, and what it may be."""

    name: str
    owner: type[DroneFlight] | type[GnssErrors] | type[ImuErrorSizes] | type[TypedInErrors]
    field: str
    shown: str
    unit: str
    help: str
    low: float
    high: float
    words: int = 1
    own_default: str = ""

    @property
    def parameter(self) -> str:
        """The name of the parameter that carries it."""
        return self.name.removeprefix("--").replace("-", "_")

    @property
    def default(self) -> str:
        """Its own default, or else that of the engine, as text."""
        if self.own_default:
            return self.own_default
        default = getattr(self.owner(), self.field)
        if default is None:
            return "none"
        values = np.atleast_1d(np.asarray(default, dtype=np.float64))
        return " ".join(f"{value:g}" for value in values)

    def as_parameter(self) -> inspect.Parameter:
        """Return what typer reads it from."""
        unit = f" [{self.unit}]" if self.unit else ""
        option = typer.Option(
            self.name, metavar=self.shown, help=f"{self.help}{unit}  [default: {self.default}]"
        )
        return keyword(self.parameter, None, Annotated[str | None, option])

    def value(self, text: str) -> float | list[float]:
        """Return the number or numbers in the text.

        Raises
        ------
        InputError
            When they are not as many as expected, no numbers, not finite, or out of range.
        """
        try:
            values = [float(word) for word in text.replace(",", " ").split()]
        except ValueError:
            values = []
        if len(values) != self.words or not all(self.low <= value <= self.high for value in values):
            many = "a number" if self.words == 1 else f"{self.words} numbers"
            unit = f" [{self.unit}]" if self.unit else ""
            raise InputError(
                f'{self.name} is "{text}"; expected {many} from {self.low:g} to {self.high:g}{unit}'
            )
        return values[0] if self.words == 1 else values


_D, _G, _I, _T = DroneFlight, GnssErrors, ImuErrorSizes, TypedInErrors
KNOBS = (
    Knob("--duration", _D, "duration_s", "S", "s", "Whole flight, parked phases included", 1, 7200),
    Knob("--parked-before", _D, "parked_before_s", "S", "s", "Rest before the take-off", 0, 3600),
    Knob("--parked-after", _D, "parked_after_s", "S", "s", "Rest after the landing", 0, 3600),
    Knob("--start-time", _D, "start_time_s", "S", "s", "Stamp of the first sample", 0, 1e6),
    Knob("--heading", _D, "heading_deg", "DEG", "deg", "Heading while parked", -360, 360),
    Knob("--altitude", _D, "altitude_m", "M", "m", "Height of flight above the pad", 1, 1000),
    Knob("--speed", _D, "speed_mps", "MPS", "m/s", "Horizontal speed", 0.5, 30),
    Knob("--acceleration", _D, "acceleration_mps2", "MPS2", "m/s^2", "Its peak on the straight", 0.05, 10),
    Knob("--climb", _D, "climb_mps", "MPS", "m/s", "Speed of the climb", 0.1, 20),
    Knob("--descent", _D, "descent_mps", "MPS", "m/s", "Speed of the descent", 0.1, 20),
    Knob("--line-bearing", _D, "line_bearing_deg", "DEG", "deg", "Bearing of the survey lines", -360, 360),
    Knob("--line-length", _D, "line_length_m", "M", "m", "Length of a line", 5, 10000),
    Knob("--line-spacing", _D, "line_spacing_m", "M", "m", "Distance of the lines", 1, 1000),
    Knob("--crab", _D, "crab_deg", "DEG", "deg", "Nose against the bearing of the lines", -180, 180),
    Knob(
        "--circle-radius", _D, "circle_radius_m", "M", "m", "Radius; 0 = as fits the acceleration", 0, 10000
    ),
    Knob("--nose-follows", _D, "nose_follows", "P", "", "Share of a course's turn the nose takes", -10, 10),
    Knob("--wind", _D, "wind_mps", "MPS", "m/s", "Steady wind", 0, 30),
    Knob("--wind-from", _D, "wind_from_deg", "DEG", "deg", "Where it comes from", -360, 360),
    Knob("--gusts", _D, "gust_mps2", "MPS2", "m/s^2", "Rms acceleration by gusts", 0, 5),
    Knob("--wobble", _D, "attitude_wobble_deg", "DEG", "deg", "Rms wobble of roll and pitch", 0, 10),
    Knob("--lat", _D, "lat_deg", "DEG", "deg", "Latitude of the pad", -89, 89),
    Knob("--lon", _D, "lon_deg", "DEG", "deg", "Longitude of the pad", -180, 360),
    Knob("--height", _D, "height_m", "M", "m", "Height of the pad above the ellipsoid", -500, 9000),
    Knob("--imu-rate", _D, "rate_hz", "HZ", "Hz", "Rate of the IMU", 10, 1000),
    Knob("--gnss-rate", _G, "rate_hz", "HZ", "Hz", "Rate of the fixes", 0.1, 50),
    Knob("--gnss-std", _G, "std_ned_m", "N E D", "m", "Position noise north, east, down", 0.001, 100, 3),
    Knob("--gnss-latency", _G, "latency_s", "S", "s", "Stamps of the fixes are late by this", -5, 5),
    Knob(
        *("--gnss-velocity-std", _G, "velocity_std_ned", "N E D", "m/s"),
        *("Velocity noise north, east, down", 0.001, 100, 3),
    ),
    Knob(
        *("--gnss-correlated-std", _G, "correlated_std_ned_m", "N E D", "m"),
        *("Position error that goes on, north, east, down", 0, 100, 3),
    ),
    Knob("--gnss-correlation-time", _G, "correlation_time_s", "S", "s", "For how long it does", 0.01, 1e6),
    Knob("--gnss-smoothing-time", _G, "smoothing_time_s", "S", "s", "The receiver smooths it over", 0, 1e4),
    Knob(
        *("--gnss-velocity-correlated-std", _G, "velocity_correlated_std_ned", "N E D", "m/s"),
        *("Velocity error that goes on, north, east, down", 0, 100, 3),
    ),
    Knob(
        *("--gnss-velocity-correlation-time", _G, "velocity_correlation_time_s", "S", "s"),
        *("For how long it does", 0.01, 1e6),
    ),
    Knob(
        *("--gnss-velocity-latency", _G, "velocity_latency_s", "S", "s"),
        *("Stamps are late by this for the velocity; none: as for the position", -5, 5),
    ),
    Knob("--gnss-jitter", _G, "stamp_jitter_s", "S", "s", "Sigma of the true epoch about its stamp", 0, 1),
    Knob(
        *("--gnss-arrival-delay", _G, "arrival_delay_s", "S", "s"),
        *("Stamps are of the arrival: mean and sigma of its delay", 0, 1),
    ),
    Knob(
        *("--gnss-step", _G, "step_ned_m", "N E D", "m"),
        *("Steps of latitude, longitude and height", 0, 100, 3),
    ),
    Knob("--gnss-velocity-step", _G, "velocity_step_mps", "MPS", "m/s", "Steps of the velocity", 0, 10),
    Knob(
        *("--gnss-stated-std", _G, "stated_std_ned_m", "N E D", "m"),
        *("Position sigma that is stated; 0 = the true one", 0, 1000, 3),
    ),
    Knob("--gnss-stated-factor", _G, "stated_std_factor", "X", "", "Stated over true sigma", 0.001, 1000),
    Knob(
        *("--gnss-velocity-stated-factor", _G, "stated_velocity_std_factor", "X", ""),
        *("The same of the velocity", 0.001, 1000),
    ),
    Knob(
        *("--gnss-heading-std", _G, "heading_std_deg", "DEG", "deg"),
        *("Noise of the heading of --gnss-heading", 0.001, 180),
    ),
    Knob("--outliers", _G, "outlier_probability", "P", "", "Share of fixes that are wrong", 0, 1),
    Knob("--outlier-size", _G, "outlier_m", "M", "m", "By how much those are wrong", 0, 10000),
    Knob("--accel-bias", _I, "accel_turn_on_ug", "UG", "ug", "Accelerometer bias, sigma on an axis", 0, 1e6),
    Knob("--gyro-bias", _I, "gyro_turn_on_deg_h", "DPH", "deg/h", "Gyro bias, sigma on an axis", 0, 1e6),
    Knob("--accel-scale", _I, "accel_scale_ppm", "PPM", "ppm", "Its scale factors, sigma", 0, 1e5),
    Knob("--gyro-scale", _I, "gyro_scale_ppm", "PPM", "ppm", "Scale factors of the gyros, sigma", 0, 1e5),
    Knob(
        *("--accel-misalignment", _I, "accel_misalignment_deg", "DEG", "deg"),
        *("Turn of its axes about the body's, sigma", 0, 10),
    ),
    Knob(
        *("--gyro-misalignment", _I, "gyro_misalignment_deg", "DEG", "deg"),
        *("The same of the gyros, sigma", 0, 10),
    ),
    Knob(
        *("--accel-vibration", _I, "accel_vibration_mps2", "X Y Z", "m/s^2"),
        *("Vibration in the force, sigma", 0, 1000, 3),
    ),
    Knob(
        *("--gyro-vibration", _I, "gyro_vibration_deg_s", "X Y Z", "deg/s"),
        *("Vibration in the rate, sigma", 0, 1000, 3),
    ),
    Knob(
        *("--vibration-time", _I, "vibration_correlation_time_s", "S", "s"),
        *("How long it remembers", 1e-5, 10),
    ),
    Knob("--noise-scale", _I, "noise_scale", "X", "", "IMU noise over that of the profile", 0, 1000),
    Knob(
        *("--lever-arm", _G, "l_ba_b", "X Y Z", "m", "IMU to antenna: forward, right, down"),
        *(-100, 100, 3, LEVER_ARM),
    ),
    Knob("--lever-arm-std", _T, "lever_arm_std_m", "M", "m", "FLIGHT.toml's is off, each axis", 0, 10),
    Knob("--gnss-latency-std", _T, "latency_std_s", "S", "s", "FLIGHT.toml's is off", 0, 5),
)


def fields_of(owner: type, texts: Mapping[str, str | None]) -> dict[str, Any]:
    """Return the fields of the owner that are given, or have a default of their own."""
    fields = {}
    for knob in KNOBS:
        text = texts.get(knob.parameter)
        if knob.owner is owner and (text is not None or knob.own_default):
            fields[knob.field] = knob.value(knob.own_default if text is None else text)
    return fields


def takes_knobs(
    command: Callable[Concatenate[dict[str, str | None], P], None],
) -> Callable[..., None]:
    """Give a command the KNOBS as parameters; it gets their texts together, as its first argument."""

    def with_knobs(**options: Any) -> None:
        texts = {knob.parameter: options.pop(knob.parameter) for knob in KNOBS}
        command(texts, **options)  # type: ignore[call-arg]

    return with_parameters(with_knobs, command, [knob.as_parameter() for knob in KNOBS])


def in_flags(message: str) -> str:
    """Return what the engine says of a flight, with the flags for the fields."""
    flags = {knob.field: knob.name for knob in KNOBS if knob.owner is DroneFlight}
    return re.sub(r"\w+", lambda word: flags.get(word[0], word[0]), message)
