"""The errors of simulated sensors as Python and the command line have them; their laws are tested in C++."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest
from liealign.cli.knobs import KNOBS

from .conftest import MainInProcess

DRONE = liealign.DroneFlight(duration_s=100.0, rate_hz=50.0, oversample=1)


def flight(seed: int = 1, **errors: Any) -> liealign.SimulatedFlight:
    gnss = errors.pop("gnss", liealign.GnssErrors())
    return liealign.simulate_flight(DRONE, gnss, liealign.make_config(), seed, **errors)


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def test_the_true_biases_are_those_of_the_samples() -> None:
    quiet = liealign.ImuErrorSizes(accel_turn_on_ug=2000.0, noise_scale=1e-6)
    simulated = flight(imu=quiet)
    truth, imu = simulated.truth(), simulated.flight.imu()
    perfect = flight(imu=liealign.ImuErrorSizes(accel_turn_on_ug=0.0, noise_scale=0.0)).flight.imu()
    error = imu["f_ib_b_mps2"] - perfect["f_ib_b_mps2"]
    np.testing.assert_allclose(error[1:], truth["b_a_mps2"][:-1], atol=1e-6)
    assert np.abs(truth["b_a_mps2"]).max() > 1e-3


def test_biases_are_drawn_anew_by_each_seed_and_fixed_ones_have_their_size() -> None:
    first = [flight(seed).truth()["b_a_mps2"][0, 0] for seed in (1, 2, 3)]
    assert len({round(abs(bias), 6) for bias in first}) == 3
    fixed = liealign.ImuErrorSizes(turn_on="fixed", noise_scale=0.0)
    for seed in (1, 2, 3):
        np.testing.assert_allclose(np.abs(flight(seed, imu=fixed).truth()["b_a_mps2"]), 500 * 9.80665e-6)


def test_what_is_typed_in_stands_in_the_config() -> None:
    gnss = liealign.GnssErrors(l_ba_b=(0.1, -0.05, -0.3), latency_s=0.1)
    typed = liealign.TypedInErrors(lever_arm_std_m=0.05, latency_std_s=0.02)

    def said(simulated: liealign.SimulatedFlight) -> dict[str, Any]:
        return liealign.config_entries(simulated.flight.config)

    off = said(flight(gnss=gnss, typed_in=typed))
    assert off["gnss.lever_arm_b_m"] != [0.1, -0.05, -0.3]
    assert off["gnss.lever_arm_b_m"] == pytest.approx([0.1, -0.05, -0.3], abs=0.25)
    assert off["gnss.latency_s"] != 0.1 and off["gnss.latency_s"] == pytest.approx(0.1, abs=0.1)
    assert said(flight(gnss=gnss))["gnss.lever_arm_b_m"] == [0.1, -0.05, -0.3]


def test_a_barometer_has_heights_of_the_flight() -> None:
    simulated = flight()
    baro = simulated.baro(liealign.BaroErrors(std_m=0.1, bias_sigma_m=0.0, rate_hz=5.0), seed=1)
    truth = simulated.truth()
    error = baro["height_m"] - np.interp(baro["time_s"], truth["time_s"], truth["height_m"])
    assert baro["time_s"].size == 501
    assert 0.08 < error.std() < 0.12
    assert (baro["std_m"] == 0.1).all()
    with pytest.raises(liealign.Error, match="rate_hz is 0"):
        simulated.baro(liealign.BaroErrors(rate_hz=0.0), seed=1)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"imu": liealign.ImuErrorSizes(turn_on="maybe")}, 'turn_on is "maybe"; expected "drawn" or "fixed"'),
        ({"imu": liealign.ImuErrorSizes(gyro_scale_ppm=-1.0)}, "gyro_scale_ppm is -1"),
        ({"gnss": liealign.GnssErrors(stamp_jitter_s=-1.0)}, "stamp_jitter_s is -1"),
        ({"typed_in": liealign.TypedInErrors(latency_std_s=-1.0)}, "latency_std_s is -1"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(errors: dict[str, Any], message: str) -> None:
    with pytest.raises(liealign.Error, match=message):
        flight(**errors)


def test_flags_of_the_errors_reach_the_files(main: MainInProcess, tmp_path: Path) -> None:
    flags = (
        "--duration 100 --imu-rate 50 --gnss-velocity --gnss-heading --gnss-correlated-std 1 1 2 "
        "--gnss-smoothing-time 1 --gnss-velocity-correlated-std 0.1 0.1 0.1 --gnss-latency 0.1 "
        "--gnss-velocity-latency 0.2 --gnss-jitter 0.01 --gnss-arrival-delay 0.02 --gnss-step 0.11 0.11 0.1 "
        "--gnss-velocity-step 0.01 --gnss-stated-factor 2 --accel-scale 1000 --gyro-misalignment 0.2 "
        "--accel-vibration 1 1 1 --lever-arm-std 0.05 --gnss-latency-std 0.01 --fixed-biases --quiet"
    )
    assert main("simulate", "-o", tmp_path / "flown", *flags.split()).code == 0
    gnss = columns(tmp_path / "flown" / "gnss.csv")
    assert {"heading_deg", "std_heading_deg"} <= set(gnss)
    assert all(float(heading) < 360.0 for heading in gnss["heading_deg"])
    assert all(
        float(velocity) * 100 == pytest.approx(round(float(velocity) * 100)) for velocity in gnss["vn_mps"]
    )
    assert float(gnss["std_n_m"][0]) == pytest.approx(2.0 * np.hypot(1.0, 0.01), abs=1e-3)
    assert len({round(float(stamp) % 1.0, 4) for stamp in gnss["time_s"]}) > 50
    said = liealign.config_entries(liealign.read_config(tmp_path / "flown" / "FLIGHT.toml"))
    assert said["gnss.lever_arm_b_m"] != [0.1, -0.05, -0.3]
    assert said["gnss.latency_s"] != 0.1 and said["gnss.latency_s"] == pytest.approx(0.1, abs=0.05)


def test_every_knob_says_a_default_that_it_takes() -> None:
    for knob in KNOBS:
        if knob.default != "none":
            knob.value(knob.default)
