"""Every script in examples/ runs on a short flight, prints what it says, and is listed in their README."""

from __future__ import annotations

import re
import subprocess
import sys

from .conftest import ROOT, Files

EXAMPLES = ROOT / "examples"


def run(files: Files, name: str, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments],
        cwd=files.folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_all_of_them_are_tested_and_listed() -> None:
    scripts = {path.name for path in EXAMPLES.glob("*.py")}
    listed = re.findall(r"\((\w+\.py)\)", (EXAMPLES / "README.md").read_text(encoding="utf-8"))
    assert sorted(listed) == sorted(scripts)
    assert scripts == {name.removeprefix("test_") + ".py" for name in globals() if name in TESTS}


def test_run_flight(files: Files) -> None:
    out = run(files, "run_flight.py", "FLIGHT.toml", "out")
    assert out.startswith("aligned: 137.0")
    assert re.search(r"the camera ends at 48\.(199999|200000)", out)
    assert (files.folder / "out" / "trajectory.csv").is_file()


def test_heading_only(files: Files) -> None:
    out = run(files, "heading_only.py", "FLIGHT.toml")
    assert out.startswith("aligned: ")
    low, high = map(float, re.findall(r"95 % within ([\d.]+) to ([\d.]+) deg", out)[0])
    assert 136.8 < low < high < 137.2
    assert " deg has 100.0 % of the probability" in out


def test_from_arrays(files: Files) -> None:
    out = run(files, "from_arrays.py")
    assert re.match(r"aligned: (249\.|250\.)", out)
    # The last fix is on the last sample: the estimated latency decides whether it is inside.
    assert re.search(r"solution\.C_b_e: \((9951|10001), 3, 3\)", out)


def test_compare_with_truth(files: Files) -> None:
    out = run(files, "compare_with_truth.py", "flight")
    rms = {name: float(number) for name, number in re.findall(r"^(\w+) +rms ([\d.]+)", out, re.MULTILINE)}
    assert len(rms) == 10
    assert 0.0 < rms["horizontal"] < 0.02 and 0.0 < rms["heading"] < 0.2
    assert "the heading is worst at 1" in out


def test_camera_pose(files: Files) -> None:
    out = run(files, "camera_pose.py", "FLIGHT.toml", "out")
    poses = int(out.split()[0])
    assert 990 <= poses <= 1001
    assert (files.folder / "out" / "trajectory.sbet").stat().st_size == 136 * poses
    assert out.count("exposure at ") == 3


TESTS = {name for name in globals() if name.startswith("test_") and not name.startswith("test_all")}
