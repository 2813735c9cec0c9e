"""The flags that stand for configuration keys: one table, from which the commands get their parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Concatenate, NamedTuple, ParamSpec, Protocol

import typer

from liealign._core import Config
from liealign.flight import make_config, read_config

P = ParamSpec("P")


def number(text: str) -> Any:
    """Return the number, or the text itself: "auto", or something for the engine to refuse by name."""
    try:
        return float(text)
    except ValueError:
        return text


def numbers(text: str) -> Any:
    """Return the numbers in the text, or the text itself when one of them is none."""
    values = [number(word) for word in text.replace(",", " ").split()]
    return values if all(isinstance(value, float) for value in values) else text


def words(text: str) -> Any:
    """Return the words in the text."""
    return text.replace(",", " ").split()


MANY = 99


def keyword(name: str, default: Any, annotation: Any) -> inspect.Parameter:
    """Return a keyword parameter as typer reads it."""
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


class Flag(NamedTuple):
    """A flag, the configuration key that it sets, how its text is read, and how many words it takes."""

    name: str
    key: str
    shown: str
    help: str
    value: Callable[[str], Any] = str
    words: int = 1

    @property
    def parameter(self) -> str:
        """The name of the parameter that carries it."""
        return self.name.removeprefix("--").replace("-", "_")

    def as_parameter(self) -> inspect.Parameter:
        """Return what typer reads it from."""
        if self.words == 0:
            return keyword(self.parameter, False, Annotated[bool, typer.Option(self.name, help=self.help)])
        option = typer.Option(self.name, metavar=self.shown, help=self.help)
        return keyword(self.parameter, None, Annotated[str | None, option])


# In the order of --help; cpp/app/main.cpp has the same ones.
_FLAGS = (
    Flag("--imu", "imu.file", "FILE", "Native imu.csv."),
    Flag("--gnss", "gnss.file", "FILE", "Native gnss.csv, or a .pos of RTKLIB."),
    Flag(
        "--lever-arm",
        "gnss.lever_arm_b_m",
        "X Y Z",
        "From the IMU to the antenna: forward, right, down [m].",
        numbers,
        words=3,
    ),
    Flag("--imu-model", "imu.model", "NAME", "Noise profile of the IMU; liealign imus lists them."),
    Flag(
        "--gnss-latency",
        "gnss.latency_s",
        "SECONDS|auto",
        "Delay of the GNSS stamps: t_true = time_s - latency.",
        number,
    ),
    Flag("--gyro-unit", "imu.gyro_unit", "rps|dps", "Unit of the gyro columns."),
    Flag("--accel-unit", "imu.accel_unit", "mps2|g", "Unit of the accelerometer columns."),
    Flag("--axes", "imu.axes", "FRD|FLU|...", "Where the sensor's x, y, z point on the vehicle."),
    Flag(
        "--heading-guess",
        "align.heading_guess_deg",
        "DEG",
        "Heading at the start, when you know it roughly.",
        number,
    ),
    Flag(
        "--heading-guess-std",
        "align.heading_guess_std_deg",
        "DEG",
        "Standard deviation of the guess.",
        number,
    ),
    Flag("--imu-noise-scale", "imu.noise_scale", "NUMBER|auto", "Factor on every IMU noise.", number),
    Flag(
        "--gnss-std-scale", "gnss.std_scale", "NUMBER|auto", "Factor on the GNSS standard deviations.", number
    ),
    Flag("--start", "align.start", "auto|static|moving", "Whether the log starts at rest or in motion."),
    Flag(
        "--format",
        "output.formats",
        "csv sbet",
        "Trajectory files to write, one or more words.",
        words,
        words=MANY,
    ),
    Flag("--start-time", "output.start_time_s", "SECONDS", "First time of the trajectory files.", number),
    Flag("--stop-time", "output.stop_time_s", "SECONDS", "Last time of the trajectory files.", number),
    Flag("--filtered", "output.filtered", "", "Write filtered.csv as well.", bool, words=0),
)
FLAGS = {flag.parameter: flag for flag in _FLAGS}
# Without the flags of the trajectory files.
ALIGN_FLAGS = {name: flag for name, flag in FLAGS.items() if not flag.key.startswith("output.")}

Toml = Annotated[Path | None, typer.Argument(metavar="FLIGHT.toml", help="The configuration of the flight.")]


class Given(NamedTuple):
    """What a command was given for its configuration: FLIGHT.toml, and the text of each flag of a key."""

    toml: Path | None
    texts: dict[str, Any]

    def config(self) -> Config:
        """FLIGHT.toml, then the flags, each under its own name in messages."""
        config = read_config(self.toml) if self.toml is not None else Config()
        for name, text in self.texts.items():
            if text not in (None, False):
                flag = FLAGS[name]
                config = make_config({flag.key: flag.value(text)}, base=config, source=flag.name)
        return config


def takes_flags(
    flags: dict[str, Flag],
) -> Callable[[Callable[Concatenate[Given, P], None]], Callable[..., None]]:
    """Give a command FLIGHT.toml and the flags as parameters beside its own options.

    The command itself gets them together, as its first argument.
    """

    def decorate(command: Callable[Concatenate[Given, P], None]) -> Callable[..., None]:
        def with_flags(*, toml: Path | None, **options: Any) -> None:
            texts = {name: options.pop(name) for name in flags}
            command(Given(toml, texts), **options)  # type: ignore[call-arg]

        parameters = [keyword("toml", None, Toml), *(flag.as_parameter() for flag in flags.values())]
        return with_parameters(with_flags, command, parameters)

    return decorate


def with_parameters(
    function: Callable[..., None], command: Callable[..., None], parameters: list[inspect.Parameter]
) -> Callable[..., None]:
    """Make `function` look to typer like `command` with the parameters in place of its first argument.

    What is required comes first in --help.
    """
    _, *rest = inspect.signature(command, eval_str=True).parameters.values()
    own = [keyword(p.name, p.default, p.annotation) for p in rest]
    required = [p for p in own if p.default is inspect.Parameter.empty]
    parameters = [*required, *parameters, *(p for p in own if p not in required)]
    function.__name__, function.__doc__ = command.__name__, command.__doc__
    # typer reads both.
    function.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    function.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return function


class Worded(Protocol):
    """A flag, and how many words it takes."""

    @property
    def name(self) -> str:
        """With its dashes."""

    @property
    def words(self) -> int:
        """0 for none, MANY for any number."""


def join_words(arguments: Sequence[str], flags: Iterable[Worded] = _FLAGS) -> list[str]:
    """Join the words of a flag into one: `--lever-arm 0.1 -0.05 -0.3` becomes `--lever-arm=0.1 -0.05 -0.3`.

    A word that starts with "-" belongs to the flag when it is a number. The words of --format, however many,
    have no point and no slash, so that a file name ends them.
    """
    words_of = {flag.name: flag.words for flag in flags if flag.words}
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
    return not word.startswith("-") or isinstance(number(word), float)


def _is_word(word: str) -> bool:
    return word.replace(",", "").isalnum()
