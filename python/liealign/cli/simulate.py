"""`liealign simulate` and `liealign demo`: a flight with its truth, as files."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer

import liealign
from liealign import _core, console
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
from liealign.cli.knobs import KNOBS, fields_of, in_flags, takes_knobs
from liealign.cli.run import Quiet
from liealign.cli.work import check_folder, exit_codes, run_to_folder
from liealign.comparison import compare, wrap_deg
from liealign.flight import make_config, read_config
from liealign.solution import Solution
from liealign.track import Track

FLIGHT_FILES = ("FLIGHT.toml", "imu.csv", "gnss.csv", "truth.csv")
# 80 minutes at 200 Hz; the simulator works in memory, on eight times as many steps.
MAX_SAMPLES = 1_000_000


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


class Sensors(NamedTuple):
    """What is simulated along a motion."""

    gnss: GnssErrors
    imu: ImuErrorSizes
    typed_in: TypedInErrors


class Motion(NamedTuple):
    """What is flown, how long, sampled how often, and the flags that say so."""

    begin_s: float
    duration_s: float
    rate_hz: float
    said_by: str
    with_sensors: Callable[[Sensors, Config, int], SimulatedFlight]


def of_drone(drone: DroneFlight) -> Motion:
    """Return the motion of a drone flight."""
    return Motion(
        drone.start_time_s,
        drone.duration_s,
        drone.rate_hz,
        f"--duration {drone.duration_s:g}",
        lambda sensors, config, seed: liealign.simulate_flight(
            drone, sensors.gnss, config, seed, sensors.imu, sensors.typed_in
        ),
    )


def along(file: Path, rate_hz: float) -> Motion:
    """Read a trajectory file and return its motion.

    Raises
    ------
    InputError
        When the file cannot be used.
    """
    track = Track.of(file)
    begin, end = float(track.time_s[0]), float(track.time_s[-1])
    return Motion(
        begin,
        end - begin,
        rate_hz,
        f"--trajectory {file} of {end - begin:.0f} s",
        lambda sensors, config, seed: liealign.simulate_along(
            track, config=config, seed=seed, rate_hz=rate_hz, **sensors._asdict()
        ),
    )


def make_flight(
    motion: Motion,
    sensors: Sensors,
    overrides: dict[str, Any],
    seed: int,
    folder: Path,
    span_s: tuple[float, float] | None = None,
) -> SimulatedFlight:
    """Simulate and write the four files.

    Raises
    ------
    InputError
        When they do not make a flight; the message names the flags for the fields.
    """
    try:
        simulated = motion.with_sensors(sensors, make_config(overrides), seed)
        if span_s is not None:
            begin, end = (motion.begin_s + t for t in span_s)
            simulated = simulated.between(begin, end)
    except Error as error:
        raise InputError(in_flags(str(error))) from None
    liealign.write_flight(str(folder), simulated)
    return simulated


def _check_size(motion: Motion) -> None:
    samples = motion.duration_s * motion.rate_hz
    if samples > MAX_SAMPLES:
        raise InputError(
            f"{motion.said_by} at --imu-rate {motion.rate_hz:g} makes {samples:.0f} samples; "
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
    gnss_heading: Annotated[
        bool, typer.Option("--gnss-heading", help="Write the heading of a second antenna as well.")
    ] = False,
    fixed_biases: Annotated[
        bool,
        typer.Option(
            "--fixed-biases",
            help="Biases, scale factors and misalignments have just their size, with a sign by the seed, "
            "instead of being drawn.",
        ),
    ] = False,
    imu_model: Annotated[
        str, typer.Option("--imu-model", metavar="NAME", help="Noise profile; liealign imus lists them.")
    ] = "adis16495",
    seed: Annotated[str, typer.Option("--seed", metavar="N", help="Same seed, same bits.")] = "1",
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="KIND",
            help="A flight drawn by the seed: survey, lines, circles, helical, rectangular, hover or parked; "
            "without it, the survey flight of the defaults.",
        ),
    ] = None,
    gentle: Annotated[
        bool, typer.Option("--gentle", help="With --kind: slow, 0.1 to 0.3 m/s^2 at most.")
    ] = False,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            "--trajectory",
            metavar="FILE",
            help="Fly along this trajectory (truth.csv, trajectory.csv, SBET) instead; of the flags of the "
            "flight only --imu-rate goes with it.",
        ),
    ] = None,
    begin: Annotated[
        str,
        typer.Option(
            "--begin", metavar="S", help="Drop what is before, to begin in the air [s from the start]"
        ),
    ] = "0",
    end: Annotated[
        str | None, typer.Option("--end", metavar="S", help="Drop what is after [s from the start]")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a simulated flight, of a drone or along a trajectory, with its truth into DIR.

    The files are FLIGHT.toml, imu.csv, gnss.csv and truth.csv.
    """
    with exit_codes():
        number = _seed(seed)
        if trajectory is None:
            motion = of_drone(_drone(kind, gentle, number, fields_of(DroneFlight, texts)))
        else:
            _check_alone(trajectory, output, {"kind": kind, "gentle": gentle or None, **texts})
            motion = along(trajectory, fields_of(DroneFlight, texts).get("rate_hz", DroneFlight().rate_hz))
        gnss = GnssErrors(**fields_of(GnssErrors, texts), velocity=gnss_velocity, heading=gnss_heading)
        _check_size(motion)
        check_target(output)
        # A latency that is known is given: the run is to find the heading, not to be led astray.
        latency = {"gnss.latency_s": gnss.latency_s} if gnss.latency_s else {}
        imu = ImuErrorSizes(**fields_of(ImuErrorSizes, texts), turn_on="fixed" if fixed_biases else "drawn")
        sensors = Sensors(gnss, imu, TypedInErrors(**fields_of(TypedInErrors, texts)))
        keys = {"imu.model": _model(imu_model), **latency}
        span = _span(begin, end, motion.duration_s)
        simulated = make_flight(motion, sensors, keys, number, output, span)
        if quiet:
            return
        samples, fixes = (len(log["time_s"]) for log in (simulated.flight.imu(), simulated.flight.gnss()))
        toml, out = output / "FLIGHT.toml", output / "out"
        console.say("flight", f"{toml}, imu.csv, gnss.csv and truth.csv beside it")
        console.say("logs", f"{samples / motion.rate_hz:.0f} s, {samples} IMU samples, {fixes} fixes")
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
            of_drone(DroneFlight()),
            Sensors(GnssErrors(**fields_of(GnssErrors, {})), ImuErrorSizes(), TypedInErrors()),
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


