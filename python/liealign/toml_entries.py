"""FLIGHT.toml to the flat entries that the field table takes: dotted key, value, line, column."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liealign._core import ConfigError, InputError

if TYPE_CHECKING:
    from liealign._core import Entry

_SECTION = re.compile(r"\s*\[\[?([^\[\]#]+)\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*([\w.\-"' ]+?)\s*=""")
_AT = re.compile(r"\s*\((?:at line (\d+), column (\d+)|at end of document)\)$")


def _dotted(text: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in text.split("."))


def _places(text: str) -> dict[str, tuple[int, int]]:
    """Line and column, from 1, of each `key =` and `[section]` by its dotted name; the first one counts.

    A light scan, for messages: inside a multi-line string it can mistake a line of text for a key.
    """
    places: dict[str, tuple[int, int]] = {}
    section = ""
    for number, line in enumerate(text.splitlines(), start=1):
        column = len(line) - len(line.lstrip()) + 1
        if header := _SECTION.match(line):
            section = _dotted(header.group(1))
            places.setdefault(section, (number, column))
        elif key := _KEY.match(line):
            name = _dotted(key.group(1))
            places.setdefault(f"{section}.{name}" if section else name, (number, column))
    return places


def _leaves(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        key = f"{prefix}{name}"
        if isinstance(value, dict):
            yield from _leaves(value, f"{key}.")
        else:
            yield key, value


def _place(key: str, places: dict[str, tuple[int, int]]) -> tuple[int, int]:
    """Of the key, or of the table it stands in; (0, 0) when neither was found."""
    while key:
        if key in places:
            return places[key]
        key = key.rpartition(".")[0]
    return 0, 0


def read_toml_entries(path: Path) -> list[Entry]:
    """Read the leaves of the file, in its order.

    Raises
    ------
    InputError
        When the file cannot be read.
    ConfigError
        `file:line:column: ...` when it is not valid TOML.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8 text") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(_syntax_error(path, text, str(error))) from None
    places = _places(text)
    return [(key, value, *_place(key, places)) for key, value in _leaves(tree)]


def _syntax_error(path: Path, text: str, message: str) -> str:
    at = _AT.search(message)
    line, column = len(text.splitlines()), 1
    if at and at.group(1):
        line, column = int(at.group(1)), int(at.group(2))
    what = _AT.sub("", message)
    return f'{path}:{line}:{column}: not valid TOML: {what}; expected lines such as key = 1.5 or key = "text"'
