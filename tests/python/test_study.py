"""Monte Carlo studies: STUDY.toml, the command, its files, the cluster, and the statistics of the results."""

from __future__ import annotations

import json
from pathlib import Path

import liealign
import numpy as np
import pytest
from liealign import Cancelled, ConfigError
from liealign.study import CHANNELS, ScenarioResult, Study, make_study, read_study, run_study, write_study
from liealign.study.result import chi_square_band
from scipy import stats

from .conftest import Cli

TOML = """
[study]
runs = 2
start = "drawn"
biases = "random_walk"
[flight]
rate_hz = 50.0
oversample = 1
duration_s = 80.0
parked_before_s = 10.0
parked_after_s = 5.0
[scenario.round]
kind = "circles"
[scenario.square]
kind = "rectangular"
line_length_m = 30.0
[errors.gnss]
l_ba_b = [0.1, -0.05, -0.3]
[errors.imu]
accel_turn_on_ug = 400.0
[gnss]
outlier = "off"
"""


@pytest.fixture(scope="module")
def toml(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "STUDY.toml"
    path.write_text(TOML, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def study(toml: Path) -> Study:
    return read_study(toml)


@pytest.fixture(scope="module")
def results(study: Study) -> dict[str, ScenarioResult]:
    return run_study(study, 6)


def csv_files(folder: Path) -> dict[str, str]:
    return {name: (folder / name).read_text(encoding="utf-8") for name in ("runs.csv", "nees.csv")}


def test_study_sets_the_fields_that_the_sections_name(study: Study) -> None:
    assert study.scenarios == ("round", "square")
    case = study.case("square")
    assert (case.flight.kind, case.flight.rate_hz, case.flight.line_length_m) == ("rectangular", 50.0, 30.0)
    assert case.imu.accel_turn_on_ug == 400.0
    np.testing.assert_array_equal(case.gnss.l_ba_b, [0.1, -0.05, -0.3])
    assert case.models == ["lie", "mekf", "euler"]
    assert study.case("round").flight.line_length_m != 30.0
    assert study.case("round").seed != case.seed


def test_study_sets_the_errors_of_sensors_and_of_what_is_typed_in() -> None:
    case = make_study(
        {
            "scenario.a.kind": "circles",
            "errors.gnss.correlated_std_ned_m": [1.0, 1.0, 2.0],
            "errors.gnss.velocity_latency_s": 0.3,
            "errors.gnss.heading": True,
            "errors.imu.turn_on": "fixed",
            "errors.imu.gyro_vibration_deg_s": [5.0, 5.0, 1.0],
            "errors.typed_in.lever_arm_std_m": 0.05,
        }
    ).case("a")
    np.testing.assert_array_equal(case.gnss.correlated_std_ned_m, [1.0, 1.0, 2.0])
    assert (case.gnss.velocity_latency_s, case.gnss.heading) == (0.3, True)
    assert case.imu.turn_on == "fixed"
    np.testing.assert_array_equal(case.imu.gyro_vibration_deg_s, [5.0, 5.0, 1.0])
    assert (case.typed_in.lever_arm_std_m, case.typed_in.latency_std_s) == (0.05, 0.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("[study]\nstrat = 'drawn'", 'STUDY.toml:2:1: unknown key "study.strat"; did you mean "study.start"'),
        ("[study]\nflight = 1", 'unknown key "study.flight"'),
        ("[study]\nruns = 0", "STUDY.toml:2:1: study.runs is 0; expected a whole number, 1 or more"),
        ("[study]\nmodels = 'lie'", 'study.models is "lie"; expected a list of texts'),
        ("[flight]\nspeed_mps = 'fast'", 'STUDY.toml:2:1: flight.speed_mps is "fast"; expected a number'),
        ("[flight]\nclockwise = 1", "flight.clockwise is 1; expected true or false"),
        ("[flight]\nkind = 'loops'", 'kind is "loops"; expected one of: survey'),
        ("[errors.gnss]\nstd_ned_m = [1.0]", "errors.gnss.std_ned_m is [1.0]; expected three numbers"),
        ("[errors.imu]\nturn_on = 'maybe'", "STUDY.toml:2:1: scenario a: study: imu.turn_on is"),
        ("[errors.gnss]\nvelocity_latency_s = 'auto'", 'velocity_latency_s is "auto"; expected a number'),
        ("[errors.typed_in]\nlever_arm_m = 1", 'unknown key "errors.typed_in.lever_arm_m"'),
        ("[errors.baro]\nstd_m = 1.0", "errors.baro.std_m is 1.0; expected the sections"),
        ("[study]\nrate_hz = -1", "STUDY.toml:2:1: scenario a: study: rate_hz is -1"),
        ("[study]\nstart = 'guessed'", "STUDY.toml:2:1: scenario a: study: start is"),
        ("[study]\nmodels = ['ukf']", 'models has "ukf"'),
        ("[study]\nheading_error_deg = nan", "heading_error_deg"),
        ("[errors.gnss]\nstd_ned_m = [true, 1, 1]", "expected three numbers"),
        ("[gnss]\nlever_arm_b_m = [0, 0, 1]", "the lever arm is errors.gnss.l_ba_b"),
        ("[imu]\ngyro_unit = 'dps'", "STUDY.toml:2:1: imu.gyro_unit does not belong to a study"),
        ("[baro]\nfile = 'b.csv'", "STUDY.toml:2:1: baro.file does not belong to a study"),
        ("[output]\nfiltered = true", "output.filtered does not belong to a study"),
        ("[filter]\nmodel = 'euler'", "the filters are study.models"),
        ("[filter]\ngravity = 'flat'", "STUDY.toml:2:1: filter.gravity"),
        ("[imu]\nmodle = 'adis16495'", 'unknown key "imu.modle"; did you mean "imu.model"'),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_place(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "STUDY.toml"
    path.write_text(f"{line}\n[scenario.a]\nkind = 'circles'\n".replace("'", '"'), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_study(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_section_without_a_key_is_a_scenario(tmp_path: Path) -> None:
    path = tmp_path / "STUDY.toml"
    path.write_text('[flight]\nkind = "circles"\n[scenario.plain]\n[scenario.fast]\nspeed_mps = 8.0\n')
    study = read_study(path)
    assert study.scenarios == ("plain", "fast")
    assert study.case("plain").flight.kind == study.case("fast").flight.kind == "circles"


def test_other_keys_leave_order_and_seeds_as_they_are(study: Study) -> None:
    other = make_study({"scenario.round.speed_mps": 5.0, "scenario.last.kind": "lines"}, base=study)
    assert other.scenarios == (*study.scenarios, "last")
    assert [other.case(name).seed for name in study.scenarios] == [1, 1_000_001]
    assert other.case("round").flight.speed_mps == 5.0


def test_the_filters_are_told_the_latency_of_the_fixes() -> None:
    late = make_study({"scenario.a.kind": "circles", "errors.gnss.latency_s": 0.2, "study.models": ["lie"]})
    nis = run_study(make_study({"flight.rate_hz": 50.0, "flight.duration_s": 120.0}, base=late), 1)["a"].nis(
        "lie"
    )
    assert 2.0 < nis.mean < 4.0


def test_a_flight_that_no_run_can_start_is_refused() -> None:
    never_at_rest = make_study(
        {
            "scenario.a.kind": "circles",
            "flight.rate_hz": 50.0,
            "flight.duration_s": 120.0,
            "align.start": "static",
            "rest.min_duration_s": 200.0,
        }
    )
    with pytest.raises(ConfigError, match=r"for the bound, fails: align\.start is"):
        run_study(never_at_rest, 1)


def test_a_parked_scenario_without_fixes_has_what_there_is(tmp_path: Path, cli: Cli) -> None:
    toml = tmp_path / "STUDY.toml"
    toml.write_text(
        '[study]\nstart = "drawn"\nmodels = ["lie"]\n[scenario.a]\nkind = "parked"\n'
        "[flight]\nrate_hz = 20.0\nduration_s = 30.0\n[errors.gnss]\nrate_hz = 0.0001\n"
    )
    outcome = cli("montecarlo", str(toml), "-n", "1", "-o", "out")
    assert (outcome.code, outcome.err) == (0, "")
    assert "over the whole run" in outcome.out
    assert (tmp_path / "out" / "runs.csv").is_file()


@pytest.mark.parametrize("runs", [0, -1])
def test_fewer_runs_than_one_are_refused(study: Study, runs: int) -> None:
    with pytest.raises(ConfigError, match="expected a whole number, 1 or more"):
        run_study(study, runs)


def test_a_study_without_scenario_or_with_one_that_cannot_fly_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no \[scenario.NAME\]"):
        make_study({"study.runs": 3})
    short = make_study({"scenario.a.kind": "circles", "flight.duration_s": 20.0})
    with pytest.raises(ConfigError, match="scenario a: drone flight: duration_s is 20"):
        run_study(short, 1)


def test_the_command_writes_what_the_api_gives(
    toml: Path, tmp_path: Path, study: Study, results: dict[str, ScenarioResult], cli: Cli
) -> None:
    outcome = cli("montecarlo", str(toml), "-n", "6", "-o", str(tmp_path / "out"))
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.startswith("scenario  round, 6 runs")
    assert "LIE-EKS" in outcome.out and "MEKS" in outcome.out and "NIS" in outcome.out
    write_study(tmp_path / "api", study, results)
    assert csv_files(tmp_path / "out") == csv_files(tmp_path / "api")
    document = json.loads((tmp_path / "out" / "montecarlo.json").read_text())
    heading = document["scenarios"]["square"]["models"]["mekf"]["smoother"]["rmse"]["flight"]["heading_deg"]
    assert heading == results["square"].rmse("smoother", "flight")[1, CHANNELS.index("heading_deg")]
    rows = csv_files(tmp_path / "api")["runs.csv"].splitlines()
    assert len(rows) == 1 + 2 * 6 * 3 * 2 * 2


def test_more_runs_leave_the_first_as_they_were(study: Study, results: dict[str, ScenarioResult]) -> None:
    few = run_study(study, 2)["square"]
    np.testing.assert_array_equal(few.runs["squares"], results["square"].runs["squares"][:2])
    np.testing.assert_array_equal(few.runs["nees"], results["square"].runs["nees"][:2])


@pytest.mark.parametrize("number", ["0", "-3", "many", "1.5"])
def test_the_number_of_runs_must_be_one(toml: Path, number: str, cli: Cli) -> None:
    outcome = cli("montecarlo", str(toml), f"--runs={number}")
    assert outcome.code == 1
    assert outcome.err == f'--runs is "{number}"; expected a whole number, 1 or more\n'


def test_a_progress_that_says_no_stops_the_runs(study: Study) -> None:
    seen: list[tuple[int, int]] = []

    def stop(done: int, total: int) -> bool:
        seen.append((done, total))
        return False

    with pytest.raises(Cancelled, match="cancelled"):
        run_study(study, 8, progress=stop)
    assert seen == [(1, 16)]


# ---- the statistics ----------------------------------------------------------------------------------------


def test_rmse_and_sigma_are_roots_of_means_over_all_epochs(results: dict[str, ScenarioResult]) -> None:
    r = results["round"]
    assert r.count == 6 and not r.failures
    squares, epochs = r.runs["squares"][:, 0, 1, 1, 2], r.runs["epochs"][:, 1]
    assert r.rmse("smoother", "flight")[0, 2] == pytest.approx(np.sqrt(squares.sum() / epochs.sum()))
    # Smoothed is better than filtered, and both are near what they say and near the bound.
    for stage in ("filter", "smoother"):
        position = CHANNELS.index("position_m")
        rmse, sigma = r.rmse(stage, "flight")[0, position], r.sigma(stage, "flight")[0, position]
        assert rmse == pytest.approx(sigma, rel=0.2)
        assert sigma == pytest.approx(r.limit(stage, "flight")[position], rel=0.02)
    assert (r.rmse("smoother", "flight")[:, :7] < r.rmse("filter", "flight")[:, :7]).all()


def test_a_failed_filter_is_left_out_of_its_own_numbers_alone(results: dict[str, ScenarioResult]) -> None:
    r = results["round"]
    broken = {name: np.array(values) for name, values in r.runs.items()}
    broken["squares"][2, 1] = 1e9
    with_failure = ScenarioResult(r.name, r.models, broken, [(2, 1, "failed")], r.bound, r.times_s)
    kept = [0, 1, 3, 4, 5]
    expected = np.sqrt(r.runs["squares"][kept, 1, 0, 0].sum(axis=0) / r.runs["epochs"][kept, 0].sum())
    np.testing.assert_allclose(with_failure.rmse("filter", "whole")[1], expected)
    np.testing.assert_array_equal(with_failure.rmse("filter", "whole")[0], r.rmse("filter", "whole")[0])
    ratio = with_failure.paired_ratio("filter", "whole", "roll_deg", "lie", "mekf")
    assert np.isnan(ratio.low)  # six runs are too few for an interval
    squares = r.runs["squares"][kept][:, :2, 0, 0, 0].sum(axis=0)
    assert ratio.ratio == pytest.approx(np.sqrt(squares[0] / squares[1]))


@pytest.mark.parametrize("degrees", [30.0, 450.0, 4500.0])
def test_chi_square_band_is_that_of_the_distribution(degrees: float) -> None:
    expected = stats.chi2.ppf([0.025, 0.975], degrees) / degrees
    np.testing.assert_allclose(chi_square_band(degrees), expected, rtol=1.5e-3)


def test_nees_and_nis_of_the_matched_noise_lie_in_their_bands() -> None:
    one = make_study(
        {
            **{key: value for key, value, *_ in make_study({"scenario.a.kind": "circles"}).entries},
            "study.start": "drawn",
            "study.biases": "random_walk",
            "study.models": ["lie"],
            "gnss.outlier": "off",
            "flight.rate_hz": 50.0,
            "flight.oversample": 1,
            "flight.duration_s": 80.0,
            "flight.parked_before_s": 10.0,
            "flight.parked_after_s": 5.0,
        }
    )
    r = run_study(one, 40)["a"]
    for stage in ("filter", "smoother"):
        band = r.nees(stage, "lie")
        wide = 1.5 * (band.high - band.expected)  # 99.7 %
        assert abs(band.mean - 15.0) < wide, band
        assert r.nees_share_inside(stage, "lie") > 0.6
    nis = r.nis("lie")
    assert abs(nis.mean - 3.0) < 1.5 * (nis.high - 3.0)
    for ratio in (
        r.rmse_over_limit("smoother", "flight", "position_m"),
        r.paired_ratio("filter", "flight", "roll_deg", "lie", "lie"),
    ):
        assert ratio.low <= ratio.ratio <= ratio.high


# ---- a cluster ---------------------------------------------------------------------------------------------


def test_runs_of_a_cluster_are_those_made_here(
    study: Study, results: dict[str, ScenarioResult], tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        seen: list[int] = []
        far = run_study(
            study, 6, scheduler=cluster.scheduler_address, progress=lambda done, total: seen.append(done)
        )
    write_study(tmp_path / "far", study, far)
    write_study(tmp_path / "here", study, results)
    assert csv_files(tmp_path / "far") == csv_files(tmp_path / "here")
    assert seen[-1] == 12


def test_a_scheduler_that_does_not_answer_is_bad_input(toml: Path, cli: Cli) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    outcome = cli("montecarlo", str(toml), "--scheduler", "nowhere")
    assert outcome.code == 1
    assert '--scheduler is "nowhere"' in outcome.err


# ---- along a file ------------------------------------------------------------------------------------------


def test_a_scenario_flies_along_a_trajectory_file(tmp_path: Path) -> None:
    flown = liealign.simulate_flight(
        liealign.DroneFlight(rate_hz=50.0, duration_s=80.0, parked_before_s=10.0, parked_after_s=5.0),
        liealign.GnssErrors(),
        liealign.make_config(),
        seed=1,
    )
    liealign.write_flight(str(tmp_path / "flight"), flown)
    (tmp_path / "STUDY.toml").write_text(
        TOML + '[scenario.again]\ntrajectory = "flight/truth.csv"\n', encoding="utf-8"
    )
    study = read_study(tmp_path / "STUDY.toml")
    again = run_study(study, 3)["again"]
    assert not again.failures
    # truth.csv has 10 um and 1e-6 deg: sensors and errors are those of a flight like the others.
    position = CHANNELS.index("position_m")
    assert again.rmse("smoother", "flight")[0, position] < 0.012
    assert again.rmse("smoother", "flight")[0, position] == pytest.approx(
        again.limit("smoother", "flight")[position], rel=0.3
    )
    assert again.times_s[-1] == pytest.approx(flown.truth()["time_s"][0] + 80.0)


def test_a_trajectory_file_that_is_not_there_is_bad_input(tmp_path: Path, cli: Cli) -> None:
    toml = tmp_path / "STUDY.toml"
    toml.write_text('[scenario.a]\ntrajectory = "nowhere.csv"\n', encoding="utf-8")
    outcome = cli("montecarlo", str(toml))
    assert outcome.code == 1
    assert "nowhere.csv: cannot be read" in outcome.err
