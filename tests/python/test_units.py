"""Wrong units and axes of the IMU log: refused with the flag that mends them; mended, the clean result."""

from __future__ import annotations

from pathlib import Path

import liealign
import numpy as np
import pytest

from .conftest import Files, MainInProcess
from .test_output import read_csv

HEADER = "time_s,gyro_x_rps,gyro_y_rps,gyro_z_rps,accel_x_mps2,accel_y_mps2,accel_z_mps2"
GYRO, ACCEL = slice(1, 4), slice(4, 7)
WRONG = {"dps": ("--gyro-unit", "dps"), "g": ("--accel-unit", "g"), "up": ("--axes", "FLU")}


def write_wrong(source: Path, target: Path, wrong: str) -> None:
    rows = np.column_stack([*read_csv(source).values()])
    if wrong == "dps":
        rows[:, GYRO] = np.rad2deg(rows[:, GYRO])
    elif wrong == "g":
        rows[:, ACCEL] /= 9.80665
    else:
        rows[:, [2, 3, 5, 6]] *= -1.0  # y and z of both sensors turned around: forward, left, up
    np.savetxt(target, rows, delimiter=",", header=HEADER, comments="", fmt="%.17g")


@pytest.mark.parametrize("wrong", WRONG)
def test_refused_with_the_flag_that_mends_it(files: Files, main: MainInProcess, wrong: str) -> None:
    guess = ("--heading-guess", "137")
    assert main("run", "FLIGHT.toml", *guess, "-o", "clean", "--quiet").code == 0
    write_wrong(files.folder / "imu.csv", files.folder / "wrong.csv", wrong)
    outcome = main("run", "FLIGHT.toml", "--imu", "wrong.csv", *guess, "-o", "out")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (1, "", 1)
    assert outcome.err.startswith("wrong.csv: ") and " ".join(WRONG[wrong]) in outcome.err
    assert not (files.folder / "out").exists()

    assert (
        main("run", "FLIGHT.toml", "--imu", "wrong.csv", *WRONG[wrong], *guess, "-o", "out", "--quiet").code
        == 0
    )
    clean, mended = (read_csv(files.folder / name / "trajectory.csv") for name in ("clean", "out"))
    for name, column in clean.items():
        # The turn of units rounds the log in its last bit; heights and sigmas are printed to 1e-5.
        np.testing.assert_allclose(mended[name], column, rtol=0, atol=1.1e-5, err_msg=name)


@pytest.mark.parametrize("recording", ["rtk_car_drive0708", "apm_x8_testlog2"])
@pytest.mark.parametrize("wrong", WRONG)
def test_real_log(data_dir: Path, main: MainInProcess, tmp_path: Path, recording: str, wrong: str) -> None:
    imu, gnss = data_dir / recording / "imu.csv", data_dir / recording / "gnss.csv"
    liealign.prepare_flight(liealign.read_flight(imu=imu, gnss=gnss))  # as it is, it is taken
    write_wrong(imu, tmp_path / "wrong.csv", wrong)
    outcome = main("run", "--imu", "wrong.csv", "--gnss", gnss, "-o", "out")
    assert outcome.code == 1
    assert outcome.err.startswith("wrong.csv: ") and " ".join(WRONG[wrong]) in outcome.err
