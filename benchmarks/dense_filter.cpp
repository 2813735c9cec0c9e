// The dense yardstick.
// SPDX-License-Identifier: Apache-2.0
#include "dense_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>

#include "liealign/earth/gravity.hpp"
#include "liealign/observe/kinds.hpp"

namespace liealign::bench {
namespace {

constexpr int kPsi = 0, kV = 3, kP = 6;  // then kBa, kBg of liealign
using Matrix3x15 = Eigen::Matrix<double, 3, 15>;

Matrix3d rotation(const Vector3d& phi) { return Eigen::AngleAxisd(phi.norm(), phi.normalized()).toRotationMatrix(); }

// Attitude by the rate, velocity by the force at the attitude of the middle, position by the mean velocity.
void mechanize(DenseState& X, const Vector3d& omega, const Vector3d& f, double dt, GravityModel gravity) {
  const Vector3d omega_ie = wgs84::omega_ie_e();
  const Vector3d f_e = X.C_b_e * rotation(0.5 * dt * omega) * f;
  const Vector3d v = X.v + dt * (f_e + gravity_e(X.p, gravity) - 2.0 * omega_ie.cross(X.v));
  X.C_b_e = rotation(-dt * omega_ie) * X.C_b_e * rotation(dt * omega);
  X.p += 0.5 * dt * (X.v + v);
  X.v = v;
}

Matrix15 transition(const DenseState& X, const Vector3d& f, double dt) {
  const Matrix3d Omega = hat(wgs84::omega_ie_e());
  Matrix15 F = Matrix15::Identity();
  F.block<3, 3>(kPsi, kPsi) -= dt * Omega;
  F.block<3, 3>(kPsi, kBg) = -dt * X.C_b_e;
  F.block<3, 3>(kV, kPsi) = -dt * hat(X.C_b_e * f);
  F.block<3, 3>(kV, kV) -= 2.0 * dt * Omega;
  F.block<3, 3>(kV, kP) = dt * gravitation_gradient_e(X.p);
  F.block<3, 3>(kV, kBa) = -dt * X.C_b_e;
  F.block<3, 3>(kP, kV) = dt * Matrix3d::Identity();
  return F;
}

Matrix15 process_noise(const ImuNoise& n, double dt, double gap_s) {
  const Vector<double, 6> input = dt * dt * input_variance(n, dt, gap_s), walk = bias_variance(n, dt);
  Vector15 diagonal;
  diagonal << input.tail<3>(), input.head<3>(), Vector3d::Zero(), walk;
  return diagonal.asDiagonal();
}

// X with its error dx taken off.
void inject(DenseState& X, const Vector15& dx) {
  X.C_b_e = rotation(dx.segment<3>(kPsi)) * X.C_b_e;
  X.v += dx.segment<3>(kV);
  X.p += dx.segment<3>(kP);
  X.b_a += dx.segment<3>(kBa);
  X.b_g += dx.segment<3>(kBg);
}

// The error of X_hat against X.
Vector15 difference(const DenseState& X_hat, const DenseState& X) {
  const Eigen::AngleAxisd turn(Matrix3d(X.C_b_e * X_hat.C_b_e.transpose()));
  Vector15 dx;
  dx << turn.angle() * turn.axis(), X.v - X_hat.v, X.p - X_hat.p, X.b_a - X_hat.b_a, X.b_g - X_hat.b_g;
  return dx;
}

void update(DenseBelief& b, const Vector3d& z, const Matrix3x15& H, const Matrix3d& R) {
  const Matrix3d S = H * b.P * H.transpose() + R;
  const Eigen::Matrix<double, 15, 3> K = S.llt().solve(H * b.P).transpose();
  const Matrix15 I_KH = Matrix15::Identity() - K * H;
  b.P = (I_KH * b.P * I_KH.transpose() + K * R * K.transpose()).eval();
  b.P = (0.5 * (b.P + b.P.transpose())).eval();
  inject(b.X, K * z);
}

void update_position(DenseBelief& b, const Observation& o) {
  const Vector3d lever_e = b.X.C_b_e * o.lever_b;
  Matrix3x15 H = Matrix3x15::Zero();
  H.middleCols<3>(kPsi) = -hat(lever_e);
  H.middleCols<3>(kP).setIdentity();
  update(b, o.y - b.X.p - lever_e, H, o.R);
}

void update_zero_velocity(DenseBelief& b, const Observation& o) {
  Matrix3x15 H = Matrix3x15::Zero();
  H.middleCols<3>(kV).setIdentity();
  update(b, -b.X.v, H, o.R);
}

void update_zero_rate(DenseBelief& b, const Observation& o, double gyro_arw) {
  const Vector3d omega_ie = wgs84::omega_ie_e();
  const Matrix3d C_e_b = b.X.C_b_e.transpose();
  const Vector3d noise = o.R.diagonal().cwiseMax(gyro_arw * gyro_arw / o.span_s);
  Matrix3x15 H = Matrix3x15::Zero();
  H.middleCols<3>(kPsi) = C_e_b * hat(omega_ie);
  H.middleCols<3>(kBg).setIdentity();
  update(b, o.y - b.X.b_g - C_e_b * omega_ie, H, Matrix3d(noise.asDiagonal()) + o.root * o.root.transpose());
}

// Of the kinds that this filter knows.
void update(DenseBelief& b, const Observation& o, double gyro_arw) {
  if (o.kind == &kGnssPosition) update_position(b, o);
  if (o.kind == &kZeroVelocity) update_zero_velocity(b, o);
  if (o.kind == &kZeroRate) update_zero_rate(b, o, gyro_arw);
}

}  // namespace

DenseBelief dense_belief(const Belief<LieModel<double>>& belief) {
  const SE23<double>& nav = belief.X.first;
  Matrix15 T = Matrix15::Identity();
  for (const int block : {kPsi, kV, kP}) T.block<3, 3>(block, block) = nav.C;
  return {{nav.C, nav.v, nav.p, b_a(belief.X), b_g(belief.X)}, T * belief.P * T.transpose()};
}

void dense_forward(const FlightData& data, const FilterOptions& options, double t_begin_s, DenseBelief& belief,
                   std::vector<DenseState>& at_events, std::vector<DenseStep>* steps) {
  ImuCursor at = cursor_at(data.imu(), t_begin_s);
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    const Observation& o = data.observations[i];
    if (o.t_s <= t_begin_s) continue;
    while (at.k < data.imu().size() && at.t_s < o.t_s) {
      const ImuSample& s = data.imu()[at.k];
      const double end = std::min(s.t_s, o.t_s), dt = end - at.t_s;
      const Vector3d omega = s.omega_ib_b - belief.X.b_g, f = s.f_ib_b - belief.X.b_a;
      const Matrix15 F = transition(belief.X, f, dt);
      if (steps) steps->push_back({belief, {}, F});
      mechanize(belief.X, omega, f, dt, options.dynamics.gravity);
      belief.P = (F * belief.P * F.transpose() + process_noise(options.dynamics.noise, dt, s.gap_s)).eval();
      if (steps) steps->back().predicted = belief;
      at.t_s = end;
      if (end == s.t_s) ++at.k;
    }
    update(belief, o, options.dynamics.noise.gyro_arw);
    const bool last = i + 1 == data.observations.size() || data.observations[i + 1].t_s > o.t_s;
    if (last) at_events.push_back(belief.X);
  }
}

std::vector<DenseBelief> dense_backward(const std::vector<DenseStep>& steps, const DenseBelief& last) {
  std::vector<DenseBelief> smoothed(steps.size());
  DenseBelief next = last;
  for (std::size_t i = steps.size(); i-- > 0;) {
    const DenseStep& s = steps[i];
    const Matrix15 G = s.predicted.P.llt().solve(s.F * s.filtered.P).transpose();
    const Vector15 dx = G * difference(s.predicted.X, next.X);
    next.P = (s.filtered.P + G * (next.P - s.predicted.P) * G.transpose()).eval();
    next.X = s.filtered.X;
    inject(next.X, dx);
    smoothed[i] = next;
  }
  return smoothed;
}

}  // namespace liealign::bench
