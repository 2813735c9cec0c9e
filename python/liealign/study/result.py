"""What the runs of a scenario come to: RMSE, sigma, bound, NEES and NIS, paired comparisons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from liealign import _core
from liealign.solution import Array

CHANNELS: tuple[str, ...] = _core.STUDY_CHANNELS
STAGES = ("filter", "smoother")
WINDOWS = ("whole", "flight")

_STATES = 15
_MEASURED = 3
_RESAMPLES = 2000
# Runs that an interval or a band from their spread wants; with fewer it would be one of chance.
_FEWEST = 10


class Band(NamedTuple):
    """A mean, what it should be, and the 95 % band that it should lie in."""

    mean: float
    expected: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Whether the mean lies in the band."""
        return self.low <= self.mean <= self.high


class Ratio(NamedTuple):
    """RMSE of one model over that of another on the same runs, with its 95 % interval."""

    ratio: float
    low: float
    high: float


def chi_square_band(degrees: float) -> tuple[float, float]:
    """Return the 95 % band of chi-square over its degrees of freedom, 30 or more (Wilson, Hilferty 1931)."""
    spread = 2.0 / (9.0 * degrees)
    low, high = (1.0 - spread + z * np.sqrt(spread) for z in (-1.959964, 1.959964))
    return float(low**3), float(high**3)


