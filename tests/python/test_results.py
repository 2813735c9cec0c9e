"""The result files: names, columns and keys as docs/formats.md has them; the used config runs again."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import liealign
import numpy as np
import pytest

from .conftest import Cli, Files, SimulatedCase

STATE = "time_s,lat_deg,lon_deg,height_m,vn_mps,ve_mps,vd_mps,roll_deg,pitch_deg,heading_deg"
STATE_STD = (
    "std_n_m,std_e_m,std_d_m,std_vn_mps,std_ve_mps,std_vd_mps,std_roll_deg,std_pitch_deg,std_heading_deg,"
    "relative_std_n_m,relative_std_e_m,relative_std_d_m"
)
HEADERS = {
    "trajectory.csv": f"{STATE},{STATE_STD}",
    "filtered.csv": f"{STATE},{STATE_STD}",
    "biases.csv": "time_s,accel_bias_x_mps2,accel_bias_y_mps2,accel_bias_z_mps2,"
    "gyro_bias_x_rps,gyro_bias_y_rps,gyro_bias_z_rps,"
    "std_accel_bias_x_mps2,std_accel_bias_y_mps2,std_accel_bias_z_mps2,"
    "std_gyro_bias_x_rps,std_gyro_bias_y_rps,std_gyro_bias_z_rps",
    "innovations.csv": "time_s,res_n_m,res_e_m,res_d_m,std_n_m,std_e_m,std_d_m,nis,weight,"
    "res_vn_mps,res_ve_mps,res_vd_mps,std_vn_mps,std_ve_mps,std_vd_mps,nis_velocity,weight_velocity,verdict",
}
ALIGNMENT_KEYS = {
    "heading_deg",
    "heading_std_deg",
    "heading_95_deg",
    "verdict",
    "start_time_s",
    "modes",
    "curve",
    "evaluations",
    "gnss_latency_s",
    "gnss_latency_std_s",
    "imu_noise_scale",
    "gnss_std_scale",
}


@pytest.fixture(scope="module")
def out(case: SimulatedCase, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    liealign.write_results(folder, case.prepared, case.alignment, case.solution)
    return folder


def column(path: Path, name: str) -> np.ndarray:
    with path.open(encoding="utf-8", newline="") as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


@pytest.mark.parametrize("name", HEADERS)
def test_header(out: Path, name: str) -> None:
    text = (out / name).read_text(encoding="utf-8")
    header, *rows = text.splitlines()
    assert header == HEADERS[name]
    assert text.endswith("\n") and "\r" not in text
    assert {row.count(",") for row in rows} == {header.count(",")}


def test_only_the_contract_files(out: Path) -> None:
    assert {path.name for path in out.iterdir()} == {
        *HEADERS,
        "alignment.json",
        "summary.json",
        "config.toml",
    }


def test_files_hold_what_the_api_gives(case: SimulatedCase, out: Path) -> None:
    s = case.solution
    path = out / "trajectory.csv"
    np.testing.assert_allclose(column(path, "time_s"), s.time_s, atol=1e-6)
    np.testing.assert_allclose(column(path, "lat_deg"), s.lat_deg, atol=1e-11)
    np.testing.assert_allclose(column(path, "heading_deg"), s.rpy_deg[:, 2], atol=1e-6)
    np.testing.assert_allclose(column(path, "std_d_m"), s.std_p_n_m[:, 2], atol=1e-5)
    np.testing.assert_allclose(column(path, "relative_std_n_m"), s.relative_std_p_n_m[:, 0], atol=1e-5)
    np.testing.assert_allclose(column(out / "biases.csv", "gyro_bias_z_rps"), s.b_g_rps[:, 2], atol=1e-10)


def test_alignment_json(case: SimulatedCase, out: Path) -> None:
    alignment = json.loads((out / "alignment.json").read_text(encoding="utf-8"))
    assert alignment.keys() >= ALIGNMENT_KEYS
    low, high = alignment["heading_95_deg"]
    assert low < alignment["heading_deg"] < high
    # by the density, as sampled: a parabola to a hundredth
    assert high - low == pytest.approx(2 * 1.959964 * alignment["heading_std_deg"], rel=0.03)
    density = np.array([row["density_per_deg"] for row in alignment["density"]])
    at = np.array([row["heading_deg"] for row in alignment["density"]])
    assert at[np.argmax(density)] == pytest.approx(alignment["heading_deg"], abs=alignment["heading_std_deg"])
    assert density.max() * alignment["heading_std_deg"] == pytest.approx(
        1.0 / math.sqrt(2.0 * math.pi), rel=0.05
    )
    assert len(alignment["parabola_points"]) == 3
    assert alignment["verdict"] in {"aligned", "weak", "ambiguous", "unobservable"}
    assert alignment["start_time_s"] == case.prepared.t_start_s
    assert len(alignment["curve"]) == alignment["evaluations"]


def test_summary_has_one_number_per_key(case: SimulatedCase, out: Path) -> None:
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary == case.solution.summary
    assert summary["version"] == liealign.__version__
    no_numbers = {key for key, value in summary.items() if not isinstance(value, int | float)}
    assert no_numbers == {
        *("version", "verdict", "warnings", "gps_week", "gnss_error_model"),
        # null: not found by the model of the receiver's errors
        *(
            "imu_noise_scale_std",
            "accel_noise_scale_std",
            "gnss_std_scale_std",
            "gnss_velocity_std_scale_std",
        ),
        "clock_drift_std_ppm",  # null: the flight is too short for it
    }


def test_used_config_names_every_key_and_runs_again_to_the_same_bits(files: Files, cli: Cli) -> None:
    first = cli("run", "FLIGHT.toml", "--gnss-latency", "0.0", "--filtered", "-o", "results/first", "--quiet")
    assert first.code == 0
    config = files.folder / "results" / "first" / "config.toml"
    text = config.read_text(encoding="utf-8")
    assert 'file = "../../imu.csv"' in text and str(files.folder) not in text
    for field in liealign.config_fields():
        assert re.search(rf"^(# )?{field.key.partition('.')[2]} = ", text, re.MULTILINE), field.key
    second = cli("run", config, "-o", "results/second", "--quiet")
    assert second.code == 0
    for name in (*HEADERS, "alignment.json", "summary.json", "config.toml"):
        ours, again = (files.folder / "results" / run / name for run in ("first", "second"))
        assert ours.read_bytes() == again.read_bytes(), name


def test_no_part_files_are_left(out: Path) -> None:
    assert not list(out.rglob("*.part"))


def test_folder_that_cannot_be_made(case: SimulatedCase, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(liealign.InputError, match="the folder cannot be made"):
        liealign.write_results(tmp_path / "file" / "out", case.prepared, case.alignment, case.solution)
