// A simulated flight as data and as files.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/simulated_flight.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/ins/profiles.hpp"
#include "liealign/io/csv.hpp"
#include "liealign/io/text_file.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign {
namespace {

void write_imu(const std::string& path, const ImuSeries& imu) {
  write_csv(path,
            {{"time_s", 6},
             {"gyro_x_rps", 12},
             {"gyro_y_rps", 12},
             {"gyro_z_rps", 12},
             {"accel_x_mps2", 10},
             {"accel_y_mps2", 10},
             {"accel_z_mps2", 10}},
            imu.size(), [&](std::size_t k, double* c) {
              c[0] = imu[k].t_s;
              for (int i = 0; i < 3; ++i) {
                c[1 + i] = imu[k].omega_ib_b[i];
                c[4 + i] = imu[k].f_ib_b[i];
              }
            });
}

void write_gnss(const std::string& path, const std::vector<GnssRecord>& gnss) {
  std::vector<CsvColumn> columns = {{"time_s", 6},  {"lat_deg", 11}, {"lon_deg", 11}, {"height_m", 5},
                                    {"std_n_m", 4}, {"std_e_m", 4},  {"std_d_m", 4},  {"fix", 0}};
  const bool velocity = !gnss.empty() && gnss.front().has_velocity;
  const bool heading = !gnss.empty() && gnss.front().has_heading;
  if (velocity) {
    for (const char* name : {"vn_mps", "ve_mps", "vd_mps", "std_vn_mps", "std_ve_mps", "std_vd_mps"})
      columns.push_back({name, 5});
  }
  if (heading) {
    for (const char* name : {"heading_deg", "std_heading_deg"}) columns.push_back({name, 5});
  }
  write_csv(path, columns, gnss.size(), [&](std::size_t k, double* c) {
    const GnssRecord& r = gnss[k];
    c[0] = r.t_s;
    c[1] = r.lat_rad * kRadToDeg;
    c[2] = r.lon_rad * kRadToDeg;
    c[3] = r.height_m;
    for (int i = 0; i < 3; ++i) c[4 + i] = std::sqrt(r.P_n_m2(i, i));
    c[7] = r.fix;
    if (velocity) {
      for (int i = 0; i < 3; ++i) {
        c[8 + i] = r.v_n_mps[i];
        c[11 + i] = r.std_v_n_mps[i];
      }
    }
    if (heading) {
      c[columns.size() - 2] = r.heading_rad * kRadToDeg;
      c[columns.size() - 1] = r.std_heading_rad * kRadToDeg;
    }
  });
}

void write_truth(const std::string& path, const Truth& truth) {
  write_csv(path,
            {{"time_s", 6},
             {"lat_deg", 11},
             {"lon_deg", 11},
             {"height_m", 5},
             {"vn_mps", 6},
             {"ve_mps", 6},
             {"vd_mps", 6},
             {"roll_deg", 6},
             {"pitch_deg", 6},
             {"heading_deg", 6}},
            truth.epochs.size(), [&](std::size_t k, double* c) {
              Epoch epoch;
              epoch.t_s = truth.epochs[k].t_s;
              epoch.X.first = truth.epochs[k].X;
              const NavRow row = nav_row(epoch);
              c[0] = row.t_s;
              c[1] = row.lat_rad * kRadToDeg;
              c[2] = row.lon_rad * kRadToDeg;
              c[3] = row.height_m;
              for (int i = 0; i < 3; ++i) {
                c[4 + i] = row.v_n_mps[i];
                c[7 + i] = row.rpy_rad[i] * kRadToDeg;
              }
            });
}

// Streams of the seed; those of the sensors are in simulate/sensor_checks.hpp.
enum SizeStream : std::uint64_t { kSigns = 7, kTurnOn = 51, kScale, kMisalignment, kTypedLeverArm, kTypedLatency };

void require_size(const char* name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value))
    throw Error(std::string("simulate: ") + name + " is " + std::to_string(value) +
                "; expected a finite number, 0 or more");
}

// Turn-on biases, scale factors and misalignments, each gyro first. The signs are of one stream, the biases' first.
void draw_sizes(ImuErrors& e, const ImuErrorSizes& sizes, std::uint64_t seed) {
  const bool fixed = sizes.turn_on == "fixed";
  if (!fixed && sizes.turn_on != "drawn")
    throw Error("simulate: turn_on is \"" + sizes.turn_on + "\"; expected \"drawn\" or \"fixed\"");
  Random signs(seed, kSigns), turn_on(seed, kTurnOn), scale(seed, kScale), misalignment(seed, kMisalignment);
  const auto draw = [&](Vector3d& value, const char* name, double size, double unit, Random& random) {
    require_size(name, size);
    for (int i = 0; i < 3; ++i)
      value[i] = (fixed ? (signs.uniform() < 0.5 ? -1.0 : 1.0) : random.normal()) * size * unit;
  };
  draw(e.b_g_turn_on, "gyro_turn_on_deg_h", sizes.gyro_turn_on_deg_h, kDegPerHourToRadPerSecond, turn_on);
  draw(e.b_a_turn_on, "accel_turn_on_ug", sizes.accel_turn_on_ug, kMicroGToMps2, turn_on);
  draw(e.gyro_scale, "gyro_scale_ppm", sizes.gyro_scale_ppm, 1e-6, scale);
  draw(e.accel_scale, "accel_scale_ppm", sizes.accel_scale_ppm, 1e-6, scale);
  draw(e.gyro_misalignment_rad, "gyro_misalignment_deg", sizes.gyro_misalignment_deg, kDegToRad, misalignment);
  draw(e.accel_misalignment_rad, "accel_misalignment_deg", sizes.accel_misalignment_deg, kDegToRad, misalignment);
}

}  // namespace

