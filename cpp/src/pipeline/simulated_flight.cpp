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
  if (!gnss.empty() && gnss.front().has_velocity) {
    for (const char* name : {"vn_mps", "ve_mps", "vd_mps", "std_vn_mps", "std_ve_mps", "std_vd_mps"})
      columns.push_back({name, 5});
  }
  write_csv(path, columns, gnss.size(), [&](std::size_t k, double* c) {
    const GnssRecord& r = gnss[k];
    c[0] = r.t_s;
    c[1] = r.lat_rad * kRadToDeg;
    c[2] = r.lon_rad * kRadToDeg;
    c[3] = r.height_m;
    for (int i = 0; i < 3; ++i) c[4 + i] = std::sqrt(r.P_n_m2(i, i));
    c[7] = r.fix;
    if (columns.size() == 8) return;
    for (int i = 0; i < 3; ++i) {
      c[8 + i] = r.v_n_mps[i];
      c[11 + i] = r.std_v_n_mps[i];
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

}  // namespace

ImuErrors imu_errors(const Config& config, const ImuErrorSizes& sizes, std::uint64_t seed) {
  constexpr std::uint64_t kSigns = 7;  // a stream of the seed; those of the sensors are in sensors.cpp
  Random random(seed, kSigns);
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
  const auto sign = [&] { return random.uniform() < 0.5 ? -1.0 : 1.0; };
  for (int i = 0; i < 3; ++i) e.b_g_turn_on[i] = sign() * sizes.gyro_turn_on_deg_h * kDegPerHourToRadPerSecond;
  for (int i = 0; i < 3; ++i) e.b_a_turn_on[i] = sign() * sizes.accel_turn_on_ug * kMicroGToMps2;
  return e;
}

SimulatedFlight simulate_flight(Truth truth, const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                                const ImuErrorSizes& imu) {
  SimulatedFlight out;
  out.truth = std::move(truth);
  out.flight.imu = add_imu_errors(out.truth.imu, imu_errors(config, imu, seed), seed).log;
  out.flight.gnss = simulate_gnss(out.truth, gnss, seed);
  out.flight.config = config;
  out.flight.config.gnss.lever_arm_b_m = {gnss.l_ba_b.x(), gnss.l_ba_b.y(), gnss.l_ba_b.z()};
  return out;
}

SimulatedFlight simulate_flight(const DroneFlight& drone, const GnssErrors& gnss, const Config& config,
                                std::uint64_t seed, const ImuErrorSizes& imu) {
  return simulate_flight(drone_truth(drone, Mechanization::exact, GravityModel::normal), gnss, config, seed, imu);
}

SimulatedFlight simulate_track(const std::vector<TrackPoint>& track, double rate_hz, int oversample,
                               const GnssErrors& gnss, const Config& config, std::uint64_t seed,
                               const ImuErrorSizes& imu) {
  return simulate_flight(track_truth(track, rate_hz, oversample, Mechanization::exact, GravityModel::normal), gnss,
                         config, seed, imu);
}

SimulatedFlight between(SimulatedFlight simulated, double begin_s, double end_s) {
  const auto keep = [&](auto& series) {
    const auto outside = [&](const auto& row) { return row.t_s < begin_s || row.t_s > end_s; };
    series.erase(std::remove_if(series.begin(), series.end(), outside), series.end());
  };
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
