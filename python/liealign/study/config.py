"""STUDY.toml: what is flown, what the sensors do to it, and which filters run on it.

Sections: `[study]`, `[flight]` (fields of `DroneFlight` that all scenarios share), `[scenario.NAME]` (the
same, of one; or `trajectory`, a file that is flown instead), `[errors.gnss]` (`GnssErrors`), `[errors.imu]`
(`ImuErrorSizes`), and those of FLIGHT.toml for the filters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from liealign import _core
from liealign._core import ConfigError, StudyCase
from liealign.flight import make_config
from liealign.toml_entries import read_toml_entries
from liealign.track import Track, read_trajectory

if TYPE_CHECKING:
    from liealign._core import Entry

# What the filters are told, unless STUDY.toml has another word: latency and scales are given, so that nothing
# is searched but the heading.
GIVEN = {"gnss.latency_s": 0.0, "imu.noise_scale": 1.0, "gnss.std_scale": 1.0}
RUNS = 100

# Scenarios do not share the seeds of their runs: what one of them shows, the others need not show as well.
_SEEDS_APART = 1_000_000

# Fields of StudyCase that are sections of their own.
_PARTS = ("flight", "gnss", "imu", "config")


@dataclass(frozen=True)
class Study:
    """What a study repeats; plain data, so that it travels to other machines.

    Attributes
    ----------
    entries
        The leaves of STUDY.toml: key, value, line, column.
    source
        Its name, for messages.
    runs
        Of each scenario.
    tracks
        Of the scenarios that fly along a file.
    """

    entries: tuple[Entry, ...]
    source: str
    runs: int
    tracks: Mapping[str, Track] = field(default_factory=dict)

    @property
    def scenarios(self) -> list[str]:
        """Names, in the order of the file."""
        return list(
            dict.fromkeys(key.split(".")[1] for key, *_ in self.entries if key.startswith("scenario."))
        )

    def case(self, scenario: str) -> StudyCase:
        """Return the engine's case of that scenario.

        Raises
        ------
        ConfigError
            `STUDY.toml:line:column: ...` for a key or value that cannot be used.
        """
        case = StudyCase(config=make_config(GIVEN))
        drone, gnss, imu = case.flight, case.gnss, case.imu
        engine: list[Entry] = []
        for key, value, line, column in self.entries:
            place = _Place(self.source, key, value, line, column)
            section, _, name = key.rpartition(".")
            if section == "study":
                if name != "runs":
                    _set(case, name, place, without=_PARTS)
            elif section.startswith("scenario.") and name == "trajectory":
                continue
            elif section in ("flight", f"scenario.{scenario}"):
                _set(drone, name, place)
            elif section == "errors.gnss":
                _set(gnss, name, place)
            elif section == "errors.imu":
                _set(imu, name, place)
            elif section.partition(".")[0] in ("scenario", "errors"):
                if section.partition(".")[0] == "errors" or section.count(".") != 1:
                    raise ConfigError(
                        place.refused("the sections [errors.gnss], [errors.imu] and [scenario.NAME]")
                    )
            else:
                engine.append((key, value, line, column))
        case.flight, case.gnss, case.imu = drone, gnss, imu
        if track := self.tracks.get(scenario):
            case.set_track(track.time_s, track.lat_deg, track.lon_deg, track.height_m, track.rpy_deg)
        case.seed += _SEEDS_APART * self.scenarios.index(scenario)
        case.config = _core.apply_config(case.config, engine, self.source)
        return case


@dataclass(frozen=True)
class _Place:
    source: str
    key: str
    value: Any
    line: int
    column: int

    def where(self) -> str:
        at = f":{self.line}:{self.column}" if self.line else ""
        return f"{self.source}{at}: " if self.source else ""

    def refused(self, expected: str) -> str:
        value = f'"{self.value}"' if isinstance(self.value, str) else self.value
        return f"{self.where()}{self.key} is {value}; expected {expected}"


def _fields(owner: Any) -> Iterator[str]:
    return (name for name, member in vars(type(owner)).items() if isinstance(member, property))


_KINDS: tuple[tuple[type | tuple[type, ...], str, Callable[[Any], bool]], ...] = (
    (bool, "true or false", lambda v: isinstance(v, bool)),
    (int, "a whole number, 0 or more", lambda v: isinstance(v, int) and not isinstance(v, bool) and v >= 0),
    ((float, type(None)), "a number", lambda v: isinstance(v, float | int) and not isinstance(v, bool)),
    (str, "a text", lambda v: isinstance(v, str)),
    (list, "a list of texts", lambda v: isinstance(v, list) and all(isinstance(w, str) for w in v)),
    (np.ndarray, "three numbers", lambda v: isinstance(v, list) and len(v) == 3),
)


def _set(owner: Any, name: str, place: _Place, without: tuple[str, ...] = ()) -> None:
    """Set a field of one of the engine's structs, of the type that its default has."""
    names = [field for field in _fields(owner) if field not in without]
    if name not in names:
        section = place.key.rpartition(".")[0]
        hint = _core.did_you_mean(place.key, [f"{section}.{field}" for field in names])
        raise ConfigError(
            f'{place.where()}unknown key "{place.key}"{hint or "; there are " + ", ".join(names)}'
        )
    default = getattr(owner, name)
    expected, good = next((text, good) for kind, text, good in _KINDS if isinstance(default, kind))
    try:
        if not good(place.value):
            raise TypeError
        setattr(
            owner, name, np.asarray(place.value, float) if isinstance(default, np.ndarray) else place.value
        )
    except (TypeError, ValueError) as error:
        if isinstance(error, _core.Error):
            raise ConfigError(f"{place.where()}{place.key}: {error}") from None
        raise ConfigError(place.refused(expected)) from None


