"""`liealign simulate --trajectory` and `simulate_along`: a given flight is flown, its heading found again."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest
from liealign import Track
from liealign.cli.knobs import KNOBS

from .conftest import LEVER_ARM, Cli, MainInProcess, SimulatedCase, wrap_deg

HEADER = "time_s,lat_deg,lon_deg,height_m,vn_mps,ve_mps,vd_mps,roll_deg,pitch_deg,heading_deg"


# Largest differences of a flight at 100 Hz from itself, flown along 50 Hz of its truth. Measured 0.017 mm and
# 0.020 mm, of which the digits of the file are 10 um; 0.07 mm/s, 0.7 mm/s (heights have one digit less) and
# 0.002 deg at the take-off.
SAME = {
    **{"horizontal": 5e-5, "down": 5e-5, "vn": 2e-4, "ve": 2e-4, "vd": 2e-3},
    **{"roll": 0.005, "pitch": 0.005, "heading": 1e-4},
}


def thinned(path: Path, step: int, to: Path) -> Path:
    """Every step-th row of a trajectory."""
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    to.write_text("".join(f"{line}\n" for line in (header, *rows[::step])), encoding="utf-8")
    return to


def refused(main: MainInProcess, *arguments: str | Path) -> str:
    outcome = main("simulate", *arguments)
    assert (outcome.code, outcome.out) == (1, ""), outcome
    assert outcome.err.count("\n") == 1, outcome.err
    return outcome.err.removesuffix("\n")


def still(n: int = 20, dt: float = 0.1, **changes: Any) -> dict[str, Any]:
    """Arrays of n points at one place."""
    columns: dict[str, Any] = {
        "time_s": 100.0 + dt * np.arange(n),
        "lat_deg": np.full(n, 48.0),
        "lon_deg": np.full(n, 16.0),
        "height_m": np.full(n, 200.0),
        "v_n_mps": np.zeros((n, 3)),
        "rpy_deg": np.tile([1.0, -2.0, 140.0], (n, 1)),
    }
    return columns | changes


def write_points(path: Path, times: list[float], heading_deg: float = 140.0) -> Path:
    rows = (f"{t},48,16,200,0,0,0,1,-2,{heading_deg}\n" for t in times)
    path.write_text(f"{HEADER}\n{''.join(rows)}", encoding="utf-8")
    return path


# ---- a flight flown again ----------------------------------------------------------------------------------


def test_a_flight_flown_again_is_the_same_flight(case: SimulatedCase, cli: Cli) -> None:
    """Its truth, thinned to 50 Hz, as the trajectory: the new truth is the old one, and the run finds it."""
    thin = thinned(case.folder / "truth.csv", 2, cli.folder / "thin.csv")
    outcome = cli(
        *("simulate", "--trajectory", thin, "-o", "again", "--imu-rate", "100", "--seed", "5"),
        *(
            "--gnss-rate",
            "2",
            "--gnss-velocity",
            "--gnss-latency",
            "0.05",
            "--lever-arm",
            "0.2",
            "-0.1",
            "-0.4",
        ),
    )
    assert (outcome.code, outcome.err) == (0, "")
    again = cli.folder / "again"
    assert "100 s, 10001 IMU samples, 201 fixes" in outcome.out
    values = liealign.config_entries(liealign.read_config(again / "FLIGHT.toml"))
    assert (values["gnss.lever_arm_b_m"], values["gnss.latency_s"]) == ([0.2, -0.1, -0.4], 0.05)

    same = liealign.compare(case.folder / "truth.csv", again / "truth.csv")
    assert same.epochs == 10001
    for name, most in SAME.items():
        assert same[name].max < most, name

    flight = liealign.read_flight(again / "FLIGHT.toml")
    alignment = liealign.align_heading(flight)
    solution = liealign.process(flight, alignment)
    truth = liealign.read_trajectory(again / "truth.csv")
    at = np.searchsorted(truth.time_s, alignment.start_time_s - 1e-6)
    error = float(wrap_deg(np.array(alignment.heading_deg - truth.rpy_deg[at, 2])))
    assert (alignment.verdict, alignment.start) == ("aligned", "static")
    assert alignment.heading_std_deg is not None
    assert abs(error) < 4.0 * alignment.heading_std_deg < 1.0
    assert liealign.compare(truth, solution)["horizontal"].rms < 0.03


def test_begin_and_end_count_from_the_first_point(
    case: SimulatedCase, main: MainInProcess, tmp_path: Path
) -> None:
    thin = thinned(case.folder / "truth.csv", 4, tmp_path / "thin.csv")
    outcome = main(
        "simulate", "--trajectory", thin, "--begin", "30", "--end", "50.5", "-o", "part", "--quiet"
    )
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    part = liealign.read_trajectory(tmp_path / "part" / "truth.csv")
    assert part.time_s[[0, -1]].tolist() == [1030.0, 1050.5]
    assert np.diff(part.time_s) == pytest.approx(0.005, abs=1e-6)  # 200 Hz where no flag says otherwise
    message = refused(main, "--trajectory", thin, "--begin", "101", "-o", "no")
    assert message == '--begin is "101"; expected a number from 0 to 100 [s]'


def test_the_seed_makes_the_noise(case: SimulatedCase, main: MainInProcess, tmp_path: Path) -> None:
    thin = thinned(case.folder / "truth.csv", 4, tmp_path / "thin.csv")
    for folder, seed in (("a", "7"), ("b", "7"), ("c", "8")):
        main("simulate", "--trajectory", thin, "--imu-rate", "50", "--seed", seed, "--quiet", "-o", folder)
    for name in ("imu.csv", "gnss.csv", "truth.csv"):
        a, b, c = ((tmp_path / folder / name).read_bytes() for folder in "abc")
        assert a == b
        assert (a == c) == (name == "truth.csv")


# ---- the API -----------------------------------------------------------------------------------------------


def test_a_track_comes_from_a_file_arrays_or_a_solution(case: SimulatedCase, tmp_path: Path) -> None:
    thin = thinned(case.folder / "truth.csv", 5, tmp_path / "thin.csv")
    track = liealign.read_trajectory(thin)
    arrays = {
        name: getattr(track, name)
        for name in ("time_s", "lat_deg", "lon_deg", "height_m", "v_n_mps", "rpy_deg")
    }
    keys = {"imu.model": "bmi088"}
    flights = [
        liealign.simulate_along(
            source, config=config, gnss=liealign.GnssErrors(l_ba_b=LEVER_ARM), rate_hz=50.0
        )
        for source, config in (
            (thin, keys),
            (str(thin), keys),
            (track, liealign.make_config(keys)),
            (arrays, keys),
        )
    ]
    for flight in flights:
        assert flight.flight.config == flights[0].flight.config
        np.testing.assert_array_equal(
            flight.flight.imu()["f_ib_b_mps2"], flights[0].flight.imu()["f_ib_b_mps2"]
        )
        np.testing.assert_array_equal(flight.flight.gnss()["lat_deg"], flights[0].flight.gnss()["lat_deg"])
    values = liealign.config_entries(flights[0].flight.config)
    assert (values["gnss.lever_arm_b_m"], values["imu.model"]) == (list(LEVER_ARM), "bmi088")

    found = liealign.simulate_along(case.solution, oversample=2)
    assert found.truth()["time_s"][0] == case.solution.time_s[0]
    assert liealign.compare(case.solution, Track.of(found.truth()))["horizontal"].max < 0.01
    with pytest.raises(TypeError, match="a list is no trajectory"):
        liealign.simulate_along([1, 2, 3])  # type: ignore[arg-type]


def test_an_imu_without_errors_reads_gravity_and_the_turning_earth() -> None:
    """At rest, by hand: WGS 84 normal gravity at 48 deg and 200 m, 15.041 deg/h."""
    quiet = liealign.ImuErrorSizes(gyro_turn_on_deg_h=0.0, accel_turn_on_ug=0.0, noise_scale=0.0)
    imu = liealign.simulate_along(still(), imu=quiet).flight.imu()
    assert imu["time_s"].size == 381
    force, rate = (np.linalg.norm(imu[name], axis=1) for name in ("f_ib_b_mps2", "omega_ib_b_rps"))
    assert force == pytest.approx(9.8081, abs=2e-4)
    assert rate == pytest.approx(7.292115e-5, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n": 3}, "track: it has 3 points; expected at least 4 for a spline"),
        (
            {"dt": 2.1},
            r"track: point 1 \(102.100000 s\): comes 2.100000 s after the one before; expected at most 2",
        ),
        ({"height_m": np.full(20, np.nan)}, r"track: point 0 \(100.000000 s\): a value is not finite"),
        (
            {"rpy_deg": np.tile([0.0, 89.7, 0.0], (20, 1))},
            "the pitch is 89.700000 deg; expected -89.5 to 89.5",
        ),
        ({"rpy_deg": np.zeros(20)}, r"rpy_deg: expected an array of shape \(20, 3\), one row for each time"),
        ({"lat_deg": np.zeros(19)}, r"lat_deg: expected an array of shape \(20,\), one row for each time"),
    ],
)
def test_points_that_are_no_flight_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(liealign.InputError, match=message):
        liealign.simulate_along(still(**changes))


def test_a_rate_out_of_range_is_refused() -> None:
    with pytest.raises(liealign.Error, match=r"rate_hz is 0\.500000; expected 1 to 10000"):
        liealign.simulate_along(still(), rate_hz=0.5)
    with pytest.raises(liealign.Error, match="oversample is 0; expected 1 or more"):
        liealign.simulate_along(still(), oversample=0)


# ---- what the command refuses ------------------------------------------------------------------------------

OF_A_DRONE = [
    *(
        (knob.name, *knob.default.split())
        for knob in KNOBS
        if knob.owner is liealign.DroneFlight and knob.name != "--imu-rate"
    ),
    ("--kind", "lines"),
    ("--gentle",),
]


@pytest.mark.parametrize("flag", OF_A_DRONE, ids=lambda flag: flag[0])
def test_flags_of_a_drone_flight_are_refused(
    flag: tuple[str, ...], main: MainInProcess, tmp_path: Path
) -> None:
    points = write_points(tmp_path / "points.csv", [0, 0.1, 0.2, 0.3])
    assert refused(main, "--trajectory", points, *flag, "-o", "out") == (
        f"{flag[0]} is of a flight made up; with --trajectory the file is flown; leave one out"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["points.csv"]


def test_files_that_cannot_be_flown_are_named(main: MainInProcess, tmp_path: Path) -> None:
    assert refused(main, "--trajectory", "none.csv", "-o", "out") == (
        "none.csv: cannot be read: No such file or directory"
    )
    write_points(tmp_path / "gap.csv", [0, 1, 2, 5, 6])
    assert refused(main, "--trajectory", "gap.csv", "-o", "out").startswith(
        "gap.csv: point 3 (5.000000 s): comes 3.000000 s after the one before; expected at most 2"
    )
    write_points(tmp_path / "long.csv", [0, 3000, 6000, 9000])
    assert refused(main, "--trajectory", "long.csv", "-o", "out") == (
        "--trajectory long.csv of 9000 s at --imu-rate 200 makes 1800000 samples; expected at most 1000000; "
        "shorten the flight or lower the rate"
    )
    assert not (tmp_path / "out").exists()


def test_the_trajectory_is_not_written_over(main: MainInProcess, tmp_path: Path) -> None:
    write_points(tmp_path / "truth.csv", [0, 0.1, 0.2, 0.3])
    before = (tmp_path / "truth.csv").read_bytes()
    assert refused(main, "--trajectory", "truth.csv", "-o", tmp_path) == (
        "truth.csv: would be written over; choose another folder (-o DIR)"
    )
    assert (tmp_path / "truth.csv").read_bytes() == before


# ---- real recordings ---------------------------------------------------------------------------------------


def columns(path: Path, *names: str) -> list[np.ndarray]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [np.array([float(row[name]) for row in rows]) for name in names]


def heading_error_and_sigma_deg(simulated: liealign.SimulatedFlight, start: str) -> tuple[float, float]:
    """Align the simulated flight: the error at its start, and the sigma stated."""
    alignment = liealign.align_heading(simulated.flight)
    assert (alignment.verdict, alignment.start) == ("aligned", start)
    assert alignment.heading_std_deg is not None
    error = alignment.heading_deg - simulated.heading_deg_at(alignment.start_time_s)
    return float(wrap_deg(np.array(error))), alignment.heading_std_deg


def test_a_drone_recorded_in_the_air_is_flown_again(
    data_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Position by the drone's RTK and attitude by its autopilot, at 10 Hz; its heights step by 0.1 m."""
    folder = data_dir / "p4rtk_full_dot7"
    time, lat, lon, height = columns(folder / "gnss.csv", "time_s", "lat_deg", "lon_deg", "height_m")
    ref_time, *rpy = columns(folder / "ref.csv", "time_s", "roll_deg", "pitch_deg", "heading_deg")
    assert (time == ref_time).all()
    width = 21
    height = np.convolve(np.pad(height, width // 2, mode="edge"), np.full(width, 1.0 / width), mode="valid")
    recorded = {
        **{"time_s": time, "lat_deg": lat, "lon_deg": lon, "height_m": height},
        **{"rpy_deg": np.stack(rpy, axis=1), "v_n_mps": np.zeros((time.size, 3))},
    }
    gnss = liealign.GnssErrors(rate_hz=5.0, l_ba_b=LEVER_ARM)
    simulated = liealign.simulate_along(recorded, gnss=gnss, seed=2, rate_hz=100.0)

    truth = simulated.truth()
    assert (truth["time_s"][0], truth["time_s"][-1]) == (time[0], pytest.approx(time[-1], abs=1e-6))
    at = np.rint((time - time[0]) * 100.0).astype(int)
    placed = np.linalg.norm(truth["p_eb_e_m"][at] - liealign.ecef_from_geodetic(lat, lon, height), axis=1)
    assert placed.max() < 1e-3
    assert np.abs(wrap_deg(truth["rpy_deg"][at] - recorded["rpy_deg"])).max() < 1e-4
    error, sigma = heading_error_and_sigma_deg(simulated, "moving")
    with capsys.disabled():
        print(f"\np4rtk again: heading error {error:.3f} deg, sigma {sigma:.3f} deg")
    assert abs(error) < 4.0 * sigma < 1.0


def test_a_car_drive_is_driven_again(data_dir: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What came of the recording, at 50 Hz, with the sensors of TAES table I in place of its own."""
    folder = data_dir / "rtk_car_drive0708"
    flight = liealign.read_flight(
        imu=folder / "imu.csv", gnss=folder / "gnss.csv", **{"output.rate_hz": 50.0}
    )
    driven = liealign.process(flight, keep_events=False)
    gnss = liealign.GnssErrors(rate_hz=2.0, l_ba_b=LEVER_ARM)
    simulated = liealign.simulate_along(driven, gnss=gnss, seed=3, rate_hz=100.0)
    same = liealign.compare(driven, Track.of(simulated.truth()))
    error, sigma = heading_error_and_sigma_deg(simulated, "static")
    with capsys.disabled():
        print(f"\ncar driven again: heading error {error:.3f} deg, sigma {sigma:.3f} deg")
    assert max(same["horizontal"].max, same["down"].max) < 0.002  # measured 0.4 mm, and 0.013 deg
    assert same["heading"].max < 0.05
    assert abs(error) < 4.0 * sigma < 1.0
