"""liealign-post against `liealign run`: the same flags, files, bits, texts and exit codes.

The executable is build/release/liealign-post (`make post`), or what LIEALIGN_POST names.
"""

from __future__ import annotations

import os
import pty
import re
import subprocess
from pathlib import Path

import liealign
import pytest
from liealign.cli import FLAGS

from .conftest import ROOT, Cli, Files, Outcome, SimulatedCase
from .test_car import FLAGS as CAR_FLAGS
from .test_cli import RESULTS


class Post(Cli):
    """The standalone executable, run in a folder, with nothing of Python in its environment."""

    def __init__(self, folder: Path, executable: Path) -> None:
        super().__init__(folder)
        self.executable = executable

    def __call__(self, *arguments: str | Path) -> Outcome:
        command = [str(self.executable), *map(str, arguments)]
        done = subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, check=False, timeout=300, env={}
        )
        return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def executable() -> Path:
    named = os.environ.get("LIEALIGN_POST")
    path = Path(named) if named else ROOT / "build" / "release" / "liealign-post"
    if not path.is_file():
        assert not named, f"LIEALIGN_POST names {named}, which is no file"
        pytest.skip(f"the standalone executable is not at {path}; run make post, or set LIEALIGN_POST")
    return path.resolve()


@pytest.fixture
def post(tmp_path: Path, executable: Path) -> Post:
    return Post(tmp_path, executable)


def same_files(one: Path, other: Path, names: set[str]) -> None:
    for folder in (one, other):
        assert {path.name for path in folder.iterdir()} == names
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def same_run(cli: Cli, post: Post, *arguments: str | Path, names: set[str] = RESULTS) -> str:
    """Run both with the same arguments; everything must agree. Returns what was printed."""
    expected = cli("run", *arguments, "-o", "out")
    assert (expected.code, expected.err) == (0, "")
    (cli.folder / "out" / "report.html").unlink()  # from Python only
    (cli.folder / "out").rename(cli.folder / "python")
    assert post(*arguments, "-o", "out") == expected
    same_files(cli.folder / "python", cli.folder / "out", names)
    return expected.out


def same_refusal(cli: Cli, post: Post, *arguments: str | Path, code: int = 1) -> str:
    expected = cli("run", *arguments, "-o", "out")
    assert (expected.code, expected.out) == (code, "")
    assert post(*arguments, "-o", "out") == expected
    assert not (post.folder / "out").exists()
    return expected.err.removesuffix("\n")


def test_a_flight_from_its_config(files: Files, cli: Cli, post: Post) -> None:
    printed = same_run(cli, post, "FLIGHT.toml")
    assert printed.startswith("heading   aligned: 137.0")


def test_a_config_in_another_folder(case: SimulatedCase, cli: Cli, post: Post) -> None:
    """With the velocity of the fixes and filtered.csv, as its FLIGHT.toml asks; the files are beside it."""
    relative = os.path.relpath(case.folder, cli.folder)
    same_run(cli, post, f".//{relative}/./FLIGHT.toml", names=RESULTS | {"filtered.csv"})


def test_the_same_bits_as_the_python_api(case: SimulatedCase, post: Post) -> None:
    liealign.write_results(post.folder / "api", case.prepared, case.alignment, case.solution)
    assert post(case.toml, "-o", "post", "--quiet") == Outcome(0, "", "")
    same_files(post.folder / "api", post.folder / "post", RESULTS | {"filtered.csv"})


def test_flags_without_a_config(files: Files, cli: Cli, post: Post) -> None:
    same_run(
        cli,
        post,
        *("--imu", "imu.csv", "--lever-arm", "0.1", "-.05", "-0.3", "--gnss", "gnss.csv"),
        *("--imu-model", "adis16495", "--gnss-latency", "-0.001", "--axes", "FRD", "--start", "static"),
        *("--heading-guess", "-220", "--heading-guess-std", "30", "--filtered"),
        *("--imu-noise-scale", "+1.5", "--gnss-std-scale", "auto"),
        names=RESULTS | {"filtered.csv"},
    )


def test_flags_are_stronger_than_the_config_and_the_last_one_counts(
    files: Files, cli: Cli, post: Post
) -> None:
    same_run(
        cli,
        post,
        *("--gnss-latency=-1", "--lever-arm=-0.1,0.2,0", "--gnss-latency", "0.002", "FLIGHT.toml"),
        *("--heading-guess", "130"),
    )


def test_used_config_runs_again_to_the_same_bits(files: Files, post: Post) -> None:
    assert post("FLIGHT.toml", "-o", "results/first", "--quiet").code == 0
    assert post("results/first/config.toml", "-o", "results/second/", "--quiet").code == 0
    same_files(files.folder / "results" / "first", files.folder / "results" / "second", RESULTS)


