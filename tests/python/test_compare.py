"""Errors against truth: known errors come out as they were put in, bad files are refused by place."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import liealign
import numpy as np
import pytest
from liealign import Track

from .conftest import Cli, MainInProcess, SimulatedCase

WGS84_A_M = 6378137.0
STATE = "time_s,lat_deg,lon_deg,height_m,vn_mps,ve_mps,vd_mps,roll_deg,pitch_deg,heading_deg"
ROW = "48.2,16.3,200,1,2,3,0,0,90"


def track(n: int = 101, dt: float = 0.1, **changes: Any) -> Track:
    """A straight flight along the equator, eastwards at 10 m/s, with constant sigmas."""
    t = 100.0 + dt * np.arange(n)
    lon = np.rad2deg(10.0 * (t - t[0]) / WGS84_A_M)
    ones = np.ones((n, 3))
    columns: dict[str, Any] = {
        "time_s": t,
        "lat_deg": np.zeros(n),
        "lon_deg": lon,
        "height_m": np.zeros(n),
        "v_n_mps": ones * [0.0, 10.0, 0.0],
        "rpy_deg": ones * [1.0, 2.0, 90.0],
        "std_p_n_m": 0.1 * ones,
        "std_v_n_mps": 0.2 * ones,
        "std_rpy_deg": 0.5 * ones,
        "relative_std_p_n_m": 0.02 * ones,
    }
    return Track(**(columns | changes))


def write_csv(path: Path, *rows: str, header: str = STATE) -> Path:
    path.write_text("".join(f"{row}\n" for row in (header, *rows)), encoding="utf-8")
    return path


# ---- the numbers -------------------------------------------------------------------------------------------


def test_nothing_differs_from_itself() -> None:
    c = liealign.compare(track(), track())
    assert (c.epochs, c.epochs_outside, c.epochs_in_gaps) == (101, 0, 0)
    assert [e.name for e in c.channels] == [
        *("north", "east", "down", "horizontal", "vn", "ve", "vd", "roll", "pitch", "heading")
    ]
    assert all(e.rms == e.max == e.mean == 0.0 for e in c.channels)


def test_offsets_come_out_in_their_channel_with_their_sign() -> None:
    t = track()
    moved = dataclasses.replace(
        t,
        lat_deg=t.lat_deg + np.rad2deg(0.3 / 6335439.327),  # meridian radius of curvature at the equator
        lon_deg=t.lon_deg - np.rad2deg(0.4 / WGS84_A_M),
        height_m=t.height_m + 0.5,
        v_n_mps=t.v_n_mps + np.array([0.1, -0.2, 0.3]),
        rpy_deg=t.rpy_deg + np.array([0.25, -0.5, 1.0]),
    )
    c = liealign.compare(t, moved)
    expected = {"north": 0.3, "east": -0.4, "down": -0.5, "horizontal": 0.5}
    expected |= {"vn": 0.1, "ve": -0.2, "vd": 0.3, "roll": 0.25, "pitch": -0.5, "heading": 1.0}
    for name, error in expected.items():
        e = c[name]
        assert e.mean == pytest.approx(error, rel=1e-5), name
        assert (e.rms, e.p95, e.max) == pytest.approx((abs(error),) * 3, rel=1e-5), name
    assert c["roll"].rms_over_sigma == pytest.approx(0.5)
    assert (c["roll"].within_1_sigma, c["heading"].within_1_sigma) == (1.0, 0.0)
    assert (c["north"].rms_over_sigma, c["heading"].rms_over_sigma) == pytest.approx((3.0, 2.0), rel=1e-5)
    assert c["horizontal"].rms_over_sigma is None


def test_statistics_are_those_of_the_errors() -> None:
    error = np.random.default_rng(1).normal(0.02, 0.5, 2001)
    t = track(2001, 0.01)
    noisy = dataclasses.replace(t, rpy_deg=t.rpy_deg + np.outer(error, [0.0, 0.0, 1.0]))
    e = liealign.compare(t, noisy)["heading"]
    assert e.mean == pytest.approx(error.mean())
    assert e.rms == pytest.approx(math.sqrt((error**2).mean()))
    assert e.max == pytest.approx(np.abs(error).max())
    assert np.mean(np.abs(error) <= e.p95) == pytest.approx(0.95, abs=1e-3)
    assert e.within_1_sigma == np.mean(np.abs(error) <= 0.5) == pytest.approx(0.68, abs=0.03)
    assert e.within_2_sigma == np.mean(np.abs(error) <= 1.0) == pytest.approx(0.95, abs=0.02)
    assert e.rms_over_sigma == pytest.approx(1.0, abs=0.05)


def test_truth_is_interpolated_to_the_trajectory() -> None:
    """Truth at 10 Hz, trajectory at 100 Hz: a line has no error but by the Earth's curvature."""
    c = liealign.compare(track(), track(1001, 0.01))
    assert c.epochs == 1001
    assert max(c[name].max for name in ("north", "east", "down")) < 1e-7
    assert max(e.max for e in c.channels[4:]) < 1e-12


