// IMU samples between two fixes, summed up once: increments, the columns of their biases, and their noise.
//
// In axes that do not turn and agree with ECEF at the start of the interval, with v' = v_eb_e + omega_ie x p_eb_e,
//   C+ = R C dC,   v'+ = R (v' + C dv + int gamma),   p+ = R (p + v' T + C dp + int int gamma),  R = exp(-omega_ie T)   (Eq. 50)
// with dC, dv, dp of the IMU alone: whoever starts from another attitude, velocity or position shares them. gamma, the
// gravitation, turns with nothing, for its field is round about the axis of the Earth; it is integrated by Simpson's
// rule over T. The error is that of Simpson's rule and of its middle position: below 3e-7 m/s and 1e-7 m for T = 1 s (tested).
//
// Errors are gathered in body axes of the start, eta = Ad(dX) eps' with eps' = (phi, nu', rho): there the motion is
// rho += nu dt, an error of the rate at s enters through (I, hat(dv_s), hat(dp_s)) C_s and one of the force through (0, I, 0) C_s.
//   B_phi_g = B_nu_a = -int C,  B_nu_g = -int hat(dv) C,  B_rho_g = int (B_nu_g - hat(dp) C),  B_rho_a = int B_nu_a   (Eq. 51)
// Noise is the same along every axis, so that C C^T = I drops out of its covariance.
// Source: Brossard et al. (arXiv 2007.14097); Forster et al. (2017) for preintegration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/mechanization.hpp"

namespace liealign {

template <typename Scalar_ = double>
struct Preintegrated {
  using Scalar = Scalar_;
  double T = 0.0;  // s
  // For the biases that the samples were corrected by.
  Matrix3<Scalar> dC = Matrix3<Scalar>::Identity();
  Vector3<Scalar> dv = Vector3<Scalar>::Zero(), dp = Vector3<Scalar>::Zero();  // m/s, m
  // Of eta = (phi, nu, rho) by (b_a, b_g), and its covariance by white noise. Three rows of zeros more, so that columns
  // divide into whole registers.
  Eigen::Matrix<Scalar, 12, 6> B = Eigen::Matrix<Scalar, 12, 6>::Zero();
  Eigen::Matrix<Scalar, 12, 9> Q = Eigen::Matrix<Scalar, 12, 9>::Zero();

  // One sample: constant rate and force over u.dt, without the biases; variance_g [rad^2], variance_a [(m/s)^2] are those
  // of its rotation and velocity increments.
  void append(const ImuInput<Scalar>& u, double variance_a, double variance_g) {
    constexpr int kPhi = SE23<Scalar>::kPhi, kNu = SE23<Scalar>::kNu, kRho = SE23<Scalar>::kRho, kBa = 0, kBg = 3;
    const Scalar dt(u.dt), half(0.5);
    const Vector3<Scalar> phi = u.omega_ib_b * dt;
    const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(phi.squaredNorm());
    const Matrix3<Scalar> E = dt * (dC * gamma<1>(phi, a));  // int C over the sample
    const Vector3<Scalar> step_v = E * u.f_ib_b;
    const Vector3<Scalar> step_p = dt * (dt * (dC * (gamma<2>(phi, a) * u.f_ib_b)) + dv);
    // What an error of the rate over the sample makes of nu and rho by its end: the means of dv_s and of dp_s + (dt - s) dv_s.
    const Vector3<Scalar> v = dv + half * step_v;
    const Vector3<Scalar> r = dp + step_p - (dt / Scalar(6)) * step_v;

    // eta+ = Phi eta + (I, hat(v), hat(r)) E d_g + (0, I, dt/2) E d_a, Phi the drift of rho by nu.
    B.template middleRows<3>(kRho) += dt * B.template middleRows<3>(kNu);
    B.template block<3, 3>(kPhi, kBg) -= E;
    B.template block<3, 3>(kNu, kBg) -= cross_rows(v, E);
    B.template block<3, 3>(kRho, kBg) -= cross_rows(r, E);
    B.template block<3, 3>(kNu, kBa) -= E;
    B.template block<3, 3>(kRho, kBa) -= (half * dt) * E;

    Q.template middleCols<3>(kRho) += dt * Q.template middleCols<3>(kNu);
    Q.template middleRows<3>(kRho) += dt * Q.template middleRows<3>(kNu);
    const Scalar g(variance_g), force(variance_a);
    Q.template block<3, 3>(kPhi, kPhi).diagonal().array() += g;
    const Matrix3<Scalar> g_v = hat(Vector3<Scalar>(g * v)), g_r = hat(Vector3<Scalar>(g * r));
    Q.template block<3, 3>(kNu, kPhi) += g_v;
    Q.template block<3, 3>(kPhi, kNu) -= g_v;
    Q.template block<3, 3>(kRho, kPhi) += g_r;
    Q.template block<3, 3>(kPhi, kRho) -= g_r;
    add_outer(kNu, kNu, g, v, v, force);
    add_outer(kRho, kRho, g, r, r, half * half * dt * dt * force);
    const Matrix3<Scalar> before = Q.template block<3, 3>(kNu, kRho);
    add_outer(kNu, kRho, g, v, r, half * dt * force);
    Q.template block<3, 3>(kRho, kNu) += (Q.template block<3, 3>(kNu, kRho) - before).transpose();

    dp += step_p;
    dv += step_v;
    dC += cross_columns(E, u.omega_ib_b);  // C Gamma_0 = C + C Gamma_1 hat(phi)
    T += u.dt;
  }

