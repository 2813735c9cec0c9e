"""What the report says in words: the verdict, then what an analyst has to know before using the numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Literal

import numpy as np

from liealign.report.heading import open_minimum
from liealign.report.review import Residuals, Review
from liealign.solution import Receiver

State = Literal["good", "fact", "look", "bad"]

_GPS_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
# A usual residual may be so many times larger or smaller than stated before the noise model is called wrong.
_FITS = 1.3
_FEW = 20  # fixes from which on shares mean something
_WHITE = 0.3  # correlation of neighbouring residuals from which on they are no noise
_LEAN = 0.5  # mean of the residuals in their rms from which on they lean to one side
_LONG_OUTAGE = 5.0  # seconds without a fix that deserve a look, when they are also many intervals
_ODD_SHARE = 0.05
# Configuration keys of the noise scales: one that is not given is estimated.
_KEY_OF = {"imu_noise_scale": "imu.noise_scale", "gnss_std_scale": "gnss.std_scale"}

TITLES = {
    "aligned": ("Aligned", "good"),
    "weak": ("Weakly aligned", "look"),
    "ambiguous": ("Ambiguous heading", "bad"),
    "unobservable": ("Heading not observable", "bad"),
}


@dataclass(frozen=True)
class Finding:
    """One sentence about the run and how it is to be taken."""

    state: State
    topic: str
    text: str


def significant(value: float, digits: int = 2) -> str:
    """Write a number with so many significant digits and without an exponent."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, decimals):.{max(decimals, 0)}f}"


def percent(share: float) -> str:
    """Write a share in percent; all of it and none of it only where that is so."""
    if share in (0.0, 1.0):
        return f"{100.0 * share:.0f} %"
    if 0.0 < share < 0.001 or 0.999 < share < 1.0:
        return f"{100.0 * share:.2f} %"
    return f"{100.0 * share:.1f} %" if share < 0.1 or share > 0.9 else f"{100.0 * share:.0f} %"


def counted(count: int, one: str, many: str) -> str:
    """Write a count with its noun."""
    return f"{count} {one if count == 1 else many}"


def degrees(value: float, like: float) -> str:
    """Write a heading with the digits that its sigma deserves."""
    decimals = min(max(1 - math.floor(math.log10(like)), 0), 4) if like > 0.0 else 3
    return f"{value:.{decimals}f}°"


def heading_lines(review: Review) -> tuple[str, str]:
    """Return the heading with its sigma, and the interval with the instant it belongs to."""
    alignment = review.alignment
    when = "the last instant of rest before the motion"
    if review.facts["start"] == "moving":
        when = "the first sample used"
    at = f"at {alignment.start_time_s:.3f} s, {when}"
    sigma = alignment.heading_std_deg
    if sigma is None:
        return "No heading", f"The flight says nothing about the heading {at}."
    low, high = review.facts["heading_95_deg"]
    interval = f"95 % interval {degrees(low, sigma)} to {degrees(high, sigma)}, {at}."
    return f"{degrees(alignment.heading_deg, sigma)} ± {significant(sigma)}°", interval


def caution(review: Review) -> str | None:
    """Return what a reader must know before he believes the sigma in the head of the page."""
    sigma = review.alignment.heading_std_deg
    if review.mismatch is None:
        return None
    of, mismatch = review.mismatch
    text = (
        "All standard deviations on this page are the filter's own statement, and it expects residuals of "
        f"the {of} {significant(mismatch)} times smaller than they are."
    )
    if sigma is None:
        return text
    factored = f"{significant(sigma * mismatch)}°, not {significant(sigma)}°"
    text += f" With that factor the sigma of the heading is about {factored}."
    free = open_minimum(review.alignment)
    if free is not None and abs(free) > 3.0 * sigma:
        text += f" With no fix taken for an outlier it would be {_by(free)}."
    return text


