"""Errors of receivers end to end: two sigmas of a position, headings and barometers, what is refused."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest

from .conftest import Files, MainInProcess, SimulatedCase, wrap_deg

LEVER_ARM = (0.1, -0.05, -0.3)
METRE = {
    "correlated_std_ned_m": (1.5, 1.5, 2.5),
    "correlation_time_s": 120.0,
    "smoothing_time_s": 1.0,
    "std_ned_m": (0.05, 0.05, 0.1),
    "velocity_correlated_std_ned": (0.05, 0.05, 0.08),
}


def simulate(seed: int, gentle: bool = False, **gnss: Any) -> liealign.SimulatedFlight:
    """100 s of drone flight at 100 Hz, GNSS at 2 Hz with velocity."""
    drone = liealign.DroneFlight(
        duration_s=100.0, parked_before_s=15.0, parked_after_s=8.0, rate_hz=100.0, altitude_m=20.0
    )
    if gentle:
        drone = liealign.random_flight("lines", gentle=True, seed=seed)
        drone.duration_s, drone.parked_before_s, drone.rate_hz = 150.0, 15.0, 100.0
    errors = liealign.GnssErrors(rate_hz=2.0, l_ba_b=LEVER_ARM, velocity=True, **gnss)
    return liealign.simulate_flight(drone, errors, liealign.make_config({}), seed)


def processed(flight: liealign.Flight, **keys: Any) -> liealign.Solution:
    config = liealign.make_config(
        {key.replace("__", "."): value for key, value in keys.items()}, base=flight.config
    )
    return liealign.process(flight.with_config(config), keep_events=False)


@pytest.fixture(scope="module")
def metre() -> liealign.SimulatedFlight:
    return simulate(5, **METRE)


@pytest.fixture(scope="module")
def metre_solution(metre: liealign.SimulatedFlight) -> liealign.Solution:
    return processed(metre.flight)


# ---- two sigmas --------------------------------------------------------------------------------------------


def test_relative_sigma_is_the_absolute_one_where_errors_are_white(case: SimulatedCase) -> None:
    white = processed(case.simulated.flight, gnss__error_model="white")
    np.testing.assert_array_equal(white.relative_std_p_n_m, white.std_p_n_m)
    assert white.summary["gnss_error_model"] == "white" and white.receiver is None
    assert white.summary["gnss_velocity_latency_s"] is None
    assert white.summary["median_relative_std_down_m"] == white.summary["median_std_down_m"]


def test_relative_sigma_is_below_the_absolute_one(case: SimulatedCase) -> None:
    s = case.solution
    assert s.summary["gnss_error_model"] == "correlated"
    assert (s.relative_std_p_n_m > 0.0).all()
    assert np.median(s.relative_std_p_n_m) < 0.7 * np.median(s.std_p_n_m)


def test_metre_class_is_bent_by_centimetres(
    metre: liealign.SimulatedFlight, metre_solution: liealign.Solution
) -> None:
    s, truth = metre_solution, metre.truth()
    assert (metre.flight.gnss()["fix"] == 5).all()
    relative, absolute = (np.median(std, axis=0) for std in (s.relative_std_p_n_m, s.std_p_n_m))
    assert (relative < 0.1 * absolute).all()
    assert (absolute > 0.5).all(), "the file states 1.5 m, and nothing contradicts it"
    error = liealign.compare(truth, s)
    for channel in ("north", "east", "down"):
        ratio = error[channel].rms_over_sigma
        assert ratio is not None and ratio < 2.5  # one draw of an error that lasts
        assert error[channel].rms_relative_sigma == pytest.approx(
            np.sqrt(np.mean(s.relative_std_p_n_m[:, ("north", "east", "down").index(channel)] ** 2)), rel=0.05
        )
    assert error["vn"].rms_relative_sigma is None


def test_receiver_is_found(metre_solution: liealign.Solution) -> None:
    found = metre_solution.receiver
    assert found is not None
    assert abs(found.latency_s) < 0.03 and abs(found.velocity_latency_s) < 0.03
    assert found.velocity_latency_std_s is not None and found.velocity_latency_std_s < 0.02
    assert 0.3 < found.smoothing_time_s < 3.0
    assert found.white_std_scale < 0.1
    assert 0.02 < found.velocity_correlated_std_mps < 0.15
    assert metre_solution.summary["gnss_correlation_time_s"] == found.correlation_time_s


def test_two_latencies_are_told_apart() -> None:
    found = processed(simulate(6, latency_s=0.08, velocity_latency_s=0.2).flight).receiver
    assert found is not None
    assert found.latency_s == pytest.approx(0.08, abs=0.01)
    assert found.velocity_latency_s == pytest.approx(0.2, abs=0.03)


def test_jitter_is_found_and_warned_of() -> None:
    s = processed(simulate(7, stamp_jitter_s=0.02).flight)
    assert s.receiver is not None and s.receiver.stamp_jitter_s == pytest.approx(0.02, rel=0.4)
    assert any("jitter by" in warning for warning in s.warnings)


# ---- external headings and barometers ----------------------------------------------------------------------


def rms_heading(simulated: liealign.SimulatedFlight, s: liealign.Solution) -> float:
    truth = simulated.truth()
    at = np.searchsorted(truth["time_s"], s.time_s - 1e-6)
    return float(np.sqrt(np.mean(wrap_deg(s.rpy_deg[:, 2] - truth["rpy_deg"][at, 2]) ** 2)))


def without_columns(path: Path, *names: str) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    kept = [name for name in rows[0] if name not in names]
    lines = [",".join(kept), *(",".join(row[name] for name in kept) for row in rows)]
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def test_external_heading_improves_the_heading(tmp_path: Path) -> None:
    simulated = simulate(13, gentle=True, heading=True, heading_std_deg=0.1)
    liealign.write_flight(str(tmp_path), simulated)
    flight = liealign.read_flight(tmp_path / "FLIGHT.toml")
    assert np.isfinite(flight.gnss()["heading_deg"]).all()
    with_it = processed(flight)
    without_columns(tmp_path / "gnss.csv", "heading_deg", "std_heading_deg")
    without = processed(liealign.read_flight(tmp_path / "FLIGHT.toml"))
    assert np.median(with_it.std_rpy_deg[:, 2]) < 0.7 * np.median(without.std_rpy_deg[:, 2])
    assert rms_heading(simulated, with_it) < rms_heading(simulated, without)
    assert rms_heading(simulated, with_it) < 3.0 * np.median(with_it.std_rpy_deg[:, 2])


def test_heading_has_a_file_of_innovations(tmp_path: Path) -> None:
    flight = simulate(11, heading=True, heading_std_deg=0.3).flight
    alignment = liealign.align_heading(flight)
    liealign.write_results(tmp_path, flight, alignment, liealign.process(flight, alignment))
    with (tmp_path / "innovations_heading.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", "residual_deg", "std_deg", "nis", "weight"]
    assert len(rows) > 180
    assert not (tmp_path / "innovations_barometer.csv").exists()


def test_barometer_improves_the_height(metre: liealign.SimulatedFlight, tmp_path: Path) -> None:
    errors = liealign.BaroErrors(std_m=0.3, rate_hz=5.0, bias_sigma_m=0.3, bias_correlation_time_s=600.0)
    heights = metre.baro(errors, seed=1)
    liealign.write_flight(str(tmp_path), metre)
    rows = zip(heights["time_s"], heights["height_m"], strict=True)
    text = "".join(f"{t:.6f},{h:.4f}\n" for t, h in rows)
    (tmp_path / "baro.csv").write_text("time_s,height_m\n" + text, encoding="utf-8")
    keys = {"baro__std_m": 0.3, "baro__bias_std_m": 0.3, "gnss__use_velocity": False}
    flight = liealign.read_flight(tmp_path / "FLIGHT.toml", baro=tmp_path / "baro.csv")
    with_it = processed(flight, **keys)
    without = processed(liealign.read_flight(tmp_path / "FLIGHT.toml"), **keys)
    sigma, sigma_without = (np.median(s.std_p_n_m[:, 2]) for s in (with_it, without))
    assert sigma < 0.5 * sigma_without
    error, error_without = (liealign.compare(metre.truth(), s)["down"].rms for s in (with_it, without))
    assert error < error_without
    assert error < 3.0 * sigma


def test_arrays_of_headings_and_heights_are_those_of_files(
    metre: liealign.SimulatedFlight, tmp_path: Path
) -> None:
    imu, gnss = metre.flight.imu(), metre.flight.gnss()
    heights = metre.baro(liealign.BaroErrors(), seed=1)
    heading = np.where(np.arange(gnss["time_s"].size) % 2 == 0, 12.5, np.nan)
    arrays = {name: gnss[name] for name in ("lat_deg", "lon_deg", "height_m")}
    std = np.sqrt(np.diagonal(gnss["P_n_m2"], axis1=1, axis2=2))

    def made(**more: Any) -> liealign.Flight:
        return liealign.flight_from_arrays(
            imu_time_s=imu["time_s"],
            omega_ib_b_rps=imu["omega_ib_b_rps"],
            f_ib_b_mps2=imu["f_ib_b_mps2"],
            gnss_time_s=gnss["time_s"],
            std_p_n_m=std,
            **arrays,
            **more,
        )

    flight = made(
        heading_deg=heading,
        std_heading_deg=0.5 + 0.0 * heading,
        baro_time_s=heights["time_s"],
        baro_height_m=heights["height_m"],
    )
    np.testing.assert_allclose(flight.gnss()["heading_deg"], heading, rtol=1e-15)
    np.testing.assert_allclose(flight.gnss()["std_heading_deg"][::2], 0.5, rtol=1e-15)
    np.testing.assert_array_equal(flight.baro()["height_m"], heights["height_m"])
    assert np.isnan(flight.baro()["std_m"]).all()
    mekf = liealign.make_config({"filter.model": "mekf"}, base=flight.config)
    with pytest.raises(liealign.ConfigError, match="a barometer is given"):
        liealign.prepare_flight(flight.with_config(mekf))
    for more, message in (
        ({"heading_deg": heading}, "heading_deg is given without std_heading_deg; expected both or neither"),
        ({"baro_time_s": heights["time_s"]}, "baro_time_s is given without baro_height_m"),
        (
            {"heading_deg": heading, "std_heading_deg": np.ones_like(heading)},
            r"std_heading_deg\[1\] is 1.0; exp",
        ),
        (
            {"heading_deg": heading, "std_heading_deg": 0.0 * heading},
            r"std_heading_deg\[0\] is 0.0; expected",
        ),
    ):
        with pytest.raises(liealign.InputError, match=message):
            made(**more)


# ---- what is refused ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gnss", "more", "message"),
    [
        (
            'error_model = "correlated"',
            '[filter]\nmodel = "mekf"',
            'gnss.error_model is "correlated" and filter.model is "mekf", which carries no errors of the '
            'receiver; set gnss.error_model to "white", or drop it',
        ),
        (
            'error_model = "correlated"',
            '[filter]\nmechanization = "paper"',
            'gnss.error_model is "correlated" and filter.mechanization is "paper", which carries no errors',
        ),
        (
            "",
            '[filter]\nmodel = "mekf"\n[baro]\nfile = "baro.csv"',
            'a barometer is given (baro.file) and filter.model is "mekf", which carries no drifting bias;',
        ),
        (
            'error_model = "coloured"',
            "",
            'FLIGHT.toml:5:1: gnss.error_model is "coloured"; expected one of "auto", "white", "correlated"',
        ),
    ],
)
def test_refused(files: Files, main: MainInProcess, gnss: str, more: str, message: str) -> None:
    files.write("baro.csv", ["time_s,height_m", "1000.0,5.0", "1100.0,5.0"])
    toml = files.folder / "FLIGHT.toml"
    text = toml.read_text(encoding="utf-8").replace("[gnss]\n", f"[gnss]\n{gnss}\n")
    toml.write_text(f"{text}{more}\n", encoding="utf-8")
    outcome = main("run", "FLIGHT.toml", "-o", "out")
    assert (outcome.code, outcome.out) == (1, "")
    assert message in outcome.err, outcome.err
