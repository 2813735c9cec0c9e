"""Bad input: the full text on one line of stderr, exit code 1, and nothing half written left behind."""

from __future__ import annotations

from pathlib import Path

import pytest

from .conftest import Cli, Files, MainInProcess, Outcome


def refused(main: MainInProcess, *arguments: str, code: int = 1) -> str:
    """The one line on stderr of a run that must fail; nothing may be written."""
    before = sorted(path.name for path in main.folder.rglob("*"))
    outcome = main("run", *(arguments or ("FLIGHT.toml",)), "-o", "out")
    assert outcome.code == code, outcome
    assert outcome.out == ""
    assert outcome.err.endswith("\n") and outcome.err.count("\n") == 1, outcome.err
    assert sorted(path.name for path in main.folder.rglob("*")) == before
    return outcome.err.removesuffix("\n")


IMU_HEADER = "time_s,gyro_x_rps,gyro_y_rps,gyro_z_rps,accel_x_mps2,accel_y_mps2,accel_z_mps2"
GNSS_HEADER = "time_s,lat_deg,lon_deg,height_m,std_n_m,std_e_m,std_d_m"


@pytest.mark.parametrize(
    ("name", "line", "column", "text", "message"),
    [
        ("imu.csv", 42, 3, "nan", 'imu.csv:42:3: gyro_y_rps is "nan"; expected a finite number [rad/s]'),
        ("imu.csv", 42, 7, "-9,81", "imu.csv:42:8: the row has 8 cells; expected 7 as in the header"),
        ("imu.csv", 2, 5, "abc", 'imu.csv:2:5: accel_x_mps2 is "abc"; expected a finite number [m/s^2]'),
        ("gnss.csv", 5, 5, "0", 'gnss.csv:5:5: std_n_m is "0"; expected a number above 0 [m]'),
        ("gnss.csv", 5, 7, "-0.03", 'gnss.csv:5:7: std_d_m is "-0.03"; expected a number above 0 [m]'),
        ("gnss.csv", 7, 2, "91.5", 'gnss.csv:7:2: lat_deg is "91.5"; expected a number from -90 to 90 [deg]'),
        ("gnss.csv", 7, 1, "inf", 'gnss.csv:7:1: time_s is "inf"; expected a finite number [s]'),
    ],
)
def test_bad_cell(
    files: Files, main: MainInProcess, name: str, line: int, column: int, text: str, message: str
) -> None:
    files.set_cell(name, line, column, text)
    assert refused(main) == message


def test_missing_column(files: Files, main: MainInProcess) -> None:
    lines = files.lines("imu.csv")
    files.write("imu.csv", [lines[0].replace("gyro_y_rps", "gyro_y_dps"), *lines[1:]])
    found = IMU_HEADER.replace("gyro_y_rps", "gyro_y_dps")
    assert refused(main) == (
        f"imu.csv:1:3: column gyro_y_rps is missing; found {found}; did you mean gyro_y_dps? "
        "It must be named gyro_y_rps and be in rad/s"
    )


def test_time_going_back(files: Files, main: MainInProcess) -> None:
    lines = files.lines("imu.csv")
    lines[10], lines[11] = lines[11], lines[10]
    files.write("imu.csv", lines)
    later, earlier = (line.split(",")[0] for line in lines[10:12])
    assert refused(main) == (
        f"imu.csv:12:1: time_s is {earlier}, before {later} on line 11; "
        "times must not go back: sort the file by time_s or remove the line"
    )


def test_repeated_time_with_other_values(files: Files, main: MainInProcess) -> None:
    lines = files.lines("gnss.csv")
    time = lines[3].split(",")[0]
    files.set_cell("gnss.csv", 5, 1, time)
    assert refused(main) == (
        f"gnss.csv:5:1: time_s is {time} as on line 4, but lat_deg differs; "
        "expected one row for each time: remove one of the two lines"
    )


