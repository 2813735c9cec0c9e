"""The heading alignment as TAES IV-E and DRONES 3.1 print it: filters from three headings, one parabola.

    phi(psi_0) = sum_k 1/2 log|S_k| + 1/2 |z_k|^2_{S_k^-1} + psi_0^2 / (2 sigma_psi^2)          TAES (30)
    psi_0* = -m_2 / (2 m_1)   of m_1 psi^2 + m_2 psi + m_3 through the three                     TAES (31)

No outlier test and no iteration. sigma_psi is not printed; 20 deg here.
"""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import liealign
import numpy as np

from flights import Array

PRIOR_STD_DEG = 20.0
P0_HEADING_STD_DEG = 5.0 / 3.0  # of P_0 in TAES V-B


@dataclass(frozen=True)
class Curve:
    """phi without its prior, and P_RMS [m] with its root (DRONES 2.3), over candidate headings."""

    heading_deg: Array
    cost: Array
    p_rms_m: Array


@dataclass(frozen=True)
class Parabola:
    """Through three points: where it is lowest, and one sigma of exp(-phi) (nan: no minimum)."""

    heading_deg: float
    sigma_deg: float
    coefficients: Array  # highest power first


def prepared_for_paper(flight: liealign.Flight) -> liealign.PreparedFlight:
    """With the plain quadratic cost of (30)."""
    return liealign.prepare_flight(
        flight.with_config(liealign.make_config({"gnss.outlier": "off"}, base=flight.config))
    )


def curve(flight: liealign.PreparedFlight, headings_deg: Iterable[float], heading_std_deg: float) -> Curve:
    """One filter from each heading, with that heading variance at the start."""
    at = np.array(list(headings_deg), dtype=np.float64)
    std = math.radians(heading_std_deg)
    scores = liealign.evaluate_candidates(
        flight, [liealign.HeadingCandidate(math.radians(heading), std) for heading in at]
    )
    return Curve(at, np.array([s.cost for s in scores]), np.array([s.p_rms_m for s in scores]))


def fit(points: Curve, prior_std_deg: float | None = None) -> Parabola:
    """(31), with the prior of mean 0 if there is one."""
    x = points.heading_deg
    prior = 0.0 if prior_std_deg is None else 0.5 * (x / prior_std_deg) ** 2
    m = np.polyfit(x, points.cost + prior, 2)
    bent = float(m[0])
    return Parabola(float(-m[1] / (2.0 * bent)), 1.0 / math.sqrt(2.0 * bent) if bent > 0.0 else math.nan, m)
