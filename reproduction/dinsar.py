"""The need behind it: three flights on one track for DInSAR, and the phase error they leave."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import liealign
import numpy as np
from scipy import stats

from dinsar_text import Summary, section_text
from flights import GIVEN, OVERSAMPLE, Aligned, Array, Errors, airborne_s, rms, simulated
from section import Json, Section, mapped, save_figure, subplots

BANDS_M = {"P": 0.70, "L": 0.23, "C": 0.056}  # wavelengths: 425 MHz, 1.3 GHz, 5.4 GHz
APERTURES_S = (2.0, 5.0, 10.0)
DEPRESSION_DEG = 45.0
PARKED_S = 900.0
DURATION_S = 2100.0
LINE_M = 200.0
SPEED_MPS = 6.0
STEP_M = 0.5  # along the track, of what is compared from pass to pass
LIMITS = {"position_mm": 10.0, "tilt_deg": 0.1, "heading_deg": 1.0}


@dataclass(frozen=True)
class Variant:
    """What the flights are given."""

    name: str
    auto: bool
    gnss_hz: float
    campaigns: int  # of three flights each


VARIANTS = (
    Variant("automatic", True, 1.0, 4),
    Variant("given", False, 1.0, 4),
    Variant("given, 5 Hz", False, 5.0, 4),
)


@dataclass(frozen=True)
class Job:
    variant: Variant
    seed: int


@dataclass(frozen=True)
class Line:
    """One pass, at even steps along the track: position error NED and own sigma [m]."""

    east_m: Array
    p_n_m: Array
    std_p_n_m: Array

    @property
    def los_m(self) -> Array:
        """Error along the line of sight."""
        los: Array = self.p_n_m @ line_of_sight_n()
        return los

    @property
    def los_sigma_m(self) -> Array:
        """Its own sigma; the axes' errors are taken as uncorrelated, which they nearly are."""
        sigma: Array = np.sqrt(self.std_p_n_m**2 @ line_of_sight_n() ** 2)
        return sigma


@dataclass(frozen=True)
class Trial:
    """One flight: sums over its airborne epochs, and its passes."""

    job: Job
    alignment: Aligned
    latency_s: float
    figures: Json
    lines: list[Line]


def track_flight(seed: int) -> liealign.DroneFlight:
    """West to east and back on one track; the nose 15 deg off it, against the wind."""
    return liealign.DroneFlight(
        kind="lines",
        duration_s=DURATION_S,
        parked_before_s=PARKED_S,
        parked_after_s=PARKED_S,
        oversample=OVERSAMPLE,
        heading_deg=40.0,
        speed_mps=SPEED_MPS,
        altitude_m=60.0,
        acceleration_mps2=3.0,
        line_bearing_deg=90.0,
        line_length_m=LINE_M,
        line_spacing_m=1.0,
        crab_deg=-15.0,
        wind_mps=4.0,
        wind_from_deg=20.0,
        max_tilt_deg=45.0,
        seed=seed,
    )


def line_of_sight_n() -> Array:
    """From the radar to a target south of the track, NED."""
    angle = math.radians(DEPRESSION_DEG)
    return np.array([-math.cos(angle), 0.0, math.sin(angle)])


def expected_inside(std: Array, limit: float) -> float:
    """The share of normal errors with these sigmas (n, k) whose every component lies inside the limit."""
    return float(np.prod(2.0 * stats.norm.cdf(limit / std) - 1.0, axis=1).mean())


def expected_norm_inside(std: Array, limit: float) -> float:
    """The share whose length lies inside the limit, from 200000 draws."""
    random = np.random.default_rng(1)
    rows = random.integers(0, len(std), 200_000)
    return float((np.linalg.norm(random.normal(size=(rows.size, 3)) * std[rows], axis=1) <= limit).mean())


