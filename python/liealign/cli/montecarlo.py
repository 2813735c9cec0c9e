"""`liealign montecarlo`: many runs of simulated flights, and how far each filter is off."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from liealign import console
from liealign._core import InputError
from liealign.cli.run import Quiet
from liealign.cli.work import check_folder, exit_codes
from liealign.progress import ProgressBar
from liealign.study import CHANNELS, STAGES, ScenarioResult, read_study, run_study, study_json, write_study

_MODEL_NAMES: dict[str, dict[str, str]] = {
    "filter": {"lie": "LIE-EKF", "mekf": "MEKF", "euler": "EULER-EKF"},
    "smoother": {"lie": "LIE-EKS", "mekf": "MEKS", "euler": "EULER-EKS"},
}


def montecarlo(
    toml: Annotated[
        Path, typer.Argument(metavar="STUDY.toml", help="What is flown, with which sensors and filters.")
    ],
    runs: Annotated[
        str | None,
        typer.Option("-n", "--runs", metavar="N", help="Runs of each scenario, instead of study.runs."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="OUT", help="Folder for montecarlo.json, runs.csv and nees.csv."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler", metavar="ADDRESS", help="Make the runs on the Dask cluster of this scheduler."
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print montecarlo.json on stdout.")] = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the flights of STUDY.toml many times; show the errors of the filters and their limits."""
    with exit_codes():
        study = read_study(toml)
        count = _count(runs, study.runs)
        if output is not None:
            check_folder(output)
        with ProgressBar(f"{count} runs of {len(study.scenarios)} scenarios", quiet=quiet) as progress:
            results = run_study(study, count, scheduler=scheduler, progress=progress)
        if output is not None:
            write_study(output, study, results)
        if json:
            print(study_json(study, results))
        elif not quiet:
            for result in results.values():
                _print(result)
            if output is not None:
                console.say("results", f"{output / 'montecarlo.json'}, runs.csv and nees.csv beside it")


def _count(text: str | None, default: int) -> int:
    if text is None:
        return default
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f'--runs is "{text}"; expected a whole number, 1 or more')
    return count


def _print(result: ScenarioResult) -> None:
    console.say("scenario", f"{result.name}, {result.count} runs")
    window = "flight" if result.runs["epochs"][:, 1].any() else "whole"
    for stage in STAGES:
        table = Table(
            f"{stage}, rms {'in flight' if window == 'flight' else 'over the whole run'}",
            box=None,
            pad_edge=False,
            padding=(0, 2, 0, 0),
        )
        for model in result.models:
            table.add_column(_MODEL_NAMES[stage][model], justify="right", no_wrap=True)
        table.add_column("limit", justify="right", no_wrap=True)
        rmse, limit = result.rmse(stage, window), result.limit(stage, window)
        for c, channel in enumerate(CHANNELS):
            name, _, unit = channel.rpartition("_")
            if channel == "gyro_bias_deg_h":
                name, unit = "gyro_bias", "deg/h"
            row = [f"{value:.5g}" for value in (*rmse[:, c], limit[c])]
            table.add_row(f"{name.replace('_', ' ')}, {unit.replace('mps', 'm/s')}", *row)
        nees = [result.nees(stage, model) for model in result.models]
        table.add_row("NEES", *(f"{band.mean:.2f}" for band in nees), "15")
        if all(isfinite(band.low) for band in nees):
            table.add_row("its 95 % band", *(f"{band.low:.2f} to {band.high:.2f}" for band in nees), "")
        console.print_table(table)
    band = result.nis(result.models[0])
    nis = ", ".join(f"{_MODEL_NAMES['filter'][m]} {result.nis(m).mean:.3f}" for m in result.models)
    console.say("NIS", f"{nis}; 95 % band {band.low:.3f} to {band.high:.3f}")
    for run, m, text in result.failures[:3]:
        console.say("failed", f"run {run}, {result.models[m]}: {text}", "yellow")
    if len(result.failures) > 3:
        console.say("failed", f"{len(result.failures)} in all", "yellow")
