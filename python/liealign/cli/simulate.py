"""`liealign simulate` and `liealign demo`: a drone flight with its truth, as files."""

from __future__ import annotations

import inspect
import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Concatenate, NamedTuple, ParamSpec

import numpy as np
import typer

import liealign
from liealign import _core, console
from liealign._core import DroneFlight, Error, GnssErrors, InputError, SimulatedFlight
from liealign.cli.flags import keyword, with_parameters
from liealign.cli.run import Quiet
from liealign.cli.work import check_folder, exit_codes, run_to_folder
from liealign.comparison import compare, wrap_deg
from liealign.flight import make_config, read_config
from liealign.solution import Solution

P = ParamSpec("P")

FLIGHT_FILES = ("FLIGHT.toml", "imu.csv", "gnss.csv", "truth.csv")
# An hour and a half at 200 Hz; the simulator works in memory, on eight times as many steps.
MAX_SAMPLES = 1_000_000


# An antenna at the IMU would be no drone.
LEVER_ARM = "0.1 -0.05 -0.3"


# ---- the flags ---------------------------------------------------------------------------------------------


class Knob(NamedTuple):
    """A flag, the field of DroneFlight or GnssErrors that it sets, and what it may be."""

    name: str
    owner: type[DroneFlight] | type[GnssErrors]
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
        values = np.atleast_1d(np.asarray(getattr(self.owner(), self.field), dtype=np.float64))
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


_D, _G = DroneFlight, GnssErrors
KNOBS = (
    Knob("--duration", _D, "duration_s", "S", "s", "Whole flight, parked phases included", 1, 7200),
    Knob("--parked-before", _D, "parked_before_s", "S", "s", "Rest before the take-off", 0, 3600),
    Knob("--parked-after", _D, "parked_after_s", "S", "s", "Rest after the landing", 0, 3600),
    Knob("--start-time", _D, "start_time_s", "S", "s", "Stamp of the first sample", 0, 1e6),
    Knob("--heading", _D, "heading_deg", "DEG", "deg", "Heading while parked", -360, 360),
    Knob("--altitude", _D, "altitude_m", "M", "m", "Height of flight above the pad", 1, 1000),
    Knob("--speed", _D, "speed_mps", "MPS", "m/s", "Horizontal speed", 0.5, 30),
    Knob("--climb", _D, "climb_mps", "MPS", "m/s", "Speed of the climb", 0.1, 20),
    Knob("--descent", _D, "descent_mps", "MPS", "m/s", "Speed of the descent", 0.1, 20),
    Knob("--line-bearing", _D, "line_bearing_deg", "DEG", "deg", "Bearing of the survey lines", -360, 360),
    Knob("--line-length", _D, "line_length_m", "M", "m", "Length of a line", 5, 10000),
    Knob("--line-spacing", _D, "line_spacing_m", "M", "m", "Distance of the lines", 1, 1000),
    Knob("--crab", _D, "crab_deg", "DEG", "deg", "Nose against the bearing of the lines", -180, 180),
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
    Knob("--outliers", _G, "outlier_probability", "P", "", "Share of fixes that are wrong", 0, 1),
    Knob("--outlier-size", _G, "outlier_m", "M", "m", "By how much those are wrong", 0, 10000),
    Knob(
        *("--lever-arm", _G, "l_ba_b", "X Y Z", "m", "IMU to antenna: forward, right, down"),
        *(-100, 100, 3, LEVER_ARM),
    ),
)


def _fields(owner: type, texts: Mapping[str, str | None]) -> dict[str, Any]:
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


# ---- the work ----------------------------------------------------------------------------------------------


def check_target(folder: Path) -> None:
    """Refuse to overwrite a flight that is not simulated: one without truth.csv.

    Raises
    ------
    InputError
        When the folder is a file, or holds such a flight.
    """
    check_folder(folder)
    there = [name for name in FLIGHT_FILES if (folder / name).exists()]
    if there and "truth.csv" not in there:
        raise InputError(
            f"{folder / there[0]}: exists, and without truth.csv beside it it is no simulated flight; "
            "choose another folder (-o DIR)"
        )


def make_flight(
    drone: DroneFlight, gnss: GnssErrors, overrides: dict[str, Any], seed: int, folder: Path
) -> SimulatedFlight:
    """Simulate and write the four files.

    Raises
    ------
    InputError
        When they do not make a flight; the message names the flags for the fields.
    """
    try:
        simulated = liealign.simulate_flight(drone, gnss, make_config(overrides), seed)
    except Error as error:
        flags = {knob.field: knob.name for knob in KNOBS if knob.owner is DroneFlight}
        raise InputError(re.sub(r"\w+", lambda word: flags.get(word[0], word[0]), str(error))) from None
    liealign.write_flight(str(folder), simulated)
    return simulated


