"""The command line: `liealign run | align | demo`. Flags, files and exit codes are a contract.

Exit codes: 0 done; 1 bad input (one line on stderr); 2 usage; 3 numerical failure; 4 heading not aligned
where --require-aligned demands it; 130 interrupted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

import liealign
from liealign import _core, console
from liealign._core import Cancelled, Config, Error, InputError, NumericalError
from liealign.drivers import align_heading, write_results
from liealign.flight import make_config, read_config
from liealign.progress import ProgressBar
from liealign.report import write_report
from liealign.solution import Alignment

EXIT_BAD_INPUT, EXIT_NUMERICAL, EXIT_NOT_ALIGNED, EXIT_INTERRUPTED = 1, 3, 4, 130


# ---- flags that stand for configuration keys ------------------------------------------------------------


def _number(text: str) -> Any:
    """Return the number, or the text itself: "auto", or something for the engine to refuse by name."""
    try:
        return float(text)
    except ValueError:
        return text


def _numbers(text: str) -> Any:
    values = [_number(word) for word in text.replace(",", " ").split()]
    return values if all(isinstance(value, float) for value in values) else text


def _words(text: str) -> Any:
    return text.replace(",", " ").split()


MANY = 99


class Flag(NamedTuple):
    """A flag, the configuration key that it sets, how its text is read, and how many words it takes."""

    name: str
    key: str
    value: Callable[[str], Any] = str
    words: int = 1


# By parameter of the commands below.
FLAGS = {
    "imu": Flag("--imu", "imu.file"),
    "gnss": Flag("--gnss", "gnss.file"),
    "lever_arm": Flag("--lever-arm", "gnss.lever_arm_b_m", _numbers, words=3),
    "imu_model": Flag("--imu-model", "imu.model"),
    "gnss_latency": Flag("--gnss-latency", "gnss.latency_s", _number),
    "axes": Flag("--axes", "imu.axes"),
    "gyro_unit": Flag("--gyro-unit", "imu.gyro_unit"),
    "accel_unit": Flag("--accel-unit", "imu.accel_unit"),
    "heading_guess": Flag("--heading-guess", "align.heading_guess_deg", _number),
    "heading_guess_std": Flag("--heading-guess-std", "align.heading_guess_std_deg", _number),
    "imu_noise_scale": Flag("--imu-noise-scale", "imu.noise_scale", _number),
    "gnss_std_scale": Flag("--gnss-std-scale", "gnss.std_scale", _number),
    "start": Flag("--start", "align.start"),
    "format": Flag("--format", "output.formats", _words, words=MANY),
    "start_time": Flag("--start-time", "output.start_time_s", _number),
    "stop_time": Flag("--stop-time", "output.stop_time_s", _number),
    "filtered": Flag("--filtered", "output.filtered", bool, words=0),
}


def join_words(arguments: Sequence[str]) -> list[str]:
    """Join the words of a flag into one: `--lever-arm 0.1 -0.05 -0.3` becomes `--lever-arm=0.1 -0.05 -0.3`.

    A word that starts with "-" belongs to the flag when it is a number. The words of --format, however many,
    have no point and no slash, so that a file name ends them.
    """
    words_of = {flag.name: flag.words for flag in FLAGS.values() if flag.words}
    joined: list[str] = []
    rest = list(arguments)
    while rest:
        word = rest.pop(0)
        if word == "--":
            return [*joined, word, *rest]
        name, equals, value = word.partition("=")
        if name in words_of:
            values = [value] if equals else []
            is_value = _is_word if words_of[name] == MANY else _is_value
            while rest and len(values) < words_of[name] and is_value(rest[0]):
                values.append(rest.pop(0))
            word = f"{name}={' '.join(values)}" if values else name
        joined.append(word)
    return joined


def _is_value(word: str) -> bool:
    return not word.startswith("-") or isinstance(_number(word), float)


def _is_word(word: str) -> bool:
    return word.replace(",", "").isalnum()


def _config(toml: Path | None, params: dict[str, Any]) -> Config:
    """FLIGHT.toml, then the flags, each under its own name in messages."""
    config = read_config(toml) if toml is not None else Config()
    for name, flag in FLAGS.items():
        if params.get(name) not in (None, False):
            config = make_config({flag.key: flag.value(params[name])}, base=config, source=flag.name)
    return config


# ---- the work ----------------------------------------------------------------------------------------------


def _fail(message: str, code: int) -> typer.Exit:
    print(" ".join(message.splitlines()), file=sys.stderr)
    return typer.Exit(code)


@contextmanager
def exit_codes() -> Iterator[None]:
    """Map what the work raises to one line on stderr and an exit code."""
    try:
        yield
    except NumericalError as error:
        raise _fail(str(error), EXIT_NUMERICAL) from None
    except (Cancelled, KeyboardInterrupt):
        raise _fail("interrupted", EXIT_INTERRUPTED) from None
    except BrokenPipeError:
        raise
    except (Error, MemoryError) as error:
        raise _fail(str(error) or "out of memory", EXIT_BAD_INPUT) from None
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        raise _fail(f"{where}{error.strerror or error}", EXIT_BAD_INPUT) from None


def _align(config: Config, quiet: bool) -> tuple[_core.PreparedFlight, Alignment]:
    prepared = _core.prepare_flight(_core.read_flight(config))
    with ProgressBar("aligning the heading", quiet=quiet) as progress:
        return prepared, align_heading(prepared, progress)


def _demand_aligned(alignment: Alignment, demanded: bool) -> None:
    if not demanded or alignment.verdict == "aligned":
        return
    message = f'the heading is "{alignment.verdict}", --require-aligned demands "aligned": {alignment.advice}'
    raise _fail(message, EXIT_NOT_ALIGNED)


def run_to_folder(
    config: Config, folder: Path, *, quiet: bool, require_aligned: bool = False
) -> tuple[_core.PreparedFlight, Alignment, _core.Solution]:
    """Read, align, filter, smooth, and write the results into the folder, once everything is computed."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; -o expects a folder for the results")
    prepared, alignment = _align(config, quiet)
    _demand_aligned(alignment, require_aligned)
    with ProgressBar("filtering and smoothing", quiet=quiet) as progress:
        solution = _core.process(prepared, alignment.engine, progress, keep_events=True)
    write_results(folder, prepared, alignment, solution)
    write_report(folder, prepared, alignment, solution)
    return prepared, alignment, solution


