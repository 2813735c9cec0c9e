"""The rules of the house, read off the source text: floors, confined libraries, equations, length, heads.

Every rule is a function from a checkout to its faults, so that each is also run on a small bad tree.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# An include goes to a lower floor or stays in its directory; directories on one floor do not see each other.
FLOORS = {
    "core": 1,
    "lie": 2,
    "earth": 2,
    "ins": 3,
    "observe": 4,
    "estimate": 5,
    "simulate": 5,
    "io": 5,
    "align": 6,
    "pipeline": 7,
    "study": 8,
}
# io is a side room: of ins it sees the data structs only.
IO_SEES_OF_INS = {"ins/imu.hpp", "ins/gnss.hpp", "ins/baro.hpp"}

OPENMP_FLOORS = {"align", "estimate", "simulate", "study"}

CPP_SUFFIXES = {".cpp", ".hpp", ".h", ".inl"}
MAX_HEADER_LINES = 260
MAX_SOURCE_LINES = 420
HEAD_LINES = 40
SPDX = "SPDX-License-Identifier: Apache-2.0"

INCLUDE = re.compile(r"^[ \t]*#[ \t]*include[ \t]*([<\"])([^>\"\n]+)[>\"]", re.MULTILINE)
OPENMP = re.compile(
    r"^[ \t]*#[ \t]*(pragma[ \t]+omp\b|include[ \t]*[<\"]omp\.h)|_Pragma\(\"omp", re.MULTILINE
)
LABEL = re.compile(r"\*\*\(Eq\. (\d+)\)\*\*")
CITATION = re.compile(r"\(Eq\. (\d+)\)")
LOOSE_CITATION = re.compile(r"\(Eqs?\b[^)\n]*\)?")

Rule = Callable[[Path], list[str]]


def cpp_files(root: Path, *folders: str) -> Iterator[tuple[Path, str]]:
    """Headers and sources under the folders of a checkout: path relative to it, and text."""
    for folder in folders or ("cpp", "bindings"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in CPP_SUFFIXES:
                yield path.relative_to(root), path.read_text(encoding="utf-8")


def place(path: Path) -> tuple[str, str]:
    """("include" | "src" | "app" | "bindings", floor directory or "") of a relative path."""
    parts = path.parts
    part = "bindings" if parts[0] == "bindings" else parts[1]
    inner = {"include": parts[3:], "src": parts[2:]}.get(part, ())
    return part, inner[0] if len(inner) > 1 else ""


def line_of(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def floor_fault(part: str, floor: str, target: str) -> str | None:
    """What is wrong when a file of `floor` includes "liealign/<target>"; None when nothing is."""
    other = target.split("/")[0]
    if "/" not in target or other not in FLOORS:
        return "is on no floor"
    if part in {"app", "bindings"} or other == floor:
        return None
    if FLOORS[other] > FLOORS[floor]:
        return "goes up"
    if FLOORS[other] == FLOORS[floor]:
        return "goes sideways"
    if floor == "io" and other == "ins" and target not in IO_SEES_OF_INS:
        return f"is not for io, which sees of ins only {sorted(IO_SEES_OF_INS)}"
    return None


def floor_faults(root: Path) -> list[str]:
    faults = []
    for path, text in cpp_files(root):
        part, floor = place(path)
        if part not in {"app", "bindings"} and floor not in FLOORS:
            faults.append(f"{path}: lies on no floor; the floors are {sorted(FLOORS)}")
            continue
        for match in INCLUDE.finditer(text):
            quote, name = match.groups()
            if name.startswith("liealign/"):
                fault = floor_fault(part, floor, name.removeprefix("liealign/"))
            elif quote == '"' and "/" in name:
                fault = 'hides its floor; write #include "liealign/..."'
            else:
                continue
            if fault:
                faults.append(f"{path}:{line_of(text, match.start())}: include of {name} {fault}")
    return faults


def confinement_fault(name: str, path: Path) -> str | None:
    """Where a library may be included, and the fault when `path` is elsewhere."""
    part, floor = place(path)
    if name.startswith("ceres/") and not (part == "src" and floor == "align"):
        return "Ceres belongs in cpp/src/align only"
    if name in {"iostream", "fstream"} and not (part == "app" or floor == "io"):
        return f"<{name}> belongs in cpp/app and io only"
    if name.startswith("pybind11/") and part != "bindings":
        return "pybind11 belongs in bindings/ only"
    return None


def confinement_faults(root: Path) -> list[str]:
    faults = []
    for path, text in cpp_files(root):
        for match in INCLUDE.finditer(text):
            if fault := confinement_fault(match.group(2), path):
                faults.append(f"{path}:{line_of(text, match.start())}: {fault}")
        part, floor = place(path)
        parallel = part == "src" and path.suffix == ".cpp" and floor in OPENMP_FLOORS
        if not parallel and (found := OPENMP.search(text)):
            where = f"{path}:{line_of(text, found.start())}"
            faults.append(f"{where}: OpenMP belongs in the .cpp files of {sorted(OPENMP_FLOORS)} only")
    return faults


def label_faults(root: Path) -> list[str]:
    """docs/equations.md numbers its equations 1, 2, 3, ... in order, each once."""
    path = root / "docs" / "equations.md"
    if not path.is_file():
        return ["docs/equations.md is missing"]
    labels = [int(number) for number in LABEL.findall(path.read_text(encoding="utf-8"))]
    if not labels:
        return ["docs/equations.md has no label **(Eq. n)**"]
    return [
        f"docs/equations.md: label number {number} is (Eq. {label}), expected (Eq. {number})"
        for number, label in enumerate(labels, start=1)
        if label != number
    ][:1]


def citation_faults(root: Path) -> list[str]:
    """Every (Eq. n) cited in code is in docs/equations.md; none is written so that it escapes this rule."""
    path = root / "docs" / "equations.md"
    if not path.is_file():
        return ["docs/equations.md is missing"]
    labels = set(LABEL.findall(path.read_text(encoding="utf-8")))
    faults = []
    for folder in ("cpp", "bindings", "python"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in CPP_SUFFIXES | {".py", ".pyi"}:
                continue
            text = file.read_text(encoding="utf-8")
            for match in LOOSE_CITATION.finditer(text):
                where = f"{file.relative_to(root)}:{line_of(text, match.start())}"
                exact = CITATION.fullmatch(match.group())
                if not exact:
                    faults.append(f'{where}: cites "{match.group()}"; write (Eq. n), one number each')
                elif exact.group(1) not in labels:
                    faults.append(f"{where}: cites {match.group()}, which docs/equations.md does not have")
    return faults


def length_faults(root: Path) -> list[str]:
    faults = []
    for path, text in cpp_files(root, "cpp/include", "cpp/src"):
        lines = len(text.splitlines())
        limit = MAX_SOURCE_LINES if path.suffix == ".cpp" else MAX_HEADER_LINES
        if lines > limit:
            faults.append(f"{path}: {lines} lines, at most {limit}")
    return faults


def head_faults(root: Path) -> list[str]:
    """A file opens with a comment that says what it is, and names its licence near the top."""
    faults = []
    for path, text in cpp_files(root):
        lines = text.splitlines()
        first = lines[0] if lines else ""
        if not re.match(r"//\s*\w", first) or "SPDX" in first:
            faults.append(f"{path}:1: does not open with a comment line that says what the file is")
        if not any(SPDX in line for line in lines[:HEAD_LINES]):
            faults.append(f'{path}: no "{SPDX}" within its first {HEAD_LINES} lines')
    return faults


def tidy_faults(root: Path) -> list[str]:
    """Every check that .clang-tidy disables has a comment line "# -check: reason" there."""
    text = (root / ".clang-tidy").read_text(encoding="utf-8")
    disabled = re.findall(r"^ *-([a-z][\w.*-]+),?$", text, re.MULTILINE)
    reasons = set(re.findall(r"^# -([\w.*-]+): \S", text, re.MULTILINE))
    return [
        f".clang-tidy: {check} is disabled without a reason" for check in disabled if check not in reasons
    ]


RULES = [
    floor_faults,
    confinement_faults,
    label_faults,
    citation_faults,
    length_faults,
    head_faults,
    tidy_faults,
]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_house_keeps_the_rule(rule: Rule) -> None:
    assert list(cpp_files(ROOT, "cpp/include")), "no headers found: the rules would hold for nothing"
    faults = rule(ROOT)
    assert not faults, "\n" + "\n".join(faults)


HEAD = f"// A file.\n// {SPDX}\n"
DOC = "**(Eq. 1)** a\n**(Eq. 2)** b\n"


def inc(target: str) -> str:
    return f'{HEAD}#include "liealign/{target}"\n'


GOOD = {
    "docs/equations.md": DOC,
    ".clang-tidy": "# -a-b: noise\nChecks: >-\n  a-*,\n  -a-b\n",
    "cpp/include/liealign/core/a.hpp": HEAD,
    "cpp/include/liealign/ins/a.hpp": inc("lie/a.hpp")
    + '#include "liealign/ins/imu.hpp"\n// (Eq. 1)-(Eq. 2)\n',
    "cpp/src/io/a.cpp": inc("ins/imu.hpp") + "#include <fstream>\n",
    "cpp/src/align/a.cpp": inc("estimate/a.hpp") + "#include <ceres/ceres.h>\n#pragma omp parallel for\n",
    "cpp/app/main.cpp": inc("study/a.hpp") + "#include <iostream>\n",
    "bindings/module.cpp": inc("align/a.hpp") + '#include <pybind11/eigen.h>\n#include "floors.hpp"\n',
}

BAD = [
    (floor_faults, "cpp/include/liealign/lie/b.hpp", inc("ins/imu.hpp")),
    (floor_faults, "cpp/include/liealign/lie/b.hpp", inc("earth/a.hpp")),
    (floor_faults, "cpp/include/liealign/earth/b.hpp", f"{HEAD}#include <liealign/lie/a.hpp>\n"),
    (floor_faults, "cpp/src/simulate/b.cpp", inc("estimate/a.hpp")),
    (floor_faults, "cpp/src/estimate/b.cpp", inc("io/a.hpp")),
    (floor_faults, "cpp/src/io/b.cpp", inc("ins/mechanization.hpp")),
    (floor_faults, "cpp/src/align/b.cpp", inc("pipeline/config.hpp")),
    (floor_faults, "cpp/src/core/b.cpp", f'{HEAD}#include "../lie/a.hpp"\n'),
    (floor_faults, "cpp/src/attic/b.cpp", HEAD),
    (floor_faults, "cpp/src/b.cpp", HEAD),
    (floor_faults, "cpp/b.cpp", HEAD),
    (floor_faults, "cpp/src/core/b.h", inc("lie/a.hpp")),
    (floor_faults, "bindings/b.cpp", inc("attic/a.hpp")),
    (confinement_faults, "cpp/include/liealign/align/b.hpp", f"{HEAD}#include <ceres/jet.h>\n"),
    (confinement_faults, "cpp/src/estimate/b.cpp", f"{HEAD}#include <ceres/jet.h>\n"),
    (confinement_faults, "cpp/include/liealign/estimate/b.hpp", f"{HEAD}#pragma omp parallel for\n"),
    (confinement_faults, "cpp/src/pipeline/b.cpp", f"{HEAD}#include <omp.h>\n"),
    (confinement_faults, "bindings/b.cpp", f"{HEAD}  # pragma omp critical\n"),
    (confinement_faults, "cpp/src/pipeline/b.cpp", f"{HEAD}#include <fstream>\n"),
    (confinement_faults, "bindings/b.cpp", f"{HEAD}#include <iostream>\n"),
    (confinement_faults, "cpp/app/b.cpp", f"{HEAD}#include <pybind11/numpy.h>\n"),
    (label_faults, "docs/equations.md", "**(Eq. 1)** a\n**(Eq. 1)** b\n**(Eq. 2)** c\n"),
    (label_faults, "docs/equations.md", "**(Eq. 1)** a\n**(Eq. 3)** b\n"),
    (label_faults, "docs/equations.md", "no labels\n"),
    (citation_faults, "python/liealign/b.py", '"""Uses (Eq. 3)."""\n'),
    (citation_faults, "bindings/b.cpp", f"{HEAD}// (Eq. 0)\n"),
    (citation_faults, "cpp/src/core/b.cpp", f"{HEAD}// (Eqs. 1, 2)\n"),
    (length_faults, "cpp/include/liealign/core/b.hpp", HEAD + "\n" * (MAX_HEADER_LINES - 1)),
    (length_faults, "cpp/src/core/b.cpp", HEAD + "\n" * (MAX_SOURCE_LINES - 1)),
    (head_faults, "cpp/src/core/b.cpp", f"#include <vector>\n// {SPDX}\n"),
    (head_faults, "cpp/include/liealign/core/b.hpp", "// A file.\n" * HEAD_LINES + f"// {SPDX}\n"),
    (head_faults, "bindings/b.cpp", ""),
    (tidy_faults, ".clang-tidy", "# -a-b: noise\nChecks: >-\n  a-*,\n  -a-b,\n  -a-c\n"),
    (tidy_faults, ".clang-tidy", "# -a-b:\nChecks: >-\n  a-*,\n  -a-b\n"),
]


def make_tree(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_rule_accepts_a_good_tree(rule: Rule, tmp_path: Path) -> None:
    assert rule(make_tree(tmp_path, GOOD)) == []


@pytest.mark.parametrize(("rule", "name", "text"), BAD)
def test_rule_finds_the_fault(rule: Rule, name: str, text: str, tmp_path: Path) -> None:
    faults = rule(make_tree(tmp_path, GOOD | {name: text}))
    assert len(faults) == 1 + (text == "") and all(name in fault for fault in faults)


@pytest.mark.parametrize("rule", [label_faults, citation_faults])
def test_rule_wants_the_equations_page(rule: Rule, tmp_path: Path) -> None:
    tree = make_tree(tmp_path, GOOD)
    (tree / "docs" / "equations.md").unlink()
    assert rule(tree) == ["docs/equations.md is missing"]