def test_heading_is_interpolated_through_north() -> None:
    t = track(3, 1.0, rpy_deg=np.array([[0.0, 0.0, 358.0], [0.0, 0.0, 2.0], [0.0, 0.0, 6.0]]))
    time = np.array([100.25, 100.75])
    rpy = np.array([[0.0, 0.0, 359.0], [0.0, 0.0, 1.5]])
    found = dataclasses.replace(track(2), time_s=time, rpy_deg=rpy)
    np.testing.assert_allclose(liealign.compare(t, found).error_rpy_deg[:, 2], [0.0, 0.5], atol=1e-12)


def test_longitudes_of_both_conventions_agree() -> None:
    t = track()
    far = dataclasses.replace(t, lon_deg=t.lon_deg + 190.0)
    other = dataclasses.replace(t, lon_deg=t.lon_deg - 170.0)
    assert liealign.compare(far, other)["east"].max < 1e-8


def test_nothing_is_extrapolated_and_no_gap_is_bridged() -> None:
    truth, found = track(101, 0.1), track(301, 0.1)
    c = liealign.compare(truth, found)
    assert (c.epochs, c.epochs_outside, c.end_time_s) == (101, 200, pytest.approx(110.0))
    names = [f.name for f in dataclasses.fields(Track) if f.name != "name"]
    kept = (truth.time_s < 103.05) | (truth.time_s > 105.95)
    holed = Track.of({name: getattr(truth, name)[kept] for name in names})
    c = liealign.compare(holed, track(101, 0.1))
    assert (c.epochs, c.epochs_outside, c.epochs_in_gaps) == (72, 0, 29)
    assert not ((c.time_s > 103.05) & (c.time_s < 105.95)).any()


def test_from_and_to() -> None:
    c = liealign.compare(track(), track(), from_s=102.0, to_s=104.0)
    assert (c.epochs, c.epochs_outside) == (21, 80)
    with pytest.raises(
        liealign.InputError, match=r"no epoch to compare from 300 s: the truth covers 100\.000 s"
    ):
        liealign.compare(track(), track(), from_s=300.0)
    with pytest.raises(liealign.InputError, match="the first time to compare is nan"):
        liealign.compare(track(), track(), from_s=math.nan)


def test_arrays_files_and_results_compare_alike(case: SimulatedCase, tmp_path: Path) -> None:
    liealign.write_results(tmp_path, case.prepared, case.alignment, case.solution)
    arrays = liealign.compare(case.truth, case.solution)
    files = liealign.compare(case.folder / "truth.csv", tmp_path / "trajectory.csv")
    assert arrays.epochs == files.epochs == case.solution.time_s.size
    for a, f in zip(arrays.channels, files.channels, strict=True):
        assert f.rms == pytest.approx(a.rms, abs=2e-5)
        if a.rms_over_sigma is not None:
            assert f.rms_over_sigma == pytest.approx(a.rms_over_sigma, rel=0.02)
    assert arrays["horizontal"].rms < 0.03 and 0.0 < arrays["heading"].rms < 0.1
    assert case.solution.filtered is not None
    assert liealign.compare(case.truth, case.solution.filtered)["north"].rms > arrays["north"].rms


