"""Draws docs/demo.png from a folder that `liealign demo --output DIR` has written. Needs matplotlib.

Usage: python docs/make_demo_figure.py liealign-demo docs/demo.png
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt


def wrap(angle_deg: np.ndarray) -> np.ndarray:
    """Return the angle in [-180, 180)."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def heading_curve(ax: plt.Axes, alignment: dict) -> None:
    """Draw the wide candidates over the circle and the last parabola of the conditional ones."""
    curve = alignment["curve"]
    wide = sorted((p["heading_deg"], p["cost"]) for p in curve if p["heading_std_deg"] > 0)
    lowest = min(cost for _, cost in wide)
    ax.plot([h for h, _ in wide], [c - lowest for _, c in wide], "o-", color="0.4", ms=3, lw=1)
    ax.axvline(alignment["heading_deg"], color="C3", lw=1)
    ax.set(xlabel="candidate heading [deg]", ylabel="negative log-likelihood")
    ax.set(xlim=(0, 360), xticks=range(0, 361, 60))
    heading, sigma = alignment["heading_deg"], alignment["heading_std_deg"]
    ax.set_title(f"heading {heading:.3f} deg, sigma {sigma:.3f} deg", fontsize=9)

    points = [p for p in curve if p["gated"]][-3:]
    x = wrap(np.array([p["heading_deg"] for p in points]) - alignment["heading_deg"])
    y = np.array([p["cost"] for p in points])
    fit = np.polynomial.Polynomial.fit(x, y - y.min(), 2)
    inset = ax.inset_axes((0.12, 0.5, 0.4, 0.4))
    fine = np.linspace(1.4 * x.min(), 1.4 * x.max(), 100)
    inset.plot(fine, fit(fine), color="C0", lw=1)
    inset.plot(x, y - y.min(), "o", color="C0", ms=3)
    inset.axvline(0.0, color="C3", lw=1)
    inset.set_title("conditional candidates", fontsize=7)
    inset.tick_params(labelsize=6)


def heading_error(ax: plt.Axes, folder: Path) -> None:
    """Draw the error of filter and smoother against truth with the smoother's three-sigma band."""
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    colours = {"filtered.csv": "0.6", "trajectory.csv": "C0"}
    for name, colour in colours.items():
        table = np.genfromtxt(folder / "out" / name, delimiter=",", names=True)
        heading = np.unwrap(truth["heading_deg"], period=360.0)
        error = wrap(table["heading_deg"] - np.interp(table["time_s"], truth["time_s"], heading))
        time = table["time_s"] - truth["time_s"][0]
        ax.plot(time, error, color=colour, lw=0.8, label="filter" if name == "filtered.csv" else "smoother")
        if name == "trajectory.csv":
            band = 3.0 * table["std_heading_deg"]
            ax.fill_between(time, -band, band, color=colour, alpha=0.2, lw=0, label="three sigma")
    ax.set(xlabel="time [s]", ylabel="heading error [deg]", ylim=(-0.12, 0.12))
    ax.legend(fontsize=7, loc="lower right")


def main() -> None:
    """Read the folder, draw, save."""
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    alignment = json.loads((folder / "out" / "alignment.json").read_text(encoding="utf-8"))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    heading_curve(left, alignment)
    heading_error(right, folder)
    figure.savefig(target, dpi=110)


main()
