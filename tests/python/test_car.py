"""Real recordings: a car with RTK that starts at rest, and a drone recorded in the air only."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest

from .conftest import Cli, wrap_deg

LEVER_ARM = (0.0, -0.05, 0.0)
SETTINGS: dict[str, Any] = {"gnss.lever_arm_b_m": LEVER_ARM}
FLAGS = ("--lever-arm", *map(str, LEVER_ARM))


@pytest.fixture(scope="module")
def car(data_dir: Path) -> Path:
    return data_dir / "rtk_car_drive0708"


def columns(path: Path, *names: str) -> list[np.ndarray]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [np.array([float(row[name]) for row in rows]) for name in names]


def test_car_heading_agrees_with_the_course(car: Path, cli: Cli, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = cli("run", "--imu", car / "imu.csv", "--gnss", car / "gnss.csv", *FLAGS, "-o", "out")
    assert (outcome.code, outcome.err) == (0, "")
    alignment = json.loads((cli.folder / "out" / "alignment.json").read_text(encoding="utf-8"))
    assert alignment["verdict"] == "aligned"
    latency_s = alignment["gnss_latency_s"]
    assert -0.23 < latency_s < -0.17  # of the positions' stamps, in the middle of the drive
    velocity_latency_s = alignment["gnss_velocity_latency_s"]
    assert (
        -0.1 < velocity_latency_s < -0.04
    )  # the reference is the course of the velocities, and late as they are
    assert alignment["imu_noise_scale"] > 10.0  # of a sensor some classes below the profile's

    time, heading, north, east = columns(
        cli.folder / "out" / "trajectory.csv", "time_s", "heading_deg", "vn_mps", "ve_mps"
    )
    ref_time, course = columns(car / "ref.csv", "time_s", "heading_deg")
    drift = 1e-6 * alignment["clock_drift_ppm"]
    ref_time = ref_time - velocity_latency_s
    ref_time = ref_time - drift * (ref_time - alignment["gnss_latency_time_s"])
    speed = np.interp(ref_time, time, np.hypot(north, east))
    used = (ref_time > time[0]) & (ref_time < time[-1]) & (speed > 3.0)
    at = np.interp(ref_time[used], time, np.unwrap(heading, period=360.0))
    error = np.abs(wrap_deg(at - course[used]))
    median, p95 = np.median(error), np.quantile(error, 0.95)
    with capsys.disabled():
        std = alignment["heading_std_deg"]
        print(f"\ncar: heading {alignment['heading_deg']:.3f} deg, sigma {std:.3f} deg")
        print(f"car: {used.sum()} courses: median error {median:.2f} deg, 95 % within {p95:.2f} deg")
    assert used.sum() > 1000
    assert median <= 0.5
    assert p95 <= 1.5


@pytest.fixture(scope="module")
def withheld_rms_m(car: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    """Run without every fourth fix; horizontal and vertical rms of the smoothed antenna against those."""
    header, *rows = (car / "gnss.csv").read_text(encoding="utf-8").splitlines()
    withheld = np.arange(len(rows)) % 4 == 3
    kept = [row for row, away in zip(rows, withheld, strict=True) if not away]
    gnss = tmp_path_factory.mktemp("car") / "gnss.csv"
    gnss.write_text("\n".join([header, *kept, ""]), encoding="utf-8")
    flight = liealign.prepare_flight(liealign.read_flight(imu=car / "imu.csv", gnss=gnss, **SETTINGS))
    solution = liealign.process(flight)

    stamp, *position = columns(car / "gnss.csv", "time_s", "lat_deg", "lon_deg", "height_m")
    time = stamp[withheld] - solution.summary["gnss_latency_s"]
    drift = 1e-6 * solution.summary["clock_drift_ppm"]
    time = time - drift * (time - solution.summary["gnss_latency_time_s"])
    inside = (time > flight.t_start_s) & (time < solution.time_s[-1])
    assert inside.sum() > 400
    time, (lat, lon, height) = time[inside], [values[withheld][inside] for values in position]
    antenna = solution.point_e_m(LEVER_ARM)
    found = np.stack([np.interp(time, solution.time_s, antenna[:, i]) for i in range(3)], axis=1)
    error = found - liealign.ecef_from_geodetic(lat, lon, height)
    phi, lam = np.deg2rad(lat), np.deg2rad(lon)
    up = np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=1)
    vertical = (error * up).sum(axis=1)
    horizontal_squared = (error**2).sum(axis=1) - vertical**2
    return float(np.sqrt(np.mean(horizontal_squared))), float(np.sqrt(np.mean(vertical**2)))


def test_car_position_agrees_with_withheld_fixes(
    withheld_rms_m: tuple[float, float], capsys: pytest.CaptureFixture[str]
) -> None:
    horizontal, vertical = withheld_rms_m
    with capsys.disabled():
        print(f"\ncar: withheld fixes: horizontal rms {horizontal:.3f} m, vertical {vertical:.3f} m")
    assert horizontal <= 0.05
    assert vertical <= 0.05


def heading_errors(folder: Path, out: Path, least_speed_mps: float) -> np.ndarray:
    time, heading, north, east = columns(out / "trajectory.csv", "time_s", "heading_deg", "vn_mps", "ve_mps")
    ref_time, reference = columns(folder / "ref.csv", "time_s", "heading_deg")
    speed = np.interp(ref_time, time, np.hypot(north, east))
    used = (ref_time > time[0]) & (ref_time < time[-1]) & (speed >= least_speed_mps)
    return wrap_deg(np.interp(ref_time[used], time, np.unwrap(heading, period=360.0)) - reference[used])


def test_p4rtk_starts_in_the_air_and_is_aligned(
    data_dir: Path, cli: Cli, capsys: pytest.CaptureFixture[str]
) -> None:
    drone = data_dir / "p4rtk_full_dot7"
    outcome = cli("run", "--imu", drone / "imu.csv", "--gnss", drone / "gnss.csv", "-o", "out")
    assert (outcome.code, outcome.err) == (0, "")
    alignment = json.loads((cli.folder / "out" / "alignment.json").read_text(encoding="utf-8"))
    assert (alignment["verdict"], alignment["start"]) == ("aligned", "moving")
    assert "no rest" in alignment["start_reason"]
    error = np.abs(heading_errors(drone, cli.folder / "out", 0.0))
    with capsys.disabled():
        print(f"\np4rtk: mean error {error.mean():.2f} deg, 95 % within {np.quantile(error, 0.95):.2f} deg")
    assert error.mean() <= 1.0
    assert np.quantile(error, 0.95) <= 3.0


def test_apm_aerobatics_have_an_honest_sigma(
    data_dir: Path, cli: Cli, capsys: pytest.CaptureFixture[str]
) -> None:
    plane = data_dir / "apm_x8_testlog2"
    outcome = cli("run", "--imu", plane / "imu.csv", "--gnss", plane / "gnss.csv", "-o", "out")
    assert outcome.code == 0
    alignment = json.loads((cli.folder / "out" / "alignment.json").read_text(encoding="utf-8"))
    (at,) = np.flatnonzero(
        np.isclose(columns(plane / "ref.csv", "time_s")[0], alignment["start_time_s"], atol=0.0101)
    )[:1]
    reference = columns(plane / "ref.csv", "heading_deg")[0][at]
    std = alignment["heading_std_deg"]
    error = np.abs(heading_errors(plane, cli.folder / "out", 8.0))
    with capsys.disabled():
        print(f"\napm: {alignment['verdict']}, sigma {std:.2f} deg, mean error {error.mean():.2f} deg")
    assert abs(wrap_deg(alignment["heading_deg"] - reference)) < 3.0 * np.hypot(std, 1.5)
    assert error.mean() <= 4.0
