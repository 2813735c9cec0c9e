// IMU samples between two fixes, summed up once: increments, the columns of their biases, and their noise.
//
// In axes that do not turn and agree with ECEF at the start of the interval, with v' = v_eb_e + omega_ie x p_eb_e,
//   C+ = R C dC,   v'+ = R (v' + C dv + int gamma),   p+ = R (p + v' T + C dp + int int gamma),  R = exp(-omega_ie T)   (Eq. 50)
// with dC, dv, dp of the IMU alone: whoever starts from another attitude, velocity or position shares them. gamma, the
// gravitation, turns with nothing, for its field is round about the axis of the Earth; it is integrated by Simpson's
// rule over T. The error is that of Simpson's rule and of its middle position: below 3e-7 m/s and 1e-7 m for T = 1 s (tested).
//
// Errors are gathered in body axes of the start, eta = Ad(dX) eps' with eps' = (phi, nu', rho), and rho without its drift,
// rho - t nu: there nothing moves but by the IMU. An error of the rate at s enters through (I, hat(v), hat(q)) C_s, v = dv_s,
// q = dp_s - s dv_s, and one of the force through (0, I, -s) C_s, so that sums are all it takes:
//   B = [0, -int C; -int C, -int hat(v) C; int s C, -int hat(q) C]   of (phi, nu, rho - t nu) by (b_a, b_g)   (Eq. 51)
// Noise is the same along every axis, so that C C^T = I drops out of its covariance, and hat(x) hat(y)^T = x.y I - y x^T.
// Two intervals in a row: along the second s = T + s_2, C = dC C_2, v = dv + dC v_2, and q = (dp - T dv) + dC (q_2 - T v_2),
// with T, dC, dv, dp of the first. All sums follow.                                                                    (Eq. 65)
// Source: Brossard et al. (arXiv 2007.14097); Forster et al. (2017) for preintegration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/mechanization.hpp"

namespace liealign {

namespace detail {

// hat(x) M.
template <typename Scalar, int cols>
Eigen::Matrix<Scalar, 3, cols> cross_rows(const Vector3<Scalar>& x, const Eigen::Matrix<Scalar, 3, cols>& M) {
  Eigen::Matrix<Scalar, 3, cols> out;
  for (int i = 0; i < cols; ++i) out.col(i) = x.cross(M.col(i));
  return out;
}

// M hat(x).
template <typename Scalar, int rows>
Eigen::Matrix<Scalar, rows, 3> cross_columns(const Eigen::Matrix<Scalar, rows, 3>& M, const Vector3<Scalar>& x) {
  Eigen::Matrix<Scalar, rows, 3> out;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    out.col(i) = x[k] * M.col(j) - x[j] * M.col(k);
  }
  return out;
}

}  // namespace detail

template <typename Scalar_ = double>
struct Preintegrated {
  using Scalar = Scalar_;
  Scalar T{0};  // s
  // For the biases that the samples were corrected by.
  Matrix3<Scalar> dC = Matrix3<Scalar>::Identity();
  Vector3<Scalar> dv = Vector3<Scalar>::Zero(), dp = Vector3<Scalar>::Zero();  // m/s, m
  // Of (Eq. 51): int C, int s C, int hat(v) C, int hat(q) C.
  Matrix3<Scalar> C_1 = Matrix3<Scalar>::Zero(), C_s = C_1, C_v = C_1, C_q = C_1;
  // Sums over the white noises of the gyros, g [rad^2]: g, g v, g q, g v v^T, g v q^T, g q q^T; and of the accelerometers,
  // f [(m/s)^2]: f, f s, f s^2.
  Scalar g{0};
  Vector3<Scalar> g_v = Vector3<Scalar>::Zero(), g_q = g_v;
  Matrix3<Scalar> g_vv = Matrix3<Scalar>::Zero(), g_vq = g_vv, g_qq = g_vv;
  Scalar f{0}, f_s{0}, f_ss{0};

