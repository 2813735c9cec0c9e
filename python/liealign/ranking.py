"""Filters of one flight ranked by how well they predict its fixes (DRONES 2.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from liealign import _core
from liealign._core import Cancelled, Flight, HeadingCandidate, NumericalError
from liealign.drivers import search_heading
from liealign.flight import make_config


@dataclass(frozen=True)
class FilterRank:
    """One of the filters that `rank_by_p_rms` was given.

    Attributes
    ----------
    index
        Its place among the candidates.
    keys
        The configuration keys that make it.
    heading_deg
        From which it ran, [0, 360).
    p_rms_m
        Root mean square of its position innovations [m], (Eq. 34); infinite when the filter failed.
    fixes
        How many fixes that is of; the same ones for every candidate.
    """

    index: int
    keys: Mapping[str, Any] = field(repr=False)
    heading_deg: float
    p_rms_m: float
    fixes: int


def rank_by_p_rms(
    flight: Flight,
    candidates: Sequence[Mapping[str, Any]],
    *,
    heading_deg: float | Sequence[float | None] | None = None,
    first_fix: int = 0,
    last_fix: int | None = None,
    progress: _core.ProgressCallback | None = None,
) -> list[FilterRank]:
    """Run filters F(p1), F(p2), ... over the same fixes of a flight; the best at predicting them comes first.

    P_RMS (Eq. 34) is a plain measure that compares filters of any kind: lever arms, latencies, noise,
    headings. It is not a likelihood, so it says nothing of how sure the order is; a fix that is wrong
    counts for all of them. The fixes are those after the rest, up to `align.max_time_s`, that every
    candidate has used; a filter treats them as `gnss.outlier` says, and never yields to them.

    Parameters
    ----------
    flight
        From `read_flight` or `flight_from_arrays`.
    candidates
        Configuration keys of each, over those of the flight, such as {"gnss.latency_s": 0.1}.
    heading_deg
        The heading from which a candidate runs [deg], with `initial.heading_std_deg`: one for all, or one
        for each. None: that of its own alignment.
    first_fix, last_fix
        Rows of the GNSS log, N1 and N2 of (Eq. 34), both included; None is the last.
    progress
        Called as progress(done, total) with the number of candidates; returning False cancels.

    Raises
    ------
    InputError, ConfigError
        As `align_heading` and `make_config`, for the first candidate that cannot be used; when
        `heading_deg` has not one heading for each candidate; when they have no fix in common.
    NumericalError
        When an alignment fails from every heading. A filter that fails is ranked last instead.
    Cancelled
        When `progress` returned False.
    """
    headings = _headings(heading_deg, len(candidates))
    innovations: list[list[_core.FixInnovation]] = []
    started: list[float] = []
    for done, (keys, heading) in enumerate(zip(candidates, headings, strict=True), start=1):
        prepared = _core.prepare_flight(flight.with_config(make_config(keys, base=flight.config)))
        start_rad = search_heading(prepared).heading_rad if heading is None else float(np.deg2rad(heading))
        started.append(float(np.rad2deg(start_rad)) % 360.0)
        innovations.append(_innovations(prepared, start_rad))
        if progress is not None and progress(done, len(candidates)) is False:
            raise Cancelled("cancelled")
    last = len(flight.gnss()["time_s"]) - 1 if last_fix is None else last_fix
    return [
        FilterRank(r.filter, candidates[r.filter], started[r.filter], r.p_rms_m, r.fixes)
        for r in _core.rank_innovations(innovations, first_fix, last)
    ]


def _innovations(flight: _core.PreparedFlight, heading_rad: float) -> list[_core.FixInnovation]:
    std_rad = float(np.deg2rad(_core.config_entries(flight.config)["initial.heading_std_deg"]))
    try:
        return _core.fix_innovations(flight, HeadingCandidate(heading_rad, std_rad, gated=True))
    except NumericalError:
        return []


def _headings(given: float | Sequence[float | None] | None, n: int) -> list[float | None]:
    if given is None or isinstance(given, int | float):
        return [given] * n
    if len(given) != n:
        raise _core.InputError(
            f"heading_deg has {len(given)} headings; expected one, or {n} for {n} candidates"
        )
    return list(given)
