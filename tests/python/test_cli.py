"""The contract of the command line: exit codes, flags, what goes to stdout and what to stderr."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import liealign
import pytest
from liealign import cli as command_line

from .conftest import Cli, Files

RESULTS = {
    "trajectory.csv",
    "biases.csv",
    "innovations.csv",
    "alignment.json",
    "summary.json",
    "config.toml",
}
REPORT = {"report.html"}  # from Python only, liealign-post writes none


def written(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_run_prints_the_verdict_first_and_writes_the_files(files: Files, cli: Cli) -> None:
    outcome = cli("run", "FLIGHT.toml", "-o", "out/of/many")
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert lines[0].startswith("heading   aligned: 137.0")
    # a line that goes on, of the velocities' latency or the relative sigma, has no label
    assert [line.split()[0] for line in lines[1:] if not line.startswith(" ")] == [
        "start",
        "latency",
        "fixes",
        "P_RMS",
        "sigma",
        "span",
        "results",
    ]
    assert "\x1b" not in outcome.out
    assert written(files.folder / "out/of/many") == RESULTS | REPORT


def test_quiet_is_silent(files: Files, cli: Cli) -> None:
    outcome = cli("run", "FLIGHT.toml", "--quiet", "--filtered", "-o", "out")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    assert written(files.folder / "out") == RESULTS | REPORT | {"filtered.csv"}
    assert cli("align", "FLIGHT.toml", "--quiet").out == ""


def test_flags_without_a_config(files: Files, cli: Cli) -> None:
    outcome = cli(
        *(
            "run",
            "-o",
            "out",
            "--imu",
            "imu.csv",
            "--lever-arm",
            "0.1",
            "-0.05",
            "-0.3",
            "--gnss",
            "gnss.csv",
        ),
        *("--imu-model", "adis16495", "--gnss-latency", "-0.001", "--axes", "FRD", "--start", "static"),
        *("--heading-guess", "-220", "--heading-guess-std", "30"),
        *("--imu-noise-scale", "1.5", "--gnss-std-scale", "auto"),
    )
    assert (outcome.code, outcome.err) == (0, "")
    used = liealign.config_entries(liealign.read_config(files.folder / "out" / "config.toml"))
    assert used["gnss.lever_arm_b_m"] == [0.1, -0.05, -0.3]
    assert used["gnss.latency_s"] == -0.001
    assert (used["align.heading_guess_deg"], used["align.heading_guess_std_deg"]) == (-220.0, 30.0)
    assert (used["imu.noise_scale"], used.get("gnss.std_scale")) == (1.5, None)
    assert (used["imu.axes"], used["align.start"], used["imu.model"]) == ("FRD", "static", "adis16495")


def test_flags_are_stronger_than_the_config(files: Files, cli: Cli) -> None:
    outcome = cli("run", "FLIGHT.toml", "--lever-arm=-0.1,0.2,0", "--quiet", "-o", "out")
    assert outcome.code == 0
    used = liealign.config_entries(liealign.read_config(files.folder / "out" / "config.toml"))
    assert used["gnss.lever_arm_b_m"] == [-0.1, 0.2, 0.0]
    assert used["align.grid_step_deg"] == 45.0


@pytest.mark.parametrize(
    ("words", "joined"),
    [
        (["--lever-arm", "0.1", "-0.05", "-.3"], ["--lever-arm=0.1 -0.05 -.3"]),
        (["--lever-arm=-1e-2", "2", "-3", "x"], ["--lever-arm=-1e-2 2 -3", "x"]),
        (["--lever-arm", "1", "--quiet"], ["--lever-arm=1", "--quiet"]),
        (["--lever-arm", "1", "-o", "2"], ["--lever-arm=1", "-o", "2"]),
        (["--gnss-latency", "-0.15", "F.toml"], ["--gnss-latency=-0.15", "F.toml"]),
        (["--lever-arm"], ["--lever-arm"]),
        (["run", "--", "--lever-arm", "1", "2"], ["run", "--", "--lever-arm", "1", "2"]),
    ],
)
def test_words_of_a_flag_are_joined(words: list[str], joined: list[str]) -> None:
    assert command_line.join_words(words) == joined


def test_align_prints_one_json_document(files: Files, cli: Cli) -> None:
    outcome = cli("align", "FLIGHT.toml", "--json")
    assert (outcome.code, outcome.err) == (0, "")
    alignment = json.loads(outcome.out)
    assert alignment["verdict"] == "aligned"
    assert alignment["heading_deg"] == pytest.approx(137.0, abs=0.2)
    assert written(files.folder) == {"FLIGHT.toml", "imu.csv", "gnss.csv"}


def test_align_prints_the_heading(files: Files, cli: Cli) -> None:
    outcome = cli("align", "FLIGHT.toml", "--lever-arm", "0", "0", "0")
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert lines[0].startswith("heading ")
    assert "warning   gnss.lever_arm_b_m is zero: the antenna is taken to be at the IMU" in lines


def cut_to_rest(files: Files) -> None:
    """Only the parked part and the first second after it: nothing shows the heading."""
    for name in ("imu.csv", "gnss.csv"):
        header, *rows = files.lines(name)
        files.write(name, [header, *(row for row in rows if float(row.split(",")[0]) <= 1014.6)])


def test_require_aligned_exits_with_4_and_writes_nothing(files: Files, cli: Cli) -> None:
    cut_to_rest(files)
    relaxed = cli("align", "FLIGHT.toml", "--json")
    assert relaxed.code == 0
    alignment = json.loads(relaxed.out)
    assert alignment["verdict"] == "unobservable" and alignment["heading_std_deg"] is None
    outcome = cli("run", "FLIGHT.toml", "--require-aligned", "-o", "out")
    assert (outcome.code, outcome.out) == (4, "")
    assert outcome.err.startswith('the heading is "unobservable", --require-aligned demands "aligned": ')
    assert outcome.err.count("\n") == 1
    assert not (files.folder / "out").exists()
    both = cli("align", "FLIGHT.toml", "--json", "--require-aligned")
    assert both.code == 4 and json.loads(both.out) == alignment


def test_require_aligned_is_content_with_aligned(files: Files, cli: Cli) -> None:
    assert cli("align", "FLIGHT.toml", "--require-aligned").code == 0


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "FLIGHT.toml"],
        ["run", "FLIGHT.toml", "-o"],
        ["run", "FLIGHT.toml", "-o", "out", "--no-such-flag"],
        ["run", "FLIGHT.toml", "second.toml", "-o", "out"],
        ["run", "-o", "out", "--lever-arm"],
        ["fly"],
    ],
)
def test_usage_errors_exit_with_2(files: Files, cli: Cli, arguments: list[str]) -> None:
    outcome = cli(*arguments)
    assert (outcome.code, outcome.out) == (2, "")
    assert "Error: " in outcome.err and "Traceback" not in outcome.err
    assert not (files.folder / "out").exists()


@pytest.mark.parametrize(
    ("raised", "code", "line"),
    [
        (liealign.NumericalError("a covariance"), 3, "a covariance\n"),
        (liealign.InputError("two\nlines"), 1, "two lines\n"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (PermissionError(13, "Permission denied", "x.csv"), 1, "x.csv: Permission denied\n"),
    ],
)
def test_what_is_raised_becomes_a_code_and_a_line(
    raised: BaseException,
    code: int,
    line: str,
    files: Files,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise raised

    monkeypatch.setattr(liealign._core, "prepare_flight", fail)
    monkeypatch.setattr(sys, "argv", ["liealign", "align", str(files.folder / "FLIGHT.toml")])
    with pytest.raises(SystemExit) as stop:
        command_line.main()
    assert (stop.value.code, *capfd.readouterr()) == (code, "", line)


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_interrupt_exits_with_130_and_writes_nothing(tmp_path: Path) -> None:
    script = Path(sysconfig.get_path("scripts")) / "liealign"
    process = subprocess.Popen(
        [str(script), "demo", "-o", "demo"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with process:
        written_input = tmp_path / "demo" / "FLIGHT.toml"
        for _ in range(6000):  # the run itself takes some tenths of a second
            if written_input.exists() or process.poll() is not None:
                break
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, b"interrupted\n")
    assert not (tmp_path / "demo" / "out").exists()


def test_version_says_what_is_built_in(cli: Cli) -> None:
    outcome = cli("--version")
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.splitlines() == [
        f"liealign {liealign.__version__}",
        f"OpenMP: {'yes' if liealign.has_openmp else 'absent'}",
        "Ceres: absent",
        "liealign-post: the standalone executable is not part of this build",
    ]


def test_demo_shows_the_truth(cli: Cli) -> None:
    outcome = cli("demo")
    assert (outcome.code, outcome.err) == (0, "")
    demo = cli.folder / "liealign-demo"
    assert written(demo) == {"FLIGHT.toml", "imu.csv", "gnss.csv", "truth.csv", "out"}
    assert written(demo / "out") == RESULTS | REPORT | {"filtered.csv"}
    rows = {
        line.split(",")[0].strip(): line.split()[-2:] for line in outcome.out.splitlines() if ", " in line
    }
    channels = ("north", "east", "down", "horizontal", "vn", "ve", "vd", "roll", "pitch", "heading")
    for name in channels:
        smoothed, filtered = map(float, rows[name])
        assert 0.0 < smoothed < filtered < 0.5, name
    assert "liealign-demo/FLIGHT.toml" in outcome.out