def _check_alone(trajectory: Path, output: Path, texts: dict[str, Any]) -> None:
    """Refuse the flags of a drone flight beside --trajectory, and to write over the file."""
    names = {"kind": "--kind", "gentle": "--gentle"}
    names |= {k.parameter: k.name for k in KNOBS if k.owner is DroneFlight and k.field != "rate_hz"}
    for parameter, name in names.items():
        if texts[parameter] is not None:
            raise InputError(
                f"{name} is of a flight made up; with --trajectory the file is flown; leave one out"
            )
    if trajectory.resolve() in [(output / name).resolve() for name in FLIGHT_FILES]:
        raise InputError(f"{trajectory}: would be written over; choose another folder (-o DIR)")


def _drone(kind: str | None, gentle: bool, seed: int, fields: dict[str, Any]) -> DroneFlight:
    if kind is None:
        if gentle:
            raise InputError("--gentle needs --kind; the survey flight of the defaults is never gentle")
        return DroneFlight(**fields, seed=seed)
    try:
        drone = liealign.random_flight(kind, gentle=gentle, seed=seed)
    except Error as error:
        raise InputError(str(error).replace("drone flight: kind", "--kind")) from None
    for name, value in fields.items():
        setattr(drone, name, value)
    return drone


def _span(begin: str, end: str | None, duration_s: float) -> tuple[float, float] | None:
    if begin == "0" and end is None:
        return None
    first = _seconds("--begin", begin, 0.0, duration_s)
    return first, duration_s if end is None else _seconds("--end", end, first, duration_s)


def _seconds(flag: str, text: str, low: float, high: float) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not low <= seconds <= high:
        raise InputError(f'{flag} is "{text}"; expected a number from {low:g} to {high:g} [s]')
    return seconds


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