def test_repeated_row_is_dropped_with_a_warning(files: Files, main: MainInProcess) -> None:
    lines = files.lines("imu.csv")
    files.write("imu.csv", [*lines[:20], lines[19], *lines[20:]])
    outcome = main("run", "FLIGHT.toml", "-o", "out")
    assert (outcome.code, outcome.err) == (0, "")
    warnings = [line for line in outcome.out.splitlines() if line.startswith("warning")]
    assert warnings == ["warning   imu.csv:21:1: 1 row repeats the row before it exactly and was dropped"]


@pytest.mark.parametrize(("name", "header"), [("imu.csv", IMU_HEADER), ("gnss.csv", GNSS_HEADER)])
def test_empty_file(files: Files, main: MainInProcess, name: str, header: str) -> None:
    (files.folder / name).write_text("", encoding="utf-8")
    assert refused(main) == f"{name}: the file is empty; expected the header {header}"
    (files.folder / name).write_text(f"{header}\n", encoding="utf-8")
    message = f"{name}:1:1: no row follows the header; expected at least one row of numbers"
    assert refused(main) == message


def test_no_overlap(files: Files, main: MainInProcess) -> None:
    header, *rows = files.lines("gnss.csv")
    moved = []
    for row in rows:
        time, _, rest = row.partition(",")
        moved.append(f"{float(time) + 5000.0:.3f},{rest}")
    files.write("gnss.csv", [header, *moved])
    assert refused(main) == (
        "the IMU and the GNSS log do not overlap: imu.csv covers 1000.000 s to 1100.000 s, "
        "gnss.csv 6000.000 s to 6100.000 s (after gnss.latency_s); bring both to one time scale"
    )


def test_the_console_script_does_the_same(files: Files, cli: Cli) -> None:
    files.set_cell("imu.csv", 42, 3, "nan")
    outcome = cli("run", "FLIGHT.toml", "-o", "out")
    message = 'imu.csv:42:3: gyro_y_rps is "nan"; expected a finite number [rad/s]\n'
    assert outcome == Outcome(1, "", message)
    assert not (files.folder / "out").exists()


def test_missing_files(files: Files, main: MainInProcess) -> None:
    assert refused(main, "FLIGHT2.toml") == "FLIGHT2.toml: cannot be read: No such file or directory"
    (files.folder / "gnss.csv").unlink()
    assert refused(main) == "gnss.csv: cannot be read: No such file or directory"
    assert refused(main, "--imu", "imu.csv") == "gnss.file is not given; name the GNSS log (--gnss FILE)"


def test_paths_in_messages_are_as_the_user_wrote_them(files: Files, tmp_path: Path) -> None:
    files.set_cell("imu.csv", 42, 3, "nan")
    outcome: Outcome = Cli(tmp_path.parent)(
        "run", f"{tmp_path.name}/FLIGHT.toml", "-o", f"{tmp_path.name}/out"
    )
    assert outcome.err.startswith(f"{tmp_path.name}/imu.csv:42:3: ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "latency_s =",
            "latncy_s =",
            'FLIGHT.toml:7:1: unknown key "gnss.latncy_s"; did you mean "gnss.latency_s"?',
        ),
        (
            'latency_s = "auto"',
            '  latency_s = "atuo"',
            'FLIGHT.toml:7:3: gnss.latency_s is "atuo"; expected a number in [-10, 10] or "auto"; '
            'did you mean "auto"?',
        ),
        (
            "[align]",
            "[alingn]",
            'FLIGHT.toml:9:1: unknown section "alingn" in key "alingn.start"; did you mean "align"?',
        ),
        (
            "grid_step_deg = 45.0",
            "grid_step_deg = 1979-05-27",
            "FLIGHT.toml:10:1: align.grid_step_deg is datetime.date(1979, 5, 27); "
            "expected true or false, a number, a string, or a list of numbers",
        ),
        (
            'start = "auto"',
            "start = auto",
            "FLIGHT.toml:9:9: not valid TOML: Invalid value; "
            'expected lines such as key = 1.5 or key = "text"',
        ),
        (
            "grid_step_deg = 45.0",
            "start = 3",
            "FLIGHT.toml:10:10: not valid TOML: Cannot overwrite a value; expected lines such as key = 1.5 "
            'or key = "text"',
        ),
        (
            "[0.1, -0.05, -0.3]",
            "[0.1, -0.05]",
            "FLIGHT.toml:6:1: gnss.lever_arm_b_m is [0.1, -0.05]; expected 3 numbers in [-100, 100]",
        ),
    ],
)
def test_bad_config(files: Files, main: MainInProcess, old: str, new: str, message: str) -> None:
    toml = files.folder / "FLIGHT.toml"
    text = toml.read_text(encoding="utf-8")
    assert old in text
    toml.write_text(text.replace(old, new), encoding="utf-8")
    assert refused(main) == message