# ---- the commands ------------------------------------------------------------------------------------------

app = typer.Typer(
    name="liealign",
    help="Heading alignment and smoothed GNSS/INS trajectories for drones with one antenna.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)

Toml = Annotated[Path | None, typer.Argument(metavar="FLIGHT.toml", help="The configuration of the flight.")]
Imu = Annotated[str | None, typer.Option(metavar="FILE", help="Native imu.csv.")]
Gnss = Annotated[str | None, typer.Option(metavar="FILE", help="Native gnss.csv.")]
LeverArm = Annotated[
    str | None,
    typer.Option(metavar="X Y Z", help="From the IMU to the antenna: forward, right, down [m]."),
]
ImuModel = Annotated[str | None, typer.Option(metavar="NAME", help="Noise profile of the IMU.")]
GnssLatency = Annotated[
    str | None,
    typer.Option(metavar="SECONDS|auto", help="Delay of the GNSS stamps: t_true = time_s - latency."),
]
GyroUnit = Annotated[
    str | None, typer.Option("--gyro-unit", metavar="rps|dps", help="Unit of the gyro columns.")
]
AccelUnit = Annotated[
    str | None, typer.Option("--accel-unit", metavar="mps2|g", help="Unit of the accelerometer columns.")
]
Axes = Annotated[
    str | None, typer.Option(metavar="FRD|FLU|...", help="Where the sensor's x, y, z point on the vehicle.")
]
HeadingGuess = Annotated[
    str | None, typer.Option(metavar="DEG", help="Heading at the start, when you know it roughly.")
]
HeadingGuessStd = Annotated[str | None, typer.Option(metavar="DEG", help="Standard deviation of the guess.")]
ImuNoiseScale = Annotated[str | None, typer.Option(metavar="NUMBER|auto", help="Factor on every IMU noise.")]
GnssStdScale = Annotated[
    str | None, typer.Option(metavar="NUMBER|auto", help="Factor on the GNSS standard deviations.")
]
Start = Annotated[
    str | None,
    typer.Option(metavar="auto|static|moving", help="Whether the log starts at rest or in motion."),
]
Formats = Annotated[
    str | None,
    typer.Option("--format", metavar="csv sbet", help="Trajectory files to write, one or more words."),
]
StartTime = Annotated[str | None, typer.Option(metavar="SECONDS", help="First time of the trajectory files.")]
StopTime = Annotated[str | None, typer.Option(metavar="SECONDS", help="Last time of the trajectory files.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")]
RequireAligned = Annotated[
    bool, typer.Option("--require-aligned", help='Exit with code 4 unless the verdict is "aligned".')
]


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    print(f"liealign {liealign.__version__}")
    print(f"OpenMP: {'yes' if liealign.has_openmp else 'absent'}")
    print(f"Ceres: {'yes' if liealign.has_ceres else 'absent'}")
    print("liealign-post: the standalone executable is not part of this build")
    raise typer.Exit


@app.callback()
def _top(
    version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Version and what is built in."
        ),
    ] = False,
) -> None:
    pass