def start_of_flight(review: Review) -> str:
    """Return the span of the trajectory, with the date where the GPS week is known."""
    s = review.summary
    span = f"{s['begin_time_s']:.2f} s to {s['end_time_s']:.2f} s"
    if s.get("gps_week") is None:
        return span
    begin = _GPS_EPOCH + timedelta(weeks=s["gps_week"], seconds=s["begin_time_s"])
    return f"{span} of GPS week {s['gps_week']}, from {begin:%Y-%m-%d %H:%M:%S} GPST"


def duration(seconds: float) -> str:
    """Write a duration as 5 min 0 s."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole % 3600 // 60
    parts = [f"{hours} h"] if hours else []
    if hours or minutes:
        parts.append(f"{minutes} min")
    return " ".join([*parts, f"{whole % 60} s"])


# ---- findings ----------------------------------------------------------------------------------------------


def findings(review: Review) -> list[Finding]:
    """Return what to look at, in the order in which it matters."""
    found = [noise_finding(residuals) for residuals in (review.position, review.velocity) if residuals]
    if not found:
        found.append(
            Finding("bad", "Fixes", "No fix was an update of the filter: the trajectory is the IMU's alone.")
        )
    found += [*_stability(review), *_start(review)]
    found += [
        item for residuals in (review.position, review.velocity) if residuals for item in _lean(residuals)
    ]
    found += _drift(review)
    suspicious = any(finding.state in ("look", "bad") for finding in found)
    if review.position:
        found.append(_outliers(review, review.position))
        found.append(_coverage(review, review.position))
    found.append(_given(review, suspicious))
    if review.receiver is not None:
        found.append(Finding("fact", "Absolute accuracy", absolute_accuracy(review)))
    return found


def absolute_accuracy(review: Review) -> str:
    """Say what the flight cannot tell."""
    horizontal, down = (significant(std) for std in review.stated_std_m)
    return (
        f"The absolute accuracy cannot be checked from this flight: the file states {horizontal} m "
        f"horizontally and {down} m down; only its drift was measured. A base, a check point or a loop "
        "closure can."
    )


def receiver_model(found: Receiver) -> str:
    """Say which model was taken for the errors of the positions."""
    if found.smoothing_time_s == 0.0:
        return (
            "The fixes are taken for those of carrier phases (RTK, PPK): their positions err by a part that "
            "lasts and a white part."
        )
    return (
        "The fixes are taken for code or float solutions: their positions err by a part that lasts, which "
        "the receiver smooths, and a small white part; the velocities err in the same way."
    )


def noise_finding(residuals: Residuals) -> Finding:
    """Say whether the noise model fits: the share inside two sigma, and how far a usual residual is off."""
    topic = f"Size of the {residuals.of} residuals"
    if residuals.nis.size < _FEW:
        few = counted(residuals.nis.size, "fix", "fixes")
        return Finding("look", topic, f"Too few to judge: {few}.")
    inside = residuals.within(2.0)
    share = f"{percent(inside)} of the residuals are inside 2 sigma, 95.4 % expected"
    usual, tail = residuals.size_ratio, residuals.tail_ratio
    if max(usual, tail) > _FITS:
        worst = max(usual, tail)
        state: State = "bad" if worst > 2.0 * _FITS else "look"
        rough = (
            f"The typical residual is {significant(usual)} times as large as the noise model says, at the "
            f"90 % point {significant(tail)} times. The stated accuracies are too optimistic: raise the "
            "IMU noise scale, or check the GNSS latency and the lever arm."
        )
        return Finding(state, topic, f"Larger than modelled: {share}. {rough}")
    if max(usual, tail) < 1.0 / _FITS:
        text = (
            f"Smaller than modelled: {share}. The typical residual is only {significant(usual)} times as "
            "large as the noise model says; the sigmas of the fixes or the IMU noise are larger than this "
            "flight needs."
        )
        return Finding("look", topic, text)
    return Finding(
        "good",
        topic,
        f"As modelled: {share}; the typical residual has {significant(usual)} times its stated size.",
    )


def _stability(review: Review) -> list[Finding]:
    """Compare the heading with the one that comes out when no fix counts as an outlier."""
    sigma, free = review.alignment.heading_std_deg, open_minimum(review.alignment)
    if sigma is None or free is None or abs(free) <= 3.0 * sigma:
        return []
    text = (
        f"It depends on the treatment of outliers: with every fix in full the best heading is {_by(free)}, "
        f"{significant(abs(free) / sigma)} sigma away. Trust the heading to about that difference."
    )
    return [Finding("look", "Heading", text)]


def _by(offset_deg: float) -> str:
    return f"{significant(abs(offset_deg))}° {'higher' if offset_deg > 0 else 'lower'}"


def _start(review: Review) -> list[Finding]:
    """Compare the heading of the alignment with that of the smoothed trajectory at the same instant."""
    sigma, at_start = review.alignment.heading_std_deg, review.smoothed_at_start
    if sigma is None or at_start is None:
        return []
    smoothed, std = at_start
    offset = (smoothed - review.alignment.heading_deg + 180.0) % 360.0 - 180.0
    if abs(offset) <= 3.0 * math.hypot(sigma, std):
        return []
    text = (
        f"The smoothed trajectory, which uses the whole flight, has {degrees(smoothed, std)} at the same "
        f"instant: {_by(offset)} than the alignment, {significant(abs(offset) / math.hypot(sigma, std))} "
        "sigma of both. One of the two sigmas, or both, are too small."
    )
    return [Finding("look", "Heading at the start", text)]


def _lean(residuals: Residuals) -> list[Finding]:
    """Residuals that lean to one side come from a datum, a lever arm or a latency, not from noise."""
    usual = np.isin(residuals.verdict, ("used", "weighted", "reacquired"))
    if np.count_nonzero(usual) < 20:
        return []
    res = residuals.res_n[usual]
    mean, rms = res.mean(axis=0), np.sqrt((res**2).mean(axis=0))
    sides = [
        f"{name} {significant(mean[i])} of {significant(rms[i])} {residuals.unit} rms"
        for i, name in enumerate(("north", "east", "down"))
        if abs(mean[i]) > _LEAN * rms[i]
    ]
    if not sides:
        return []
    text = f"They lean to one side ({', '.join(sides)}): check the lever arm and the GNSS latency."
    return [Finding("look", f"Residuals, {residuals.of}", text)]


def _drift(review: Review) -> list[Finding]:
    """Innovations of a right model are white; waves in them are errors that the model does not have."""
    waves = []
    for residuals in (review.position, review.velocity):
        rho = residuals.correlation if residuals else None
        if residuals and rho is not None and rho > _WHITE:
            waves.append(f"{rho:.2f} of the {residuals.of}")
    if not waves:
        return []
    text = (
        f"They come in waves: neighbouring residuals correlate ({' and '.join(waves)}; 0 expected). What "
        "is left is not noise but a drifting error: GNSS latency, lever arm, the scale of a sensor, or the "
        "fixes themselves."
    )
    return [Finding("look", "Pattern of the residuals", text)]


def _outliers(review: Review, position: Residuals) -> Finding:
    s, n = review.summary, position.nis.size
    counts = {word: s[f"fixes_{word}"] for word in ("weighted", "rejected", "reacquired")}
    odd = sum(counts.values())
    if not odd:
        return Finding(
            "good", "Outliers", f"Of {counted(n, 'fix', 'fixes')} not one was weighted down or rejected."
        )
    listed = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    listed = listed.replace("weighted", "weighted down")
    share = odd / n
    state: State = "look" if share > _ODD_SHARE or counts["reacquired"] else "good"
    text = f"{listed} of {n} fixes ({percent(share)})."
    if review.mismatch is not None:
        text += " The outlier test was opened to match the residuals, so that few fixes fail it."
    return Finding(state, "Outliers", text)


def _coverage(review: Review, position: Residuals) -> Finding:
    """Find the longest time in motion without a fix that counted, and the gaps of the IMU log."""
    taken = position.time_s[position.verdict != "rejected"]
    times = np.concatenate([[review.alignment.start_time_s], taken[taken > review.alignment.start_time_s]])
    steps = np.diff(times)
    gaps, gap_s = review.summary["imu_gaps"], review.summary["imu_gaps_s"]
    imu = (
        f"{counted(gaps, 'gap', 'gaps')} in the IMU log, {significant(gap_s)} s in all"
        if gaps
        else "no IMU gap"
    )
    if steps.size < 2:
        few = counted(steps.size, "accepted fix", "accepted fixes")
        return Finding("look", "Coverage", f"{few} after the rest; {imu}.")
    longest = int(np.argmax(steps))
    outage = float(steps[longest])
    usual = float(np.median(steps))
    long = outage > max(_LONG_OUTAGE, 3.0 * usual)
    text = f"A fix every {significant(usual)} s, {imu}."
    if outage > 1.5 * usual:
        text = (
            f"A fix every {significant(usual)} s, the longest time without one {significant(outage)} s "
            f"(from {times[longest]:.2f} s); {imu}."
        )
    return Finding("look" if long or gaps else "good", "Coverage", text)


def _given(review: Review, suspicious: bool) -> Finding:
    """List the inputs that were taken as given: what is wrong in them is wrong in the result."""
    s = review.summary
    found = review.receiver
    if found is not None:
        text = f"Positions {latency_text(review)}, velocities {velocity_latency_text(review)}"
        if found.latency_std_s is None:
            return Finding("look" if suspicious else "good", "GNSS latency", f"{text}.")
        return Finding(
            "good",
            "GNSS latency",
            f"{text}{_clock_drift(s)}. Other models of the receiver move that of positions by "
            f"{spread_text(found)}.",
        )
    estimated = [key for key in ("gnss_latency", "imu_noise_scale", "gnss_std_scale") if _std_of(s, key)]
    if "gnss_latency" in estimated:
        return Finding("good", "GNSS latency", f"{latency_text(review)}{_clock_drift(s)}.")
    text = (
        f"{s['gnss_latency_s']:g} s, taken as given and not estimated from the flight. A wrong latency is "
        "a wrong heading, and shows as waves in the residuals wherever the speed changes."
    )
    return Finding("look" if suspicious else "good", "GNSS latency", text)


def _std_of(summary: dict[str, object], key: str) -> object:
    return summary.get(f"{key}_std_s", summary.get(f"{key}_std"))


def _clock_drift(s: dict[str, Any]) -> str:
    if not s["clock_drift_ppm"]:
        return ""
    return (
        f" at the start; the clocks drift apart by {significant(s['clock_drift_ppm'])} ppm "
        f"(sigma {significant(s['clock_drift_std_ppm'])} ppm), which is taken out"
    )


def latency_text(review: Review) -> str:
    """Write the latency with its sigma, or that it was given."""
    return _given_or_estimated(review, "gnss_latency", "gnss_latency_s", " s")


def spread_text(found: Receiver) -> str:
    """Write by how much other models of the receiver move the latency of positions."""
    spread_ms = 1e3 * found.latency_model_spread_s
    return "less than 0.1 ms" if spread_ms < 0.1 else f"{significant(spread_ms)} ms"


def velocity_latency_text(review: Review) -> str:
    """Write the latency of the velocities with its sigma, or that it was given."""
    return _given_or_estimated(review, "gnss_velocity_latency", "gnss_velocity_latency_s", " s")


def scale_text(review: Review, key: str) -> str:
    """Write a noise scale with its sigma, or that it was given."""
    return _given_or_estimated(review, key, key, "")


def as_exact_as(value: float, std: float) -> str:
    """Write a value with the decimals that its sigma has."""
    if not 0.0 < std < math.inf:
        return f"{value:.4g}"
    return f"{value:.{min(max(1 - math.floor(math.log10(std)), 0), 6)}f}"


def _given_or_estimated(review: Review, key: str, value_key: str, unit: str) -> str:
    value, std = review.summary[value_key], _std_of(review.summary, key)
    if isinstance(std, float | int):
        return f"{as_exact_as(value, float(std))} ± {significant(float(std))}{unit} estimated"
    if (
        review.receiver is not None
        and value_key.endswith("_scale")
        and review.config.get(_KEY_OF[key]) is None
    ):
        return f"{value:.3g}{unit} estimated"
    return f"{value:g}{unit} given"
