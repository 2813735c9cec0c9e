// From records and configuration to the receiver's errors.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/receiver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/observe/kinds.hpp"

namespace liealign {
namespace {

constexpr double kLatencyPrior_s = 0.2;  // of what is left of an estimated latency

// What all messages of a log share.
struct Receiver {
  StampGrid grid;
  QuantisationSteps steps;
  FixClass kind = FixClass::fixed;  // that most fixes have
  bool has_velocity = false;

  explicit Receiver(const PreparedFlight& flight)
      : grid(stamp_grid(flight.gnss)), steps(quantisation_steps(flight.gnss)) {
    std::array<std::size_t, 3> count{};
    for (std::size_t i = 0; i < flight.gnss.size(); ++i) {
      if (flight.record_use[i] == RecordUse::quality_not_accepted) continue;
      ++count[static_cast<std::size_t>(fix_class(flight.gnss[i]))];
      has_velocity = has_velocity || (flight.gnss[i].has_velocity && flight.config.gnss.use_velocity);
    }
    kind = static_cast<FixClass>(std::max_element(count.begin(), count.end()) - count.begin());
  }
};

Matrix3d rounding_e(const Matrix3d& C_n_e, const Vector3d& step_n) {
  return C_n_e * (step_n.cwiseAbs2() / 12.0).asDiagonal() * C_n_e.transpose();
}

struct Collected {
  std::vector<Observation>& observations;
  std::vector<Matrix3d>& rounding;

