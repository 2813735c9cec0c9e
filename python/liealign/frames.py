"""Axes of the local level, north, east, down, for arrays of places."""

from __future__ import annotations

import numpy as np

from liealign.solution import Array


def ned_rows(lat_deg: Array, lon_deg: Array) -> Array:
    """Return C_e_n, (n, 3, 3): rows north, east, down in ECEF components, at each place."""
    phi, lam = np.deg2rad(lat_deg), np.deg2rad(lon_deg)
    zero = np.zeros_like(phi)
    north = np.stack([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)], axis=1)
    east = np.stack([-np.sin(lam), np.cos(lam), zero], axis=1)
    down = np.stack([-np.cos(phi) * np.cos(lam), -np.cos(phi) * np.sin(lam), -np.sin(phi)], axis=1)
    rows: Array = np.stack([north, east, down], axis=1)
    return rows
