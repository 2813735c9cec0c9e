"""TAES Fig. 7: the scenarios, and how hard they are flown."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

import liealign
import numpy as np

from flights import Array
from section import Json, Section, markdown_table, number, picture, save_figure, subplots
from studies import SCENARIOS, table_1

OTHERS: dict[str, Json] = {
    "survey lines, crabwise": {"kind": "lines"},
    "hover": {"kind": "hover"},
    "parked": {"kind": "parked"},
}
EARTH_M = 6.371e6


def drones() -> dict[str, liealign.DroneFlight]:
    """The three of table1.toml, and the other kinds with the same numbers."""
    study = table_1()
    flights = {name: study.case(name).flight for name in SCENARIOS}
    for name, fields in OTHERS.items():
        drone = study.case(SCENARIOS[0]).flight
        drone.kind = fields["kind"]
        flights[name] = drone
    return flights


def motion(truth: Any) -> tuple[Array, Json]:
    """North, east, up from the pad [m], and the peaks of the motion."""
    lat, lon = np.radians(truth["lat_deg"]), np.radians(truth["lon_deg"])
    place = np.stack(
        [
            (lat - lat[0]) * EARTH_M,
            (lon - lon[0]) * EARTH_M * np.cos(lat[0]),
            truth["height_m"] - truth["height_m"][0],
        ],
        axis=1,
    )
    dt = truth["time_s"][1] - truth["time_s"][0]
    speed, acceleration = truth["v_n_mps"], np.gradient(truth["v_n_mps"], dt, axis=0)
    jerk = np.gradient(acceleration, dt, axis=0)
    tilt = np.hypot(truth["rpy_deg"][:, 0], truth["rpy_deg"][:, 1])

    def peak(vectors: Array) -> float:
        return round(float(np.linalg.norm(vectors, axis=1).max()), 6)

    return place, {
        "speed_mps": peak(speed),
        "acceleration_mps2": peak(acceleration),
        "jerk_mps3": peak(jerk),
        "tilt_deg": float(tilt.max()),
    }


def experiment(quick: bool, jobs: int) -> Section:
    """Six flights, one of each kind."""
    figure, axes = subplots(1, 4, 7.4, 2.2)
    peaks = {}
    for name, drone in drones().items():
        simulated = liealign.simulate_flight(drone, liealign.GnssErrors(), liealign.make_config(), 1)
        place, peaks[name] = motion(simulated.truth())
        if len(peaks) <= 4:
            ax = axes[0][len(peaks) - 1]
            ax.plot(place[::20, 1], place[::20, 0], color="C0", lw=0.8)
            ax.set(title=name, xlabel="east [m]", aspect="equal")
    axes[0][0].set_ylabel("north [m]")
    table = markdown_table(
        ["peak of", "speed [m/s]", "acceleration [m/s²]", "jerk [m/s³]", "tilt [deg]"],
        ([name, *(number(value) for value in peak.values())] for name, peak in peaks.items()),
    )
    text = f"""
The paper draws its scenarios without sizes. Ours are flown by a multirotor: commanded velocities go
through three moving averages, so
that acceleration and jerk stay bounded; gusts push it about; the thrust that makes all that, against drag
and a wind of 2 m/s, gives roll and
pitch; and the nose keeps an angle to the course, since a multirotor need not fly where it points. Each
flight is parked before and after.

{picture("fig7.png", "Ground tracks of the scenarios")}

{table}
"""
    return Section(
        name="fig7",
        title="TAES Fig. 7: the scenarios",
        text=text,
        numbers=peaks,
        figures=(save_figure(figure, "fig7.png", quick),),
    )