def test_formats_span_and_another_point(files: Files, cli: Cli, post: Post) -> None:
    with (files.folder / "FLIGHT.toml").open("a", encoding="utf-8") as toml:
        toml.write(
            "[output]\nreference_point_b_m = [0.2, 0, -0.1]\nboresight_deg = [1, -90, 2.5]\nrate_hz = 25\n"
        )
    sbet = {"trajectory.sbet", "trajectory.smrmsg", "trajectory.sbet.json"}
    span = ("--start-time", "1020", "--stop-time", "1060.5")
    same_run(cli, post, "--format", "sbet", "csv", "FLIGHT.toml", *span, names=RESULTS | sbet)


def test_car(data_dir: Path, cli: Cli, post: Post) -> None:
    car = data_dir / "rtk_car_drive0708"
    same_run(cli, post, "--imu", car / "imu.csv", "--gnss", car / "gnss.csv", *CAR_FLAGS)


def test_apm_x8(data_dir: Path, cli: Cli, post: Post) -> None:
    plane = data_dir / "apm_x8_testlog2"
    flags = ("--gnss-latency", "0.32", "--imu-noise-scale", "10", "--format", "csv", "sbet")
    sbet = {"trajectory.sbet", "trajectory.smrmsg", "trajectory.sbet.json"}
    same_run(
        cli, post, "--imu", plane / "imu.csv", "--gnss", plane / "gnss.csv", *flags, names=RESULTS | sbet
    )


def test_p4rtk_without_a_rest_is_refused_with_the_same_words(data_dir: Path, cli: Cli, post: Post) -> None:
    drone = data_dir / "p4rtk_full_dot7"
    assert same_refusal(
        cli, post, "--imu", drone / "imu.csv", "--gnss", drone / "gnss.csv", "--start", "static"
    )


# ---- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("latency_s =", "latncy_s =", "FLIGHT.toml:7:1: unknown key "),
        ('latency_s = "auto"', '  latency_s = "atuo"', "FLIGHT.toml:7:3: gnss.latency_s is "),
        ("[align]", "[alingn]", 'FLIGHT.toml:9:1: unknown section "alingn"'),
        ("[0.1, -0.05, -0.3]", "[0.1, -0.05]", "FLIGHT.toml:6:1: gnss.lever_arm_b_m is "),
        ("[0.1, -0.05, -0.3]", "[0.1, true, -0.3]", "FLIGHT.toml:6:1: gnss.lever_arm_b_m is "),
        ("grid_step_deg = 45.0", "grid_step_deg = [[1, 2], [3]]", "FLIGHT.toml:10:1: align.grid_step_deg is"),
        ("[imu]", "rast.zaru_std_dps = 1.0\n[imu]", 'FLIGHT.toml:1:6: unknown section "rast"'),
        ('[imu]\nfile = "imu.csv"', '[imu]\nfile = "imü.csv"', "imü.csv: cannot be read: "),
    ],
)
def test_bad_config(files: Files, cli: Cli, post: Post, old: str, new: str, place: str) -> None:
    """toml++ knows the column of the last part of a dotted key, Python's scan only that of its line."""
    toml = files.folder / "FLIGHT.toml"
    text = toml.read_text(encoding="utf-8")
    assert old in text
    toml.write_text(text.replace(old, new), encoding="utf-8")
    expected, found = cli("run", "FLIGHT.toml", "-o", "out"), post("FLIGHT.toml", "-o", "out")
    assert found.err.startswith(place)
    if "rast" in new:
        expected = Outcome(expected.code, expected.out, expected.err.replace(":1:1:", ":1:6:"))
    if "true" in new or "[[" in new:  # the value as each reader writes it
        expected, found = (
            Outcome(o.code, o.out, re.sub(" is .*; expected", " is ...; expected", o.err))
            for o in (expected, found)
        )
    assert found == expected


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[imu]\nfile = imu.csv\n", "FLIGHT.toml:2:"),
        ('[imu]\nfile = "a"\nfile = "b"\n', "FLIGHT.toml:3:"),
        ("[imu\n", "FLIGHT.toml:1:"),
    ],
)
def test_text_that_is_no_toml(files: Files, cli: Cli, post: Post, text: str, place: str) -> None:
    """The reason in the middle is the parser's own."""
    (files.folder / "FLIGHT.toml").write_text(text, encoding="utf-8")
    for outcome in (cli("run", "FLIGHT.toml", "-o", "out"), post("FLIGHT.toml", "-o", "out")):
        assert (outcome.code, outcome.out) == (1, "")
        assert outcome.err.startswith(place) and ": not valid TOML: " in outcome.err
        assert outcome.err.endswith('; expected lines such as key = 1.5 or key = "text"\n')
        assert outcome.err.count("\n") == 1