  // Q for white noises whose variances are `gyro` and `accel` times those it was gathered with, of which the accelerometers'
  // was density_a [(m/s^2)^2 s]: theirs alone is that of (nu, rho) after a white force,
  // density_a [T, T^2/2; T^2/2, T^3/3] along each axis, up to (dt/T)^2 / 4 of the last.
  void rescale_noise(double gyro, double accel, double density_a) {
    constexpr int kNu = SE23<Scalar>::kNu, kRho = SE23<Scalar>::kRho;
    Q *= Scalar(gyro);
    const double force = (accel - gyro) * density_a * T;
    Q.template block<3, 3>(kNu, kNu).diagonal().array() += Scalar(force);
    Q.template block<3, 3>(kNu, kRho).diagonal().array() += Scalar(force * T / 2.0);
    Q.template block<3, 3>(kRho, kNu).diagonal().array() += Scalar(force * T / 2.0);
    Q.template block<3, 3>(kRho, kRho).diagonal().array() += Scalar(force * T * T / 3.0);
  }

 private:
  // hat(x) M.
  static Matrix3<Scalar> cross_rows(const Vector3<Scalar>& x, const Matrix3<Scalar>& M) {
    Matrix3<Scalar> out;
    for (int i = 0; i < 3; ++i) out.col(i) = x.cross(M.col(i));
    return out;
  }
  // M hat(x).
  static Matrix3<Scalar> cross_columns(const Matrix3<Scalar>& M, const Vector3<Scalar>& x) {
    Matrix3<Scalar> out;
    for (int i = 0; i < 3; ++i) out.row(i) = M.row(i).cross(x);
    return out;
  }
  // The block += g hat(x) hat(y)^T + s I, with hat(x) hat(y)^T = x.y I - y x^T.
  void add_outer(int row, int col, const Scalar& g, const Vector3<Scalar>& x, const Vector3<Scalar>& y,
                 const Scalar& s) {
    Q.template block<3, 3>(row, col) -= (g * y) * x.transpose();
    Q.template block<3, 3>(row, col).diagonal().array() += g * x.dot(y) + s;
  }
};

// The increments (dC, dv, dp) for the biases b_0 + delta_b (accelerometer first), b_0 those that the samples were corrected
// by: X(b) = X(b_0) exp(B delta_b), first order in delta_b.
template <typename Scalar>
SE23<Scalar> increments(const Preintegrated<Scalar>& pre, const Vector<Scalar, 6>& delta_b) {
  typename SE23<Scalar>::Tangent eta;  // dX exp(Ad(dX^-1) eta) = exp(eta) dX
  eta = pre.B.template topRows<9>().lazyProduct(delta_b);
  return SE23<Scalar>::exp(eta) * SE23<Scalar>{pre.dC, pre.dv, pre.dp};
}

// Gravitation along an interval of T seconds, the parabola through its values at the start, the middle and the end; what it
// pulls at T is what Simpson's rule gives:  gamma(t) = start + slope t + bend t^2           (Eq. 52)
template <typename Scalar>
struct IntervalPull {
  Vector3<Scalar> start = Vector3<Scalar>::Zero(), slope = start, bend = start;  // m/s^2, by t, by t^2

  IntervalPull() = default;
  // d from increments(); T above 0.
  IntervalPull(const SE23<Scalar>& X, const SE23<Scalar>& d, double seconds, GravityModel model)
      : start(gravitation_e(X.p, model)) {
    const Scalar T(seconds), half(0.5);
    const Vector3<Scalar> v_i = X.v + wgs84::omega_ie_e<Scalar>().cross(X.p), C_dp = X.C * d.p;
    // The middle: the force as if constant over the interval.
    const Vector3<Scalar> p_middle = X.p + half * T * v_i + Scalar(0.25) * (C_dp + half * T * T * start);
    const Vector3<Scalar> p_end = X.p + T * v_i + C_dp + half * T * T * start;
    const Vector3<Scalar> middle = gravitation_e(p_middle, model), end = gravitation_e(p_end, model);
    slope = (Scalar(4) * middle - Scalar(3) * start - end) / T;
    bend = Scalar(2) * (start - Scalar(2) * middle + end) / (T * T);
  }

  Vector3<Scalar> v(const Scalar& t) const { return t * (start + t * (Scalar(0.5) * slope + (t / Scalar(3)) * bend)); }
  Vector3<Scalar> p(const Scalar& t) const {
    return (t * t) * (Scalar(0.5) * start + (t / Scalar(6)) * (slope + Scalar(0.5) * t * bend));
  }
};

// (Eq. 50). The state t [s] after X, t within the interval of `pull`; d the increments up to there.
template <typename Scalar>
SE23<Scalar> advance_interval(const SE23<Scalar>& X, const SE23<Scalar>& d, double seconds,
                              const IntervalPull<Scalar>& pull) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  const Scalar t(seconds);
  const Vector3<Scalar> v_i = X.v + omega_ie.cross(X.p);
  const Matrix3<Scalar> R = gamma<0>(Vector3<Scalar>(-omega_ie * t));
  SE23<Scalar> next;
  next.C = R * X.C * d.C;
  next.p = R * (X.p + t * v_i + X.C * d.p + pull.p(t));
  next.v = R * (v_i + X.C * d.v + pull.v(t)) - omega_ie.cross(next.p);
  return next;
}

}  // namespace liealign
