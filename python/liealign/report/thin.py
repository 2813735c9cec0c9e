"""Thins traces to what a screen shows, so that a flight of hours still opens at once.

A bin keeps its lowest and its highest value, hence a spike of one sample stays where it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from liealign.solution import Array

Index = NDArray[np.intp]

BINS = 1000  # a figure is about as many pixels wide
MOST_MARKED = 8000  # markers that are never thinned; with many more the page would not open any more


def extremes(values: Array, bins: int = BINS) -> Index:
    """Return the indices, ascending, of the lowest and highest value of each bin of rows.

    Parameters
    ----------
    values
        (n,) or (n, k); a column keeps its own extremes. NaN is never one.
    bins
        At most 2 k bins + 2 indices come back; all n where n is no more than that.
    """
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    columns = values.reshape(n, -1)
    edges = np.linspace(0, n, bins + 1).astype(np.intp)
    kept = [np.array([0, n - 1], dtype=np.intp)]
    for column in columns.T:
        for sign in (1.0, -1.0):
            kept.append(_lowest(sign * column, edges))
    return np.unique(np.concatenate(kept))


def _lowest(column: Array, edges: Index) -> Index:
    """Index of the lowest number between each two edges."""
    numbers = np.where(np.isnan(column), np.inf, column)
    lowest = np.minimum.reduceat(numbers, edges[:-1])
    bin_of = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    hits = np.flatnonzero(numbers == lowest[bin_of])
    _, first = np.unique(bin_of[hits], return_index=True)
    found: Index = hits[first]
    return found


def marked(values: Array, ordinary: bool) -> Index:
    """Return the markers to draw: of ordinary fixes the extremes, of all others every one.

    More than MOST_MARKED are thinned as well: that many no longer stand out anyway.
    """
    if ordinary:
        return extremes(values)
    return extremes(values, MOST_MARKED // 2)
