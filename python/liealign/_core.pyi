"""The engine. Angles in rad and SI units unless a name ends in another unit."""

from collections.abc import Callable, Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ProgressCallback = Callable[[int, int], bool | None]
# key, value, line, column; line 0: unknown
Entry = tuple[str, Any, int, int]

__version__: str
has_openmp: bool
has_ceres: bool

class Error(ValueError): ...
class InputError(Error): ...
class ConfigError(Error): ...
class NumericalError(Error): ...
class Cancelled(Error): ...

def geodetic_from_ecef(p_e_m: ArrayLike) -> tuple[Array, Array, Array]: ...
def ecef_from_geodetic(lat_deg: ArrayLike, lon_deg: ArrayLike, height_m: ArrayLike) -> Array: ...

class ImuProfile:
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def gyro_arw_deg_sqrt_h(self) -> float: ...
    @property
    def accel_vrw_mps_sqrt_h(self) -> float: ...
    @property
    def gyro_bias_instability_deg_h(self) -> float: ...
    @property
    def accel_bias_instability_ug(self) -> float: ...
    @property
    def gyro_bias_turn_on_deg_h(self) -> float: ...
    @property
    def accel_bias_turn_on_mg(self) -> float: ...
    @property
    def source(self) -> str: ...
    @property
    def estimated(self) -> str: ...

def imu_profiles() -> list[ImuProfile]: ...

class Config:
    def __init__(self) -> None: ...