  // One sample: constant rate and force over u.dt, without the biases; variance_g [rad^2], variance_a [(m/s)^2] are those
  // of its rotation and velocity increments.
  void append(const ImuInput<Scalar>& u, double variance_a, double variance_g);

  // (Eq. 65): the interval that follows, gathered from its own start with the same biases.
  void append(const Preintegrated& next);

  // For white noises whose variances are `gyro` and `accel` times those of the samples.
  void rescale_noise(double gyro, double accel) {
    const Scalar by(gyro), force(accel);
    for (Scalar* sum : {&f, &f_s, &f_ss}) *sum *= force;
    for (Matrix3<Scalar>* sum : {&g_vv, &g_vq, &g_qq}) *sum *= by;
    for (Vector3<Scalar>* sum : {&g_v, &g_q}) *sum *= by;
    g *= by;
  }

  // For another scalar.
  template <typename To>
  Preintegrated<To> cast() const {
    Preintegrated<To> to;
    to.each(
        *this, [](auto& out, const auto& in) { out = in.template cast<To>(); },
        [](To& out, const Scalar& in) { out = To(in); });
    return to;
  }

  // matrix(mine, its), number(mine, its) for every member.
  template <typename Other, typename OnMatrix, typename OnNumber>
  void each(const Other& its, const OnMatrix& matrix, const OnNumber& number) {
    number(T, its.T);
    matrix(dC, its.dC);
    matrix(dv, its.dv);
    matrix(dp, its.dp);
    matrix(C_1, its.C_1);
    matrix(C_s, its.C_s);
    matrix(C_v, its.C_v);
    matrix(C_q, its.C_q);
    number(g, its.g);
    matrix(g_v, its.g_v);
    matrix(g_q, its.g_q);
    matrix(g_vv, its.g_vv);
    matrix(g_vq, its.g_vq);
    matrix(g_qq, its.g_qq);
    number(f, its.f);
    number(f_s, its.f_s);
    number(f_ss, its.f_ss);
  }
};

template <typename Scalar>
void Preintegrated<Scalar>::append(const ImuInput<Scalar>& u, double variance_a, double variance_g) {
  const Scalar dt(u.dt), half(0.5);
  const Vector3<Scalar> phi = u.omega_ib_b * dt;
  const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(phi.squaredNorm());
  const Matrix3<Scalar> E = dt * (dC * gamma<1>(phi, a));  // int C over the sample
  const Vector3<Scalar> step_v = E * u.f_ib_b;
  const Vector3<Scalar> step_p = dt * (dt * (dC * (gamma<2>(phi, a) * u.f_ib_b)) + dv);
  // What an error of the rate over the sample makes of nu and rho by its end: the means of dv_s and of dp_s + (dt - s) dv_s.
  const Vector3<Scalar> v = dv + half * step_v;
  const Vector3<Scalar> r = dp + step_p - (dt / Scalar(6)) * step_v;
  const Scalar s = T + half * dt;
  T += dt;
  const Vector3<Scalar> q = r - T * v;

  C_1 += E;
  C_s += s * E;
  C_v += detail::cross_rows(v, E);
  C_q += detail::cross_rows(q, E);
  const Scalar variance(variance_g), force(variance_a);
  const Vector3<Scalar> weighted_v = variance * v, weighted_q = variance * q;
  g += variance;
  g_v += weighted_v;
  g_q += weighted_q;
  g_vv += weighted_v * v.transpose();
  g_vq += weighted_v * q.transpose();
  g_qq += weighted_q * q.transpose();
  f += force;
  f_s += force * s;
  f_ss += force * s * s;

  dp += step_p;
  dv += step_v;
  dC += detail::cross_columns(E, u.omega_ib_b);  // C Gamma_0 = C + C Gamma_1 hat(phi)
}

