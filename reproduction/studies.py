"""The study of Table I, in the variations that the sections need."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
from typing import Any

from liealign.study import Study, make_study, read_study

from section import HERE

CONFIG = HERE / "table1.toml"
SCENARIOS = ("helicoidal", "rectangular", "circular")
MODELS = {"lie": "Lie", "mekf": "MEKF", "euler": "Euler"}


def table_1(keys: dict[str, Any] | None = None) -> Study:
    """table1.toml with other keys."""
    return make_study(keys or {}, base=read_study(CONFIG))


def settings(keys: dict[str, Any]) -> str:
    """The keys that differ from table1.toml, for the text."""
    return ", ".join(f"`{key} = {_toml(value)}`" for key, value in keys.items())


def _toml(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else json.dumps(value)
