"""A flight from numpy arrays, for logs in a format of your own: `python from_arrays.py`.

The arrays come from the simulator here; put those of your own reader in their place.
"""

from __future__ import annotations

import liealign
import numpy as np


def main() -> None:
    simulated = liealign.simulate_flight(
        liealign.DroneFlight(duration_s=100.0, parked_before_s=15.0, rate_hz=100.0, heading_deg=250.0),
        liealign.GnssErrors(rate_hz=2.0, l_ba_b=(0.1, -0.05, -0.3)),
        liealign.make_config({"imu.model": "bmi088"}),
        seed=1,
    )
    imu, gnss = simulated.flight.imu(), simulated.flight.gnss()

    # One row per sample or fix. All times on one scale; what the axes and units are is said in the config.
    flight = liealign.flight_from_arrays(
        imu_time_s=imu["time_s"],  # (n,) s
        omega_ib_b_rps=imu["omega_ib_b_rps"],  # (n, 3) rad/s
        f_ib_b_mps2=imu["f_ib_b_mps2"],  # (n, 3) m/s^2, about -9.8 on z at rest (z down)
        gnss_time_s=gnss["time_s"],  # (m,) s
        lat_deg=gnss["lat_deg"],
        lon_deg=gnss["lon_deg"],
        height_m=gnss["height_m"],  # above the ellipsoid, not above the sea
        std_p_n_m=np.sqrt(np.einsum("kii->ki", gnss["P_n_m2"])),  # (m, 3) north, east, down
        config={
            "imu.model": "bmi088",  # liealign imus lists them
            "imu.axes": "FRD",  # "FLU" where z points up
            "gnss.lever_arm_b_m": [0.1, -0.05, -0.3],  # the antenna is 30 cm above the IMU
        },
    )

    alignment = liealign.align_heading(flight)
    print(f"{alignment.verdict}: {alignment.heading_deg:.3f} deg, sigma {alignment.heading_std_deg} deg")
    solution = liealign.process(flight, alignment)
    for name in ("time_s", "lat_deg", "rpy_deg", "std_rpy_deg", "C_b_e"):
        print(f"solution.{name}: {getattr(solution, name).shape}")


if __name__ == "__main__":
    main()
