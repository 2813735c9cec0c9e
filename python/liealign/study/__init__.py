"""Monte Carlo studies: the same flight with other sensor errors in each run, several filters compared on it.

study = read_study("STUDY.toml")
result = run_study(study, runs=100)
result["helicoidal"].rmse("smoother", "flight")
write_study("results", study, result)
"""

from __future__ import annotations

from liealign.study.config import Study, make_study, read_study
from liealign.study.files import study_json, write_study
from liealign.study.result import CHANNELS, STAGES, WINDOWS, ScenarioResult
from liealign.study.run import run_study

__all__ = [
    "CHANNELS",
    "STAGES",
    "WINDOWS",
    "ScenarioResult",
    "Study",
    "make_study",
    "read_study",
    "run_study",
    "study_json",
    "write_study",
]