def _made(entries: list[Entry], source: str) -> Study:
    runs = RUNS
    for key, value, line, column in entries:
        if key == "study.runs":
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                raise ConfigError(
                    _Place(source, key, value, line, column).refused("a whole number, 1 or more")
                )
            runs = value
    study = Study(tuple(entries), source, runs, _tracks(entries, source))
    if not study.scenarios:
        where = f"{source}: " if source else ""
        raise ConfigError(
            f"{where}no [scenario.NAME]; expected one or more, such as [scenario.circular] with "
            'kind = "circles"'
        )
    for scenario in study.scenarios:
        study.case(scenario)
    return study


def _tracks(entries: list[Entry], source: str) -> dict[str, Track]:
    """Read the files of the scenarios that have one; their names are relative to the folder of STUDY.toml."""
    tracks = {}
    for key, value, line, column in entries:
        section, _, name = key.rpartition(".")
        if name == "trajectory" and section.startswith("scenario."):
            if not isinstance(value, str):
                raise ConfigError(_Place(source, key, value, line, column).refused("the name of a file"))
            tracks[section.removeprefix("scenario.")] = read_trajectory(Path(source).parent / value)
    return tracks


def read_study(toml: str | PathLike[str]) -> Study:
    """Read a STUDY.toml.

    Raises
    ------
    InputError
        When the file cannot be read.
    ConfigError
        `STUDY.toml:line:column: ...` when it is not valid TOML, or for a key or value that cannot be used.
    """
    return _made(read_toml_entries(Path(toml)), str(toml))


def make_study(keys: Mapping[str, Any], *, base: Study | None = None) -> Study:
    """Make a study from dotted keys, such as {"study.start": "drawn", "scenario.circular.kind": "circles"}.

    Parameters
    ----------
    keys
        As in STUDY.toml.
    base
        A study whose other keys stay.

    Raises
    ------
    ConfigError
        For a key or value that cannot be used.
    """
    old = [entry for entry in (base.entries if base else ()) if entry[0] not in keys]
    return _made([*old, *((key, value, 0, 0) for key, value in keys.items())], base.source if base else "")
