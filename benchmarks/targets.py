"""What the engine is held to, each with the figure of this run."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Json = dict[str, Any]

# Per IMU epoch of KF-GINS's engine, microseconds: measured apart from this run, as its licence keeps it out.
KF_GINS_US = (6.6, 11.0)

_LONGEST_S = 36000.0


@dataclass(frozen=True)
class Target:
    """One demand: what, how much is wanted, what was found."""

    what: str
    wanted: str
    figure: str
    met: bool


def stage(figures: Json, name: str) -> Json:
    """A stage of liealign-stages by its name."""
    found: Json = next(row for row in figures["stages"] if row["stage"] == name)
    return found


def us_per_epoch(figures: Json, name: str) -> float:
    """Microseconds of a stage per IMU epoch."""
    return float(1e6 * stage(figures, name)["seconds"] / figures["epochs"])


def seconds_per_heading(curves: Json) -> tuple[float, float]:
    """Of one candidate by samples, and by intervals (of the curve nearest to 60 headings)."""
    samples = curves["by_samples"]
    curve = min(curves["by_intervals"], key=lambda row: abs(row["headings"] - 60))
    return samples["seconds"] / samples["headings"], curve["seconds"] / curve["headings"]


def memory_mb(figures: Json) -> float:
    """Peak of filter, smoother and files beyond what is held before them."""
    before = stage(figures, "filter_and_smoother")["rss_before_mb"]
    late = [row for row in figures["stages"] if row["stage"] in ("filter_and_smoother", "to_files")]
    return float(max(row["peak_mb"] for row in late) - before)


def _at_most(what: str, figure: float, limit: float, unit: str, digits: int = 2) -> Target:
    shown = f"{figure:.{digits}f}"
    return Target(what, f"at most {limit:g} {unit}".rstrip(), f"{shown} {unit}".rstrip(), figure <= limit)


def _at_least(what: str, figure: float, limit: float) -> Target:
    return Target(what, f"at least {limit:g} times", f"{figure:.1f} times", figure >= limit)


def _speed(results: Json) -> list[Target]:
    one, low = results["filter"], KF_GINS_US[0]
    filter_us = us_per_epoch(one, "filter")
    dense = one["dense"]["filter_seconds"] / stage(one, "filter")["seconds"]
    two = next((row for row in results["by_threads"] if row["threads"] == 2), results["by_threads"][-1])
    both = us_per_epoch(two, "filter_and_smoother")
    threads = f"{two['threads']} thread" + ("s" if two["threads"] > 1 else "")
    return [
        _at_most(
            "filter with state and covariance at every IMU epoch, one thread, per epoch", filter_us, 0.6, "us"
        ),
        _at_least("the same, faster than the dense yardstick", dense, 2.3),
        _at_least(f"the same, faster than KF-GINS's engine ({low} us)", low / filter_us, 10),
        _at_most(f"filter and smoother, {threads}, per IMU epoch", both, 1.5, "us"),
    ]


def _check(results: Json) -> list[Target]:
    check = results["filter"]["check"]
    what = "difference from the plain full-rate smoother, of its sigma"
    worst = 100 * max(check["largest_difference_in_sigma"], check["largest_relative_sigma_error"])
    return [_at_most(what, worst, 2, "%")]


def _memory(results: Json) -> list[Target]:
    longest = results["scaling"][-1]
    hours = longest["seconds_of_flight"] / 3600
    what = f"memory beyond the input, flight of {hours:.1f} h"
    if longest["seconds_of_flight"] < _LONGEST_S - 60:
        what += " (10 h are wanted)"
    return [_at_most(what, memory_mb(longest), 100, "MB", 0)]


def _candidates(results: Json) -> list[Target]:
    curves = results["curves"]
    rows = []
    for key, limit in (("1_hz", 60), ("10_hz", 6)):
        full, cheap = seconds_per_heading(curves[key])
        rate = key.replace("_hz", " Hz")
        rows.append(
            _at_least(
                f"candidate by intervals, fixes at {rate}, cheaper than by samples", full / cheap, limit
            )
        )
    curve = min(curves["1_hz"]["by_intervals"], key=lambda row: abs(row["headings"] - 60))
    share = curve["seconds"] / stage(results["filter"], "filter")["seconds"]
    what = f"curve of {curve['headings']} headings over the common flight, one thread, in filter passes"
    rows.append(_at_most(what, share, 1.0, ""))
    return rows


def alignment_passes(results: Json, key: str) -> float:
    """What preparation and alignment cost, in passes of the filter of the first target."""
    figures = results[key]
    seconds = sum(stage(figures, name)["seconds"] for name in ("prepare", "align"))
    return float(seconds / stage(results["filter"], "filter")["seconds"])


def _alignment(results: Json) -> list[Target]:
    what = "preparation and alignment, one thread, in filter passes: "
    given = alignment_passes(results, "filter")
    automatic = alignment_passes(results, "filter_auto")
    return [
        _at_most(what + "latency and noise scales given", given, 2, ""),
        _at_most(what + "all automatic", automatic, 6, ""),
    ]


def _job(results: Json) -> list[Target]:
    jobs = results["jobs"]
    rows = []
    if "gtsam" in jobs:
        ratio = jobs["gtsam"]["wall_seconds"] / jobs["post"]["wall_seconds"]
        rows.append(_at_least("whole job, faster than the GTSAM pipeline, process against process", ratio, 3))
    same = jobs["same_bytes"]
    rows.append(
        Target("files of one thread and of all", "the same bytes", "the same" if same else "other", same)
    )
    return rows


def _accuracy(results: Json) -> list[Target]:
    a = results["jobs"]["post"]["accuracy"]
    tilt = max(a["roll_deg"], a["pitch_deg"])
    position = [1000 * a[axis] for axis in ("north_m", "east_m", "down_m")]
    met = all(round(mm) <= limit for mm, limit in zip(position, (3, 3, 6), strict=True))
    return [
        _at_most("smoothed heading, rms", a["heading_deg"], 0.009, "deg", 4),
        _at_most("smoothed roll and pitch, rms", tilt, 0.002, "deg", 4),
        Target(
            "smoothed position north, east, down, rms",
            "3, 3, 6 mm, rounded",
            ", ".join(f"{mm:.1f}" for mm in position) + " mm",
            met,
        ),
    ]


def targets(results: Json) -> list[Target]:
    """Every target, in the order of the issue."""
    parts = (_speed, _check, _memory, _candidates, _alignment, _job, _accuracy)
    return [target for part in parts for target in part(results)]
