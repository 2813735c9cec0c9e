"""TAES (13) as printed against the closed form over a sample."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

from liealign.study import ScenarioResult, run_study

from section import Section, markdown_table, number
from studies import SCENARIOS, table_1

KEYS: dict[str, Any] = {"study.start": "drawn", "study.models": ["lie"], "gnss.outlier": "off"}
# Whose inverse makes the IMU, how often, and what the filter takes.
CASES = {
    "true means of the motion, 4 steps a sample; `exact`": ("exact", 4, "exact"),
    "true means of the motion, 4 steps a sample; `paper`": ("exact", 4, "paper"),
    "inverse of the paper's (32)-(33); `paper`": ("paper", 1, "paper"),
    "inverse of the paper's (32)-(33); `exact`": ("paper", 1, "exact"),
}
SHOWN = (("roll_deg", 0), ("heading_deg", 2), ("position_m", 6), ("velocity_mps", 7))


def rows(results: dict[str, dict[str, ScenarioResult]], scenario: str) -> list[list[str]]:
    table = []
    for case, by_scenario in results.items():
        r = by_scenario[scenario]
        cells = [case]
        for stage in ("filter", "smoother"):
            cells += [number(float(r.rmse(stage, "flight")[0, c])) for _, c in SHOWN]
            cells.append(f"{r.nees(stage, 'lie').mean:.1f}")
        table.append([*cells, f"{r.nis('lie').mean:.2f}"])
    return table


def experiment(quick: bool, jobs: int) -> Section:
    """Two ways to make the IMU, two to use it."""
    runs = 3 if quick else 30
    results = {}
    for case, (truth, oversample, filter_with) in CASES.items():
        keys = {**KEYS, "study.mechanization": truth, "flight.oversample": oversample}
        results[case] = run_study(table_1({**keys, "filter.mechanization": filter_with}), runs)
    head = ["IMU; filter"]
    for stage in ("filter", "smoother"):
        head += [f"{stage}: roll [deg]", "heading [deg]", "position [m]", "velocity [m/s]", "NEES"]
    tables = "\n".join(
        f"{scenario}, RMSE in flight\n\n" + markdown_table([*head, "NIS"], rows(results, scenario))
        for scenario in SCENARIOS
    )
    text = f"""
TAES (13) moves the state by one exponential, which leaves out half the acceleration over the sample in the
position and turns velocity and gravity
with the body. An IMU made by its inverse (32)-(33) hides that, for the two errors cancel; on an IMU that
reports means of the motion it shows.
{runs} runs of each, seeds as for the tables, first state drawn from P_0, biases of Table I.

{tables}

On its own truth `paper` does as well as `exact` does on real means. A log of a real IMU is of the first
kind: there the paper's step costs what the
second line of each table says, and its innovations say so (NIS, 3 expected). `exact` is the default;
`filter.mechanization = "paper"` is there for
this comparison.
"""
    return Section(
        name="mechanization",
        title="TAES (13) against the closed form",
        text=text,
        numbers={
            f"{truth} truth, {used} filter": {
                scenario: {
                    "nis": r.nis("lie").mean,
                    **{
                        stage: {
                            **{name: float(r.rmse(stage, "flight")[0, c]) for name, c in SHOWN},
                            "nees": r.nees(stage, "lie").mean,
                        }
                        for stage in ("filter", "smoother")
                    },
                }
                for scenario, r in results[case].items()
            }
            for case, (truth, _, used) in CASES.items()
        },
    )