def test_what_is_no_trajectory() -> None:
    with pytest.raises(TypeError, match="a int is no trajectory: time_s, lat_deg"):
        liealign.compare(3, track())  # type: ignore[arg-type]
    arrays = {name: array for name, array in vars(track()).items() if name != "rpy_deg"}
    with pytest.raises(TypeError, match="a dict is no trajectory: rpy_deg missing"):
        liealign.compare(track(), arrays)  # type: ignore[arg-type]


def test_frame_and_dict(case: SimulatedCase) -> None:
    c = liealign.compare(case.truth, case.solution)
    frame = c.to_frame()
    assert frame.loc["heading", "rms"] == c["heading"].rms and len(frame) == 10
    assert json.loads(json.dumps(c.to_dict()))["channels"][9]["name"] == "heading"
    with pytest.raises(KeyError):
        c["headin"]
    with pytest.raises(dataclasses.FrozenInstanceError):
        c.epochs = 3  # type: ignore[misc]


# ---- SBET --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sbet(case: SimulatedCase, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sbet")
    toml = case.toml.read_text(encoding="utf-8").replace('formats = ["csv"]', 'formats = ["csv", "sbet"]')
    (case.folder / "SBET.toml").write_text(toml, encoding="utf-8")
    prepared = liealign.prepare_flight(liealign.read_flight(case.folder / "SBET.toml"))
    liealign.write_results(folder, prepared, case.alignment, liealign.process(prepared, case.alignment))
    return folder / "trajectory.sbet"


def test_sbet_holds_what_the_csv_holds(sbet: Path) -> None:
    binary, text = liealign.read_trajectory(sbet), liealign.read_trajectory(sbet.with_suffix(".csv"))
    assert binary.time_s.size == text.time_s.size > 1000
    for name, atol in {
        **{"time_s": 1e-6, "lat_deg": 1e-11, "lon_deg": 1e-11, "height_m": 1e-5, "v_n_mps": 1e-6},
        **{"rpy_deg": 1e-6, "std_p_n_m": 1e-5, "std_v_n_mps": 1e-6, "std_rpy_deg": 1e-6},
    }.items():
        np.testing.assert_allclose(getattr(binary, name), getattr(text, name), atol=atol, err_msg=name)


def test_sbet_without_smrmsg_states_no_sigma(sbet: Path, tmp_path: Path) -> None:
    lonely = tmp_path / "sbet_mission.out"
    lonely.write_bytes(sbet.read_bytes())
    assert np.isnan(liealign.read_trajectory(lonely).std_rpy_deg).all()
    c = liealign.compare(sbet, lonely)
    assert c["heading"].max == 0.0 and c["heading"].rms_over_sigma is None
    # By POSPac's own names, and with fewer records: interpolated.
    records = np.frombuffer(sbet.with_suffix(".smrmsg").read_bytes(), dtype="<f8").reshape(-1, 10)
    (tmp_path / "smrmsg_mission.out").write_bytes(records[::50].tobytes())
    sparse, full = liealign.read_trajectory(lonely), liealign.read_trajectory(sbet)
    np.testing.assert_allclose(sparse.std_p_n_m[::50], full.std_p_n_m[::50])
    inside = np.isfinite(sparse.std_p_n_m)
    assert inside.mean() > 0.9 and np.allclose(sparse.std_p_n_m[inside], full.std_p_n_m[inside], atol=5e-3)


def test_wander_angle_is_taken_off(tmp_path: Path) -> None:
    """North-going at 3 m/s, nose east, in a platform frame whose x axis points 0.2 rad west of north."""
    wander = 0.2
    v = [3.0 * math.cos(wander), 3.0 * math.sin(wander), 0.5]
    row = [10.0, 0.8, -2.0, 100.0, *v, 0.1, -0.05, math.pi / 2 + wander, wander, *[0.0] * 6]
    (tmp_path / "a.sbet").write_bytes(np.array([row], dtype="<f8").tobytes())
    t = liealign.read_trajectory(tmp_path / "a.sbet")
    np.testing.assert_allclose(t.v_n_mps, [[3.0, 0.0, 0.5]], atol=1e-15)
    np.testing.assert_allclose(t.rpy_deg, [[np.rad2deg(0.1), np.rad2deg(-0.05), 90.0]])