ImuErrors imu_errors(const Config& config, const ImuErrorSizes& sizes, std::uint64_t seed) {
  const ImuProfile& p = imu_profile(config.imu.model);
  ImuErrors e;
  e.noise = imu_noise(config);
  e.ornstein_uhlenbeck = true;
  e.gyro_bias_sigma =
      config.imu.gyro_bias_instability_deg_h.value_or(p.gyro_bias_instability_deg_h) * kDegPerHourToRadPerSecond;
  e.accel_bias_sigma = config.imu.accel_bias_instability_ug.value_or(p.accel_bias_instability_ug) * kMicroGToMps2;
  e.bias_correlation_time_s = config.imu.bias_correlation_time_s;
  e.gyro_bias_sigma *= sizes.noise_scale;
  e.accel_bias_sigma *= sizes.noise_scale;
  for (double* density : {&e.noise.gyro_arw, &e.noise.accel_vrw, &e.noise.gyro_bias_rw, &e.noise.accel_bias_rw})
    *density *= sizes.noise_scale;
  draw_sizes(e, sizes, seed);
  e.gyro_vibration_rps = kDegToRad * sizes.gyro_vibration_deg_s;
  e.accel_vibration_mps2 = sizes.accel_vibration_mps2;
  e.vibration_correlation_time_s = sizes.vibration_correlation_time_s;
  return e;
}

void type_in(Config& config, const GnssErrors& gnss, const TypedInErrors& errors, std::uint64_t seed) {
  require_size("lever_arm_std_m", errors.lever_arm_std_m);
  require_size("latency_std_s", errors.latency_std_s);
  Random lever_arm(seed, kTypedLeverArm), latency(seed, kTypedLatency);
  const Vector3d l_ba_b = gnss.l_ba_b + errors.lever_arm_std_m * lever_arm.normal3();
  config.gnss.lever_arm_b_m = {l_ba_b.x(), l_ba_b.y(), l_ba_b.z()};
  if (errors.latency_std_s > 0.0) config.gnss.latency_s = gnss.latency_s + errors.latency_std_s * latency.normal();
}

SimulatedFlight simulate_flight(Truth truth, const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                                const ImuErrorSizes& imu, const TypedInErrors& typed_in) {
  SimulatedFlight out;
  out.truth = std::move(truth);
  out.imu_errors = imu_errors(config, imu, seed);
  vibrate_in_motion(out.imu_errors, out.truth);
  SimulatedImu log = add_imu_errors(out.truth.imu, out.imu_errors, seed);
  out.flight.imu = std::move(log.log);
  out.b_a = std::move(log.b_a);
  out.b_g = std::move(log.b_g);
  out.flight.gnss = simulate_gnss(out.truth, gnss, seed);
  out.flight.config = config;
  type_in(out.flight.config, gnss, typed_in, seed);
  return out;
}

SimulatedFlight simulate_flight(const DroneFlight& drone, const GnssErrors& gnss, const Config& config,
                                std::uint64_t seed, const ImuErrorSizes& imu, const TypedInErrors& typed_in) {
  return simulate_flight(drone_truth(drone, Mechanization::exact, GravityModel::normal), gnss, config, seed, imu,
                         typed_in);
}

SimulatedFlight simulate_track(const std::vector<TrackPoint>& track, double rate_hz, int oversample,
                               const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                               const ImuErrorSizes& imu, const TypedInErrors& typed_in) {
  return simulate_flight(track_truth(track, rate_hz, oversample, Mechanization::exact, GravityModel::normal), gnss,
                         config, seed, imu, typed_in);
}

SimulatedFlight between(SimulatedFlight simulated, double begin_s, double end_s) {
  const auto keep = [&](auto& series) {
    const auto outside = [&](const auto& row) { return row.t_s < begin_s || row.t_s > end_s; };
    series.erase(std::remove_if(series.begin(), series.end(), outside), series.end());
  };
  std::size_t kept = 0;
  for (std::size_t k = 0; k < simulated.truth.epochs.size(); ++k) {
    const double t_s = simulated.truth.epochs[k].t_s;
    if (t_s < begin_s || t_s > end_s) continue;
    simulated.b_a[kept] = simulated.b_a[k];
    simulated.b_g[kept++] = simulated.b_g[k];
  }
  simulated.b_a.resize(kept);
  simulated.b_g.resize(kept);
  keep(simulated.flight.imu);
  keep(simulated.flight.gnss);
  keep(simulated.truth.imu);
  keep(simulated.truth.epochs);
  if (simulated.flight.imu.size() < 2)
    throw Error("simulated flight: nothing of it lies between " + std::to_string(begin_s) + " s and " +
                std::to_string(end_s) + " s");
  return simulated;
}

void write_flight(const std::string& folder, const SimulatedFlight& simulated) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw InputError(folder + ": the folder cannot be made: " + failure.message());
  const auto in = [&](const char* name) { return (std::filesystem::path(folder) / name).string(); };
  Config config = simulated.flight.config;
  config.imu.file = "imu.csv";
  config.gnss.file = "gnss.csv";
  write_imu(in("imu.csv"), simulated.flight.imu);
  write_gnss(in("gnss.csv"), simulated.flight.gnss);
  write_truth(in("truth.csv"), simulated.truth);
  write_text_file(in("FLIGHT.toml"), dump_config(config));
}

}  // namespace liealign
