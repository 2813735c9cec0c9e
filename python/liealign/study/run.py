"""Runs of a study: here, or spread over the workers of a Dask cluster. Results are the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from liealign import _core
from liealign._core import Cancelled, ConfigError, Error, InputError, NumericalError
from liealign.study.config import Study
from liealign.study.result import ScenarioResult

Progress = Callable[[int, int], Any]

# Of a job for the cluster: few enough to spread, and enough for the truth, which every job makes anew.
_RUNS_PER_JOB = 5


def run_study(
    study: Study, runs: int | None = None, *, scheduler: str | None = None, progress: Progress | None = None
) -> dict[str, ScenarioResult]:
    """Run every scenario of the study.

    Run i of scenario j has the seed `study.seed` + 10^6 j + i, whoever runs it: more runs, other machines or
    threads leave the others as they were.

    Parameters
    ----------
    study
        From `read_study` or `make_study`.
    runs
        Of each scenario, instead of those of the study.
    scheduler
        Address of a Dask scheduler, such as "tcp://10.0.0.5:8786", whose workers have the same liealign;
        without it the runs are made here, on every core.
    progress
        Called as progress(done, total) with the number of runs; returning False cancels.

    Returns
    -------
    dict
        A `ScenarioResult` for each scenario, by its name.

    Raises
    ------
    ConfigError
        For a flight that cannot be flown, or fewer runs than one.
    InputError
        When the cluster cannot be reached or has another version.
    Cancelled
        When `progress` returned False.
    """
    count = study.runs if runs is None else runs
    if count < 1:
        raise ConfigError(f"runs is {count}; expected a whole number, 1 or more")
    names = study.scenarios
    if scheduler is not None:
        return _on_cluster(study, names, count, scheduler, progress)
    results = {}
    for i, name in enumerate(names):
        done = _after(progress, i * count, len(names) * count)
        results[name] = _scenario(study, name, [_job(study, name, 0, count, bound=True, progress=done)])
    return results


def _after(progress: Progress | None, before: int, total: int) -> Progress | None:
    return None if progress is None else lambda done, _: progress(before + done, total)


def _job(
    study: Study, name: str, first: int, count: int, *, bound: bool, progress: Progress | None = None
) -> dict[str, Any]:
    """Make runs `first` to `first + count - 1` of a scenario, and its bound where it is wanted."""
    case = study.case(name)
    try:
        truth = _core.study_truth(case)
        limit = _core.study_bound(case, truth) if bound else None
        runs = _core.run_study(case, truth, first, count, progress)
    except (Cancelled, NumericalError):
        raise
    except Error as error:
        raise ConfigError(f"{study.source or 'study'}: scenario {name}: {error}") from None
    return {
        "runs": runs,
        "bound": limit,
        "times_s": _core.nees_times(case, truth),
    }


def _scenario(study: Study, name: str, parts: list[dict[str, Any]]) -> ScenarioResult:
    arrays: dict[str, Any] = {}
    failures: list[tuple[int, int, str]] = []
    before = 0
    for part in parts:
        runs = part["runs"]
        failures += [(before + row, model, text) for row, model, text in runs["failures"]]
        before += len(runs["seed"])
    for key in parts[0]["runs"]:
        if key != "failures":
            arrays[key] = np.concatenate([part["runs"][key] for part in parts])
    case = study.case(name)
    bound = next(part["bound"] for part in parts if part["bound"] is not None)
    return ScenarioResult(name, tuple(case.models), arrays, failures, bound, np.asarray(parts[0]["times_s"]))


# ---- a cluster ---------------------------------------------------------------------------------------------


def _on_cluster(
    study: Study, names: tuple[str, ...], count: int, scheduler: str, progress: Progress | None
) -> dict[str, ScenarioResult]:
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise InputError(
            "--scheduler needs dask.distributed, which is not installed; pip install 'liealign[batch]'"
        ) from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f'--scheduler is "{scheduler}", where no Dask scheduler answers ({error}); expected an address '
            "such as tcp://10.0.0.5:8786"
        ) from None
    with client:
        _check_workers(client, scheduler)
        jobs = [(name, first) for name in names for first in range(0, count, _RUNS_PER_JOB)]
        futures = [
            client.submit(
                _job, study, name, first, min(_RUNS_PER_JOB, count - first), bound=first == 0, pure=False
            )
            for name, first in jobs
        ]
        done = 0
        for future in as_completed(futures, loop=client.loop):
            done += len(future.result()["runs"]["seed"])
            if progress is not None and progress(done, count * len(names)) is False:
                client.cancel(futures)
                raise Cancelled("cancelled")
        parts = client.gather(futures)
    return {
        name: _scenario(study, name, [part for job, part in zip(jobs, parts, strict=True) if job[0] == name])
        for name in names
    }


def _check_workers(client: Any, scheduler: str) -> None:
    """Refuse a cluster without workers, or with one that has another liealign."""
    try:
        client.wait_for_workers(1, timeout=10)
        versions = client.run(_version)
    except Exception as error:  # whatever a worker raises, or that none is there
        raise InputError(f"{scheduler}: no worker with liealign answers: {error}") from None
    for worker, version in versions.items():
        if version != _core.__version__:
            raise InputError(
                f"the worker {worker} has liealign {version}, this is {_core.__version__}; install the same"
            )


def _version() -> str:
    import liealign.study  # a version that has studies

    return liealign.__version__
