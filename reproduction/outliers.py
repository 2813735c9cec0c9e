"""What outlier weighting and rejection do: the same flights with and without wrong fixes."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
from dataclasses import dataclass

import liealign
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from flights import GIVEN, OVERSAMPLE, Aligned, Array, Errors, airborne_s, rms, simulated
from section import Json, Section, mapped, markdown_table, number, picture, save_figure, subplots

KINDS = ("lines", "circles", "helical", "rectangular")
MODES = ("weight", "reject", "off")
CONDITIONS = ((0.0, 1.0), *((share, size) for size in (1.0, 5.0) for share in (0.02, 0.05, 0.10)))
CHANNELS = ("heading_deg", "roll_pitch_deg", "position_m")
LOST_DEG = 1.0  # an alignment off by more is lost, and no RMSE says more about its flight
UNITS = {"heading_deg": ("deg", 1.0), "roll_pitch_deg": ("deg", 1.0), "position_m": ("mm", 1e3)}


@dataclass(frozen=True)
class Job:
    kind: str
    seed: int
    share: float  # of the fixes that are wrong
    size_m: float


@dataclass(frozen=True)
class Run:
    """RMSE over the airborne epochs of one flight; nan when the engine refused it."""

    alignment: Aligned | None
    smoothed: dict[str, float]
    filtered: dict[str, float]
    failure: str = ""
    truth_costs_less: bool = False  # of a lost flight: the search could have known


@dataclass(frozen=True)
class Trial:
    job: Job
    runs: dict[str, Run]


def channels(errors: Errors) -> dict[str, float]:
    """Heading, roll and pitch together, 3-D position."""
    return {
        "heading_deg": rms(errors.rpy_deg[:, 2]),
        "roll_pitch_deg": rms(errors.rpy_deg[:, :2].ravel()),
        "position_m": rms(np.linalg.norm(errors.p_n_m, axis=1)),
    }


def run(job: Job) -> Trial:
    """One simulation, processed in three ways."""
    drone = liealign.random_flight(job.kind, seed=job.seed)
    drone.duration_s, drone.oversample = 300.0, OVERSAMPLE
    flight = simulated(drone, job.seed, GIVEN, outlier_probability=job.share, outlier_m=job.size_m)
    truth, window_s = flight.truth(), airborne_s(drone)
    runs: dict[str, Run] = {}
    for mode in MODES:
        keys = {"gnss.outlier": mode, "output.filtered": True}
        prepared = liealign.prepare_flight(
            flight.flight.with_config(liealign.make_config(keys, base=flight.flight.config))
        )
        try:
            alignment = liealign.align_heading(prepared)
            solution = liealign.process(prepared, alignment, keep_events=False)
        except liealign.Error as error:
            lost = dict.fromkeys(CHANNELS, math.nan)
            runs[mode] = Run(None, lost, lost, str(error))
            continue
        assert solution.filtered is not None
        runs[mode] = Run(
            Aligned.of(flight, alignment),
            channels(Errors.of(truth, solution, window_s)),
            channels(Errors.of(truth, solution.filtered, window_s)),
            truth_costs_less=truth_costs_less(flight, prepared, alignment),
        )
    return Trial(job, runs)


def truth_costs_less(
    flight: liealign.SimulatedFlight, prepared: liealign.PreparedFlight, alignment: liealign.Alignment
) -> bool:
    """Whether a candidate at the true heading has a lower cost than one at the heading found, gated alike."""
    headings = (flight.heading_deg_at(alignment.start_time_s), alignment.heading_deg)
    scale = alignment.engine.gate_scale_position
    true, found = liealign.evaluate_candidates(
        prepared, [liealign.HeadingCandidate(math.radians(h), 0.0, True, scale) for h in headings]
    )
    return true.cost < found.cost


def of_condition(trials: list[Trial], condition: tuple[float, float]) -> list[Trial]:
    return [t for t in trials if (t.job.share, t.job.size_m) == condition]


def values(trials: list[Trial], mode: str, stage: str, channel: str) -> Array:
    """The RMSE of each flight."""
    return np.array([getattr(t.runs[mode], stage)[channel] for t in trials])


def alignment_errors(trials: list[Trial], mode: str) -> Array:
    """The size of the heading error at the start, of each flight."""
    found = [t.runs[mode].alignment for t in trials]
    return np.array([math.nan if a is None else abs(a.error_deg) for a in found])


def paired(a: Array, b: Array) -> Json:
    """Mean of a - b over the flights, with its 95 % confidence interval by Student's t."""
    difference = a - b
    if difference.size < 2:
        return {"flights": difference.size, "mean": math.nan, "low": math.nan, "high": math.nan}
    mean = float(difference.mean())
    half = float(
        stats.t.ppf(0.975, difference.size - 1) * difference.std(ddof=1) / math.sqrt(difference.size)
    )
    return {"flights": difference.size, "mean": mean, "low": mean - half, "high": mean + half}


