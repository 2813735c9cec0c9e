"""Shared flights: one simulated and run once per session, and the real recordings where they are at hand."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import liealign
import numpy as np
import pytest
from liealign import cli as command_line

if TYPE_CHECKING:
    from liealign._core import TruthColumns

ROOT = Path(__file__).resolve().parents[2]
LEVER_ARM = (0.1, -0.05, -0.3)


@dataclass(frozen=True)
class SimulatedCase:
    """A short flight as files, as an object, and what came of it."""

    folder: Path
    simulated: liealign.SimulatedFlight
    truth: TruthColumns
    prepared: liealign.PreparedFlight
    alignment: liealign.Alignment
    solution: liealign.Solution

    @property
    def toml(self) -> Path:
        return self.folder / "FLIGHT.toml"


@pytest.fixture(scope="session")
def case(tmp_path_factory: pytest.TempPathFactory) -> SimulatedCase:
    """100 s of drone flight at 100 Hz, GNSS at 2 Hz with velocity; all of it run once."""
    folder = tmp_path_factory.mktemp("flight")
    simulated = liealign.simulate_flight(
        liealign.DroneFlight(
            duration_s=100.0, parked_before_s=15.0, parked_after_s=8.0, rate_hz=100.0, altitude_m=20.0
        ),
        liealign.GnssErrors(rate_hz=2.0, l_ba_b=LEVER_ARM, velocity=True),
        liealign.make_config({"output.filtered": True, "align.grid_step_deg": 30.0}),
        seed=3,
    )
    liealign.write_flight(str(folder), simulated)
    prepared = liealign.prepare_flight(liealign.read_flight(folder / "FLIGHT.toml"))
    alignment = liealign.align_heading(prepared)
    solution = liealign.process(prepared, alignment)
    return SimulatedCase(folder, simulated, simulated.truth(), prepared, alignment, solution)


@dataclass(frozen=True)
class Files:
    """A copy of the simulated input as lines of text, to be spoilt."""

    folder: Path

    def lines(self, name: str) -> list[str]:
        return (self.folder / name).read_text(encoding="utf-8").splitlines()

    def write(self, name: str, lines: list[str]) -> None:
        (self.folder / name).write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    def set_cell(self, name: str, line: int, column: int, text: str) -> None:
        """Line and column (cell) as in messages: counted from 1, the header is line 1."""
        lines = self.lines(name)
        cells = lines[line - 1].split(",")
        cells[column - 1] = text
        lines[line - 1] = ",".join(cells)
        self.write(name, lines)


@pytest.fixture
def files(case: SimulatedCase, tmp_path: Path) -> Files:
    """imu.csv, gnss.csv and a minimal FLIGHT.toml of the simulated flight, in a folder of their own."""
    for name in ("imu.csv", "gnss.csv"):
        (tmp_path / name).write_bytes((case.folder / name).read_bytes())
    (tmp_path / "FLIGHT.toml").write_text(
        f'[imu]\nfile = "imu.csv"\nmodel = "adis16495"\n'
        f'[gnss]\nfile = "gnss.csv"\nlever_arm_b_m = {list(LEVER_ARM)}\nlatency_s = "auto"\n'
        f'[align]\nstart = "auto"\ngrid_step_deg = 45.0\n',
        encoding="utf-8",
    )
    return Files(tmp_path)


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


class Cli:
    """The installed console script, run in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, *arguments: str | Path) -> Outcome:
        script = Path(sysconfig.get_path("scripts")) / "liealign"
        done = subprocess.run(
            [str(script), *map(str, arguments)],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
            env={key: value for key, value in os.environ.items() if key not in {"FORCE_COLOR", "COLUMNS"}},
        )
        return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.fixture
def cli(tmp_path: Path) -> Cli:
    return Cli(tmp_path)


class MainInProcess(Cli):
    """The same by calling main() in this process, which saves the start of an interpreter."""

    def __init__(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
    ) -> None:
        super().__init__(folder)
        self.monkeypatch, self.capfd = monkeypatch, capfd

    def __call__(self, *arguments: str | Path) -> Outcome:
        self.monkeypatch.chdir(self.folder)
        self.monkeypatch.setattr(sys, "argv", ["liealign", *map(str, arguments)])
        self.capfd.readouterr()
        with pytest.raises(SystemExit) as stop:
            command_line.main()
        assert isinstance(stop.value.code, int)
        return Outcome(stop.value.code, *self.capfd.readouterr())


@pytest.fixture
def main(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> MainInProcess:
    return MainInProcess(tmp_path, monkeypatch, capfd)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The real recordings: LIEALIGN_DATA, or shared/data beside the checkout."""
    folder = Path(os.environ.get("LIEALIGN_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"the recordings are not at {folder}; set LIEALIGN_DATA to their folder")
    return folder


def wrap_deg(angle: np.ndarray) -> np.ndarray:
    return (angle + 180.0) % 360.0 - 180.0