def test_config_that_is_no_text(files: Files, main: MainInProcess) -> None:
    (files.folder / "FLIGHT.toml").write_bytes(b"[imu]\n\xff\xfe")
    assert refused(main) == "FLIGHT.toml: byte 6 is not UTF-8; save the file as UTF-8 text"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--gnss-latency", "fast"],
            '--gnss-latency: gnss.latency_s is "fast"; expected a number in [-10, 10] or "auto"',
        ),
        (
            ["--lever-arm", "0.1", "-0.2"],
            "--lever-arm: gnss.lever_arm_b_m is [0.1, -0.2]; expected 3 numbers in [-100, 100]",
        ),
        (
            ["--lever-arm", "0.1", "x", "-0.2"],
            '--lever-arm: gnss.lever_arm_b_m is "0.1 x -0.2"; expected 3 numbers in [-100, 100]',
        ),
        (
            ["--imu-noise-scale", "-1"],
            '--imu-noise-scale: imu.noise_scale is -1.0; expected a number > 0 or "auto"',
        ),
        (
            ["--start", "statc"],
            '--start: align.start is "statc"; expected one of "auto", "static", "moving"; '
            'did you mean "static"?',
        ),
        (
            ["--heading-guess-std", "30"],
            "align.heading_guess_std_deg is 30.0 without align.heading_guess_deg; give the guess as well "
            "(--heading-guess DEG), or drop align.heading_guess_std_deg (--heading-guess-std)",
        ),
    ],
)
def test_bad_flag_value(files: Files, main: MainInProcess, arguments: list[str], message: str) -> None:
    assert refused(main, "FLIGHT.toml", *arguments) == message


def test_unknown_model_lists_the_profiles(files: Files, main: MainInProcess) -> None:
    message = refused(main, "FLIGHT.toml", "--imu-model", "icm4268p")
    assert message.startswith('--imu-model: imu.model is "icm4268p"; expected one of "adis16495", ')
    assert message.endswith('; did you mean "icm42688p"?')


def test_left_handed_axes_are_named(files: Files, main: MainInProcess) -> None:
    message = refused(main, "FLIGHT.toml", "--axes", "FRU")
    assert message.startswith('--axes: imu.axes is "FRU", a left-handed set of axes; expected')


def test_flight_without_rest(files: Files, main: MainInProcess) -> None:
    for name in ("imu.csv", "gnss.csv"):
        header, *rows = files.lines(name)
        files.write(name, [header, *(row for row in rows if 1025.0 < float(row.split(",")[0]) < 1080.0)])
    assert refused(main, "FLIGHT.toml", "--start", "static") == (
        'align.start is "static" and the log holds no rest of at least 5.0 s with fixes; '
        'see the keys of [rest], or set align.start = "auto" (--start auto)'
    )


def test_output_that_is_a_file(files: Files, main: MainInProcess) -> None:
    (files.folder / "out").write_text("mine", encoding="utf-8")
    assert refused(main) == "out: is a file; -o expects a folder for the results"
    assert (files.folder / "out").read_text(encoding="utf-8") == "mine"