template <typename Scalar>
void Preintegrated<Scalar>::append(const Preintegrated& next) {
  const Matrix3<Scalar> E = dC * next.C_1, Ev = dC * next.C_v;
  const Vector3<Scalar> q = dp - T * dv;
  // Sums along the second of the parts of v and q that its own motion adds to those at its start.
  const Vector3<Scalar> w_v = dC * next.g_v, w_q = dC * (next.g_q - T * next.g_v);
  const Matrix3<Scalar> vq = next.g_vq - T * next.g_vv;
  const Matrix3<Scalar> qq = next.g_qq - T * (next.g_vq.transpose() + vq);

  C_v += detail::cross_rows(dv, E) + Ev;
  C_q += detail::cross_rows(q, E) - T * Ev + dC * next.C_q;
  C_s += T * E + dC * next.C_s;
  C_1 += E;
  g_vv += (next.g * dv + w_v) * dv.transpose() + dv * w_v.transpose() + dC * next.g_vv * dC.transpose();
  g_vq += (next.g * dv + w_v) * q.transpose() + dv * w_q.transpose() + dC * vq * dC.transpose();
  g_qq += (next.g * q + w_q) * q.transpose() + q * w_q.transpose() + dC * qq * dC.transpose();
  g_v += next.g * dv + w_v;
  g_q += next.g * q + w_q;
  g += next.g;
  f_ss += next.f_ss + T * (Scalar(2) * next.f_s + T * next.f);
  f_s += next.f_s + T * next.f;
  f += next.f;

  dp += next.T * dv + dC * next.dp;
  dv += dC * next.dv;
  dC *= next.dC;
  T += next.T;
}

// In preintegration.cpp.
extern template void Preintegrated<double>::append(const ImuInput<double>&, double, double);
extern template void Preintegrated<double>::append(const Preintegrated&);

// The increments (dC, dv, dp) for the biases b_0 + delta_b (accelerometer first), b_0 those that the samples were corrected
// by: X(b) = X(b_0) exp(B delta_b), first order in delta_b.
template <typename Scalar>
SE23<Scalar> increments(const Preintegrated<Scalar>& pre, const Vector<Scalar, 6>& delta_b) {
  const Vector3<Scalar> a = delta_b.template head<3>(), w = delta_b.template tail<3>();
  const Vector3<Scalar> nu = -(pre.C_1 * a + pre.C_v * w);
  typename SE23<Scalar>::Tangent eta;  // dX exp(Ad(dX^-1) eta) = exp(eta) dX
  eta << -(pre.C_1 * w), nu, pre.C_s * a - pre.C_q * w + pre.T * nu;
  return SE23<Scalar>::exp(eta) * SE23<Scalar>{pre.dC, pre.dv, pre.dp};
}

// Gravitation along an interval of T seconds, the parabola through its values at the start, the middle and the end; what it
// pulls at T is what Simpson's rule gives:  gamma(t) = start + slope t + bend t^2           (Eq. 52)
template <typename Scalar>
struct IntervalPull {
  Vector3<Scalar> start = Vector3<Scalar>::Zero(), slope = start, bend = start;  // m/s^2, by t, by t^2

  IntervalPull() = default;
  // d from increments(); T above 0.
  IntervalPull(const SE23<Scalar>& X, const SE23<Scalar>& d, const Scalar& T, GravityModel model)
      : start(gravitation_e(X.p, model)) {
    const Scalar half(0.5);
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
SE23<Scalar> advance_interval(const SE23<Scalar>& X, const SE23<Scalar>& d, const Scalar& t,
                              const IntervalPull<Scalar>& pull) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  const Vector3<Scalar> v_i = X.v + omega_ie.cross(X.p);
  const Matrix3<Scalar> R = gamma<0>(Vector3<Scalar>(-omega_ie * t));
  SE23<Scalar> next;
  next.C = R * X.C * d.C;
  next.p = R * (X.p + t * v_i + X.C * d.p + pull.p(t));
  next.v = R * (v_i + X.C * d.v + pull.v(t)) - omega_ie.cross(next.p);
  return next;
}

}  // namespace liealign
