"""Heading alignment and smoothed GNSS/INS trajectories for drones with one antenna, on SE_2(3).

    import liealign

    flight = liealign.read_flight("FLIGHT.toml")
    alignment = liealign.align_heading(flight)
    solution = liealign.process(flight, alignment)

Conventions
-----------
- Frames: `b` body = IMU, forward-right-down; `n` local north-east-down; `e` ECEF (WGS 84); `i` inertial.
- `C_b_e` takes components in b to components in e; `p_eb_e` is the position of b against e, in e components.
- Arrays have one row per epoch: (n,), vectors (n, 3), matrices (n, 3, 3). Their names end in their unit.
- Heading is clockwise from true north, [0, 360); roll and pitch take the body to NED, in the order ZYX.
- Times are seconds on one continuous scale; t_true = time_s - latency_s.
- Heights are above the ellipsoid. Standard deviations are one sigma.
- Errors are `liealign.Error`, a ValueError: `InputError`, `ConfigError`, `NumericalError`, `Cancelled`.
  Warnings are data: `Solution.warnings`. Nothing is printed.
"""

from __future__ import annotations

from liealign._core import (
    BaroErrors,
    Cancelled,
    CandidateScore,
    Config,
    ConfigError,
    ConfigField,
    DroneFlight,
    Error,
    Flight,
    GnssErrors,
    HeadingCandidate,
    HeadingResult,
    HeadingSearch,
    HeadingSearchOptions,
    ImuErrorSizes,
    ImuProfile,
    InputError,
    NumericalError,
    PreparedFlight,
    SimulatedFlight,
    TypedInErrors,
    __version__,
    config_entries,
    config_fields,
    dump_config,
    ecef_from_geodetic,
    evaluate_candidates,
    geodetic_from_ecef,
    has_ceres,
    has_openmp,
    heading_search_options,
    imu_profiles,
    prepare_flight,
    random_flight,
    simulate_flight,
    with_clock_of_flight,
    write_flight,
)
from liealign.comparison import ChannelError, Comparison, compare
from liealign.drivers import align_heading, process, write_results
from liealign.flight import flight_from_arrays, make_config, read_config, read_flight
from liealign.ranking import FilterRank, rank_by_p_rms
from liealign.report import report_html, write_report
from liealign.simulation import simulate_along
from liealign.solution import Alignment, Innovations, Receiver, Solution, Trajectory
from liealign.track import Track, read_trajectory

__all__ = [
    "Alignment",
    "BaroErrors",
    "Cancelled",
    "CandidateScore",
    "ChannelError",
    "Comparison",
    "Config",
    "ConfigError",
    "ConfigField",
    "DroneFlight",
    "Error",
    "FilterRank",
    "Flight",
    "GnssErrors",
    "HeadingCandidate",
    "HeadingResult",
    "HeadingSearch",
    "HeadingSearchOptions",
    "ImuErrorSizes",
    "ImuProfile",
    "Innovations",
    "InputError",
    "NumericalError",
    "PreparedFlight",
    "Receiver",
    "SimulatedFlight",
    "Solution",
    "Track",
    "Trajectory",
    "TypedInErrors",
    "__version__",
    "align_heading",
    "compare",
    "config_entries",
    "config_fields",
    "dump_config",
    "ecef_from_geodetic",
    "evaluate_candidates",
    "flight_from_arrays",
    "geodetic_from_ecef",
    "has_ceres",
    "has_openmp",
    "heading_search_options",
    "imu_profiles",
    "make_config",
    "prepare_flight",
    "process",
    "random_flight",
    "rank_by_p_rms",
    "read_config",
    "read_flight",
    "read_trajectory",
    "report_html",
    "simulate_along",
    "simulate_flight",
    "with_clock_of_flight",
    "write_flight",
    "write_report",
    "write_results",
]
