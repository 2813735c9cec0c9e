"""Heading alignment over many simulated flights: is it right, and are its sigmas and intervals true?

Each case draws flights by their seeds (liealign.random_flight), aligns them in helper processes, and sets the
errors against the truth at the alignment's start_time_s beside what is stated and what is wanted. A run of
all cases writes benchmarks/alignment.md from alignment_page.md.

Usage: python benchmarks/alignment.py [-n 200] [--case NAME ...] [--seed 1] [--jobs 2] [--json F] [--page F]
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
import platform
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

# Flights go to processes of their own; a second level of threads would only be in the way.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import liealign
import numpy as np

HERE = Path(__file__).resolve().parent
Json = dict[str, Any]

MOVING = ("lines", "circles", "helical", "rectangular")
LEVER_ARM_B_M = (0.1, -0.05, -0.3)
PARKED_S = 30.0
WHOLE_N = 200  # what the limits on the coverage are made for
_AUTO = {"gnss.latency_s": "auto", "imu.noise_scale": "auto", "gnss.std_scale": "auto"}
_SCALES_GIVEN: Json = {"imu.noise_scale": 1.0, "gnss.std_scale": 1.0, "gnss.error_model": "white"}


@dataclass(frozen=True)
class Case:
    """Flights of one sort, what is told to the alignment, and what is wanted of it."""

    name: str
    what: str
    kinds: tuple[str, ...] = MOVING
    gentle: bool = False
    window_s: float = 30.0  # the log ends so long after the take-off, or after its beginning in the air
    auto: bool = False  # latency and noise scales are not told
    gnss_hz: float = 1.0
    latency_s: float = 0.0  # drawn from -this to this
    outliers: float = 0.0
    accel_bias_mg: float = 0.5
    bias_told: bool = True  # its size stands in the config
    begin_s: tuple[float, float] | None = None  # after the take-off: the log begins there
    wanted: tuple[Wanted, ...] = ()


@dataclass(frozen=True)
class Wanted:
    """A figure of a case and the limits it is held to, both included."""

    figure: str
    low: float = -math.inf
    high: float = math.inf
    times: str = ""  # high is in units of the same figure of this case

    def text(self) -> str:
        """In words."""
        unit = _UNITS.get(self.figure, "")
        if self.times:
            return f"{_NAMES[self.figure]} at most {self.high:g} times that of {self.times}"
        if self.low == self.high:
            return f"{_NAMES[self.figure]} {self.low:g}{unit}"
        if math.isinf(self.low):
            return f"{_NAMES[self.figure]} at most {self.high:g}{unit}"
        if math.isinf(self.high):
            return f"{_NAMES[self.figure]} at least {self.low:g}{unit}"
        return f"{_NAMES[self.figure]} {self.low:g} to {self.high:g}{unit}"


_NAMES = {
    "rms_deg": "heading rms",
    "max_deg": "largest error",
    "rms_over_sigma": "rms over that of the stated sigma",
    "covered_percent": "95 % interval covers",
    "aligned_percent": "verdict aligned",
    "latency_rms_ms": "latency rms",
}
_UNITS = {
    "rms_deg": " deg",
    "max_deg": " deg",
    "covered_percent": " %",
    "aligned_percent": " %",
    "latency_rms_ms": " ms",
}
_COVERED = Wanted("covered_percent", 91.0, 98.0)
_NOTHING = (Wanted("aligned_percent", high=0.0), Wanted("covered_percent", low=91.0))
_TRUE_SIGMA = Wanted("rms_over_sigma", high=1.1)
_IN_30_S = (Wanted("rms_deg", high=0.06), Wanted("max_deg", high=0.3), _TRUE_SIGMA, _COVERED)
_GENTLE = (Wanted("rms_over_sigma", high=1.15), _COVERED)

CASES = (
    Case("given", "30 s after take-off, latency and scales given", wanted=_IN_30_S),
    Case("auto", "the same with all automatic", auto=True),
    Case("gentle", "gentle flights, 60 s", gentle=True, window_s=60.0, wanted=_GENTLE),
    Case("gentle-auto", "the same with all automatic", gentle=True, window_s=60.0, auto=True),
    Case(
        *("air", "the log begins in the air; 60 s of it"),
        window_s=60.0,
        begin_s=(10.0, 40.0),
        wanted=(Wanted("rms_deg", high=0.3), _COVERED),
    ),
    Case("air-auto", "the same with all automatic", window_s=60.0, begin_s=(10.0, 40.0), auto=True),
    Case(
        *("latency", "latency of -0.3 to 0.3 s not told, all automatic; 5 Hz, 90 s"),
        window_s=90.0,
        gnss_hz=5.0,
        latency_s=0.3,
        auto=True,
        wanted=(Wanted("latency_rms_ms", high=5.0), Wanted("rms_deg", high=0.1)),
    ),
    Case(
        *("outliers", "5 % of the fixes wrong by 2 to 10 m; the flights of `given`"),
        outliers=0.05,
        wanted=(Wanted("rms_deg", high=1.5, times="given"),),
    ),
    Case(
        *("outliers-auto", "the same with all automatic; the flights of `auto`"),
        outliers=0.05,
        auto=True,
        wanted=(Wanted("rms_deg", high=1.5, times="auto"),),
    ),
    Case("parked", "parked for 90 s", kinds=("parked",), window_s=60.0, wanted=_NOTHING),
    Case(
        "parked-auto",
        "the same with all automatic",
        kinds=("parked",),
        window_s=60.0,
        auto=True,
        wanted=_NOTHING,
    ),
    Case("hover", "take-off and hover, 60 s", kinds=("hover",), window_s=60.0, wanted=_NOTHING),
    Case(
        "hover-auto",
        "the same with all automatic",
        kinds=("hover",),
        window_s=60.0,
        auto=True,
        wanted=_NOTHING,
    ),
    Case(
        *("hover-air", "nothing but hover, 60 s, all automatic"),
        kinds=("hover",),
        window_s=60.0,
        auto=True,
        begin_s=(25.0, 25.0),
        wanted=_NOTHING,
    ),
    Case("bias-20", "accelerometer biases of 20 mg, told", accel_bias_mg=20.0),
    Case("bias-50", "accelerometer biases of 50 mg, told", accel_bias_mg=50.0),
    Case(
        "bias-20-untold",
        "of 20 mg, the profile says 1/3; all automatic",
        accel_bias_mg=20.0,
        bias_told=False,
        auto=True,
    ),
)


# ---- One flight ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Trial:
    """What came of one flight."""

    kind: str
    seed: int
    failure: str = ""
    error_deg: float = math.nan
    sigma_deg: float = math.nan  # nan: the alignment says that the data say nothing
    covered: bool = False
    verdict: str = ""
    start: str = ""
    latency_error_s: float = math.nan
    latency_sigma_s: float = math.nan  # nan: not estimated
    seconds: float = math.nan


def simulate(case: Case, kind: str, seed: int) -> liealign.SimulatedFlight:
    """The flight of a seed; cases that differ in what is told or in outliers have the same flights."""
    draw = np.random.default_rng(seed)
    latency_s = case.latency_s * draw.uniform(-1.0, 1.0)
    outlier_m = draw.uniform(2.0, 10.0)
    begin_s = None if case.begin_s is None else draw.uniform(*case.begin_s)
    drone = liealign.random_flight(kind, gentle=case.gentle, seed=seed)
    drone.parked_before_s = PARKED_S
    # A flight has to have its landing, of which nothing is used.
    drone.duration_s = 90.0 if kind == "parked" else 400.0 if case.gentle else 240.0
    gnss = liealign.GnssErrors(
        rate_hz=case.gnss_hz,
        l_ba_b=LEVER_ARM_B_M,
        latency_s=latency_s,
        outlier_probability=case.outliers,
        outlier_m=outlier_m,
    )
    keys: Json = _AUTO if case.auto else _SCALES_GIVEN | {"gnss.latency_s": latency_s}
    if case.bias_told and case.accel_bias_mg > 0.5:
        keys = keys | {"imu.accel_bias_turn_on_mg": case.accel_bias_mg}
    imu = liealign.ImuErrorSizes(accel_turn_on_ug=1e3 * case.accel_bias_mg, turn_on="fixed")
    simulated = liealign.simulate_flight(drone, gnss, liealign.make_config(keys), seed, imu)
    take_off_s = drone.start_time_s + PARKED_S
    first_s = drone.start_time_s if begin_s is None else take_off_s + begin_s
    return simulated.between(first_s, take_off_s + (begin_s or 0.0) + case.window_s)


def wrap_deg(angle: float) -> float:
    """To [-180, 180)."""
    return (angle + 180.0) % 360.0 - 180.0


def covers(interval_deg: list[float] | None, heading_deg: float) -> bool:
    """Whether the interval, clockwise from its first to its second end, has the heading; none: the circle."""
    if interval_deg is None:
        return True
    low, high = interval_deg
    width = high - low if high - low >= 360.0 else (high - low) % 360.0
    return (heading_deg - low) % 360.0 <= width


def run_trial(case: Case, index: int, seed: int) -> Trial:
    """Simulate and align one flight."""
    kind = case.kinds[index % len(case.kinds)]
    simulated = simulate(case, kind, seed + index)
    trial = Trial(kind, seed + index)
    begin = time.perf_counter()
    try:
        alignment = liealign.align_heading(simulated.flight)
    except liealign.Error as error:
        return dataclasses.replace(trial, failure=str(error))
    seconds = time.perf_counter() - begin
    true_deg = simulated.heading_deg_at(alignment.start_time_s)
    content = alignment.to_dict()
    sigma, latency_sigma = alignment.heading_std_deg, content["gnss_latency_std_s"]
    latency_s = case.latency_s * np.random.default_rng(seed + index).uniform(-1.0, 1.0)
    return dataclasses.replace(
        trial,
        error_deg=wrap_deg(alignment.heading_deg - true_deg),
        sigma_deg=math.nan if sigma is None else sigma,
        # The longest width of an interval is that of the circle.
        covered=covers(content["heading_95_deg"], true_deg) or (sigma is not None and 1.96 * sigma >= 180.0),
        verdict=alignment.verdict,
        start=content["start"],
        latency_error_s=content["gnss_latency_s"] - latency_s,
        latency_sigma_s=math.nan if latency_sigma is None else latency_sigma,
        seconds=seconds,
    )


# ---- Many ----------------------------------------------------------------------------------------


def rms(values: Iterable[float]) -> float:
    """Root mean square; nan for none."""
    squares = [value * value for value in values]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def figures_of(trials: list[Trial]) -> Json:
    """Figures of a case, over the flights that were aligned at all."""
    done = [trial for trial in trials if not trial.failure]
    stated = [trial for trial in done if not math.isnan(trial.sigma_deg)]
    reasons = Counter(trial.failure for trial in trials if trial.failure)
    n = max(len(done), 1)
    # The worst of a hundred may hide in an rms: outside three sigma, as a normal law has 0.27 % of them.
    outside = sum(abs(t.error_deg) > 3.0 * t.sigma_deg for t in stated)
    return {
        "flights": len(trials),
        "failed": len(trials) - len(done),
        "reason": reasons.most_common(1)[0][0] if reasons else "",
        "rms_deg": rms(t.error_deg for t in done),
        "median_deg": float(np.median([abs(t.error_deg) for t in done])) if done else math.nan,
        "max_deg": max((abs(t.error_deg) for t in done), default=math.nan),
        "sigma_rms_deg": rms(t.sigma_deg for t in stated),
        "rms_over_sigma": rms(t.error_deg for t in stated) / rms(t.sigma_deg for t in stated)
        if stated
        else math.nan,
        "normalised_rms": rms(t.error_deg / t.sigma_deg for t in stated),
        "outside_3_sigma": outside,
        "covered_percent": 100.0 * sum(t.covered for t in done) / n if done else math.nan,
        "verdicts": dict(Counter(t.verdict for t in done)),
        "aligned_percent": 100.0 * sum(t.verdict == "aligned" for t in done) / n if done else math.nan,
        "starts": dict(Counter(t.start for t in done)),
        "latency_rms_ms": 1e3 * rms(t.latency_error_s for t in done),
        "latency_sigma_rms_ms": 1e3
        * rms(t.latency_sigma_s for t in done if not math.isnan(t.latency_sigma_s)),
        "latency_estimated": sum(not math.isnan(t.latency_sigma_s) for t in done),
        "align_seconds": float(np.median([t.seconds for t in done])) if done else math.nan,
    }


def shortfalls(case: Case, results: Json) -> list[str]:
    """What a case is wanted to show and does not."""
    figures = results[case.name]["figures"]
    short = []
    if figures["failed"]:
        short.append(f"{figures['failed']} of {figures['flights']} failed: {figures['reason']}")
    for wanted in case.wanted:
        unit = 1.0
        if wanted.times:
            if wanted.times not in results:
                continue
            unit = results[wanted.times]["figures"][wanted.figure]
        if not wanted.low <= figures[wanted.figure] <= wanted.high * unit:
            short.append(f"{wanted.text()}: {number(figures[wanted.figure])}{_UNITS.get(wanted.figure, '')}")
    return short


def run_case(case: Case, n: int, seed: int, map_: Callable[..., Iterable[Trial]]) -> Json:
    """The trials of a case and their figures."""
    begin = time.perf_counter()
    trials = list(map_(run_trial, [case] * n, range(n), [seed] * n))
    seconds = time.perf_counter() - begin
    return {
        "figures": figures_of(trials),
        "seconds": seconds,
        "trials": [dataclasses.asdict(trial) for trial in trials],
    }


# ---- What is told --------------------------------------------------------------------------------


def number(value: float) -> str:
    """Three digits that count; a dash for none."""
    if math.isnan(value):
        return "-"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


_COLUMNS: tuple[tuple[str, str], ...] = (
    ("rms deg", "rms_deg"),
    ("median", "median_deg"),
    ("max", "max_deg"),
    ("sigma", "sigma_rms_deg"),
    ("rms/sigma", "rms_over_sigma"),
    (">3 sigma", "outside_3_sigma"),
    ("in 95 %", "covered_percent"),
    ("aligned %", "aligned_percent"),
    ("latency ms", "latency_rms_ms"),
    ("s/flight", "align_seconds"),
)


def row(case: Case, results: Json) -> list[str]:
    """Cells of a case."""
    figures = results[case.name]["figures"]
    told = [number(figures[key]) for _, key in _COLUMNS]
    return [case.name, f"{figures['flights'] - figures['failed']}/{figures['flights']}", *told]


def table(cases: list[Case], results: Json) -> list[list[str]]:
    """Head and rows."""
    head = ["case", "aligned of", *(name for name, _ in _COLUMNS)]
    return [head, *(row(case, results) for case in cases)]


def as_text(rows: list[list[str]]) -> str:
    """Columns one under the other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(r, widths, strict=True))
        )
        for r in rows
    )


