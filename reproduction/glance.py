"""The page in one table: what the papers print, and what came of it here, from the sections' numbers."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from section import Json, markdown_table, number, percent

Row = tuple[str, str, str]


def _tables(n: Json) -> Row:
    above = sum(len(cells) for cells in n["above_paper"].values())
    here = (
        "at or below the printed cells in attitude and 3-D position" if not above else f"{above} cells above"
    )
    return (
        "Lie filter and smoother (TAES Tables II, III)",
        "RMSE of 24 cells",
        f"{here}; {n['runs']} runs each",
    )


def _order(n: Json) -> Row:
    error = "40.0" if "40.0" in n else max(n, key=float)
    ratios = [scenario["smoother"]["lie_over_mekf"]["ratio"] for scenario in n[error].values()]
    gain = " to ".join(f"{100.0 * (1.0 - r):.0f} %" for r in (max(ratios), min(ratios)))
    return (
        "gain of the Lie smoother over the MEKS in heading",
        "9 to 40 %, first error not stated",
        f"none to first order; {gain} from a heading {float(error):g} deg off",
    )


def _consistency(n: Json) -> Row:
    stages = [scenario[stage] for scenario in n["matched"].values() for stage in ("filter", "smoother")]
    nees = [stage["nees"]["mean"] for stage in stages]
    inside = sum(stage["nees"]["low"] <= stage["nees"]["mean"] <= stage["nees"]["high"] for stage in stages)
    off = max(abs(r["ratio"] - 1.0) for stage in stages for r in stage["rmse_over_bound"].values())
    return (
        "consistency of the Lie filter and smoother",
        "not shown",
        f"NEES {min(nees):.2f} to {max(nees):.2f} of 15, {inside} of {len(stages)} in the 95 % band; "
        f"RMSE within {100.0 * off:.0f} % of the bound",
    )


def _mechanization(n: Json) -> Row:
    factors = [
        n["exact truth, paper filter"][name]["smoother"]["heading_deg"]
        / n["exact truth, exact filter"][name]["smoother"]["heading_deg"]
        for name in n["exact truth, exact filter"]
    ]
    return (
        "TAES (13) as printed, on true means",
        "not shown",
        f"smoothed heading {min(factors):.1f} to {max(factors):.1f} times worse than with the closed form",
    )


def _fig8(n: Json) -> Row:
    near, circle = n["no_guess_within_20_deg"]["all"], n["no_guess_whole_circle"]["all"]
    return (
        "heading alignment (TAES Fig. 8)",
        "below 2 deg within ±20 deg",
        f"{number(near['rms_deg'])} deg rms within ±20 deg; over the circle {number(circle['rms_deg'])}, "
        f"at most {number(circle['max_deg'])} deg, {percent(circle['in_95_interval'])} % in the 95 % "
        "interval",
    )


def _fig5(n: Json) -> Row:
    below = n["sigma_below_1_deg_s"]
    return (
        "time after take-off until the heading is there (DRONES Fig. 5)",
        "90 s, one flight",
        f"sigma below 1 deg after {below['median']:.0f} s (median), {below['last']:.0f} s in all flights",
    )


def _outliers(n: Json) -> Row:
    conditions = [c for c in n.values() if isinstance(c, dict)]
    lost = {mode: sum(c[mode]["lost"] for c in conditions) for mode in ("weight", "reject", "off")}
    flights = sum(c["weight"]["flights"] for c in conditions)
    return (
        "outlier weighting (TAES IV-C)",
        "not shown",
        f"flights whose heading is lost, of {flights}: {lost['weight']} with weighting, "
        f"{lost['reject']} with rejection, {lost['off']} without",
    )


def _dinsar(n: Json) -> Row:
    names = {
        "north_10_mm": "north",
        "east_10_mm": "east",
        "down_10_mm": "down",
        "norm_10_mm": "3-D",
        "roll_and_pitch_0.1_deg": "roll and pitch",
        "heading_1_deg": "heading",
    }
    at_1_hz, at_5_hz = (n[case]["all"]["inside"] for case in ("automatic", "given, 5 Hz"))
    shares = ", ".join(f"{name} {percent(at_1_hz[key])}" for key, name in names.items())
    return (
        "10 mm, 0.1 deg, 1 deg for DInSAR (DRONES 1)",
        "wanted",
        f"% of flight epochs inside: {shares}; 3-D with fixes at 5 Hz {percent(at_5_hz['norm_10_mm'])}",
    )


ROWS: dict[str, Callable[[Any], Row]] = {
    "tables": _tables,
    "order": _order,
    "consistency": _consistency,
    "mechanization": _mechanization,
    "fig8": _fig8,
    "fig5": _fig5,
    "outliers": _outliers,
    "dinsar": _dinsar,
}


def at_a_glance(numbers: dict[str, Json]) -> str:
    """One row for each section that has one."""
    rows = [ROWS[name](n) for name, n in numbers.items() if name in ROWS]
    return markdown_table(["what", "the papers", "here"], rows)
