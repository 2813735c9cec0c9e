"""`liealign config`: every key with its default, unit and meaning, as a FLIGHT.toml that runs."""

from __future__ import annotations

import json
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.text import Text

from liealign import _core, console
from liealign._core import Config, ConfigField, InputError
from liealign.cli.flags import FLAGS, Toml
from liealign.cli.work import exit_codes
from liealign.toml_entries import read_toml_entries

_COLUMNS = 80
_FLAG_OF = {flag.key: flag.name for flag in FLAGS.values()}


class Key(NamedTuple):
    """A key, its line in the dump of a configuration, its flag, and its value (None: not set)."""

    field: ConfigField
    line: str
    flag: str
    value: Any

    @property
    def section(self) -> str:
        """The part before the dot."""
        return self.field.key.partition(".")[0]

    @property
    def default(self) -> Any:
        """The default; None when there is none."""
        text = self.field.default_value
        return tomllib.loads(f"value = {text}")["value"] if text else None

    @property
    def is_default(self) -> bool:
        """Whether the value is the default; an empty file name is none."""
        return bool((None if self.value == "" else self.value) == self.default)

    def matches(self, word: str) -> bool:
        """Whether the word is in the key, its flag or its meaning, in any case."""
        return any(word.lower() in text.lower() for text in (self.field.key, self.flag, self.field.meaning))

    def comment(self) -> list[str]:
        """Meaning, unit, what is allowed and flag, as comment lines."""
        unit = f" [{self.field.unit}]" if self.field.unit else ""
        flag = f"{self.flag}: " if self.flag else ""
        text = f"{flag}{self.field.meaning}{unit}; {self.field.type}."
        return textwrap.wrap(
            text,
            _COLUMNS,
            initial_indent="# ",
            subsequent_indent="# ",
            break_on_hyphens=False,
            break_long_words=False,
        )


def _keys(config: Config) -> list[Key]:
    """Every key with its line of dump_config; those from the IMU profile with its number."""
    dump = _core.dump_config(config)
    values = tomllib.loads(dump)
    lines = _key_lines(dump)
    model = values["imu"]["model"]
    profile = next((p for p in _core.imu_profiles() if p.name == model), None)
    keys = []
    for field, line in zip(_core.config_fields(), lines, strict=True):
        section, _, member = field.key.partition(".")
        value = values.get(section, {}).get(member)
        if value is None and line.endswith("# from the profile") and profile is not None:
            line = f"# {member} = {getattr(profile, member):.6g}  # from the profile {model}"
        keys.append(Key(field, line, _FLAG_OF.get(field.key, ""), value))
    return [_with_default(key) for key in keys]


def _key_lines(dump: str) -> Iterator[str]:
    """Of each key in turn: in the dump it follows the one comment line on it."""
    lines = [line for line in dump.splitlines()[1:] if line and not line.startswith("[")]
    return iter(lines[1::2])


def _with_default(key: Key) -> Key:
    if key.is_default or key.default is None:
        return key
    return key._replace(line=f"{key.line}  # default {key.field.default_value}")


def _print(keys: list[Key]) -> None:
    out, section = console.console(), ""
    for key in keys:
        if key.section != section:
            section = key.section
            out.print(Text(f"\n[{section}]", "bold"), soft_wrap=True)
        for comment in key.comment():
            out.print(Text(comment, "dim"), soft_wrap=True)
        style = "dim" if key.line.startswith("#") else "" if key.is_default else "yellow"
        out.print(Text(key.line, style), soft_wrap=True)


def _as_json(keys: list[Key], with_values: bool) -> str:
    fields = [
        {
            "key": key.field.key,
            "type": key.field.type,
            "unit": key.field.unit,
            "meaning": key.field.meaning,
            "default": key.default,
            "flag": key.flag or None,
            **({"value": key.value} if with_values else {}),
        }
        for key in keys
    ]
    return json.dumps(fields, indent=2, ensure_ascii=False)


def _read(toml: Path) -> Config:
    """Its file names as they stand: what is printed belongs beside it."""
    return _core.apply_config(Config(), read_toml_entries(toml), str(toml))


def config(
    toml: Toml = None,
    search: Annotated[
        str | None, typer.Option("--search", metavar="WORD", help="Only the keys about this word.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="A list of the keys: type, unit, meaning, default, flag.")
    ] = False,
) -> None:
    """Print every configuration key, as a FLIGHT.toml.

    Each with its value, unit, meaning and flag; without FLIGHT.toml the defaults.
    `liealign config > FLIGHT.toml` makes a file to start from.
    """
    with exit_codes():
        keys = _keys(_read(toml) if toml is not None else Config())
        if search is not None:
            keys = _found(keys, search)
        if as_json:
            print(_as_json(keys, toml is not None))
            return
        source = f" of {toml}" if toml is not None else ""
        print(f"# liealign configuration{source}. A commented key is not set.")
        _print(keys)


def _found(keys: list[Key], word: str) -> list[Key]:
    found = [key for key in keys if key.matches(word)]
    if not found:
        names = {name for key in keys for name in key.field.key.replace("_", ".").split(".")}
        hint = _core.did_you_mean(word, sorted(names)) or "; liealign config lists them all"
        raise InputError(f'no key is about "{word}"{hint}')
    return found
