"""Poses of a camera, for photogrammetry: `python camera_pose.py FLIGHT.toml OUT`.

Writes OUT/trajectory.csv and OUT/trajectory.sbet of the camera's projection centre, 10 times a second, and
prints the pose at three exposures.
"""

from __future__ import annotations

import sys
from typing import Any

import liealign
import numpy as np

CAMERA: dict[str, Any] = {
    # From the IMU to the projection centre: forward, right, down.
    "output.reference_point_b_m": [0.12, 0.0, 0.08],
    # The camera's axes in the body: roll, pitch, yaw. This one looks down 30 deg.
    "output.boresight_deg": [0.0, -30.0, 0.0],
    "output.rate_hz": 10.0,
    "output.formats": ["csv", "sbet"],
}


def main(toml: str, out: str) -> None:
    flight = liealign.read_flight(toml, **CAMERA)
    alignment = liealign.align_heading(flight)
    solution = liealign.process(flight, alignment)
    liealign.write_results(out, flight, alignment, solution)
    print(f"{solution.time_s.size} poses in {out}/trajectory.sbet and {out}/trajectory.csv")

    # At the shutter's own times: interpolate angles unwrapped, so that 359 to 1 deg passes through north.
    exposure_s = alignment.start_time_s + np.array([10.25, 11.25, 12.25])
    heading = np.interp(exposure_s, solution.time_s, np.unwrap(solution.rpy_deg[:, 2], period=360.0)) % 360.0
    height = np.interp(exposure_s, solution.time_s, solution.height_m)
    for time, h, psi in zip(exposure_s, height, heading, strict=True):
        print(f"exposure at {time:.3f} s: height {h:.3f} m, heading {psi:.3f} deg")


if __name__ == "__main__":
    main(*sys.argv[1:])