def _check_size(drone: DroneFlight) -> None:
    samples = drone.duration_s * drone.rate_hz
    if samples > MAX_SAMPLES:
        raise InputError(
            f"--duration {drone.duration_s:g} at --imu-rate {drone.rate_hz:g} makes {samples:.0f} samples; "
            f"expected at most {MAX_SAMPLES}; shorten the flight or lower the rate"
        )


def _heading_at_start(simulated: SimulatedFlight, alignment: liealign.Alignment) -> tuple[float, float]:
    """Return the true heading at the start, and the error of the one found [deg]."""
    truth = simulated.truth()
    at_start = int(np.argmin(np.abs(truth["time_s"] - alignment.start_time_s)))
    true_heading = float(truth["rpy_deg"][at_start, 2])
    return true_heading, float(wrap_deg(np.array(alignment.heading_deg - true_heading)))


def _shell(words: Iterable[str | Path]) -> str:
    return shlex.join(map(str, words))


# ---- the commands ------------------------------------------------------------------------------------------


@takes_knobs
def simulate(
    texts: dict[str, str | None],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for FLIGHT.toml and the logs.")
    ],
    gnss_velocity: Annotated[
        bool, typer.Option("--gnss-velocity", help="Write the velocity of the fixes as well.")
    ] = False,
    imu_model: Annotated[
        str, typer.Option("--imu-model", metavar="NAME", help="Noise profile; liealign imus lists them.")
    ] = "adis16495",
    seed: Annotated[str, typer.Option("--seed", metavar="N", help="Same seed, same bits.")] = "1",
    quiet: Quiet = False,
) -> None:
    """Write a simulated drone flight with its truth into DIR.

    The files are FLIGHT.toml, imu.csv, gnss.csv and truth.csv.
    """
    with exit_codes():
        number = _seed(seed)
        drone = DroneFlight(**_fields(DroneFlight, texts), seed=number)
        gnss = GnssErrors(**_fields(GnssErrors, texts), velocity=gnss_velocity)
        _check_size(drone)
        check_target(output)
        # A latency that is known is given: the run is to find the heading, not to be led astray.
        latency = {"gnss.latency_s": gnss.latency_s} if gnss.latency_s else {}
        simulated = make_flight(drone, gnss, {"imu.model": _model(imu_model), **latency}, number, output)
        if quiet:
            return
        imu, fixes = (len(log["time_s"]) for log in (simulated.flight.imu(), simulated.flight.gnss()))
        toml, out = output / "FLIGHT.toml", output / "out"
        console.say("flight", f"{toml}, imu.csv, gnss.csv and truth.csv beside it")
        console.say("logs", f"{drone.duration_s:g} s, {imu} IMU samples, {fixes} fixes")
        console.say("next", _shell(["liealign", "run", toml, "-o", out]))
        console.say("then", _shell(["liealign", "compare", output / "truth.csv", out / "trajectory.csv"]))


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the simulated files.")
    ] = Path("liealign-demo"),
    quiet: Quiet = False,
) -> None:
    """Simulate a five-minute flight, run it, show the errors."""
    with exit_codes():
        check_target(output)
        simulated = make_flight(
            DroneFlight(),
            GnssErrors(**_fields(GnssErrors, {})),
            {"imu.model": "adis16495", "output.filtered": True},
            1,
            output,
        )
        results = output / "out"
        prepared, alignment, solution = run_to_folder(
            read_config(output / "FLIGHT.toml"), results, quiet=quiet
        )
        if quiet:
            return
        console.print_run(prepared, alignment, solution, results)
        found, truth = Solution.from_engine(prepared, alignment.engine, solution), simulated.truth()
        assert found.filtered is not None
        heading = _heading_at_start(simulated, alignment)
        console.print_truth(heading, compare(truth, found), compare(truth, found.filtered), output)


def _seed(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = -1
    if not 0 <= number < 2**63:
        raise InputError(f'--seed is "{text}"; expected a whole number, 0 or more')
    return number


def _model(name: str) -> str:
    names = [profile.name for profile in _core.imu_profiles()]
    if name not in names:
        hint = _core.did_you_mean(name, names) or f"; expected one of: {', '.join(names)}"
        raise InputError(f'--imu-model is "{name}", which is no profile{hint}')
    return name
