"""Output where it is wanted: formats, span, rate, another point; SBET read back by its layout alone."""

from __future__ import annotations

import csv
import json
import struct
from pathlib import Path

import liealign
import numpy as np
import pytest

from .conftest import Cli, Files, MainInProcess

SBET_SIDE = "trajectory.sbet.json"


def read_csv(path: Path) -> dict[str, np.ndarray]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def records(path: Path, doubles: int) -> np.ndarray:
    """All records of a file of little-endian doubles; the size is whole."""
    content = path.read_bytes()
    assert len(content) % (8 * doubles) == 0
    return np.array(list(struct.iter_unpack(f"<{doubles}d", content)))


def run(main: Cli, *arguments: str | Path) -> Path:
    outcome = main("run", "FLIGHT.toml", *arguments, "-o", "out", "--quiet")
    assert (outcome.code, outcome.err) == (0, "")
    return main.folder / "out"


def test_sbet_and_smrmsg_by_their_published_layout(files: Files, main: MainInProcess) -> None:
    """17 doubles: time, lat, lon, alt, v 3, roll, pitch, platform heading, wander, a 3, rates 3."""
    out = run(main, "--format", "csv", "sbet")
    rows, sbet = read_csv(out / "trajectory.csv"), records(out / "trajectory.sbet", 17)
    smrmsg = records(out / "trajectory.smrmsg", 10)
    assert len(sbet) == len(smrmsg) == len(rows["time_s"]) > 1000

    def same(column: np.ndarray, name: str, decimals: int) -> None:
        np.testing.assert_allclose(column, rows[name], rtol=0, atol=0.51 * 10.0**-decimals, err_msg=name)

    same(sbet[:, 0], "time_s", 6)
    same(np.rad2deg(sbet[:, 1]), "lat_deg", 11)
    same(np.rad2deg(sbet[:, 2]), "lon_deg", 11)
    same(sbet[:, 3], "height_m", 5)
    for column, name in enumerate(("vn_mps", "ve_mps", "vd_mps"), start=4):
        same(sbet[:, column], name, 6)
    assert not sbet[:, 10].any(), "without wander angle platform heading is true heading"
    for column, name in enumerate(("roll_deg", "pitch_deg", "heading_deg"), start=7):
        same(np.rad2deg(sbet[:, column]), name, 6)
    same(smrmsg[:, 0], "time_s", 6)
    for column, name in enumerate(("n_m", "e_m", "d_m"), start=1):
        same(smrmsg[:, column], f"std_{name}", 5)
    for column, name in enumerate(
        ("vn_mps", "ve_mps", "vd_mps", "roll_deg", "pitch_deg", "heading_deg"), start=4
    ):
        same(smrmsg[:, column] / (60 if column > 6 else 1), f"std_{name}", 6)

    # At rest nothing accelerates and nothing turns: gravity and the Earth's rate are taken off.
    rest = sbet[:, 0] < sbet[0, 0] + 5.0
    assert np.abs(sbet[rest, 11:14].mean(axis=0)).max() < 0.01
    assert np.abs(sbet[rest, 14:17].mean(axis=0)).max() < 1e-4
    assert np.abs(sbet[:, 11:14]).max() > 1.0, "the flight moves"

    side = json.loads((out / SBET_SIDE).read_text(encoding="utf-8"))
    assert (side["gps_week"], side["time_scale"], side["records"]) == (None, "GPST", len(sbet))
    assert (side["wander_angle_rad"], side["reference_point_b_m"]) == (0.0, [0.0, 0.0, 0.0])
    assert {"datum", "height", "velocity_axes", "boresight_deg", "acceleration", "attitude"} <= side.keys()


def test_another_format_replaces_the_files_of_the_first(files: Files, main: MainInProcess) -> None:
    out = run(main, "--format", "csv,sbet", "--filtered")
    assert {"trajectory.csv", "trajectory.sbet", SBET_SIDE, "filtered.csv"} <= {p.name for p in out.iterdir()}
    outcome = main("run", "--format", "sbet", "FLIGHT.toml", "-o", "out")
    assert outcome.code == 0 and "out/trajectory.sbet, summary.json" in outcome.out
    left = {path.name for path in out.iterdir()}
    assert "trajectory.sbet" in left and not {"trajectory.csv", "filtered.csv"} & left


