"""benchmarks/README.md: the tables of a run, filled into page.md."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import os
import platform
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from targets import KF_GINS_US, memory_mb, seconds_per_heading, stage, targets, us_per_epoch

Json = dict[str, Any]

_STAGES = {
    "read": "read and check the text",
    "prepare": "prepare: coning, rests, preintegration for the alignment",
    "align": "align: find the heading",
    "to_files": "filter, smooth and write SBET, SMRMSG, biases, innovations, summaries",
}
_GTSAM_STAGES = {
    "import": "import",
    "read": "read the text",
    "preintegration": "preintegration, sample by sample from Python",
    "isam2": "ISAM2",
    "levenberg_marquardt": "Levenberg-Marquardt",
    "marginals": "marginals of all poses",
    "write": "write the poses",
}


_ERRORS = {
    "heading_deg": ("deg", 1.0, 4),
    "roll_deg": ("deg", 1.0, 4),
    "pitch_deg": ("deg", 1.0, 4),
    "north_m": ("mm", 1e3, 1),
    "east_m": ("mm", 1e3, 1),
    "down_m": ("mm", 1e3, 1),
}


def machine(build: Path) -> Json:
    """Processor, cores and compiler of the build."""
    cpu = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.is_file() and (found := re.search(r"^model name\s*:\s*(.+)$", info.read_text(), re.MULTILINE)):
        cpu = found.group(1)
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    settings = dict(re.findall(r"^(\w+):\w+=(.*)$", cache, re.MULTILINE))
    compiler = subprocess.run(
        [settings["CMAKE_CXX_COMPILER"], "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]
    native = " -march=native" if settings.get("LIEALIGN_NATIVE") == "ON" else ""
    return {
        "cpu": cpu,
        "cores": len(os.sched_getaffinity(0)),
        "compiler": compiler,
        "flags": settings["CMAKE_CXX_FLAGS_RELEASE"] + native,
    }


def table(head: str, rows: Iterable[Iterable[object]]) -> str:
    """Markdown; columns after the first to the right."""
    names = head.split("|")
    rule = ["---"] + ["---:"] * (len(names) - 1)
    lines = [names, rule, *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(cell.strip() for cell in line) + " |" for line in lines) + "\n"


def seconds(x: float) -> str:
    """Three figures with a unit."""
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        if x * scale >= 1.0 or unit == "ns":
            return f"{x * scale:.3g} {unit}" if x * scale < 100 else f"{x * scale:.0f} {unit}"
    raise AssertionError


def length(figures: Json) -> str:
    """Of a flight."""
    minutes = figures["seconds_of_flight"] / 60
    return f"{minutes:.0f} min" if minutes < 59 else f"{minutes / 60:.0f} h"


def _targets(results: Json) -> str:
    rows = [(t.what, t.wanted, t.figure, "met" if t.met else "**short**") for t in targets(results)]
    return table("|wanted|found|", rows)


def _job(results: Json) -> str:
    figures = results["by_threads"][-1]
    used = [stage(figures, name) for name in _STAGES]
    total = sum(row["seconds"] for row in used)
    shares = [f"{100 * row['seconds'] / total:.0f} %" for row in used]
    rows = [
        (_STAGES[row["stage"]], seconds(row["seconds"]), share)
        for row, share in zip(used, shares, strict=True)
    ]
    alone = stage(figures, "filter_and_smoother")["seconds"]
    rows.append(
        ("(filter and smoother alone, every epoch, no files)", seconds(alone), f"{100 * alone / total:.0f} %")
    )
    return table("stage|time|share", [*rows, ("all", seconds(total), "")])


def _engines(results: Json) -> str:
    post, gtsam = results["jobs"]["post"], results["jobs"].get("gtsam")
    head = "|liealign-post"
    names = {
        "wall_seconds": ("process, start to end", seconds),
        "process_peak_mb": ("peak memory", lambda mb: f"{mb:.0f} MB"),
    }
    rows = [[what, shown(post[key])] for key, (what, shown) in names.items()]
    rows.append(["heading", "found"])
    rows.append(["states with covariance", f"{results['filter']['epochs']}"])
    for axis, (unit, scale, digits) in _ERRORS.items():
        rows.append([f"{axis.rsplit('_', 1)[0]}, rms", f"{scale * post['accuracy'][axis]:.{digits}f} {unit}"])
    if gtsam is None:
        return table(head, rows) + "\nGTSAM was not installed: no comparison in this run.\n"
    others = [shown(gtsam[key]) for key, (_, shown) in names.items()]
    others += ["given", f"{gtsam['keyframes']}"]
    others += [f"{s * gtsam['accuracy'][axis]:.{d}f} {unit}" for axis, (unit, s, d) in _ERRORS.items()]
    text = table(head + "|GTSAM", [[*row, other] for row, other in zip(rows, others, strict=True)])
    ratio = gtsam["wall_seconds"] / post["wall_seconds"]
    bare = (gtsam["wall_seconds"] - gtsam["binding_seconds"]) / post["wall_seconds"]
    stages = [(what, seconds(gtsam["stages"][name])) for name, what in _GTSAM_STAGES.items()]
    calls = seconds(gtsam["binding_seconds"])
    return "\n".join(
        [
            text,
            f"The GTSAM pipeline takes **{ratio:.1f} times** as long. Its stages:\n",
            table("stage|time", stages),
            f"As many calls from Python as there are samples, {gtsam['epochs']}, take {calls} when they do",
            f"nothing; without them it would be {bare:.1f} times.\n",
        ]
    )


def _filters(results: Json) -> str:
    one, short = results["filter"], results["dense_smoother"]
    ours, dense = stage(one, "filter")["seconds"], one["dense"]["filter_seconds"]
    epochs = one["epochs"]
    both = stage(short, "filter_and_smoother")["seconds"]
    dense_both = short["dense"]["filter_and_smoother_seconds"]

    def row(what: str, a: float, b: float, n: int) -> tuple[str, str, str, str]:
        return what, f"{1e6 * a / n:.2f} us", f"{1e6 * b / n:.2f} us", f"{b / a:.1f}"

    rows: list[tuple[str, ...]] = [
        row("filter, per IMU epoch", ours, dense, epochs),
        row(f"filter and smoother, flight of {length(short)}", both, dense_both, short["epochs"]),
    ]
    a, b = one["filtered_accuracy"], one["dense_accuracy"]
    for axis, (unit, scale, digits) in _ERRORS.items():
        figures = (f"{scale * x[axis]:.{digits}f} {unit}" for x in (a, b))
        rows.append((f"filtered {axis.rsplit('_', 1)[0]}, rms", *figures, ""))
    return table("|liealign|dense|ratio", rows)


def _scaling(results: Json) -> str:
    rows = []
    for f in results["scaling"]:
        total = sum(stage(f, name)["seconds"] for name in _STAGES)
        read = stage(f, "prepare")["rss_before_mb"]
        cells = [
            length(f),
            f["epochs"],
            *(seconds(stage(f, name)["seconds"]) for name in _STAGES),
            seconds(total),
            f"{us_per_epoch(f, 'filter_and_smoother'):.2f} us",
            f"{read:.0f} MB",
            f"{memory_mb(f):.0f} MB",
        ]
        rows.append(cells)
    head = "flight|IMU epochs|read|prepare|align|filter, smoother, files|all"
    return table(head + "|filter, smoother per epoch|log in memory|memory beyond the input", rows)


def _threads(results: Json) -> str:
    first = results["by_threads"][0]

    def cell(f: Json, name: str) -> str:
        now, then = stage(f, name)["seconds"], stage(first, name)["seconds"]
        return f"{seconds(now)} ({then / now:.2f})"

    names = ["prepare", "align", "filter", "filter_and_smoother", "to_files"]
    rows = [[f["threads"], *(cell(f, name) for name in names)] for f in results["by_threads"]]
    return table("threads|prepare|align|filter|filter and smoother|the same to files", rows)


def _curves(results: Json) -> str:
    one = results["filter"]
    parts = []
    for key, rate in (("1_hz", "1 Hz"), ("10_hz", "10 Hz")):
        c = results["curves"][key]
        full, _ = seconds_per_heading(c)
        rows = [
            (
                f"{rate}: {row['headings']}",
                seconds(row["seconds"]),
                seconds(row["seconds"] / row["headings"]),
                f"{full * row['headings'] / row['seconds']:.0f}",
                f"{row['seconds'] / stage(one, 'filter')['seconds']:.2f}",
            )
            for row in c["by_intervals"]
        ]
        parts.append(table("headings|curve|one heading|cheaper than by samples|in filter passes", rows))
        parts.append(
            f"\nPreintegration of {c['epochs']} samples into {c['intervals']} intervals: "
            f"{seconds(c['preintegration_seconds'])}, once. One heading by samples: {seconds(full)}.\n"
        )
    return "\n".join(parts).replace("\n\n\n", "\n\n")


def _kernels(results: Json) -> str:
    if not results["kernels"]:
        return "Google Benchmark was not installed: no kernels in this run.\n"
    scale = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    rows = []
    for row in results["kernels"]:
        name = row["run_name"]
        time = row["cpu_time"] * scale[row["time_unit"]]
        if rate := row.get("items_per_second"):
            time = 1.0 / rate
        per_epoch = f"{seconds(time / row['epochs'])}" if "epochs" in row else ""
        rows.append((name, seconds(time), per_epoch))
    return table("kernel|one call|per IMU epoch", rows)


def page(results: Json, template: str) -> str:
    """Fill in the template of benchmarks/README.md."""
    m = results["machine"]
    low, high = KF_GINS_US
    text = template.format(
        machine=f"{m['cpu']}, {m['cores']} core(s); {m['compiler']}, {m['flags']}",
        kf_gins=f"{low:g} to {high:g}",
        threads=results["threads"],
        targets=_targets(results),
        job=_job(results),
        gtsam=_engines(results),
        dense=_filters(results),
        scaling=_scaling(results),
        curves=_curves(results),
        by_threads=_threads(results),
        kernels=_kernels(results),
    )
    return text.rstrip() + "\n"
