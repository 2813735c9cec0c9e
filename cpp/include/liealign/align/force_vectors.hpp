// The specific force of the antenna, as the fixes say it and as the IMU says it: the vectors of (Eq. 56).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "liealign/estimate/flight_data.hpp"

namespace liealign {

// Over the same second or two.
struct ForcePair {
  Vector3d alpha;  // a_n - g_n of the fixes, NED, m/s^2
  Vector3d beta;   // of the accelerometers, in L
  Matrix3d C;      // C_L in its middle
  Matrix3d G;      // int C_L from the window's begin to there, s
};

class ForceVectors {
 public:
  // L: the body axes at t_ref_s. The gyros are integrated from there without the bias b_g_rps.
  ForceVectors(const ImuSeries& imu, const std::vector<GnssFix>& fixes, Vector3d l_ba_b, double t_ref_s, double t_end_s,
               const Vector3d& b_g_rps);

  // Of the fixes in [begin_s, end_s], each taken to be latency_s older than its t_s.
  std::vector<ForcePair> pairs(double begin_s, double end_s, double latency_s) const;

  Matrix3d G_at(double t_s) const { return at(t_s).G; }
  Vector3d mean_force() const { return mean_force_; }  // of the first seconds, body axes

 private:
  // Integrals from t_ref on, in L.
  struct Node {
    double t_s;
    Vector3d V, S;  // int C f, its integral, m/s and m
    Vector3d v_l;   // C (omega x l), m/s
    Matrix3d C, G;
  };
  // What the fixes say at one instant or over three.
  struct Difference {
    double t_s[3];   // of the fixes; two of velocities
    Vector3d alpha;  // m/s^2, NED
  };

  void integrate(const ImuSeries& imu, double t_ref_s, double t_end_s, const Vector3d& b_g_rps);
  void difference(const std::vector<GnssFix>& fixes, double t_ref_s, double t_end_s);
  Node at(double t_s) const;

  Vector3d l_ba_b_;
  std::vector<Node> nodes_;
  bool velocities_ = false;
  std::vector<Difference> differences_;
  Vector3d mean_force_ = Vector3d::Zero();
};

}  // namespace liealign