class ConfigField:
    @property
    def key(self) -> str: ...
    @property
    def type(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def meaning(self) -> str: ...
    @property
    def default_value(self) -> str: ...

def config_fields() -> list[ConfigField]: ...
def apply_config(base: Config, entries: Sequence[Entry], source: str) -> Config: ...
def dump_config(config: Config) -> str: ...
def config_entries(config: Config) -> dict[str, Any]: ...
def did_you_mean(word: str, names: Sequence[str]) -> str: ...
def files_from(toml: str, config: Config) -> Config: ...

class FlightParameters:
    def __init__(
        self,
        *,
        latency_s: float = ...,
        clock_drift: float = ...,
        imu_noise_scale: float = ...,
        accel_noise_scale: float = ...,
        gnss_std_scale: float = ...,
        velocity_std_scale: float = ...,
        turn_on_scale: float = ...,
    ) -> None: ...
    @property
    def latency_s(self) -> float: ...
    @property
    def clock_drift(self) -> float: ...
    @property
    def imu_noise_scale(self) -> float: ...
    @property
    def accel_noise_scale(self) -> float: ...
    @property
    def gnss_std_scale(self) -> float: ...
    @property
    def velocity_std_scale(self) -> float: ...
    @property
    def turn_on_scale(self) -> float: ...

class FixInnovation:
    def __init__(self, record: int, norm_m: float) -> None: ...
    @property
    def record(self) -> int: ...
    @property
    def norm_m(self) -> float: ...

class RankedFilter:
    @property
    def filter(self) -> int: ...
    @property
    def p_rms_m(self) -> float: ...
    @property
    def fixes(self) -> int: ...

def rank_innovations(
    filters: Sequence[Sequence[FixInnovation]], first_record: int, last_record: int
) -> list[RankedFilter]: ...

class HeadingCandidate:
    def __init__(
        self,
        heading_rad: float,
        heading_std_rad: float = ...,
        gated: bool = ...,
        gate_scale_position: float = ...,
        gate_scale_velocity: float = ...,
        parameters: FlightParameters = ...,
    ) -> None: ...
    @property
    def parameters(self) -> FlightParameters: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def heading_std_rad(self) -> float: ...
    @property
    def gated(self) -> bool: ...
    @property
    def gate_scale_position(self) -> float: ...
    @property
    def gate_scale_velocity(self) -> float: ...

class CandidateScore:
    @property
    def cost(self) -> float: ...
    @property
    def p_rms_m(self) -> float: ...
    @property
    def nis_90(self) -> float: ...
    @property
    def fixes(self) -> int: ...

class HeadingSearchOptions:
    @property
    def guess_rad(self) -> float | None: ...
    @property
    def guess_std_rad(self) -> float: ...
    @property
    def grid_step_rad(self) -> float: ...
    @property
    def grid_std_rad(self) -> float: ...
    @property
    def triple_step_rad(self) -> float: ...
    @property
    def tolerance_rad(self) -> float: ...
    @property
    def max_evaluations(self) -> int: ...
    @property
    def max_sigma_rad(self) -> float: ...
    @property
    def estimate_latency(self) -> bool: ...
    @property
    def estimate_imu_noise(self) -> bool: ...
    @property
    def estimate_gnss_std(self) -> bool: ...

class ModeColumns(TypedDict):
    heading_rad: Array
    mass: Array

class CurveColumns(TypedDict):
    heading_rad: Array
    heading_std_rad: Array
    cost: Array
    gated: NDArray[np.bool_]

class TripleColumns(TypedDict):
    heading_rad: Array
    cost: Array

class DensityColumns(TypedDict):
    heading_rad: Array
    density_per_rad: Array

class HeadingResult:
    @property
    def heading_rad(self) -> float: ...
    @property
    def sigma_rad(self) -> float | None: ...
    @property
    def settled(self) -> bool: ...
    @property
    def verdict(self) -> str: ...
    @property
    def advice(self) -> str: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def gate_scale_position(self) -> float: ...
    @property
    def gate_scale_velocity(self) -> float: ...
    @property
    def nis_90(self) -> float: ...
    @property
    def parameters(self) -> FlightParameters: ...
    @property
    def latency_std_s(self) -> float | None: ...
    @property
    def imu_noise_scale_std(self) -> float | None: ...
    @property
    def accel_noise_scale_std(self) -> float | None: ...
    @property
    def gnss_std_scale_std(self) -> float | None: ...
    @property
    def mean_rad(self) -> float: ...
    @property
    def interval_95_rad(self) -> tuple[float, float]: ...
    def density(self) -> DensityColumns: ...
    def triple(self) -> TripleColumns: ...
    def modes(self) -> ModeColumns: ...
    def curve(self) -> CurveColumns: ...

class HeadingSearch:
    def __init__(self, options: HeadingSearchOptions) -> None: ...
    def ask(self) -> list[HeadingCandidate]: ...
    def tell(self, scores: Sequence[CandidateScore]) -> None: ...
    def done(self) -> bool: ...
    def result(self) -> HeadingResult: ...

class ImuColumns(TypedDict):
    time_s: Array
    omega_ib_b_rps: Array
    f_ib_b_mps2: Array

class GnssColumns(TypedDict):
    time_s: Array
    lat_deg: Array
    lon_deg: Array
    height_m: Array
    P_n_m2: Array
    v_n_mps: Array
    std_v_n_mps: Array
    fix: Array
    heading_deg: Array
    std_heading_deg: Array

class BaroColumns(TypedDict):
    time_s: Array
    height_m: Array
    std_m: Array

class Flight:
    def __init__(
        self,
        *,
        config: Config,
        imu_time_s: ArrayLike,
        omega_ib_b_rps: ArrayLike,
        f_ib_b_mps2: ArrayLike,
        gnss_time_s: ArrayLike,
        lat_deg: ArrayLike,
        lon_deg: ArrayLike,
        height_m: ArrayLike,
        std_p_n_m: ArrayLike,
        cov_p_n_m2: ArrayLike | None = ...,
        v_n_mps: ArrayLike | None = ...,
        std_v_n_mps: ArrayLike | None = ...,
        fix: ArrayLike | None = ...,
        heading_deg: ArrayLike | None = ...,
        std_heading_deg: ArrayLike | None = ...,
        baro_time_s: ArrayLike | None = ...,
        baro_height_m: ArrayLike | None = ...,
        baro_std_m: ArrayLike | None = ...,
    ) -> None: ...
    @property
    def config(self) -> Config: ...
    @property
    def warnings(self) -> list[str]: ...
    def with_config(self, config: Config) -> Flight: ...
    def imu(self) -> ImuColumns: ...
    def gnss(self) -> GnssColumns: ...
    def baro(self) -> BaroColumns: ...

def read_flight(config: Config) -> Flight: ...

class CoarseMode:
    @property
    def heading_rad(self) -> float: ...
    @property
    def heading_std_rad(self) -> float: ...
    @property
    def latency_s(self) -> float: ...
    @property
    def latency_std_s(self) -> float: ...
    @property
    def weight(self) -> float: ...

class CoarseWindow:
    @property
    def begin_s(self) -> float: ...
    @property
    def end_s(self) -> float: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def heading_std_rad(self) -> float: ...
    @property
    def latency_s(self) -> float: ...
    @property
    def modulus(self) -> float: ...
    @property
    def excitation_mps2(self) -> float: ...

class CoarseAlignment:
    @property
    def modes(self) -> list[CoarseMode]: ...
    @property
    def windows(self) -> list[CoarseWindow]: ...
    @property
    def roll_rad(self) -> float: ...
    @property
    def pitch_rad(self) -> float: ...
    @property
    def tilt_std_rad(self) -> float: ...
    @property
    def b_g_std_rps(self) -> float: ...

class PreparedFlight:
    @property
    def config(self) -> Config: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def rests(self) -> Array: ...
    @property
    def gaps(self) -> Array: ...
    @property
    def fix_p_ea_e_m(self) -> Array: ...
    @property
    def fix_std_p_n_m(self) -> Array: ...
    @property
    def t_begin_s(self) -> float: ...
    @property
    def t_start_s(self) -> float: ...
    @property
    def t_end_s(self) -> float: ...
    @property
    def imu_rate_hz(self) -> float: ...
    @property
    def latency_s(self) -> float: ...
    @property
    def imu_noise_scale(self) -> float: ...
    @property
    def gnss_std_scale(self) -> float: ...
    @property
    def start(self) -> str: ...
    @property
    def start_reason(self) -> str: ...
    @property
    def coarse(self) -> CoarseAlignment: ...

def heading_search_options(flight: PreparedFlight) -> HeadingSearchOptions: ...
def with_clock_of_flight(flight: PreparedFlight, found: HeadingResult) -> HeadingResult: ...
def prepare_flight(flight: Flight) -> PreparedFlight: ...
def fix_innovations(flight: PreparedFlight, candidate: HeadingCandidate) -> list[FixInnovation]: ...
def evaluate_candidates(
    flight: PreparedFlight, candidates: Sequence[HeadingCandidate]
) -> list[CandidateScore]: ...

class TrajectoryColumns(TypedDict):
    time_s: Array
    lat_deg: Array
    lon_deg: Array
    height_m: Array
    v_n_mps: Array
    rpy_deg: Array
    std_p_n_m: Array
    std_v_n_mps: Array
    std_rpy_deg: Array
    relative_std_p_n_m: Array
    std_b_a_mps2: Array
    std_b_g_rps: Array
    p_eb_e_m: Array
    v_eb_e_mps: Array
    C_b_e: Array
    b_a_mps2: Array
    b_g_rps: Array

class Solution:
    def smoothed(self) -> TrajectoryColumns: ...
    def filtered(self) -> TrajectoryColumns: ...
    def filtered_at_events(self) -> TrajectoryColumns: ...
    def smoothed_at_events(self) -> TrajectoryColumns: ...
    def innovations(self) -> dict[str, NDArray[Any]]: ...
    @property
    def p_rms_m(self) -> float: ...
    @property
    def epochs(self) -> int: ...

def process(
    flight: PreparedFlight,
    heading: HeadingResult,
    progress: ProgressCallback | None = ...,
    keep_events: bool = ...,
) -> Solution: ...
def alignment_json(flight: PreparedFlight, heading: HeadingResult) -> str: ...
def summary_json(flight: PreparedFlight, heading: HeadingResult, solution: Solution) -> str: ...
def alignment_text(flight: PreparedFlight, heading: HeadingResult) -> list[tuple[str, str]]: ...
def run_text(
    flight: PreparedFlight, heading: HeadingResult, solution: Solution, folder: str
) -> list[tuple[str, str]]: ...
def write_results(
    folder: str,
    flight: PreparedFlight,
    heading: HeadingResult,
    solution: Solution,
) -> None: ...

class DroneFlight:
    kind: str
    lat_deg: float
    lon_deg: float
    height_m: float
    rate_hz: float
    oversample: int
    start_time_s: float
    duration_s: float
    parked_before_s: float
    parked_after_s: float
    parked_roll_deg: float
    parked_pitch_deg: float
    heading_deg: float
    speed_mps: float
    climb_mps: float
    descent_mps: float
    altitude_m: float
    acceleration_mps2: float
    line_bearing_deg: float
    line_length_m: float
    line_spacing_m: float
    crab_deg: float
    circle_radius_m: float
    helix_climb_mps: float
    clockwise: bool
    nose_follows: float
    drag_per_s: float
    wind_mps: float
    wind_from_deg: float
    gust_mps2: float
    attitude_wobble_deg: float
    max_tilt_deg: float
    seed: int
    def __init__(
        self,
        *,
        kind: str = ...,
        lat_deg: float = ...,
        lon_deg: float = ...,
        height_m: float = ...,
        rate_hz: float = ...,
        oversample: int = ...,
        start_time_s: float = ...,
        duration_s: float = ...,
        parked_before_s: float = ...,
        parked_after_s: float = ...,
        parked_roll_deg: float = ...,
        parked_pitch_deg: float = ...,
        heading_deg: float = ...,
        speed_mps: float = ...,
        climb_mps: float = ...,
        descent_mps: float = ...,
        altitude_m: float = ...,
        acceleration_mps2: float = ...,
        line_bearing_deg: float = ...,
        line_length_m: float = ...,
        line_spacing_m: float = ...,
        crab_deg: float = ...,
        circle_radius_m: float = ...,
        helix_climb_mps: float = ...,
        clockwise: bool = ...,
        nose_follows: float = ...,
        drag_per_s: float = ...,
        wind_mps: float = ...,
        wind_from_deg: float = ...,
        gust_mps2: float = ...,
        attitude_wobble_deg: float = ...,
        max_tilt_deg: float = ...,
        seed: int = ...,
    ) -> None: ...

class GnssErrors:
    std_ned_m: ArrayLike
    rate_hz: float
    l_ba_b: ArrayLike
    latency_s: float
    velocity: bool
    velocity_std_ned: ArrayLike
    outlier_probability: float
    outlier_m: float
    correlated_std_ned_m: ArrayLike
    correlation_time_s: float
    smoothing_time_s: float
    velocity_correlated_std_ned: ArrayLike
    velocity_correlation_time_s: float
    velocity_latency_s: float | None
    stamp_jitter_s: float
    arrival_delay_s: float
    step_ned_m: ArrayLike
    velocity_step_mps: float
    stated_std_ned_m: ArrayLike
    stated_velocity_std_ned: ArrayLike
    stated_std_factor: float
    stated_velocity_std_factor: float
    heading: bool
    heading_std_deg: float
    stated_heading_std_deg: float
    fix: int
    def __init__(
        self,
        *,
        std_ned_m: ArrayLike = ...,
        rate_hz: float = ...,
        l_ba_b: ArrayLike = ...,
        latency_s: float = ...,
        velocity: bool = ...,
        velocity_std_ned: ArrayLike = ...,
        outlier_probability: float = ...,
        outlier_m: float = ...,
        correlated_std_ned_m: ArrayLike = ...,
        correlation_time_s: float = ...,
        smoothing_time_s: float = ...,
        velocity_correlated_std_ned: ArrayLike = ...,
        velocity_correlation_time_s: float = ...,
        velocity_latency_s: float | None = ...,
        stamp_jitter_s: float = ...,
        arrival_delay_s: float = ...,
        step_ned_m: ArrayLike = ...,
        velocity_step_mps: float = ...,
        stated_std_ned_m: ArrayLike = ...,
        stated_velocity_std_ned: ArrayLike = ...,
        stated_std_factor: float = ...,
        stated_velocity_std_factor: float = ...,
        heading: bool = ...,
        heading_std_deg: float = ...,
        stated_heading_std_deg: float = ...,
        fix: int = ...,
    ) -> None: ...

class TruthColumns(TypedDict):
    time_s: Array
    lat_deg: Array
    lon_deg: Array
    height_m: Array
    v_n_mps: Array
    rpy_deg: Array
    p_eb_e_m: Array
    v_eb_e_mps: Array
    C_b_e: Array
    b_a_mps2: Array
    b_g_rps: Array

class ImuErrorSizes:
    gyro_turn_on_deg_h: float
    accel_turn_on_ug: float
    gyro_scale_ppm: float
    accel_scale_ppm: float
    gyro_misalignment_deg: float
    accel_misalignment_deg: float
    turn_on: str
    noise_scale: float
    gyro_vibration_deg_s: ArrayLike
    accel_vibration_mps2: ArrayLike
    vibration_correlation_time_s: float
    def __init__(
        self,
        *,
        gyro_turn_on_deg_h: float = ...,
        accel_turn_on_ug: float = ...,
        gyro_scale_ppm: float = ...,
        accel_scale_ppm: float = ...,
        gyro_misalignment_deg: float = ...,
        accel_misalignment_deg: float = ...,
        turn_on: str = ...,
        noise_scale: float = ...,
        gyro_vibration_deg_s: ArrayLike = ...,
        accel_vibration_mps2: ArrayLike = ...,
        vibration_correlation_time_s: float = ...,
    ) -> None: ...

class TypedInErrors:
    lever_arm_std_m: float
    latency_std_s: float
    def __init__(
        self,
        *,
        lever_arm_std_m: float = ...,
        latency_std_s: float = ...,
    ) -> None: ...

class BaroErrors:
    std_m: float
    rate_hz: float
    bias_sigma_m: float
    bias_correlation_time_s: float
    def __init__(
        self,
        *,
        std_m: float = ...,
        rate_hz: float = ...,
        bias_sigma_m: float = ...,
        bias_correlation_time_s: float = ...,
    ) -> None: ...

class SimulatedFlight:
    @property
    def flight(self) -> Flight: ...
    def between(self, begin_s: float, end_s: float) -> SimulatedFlight: ...
    def heading_deg_at(self, t_s: float) -> float: ...
    def truth(self) -> TruthColumns: ...
    def baro(self, errors: BaroErrors = ..., *, seed: int) -> BaroColumns: ...

def random_flight(kind: str, *, gentle: bool = False, seed: int) -> DroneFlight: ...
def simulate_flight(
    drone: DroneFlight,
    gnss: GnssErrors,
    config: Config,
    seed: int,
    imu: ImuErrorSizes = ...,
    typed_in: TypedInErrors = ...,
) -> SimulatedFlight: ...
def simulate_track(
    time_s: ArrayLike,
    lat_deg: ArrayLike,
    lon_deg: ArrayLike,
    height_m: ArrayLike,
    rpy_deg: ArrayLike,
    rate_hz: float,
    oversample: int,
    gnss: GnssErrors,
    config: Config,
    seed: int,
    imu: ImuErrorSizes,
    typed_in: TypedInErrors = ...,
) -> SimulatedFlight: ...
def write_flight(folder: str, simulated: SimulatedFlight) -> None: ...

STUDY_CHANNELS: tuple[str, ...]

class StudyCase:
    flight: DroneFlight
    gnss: GnssErrors
    imu: ImuErrorSizes
    typed_in: TypedInErrors
    config: Config
    models: list[str]
    start: str
    heading_error_deg: float | None
    position_std_m: float
    biases: str
    mechanization: str
    rate_hz: float
    nees_interval_s: float
    seed: int
    def __init__(
        self,
        *,
        flight: DroneFlight = ...,
        gnss: GnssErrors = ...,
        imu: ImuErrorSizes = ...,
        typed_in: TypedInErrors = ...,
        config: Config = ...,
        models: list[str] = ...,
        start: str = ...,
        heading_error_deg: float | None = ...,
        position_std_m: float = ...,
        biases: str = ...,
        mechanization: str = ...,
        rate_hz: float = ...,
        nees_interval_s: float = ...,
        seed: int = ...,
    ) -> None: ...
    def set_track(
        self,
        time_s: ArrayLike,
        lat_deg: ArrayLike,
        lon_deg: ArrayLike,
        height_m: ArrayLike,
        rpy_deg: ArrayLike,
    ) -> None: ...

class Truth: ...

def check_study(study: StudyCase) -> None: ...
def study_truth(study: StudyCase) -> Truth: ...
def nees_times(study: StudyCase, truth: Truth) -> list[float]: ...
def run_study(
    study: StudyCase, truth: Truth, first: int, count: int, progress: ProgressCallback | None = None
) -> dict[str, Any]: ...
def study_bound(study: StudyCase, truth: Truth) -> dict[str, Any]: ...

class HonestCase:
    config: Config
    gnss: GnssErrors
    kinds: Sequence[str]
    rate_hz: float
    parked_s: float
    flight_s: float
    start_after_s: float
    latency_start_std_s: float
    rest_s: float
    tilt_std_deg: float
    heading_std_deg: float
    velocity_std_mps: float
    settle_s: float
    every_s: float
    def __init__(
        self,
        *,
        config: Config = ...,
        gnss: GnssErrors = ...,
        kinds: Sequence[str] = ...,
        rate_hz: float = ...,
        parked_s: float = ...,
        flight_s: float = ...,
        start_after_s: float = ...,
        latency_start_std_s: float = ...,
        rest_s: float = ...,
        tilt_std_deg: float = ...,
        heading_std_deg: float = ...,
        velocity_std_mps: float = ...,
        settle_s: float = ...,
        every_s: float = ...,
    ) -> None: ...

HONEST_CHANNELS: tuple[str, ...]
HONEST_BLOCKS: tuple[str, ...]

def honest_runs(
    case: HonestCase, first_seed: int, count: int, progress: ProgressCallback | None = None
) -> list[dict[str, Any]]: ...