def figures_of(e: Errors) -> Json:
    """RMSE, own sigma, shares inside the limits, and the shares that the own sigmas let expect."""
    p, std_p = 1e3 * e.p_n_m, 1e3 * e.std_p_n_m
    tilt, heading = e.rpy_deg[:, :2], e.rpy_deg[:, 2]
    norm, limit = np.linalg.norm(p, axis=1), LIMITS["position_mm"]
    axes = dict(zip(("north", "east", "down"), range(3), strict=True))
    found: Json = {
        "rmse": {f"{a}_mm": rms(p[:, k]) for a, k in axes.items()},
        "own_sigma": {f"{a}_mm": rms(std_p[:, k]) for a, k in axes.items()},
        "inside": {f"{a}_10_mm": float((abs(p[:, k]) <= limit).mean()) for a, k in axes.items()},
        "inside_expected": {f"{a}_10_mm": expected_inside(std_p[:, [k]], limit) for a, k in axes.items()},
    }
    found["rmse"] |= {"position_mm": rms(norm), "roll_deg": rms(tilt[:, 0]), "pitch_deg": rms(tilt[:, 1])}
    found["rmse"] |= {"heading_deg": rms(heading)}
    std = np.sqrt(np.mean(e.std_rpy_deg**2, axis=0))
    found["own_sigma"] |= {"position_mm": rms(np.linalg.norm(std_p, axis=1))}
    found["own_sigma"] |= {"roll_deg": std[0], "pitch_deg": std[1], "heading_deg": std[2]}
    found["inside"] |= {
        "norm_10_mm": float((norm <= limit).mean()),
        "roll_and_pitch_0.1_deg": float((abs(tilt).max(axis=1) <= LIMITS["tilt_deg"]).mean()),
        "heading_1_deg": float((abs(heading) <= LIMITS["heading_deg"]).mean()),
    }
    found["inside_expected"] |= {
        "norm_10_mm": expected_norm_inside(std_p, limit),
        "roll_and_pitch_0.1_deg": expected_inside(e.std_rpy_deg[:, :2], LIMITS["tilt_deg"]),
        "heading_1_deg": expected_inside(e.std_rpy_deg[:, [2]], LIMITS["heading_deg"]),
    }
    return found


def passes(truth: liealign.Track, e: Errors, lon0_deg: float) -> list[Line]:
    """The passes of a flight: the middle of the track, where the speed is that of the line."""
    radius_m = 6378137.0 * math.cos(math.radians(float(truth.lat_deg[0])))
    rows = np.searchsorted(truth.time_s, e.time_s - 1e-6)
    east = np.deg2rad(truth.lon_deg[rows] - lon0_deg) * radius_m
    on_line = (east > 15.0) & (east < LINE_M - 15.0) & (abs(truth.v_n_mps[rows, 1]) > 0.7 * SPEED_MPS)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on_line.astype(int), [0]])))
    at = np.arange(20.0, LINE_M - 20.0, STEP_M)
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        part = slice(begin, end)
        order = np.argsort(east[part])
        x = east[part][order]
        if x[0] > at[0] or x[-1] < at[-1]:
            continue
        p, std = (
            np.column_stack([np.interp(at, x, column) for column in rows_of[part][order].T])
            for rows_of in (e.p_n_m, e.std_p_n_m)
        )
        found.append(Line(at, p, std))
    return found


def run(job: Job) -> Trial:
    """One flight, from switch-on to switch-off, as a user would run it."""
    drone = track_flight(job.seed)
    flight = simulated(drone, job.seed, {} if job.variant.auto else GIVEN, rate_hz=job.variant.gnss_hz)
    prepared = liealign.prepare_flight(flight.flight)
    alignment = liealign.align_heading(prepared)
    solution = liealign.process(prepared, alignment, keep_events=False)
    columns = flight.truth()
    errors = Errors.of(columns, solution, airborne_s(drone))
    return Trial(
        job,
        Aligned.of(flight, alignment),
        alignment.gnss_latency_s,
        figures_of(errors),
        passes(liealign.Track.of(columns), errors, drone.lon_deg),
    )


