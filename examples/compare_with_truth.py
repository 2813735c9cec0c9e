"""How good is it, and are the sigmas true? `python compare_with_truth.py OUT`.

Simulates a flight into the folder, runs it, and compares the result with the truth. The truth may as well be
the trajectory of a better IMU: any trajectory.csv or SBET of the same point and axes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import liealign


def main(out: str) -> None:
    folder = Path(out)
    simulated = liealign.simulate_flight(
        liealign.DroneFlight(duration_s=120.0, rate_hz=100.0),
        liealign.GnssErrors(rate_hz=2.0, l_ba_b=(0.1, -0.05, -0.3)),
        liealign.Config(),
        seed=2,
    )
    liealign.write_flight(out, simulated)

    flight = liealign.read_flight(folder / "FLIGHT.toml")
    alignment = liealign.align_heading(flight)
    solution = liealign.process(flight, alignment)
    liealign.write_results(folder / "out", flight, alignment, solution)

    # From files; solution and simulated.truth() do as well. In flight only: at rest it is easy to be right.
    comparison = liealign.compare(
        folder / "truth.csv", folder / "out" / "trajectory.csv", from_s=alignment.start_time_s
    )
    for c in comparison.channels:
        ratio = "" if c.rms_over_sigma is None else f"{c.rms_over_sigma:.1f} of its sigma"
        print(f"{c.name:<10} rms {c.rms:.4f} {c.unit:<4} {ratio}")

    # Every error at every epoch is there, to be plotted.
    worst = abs(comparison.error_rpy_deg[:, 2]).argmax()
    print(f"the heading is worst at {comparison.time_s[worst]:.2f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
