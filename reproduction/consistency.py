"""Are the stated sigmas true: NEES, NIS and the bound, with the filter's own noise and with the papers'."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

from liealign.study import CHANNELS, ScenarioResult, run_study

from section import Section, markdown_table, percent, picture, save_figure, subplots
from studies import SCENARIOS, settings, table_1

MATCHED = {
    "study.start": "drawn",
    "study.biases": "random_walk",
    "study.models": ["lie"],
    "gnss.outlier": "off",
}
MISMATCH = {**MATCHED, "study.biases": "ornstein_uhlenbeck"}
LIMITED = ("roll_deg", "pitch_deg", "heading_deg", "position_m")
STAGES = ("filter", "smoother")


def nees_table(results: dict[str, ScenarioResult]) -> str:
    rows = []
    for scenario, result in results.items():
        nis = result.nis("lie")
        for stage in STAGES:
            b = result.nees(stage, "lie")
            rows.append(
                [
                    f"{scenario}, {stage}",
                    f"{b.mean:.2f}",
                    f"{b.low:.2f} to {b.high:.2f}",
                    "yes" if b.inside else "**no**",
                    percent(result.nees_share_inside(stage, "lie")),
                    f"{nis.mean:.3f}",
                    f"{nis.low:.3f} to {nis.high:.3f}",
                ]
            )
    return markdown_table(["", "NEES", "band", "inside", "times inside their band [%]", "NIS", "band"], rows)


def bound_table(results: dict[str, ScenarioResult]) -> str:
    rows = []
    for scenario, result in results.items():
        for stage in STAGES:
            cells = [f"{scenario}, {stage}"]
            for channel in LIMITED:
                r = result.rmse_over_limit(stage, "flight", channel)
                cells.append(f"{r.ratio:.3f} ({r.low:.3f} to {r.high:.3f})")
            rows.append(cells)
    return markdown_table(["RMSE over the bound, flight", *(c.rpartition("_")[0] for c in LIMITED)], rows)


def draw(matched: dict[str, ScenarioResult], mismatch: dict[str, ScenarioResult], quick: bool) -> str:
    figure, axes = subplots(2, 3, 7.2, 3.8, sharex=True, sharey=True)
    for column, scenario in enumerate(SCENARIOS):
        for line, stage in enumerate(STAGES):
            ax = axes[line][column]
            for results, color, label in (
                (matched, "C0", "noise of the filter"),
                (mismatch, "C3", "papers' noise"),
            ):
                r = results[scenario]
                ax.plot(r.times_s - r.times_s[0] + 10.0, r.nees_at(stage, "lie"), color=color, label=label)
            low, high = matched[scenario].nees_band_at("lie")
            ax.axhspan(low, high, color="0.85", label="95 % band")
        axes[0][column].set_title(scenario)
        axes[1][column].set_xlabel("time [s]")
    axes[0][0].set_ylabel("NEES, filter")
    axes[1][0].set_ylabel("NEES, smoother")
    axes[0][0].legend()
    return save_figure(figure, "consistency.png", quick)


def numbers(results: dict[str, ScenarioResult]) -> dict[str, Any]:
    return {
        scenario: {
            "nis": r.nis("lie")._asdict(),
            **{
                stage: {
                    "nees": r.nees(stage, "lie")._asdict(),
                    "nees_share_inside": r.nees_share_inside(stage, "lie"),
                    "rmse_over_bound": {c: r.rmse_over_limit(stage, "flight", c)._asdict() for c in LIMITED},
                    "bound": dict(zip(CHANNELS, map(float, r.limit(stage, "flight")), strict=True)),
                }
                for stage in STAGES
            },
        }
        for scenario, r in results.items()
    }


def experiment(quick: bool, jobs: int) -> Section:
    """Matched and mismatched noise."""
    runs = 10 if quick else 200
    matched, mismatch = (run_study(table_1(keys), runs) for keys in (MATCHED, MISMATCH))
    text = f"""
{runs} runs of each scenario, the seeds and sensors of Table I. *Noise of the filter*: {settings(MATCHED)}:
biases walk as
the filter has it, the first state is drawn as X_true = X_hat exp(eps), eps ~ N(0, P_0). *The papers'
noise*: Ornstein-Uhlenbeck biases
about turn-on values of 500 ug and 10 deg/h on every axis, while the filter has a random walk (q = 2 sigma²
/ tau). NEES is taken every
10 s with all 15 states; its band comes from the spread between runs, that of one time from chi-square.

{picture("consistency.png", "NEES of the Lie filter and smoother over time")}

The filter's own noise:

{nees_table(matched)}

{bound_table(matched)}

The bound is the posterior Cramér-Rao bound, the covariance along the truth. Errors last through much of a
run, so that {runs} runs leave
the intervals given here.

The papers' noise:

{nees_table(mismatch)}

{bound_table(mismatch)}

The first biases of the papers' truth are not drawn from P_0: they are one sigma on every axis of every
run, which is less than a
Gaussian has in its tails. And an Ornstein-Uhlenbeck bias stays where the random walk of the filter lets it
go. The filter
therefore tends to state too much rather than too little: NEES below 15 is the mismatch one can live with.
"""
    return Section(
        name="consistency",
        title="NEES, NIS and the Cramér-Rao bound",
        text=text,
        numbers={"runs": runs, "matched": numbers(matched), "mismatch": numbers(mismatch)},
        figures=(draw(matched, mismatch, quick),),
    )