def lost(trials: list[Trial], mode: str) -> NDArray[np.bool_]:
    """Which flights the engine refused, or aligned worse than LOST_DEG."""
    return ~(alignment_errors(trials, mode) <= LOST_DEG)


def sums(trials: list[Trial], mode: str) -> Json:
    """RMSE over the flights of a condition that are not lost, pooled; `all` has the lost ones too."""
    kept, errors = ~lost(trials, mode), alignment_errors(trials, mode)
    found: Json = {
        "flights": len(trials),
        "refused": sum(bool(t.runs[mode].failure) for t in trials),
        "lost": int((~kept).sum()),
        "alignment_deg": rms(errors[kept]),
        "all": {"alignment_deg": rms(errors[np.isfinite(errors)])},
    }
    for stage in ("smoothed", "filtered"):
        each = {c: values(trials, mode, stage, c) for c in CHANNELS}
        found[stage] = {c: rms(v[kept]) for c, v in each.items()}
        found["all"][stage] = {c: rms(v[np.isfinite(v)]) for c, v in each.items()}
    return found


def paired_with_weight(trials: list[Trial], mode: str) -> Json:
    """Over the flights that are lost in neither way."""
    both = ~(lost(trials, mode) | lost(trials, "weight"))
    return {
        c: paired(values(trials, mode, "smoothed", c)[both], values(trials, "weight", "smoothed", c)[both])
        for c in CHANNELS
    }


def losses(trials: list[Trial]) -> list[Json]:
    """Every lost flight."""
    found = []
    for mode in MODES:
        for trial, gone in zip(trials, lost(trials, mode), strict=True):
            a = trial.runs[mode].alignment
            if gone:
                found.append(
                    {
                        "wrong_fixes": name_of((trial.job.share, trial.job.size_m)),
                        "outlier": mode,
                        "kind": trial.job.kind,
                        "seed": trial.job.seed,
                        "error_deg": None if a is None else a.error_deg,
                        "sigma_deg": None if a is None else a.sigma_deg,
                        "verdict": "refused" if a is None else a.verdict,
                        "truth_costs_less": trial.runs[mode].truth_costs_less,
                        "in_95_interval": a is not None and a.covered,
                    }
                )
    return found


def name_of(condition: tuple[float, float]) -> str:
    share, size_m = condition
    return f"{100 * share:.0f} %, {size_m:g} m" if share else "none"


def rows_of(numbers: Json) -> list[list[str]]:
    """RMSE of each condition and mode."""
    rows = []
    for condition in CONDITIONS:
        for mode in MODES:
            n = numbers[name_of(condition)][mode]
            cells = [name_of(condition), f"`{mode}`", str(n["lost"]), number(n["alignment_deg"])]
            for channel in CHANNELS:
                factor = UNITS[channel][1]
                cells += [number(factor * n[stage][channel]) for stage in ("smoothed", "filtered")]
            rows.append(cells)
    return rows


def paired_rows(numbers: Json) -> list[list[str]]:
    """Differences of the smoothed RMSE against `weight`."""
    rows = []
    for condition in CONDITIONS:
        for mode in MODES[1:]:
            cells = [name_of(condition), f"`{mode}` − `weight`"]
            pairs = numbers[name_of(condition)]["paired_smoothed"][mode]
            cells.append(str(pairs["position_m"]["flights"]))
            for channel in CHANNELS:
                factor = 1e3  # mdeg and mm
                d = pairs[channel]
                cells.append("{} [{}, {}]".format(*(number(factor * d[k]) for k in ("mean", "low", "high"))))
            rows.append(cells)
    return rows


def draw(numbers: Json, quick: bool) -> str:
    """Smoothed RMSE over the share of wrong fixes."""
    figure, axes = subplots(1, 4, 9.0, 2.7)
    titles = ("alignment [deg]", "heading [deg]", "roll and pitch [deg]", "3-D position [mm]")
    colours = {"weight": "C0", "reject": "C1", "off": "C3"}
    sizes = {"weight": 6.0, "reject": 3.0, "off": 4.0}  # the first two lie on each other
    for size_m, style in ((1.0, "o-"), (5.0, "s--")):
        chosen = [c for c in CONDITIONS if c[0] == 0.0 or c[1] == size_m]
        x = [100.0 * c[0] for c in chosen]
        for mode in MODES:
            found = [numbers[name_of(c)][mode] for c in chosen]
            errors = [f["alignment_deg"] for f in found]
            axes[0, 0].plot(x, errors, style, color=colours[mode], ms=sizes[mode])
            for ax, channel in zip(axes[0, 1:], CHANNELS, strict=True):
                y = [UNITS[channel][1] * f["smoothed"][channel] for f in found]
                ax.plot(x, y, style, color=colours[mode], ms=sizes[mode], label=f"{mode}, {size_m:g} m")
    for ax, title in zip(axes[0], titles, strict=True):
        ax.set(yscale="log", title=title, xlabel="wrong fixes [%]", xticks=(0, 2, 5, 10))
        low, high = ax.get_ylim()
        ax.set_ylim(10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(high)))
    axes[0, 0].set_ylabel("RMSE, smoothed")
    handles, labels = axes[0, 3].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6)
    return save_figure(figure, "outliers.png", quick)


