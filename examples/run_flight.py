"""Run a flight through the Python API: `python run_flight.py FLIGHT.toml OUT`."""

from __future__ import annotations

import sys

import liealign


def main(toml: str, out: str) -> None:
    flight = liealign.read_flight(toml)
    alignment = liealign.align_heading(flight)
    print(f"{alignment.verdict}: {alignment.heading_deg:.3f} deg, sigma {alignment.heading_std_deg} deg")

    solution = liealign.process(flight, alignment)
    for warning in solution.warnings:
        print(f"warning: {warning}")
    print(f"median sigma of the heading: {solution.summary['median_std_heading_deg']:.3f} deg")

    # The trajectory is that of the IMU; another point is a lever arm away (forward, right, down).
    lat_deg, lon_deg, height_m = solution.point_geodetic([0.0, 0.0, 0.15])
    print(f"the camera ends at {lat_deg[-1]:.8f} {lon_deg[-1]:.8f}, {height_m[-1]:.3f} m")

    liealign.write_results(out, flight, alignment, solution)


if __name__ == "__main__":
    main(*sys.argv[1:])
