// How the state moves between observations, and the densities of the IMU's noise that make it uncertain.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/earth/gravity.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/ins/mechanization.hpp"
#include "liealign/ins/noise_shape.hpp"

namespace liealign {

// How the state moves and how uncertain that is.
struct Dynamics {
  Mechanization mechanization = Mechanization::exact;
  GravityModel gravity = GravityModel::normal;
  ImuNoise noise;
};

// Density of the white noise of accelerometer and gyro, N^2; inside a gap of length T sigma_gap^2 T more, which adds up to
// sigma_gap^2 T^2 over the gap however fixes split it.
struct WhiteDensity {
  double accel, gyro;  // (m/s^2)^2 s, (rad/s)^2 s
};

inline WhiteDensity white_density(const ImuNoise& n, double gap_s) {
  return {n.accel_vrw * n.accel_vrw + n.accel_gap_mps2 * n.accel_gap_mps2 * gap_s,
          n.gyro_arw * n.gyro_arw + n.gyro_gap_rps * n.gyro_gap_rps * gap_s};
}

// The same where and when a sample was taken.
inline WhiteDensity white_density(const ImuNoise& n, const ImuSample& sample) {
  if (!n.shape) return white_density(n, sample.gap_s);
  const NoiseShape::Share share = n.shape->at(sample.t_s);
  return {share.accel * n.accel_vrw * n.accel_vrw + n.accel_gap_mps2 * n.accel_gap_mps2 * sample.gap_s,
          share.gyro * n.gyro_arw * n.gyro_arw + n.gyro_gap_rps * n.gyro_gap_rps * sample.gap_s};
}

// Variance of the mean input over dt (accelerometer first, as the biases).
inline Vector<double, 6> input_variance(const WhiteDensity& d, double dt) {
  const double a = d.accel / dt, g = d.gyro / dt;
  return (Vector<double, 6>() << a, a, a, g, g, g).finished();
}

inline Vector<double, 6> input_variance(const ImuNoise& n, double dt, double gap_s = 0.0) {
  return input_variance(white_density(n, gap_s), dt);
}

// What the biases gain over dt.
inline Vector<double, 6> bias_variance(const ImuNoise& n, double dt) {
  const double a = n.accel_bias_rw * n.accel_bias_rw * dt, g = n.gyro_bias_rw * n.gyro_bias_rw * dt;
  return (Vector<double, 6>() << a, a, a, g, g, g).finished();
}

}  // namespace liealign