@dataclass(frozen=True, eq=False)
class ScenarioResult:
    """The runs of one scenario.

    Attributes
    ----------
    name
        Of the scenario.
    models
        Names of the filters, in the order of the arrays.
    runs
        The arrays of `_core.run_study`, one row per run.
    failures
        (run, model, why) of each filter that failed.
    bound
        The arrays of `_core.study_bound`.
    times_s
        (t,) times that NEES is taken at.
    """

    name: str
    models: tuple[str, ...]
    runs: dict[str, Any] = field(repr=False)
    failures: list[tuple[int, int, str]] = field(repr=False)
    bound: dict[str, Any] = field(repr=False)
    times_s: Array = field(repr=False)

    @property
    def count(self) -> int:
        """Runs."""
        return len(self.runs["seed"])

    def good(self) -> NDArray[np.bool_]:
        """Return (runs, models): whether the filter went through."""
        good = np.ones((self.count, len(self.models)), dtype=bool)
        for run, model, _ in self.failures:
            good[run, model] = False
        return good

    def _mean_square(self, name: str, stage: str, window: str) -> Array:
        """Return (models, channels), over the runs that went through."""
        s, w = STAGES.index(stage), WINDOWS.index(window)
        good = self.good()
        sums = np.where(good[:, :, None], self.runs[name][:, :, s, w], 0.0).sum(axis=0)
        epochs = (good * self.runs["epochs"][:, w, None]).sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean: Array = sums / epochs[:, None]
        return mean

    def rmse(self, stage: str, window: str) -> Array:
        """Return (models, channels): root mean square error over all epochs; NaN where no run went through.

        stage is "filter" or "smoother", window "whole" or "flight".
        """
        return np.sqrt(self._mean_square("squares", stage, window))

    def sigma(self, stage: str, window: str) -> Array:
        """Return (models, channels): root mean square of the stated standard deviations."""
        return np.sqrt(self._mean_square("variances", stage, window))

    def limit(self, stage: str, window: str) -> Array:
        """Return (channels,): the bound of (Eq. 68), the Lie model's covariance along the truth."""
        s, w = STAGES.index(stage), WINDOWS.index(window)
        with np.errstate(invalid="ignore"):
            bound: Array = np.sqrt(self.bound["variances"][0, 0, s, w] / self.bound["epochs"][0, w])
        return bound

    def paired_ratio(self, stage: str, window: str, channel: str, model: str, other: str) -> Ratio:
        """Return the RMSE of `model` over that of `other`, over the runs that both went through.

        The interval is from a bootstrap over these runs, with a fixed seed; NaN for less than ten.
        """
        s, w, c = STAGES.index(stage), WINDOWS.index(window), CHANNELS.index(channel)
        pair = [self.models.index(model), self.models.index(other)]
        both = self.good()[:, pair].all(axis=1)
        a, b = self.runs["squares"][both][:, pair, s, w, c].T
        if a.size == 0:
            return Ratio(np.nan, np.nan, np.nan)
        interval = _resampled(lambda draws: np.sqrt(a[draws].sum(axis=1) / b[draws].sum(axis=1)), a.size)
        return Ratio(float(np.sqrt(a.sum() / b.sum())), *interval)

    def rmse_over_limit(self, stage: str, window: str, channel: str, model: str = "lie") -> Ratio:
        """Return the RMSE over the bound, with its 95 % interval (bootstrap, fixed seed)."""
        s, w, c, m = (
            STAGES.index(stage),
            WINDOWS.index(window),
            CHANNELS.index(channel),
            self.models.index(model),
        )
        good = self.good()[:, m]
        squares = self.runs["squares"][good, m, s, w, c] / self.runs["epochs"][good, w]
        limit = float(self.limit(stage, window)[c])
        if squares.size == 0:
            return Ratio(np.nan, np.nan, np.nan)
        interval = _resampled(lambda draws: np.sqrt(squares[draws].mean(axis=1)) / limit, squares.size)
        return Ratio(float(np.sqrt(squares.mean())) / limit, *interval)

    def nees_at(self, stage: str, model: str) -> Array:
        """Return (t,): mean NEES over the runs at each time; the band is `nees_band_at`."""
        m, s = self.models.index(model), STAGES.index(stage)
        nees = self.runs["nees"][self.good()[:, m], m, s]
        present = np.isfinite(nees).all(axis=0)
        mean: Array = np.full(self.times_s.size, np.nan)
        if nees.size:
            mean[present] = nees[:, present].mean(axis=0)
        return mean

    def nees_band_at(self, model: str) -> tuple[float, float]:
        """Return the 95 % band of `nees_at` at one time: chi-square with 15 degrees of freedom per run."""
        runs = int(self.good()[:, self.models.index(model)].sum())
        low, high = chi_square_band(_STATES * runs) if runs else (np.nan, np.nan)
        return _STATES * low, _STATES * high

    def nees(self, stage: str, model: str) -> Band:
        """Return the mean NEES over runs and times.

        Its band comes from the spread of the runs' means, for within a run errors go on; NaN for less than
        ten of them.
        """
        m, s = self.models.index(model), STAGES.index(stage)
        nees = self.runs["nees"][self.good()[:, m], m, s]
        nees = nees[np.isfinite(nees).any(axis=1)]
        means = np.nanmean(nees, axis=1) if nees.size else np.array([])
        return _spread_band(means, float(_STATES))

    def nees_share_inside(self, stage: str, model: str) -> float:
        """Return the share of times with a mean NEES in `nees_band_at`: 0.95 where the noise is right."""
        low, high = self.nees_band_at(model)
        nees = self.nees_at(stage, model)
        nees = nees[np.isfinite(nees)]
        return float(np.mean((nees >= low) & (nees <= high))) if nees.size else float("nan")

    def nis(self, model: str) -> Band:
        """Return the mean NIS of the fixes; its band takes them as independent, 3 degrees of freedom each."""
        m = self.models.index(model)
        good = self.good()[:, m]
        fixes = self.runs["fixes"][good]
        if not fixes.sum():
            return Band(float("nan"), float(_MEASURED), float("nan"), float("nan"))
        low, high = chi_square_band(_MEASURED * float(fixes.sum()))
        mean = float((self.runs["mean_nis"][good, m] * fixes).sum() / fixes.sum())
        return Band(mean, float(_MEASURED), _MEASURED * low, _MEASURED * high)


def _spread_band(means: Array, expected: float) -> Band:
    mean = float(means.mean()) if means.size else float("nan")
    if means.size < _FEWEST:
        return Band(mean, expected, float("nan"), float("nan"))
    half = 1.959964 * float(means.std(ddof=1)) / np.sqrt(means.size)
    return Band(mean, expected, expected - half, expected + half)


def _resampled(roots: Callable[[NDArray[np.int64]], Array], runs: int) -> tuple[float, float]:
    """95 % interval by bootstrap over the runs, with a fixed seed; NaN for too few of them."""
    if runs < _FEWEST:
        return float("nan"), float("nan")
    low, high = np.percentile(
        roots(np.random.default_rng(1).integers(0, runs, (_RESAMPLES, runs))), [2.5, 97.5]
    )
    return float(low), float(high)
