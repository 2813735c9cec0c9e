"""STUDY.toml: what is flown, what the sensors do to it, and which filters run on it.

Sections: `[study]`, `[flight]` (fields of `DroneFlight` that all scenarios share), `[scenario.NAME]` (the
same, of one; or `trajectory`, a file that is flown instead), `[errors.gnss]` (`GnssErrors`), `[errors.imu]`
(`ImuErrorSizes`), `[errors.typed_in]` (`TypedInErrors`), and those of FLIGHT.toml for the filters.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
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

RUNS = 100

# Scenarios do not share the seeds of their runs: what one of them shows, the others need not show as well.
_SEEDS_APART = 1_000_000

# Fields of StudyCase that are sections of their own.
_PARTS = ("flight", "gnss", "imu", "typed_in", "config")

# Keys of FLIGHT.toml that say something of logs and of results, which a study has not, and what to do.
_NOT_HERE = {
    **dict.fromkeys(
        ("imu.file", "gnss.file", "gnss.week", "baro.file"), "a study reads no logs; drop the key"
    ),
    **dict.fromkeys(
        ("imu.sample", "imu.gyro_unit", "imu.accel_unit", "imu.axes", "imu.mounting_rpy_deg"),
        "simulated samples are means in SI along the body axes; drop the key",
    ),
    "gnss.lever_arm_b_m": "the lever arm is errors.gnss.l_ba_b",
    "filter.model": "the filters are study.models",
}
# With a trajectory, of the flight: how often it is sampled.
_OF_TRACK = ("rate_hz", "oversample")


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
    scenarios
        Their names, in the order of the file.
    tracks
        Of the scenarios that fly along a file.
    """

    entries: tuple[Entry, ...]
    source: str
    runs: int
    scenarios: tuple[str, ...]
    tracks: Mapping[str, Track] = field(default_factory=dict)

    def case(self, scenario: str) -> StudyCase:
        """Return the engine's case of that scenario.

        Raises
        ------
        ConfigError
            `STUDY.toml:line:column: ...` for a key or value that cannot be used.
        """
        case = StudyCase()
        drone, errors = case.flight, {"gnss": case.gnss, "imu": case.imu, "typed_in": case.typed_in}
        engine: list[Entry] = []
        for key, value, line, column in self.entries:
            place = _Place(self.source, key, value, line, column)
            section, _, name = key.rpartition(".")
            first = section.partition(".")[0]
            if section == "study":
                if name != "runs":
                    _set(case, name, place, without=_PARTS)
            elif first == "errors" and section.removeprefix("errors.") in errors:
                _set(errors[section.removeprefix("errors.")], name, place)
            elif section == "flight" or (first == "scenario" and section.count(".") == 1):
                if section in ("flight", f"scenario.{scenario}") and not self._is_track(section, name, place):
                    _set(drone, name, place)
            elif first in ("scenario", "errors"):
                raise ConfigError(
                    place.refused(
                        "the sections [errors.gnss], [errors.imu], [errors.typed_in] and [scenario.NAME]"
                    )
                )
            elif key in _NOT_HERE or first == "output":
                why = _NOT_HERE.get(key, "a study writes no trajectories; drop the key")
                raise ConfigError(f"{place.where()}{key} does not belong to a study: {why}")
            else:
                engine.append((key, value, line, column))
        case.flight = drone
        for part, sizes in errors.items():
            setattr(case, part, sizes)
        if track := self.tracks.get(scenario):
            case.set_track(track.time_s, track.lat_deg, track.lon_deg, track.height_m, track.rpy_deg)
        case.seed += _SEEDS_APART * self.scenarios.index(scenario)
        # Given, unless STUDY.toml has another word, so that nothing is searched but the heading.
        given = {"gnss.latency_s": case.gnss.latency_s, "imu.noise_scale": 1.0, "gnss.std_scale": 1.0}
        case.config = _core.apply_config(make_config(given), engine, self.source)
        self._check(case, scenario)
        return case

    def _is_track(self, section: str, name: str, place: _Place) -> bool:
        """Whether this is the name of a file; its scenario may only say besides how often it is sampled."""
        scenario = section.removeprefix("scenario.")
        if section != "flight" and scenario in self.tracks and name not in (*_OF_TRACK, "trajectory"):
            raise ConfigError(
                f"{place.where()}{place.key} does not go with scenario.{scenario}.trajectory, which is flown "
                f"as it is; drop one of the two"
            )
        return section != "flight" and name == "trajectory"

    def _check(self, case: StudyCase, scenario: str) -> None:
        """Refuse what the engine refuses, with the place of the key that it names."""
        try:
            _core.check_study(case)
        except _core.Error as error:
            words = str(error).removeprefix("study: ").split()
            places = (
                _Place(self.source, key, value, line, column)
                for key, value, line, column in self.entries
                if key in (f"study.{words[0]}", f"errors.{words[0]}")
            )
            where = next((place.where() for place in places), f"{self.source}: " if self.source else "")
            raise ConfigError(f"{where}scenario {scenario}: {error}") from None


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


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


_KINDS: tuple[tuple[type | tuple[type, ...], str, Callable[[Any], bool]], ...] = (
    (bool, "true or false", lambda v: isinstance(v, bool)),
    (int, "a whole number, 0 or more", lambda v: isinstance(v, int) and not isinstance(v, bool) and v >= 0),
    ((float, type(None)), "a number", lambda v: _is_number(v)),
    (str, "a text", lambda v: isinstance(v, str)),
    (list, "a list of texts", lambda v: isinstance(v, list) and all(isinstance(w, str) for w in v)),
    (np.ndarray, "three numbers", lambda v: isinstance(v, list) and len(v) == 3 and all(map(_is_number, v))),
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


def _made(entries: list[Entry], source: str, scenarios: Iterable[str]) -> Study:
    runs = RUNS
    for key, value, line, column in entries:
        if key == "study.runs":
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                raise ConfigError(
                    _Place(source, key, value, line, column).refused("a whole number, 1 or more")
                )
            runs = value
    study = Study(tuple(entries), source, runs, tuple(scenarios), _tracks(entries, source))
    if not study.scenarios:
        where = f"{source}: " if source else ""
        raise ConfigError(
            f"{where}no [scenario.NAME]; expected one or more, such as [scenario.circular] with "
            'kind = "circles"'
        )
    for scenario in study.scenarios:
        study.case(scenario)
    return study


def _named(entries: Iterable[Entry]) -> list[str]:
    """Scenarios that a key names."""
    return [key.split(".")[1] for key, *_ in entries if key.startswith("scenario.") and key.count(".") > 1]


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
    path = Path(toml)
    entries = read_toml_entries(path)
    # A section without a key has no entry.
    sections = tomllib.loads(path.read_text(encoding="utf-8-sig")).get("scenario", {})
    names = [name for name, fields in sections.items() if isinstance(fields, dict)]
    return _made(entries, str(toml), names)


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
    entries = [
        (key, keys[key], 0, 0) if key in keys else (key, value, line, column)
        for key, value, line, column in (base.entries if base else ())
    ]
    there = {key for key, *_ in entries}
    entries += [(key, value, 0, 0) for key, value in keys.items() if key not in there]
    names = dict.fromkeys((*(base.scenarios if base else ()), *_named(entries)))
    return _made(entries, base.source if base else "", names)