def as_markdown(rows: list[list[str]]) -> str:
    """The same as a table of Markdown."""
    head, *body = rows
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *body]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def judgement(case: Case, results: Json) -> str:
    """met, or what is short of what is wanted."""
    short = shortfalls(case, results)
    return "; ".join(short) if short else "met" if case.wanted else "-"


def page(cases: list[Case], results: Json, command: str) -> str:
    """The content of benchmarks/alignment.md."""
    judged = [["case", "what", "wanted", "short of it"]]
    for case in cases:
        wanted = "; ".join(w.text() for w in case.wanted) or "-"
        judged.append([f"`{case.name}`", case.what, wanted, judgement(case, results)])
    seconds = sum(results[case.name]["seconds"] for case in cases)
    return (
        (HERE / "alignment_page.md")
        .read_text(encoding="utf-8")
        .format(
            parked_s=f"{PARKED_S:g}",
            command=command,
            version=liealign.__version__,
            minutes=seconds / 60.0,
            machine=f"{len(os.sched_getaffinity(0))} cores, Python {platform.python_version()}",
            judged=as_markdown(judged),
            figures=as_markdown(table(cases, results)),
        )
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Heading alignment over many simulated flights.")
    parser.add_argument("-n", type=int, default=WHOLE_N, metavar="N", help="flights of each case")
    parser.add_argument(
        "--case", action="append", choices=[case.name for case in CASES], help="only this one; again for more"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the first flight")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--json", type=Path, help="every flight and every figure")
    parser.add_argument(
        "--page",
        type=Path,
        help=f"default: benchmarks/alignment.md for all cases of {WHOLE_N} flights or more, else none",
    )
    a = parser.parse_args()
    cases = [case for case in CASES if not a.case or case.name in a.case]
    results: Json = {}
    with ProcessPoolExecutor(a.jobs, mp_context=get_context("spawn")) as pool:
        for case in cases:
            print(f"{case.name}: {case.what}", file=sys.stderr, flush=True)
            results[case.name] = run_case(case, a.n, a.seed, pool.map)
            if a.json:
                content = {"version": liealign.__version__, "n": a.n, "seed": a.seed, "cases": results}
                a.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(as_text(table(cases, results)))
    for case in cases:
        print(f"{case.name}: {judgement(case, results)}")
    whole = not a.case and a.n >= WHOLE_N
    target = a.page or (HERE / "alignment.md" if whole else None)
    if target:
        command = f"python benchmarks/alignment.py -n {a.n} --seed {a.seed}"
        target.write_text(page(cases, results, command), encoding="utf-8")


if __name__ == "__main__":
    main()