def test_heading_sigma_that_is_not_known(sbet: Path, tmp_path: Path) -> None:
    records = np.frombuffer(sbet.with_suffix(".smrmsg").read_bytes(), dtype="<f8").reshape(-1, 10).copy()
    records[:, 9] = 10800.0
    (tmp_path / "t.sbet").write_bytes(sbet.read_bytes())
    (tmp_path / "t.smrmsg").write_bytes(records.tobytes())
    c = liealign.compare(sbet, tmp_path / "t.sbet")
    assert c["heading"].rms_over_sigma is None and c["roll"].rms_over_sigma == 0.0


# ---- the command -------------------------------------------------------------------------------------------


def test_compare_prints_the_table(case: SimulatedCase, sbet: Path, cli: Cli) -> None:
    outcome = cli("compare", case.folder / "truth.csv", sbet, "--from", "1015")
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert re.fullmatch(
        r"overlap   1015.000 s to 1\d+.\d+ s, \d+ epochs; \d+ epochs outside it left out", lines[0]
    )
    assert lines[1].split("  ")[-1].strip() == "rms/sigma"
    c = liealign.compare(case.folder / "truth.csv", sbet, from_s=1015.0)
    for line, e in zip(lines[2:12], c.channels, strict=True):
        assert line.startswith(f"{e.name}, {e.unit}")
        assert f" {e.rms:.4f} " in line and f" {e.max:.4f}" in line
    assert max(map(len, lines)) <= 90 and "-0.0000" not in outcome.out


def test_compare_json(case: SimulatedCase, sbet: Path, main: MainInProcess) -> None:
    outcome = main("compare", case.folder / "truth.csv", sbet, "--json", "--to", "1050")
    content = json.loads(outcome.out)
    assert outcome.code == 0 and content["end_time_s"] == pytest.approx(1050.0, abs=0.011)
    heading = next(channel for channel in content["channels"] if channel["name"] == "heading")
    assert set(heading) == {
        *("name", "unit", "mean", "rms", "p95", "max"),
        *("within_1_sigma", "within_2_sigma", "rms_over_sigma", "rms_relative_sigma"),
    }
    assert heading["unit"] == "deg" and 0.0 < heading["rms"] < 0.2


# ---- what cannot be used -----------------------------------------------------------------------------------

