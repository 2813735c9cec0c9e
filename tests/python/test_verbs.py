"""`liealign config`, `imus` and `simulate`: what they print is of use, garbage is refused in one line."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sysconfig
import tomllib
from pathlib import Path

import liealign
import pytest
from liealign.cli import FLAGS

from .conftest import LEVER_ARM, Cli, Files, MainInProcess


def refused(main: MainInProcess, *arguments: str | Path) -> str:
    outcome = main(*arguments)
    assert (outcome.code, outcome.out) == (1, ""), outcome
    assert outcome.err.count("\n") == 1, outcome.err
    return outcome.err.removesuffix("\n")


def printed(main: MainInProcess, *arguments: str | Path) -> str:
    outcome = main(*arguments)
    assert (outcome.code, outcome.err) == (0, "")
    return outcome.out


def terminal(folder: Path, *arguments: str) -> str:
    """What a terminal of 80 columns shows."""
    ours, theirs = pty.openpty()
    script = Path(sysconfig.get_path("scripts")) / "liealign"
    with subprocess.Popen(
        [str(script), *arguments], cwd=folder, stdout=theirs, env={**os.environ, "COLUMNS": "80"}
    ) as process:
        os.close(theirs)
        shown = b""
        try:
            while piece := os.read(ours, 65536):
                shown += piece
        except OSError:  # how a terminal whose other end is closed reads on Linux
            pass
        assert process.wait(timeout=60) == 0
    os.close(ours)
    return shown.decode()


# ---- config ------------------------------------------------------------------------------------------------


def test_config_is_the_default_config(main: MainInProcess, tmp_path: Path) -> None:
    text = printed(main, "config")
    (tmp_path / "FLIGHT.toml").write_text(text, encoding="utf-8")
    assert liealign.read_config(tmp_path / "FLIGHT.toml") == liealign.Config()
    assert max(map(len, text.splitlines())) <= 100
    assert "\x1b" not in text


def test_config_names_every_key_its_meaning_and_its_flag(main: MainInProcess) -> None:
    text = printed(main, "config")
    unwrapped = text.replace("\n# ", " ")
    for field in liealign.config_fields():
        assert re.search(rf"^(# )?{field.key.partition('.')[2]} = ", text, re.MULTILINE), field.key
        assert field.meaning in unwrapped, field.key
        assert not field.unit or f"[{field.unit}]" in text
    for flag in FLAGS.values():
        assert f"\n# {flag.name}: " in text


def test_printed_config_runs(files: Files, main: MainInProcess) -> None:
    (files.folder / "ALL.toml").write_text(printed(main, "config"), encoding="utf-8")
    lever_arm = map(str, LEVER_ARM)
    with_files = ["--imu", "imu.csv", "--gnss", "gnss.csv", "--lever-arm", *lever_arm]
    assert printed(main, "align", "ALL.toml", *with_files).startswith("heading   aligned: 137.0")


def test_config_of_a_file_is_that_of_the_file(files: Files, main: MainInProcess) -> None:
    text = printed(main, "config", "FLIGHT.toml")
    (files.folder / "ALL.toml").write_text(text, encoding="utf-8")
    ours, again = (liealign.read_config(files.folder / name) for name in ("FLIGHT.toml", "ALL.toml"))
    assert ours == again != liealign.Config()
    assert "grid_step_deg = 45.0  # default 15.0\n" in text
    assert 'latency_s = "auto"\n' in text
    assert "# gyro_arw_deg_sqrt_h = 0.09  # from the profile adis16495\n" in text


def test_config_of_a_file_elsewhere_keeps_its_names(
    files: Files, main: MainInProcess, tmp_path: Path
) -> None:
    """What is printed belongs beside the file that it was read from."""
    main.folder = tmp_path.parent
    assert 'file = "imu.csv"\n' in printed(main, "config", f"{tmp_path.name}/FLIGHT.toml")


def test_config_shows_an_angle_of_zero_as_given(files: Files, main: MainInProcess) -> None:
    (files.folder / "F.toml").write_text("[align]\nheading_guess_deg = 0\n", encoding="utf-8")
    assert "\nheading_guess_deg = 0.0\n" in printed(main, "config", "F.toml")


def test_config_search(main: MainInProcess) -> None:
    text = printed(main, "config", "--search", "LATENCY")
    assert set(tomllib.loads(text)) == {"gnss"} and "latency_s" in text and "lever_arm" not in text
    assert "lever_arm_b_m" in printed(main, "config", "--search", "--lever-arm")
    assert refused(main, "config", "--search", "ltency") == (
        'no key is about "ltency"; did you mean "latency"?'
    )


def test_config_json(files: Files, main: MainInProcess) -> None:
    fields = {field["key"]: field for field in json.loads(printed(main, "config", "--json"))}
    assert list(fields) == [field.key for field in liealign.config_fields()]
    assert fields["gnss.latency_s"] == {
        "key": "gnss.latency_s",
        "type": 'number in [-10, 10] or "auto"',
        "unit": "s",
        "meaning": "Delay of the time stamps, t_true = time_s - latency_s (auto: estimated from the flight)",
        "default": "auto",
        "flag": "--gnss-latency",
    }
    assert fields["gnss.lever_arm_b_m"]["default"] == [0.0, 0.0, 0.0]
    assert fields["output.rate_hz"]["default"] is None and fields["output.rate_hz"]["flag"] is None
    values = {f["key"]: f["value"] for f in json.loads(printed(main, "config", "FLIGHT.toml", "--json"))}
    assert values["gnss.lever_arm_b_m"] == list(LEVER_ARM) and values["output.rate_hz"] is None


def test_config_refuses(files: Files, main: MainInProcess) -> None:
    assert refused(main, "config", "none.toml") == "none.toml: cannot be read: No such file or directory"
    (files.folder / "F.toml").write_text("[gnss]\nlatncy_s = 1\n", encoding="utf-8")
    assert refused(main, "config", "F.toml").startswith(
        'F.toml:2:1: unknown key "gnss.latncy_s"; did you mean'
    )


# ---- imus --------------------------------------------------------------------------------------------------


def test_imus_lists_every_profile(main: MainInProcess) -> None:
    lines = printed(main, "imus").splitlines()
    for profile in liealign.imu_profiles():
        (line,) = (line for line in lines if line.startswith(f"{profile.name} "))
        assert line.endswith(profile.description)
        assert line.count("~") == len([name for name in profile.estimated.split(", ") if name])
    assert lines[2].split()[1:7] == ["0.09", "0.008", "0.8", "3.2", "10", "0.5"]


def test_imus_json(main: MainInProcess) -> None:
    profiles = json.loads(printed(main, "imus", "--json"))
    assert [p["name"] for p in profiles] == [p.name for p in liealign.imu_profiles()]
    one = json.loads(printed(main, "imus", "--json", "bmi088"))
    assert one in profiles and one["estimated"] == ["accel_bias_instability_ug"]


@pytest.mark.parametrize("name", [profile.name for profile in liealign.imu_profiles()])
def test_one_imu_is_toml_with_its_numbers(name: str, main: MainInProcess) -> None:
    text = printed(main, "imus", name.upper())
    (profile,) = (p for p in liealign.imu_profiles() if p.name == name)
    keys = tomllib.loads(text)["imu"]
    assert keys.pop("model") == name and len(keys) == 6
    for key, value in keys.items():
        assert value == pytest.approx(getattr(profile, key), rel=1e-5)
        assert (f"{key} = " in text) and (
            (key in profile.estimated) == bool(re.search(f"{key} .*estimate", text))
        )
    liealign.make_config({f"imu.{key}": value for key, value in keys.items()})
    assert profile.source in text.replace("\n# ", " ")


def test_unknown_imu(main: MainInProcess) -> None:
    assert (
        refused(main, "imus", "icm42688") == 'no IMU profile is named "icm42688"; did you mean "icm42688p"?'
    )
    assert refused(main, "imus", "x").startswith('no IMU profile is named "x"; expected one of: adis16495, ')


def test_terminal_of_80_columns(tmp_path: Path) -> None:
    for verb in ("imus", "config"):
        lines = re.sub(r"\x1b\[[\d;]*m", "", terminal(tmp_path, verb)).splitlines()
        assert len(lines) > 15
        assert max(map(len, lines)) <= (80 if verb == "imus" else 100)


# ---- simulate ----------------------------------------------------------------------------------------------

SHORT = (
    "--duration",
    "90",
    "--parked-before",
    "12",
    "--parked-after",
    "5",
    "--imu-rate",
    "50",
    "--altitude",
    "15",
)


def test_simulated_flight_runs_and_compares(cli: Cli) -> None:
    outcome = cli(
        *("simulate", "-o", "a flight", *SHORT, "--heading", "-20", "--gnss-rate", "4", "--gnss-velocity"),
        *("--lever-arm", "0.2", "-0.1", "-0.4", "--gnss-latency", "0.05", "--imu-model", "bmi088"),
    )
    assert (outcome.code, outcome.err) == (0, "")
    flight = cli.folder / "a flight"
    assert {path.name for path in flight.iterdir()} == {"FLIGHT.toml", "imu.csv", "gnss.csv", "truth.csv"}
    assert "90 s, 4501 IMU samples, 361 fixes" in outcome.out
    values = liealign.config_entries(liealign.read_config(flight / "FLIGHT.toml"))
    assert values["gnss.lever_arm_b_m"] == [0.2, -0.1, -0.4]
    assert (values["gnss.latency_s"], values["imu.model"]) == (0.05, "bmi088")
    # The commands it suggests are those that a shell would run.
    for line in (line for line in outcome.out.splitlines() if line.startswith(("next", "then"))):
        assert "'a flight/" in line
        words = line.partition(" liealign ")[2].replace("'", "").replace("a flight", "a@flight").split()
        done = cli(*(word.replace("@", " ") for word in words))
        assert (done.code, done.err) == (0, ""), done
        if words[0] == "run":
            assert re.match(r"heading   aligned: (339|340)\.", done.out)
            assert "warning" not in done.out


def test_same_seed_same_bits(main: MainInProcess, tmp_path: Path) -> None:
    for folder, seed in (("a", "7"), ("b", "7"), ("c", "8")):
        assert printed(main, "simulate", *SHORT, "--seed", seed, "--quiet", "-o", folder) == ""
    for name in ("imu.csv", "gnss.csv", "truth.csv", "FLIGHT.toml"):
        a, b, c = ((tmp_path / folder / name).read_bytes() for folder in "abc")
        assert a == b
        assert (a == c) == (name == "FLIGHT.toml")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--duration", "nan"], '--duration is "nan"; expected a number from 1 to 7200 [s]'),
        (["--duration", "1e9"], '--duration is "1e9"; expected a number from 1 to 7200 [s]'),
        (["--duration", "-5"], '--duration is "-5"; expected a number from 1 to 7200 [s]'),
        (["--duration="], '--duration is ""; expected a number from 1 to 7200 [s]'),
        (["--duration", "inf"], '--duration is "inf"; expected a number from 1 to 7200 [s]'),
        (["--imu-rate", "0"], '--imu-rate is "0"; expected a number from 10 to 1000 [Hz]'),
        (["--gnss-rate", "fast"], '--gnss-rate is "fast"; expected a number from 0.1 to 50 [Hz]'),
        (["--gnss-std", "1", "2"], '--gnss-std is "1 2"; expected 3 numbers from 0.001 to 100 [m]'),
        (["--gnss-std", "1", "2", "0"], '--gnss-std is "1 2 0"; expected 3 numbers from 0.001 to 100 [m]'),
        (["--outliers", "1.5"], '--outliers is "1.5"; expected a number from 0 to 1'),
        (["--seed", "1.5"], '--seed is "1.5"; expected a whole number, 0 or more'),
        (["--seed", "-1"], '--seed is "-1"; expected a whole number, 0 or more'),
        (["--imu-model", "bmi88"], '--imu-model is "bmi88", which is no profile; did you mean "bmi088"?'),
        (
            ["--duration", "7200"],
            "--duration 7200 at --imu-rate 200 makes 1440000 samples; expected at most 1000000; "
            "shorten the flight or lower the rate",
        ),
    ],
)
def test_simulate_refuses(arguments: list[str], message: str, main: MainInProcess, tmp_path: Path) -> None:
    assert refused(main, "simulate", "-o", "out", *arguments) == message
    assert not list(tmp_path.iterdir())


def test_what_the_engine_refuses_is_said_in_flags(main: MainInProcess) -> None:
    message = refused(main, "simulate", "-o", "out", "--duration", "10")
    assert message.startswith("drone flight: --duration is 10.000000; expected at least 9")
    assert "_" not in message
    assert "lower --speed, --gusts" in refused(main, "simulate", "-o", "out", "--speed", "30", "--gusts", "5")


@pytest.mark.parametrize("verb", ["simulate", "demo"])
def test_a_real_flight_is_not_overwritten(verb: str, main: MainInProcess, tmp_path: Path) -> None:
    (tmp_path / "imu.csv").write_text("mine", encoding="utf-8")
    assert refused(main, verb, "-o", tmp_path).startswith(
        f"{tmp_path}/imu.csv: exists, and without truth.csv"
    )
    assert refused(main, verb, "-o", tmp_path / "imu.csv").endswith("-o expects a folder for the results")
    assert [path.name for path in tmp_path.iterdir()] == ["imu.csv"]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("lon_deg", float("nan")),
        ("duration_s", 1e9),
        ("start_time_s", float("inf")),
        ("parked_before_s", 1e300),
    ],
)
def test_engine_refuses_flights_that_cannot_be(field: str, value: float) -> None:
    with pytest.raises(liealign.Error, match="drone flight: "):
        liealign.simulate_flight(
            liealign.DroneFlight(**{field: value}), liealign.GnssErrors(), liealign.Config(), 1
        )
