"""What an experiment hands back, and what all of them need: tables, figures, processes."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import dataclasses
import io
import json
import math
import os
import textwrap
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
FIGURES = "reproduction"  # the folder of the figures beside the page, and of its JSON files
Json = dict[str, Any]
Argument = TypeVar("Argument")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Section:
    """One section of the page.

    `text` is Markdown below the title, its pictures made by picture(); `numbers` goes to numbers.json under
    `name`, `tables` is merged into tables.json. `figures` are names of files that save_figure() has written.
    """

    name: str
    title: str
    text: str
    numbers: Json = field(default_factory=dict)
    tables: Json = field(default_factory=dict)
    figures: tuple[str, ...] = ()
    command: str = ""  # empty: reproduce.py --only NAME
    seconds: float = 0.0

    def completed(self, seconds: float, quick: bool) -> Section:
        """With the time taken, the command that makes it again, and no number that JSON does not know."""
        command = (
            self.command
            or f"python reproduction/reproduce.py --only {self.name}{' --quick' if quick else ''}"
        )
        return dataclasses.replace(
            self,
            text=wrapped(self.text),
            command=command,
            seconds=seconds,
            numbers=plain(self.numbers),
            tables=plain(self.tables),
        )

    def save(self, folder: Path) -> None:
        """Write NAME.json into the folder."""
        write_json(folder / f"{self.name}.json", dataclasses.asdict(self))

    @classmethod
    def load(cls, path: Path) -> Section:
        """Read what save() has written."""
        content = json.loads(path.read_text(encoding="utf-8"))
        return cls(**content | {"figures": tuple(content["figures"])})


def cache_folder(quick: bool) -> Path:
    """Where sections and their figures are kept until the page is put together."""
    folder = ROOT / "build" / "reproduction" / ("quick" if quick else "full")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def plain(value: Any) -> Any:
    """Without numpy's types; None for what is not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def write_json(path: Path, content: Any) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


# ---- Markdown ------------------------------------------------------------------------------------


def number(value: float | None, digits: int = 3) -> str:
    """So many digits that count; a dash for none."""
    if value is None or math.isnan(value):
        return "-"
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{value:.{max(places, 0)}f}"


def percent(share: float | None) -> str:
    """Of a share of 1, to a hundredth where it is close to all."""
    if share is None or math.isnan(share):
        return "-"
    return f"{100.0 * share:.2f}" if 0.98 <= share < 1.0 else f"{100.0 * share:.1f}"


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of Markdown, its first column on the left and the others on the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def wrapped(text: str) -> str:
    """With its paragraphs in lines of 110; tables, lists and pictures as they are."""
    blocks = [block.strip("\n") for block in text.strip().split("\n\n")]
    return "\n\n".join(
        block
        if block.startswith(("|", "!", "- ", "* ", "<", "#", "```"))
        else textwrap.fill(block, 110, break_long_words=False, break_on_hyphens=False)
        for block in blocks
    )


def picture(name: str, what: str) -> str:
    """A figure of the page."""
    return f"![{what}]({FIGURES}/{name})\n"


# ---- Figures -------------------------------------------------------------------------------------

_STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.0,
    "lines.markersize": 3,
    "font.family": "sans-serif",
}


def subplots(rows: int, columns: int, width: float, height: float, **options: Any) -> tuple[Figure, Any]:
    """A figure of so many axes and inches in the style of the page."""
    plt.rcdefaults()
    mpl.use("Agg")
    plt.rcParams.update(_STYLE)
    figure, axes = plt.subplots(
        rows, columns, figsize=(width, height), layout="constrained", squeeze=False, **options
    )
    return figure, axes


def save_figure(figure: Figure, name: str, quick: bool) -> str:
    """Write it under that name (.png), without what changes from day to day, and return the name."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=120, facecolor="white")
    plt.close(figure)
    # A line drawing needs few colours; its file is a third of the size then.
    few = Image.open(drawn).convert("RGB").quantize(128, dither=Image.Dither.NONE)
    few.save(cache_folder(quick) / name, format="png", optimize=True)
    return name


# ---- Processes -----------------------------------------------------------------------------------


def mapped(function: Callable[[Argument], Result], jobs: int, arguments: Iterable[Argument]) -> list[Result]:
    """function(argument) of each, in their order, in so many processes of one thread."""
    todo = list(arguments)
    if jobs <= 1 or len(todo) <= 1:
        return [function(argument) for argument in todo]
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"  # what the processes begin with
    try:
        with ProcessPoolExecutor(min(jobs, len(todo)), mp_context=get_context("spawn")) as pool:
            return list(pool.map(function, todo, chunksize=max(1, len(todo) // (8 * jobs))))
    finally:
        os.environ.pop("OMP_NUM_THREADS")
        if before is not None:
            os.environ["OMP_NUM_THREADS"] = before