WANTED = f"expected the columns {STATE}"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], f": the file is empty; expected the header {STATE}"),
        (["", "# only a comment"], f": the file is empty; expected the header {STATE}"),
        ([STATE], ":1:1: no row follows the header; expected at least one row of numbers"),
        ([STATE.replace("vn_", "v_n_"), f"1,{ROW}"], f":1:1: column vn_mps [m/s] is missing; {WANTED}"),
        ([f"{STATE},lat_deg", f"1,{ROW},2"], ":1:11: column lat_deg is there twice; expected it once"),
        ([STATE, "1,48"], ":2:2: the row has 2 cells; expected 10 as in the header"),
        ([STATE, f"1,{ROW}", f"2,{ROW},5"], ":3:11: the row has 11 cells; expected 10 as in the header"),
        (
            [STATE, f"1,{ROW}", "2," + ROW.replace("16.3", "nan")],
            ':3:3: lon_deg is "nan"; expected a number from -180 to 360 [deg]',
        ),
        (
            [STATE, "1," + ROW.replace("48.2", "91")],
            ':2:2: lat_deg is "91"; expected a number from -90 to 90 [deg]',
        ),
        ([STATE, "1," + ROW.replace("200", "")], ':2:4: height_m is ""; expected a finite number [m]'),
        ([STATE, "1," + ROW.replace("200", "2oo")], ':2:4: height_m is "2oo"; expected a finite number [m]'),
        ([STATE, f"inf,{ROW}"], ':2:1: time_s is "inf"; expected a finite number [s]'),
        (
            ["# made by hand", STATE, f"2,{ROW}", "", f"1,{ROW}"],
            ":5:1: time_s is 1, not after that of line 3; "
            "expected increasing times: sort the file by time_s or remove the line",
        ),
        (
            [f"{STATE},std_n_m", f"1,{ROW},", f"2,{ROW},-1"],
            ':3:11: std_n_m is "-1"; expected a finite number, 0 or more, or nothing [m]',
        ),
        (
            [f"{STATE},std_n_m", f"1,{ROW},nan"],
            ':2:11: std_n_m is "nan"; expected a finite number, 0 or more, or nothing [m]',
        ),
    ],
)
def test_bad_csv(lines: list[str], message: str, main: MainInProcess, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    write_csv(tmp_path / "good.csv", f"1,{ROW}", f"2,{ROW}")
    for arguments in (("bad.csv", "good.csv"), ("good.csv", "bad.csv")):
        outcome = main("compare", *arguments)
        assert (outcome.code, outcome.out, outcome.err) == (1, "", f"bad.csv{message}\n")


def test_csv_as_people_write_it(tmp_path: Path) -> None:
    """Byte order mark, CRLF, comments, blanks, quotes, other columns, empty sigmas."""
    text = f'# mine\r\n\r\nnote, {STATE},std_heading_deg\r\nx, 1 ,{ROW},\r\n"a,b",2,{ROW},0.5\r\n'
    (tmp_path / "t.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    t = liealign.read_trajectory(tmp_path / "t.csv")
    np.testing.assert_array_equal(t.time_s, [1.0, 2.0])
    np.testing.assert_array_equal(t.rpy_deg, [[0.0, 0.0, 90.0]] * 2)
    np.testing.assert_array_equal(t.std_rpy_deg[:, 2], [np.nan, 0.5])
    assert np.isnan(t.std_p_n_m).all()


def put(column: int, value: float) -> Callable[[np.ndarray], bytes]:
    def spoil(records: np.ndarray) -> bytes:
        records[1, column] = value
        return bytes(records.astype("<f8").tobytes())

    return spoil


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda r: b"", "the file is empty; expected records of 17 doubles"),
        (lambda r: r.tobytes()[:-8], "has 264 bytes; expected a multiple of 136: records of 17 doubles"),
        (put(1, math.nan), "record 2: is not finite; is this the file of another format?"),
        (put(0, 0.0), "record 2: time is 0.0, not after 1.0; expected increasing times"),
        (put(1, 48.2), "record 2: the latitude is 48.2 rad; expected radians: is this an SBET?"),
        (put(2, 7.0), "record 2: the longitude is 7 rad; expected radians: is this an SBET?"),
    ],
)
def test_bad_sbet(
    spoil: Callable[[np.ndarray], bytes], message: str, main: MainInProcess, tmp_path: Path
) -> None:
    records = np.zeros((2, 17))
    records[:, 0] = [1.0, 2.0]
    (tmp_path / "x.sbet").write_bytes(spoil(records))
    outcome = main("compare", "x.sbet", "x.sbet")
    assert (outcome.code, outcome.out, outcome.err) == (1, "", f"x.sbet: {message}\n")


def test_paths_that_are_no_trajectories(main: MainInProcess, tmp_path: Path) -> None:
    write_csv(tmp_path / "good.csv", f"1,{ROW}", f"2,{ROW}")
    write_csv(tmp_path / "later.csv", f"11,{ROW}", f"12,{ROW}")
    (tmp_path / "x.bin").write_bytes(b"\xff\xfe\x00")
    for arguments, message in (
        (("none.csv", "good.csv"), "none.csv: cannot be read: No such file or directory"),
        (("none.sbet", "good.csv"), "none.sbet: cannot be read: No such file or directory"),
        ((".", "good.csv"), ".: is a folder; name the file in it, such as trajectory.csv"),
        (("x.bin", "good.csv"), "x.bin: is not UTF-8 text; expected a trajectory.csv, or an SBET named"),
        (
            ("good.csv", "later.csv"),
            "no epoch to compare: good.csv covers 1.000 s to 2.000 s, later.csv covers",
        ),
    ):
        outcome = main("compare", *arguments)
        assert (outcome.code, outcome.out, outcome.err.count("\n")) == (1, "", 1)
        assert outcome.err.startswith(message)
    assert main("compare", "good.csv").code == 2