  void add(const Observation& o, const Matrix3d& round) {
    observations.push_back(o);
    rounding.push_back(round);
  }
};

// The messages that the final run takes, by their stamps less the drift of the clock.
void add_messages(const PreparedFlight& flight, const Receiver& receiver, double drift, const Vector3d& l_ba_b,
                  Collected& to) {
  const FixClass* before = nullptr;
  FixClass last = FixClass::fixed;
  for (std::size_t i = 0; i < flight.gnss.size(); ++i) {
    const RecordUse use = flight.record_use[i];
    if (use != RecordUse::update && use != RecordUse::averaged_at_rest) continue;
    const GnssRecord& record = flight.gnss[i];
    // By the std that the file states, or its given multiple.
    const GnssFix fix = fix_from_record(record, i, flight.config, 0.0, flight.gnss_std_scale);
    const double stamp_s = receiver.grid.t_s[i];
    const Matrix3d C = C_n_e(record.lat_rad, record.lon_rad);
    Observation o;
    o.t_s = stamp_s - drift * (stamp_s - flight.latency_s - flight.problem.t_start_s);
    o.kind = &kGnssPosition;
    o.record = i;
    o.y = fix.p_ea_e;
    o.R = fix.R_p_e;
    o.root = C * Eigen::LLT<Matrix3d>(Matrix3d(C.transpose() * fix.R_p_e * C)).matrixL().toDenseMatrix();
    o.lever_b = l_ba_b;
    o.place_e = fix.p_ea_e;
    const FixClass now = fix_class(record);
    o.new_datum = before != nullptr && now != last;
    last = now;
    before = &last;
    to.add(o, rounding_e(C, receiver.steps.position_n_m));
    if (!fix.has_velocity) continue;
    o.kind = &kGnssVelocity;
    o.y = fix.v_ea_e;
    o.R = fix.R_v_e;
    o.root = C;
    o.new_datum = false;
    to.add(o, rounding_e(C, receiver.steps.velocity_n_mps));
  }
}

// The end of what theta is found from: a few minutes of motion, and no more messages than take a second or two.
double fit_end(const PreparedFlight& flight, const std::vector<Observation>& observations, double begin_s) {
  constexpr double kLongest_s = 300.0;
  constexpr std::size_t kMostMessages = 1500;
  const double end_s = std::min(flight.problem.t_start_s + kLongest_s, flight.data.imu().back().t_s);
  std::size_t messages = 0;
  for (const Observation& o : observations) {
    if (o.kind->gate != GateClass::position || o.t_s < begin_s) continue;
    if (o.t_s > end_s) break;
    if (++messages == kMostMessages) return o.t_s;
  }
  return end_s;
}

}  // namespace

bool models_receiver(const Config& config) {
  if (config.gnss.error_model != "auto") return config.gnss.error_model == "correlated";
  return config.filter.model == "lie" && config.filter.mechanization == "exact" && config.filter.covariance_reset;
}

void add_other_observations(const PreparedFlight& flight, double latency_s, std::vector<Observation>& to) {
  const double offset = flight.config.gnss.heading_offset_deg * kDegToRad;
  const Vector3d place_e = flight.record_p_ea_e.empty() ? Vector3d::Zero() : flight.record_p_ea_e.front();
  for (std::size_t i = 0; i < flight.gnss.size(); ++i) {
    const GnssRecord& record = flight.gnss[i];
    const RecordUse use = flight.record_use[i];
    if (!record.has_heading || (use != RecordUse::update && use != RecordUse::averaged_at_rest)) continue;
    Observation o;
    o.t_s = record.t_s - latency_s;
    o.kind = &kExternalHeading;
    o.record = i;
    o.y[0] = record.heading_rad;
    o.R(0, 0) = record.std_heading_rad * record.std_heading_rad;
    o.lever_b = Vector3d(std::cos(offset), std::sin(offset), 0.0);
    o.place_e = place_e;
    to.push_back(o);
  }
  for (std::size_t i = 0; i < flight.baro.size(); ++i) {
    const BaroRecord& record = flight.baro[i];
    const double std_m = record.has_std ? record.std_m : flight.config.baro.std_m;
    Observation o;
    o.t_s = record.t_s;
    o.kind = &kBarometer;
    o.record = i;
    o.y[0] = record.height_m;
    o.R(0, 0) = std_m * std_m;
    o.place_e = place_e;
    to.push_back(o);
  }
}

ReceiverProblem receiver_problem(const PreparedFlight& flight, const HeadingResult& heading,
                                 const FilterOptions& filter, const Belief<LieModel<double>>& start,
                                 const ImuCursor& cursor) {
  const GnssConfig& gnss = flight.config.gnss;
  const Receiver receiver(flight);
  ReceiverProblem problem;
  problem.data.samples = flight.data.samples;
  problem.data.l_ba_b = flight.data.l_ba_b;
  problem.data.rest_noise = flight.data.rest_noise;
  problem.filter = filter;
  problem.start = start;
  problem.cursor = cursor;

  std::vector<Observation>& all = problem.data.observations;
  Collected to{all, problem.rounding};
  add_messages(flight, receiver, heading.parameters.clock_drift, flight.data.l_ba_b, to);
  // As good as nothing beside the first fix; much wider costs digits in the smoother.
  problem.wide_position_std_m = 10.0 * std::sqrt(all.empty() ? 1.0 : all.front().R.trace() / 3.0);
  std::vector<Observation> others = flight.data.others;
  add_other_observations(flight, 0.0, others);
  for (const RestUpdate& rest : flight.data.rests) add_observations(rest, flight.data.rest_noise, others);
  for (const Observation& o : others) to.add(o, Matrix3d::Zero());

  problem.prior = receiver_prior(receiver.kind, receiver.has_velocity, receiver.grid.arrival);
  if (gnss.std_scale) problem.prior.white_scale.log_std = 0.0;
  if (flight.config.imu.noise_scale) problem.prior.gyro_scale.log_std = problem.prior.accel_scale.log_std = 0.0;
  problem.start_gyro_scale = heading.parameters.imu_noise_scale;
  problem.start_accel_scale = heading.parameters.imu_noise_scale * heading.parameters.accel_noise_scale;

  problem.latency.time_s = flight.problem.t_start_s;
  const double found_s = flight.latency_s + heading.parameters.latency_s;
  problem.latency.position_s = gnss.latency_s.value_or(found_s);
  problem.latency.velocity_s = gnss.velocity_latency_s.value_or(problem.latency.position_s);
  problem.latency.position_std_s = gnss.latency_s ? 0.0 : kLatencyPrior_s;
  problem.latency.velocity_std_s = gnss.velocity_latency_s || !receiver.has_velocity ? 0.0 : kLatencyPrior_s;
  problem.latency_walk = stamp_walk(receiver.grid);
  if (!flight.baro.empty()) {
    problem.baro_std_m = flight.config.baro.bias_std_m;
    problem.baro_tau_s = flight.config.baro.bias_correlation_time_s;
  }
  constexpr double kRest_s = 30.0;  // of the rest before the motion
  problem.fit_begin_s = flight.problem.t_start_s - kRest_s;
  problem.fit_end_s = fit_end(flight, all, problem.fit_begin_s);
  return problem;
}

}  // namespace liealign