def aperture_pieces(line: Line, seconds: float) -> Array:
    """The line-of-sight error in rows of one aperture each."""
    n = max(3, round(seconds * SPEED_MPS / STEP_M))
    return line.los_m[: len(line.los_m) // n * n].reshape(-1, n)


def within_aperture(line: Line, seconds: float) -> tuple[Array, Array]:
    """Line-of-sight error [m] in pieces of one aperture, their mean removed, and mean and trend removed."""
    pieces = aperture_pieces(line, seconds)
    x = np.linspace(-1.0, 1.0, pieces.shape[1])
    centred = pieces - pieces.mean(axis=1, keepdims=True)
    return centred.ravel(), (centred - np.outer(centred @ x / (x @ x), x)).ravel()


def pass_to_pass(trials: list[Trial]) -> Array:
    """Position errors (n, 3) [m] of one flight of a campaign minus another's, at the same places."""
    found = [
        b.p_n_m - a.p_n_m
        for first in range(0, len(trials), 3)
        for one, other in itertools.combinations(trials[first : first + 3], 2)
        for a, b in zip(one.lines, other.lines, strict=True)
    ]
    return np.concatenate(found)


def mean_of(parts: list[Json], root: bool) -> Json:
    """Means of the same numbers, or roots of the means of their squares; all flights have as many epochs."""
    keys = parts[0].keys()
    return {k: rms([p[k] for p in parts]) if root else float(np.mean([p[k] for p in parts])) for k in keys}


def summary_of(variant: Variant, trials: list[Trial]) -> Summary:
    """Sums over the flights of a variant."""
    both = [within_aperture(line, s) for s in APERTURES_S for t in trials for line in t.lines]
    per = len(both) // len(APERTURES_S)
    apertures: Json = {}
    for k, seconds in enumerate(APERTURES_S):
        part = both[k * per : (k + 1) * per]
        apertures[f"{seconds:g}_s"] = {
            "mean_removed_mm": 1e3 * rms(np.concatenate([c for c, _ in part])),
            "trend_removed_mm": 1e3 * rms(np.concatenate([d for _, d in part])),
            "trend_removed_max_mm": 1e3 * max(float(abs(d).max()) for _, d in part),
        }
    between = pass_to_pass(trials)
    return Summary(
        name=variant.name,
        flights=len(trials),
        all={
            key: mean_of([t.figures[key] for t in trials], key in ("rmse", "own_sigma"))
            for key in trials[0].figures
        },
        each=[t.figures for t in trials[:3]],
        alignment_rms_deg=rms([t.alignment.error_deg for t in trials]),
        alignment_sigma_deg=rms([t.alignment.sigma_deg for t in trials]),
        latency_rms_ms=1e3 * rms([t.latency_s for t in trials]),
        lines=len(trials[0].lines),
        los_mm=1e3 * rms(np.concatenate([line.los_m for t in trials for line in t.lines])),
        los_sigma_mm=1e3 * rms(np.concatenate([line.los_sigma_m for t in trials for line in t.lines])),
        pass_to_pass_mm=1e3 * rms(between @ line_of_sight_n()),
        pass_to_pass_ned_mm=[1e3 * rms(between[:, k]) for k in range(3)],
        pass_to_pass_3d_mm=1e3 * rms(np.linalg.norm(between, axis=1)),
        apertures=apertures,
    )


def phase_deg(los_m: Array, wavelength_m: float) -> Array:
    """4 pi dr / lambda."""
    phase: Array = np.rad2deg(4.0 * math.pi * los_m / wavelength_m)
    return phase


def draw(trials: list[Trial], quick: bool) -> str:
    """The first line of three flights: errors, and phases from pass to pass and within an aperture."""
    figure, axes = subplots(1, 3, 9.0, 2.9)
    for k, trial in enumerate(trials[:3]):
        line = trial.lines[0]
        axes[0, 0].plot(line.east_m, 1e3 * line.los_m, color=f"C{k}", label=f"flight {k + 1}")
    sigma = 1e3 * trials[0].lines[0].los_sigma_m
    axes[0, 0].fill_between(trials[0].lines[0].east_m, -sigma, sigma, color="0.85", lw=0, label="own sigma")
    axes[0, 0].set(ylabel="line-of-sight error [mm]", title="three flights, first line")
    first, second = trials[0].lines[0], trials[1].lines[0]
    x = first.east_m
    for band, wavelength in BANDS_M.items():
        axes[0, 1].plot(x, phase_deg(second.los_m - first.los_m, wavelength), label=f"{band} band")
        _, left = within_aperture(first, 5.0)
        n = len(aperture_pieces(first, 5.0)[0])
        gaps = np.insert(left, range(n, left.size, n), np.nan)  # each piece a line of its own
        places = np.insert(x[: left.size], range(n, left.size, n), np.nan)
        axes[0, 2].plot(places, phase_deg(gaps, wavelength), label=f"{band} band")
    axes[0, 1].set(ylabel="phase error [deg]", title="flight 2 minus flight 1")
    axes[0, 2].set(ylabel="phase error [deg]", title="within 5 s, mean and trend removed")
    for ax in axes[0]:
        ax.set_xlabel("along the track [m]")
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + 0.25 * (high - low))
        ax.legend(loc="upper center", ncols=2 if ax is axes[0, 0] else 3, columnspacing=0.8, handlelength=0.9)
    return save_figure(figure, "dinsar.png", quick)


def experiment(quick: bool, jobs: int) -> Section:
    """Run it and tell."""
    todo = [
        Job(variant, seed)
        for variant in VARIANTS
        for seed in range(1, 1 + 3 * (1 if quick else variant.campaigns))
    ]
    trials = mapped(run, jobs, todo)
    summaries = []
    for variant in VARIANTS:
        summaries.append(summary_of(variant, [t for t in trials if t.job.variant == variant]))
    draw([t for t in trials if t.job.variant == VARIANTS[0]], quick)
    numbers: Json = {s.name: s.numbers() for s in summaries}
    numbers["limits"] = LIMITS
    numbers["wavelengths_m"] = BANDS_M
    return Section(
        "dinsar",
        "The need behind it: three flights on one track for DInSAR",
        section_text(summaries, BANDS_M),
        numbers,
        figures=("dinsar.png",),
    )
