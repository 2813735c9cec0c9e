"""Flights of all kinds from Python and the command line, filters ranked on one, the Monte Carlo over many."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import liealign
import numpy as np
import pytest

from .conftest import LEVER_ARM, ROOT, Cli, MainInProcess, SimulatedCase

KINDS = ("survey", "lines", "circles", "helical", "rectangular", "hover", "parked")


def simulated(kind: str, seed: int = 2, **fields: float) -> liealign.SimulatedFlight:
    drone = liealign.random_flight(kind, seed=seed)
    for name, value in {"rate_hz": 50.0, "oversample": 2, "duration_s": 200.0, **fields}.items():
        setattr(drone, name, value)
    gnss = liealign.GnssErrors(l_ba_b=LEVER_ARM)
    return liealign.simulate_flight(drone, gnss, liealign.make_config({}), seed)


# ---- flights -----------------------------------------------------------------------------------------------


def test_a_seed_draws_the_same_flight_and_another_another() -> None:
    for kind in KINDS:
        one, same = (liealign.random_flight(kind, gentle=True, seed=5) for _ in range(2))
        other = liealign.random_flight(kind, gentle=True, seed=6)
        assert one.kind == kind
        assert one.heading_deg == same.heading_deg != other.heading_deg
        assert 0.1 <= one.acceleration_mps2 <= 0.3


def test_a_kind_that_is_none_is_refused_with_those_that_are() -> None:
    expected = 'kind is "loops"; expected one of: survey, lines, circles'
    with pytest.raises(liealign.Error, match=expected):
        liealign.random_flight("loops", seed=1)
    with pytest.raises(liealign.Error, match=expected):
        liealign.DroneFlight(kind="loops")


def test_the_true_heading_is_that_of_the_truth() -> None:
    flight = simulated("circles")
    truth = flight.truth()
    for k in (0, 4000, 7777):
        off = flight.heading_deg_at(truth["time_s"][k]) - truth["rpy_deg"][k, 2]
        assert abs((off + 180) % 360 - 180) < 1e-9
    with pytest.raises(liealign.Error):
        flight.heading_deg_at(truth["time_s"][-1] + 1)


def test_a_part_of_a_recording_begins_and_ends_where_it_is_told() -> None:
    flight = simulated("lines")
    part = flight.between(1050.0, 1100.0)
    for log in (part.flight.imu(), part.flight.gnss(), part.truth()):
        assert (log["time_s"][0], log["time_s"][-1]) == pytest.approx((1050.0, 1100.0))
    assert len(flight.truth()["time_s"]) == 200 * 50 + 1
    with pytest.raises(liealign.Error, match="nothing of it lies between"):
        flight.between(2000.0, 2100.0)


def test_simulate_writes_a_flight_of_a_kind(cli: Cli) -> None:
    outcome = cli(
        *("simulate", "-o", "out", "--kind", "rectangular", "--gentle", "--seed", "4", "--duration", "400"),
        *("--imu-rate", "50", "--begin", "60", "--end", "120", "--accel-bias", "20000"),
    )
    assert (outcome.code, outcome.err) == (0, "")
    assert "60 s, 3001 IMU samples, 61 fixes" in outcome.out
    time_s = np.loadtxt(cli.folder / "out" / "truth.csv", delimiter=",", skiprows=1, usecols=0)
    assert (time_s[0], time_s[-1]) == (1060.0, 1120.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--gentle"], "--gentle needs --kind"),
        (["--kind", "loops"], '--kind is "loops"; expected one of: survey, lines'),
        (["--begin", "soon"], '--begin is "soon"; expected a number from 0 to 300 [s]'),
        (["--begin", "50", "--end", "40"], '--end is "40"; expected a number from 50 to 300 [s]'),
    ],
)
def test_simulate_refuses(arguments: list[str], message: str, main: MainInProcess, tmp_path: Path) -> None:
    outcome = main("simulate", "-o", "out", *arguments)
    assert outcome.code == 1
    assert message in outcome.err
    assert not list(tmp_path.iterdir())


# ---- ranking -----------------------------------------------------------------------------------------------


def test_the_right_lever_arm_ranks_first(case: SimulatedCase) -> None:
    x, y, z = LEVER_ARM
    arms = [(x + 0.3, y, z), (x, y - 0.3, z), (x, y, z), (x - 0.1, y + 0.1, z)]
    ranks = liealign.rank_by_p_rms(case.simulated.flight, [{"gnss.lever_arm_b_m": arm} for arm in arms])
    assert ranks[0].index == 2
    assert ranks[0].keys["gnss.lever_arm_b_m"] == LEVER_ARM
    assert [rank.p_rms_m for rank in ranks] == sorted(rank.p_rms_m for rank in ranks)
    assert len({rank.fixes for rank in ranks}) == 1
    assert abs(ranks[0].heading_deg - case.alignment.heading_deg) < 0.05


def test_the_right_heading_and_latency_rank_first(case: SimulatedCase) -> None:
    true_deg = case.simulated.heading_deg_at(case.alignment.start_time_s)
    headings = [true_deg + 10, true_deg, true_deg - 170]
    ranks = liealign.rank_by_p_rms(case.simulated.flight, [{}] * 3, heading_deg=headings)
    assert [rank.index for rank in ranks] == [1, 0, 2]
    # A latency moves the true times of the fixes, not which fixes they are.
    candidates = [{"gnss.latency_s": latency} for latency in (-0.1, 0.0, 0.1)]
    ranks = liealign.rank_by_p_rms(case.simulated.flight, candidates, heading_deg=true_deg)
    assert ranks[0].index == 1
    assert {rank.heading_deg for rank in ranks} == {true_deg % 360}


def test_p_rms_is_of_the_fixes_from_first_to_last(case: SimulatedCase) -> None:
    flight = case.simulated.flight
    whole = liealign.rank_by_p_rms(flight, [{}], heading_deg=137.0)[0]
    parts = [
        liealign.rank_by_p_rms(flight, [{}], heading_deg=137.0, first_fix=first, last_fix=last)[0]
        for first, last in ((0, 80), (81, None))
    ]
    assert sum(part.fixes for part in parts) == whole.fixes
    squares = sum(part.fixes * part.p_rms_m**2 for part in parts)
    assert math.isclose(squares, whole.fixes * whole.p_rms_m**2, rel_tol=1e-9)
    with pytest.raises(liealign.Error, match="no fix in the span"):
        liealign.rank_by_p_rms(flight, [{}], heading_deg=137.0, first_fix=5, last_fix=4)


def test_ranking_refuses_and_stops(case: SimulatedCase) -> None:
    flight = case.simulated.flight
    with pytest.raises(liealign.ConfigError, match=r"gnss\.latency_s"):
        liealign.rank_by_p_rms(flight, [{"gnss.latency": 0.1}], heading_deg=137.0)
    with pytest.raises(liealign.InputError, match="has 1 headings; expected one, or 2"):
        liealign.rank_by_p_rms(flight, [{}, {}], heading_deg=[137.0])
    with pytest.raises(liealign.Cancelled):
        liealign.rank_by_p_rms(flight, [{}, {}], heading_deg=137.0, progress=lambda done, total: False)
    assert liealign.rank_by_p_rms(flight, []) == []


# ---- Monte Carlo -------------------------------------------------------------------------------------------


def test_the_alignment_benchmark_runs(tmp_path: Path) -> None:
    figures, page = tmp_path / "figures.json", tmp_path / "page.md"
    done = subprocess.run(
        [
            *(sys.executable, str(ROOT / "benchmarks" / "alignment.py"), "-n", "4", "--jobs", "1"),
            *("--case", "given", "--case", "parked", "--json", str(figures), "--page", str(page)),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    cases = json.loads(figures.read_text(encoding="utf-8"))["cases"]
    assert [trial["kind"] for trial in cases["given"]["trials"]] == list(KINDS[1:5])
    assert cases["given"]["figures"]["rms_deg"] < 0.2
    assert cases["parked"]["figures"]["aligned_percent"] == 0
    assert "parked: met" in done.stdout
    assert "| `given` | " in page.read_text(encoding="utf-8")
