"""The Python API: arrays, round trips, progress, errors raised."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest

from .conftest import LEVER_ARM, Files, SimulatedCase, wrap_deg


def arrays_of(flight: liealign.Flight) -> dict[str, Any]:
    imu, gnss = flight.imu(), flight.gnss()
    return {
        "imu_time_s": imu["time_s"],
        "omega_ib_b_rps": imu["omega_ib_b_rps"],
        "f_ib_b_mps2": imu["f_ib_b_mps2"],
        "gnss_time_s": gnss["time_s"],
        "lat_deg": gnss["lat_deg"],
        "lon_deg": gnss["lon_deg"],
        "height_m": gnss["height_m"],
        "std_p_n_m": np.sqrt(np.einsum("kii->ki", gnss["P_n_m2"])),
        "v_n_mps": gnss["v_n_mps"],
        "std_v_n_mps": gnss["std_v_n_mps"],
        "fix": gnss["fix"],
    }


def test_alignment_is_near_the_truth(case: SimulatedCase) -> None:
    a = case.alignment
    at = np.searchsorted(case.truth["time_s"], a.start_time_s - 1e-6)
    error = wrap_deg(a.heading_deg - case.truth["rpy_deg"][at, 2])
    assert a.verdict == "aligned"
    assert a.heading_std_deg is not None
    assert abs(error) < 4.0 * a.heading_std_deg < 1.0
    assert a.evaluations == a.curve_cost.size == a.curve_heading_deg.size == a.curve_gated.size
    assert not a.curve_gated.any()  # with noise scales of its own no candidate needs the final filter's gate
    latency = a.gnss_latency_std_s
    assert latency is not None
    assert abs(a.gnss_latency_s) < 4.0 * latency < 0.02
    assert a.mean_deg == pytest.approx(a.heading_deg, abs=0.5 * a.heading_std_deg)
    low, high = np.rad2deg(a.engine.interval_95_rad)
    assert high - low == pytest.approx(2 * 1.96 * a.heading_std_deg, rel=0.1)
    assert a.start == "static"
    assert math.isclose(a.mode_mass.sum(), 1.0)


def test_smoothed_trajectory_is_near_the_truth_and_within_its_sigmas(case: SimulatedCase) -> None:
    s, truth = case.solution, case.truth
    at = np.searchsorted(truth["time_s"], s.time_s - 1e-6)
    np.testing.assert_allclose(truth["time_s"][at], s.time_s, atol=1e-6)
    position = np.linalg.norm(s.p_eb_e_m - truth["p_eb_e_m"][at], axis=1)
    assert np.sqrt(np.mean(position**2)) < 0.03
    attitude = wrap_deg(s.rpy_deg - truth["rpy_deg"][at])
    assert np.sqrt(np.mean(attitude**2, axis=0)).max() < 0.1
    # Errors follow each other over tens of seconds, so one flight holds only a few independent ones.
    assert (np.abs(attitude) < 5.0 * s.std_rpy_deg).mean() > 0.95


def test_arrays_have_the_shapes_they_say(case: SimulatedCase) -> None:
    s = case.solution
    n = s.time_s.size
    assert s.filtered is not None and s.filtered.time_s.size > 0
    for field in dataclasses.fields(liealign.Trajectory):
        array = getattr(s, field.name)
        expected = {"C_b_e": (n, 3, 3)}.get(field.name, (n,) if array.ndim == 1 else (n, 3))
        assert array.shape == expected and array.dtype == np.float64 and np.isfinite(array).all(), field.name
    assert (np.diff(s.time_s) > 0).all()
    rotations = s.C_b_e @ s.C_b_e.transpose(0, 2, 1)
    np.testing.assert_allclose(rotations, np.broadcast_to(np.eye(3), rotations.shape), atol=1e-12)
    with pytest.raises(dataclasses.FrozenInstanceError):
        s.time_s = s.time_s  # type: ignore[misc]


def test_point_is_the_lever_arm_away(case: SimulatedCase) -> None:
    s = case.solution
    moved = s.point_e_m(LEVER_ARM) - s.p_eb_e_m
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), np.linalg.norm(LEVER_ARM), rtol=1e-8)
    lat, lon, height = s.point_geodetic([0.0, 0.0, 0.0])
    np.testing.assert_allclose(lat, s.lat_deg, atol=1e-13)
    np.testing.assert_allclose(lon, s.lon_deg, atol=1e-13)
    np.testing.assert_allclose(height, s.height_m, atol=1e-8)
    np.testing.assert_allclose(liealign.ecef_from_geodetic(lat, lon, height), s.p_eb_e_m, atol=2e-8)


def test_innovations_count_every_record(case: SimulatedCase) -> None:
    innovations, summary = case.solution.innovations, case.solution.summary
    assert innovations.time_s.size == summary["fixes"]
    words, counts = np.unique(innovations.verdict, return_counts=True)
    assert {f"fixes_{word}": count for word, count in zip(words, counts, strict=True)} == {
        key: value for key, value in summary.items() if key.startswith("fixes_") and value
    }
    updated = np.isin(innovations.verdict, ["used", "weighted", "reacquired"])
    assert np.isfinite(innovations.nis[updated]).all() and np.isnan(innovations.nis[~updated]).all()
    assert np.isfinite(innovations.res_v_n_mps[updated]).all()


def test_frames_have_the_columns_of_the_files(case: SimulatedCase, tmp_path: Path) -> None:
    liealign.write_results(tmp_path, case.prepared, case.alignment, case.solution)
    for name, frame in (
        ("trajectory.csv", case.solution.to_frame()),
        ("innovations.csv", case.solution.innovations.to_frame()),
    ):
        header = (tmp_path / name).read_text(encoding="utf-8").splitlines()[0]
        assert ",".join(frame.columns) == header


def test_to_frame_says_what_to_install(case: SimulatedCase, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"pip install \"liealign\[frame\]\""):
        case.solution.to_frame()


def test_flight_from_arrays_gives_the_same_as_from_files(case: SimulatedCase) -> None:
    from_file = liealign.read_flight(case.toml)
    arrays = arrays_of(from_file)
    flight = liealign.flight_from_arrays(**arrays, config=from_file.config)
    again = liealign.align_heading(flight)
    # Standard deviations and angles go through a root and degrees: last bits differ (1 nm), and with them
    # where the search settles.
    assert again.heading_std_deg is not None
    assert again.heading_deg == pytest.approx(case.alignment.heading_deg, abs=0.1 * again.heading_std_deg)


@pytest.mark.parametrize(
    ("name", "index", "value", "message"),
    [
        ("omega_ib_b_rps", (17, 1), math.nan, "omega_ib_b_rps[17, 1] is nan; expected a finite number"),
        ("imu_time_s", (5,), 0.0, "imu_time_s[5] is 0.0; expected a time later than the one before"),
        ("lat_deg", (2,), 90.5, "lat_deg[2] is 90.5; expected a number from -90 to 90"),
        ("lon_deg", (2,), -181.0, "lon_deg[2] is -181.0; expected a number from -180 to 360"),
        ("std_p_n_m", (0, 2), 0.0, "std_p_n_m[0, 2] is 0.0; expected a number above 0"),
        ("std_v_n_mps", (3, 0), -1.0, "std_v_n_mps[3, 0] is -1.0; expected a number above 0"),
    ],
)
def test_flight_from_arrays_refuses(
    case: SimulatedCase, name: str, index: tuple[int, ...], value: float, message: str
) -> None:
    arrays = arrays_of(case.simulated.flight)
    arrays[name] = arrays[name].copy()
    arrays[name][index] = value
    with pytest.raises(liealign.InputError) as error:
        liealign.flight_from_arrays(**arrays)
    assert str(error.value) == message


def test_flight_from_arrays_refuses_shapes_and_covariances(case: SimulatedCase) -> None:
    arrays = arrays_of(case.simulated.flight)
    short = {**arrays, "f_ib_b_mps2": arrays["f_ib_b_mps2"][:-1]}
    with pytest.raises(liealign.InputError, match=r"f_ib_b_mps2: expected an array of shape \(\d+, 3\)"):
        liealign.flight_from_arrays(**short)
    with pytest.raises(liealign.InputError, match="lat_deg is not an array of numbers"):
        liealign.flight_from_arrays(**{**arrays, "lat_deg": "north"})
    too_much = np.full((arrays["lat_deg"].size, 3), 1.0)
    with pytest.raises(liealign.InputError, match=r"cov_p_n_m2\[0\] does not fit std_p_n_m\[0\]"):
        liealign.flight_from_arrays(**arrays, cov_p_n_m2=too_much)


def test_overrides_are_stronger_than_the_file(files: Files) -> None:
    overrides: dict[str, Any] = {"gnss.latency_s": -0.15, "imu.axes": "FLU"}
    flight = liealign.read_flight(files.folder / "FLIGHT.toml", **overrides)
    values = liealign.config_entries(flight.config)
    assert (values["gnss.latency_s"], values["imu.axes"], values["align.grid_step_deg"]) == (
        -0.15,
        "FLU",
        45.0,
    )
    assert values["gnss.lever_arm_b_m"] == list(LEVER_ARM)
    numpy_values = liealign.make_config(
        {"gnss.lever_arm_b_m": np.array(LEVER_ARM), "imu.noise_scale": np.float64(3)}
    )
    assert liealign.config_entries(numpy_values)["gnss.lever_arm_b_m"] == list(LEVER_ARM)


def test_read_flight_takes_bare_files(files: Files) -> None:
    folder = files.folder
    flight = liealign.read_flight(imu=folder / "imu.csv", gnss=folder / "gnss.csv")
    assert flight.imu()["time_s"].size > flight.gnss()["time_s"].size > 0
    with pytest.raises(liealign.ConfigError, match=r"^gnss\.file is not given"):
        liealign.read_flight(imu=folder / "imu.csv")


def test_read_flight_takes_the_heading_of_a_dual_antenna(files: Files) -> None:
    header, first, *rows = files.lines("gnss.csv")
    spread = [f"{header},heading_deg,std_heading_deg", f"{first},-90,0.5", *(f"{row},," for row in rows)]
    files.write("gnss.csv", spread)
    gnss = liealign.read_flight(files.folder / "FLIGHT.toml").gnss()
    assert gnss["heading_deg"][0] == pytest.approx(270.0, abs=1e-12)
    assert gnss["std_heading_deg"][0] == pytest.approx(0.5, abs=1e-12)
    assert np.isnan(gnss["heading_deg"][1:]).all() and np.isnan(gnss["std_heading_deg"][1:]).all()


def test_read_flight_takes_a_barometer(files: Files) -> None:
    toml = files.folder / "FLIGHT.toml"
    assert liealign.read_flight(toml).baro()["time_s"].size == 0
    files.write("baro.csv", ["time_s,height_m,std_m", "1000.0,12.5,0.25", "1000.1,12.75,"])
    text = toml.read_text(encoding="utf-8")
    toml.write_text(f'{text}[baro]\nfile = "baro.csv"\n', encoding="utf-8")
    for flight in (
        liealign.read_flight(toml),
        liealign.read_flight(
            imu=files.folder / "imu.csv", gnss=files.folder / "gnss.csv", baro=files.folder / "baro.csv"
        ),
    ):
        baro = flight.baro()
        np.testing.assert_array_equal(baro["time_s"], [1000.0, 1000.1])
        np.testing.assert_array_equal(baro["height_m"], [12.5, 12.75])
        np.testing.assert_array_equal(baro["std_m"], [0.25, np.nan])
    files.write("baro.csv", ["time_s,height_m", "1000.0,x"])
    with pytest.raises(liealign.InputError, match=r'baro\.csv:2:2: height_m is "x"; expected a number from'):
        liealign.read_flight(toml)


def test_every_key_has_a_line_in_the_table() -> None:
    fields = liealign.config_fields()
    keys = [field.key for field in fields]
    assert len(set(keys)) == len(keys) > 40
    assert all(field.meaning and field.type for field in fields)
    text = liealign.dump_config(liealign.Config())
    assert all(
        f"\n{key.partition('.')[2]} = " in text or f"# {key.partition('.')[2]} = " in text for key in keys
    )


def test_exceptions_are_one_family() -> None:
    for kind in (liealign.InputError, liealign.ConfigError, liealign.NumericalError, liealign.Cancelled):
        assert issubclass(kind, liealign.Error) and issubclass(kind, ValueError)
        assert kind.__module__ == "liealign"
    with pytest.raises(
        liealign.ConfigError, match=r'unknown key "gnss.latency"; did you mean "gnss.latency_s"'
    ):
        liealign.make_config({"gnss.latency": 0.1})
    with pytest.raises(liealign.ConfigError, match=r"gnss.latency_s is None; expected"):
        liealign.make_config({"gnss.latency_s": None})
    with pytest.raises(liealign.Error, match="duration_s is 10"):
        liealign.simulate_flight(
            liealign.DroneFlight(duration_s=10.0), liealign.GnssErrors(), liealign.Config(), 1
        )
    with pytest.raises(TypeError, match="unexpected keyword argument 'speed'"):
        liealign.DroneFlight(speed=3.0)  # type: ignore[call-arg]


def test_progress_is_called_and_can_stop(case: SimulatedCase) -> None:
    seen: list[tuple[int, int]] = []

    def watch(done: int, total: int) -> None:
        seen.append((done, total))

    liealign.process(case.prepared, case.alignment, watch)
    assert len(seen) > 20 and all(0 <= done <= total for done, total in seen)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)

    def fail(done: int, total: int) -> bool:
        raise KeyError(done)

    with pytest.raises(KeyError):
        liealign.process(case.prepared, case.alignment, fail)
    with pytest.raises(liealign.Cancelled):
        liealign.process(case.prepared, case.alignment, lambda done, total: False)
    with pytest.raises(liealign.Cancelled):
        liealign.align_heading(case.prepared, lambda done, total: False)


def test_ask_and_tell_by_hand(case: SimulatedCase) -> None:
    search = liealign.HeadingSearch(liealign.heading_search_options(case.prepared))
    with pytest.raises(liealign.Error):
        search.result()
    while not search.done():
        search.tell(liealign.evaluate_candidates(case.prepared, search.ask()))
    assert math.degrees(search.result().heading_rad) == case.alignment.heading_deg


def test_candidates_do_not_depend_on_their_neighbours(case: SimulatedCase) -> None:
    candidates = [liealign.HeadingCandidate(heading_rad=0.4 * i) for i in range(5)]
    together = [score.cost for score in liealign.evaluate_candidates(case.prepared, candidates)]
    alone = [liealign.evaluate_candidates(case.prepared, [c])[0].cost for c in candidates]
    assert together == alone


def test_prepared_flight_says_what_it_found(case: SimulatedCase) -> None:
    prepared = case.prepared
    assert prepared.rests.shape == (2, 2) and prepared.gaps.shape == (0, 2)
    assert prepared.t_begin_s < prepared.t_start_s < prepared.t_end_s
    assert prepared.imu_rate_hz == pytest.approx(100.0, rel=1e-6)
    assert prepared.latency_s == pytest.approx(0.0, abs=0.05)  # of the coarse stage
    assert (prepared.imu_noise_scale, prepared.gnss_std_scale) == (1.0, 1.0)
    assert prepared.start == "static" and "rests" in prepared.start_reason
    mode = prepared.coarse.modes[0]
    error = wrap_deg(np.rad2deg(mode.heading_rad) - case.alignment.heading_deg)
    assert abs(error) < 4.0 * np.rad2deg(mode.heading_std_rad) < 45.0


def test_alignment_json_is_what_to_dict_gives(case: SimulatedCase) -> None:
    assert case.alignment.to_dict() == json.loads(case.alignment.json_text)
    assert case.alignment.to_dict()["heading_deg"] == case.alignment.heading_deg
