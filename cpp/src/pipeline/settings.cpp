// Configuration to settings.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/settings.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/forward.hpp"
#include "liealign/estimate/output_frame.hpp"
#include "liealign/ins/profiles.hpp"

namespace liealign {
namespace {

Vector3d vector_of(const std::array<double, 3>& numbers) { return Vector3d(numbers.data()); }

}  // namespace

ImuNoise imu_noise(const Config& config) {
  const ImuConfig& c = config.imu;
  const ImuProfile& p = imu_profile(c.model);
  const double root = std::sqrt(2.0 / c.bias_correlation_time_s);
  ImuNoise n;
  n.gyro_arw = c.gyro_arw_deg_sqrt_h.value_or(p.gyro_arw_deg_sqrt_h) * kDegPerSqrtHourToRadPerSqrtSecond;
  n.accel_vrw = c.accel_vrw_mps_sqrt_h.value_or(p.accel_vrw_mps_sqrt_h) * kMpsPerSqrtHourToMpsPerSqrtSecond;
  n.gyro_bias_rw =
      root * c.gyro_bias_instability_deg_h.value_or(p.gyro_bias_instability_deg_h) * kDegPerHourToRadPerSecond;
  n.accel_bias_rw = root * c.accel_bias_instability_ug.value_or(p.accel_bias_instability_ug) * kMicroGToMps2;
  n.gyro_gap_rps = c.gap_gyro_std_dps * kDegToRad;
  n.accel_gap_mps2 = c.gap_accel_std_mps2;
  const double scale = c.noise_scale.value_or(kUnestimatedScale);
  return scaled(n, scale, scale);
}

InitialStd initial_std(const Config& config) {
  const ImuProfile& p = imu_profile(config.imu.model);
  const double scale = config.imu.noise_scale.value_or(kUnestimatedScale);
  const double accel_mg = scale * config.imu.accel_bias_turn_on_mg.value_or(p.accel_bias_turn_on_mg);
  return {config.initial.roll_pitch_std_deg * kDegToRad, config.initial.velocity_std_mps,
          scale * config.imu.gyro_bias_turn_on_deg_h.value_or(p.gyro_bias_turn_on_deg_h) * kDegPerHourToRadPerSecond,
          accel_mg * kMilliGToMps2};
}

FilterOptions filter_options(const Config& config) {
  FilterOptions o;
  o.dynamics.mechanization = config.filter.mechanization == "paper" ? Mechanization::paper : Mechanization::exact;
  o.dynamics.gravity = config.filter.gravity == "j2" ? GravityModel::j2 : GravityModel::normal;
  o.dynamics.noise = imu_noise(config);
  o.covariance_reset = config.filter.covariance_reset;
  o.gate.outliers = config.gnss.outlier == "reject" ? Outliers::reject
                    : config.gnss.outlier == "off"  ? Outliers::off
                                                    : Outliers::weight;
  o.gate.kappa = chi_square_3_quantile(config.gnss.outlier_probability);
  o.velocity_gate = o.gate;
  o.reacquire_after = config.gnss.reacquire_after;
  return o;
}

RestNoise rest_noise(const Config& config) { return {config.rest.zupt_std_mps, config.rest.zaru_std_dps * kDegToRad}; }

RestLimits rest_limits(const Config& config) {
  const RestConfig& r = config.rest;
  return {r.min_duration_s, r.gyro_std_dps * kDegToRad, r.gyro_mean_dps * kDegToRad,
          r.accel_std_mps2, r.accel_mean_mps2,          r.gnss_drift_sigma};
}

HeadingSearchOptions heading_search_options(const Config& config) {
  const AlignConfig& a = config.align;
  HeadingSearchOptions o;
  if (a.heading_guess_deg) o.guess_rad = *a.heading_guess_deg * kDegToRad;
  o.guess_std_rad = a.heading_guess_std_deg * kDegToRad;
  o.grid_step_rad = a.grid_step_deg * kDegToRad;
  o.grid_std_rad = a.grid_heading_std_deg * kDegToRad;
  o.triple_step_rad = a.triple_step_deg * kDegToRad;
  o.tolerance_rad = a.tolerance_deg * kDegToRad;
  o.max_evaluations = a.max_evaluations;
  o.max_sigma_rad = a.max_sigma_deg * kDegToRad;
  return o;
}

ImuSampleKind sample_kind(const Config& config) {
  if (config.imu.sample == "instant") return ImuSampleKind::instant;
  return config.imu.sample == "increment" ? ImuSampleKind::increment : ImuSampleKind::mean;
}

OutputFrame output_frame(const Config& config) {
  return {vector_of(config.output.reference_point_b_m),
          C_b_n_from_rpy(kDegToRad * vector_of(config.output.boresight_deg))};
}

Matrix3d sensor_to_body(const Config& config) {
  return C_b_n_from_rpy(kDegToRad * vector_of(config.imu.mounting_rpy_deg)) * C_s_b_from_axes(config.imu.axes);
}

}  // namespace liealign