def test_bytes_that_are_no_text(files: Files, post: Post) -> None:
    (files.folder / "FLIGHT.toml").write_bytes(b"[imu]\n\xff\xfe")
    outcome = post("FLIGHT.toml", "-o", "out")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (1, "", 1)
    assert re.match(r"FLIGHT\.toml:\d+:\d+: not valid TOML: .*utf-8", outcome.err)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--gnss-latency", "fast"],
        ["--gnss-latency", "-11"],
        ["--lever-arm", "0.1", "-0.2"],
        ["--lever-arm", "0.1", "x", "-0.2"],
        ["--lever-arm=0.1", "-0.2", "-1e9"],
        ["--imu-noise-scale", "-1"],
        ["--imu-noise-scale", "nan"],
        ["--start", "statc"],
        ["--axes", "FRU"],
        ["--imu-model", "tactical"],
        ["--imu", "no/such.csv"],
        ["--start", "flying"],
        ["--format", "csv", "pos"],
        ["--format=sbet,las"],
        ["--start-time", "late"],
        ["--stop-time", "10"],
        ["--heading-guess-std", "30"],
    ],
)
def test_bad_flag_value(files: Files, cli: Cli, post: Post, arguments: list[str]) -> None:
    assert same_refusal(cli, post, "FLIGHT.toml", *arguments)


def test_bad_input_files(files: Files, cli: Cli, post: Post) -> None:
    assert same_refusal(cli, post, "FLIGHT2.toml").startswith("FLIGHT2.toml: cannot be read: ")
    assert same_refusal(cli, post, ".").startswith(".: cannot be read: ")
    assert same_refusal(cli, post, "--imu", "imu.csv").startswith("gnss.file is not given; ")
    lines = files.lines("imu.csv")
    files.write("imu.csv", [lines[0].replace("gyro_y_rps", "gyro_y_dps"), *lines[1:]])
    assert same_refusal(cli, post, "./FLIGHT.toml").startswith("imu.csv:1:3: column gyro_y_rps is missing; ")


def test_no_overlap(files: Files, cli: Cli, post: Post) -> None:
    header, *rows = files.lines("gnss.csv")
    files.write("gnss.csv", [header, *(f"9{row}" for row in rows)])
    assert same_refusal(cli, post, "FLIGHT.toml").startswith("the IMU and the GNSS log do not overlap: ")


def test_output_that_is_a_file(files: Files, cli: Cli, post: Post) -> None:
    for output in ("imu.csv", "imu.csv/out"):
        expected = cli("run", "FLIGHT.toml", "-o", output)
        assert expected.code == 1
        assert post("FLIGHT.toml", "-o", output) == expected


def test_require_aligned(files: Files, cli: Cli, post: Post) -> None:
    for name in ("imu.csv", "gnss.csv"):
        header, *rows = files.lines(name)
        files.write(name, [header, *(row for row in rows if float(row.split(",")[0]) <= 1014.0)])
    message = same_refusal(cli, post, "FLIGHT.toml", "--require-aligned", code=4)
    assert message.startswith('the heading is "unobservable", --require-aligned demands "aligned": ')
    printed = same_run(cli, post, "FLIGHT.toml")
    assert printed.startswith("heading   unobservable: not determined, at ")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["FLIGHT.toml"],
        ["FLIGHT.toml", "-o"],
        ["FLIGHT.toml", "-o", "out", "--no-such-flag"],
        ["FLIGHT.toml", "second.toml", "-o", "out"],
        ["-o", "out", "--lever-arm"],
    ],
)
def test_usage_errors_exit_with_2(files: Files, post: Post, arguments: list[str]) -> None:
    outcome = post(*arguments)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.count("\n") <= 2
    assert not (files.folder / "out").exists()


# ---- the front ends ----------------------------------------------------------------------------------------


def test_flags_are_those_of_liealign_run(post: Post) -> None:
    flags = set(re.findall(r"--[a-z-]+", post("--help").out))
    assert flags == {flag.name for flag in FLAGS.values()} | {
        *("--output", "--require-aligned", "--quiet", "--help", "--version")
    }


def test_version(post: Post) -> None:
    assert post("--version") == Outcome(0, f"liealign-post {liealign.__version__}\n", "")


def test_progress_is_one_rewritten_line_on_a_terminal(case: SimulatedCase, post: Post) -> None:
    """It appears after a second, so that the work here takes longer: tens of thousands of candidates."""
    toml = case.toml.read_text(encoding="utf-8").replace("grid_step_deg = 30.0", "grid_step_deg = 0.01")
    (case.folder / "SLOW.toml").write_text(toml, encoding="utf-8")
    ours, theirs = pty.openpty()
    command = [str(post.executable), str(case.folder / "SLOW.toml"), "-o", "out"]
    with subprocess.Popen(command, cwd=post.folder, stdout=subprocess.PIPE, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        try:
            while piece := os.read(ours, 4096):
                shown += piece
        except OSError:  # how a terminal whose other end is closed reads on Linux
            pass
        assert process.wait(timeout=300) == 0
    os.close(ours)
    assert b"\raligning the heading" not in shown.split(b"\x1b[K")[-1]
    assert re.fullmatch(rb"(\r\x1b\[K(aligning the heading|filtering and smoothing): \d+ %)+\r\x1b\[K", shown)