def test_span_and_rate(files: Files, main: MainInProcess) -> None:
    with (files.folder / "FLIGHT.toml").open("a", encoding="utf-8") as toml:
        toml.write("[output]\nrate_hz = 10.0\n")
    out = run(main, "--start-time", "1030", "--stop-time", "1040")
    time_s = read_csv(out / "trajectory.csv")["time_s"]
    np.testing.assert_allclose(time_s, np.arange(1030.0, 1040.05, 0.1), atol=0.0101)
    np.testing.assert_array_equal(read_csv(out / "biases.csv")["time_s"], time_s)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (summary["epochs"], summary["begin_time_s"]) == (time_s.size, time_s[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--format", "las"], '--format: output.formats is ["las"]; expected a list of "csv", "sbet"'),
        (["--format", "csv", "sbt"], '--format: output.formats is ["csv", "sbt"]; '),
        (["--start-time", "noon"], '--start-time: output.start_time_s is "noon"; expected a finite number'),
        (
            ["--start-time", "5000"],
            "output.start_time_s and output.stop_time_s ask for 5000.000 s to ",
        ),
        (
            ["--start-time", "1050", "--stop-time", "1040"],
            "output.start_time_s and output.stop_time_s ask for 1050",
        ),
    ],
)
def test_refused(files: Files, main: MainInProcess, arguments: list[str], message: str) -> None:
    outcome = main("run", "FLIGHT.toml", *arguments, "-o", "out")
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith(message), outcome.err


def test_camera_pose(files: Files, main: MainInProcess) -> None:
    """A camera that looks down, its x axis to the right, 15 cm below the IMU."""
    imu = read_csv(run(main) / "trajectory.csv")
    with (files.folder / "FLIGHT.toml").open("a", encoding="utf-8") as toml:
        toml.write("[output]\nreference_point_b_m = [0.0, 0.0, 0.15]\nboresight_deg = [0.0, 0.0, 90.0]\n")
    camera = read_csv(run(main) / "trajectory.csv")
    level = np.hypot(imu["roll_deg"], imu["pitch_deg"]) < 1.0
    assert level.sum() > 100
    np.testing.assert_allclose((camera["height_m"] - imu["height_m"])[level], -0.15, atol=1e-3)
    turned = (camera["heading_deg"] - imu["heading_deg"] - 90.0 + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(turned[level], 0.0, atol=0.05)
    np.testing.assert_allclose(camera["roll_deg"][level], imu["pitch_deg"][level], atol=0.05)


def pos_lines(gnss: list[str], week: int) -> list[str]:
    """The fixes of gnss.csv as RTKLIB writes them, with week and seconds of the week."""
    header = (
        "%  GPST  latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne(m) sdeu(m) sdun(m)"
    )
    lines = ["% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float)", header]
    for row in csv.DictReader(gnss):
        time, lat, lon, height = (row[name] for name in ("time_s", "lat_deg", "lon_deg", "height_m"))
        n, e, d = (row[name] for name in ("std_n_m", "std_e_m", "std_d_m"))
        lines.append(f"{week} {time} {lat} {lon} {height} {row['fix']} 9 {n} {e} {d} 0.0 0.0 0.0")
    return lines


def test_week_comes_from_the_pos_file_and_may_not_contradict_it(files: Files, main: MainInProcess) -> None:
    files.write("gnss.pos", pos_lines(files.lines("gnss.csv"), week=2238))
    out = run(main, "--gnss", "gnss.pos", "--format", "sbet")
    assert json.loads((out / SBET_SIDE).read_text(encoding="utf-8"))["gps_week"] == 2238
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["gps_week"] == 2238
    toml = files.folder / "FLIGHT.toml"
    toml.write_text(
        toml.read_text(encoding="utf-8").replace("[gnss]", "[gnss]\nweek = 2237"), encoding="utf-8"
    )
    outcome = main("run", "FLIGHT.toml", "--gnss", "gnss.pos", "-o", "out")
    assert outcome.code == 1
    assert outcome.err.startswith("gnss.pos: the first record is of GPS week 2238, gnss.week is 2237; ")


def test_files_of_one_run_replace_those_of_another_together_or_not_at_all(
    files: Files, main: MainInProcess, tmp_path: Path
) -> None:
    out = run(main)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    (out / "summary.json.part").mkdir()  # the eighth file cannot be written
    outcome = main("run", "FLIGHT.toml", "--imu-noise-scale", "2", "-o", "out")
    assert outcome.code == 1 and outcome.err.startswith("out/summary.json: cannot be written")
    (out / "summary.json.part").rmdir()
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_api_gives_the_wanted_point(files: Files) -> None:
    flight = liealign.read_flight(
        files.folder / "FLIGHT.toml",
        **{"output.reference_point_b_m": [1.0, 0.0, 0.0], "output.rate_hz": 1.0},
    )
    alignment = liealign.align_heading(flight)
    moved = liealign.process(flight, alignment)
    imu = liealign.process(liealign.read_flight(files.folder / "FLIGHT.toml"), alignment)
    at = np.searchsorted(imu.time_s, moved.time_s - 1e-9)
    assert moved.time_s.size < imu.time_s.size / 90
    np.testing.assert_allclose(moved.p_eb_e_m, imu.point_e_m([1.0, 0.0, 0.0])[at], atol=1e-8)