@app.command()
def run(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="OUT", help="Folder for the results.")],
    toml: Toml = None,
    imu: Imu = None,
    gnss: Gnss = None,
    lever_arm: LeverArm = None,
    imu_model: ImuModel = None,
    gnss_latency: GnssLatency = None,
    gyro_unit: GyroUnit = None,
    accel_unit: AccelUnit = None,
    axes: Axes = None,
    heading_guess: HeadingGuess = None,
    heading_guess_std: HeadingGuessStd = None,
    imu_noise_scale: ImuNoiseScale = None,
    gnss_std_scale: GnssStdScale = None,
    start: Start = None,
    format: Formats = None,
    start_time: StartTime = None,
    stop_time: StopTime = None,
    filtered: Annotated[bool, typer.Option("--filtered", help="Write filtered.csv as well.")] = False,
    require_aligned: RequireAligned = False,
    quiet: Quiet = False,
) -> None:
    """Align the heading, filter, smooth, write the results into OUT. Flags are stronger than FLIGHT.toml."""
    with exit_codes():
        config = _config(toml, context.params)
        prepared, alignment, solution = run_to_folder(
            config, output, quiet=quiet, require_aligned=require_aligned
        )
        if not quiet:
            console.print_run(prepared, alignment, solution, output)


@app.command()
def align(
    context: typer.Context,
    toml: Toml = None,
    imu: Imu = None,
    gnss: Gnss = None,
    lever_arm: LeverArm = None,
    imu_model: ImuModel = None,
    gnss_latency: GnssLatency = None,
    gyro_unit: GyroUnit = None,
    accel_unit: AccelUnit = None,
    axes: Axes = None,
    heading_guess: HeadingGuess = None,
    heading_guess_std: HeadingGuessStd = None,
    imu_noise_scale: ImuNoiseScale = None,
    gnss_std_scale: GnssStdScale = None,
    start: Start = None,
    json: Annotated[bool, typer.Option("--json", help="Print alignment.json on stdout.")] = False,
    require_aligned: RequireAligned = False,
    quiet: Quiet = False,
) -> None:
    """Find the heading only. Flags are stronger than FLIGHT.toml."""
    with exit_codes():
        _, alignment = _align(_config(toml, context.params), quiet)
        if json:
            sys.stdout.write(alignment.json_text)
        elif not quiet:
            console.print_alignment(alignment)
        _demand_aligned(alignment, require_aligned)


@app.command()
def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the simulated files.")
    ] = Path("liealign-demo"),
    quiet: Quiet = False,
) -> None:
    """Simulate a five-minute drone flight, run it like any other, and compare the result with the truth."""
    with exit_codes():
        simulated = liealign.simulate_flight(
            liealign.DroneFlight(),
            liealign.GnssErrors(rate_hz=1.0, l_ba_b=(0.1, -0.05, -0.3)),
            make_config({"imu.model": "adis16495", "output.filtered": True}),
            seed=1,
        )
        liealign.write_flight(str(output), simulated)
        results = output / "out"
        prepared, alignment, solution = run_to_folder(
            read_config(output / "FLIGHT.toml"), results, quiet=quiet
        )
        if not quiet:
            console.print_run(prepared, alignment, solution, results)
            console.print_truth(simulated, prepared, alignment, solution, output)


def main() -> None:
    """Run the command line; the entry point of the console script."""
    try:
        app(args=join_words(sys.argv[1:]), prog_name="liealign")
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)


if __name__ == "__main__":
    main()
