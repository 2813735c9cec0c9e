"""Runs every benchmark and writes benchmarks/README.md. Called by `make bench`.

Makes the flights (kept in BUILD/flights), runs the executables of the build and GTSAM as processes of their
own, one after the other, and keeps all figures in BUILD/results.json, from which --report writes the page. A
quick run keeps its page in BUILD/README.md.

Usage: python benchmarks/run.py --build build/bench [--quick] [--report]
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import argparse
import dataclasses
import filecmp
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from accuracy import accuracy, read_poses, read_sbet
from common_flight import LEVER_ARM_B_M, START_HEADING_DEG, FlightSpec, make_flight
from report import machine, page
from targets import targets

HERE = Path(__file__).resolve().parent
Json = dict[str, Any]

# Long flights only have to be long: two points of an IMU interval do, and no truth.
_FLIGHTS = {
    "common": FlightSpec(),
    "common_10_hz": FlightSpec(gnss_rate_hz=10, truth=False),
    "10_min": FlightSpec(600.0, substeps=2, truth=False),
    "1_h": FlightSpec(3600.0, substeps=2, truth=False),
    "3_h": FlightSpec(10800.0, substeps=2, truth=False),
    "10_h": FlightSpec(36000.0, substeps=2, truth=False),
}
_LEVER_ARM = ["--lever-arm", *map(str, LEVER_ARM_B_M)]


@dataclass(frozen=True)
class Plan:
    """What is run how often."""

    repeat: int
    scaling: tuple[str, ...]
    headings: tuple[int, ...]
    kernel_seconds: float


_FULL = Plan(5, ("10_min", "common", "1_h", "3_h", "10_h"), (3, 6, 12, 24, 60, 120, 240, 360), 0.2)
_QUICK = Plan(1, ("10_min", "common"), (3, 60), 0.02)


@dataclass(frozen=True)
class Done:
    """A process that has ended well."""

    seconds: float
    peak_mb: float
    output: str


# A process begins with the peak memory of the one that has started it, so a small one does. It writes
# seconds, peak memory and exit code to the file that is its first argument.
_MEASURE = """
import json, os, subprocess, sys, time
begin = time.perf_counter()
process = subprocess.Popen(sys.argv[2:])
_, status, usage = os.wait4(process.pid, 0)
figures = [time.perf_counter() - begin, usage.ru_maxrss, os.waitstatus_to_exitcode(status)]
open(sys.argv[1], "w").write(json.dumps(figures))
"""


def run(command: Sequence[str | Path], threads: int) -> Done:
    """Run a process; seconds of the wall clock from start to end, as its user sees them."""
    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    with tempfile.NamedTemporaryFile("r") as figures:
        measured = [sys.executable, "-S", "-c", _MEASURE, figures.name, *map(str, command)]
        output = subprocess.run(
            measured, stdout=subprocess.PIPE, env=environment, text=True, check=True
        ).stdout
        seconds, peak_kb, code = json.load(figures)
    if code != 0:
        raise SystemExit(f"{command[0]} failed with exit code {code}")
    return Done(seconds, 1.024e-3 * peak_kb, output)


def say(text: str) -> None:
    """Tell what goes on."""
    print(text, file=sys.stderr, flush=True)


@contextmanager
def scratch_folder(build: Path) -> Iterator[Path]:
    """Beside the flights: long trajectories are larger than some /tmp."""
    folder = Path(tempfile.mkdtemp(prefix="out-", dir=build))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


class Bench:
    """The executables, the flights and the plan."""

    def __init__(self, build: Path, plan: Plan) -> None:
        self.build = build
        self.plan = plan
        self.threads = len(os.sched_getaffinity(0))

    def flight(self, name: str) -> Path:
        """Folder of a flight, made when it is not there or was another one."""
        spec = _FLIGHTS[name]
        folder = self.build / "flights" / name
        mark = folder / "spec.json"
        wanted = json.dumps(dataclasses.asdict(spec))
        if not mark.is_file() or mark.read_text() != wanted:
            say(f"making the flight {name} ({spec.duration_s:.0f} s)")
            make_flight(folder, spec)
            mark.write_text(wanted)
        return folder

    def inputs(self, name: str) -> list[str | Path]:
        folder = self.flight(name)
        return ["--imu", folder / "imu.csv", "--gnss", folder / "gnss.csv", *_LEVER_ARM]

    def stages(self, flight: str, threads: int, *more: str | Path, repeat: int | None = None) -> Json:
        """Figures of liealign-stages."""
        inputs = self.inputs(flight)
        say(f"stages of {flight}, {threads} thread(s) {' '.join(map(str, more))}")
        count = ["--repeat", str(repeat or self.plan.repeat)]
        done = run([self.build / "benchmarks" / "liealign-stages", *inputs, *count, *more], threads)
        figures: Json = json.loads(done.output)
        return figures

    def post(self, threads: int, out: Path) -> Done:
        """One run of liealign-post on the common flight."""
        inputs = self.inputs("common")
        output: list[str | Path] = ["--format", "sbet", "-o", out, "--quiet"]
        return run([self.build / "liealign-post", *inputs, *output], threads)

    def gtsam(self, out: Path, *more: str) -> Done:
        """One run of the GTSAM pipeline on the common flight."""
        inputs: list[str | Path] = [HERE / "gtsam_pipeline.py", self.flight("common"), out]
        start = ["--heading", str(START_HEADING_DEG), *_LEVER_ARM, *more]
        return run([sys.executable, *inputs, *start], self.threads)


# ---- What is measured ----------------------------------------------------------------------------


def measure_filter(bench: Bench) -> Json:
    """The full-rate filter and the dense one, on one thread; their errors; the check of the smoother."""
    truth = read_poses(bench.flight("common") / "truth.csv")
    with scratch_folder(bench.build) as out:
        figures = bench.stages("common", 1, "--dense", "--check", "--states", out)
        for name in ("filtered", "dense"):
            errors = accuracy(read_poses(out / f"{name}_at_fixes.csv"), truth)
            figures[f"{name}_accuracy"] = dataclasses.asdict(errors)
    return figures


def measure_threads(bench: Bench) -> list[Json]:
    """The job on 1, 2, 4, ... threads."""
    counts = [1 << i for i in range(bench.threads.bit_length()) if 1 << i < bench.threads]
    rows = []
    for threads in [*counts, bench.threads]:
        with scratch_folder(bench.build) as out:
            rows.append(bench.stages("common", threads, "--auto", "--write", out))
    return rows


def measure_scaling(bench: Bench) -> list[Json]:
    """Flights of all lengths, once each: the job with its files."""
    rows = []
    for name in bench.plan.scaling:
        with scratch_folder(bench.build) as out:
            rows.append(bench.stages(name, bench.threads, "--auto", "--write", out, repeat=1))
    return rows


def measure_curves(bench: Bench) -> Json:
    """Curves of many headings over the whole common flight, fixes at 1 and at 10 Hz, on one thread."""
    headings = ",".join(map(str, bench.plan.headings))
    options = ["--align-time", "0", "--by-samples", "3", "--candidates"]
    return {
        "1_hz": bench.stages("common", 1, *options, headings)["curves"],
        "10_hz": bench.stages("common_10_hz", 1, *options, "3,60")["curves"],
    }


def measure_jobs(bench: Bench) -> Json:
    """liealign-post and the GTSAM pipeline as processes, in turn."""
    truth = read_poses(bench.flight("common") / "truth.csv")
    with_gtsam = find_spec("gtsam") is not None
    posts, others = [], []
    result: Json = {}
    with scratch_folder(bench.build) as out:
        for i in range(max(bench.plan.repeat, 1)):
            say(f"the whole job, run {i + 1}")
            posts.append(bench.post(bench.threads, out / "post"))
            if with_gtsam:
                others.append(bench.gtsam(out / "gtsam"))
        errors = accuracy(read_sbet(out / "post" / "trajectory.sbet"), truth)
        result["post"] = job(posts) | {"accuracy": dataclasses.asdict(errors)}
        bench.post(1, out / "one")
        result["same_bytes"] = same_files(out / "one", out / "post")
        if with_gtsam:
            bench.gtsam(out / "gtsam", "--binding")
            times = json.loads((out / "gtsam" / "times.json").read_text())
            errors = accuracy(read_poses(out / "gtsam" / "poses.csv"), truth)
            result["gtsam"] = job(others) | times | {"accuracy": dataclasses.asdict(errors)}
    return result


def job(runs: list[Done]) -> Json:
    """Median wall time, and memory."""
    return {
        "wall_seconds": statistics.median(done.seconds for done in runs),
        "process_peak_mb": statistics.median(done.peak_mb for done in runs),
    }


def same_files(one: Path, other: Path) -> bool:
    """Whether two folders hold the same names and bytes."""
    names = sorted(path.name for path in one.iterdir())
    if names != sorted(path.name for path in other.iterdir()):
        return False
    return filecmp.cmpfiles(one, other, names, shallow=False)[0] == names


def measure_kernels(bench: Bench) -> list[Json]:
    """Medians of Google Benchmark; nothing where it was not there at build time."""
    program = bench.build / "benchmarks" / "liealign-kernels"
    if not program.is_file():
        return []
    say("kernels")
    options = [f"--benchmark_min_time={bench.plan.kernel_seconds}", "--benchmark_format=json"]
    repeat = ["--benchmark_repetitions=5", "--benchmark_report_aggregates_only=true"]
    done = run([program, *options, *repeat], 1)
    rows: list[Json] = json.loads(done.output)["benchmarks"]
    return [row for row in rows if row["aggregate_name"] == "median"]


def measure(bench: Bench) -> Json:
    """Everything, one after the other."""
    return {
        "machine": machine(bench.build),
        "threads": bench.threads,
        "filter": measure_filter(bench),
        "filter_auto": bench.stages("common", 1, "--auto"),
        "curves": measure_curves(bench),
        "jobs": measure_jobs(bench),
        "by_threads": measure_threads(bench),
        "kernels": measure_kernels(bench),
        "dense_smoother": bench.stages("10_min", 1, "--dense", "--dense-smoother"),
        "scaling": measure_scaling(bench),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Every benchmark, and benchmarks/README.md.")
    parser.add_argument("--build", type=Path, required=True, help="a build with LIEALIGN_BENCHMARKS=ON")
    parser.add_argument("--quick", action="store_true", help="short flights, once: to try it")
    parser.add_argument("--report", action="store_true", help="only write the page from the last figures")
    a = parser.parse_args()
    build = a.build.resolve()
    kept = build / "results.json"
    if not a.report:
        load = os.getloadavg()[0]
        if load > 0.5:
            say(f"warning: the machine is busy (load {load:.1f}); times will be too long")
        results = measure(Bench(build, _QUICK if a.quick else _FULL)) | {"quick": a.quick}
        kept.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    results = json.loads(kept.read_text(encoding="utf-8"))
    readme = build / "README.md" if results["quick"] else HERE / "README.md"
    readme.write_text(page(results, (HERE / "page.md").read_text(encoding="utf-8")), encoding="utf-8")
    for target in targets(results):
        print(f"{'met  ' if target.met else 'SHORT'} {target.figure:>24}  {target.what} ({target.wanted})")


if __name__ == "__main__":
    main()
