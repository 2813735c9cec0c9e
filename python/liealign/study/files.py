"""The results of a study as files: montecarlo.json, runs.csv and nees.csv; see docs/studies.md."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from liealign import _core
from liealign._core import InputError
from liealign.study.config import Study
from liealign.study.result import CHANNELS, STAGES, WINDOWS, ScenarioResult

STUDY_FILES = ("montecarlo.json", "runs.csv", "nees.csv")


def write_study(folder: str | Path, study: Study, results: dict[str, ScenarioResult]) -> None:
    """Write the three files into a folder, which is made if need be.

    runs.csv and nees.csv are the same to the byte wherever the runs were made; the times taken are in
    montecarlo.json.

    Raises
    ------
    InputError
        When a file cannot be written.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
        (target / "montecarlo.json").write_text(study_json(study, results) + "\n", encoding="utf-8")
        _write_csv(target / "runs.csv", _run_rows(results))
        _write_csv(target / "nees.csv", _nees_rows(results))
    except OSError as error:
        raise InputError(f"{error.filename or target}: cannot be written: {error.strerror}") from None


def study_json(study: Study, results: dict[str, ScenarioResult]) -> str:
    """Return the text of montecarlo.json: the study as given; RMSE, sigma, bound, NEES, NIS by scenario."""
    document = {
        "liealign": _core.__version__,
        "study": {key: value for key, value, *_ in study.entries},
        "seed": study.case(study.scenarios[0]).seed,
        "scenarios": {name: _summary(result) for name, result in results.items()},
    }
    return json.dumps(_plain(document), indent=2, ensure_ascii=False)


def _summary(result: ScenarioResult) -> dict[str, Any]:
    summary: dict[str, Any] = {"runs": result.count, "models": {}}
    for i, model in enumerate(result.models):
        summary["models"][model] = {
            "failed_runs": int((~result.good()[:, i]).sum()),
            "nis": result.nis(model)._asdict(),
            **{stage: _stage(result, stage, model, i) for stage in STAGES},
        }
    summary["bound"] = {
        stage: {window: _channels(result.limit(stage, window)) for window in WINDOWS} for stage in STAGES
    }
    summary["failures"] = [
        {"run": run, "model": result.models[model], "error": text} for run, model, text in result.failures
    ]
    good = result.good()
    summary["mean_seconds"] = {
        "simulate": float(result.runs["simulate_s"].mean()),
        "start": float(result.runs["align_s"].mean()),
        **{
            stage: {
                model: float(result.runs[f"{stage}_s"][good[:, i], i].mean()) if good[:, i].any() else None
                for i, model in enumerate(result.models)
            }
            for stage in STAGES
        },
    }
    return summary


def _stage(result: ScenarioResult, stage: str, model: str, i: int) -> dict[str, Any]:
    return {
        "nees": result.nees(stage, model)._asdict(),
        "nees_share_inside": result.nees_share_inside(stage, model),
        "rmse": {window: _channels(result.rmse(stage, window)[i]) for window in WINDOWS},
        "sigma": {window: _channels(result.sigma(stage, window)[i]) for window in WINDOWS},
    }


def _channels(values: Iterable[float]) -> dict[str, float]:
    return dict(zip(CHANNELS, map(float, values), strict=True))


def _plain(value: Any) -> Any:
    """JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# ---- CSV ---------------------------------------------------------------------------------------------------


def _write_csv(path: Path, rows: Iterable[list[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def _number(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else ""


def _run_rows(results: dict[str, ScenarioResult]) -> Iterable[list[Any]]:
    yield [
        "scenario",
        "run",
        "seed",
        "model",
        "stage",
        "window",
        "epochs",
        "mean_nis",
        "mean_nees",
        *(f"rmse_{channel}" for channel in CHANNELS),
        *(f"sigma_{channel}" for channel in CHANNELS),
    ]
    for name, result in results.items():
        r, good = result.runs, result.good()
        for run, m, s, w in np.ndindex(result.count, len(result.models), len(STAGES), len(WINDOWS)):
            epochs = r["epochs"][run, w] if good[run, m] else 0.0
            head = [name, run, int(r["seed"][run]), result.models[m], STAGES[s], WINDOWS[w], int(epochs)]
            if not epochs:
                yield [*head, *[""] * (2 + 2 * len(CHANNELS))]
                continue
            sums = np.concatenate([r["squares"][run, m, s, w], r["variances"][run, m, s, w]])
            at_times = r["nees"][run, m, s]
            nees = np.nanmean(at_times) if np.isfinite(at_times).any() else np.nan
            yield [*head, *map(_number, (r["mean_nis"][run, m], nees, *np.sqrt(sums / epochs)))]


def _nees_rows(results: dict[str, ScenarioResult]) -> Iterable[list[Any]]:
    yield ["scenario", "model", "stage", "time_s", "mean_nees", "low", "high"]
    for name, result in results.items():
        for model in result.models:
            band = [_number(limit) for limit in result.nees_band_at(model)]
            for stage in STAGES:
                nees = result.nees_at(stage, model)
                for time, mean in zip(result.times_s, nees, strict=True):
                    yield [name, model, stage, _number(float(time)), _number(float(mean)), *band]
