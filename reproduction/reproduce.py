"""Runs the experiments of the two papers and writes docs/reproduction.md with its figures and numbers.

Each section is kept under build/reproduction/, so that one can be made again alone; the page is put together
from all that are there.

Usage: python reproduction/reproduce.py [--only NAME ...] [--quick] [--jobs 2] [--output docs]
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import argparse
import importlib
import os
import platform
import shutil
import sys
import time
from pathlib import Path

import liealign
import numpy as np

from glance import at_a_glance
from section import FIGURES, HERE, ROOT, Json, Section, cache_folder, markdown_table, write_json

# In the order of the page; each is a module with experiment(quick, jobs) -> Section.
EXPERIMENTS = (
    "fig7",
    "tables",
    "order",
    "consistency",
    "mechanization",
    "fig8",
    "fig4",
    "fig5",
    "outliers",
    "dinsar",
)


def make(name: str, quick: bool, jobs: int) -> Section:
    """Run an experiment and keep its section."""
    module = importlib.import_module(name)
    begin = time.perf_counter()
    section: Section = module.experiment(quick, jobs)
    section = section.completed(time.perf_counter() - begin, quick)
    section.save(cache_folder(quick))
    return section


def known_sections(quick: bool) -> list[Section]:
    """Those that have been made, in the order of the page."""
    paths = [cache_folder(quick) / f"{name}.json" for name in EXPERIMENTS]
    return [Section.load(path) for path in paths if path.exists()]


def duration(seconds: float) -> str:
    """Rough; the next time will not be the same."""
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.1f} min"


def page(sections: list[Section], tables: bool, jobs: int) -> str:
    """The content of reproduction.md."""
    contents = markdown_table(
        ["section", "time"],
        ([f"[{s.title}](#{s.name})", duration(s.seconds)] for s in sections),
    )
    parts = [
        f'<a id="{s.name}"></a>\n\n## {s.title}\n\n{s.text.strip()}\n\nMade by `{s.command}`.\n'
        for s in sections
    ]
    cores, link = len(os.sched_getaffinity(0)), f"[tables.json]({FIGURES}/tables.json)"
    return (
        (HERE / "page.md")
        .read_text(encoding="utf-8")
        .format(
            version=liealign.__version__,
            numpy=np.__version__,
            machine=f"{cores} cores ({jobs} processes), Python {platform.python_version()}",
            folder=FIGURES,
            tables=f", those of TAES Tables II and III also in {link}" if tables else "",
            glance=at_a_glance({s.name: s.numbers for s in sections}),
            contents=contents,
            sections="\n".join(parts).rstrip(),
        )
    )


def write_page(sections: list[Section], output: Path, quick: bool, jobs: int) -> None:
    """The page, its figures and the two JSON files."""
    folder = output / FIGURES
    folder.mkdir(parents=True, exist_ok=True)
    for section in sections:
        for name in section.figures:
            shutil.copyfile(cache_folder(quick) / name, folder / name)
    tables: Json = {}
    for section in sections:
        tables |= section.tables
    if tables:
        write_json(folder / "tables.json", tables)
    write_json(folder / "numbers.json", {s.name: s.numbers for s in sections})
    (output / "reproduction.md").write_text(page(sections, bool(tables), jobs), encoding="utf-8")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="The experiments of the papers on simulated flights.")
    parser.add_argument(
        "--only",
        action="append",
        choices=EXPERIMENTS,
        metavar="NAME",
        help=f"again for more: {', '.join(EXPERIMENTS)}",
    )
    parser.add_argument(
        "--quick", action="store_true", help="few flights, to try it; kept apart from the others"
    )
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    parser.add_argument(
        "--output", type=Path, help="default: docs/; with --quick build/reproduction/quick/page/"
    )
    return parser.parse_args()


def main() -> None:
    a = arguments()
    for name in a.only or EXPERIMENTS:
        if not (HERE / f"{name}.py").exists():
            if a.only:
                sys.exit(f"reproduction/{name}.py is not there")
            continue
        print(f"{name} ...", file=sys.stderr, flush=True)
        section = make(name, a.quick, a.jobs)
        print(f"{name}: {section.title}, {duration(section.seconds)}", file=sys.stderr, flush=True)
    output = a.output or (cache_folder(True) / "page" if a.quick else ROOT / "docs")
    write_page(known_sections(a.quick), output, a.quick, a.jobs)
    print(output / "reproduction.md")


if __name__ == "__main__":
    main()