def experiment(quick: bool, jobs: int) -> Section:
    """Run it and tell."""
    n = 4 if quick else 20
    todo = [Job(KINDS[k % 4], k + 1, *condition) for condition in CONDITIONS for k in range(n)]
    trials = mapped(run, jobs, todo)
    numbers: Json = {}
    for condition in CONDITIONS:
        chosen = of_condition(trials, condition)
        numbers[name_of(condition)] = {mode: sums(chosen, mode) for mode in MODES} | {
            "paired_smoothed": {mode: paired_with_weight(chosen, mode) for mode in MODES[1:]}
        }
    gone = numbers["lost_flights"] = losses(trials)
    text = f"""\
**The papers.** TAES IV-C tests each fix by its Mahalanobis distance (Fig. 3) and scales its innovation down,
(24)-(25); neither paper says what it is worth.

**Here.** {n} flights drawn by `liealign.random_flight` (5 minutes, 30 s parked; lines, circles, helices,
rectangles in turn), seeds 1 to {n}; 0, 2, 5 or 10 % of the fixes off by 1 m or 5 m in a random direction,
their stated sigmas as before, at rest too. The flights and all other errors are the same in every row.
`weight` is the default (a fix beyond the 99.9 % point is weighed down), `reject` drops it, `off` believes
all. Latency and scales given. RMSE over the airborne epochs, smoothed unless the column says filtered;
*alignment* is the heading error at the start. A flight aligned worse than {LOST_DEG:g} deg is counted as
*lost* and left out of the other columns (numbers.json has them with it under `all`).

{markdown_table(_HEAD, rows_of(numbers))}
The same flights in pairs, those lost in neither way: mean difference of the smoothed RMSE of a flight, with
its 95 % confidence interval (Student's t).

{markdown_table(_PAIRED_HEAD, paired_rows(numbers))}
{picture(draw(numbers, quick), "RMSE over the share of wrong fixes")}
{conclusion(numbers, gone, n)}
"""
    return Section(
        "outliers", "Outlier weighting and rejection, on and off", text, numbers, figures=("outliers.png",)
    )


_HEAD = (
    *("wrong fixes", "`gnss.outlier`", "lost", "alignment deg", "heading deg", "filtered", "roll, pitch deg"),
    *("filtered", "3-D position mm", "filtered"),
)
_PAIRED_HEAD = ("wrong fixes", "difference", "flights", "heading mdeg", "roll, pitch mdeg", "3-D position mm")


def conclusion(numbers: Json, gone: list[Json], n: int) -> str:
    """What the numbers say, whatever they are."""
    none = numbers["none"]["weight"]["smoothed"]["position_m"]

    def times(mode: str, condition: str) -> float:
        return float(numbers[condition][mode]["smoothed"]["position_m"] / none)

    wrong = [name_of(c) for c in CONDITIONS[1:]]
    without = numbers["none"]["paired_smoothed"]["off"]["position_m"]
    low, high = (number(1e3 * without[k]) for k in ("low", "high"))
    off, weighed, rejected = ([times(m, c) for c in wrong] for m in ("off", "weight", "reject"))
    text = (
        f"**What it shows.** Without wrong fixes, no test at all changes the position by {low} to {high} mm"
        " (95 %) against `weight`: the test costs nothing that matters. With them, believing every fix"
        f" makes the position {number(min(off), 2)} to {number(max(off), 2)} times worse; with `weight` it is"
        f" at most {number(100.0 * (max(weighed) - 1.0), 2)} % worse than without wrong fixes, with `reject`"
        f" {number(100.0 * (max(rejected) - 1.0), 2)} %, over the flights that are not lost."
    )
    if not gone:
        return text + " No flight is lost in any way."
    counts = ", ".join(f"{sum(g['outlier'] == m for g in gone)} with `{m}`" for m in MODES)
    said = sum(g["verdict"] == "aligned" for g in gone)
    missed = sum(not g["in_95_interval"] for g in gone)
    text += (
        f" Lost are, of {len(wrong) * n} alignments each, {counts}; {said} of them with the verdict"
        f" `aligned`, and {missed} of {len(gone)} stated intervals do not have the truth."
    )
    tested = [g for g in gone if g["outlier"] != "off"]
    if tested:
        text += (
            f" With a test, {sum(g['truth_costs_less'] for g in tested)} of {len(tested)} stayed in a false"
            " minimum of the search: a filter from the true heading has the lower cost. They are"
            f" {'; '.join(map(lost_words, tested[:12]))}."
        )
    return text


def lost_words(g: Json) -> str:
    """One lost flight."""
    error = "refused" if g["error_deg"] is None else f"{g['error_deg']:+.1f} deg"
    return f"{g['wrong_fixes']}, `{g['outlier']}`, {g['kind']}, seed {g['seed']}: {error} ({g['verdict']})"
