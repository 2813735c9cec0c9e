"""docs/reproduction.md and its tables: whole, true to the papers, made by the scripts beside them."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from .conftest import ROOT

PAGE = ROOT / "docs" / "reproduction.md"
FOLDER = ROOT / "docs" / "reproduction"
SCENARIOS = ("helicoidal", "rectangular", "circular")
MODELS = {"table2": ("lie", "mekf", "euler"), "table3": ("lie", "meks", "euler")}
ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
AXES = ("longitude_m", "latitude_m", "altitude_m")


@pytest.fixture(scope="module")
def tables() -> dict[str, Any]:
    content: dict[str, Any] = json.loads((FOLDER / "tables.json").read_text(encoding="utf-8"))
    return content


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("side", ["ours", "paper", "whole_run"])
def test_tables_have_every_cell(tables: dict[str, Any], name: str, side: str) -> None:
    table = tables[name] if side == "ours" else tables[side][name]
    assert tuple(table) == SCENARIOS
    for scenario in SCENARIOS:
        assert tuple(table[scenario]) == MODELS[name]
        for cells in table[scenario].values():
            for channel in (*ANGLES, *AXES):
                assert 0.0 < cells[channel] < 1.0


@pytest.mark.parametrize(
    ("place", "printed"),
    [
        ("table2 helicoidal lie roll_deg", 0.01861),
        ("table2 rectangular euler roll_deg", 0.07520),
        ("table2 circular mekf altitude_m", 0.00883),
        ("table3 helicoidal meks heading_deg", 0.13661),
        ("table3 rectangular lie pitch_deg", 0.00539),
        ("table3 circular euler longitude_m", 0.01000),
    ],
)
def test_the_papers_cells_are_as_printed(tables: dict[str, Any], place: str, printed: float) -> None:
    cell: Any = tables["paper"]
    for key in place.split():
        cell = cell[key]
    assert cell == printed


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("window", ["flight", "whole_run"])
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_lie_column_is_at_or_below_the_papers(
    tables: dict[str, Any], name: str, window: str, scenario: str
) -> None:
    ours = (tables if window == "flight" else tables["whole_run"])[name][scenario]["lie"]
    paper = tables["paper"][name][scenario]["lie"]
    for channel in ANGLES:
        assert ours[channel] <= paper[channel]
    assert math.hypot(*(ours[c] for c in AXES)) <= math.hypot(*(paper[c] for c in AXES))


def test_the_page_has_its_figures_and_names_its_commands() -> None:
    page = PAGE.read_text(encoding="utf-8")
    figures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page)
    assert figures
    for figure in figures:
        assert (PAGE.parent / figure).is_file(), figure
    commands = re.findall(r"reproduce\.py --only (\w+)", page)
    assert set(commands) == {p.stem for p in (ROOT / "reproduction").glob("*.py") if _is_experiment(p)}
    assert "{" not in re.sub(r"`[^`]*`", "", page)  # nothing left to fill in


def _is_experiment(path: Path) -> bool:
    return "def experiment(" in path.read_text(encoding="utf-8")


def test_a_section_is_made_anew(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    command = [sys.executable, "reproduction/reproduce.py", "--quick", "--only", "mechanization"]
    done = subprocess.run(
        [*command, "--output", tmp_path], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "## TAES (13) against the closed form" in (tmp_path / "reproduction.md").read_text(
        encoding="utf-8"
    )
    numbers = json.loads((tmp_path / "reproduction" / "numbers.json").read_text(encoding="utf-8"))[
        "mechanization"
    ]
    right = numbers["exact truth, exact filter"]["helicoidal"]
    assert right["smoother"]["heading_deg"] < 0.1
    assert abs(right["nis"] - 3.0) < 0.5
