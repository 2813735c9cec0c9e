// SO(3): hat, vee, exp, log, the Gamma_m kernels and the Jacobians, closed form and templated on the scalar.
//
//   a_n(theta^2) = sum_k (-1)^k theta^(2k) / (2k + n)!                                   (Eq. 1)
//   Gamma_m(phi) = sum_k hat(phi)^k / (k + m)! = I/m! + a_{m+1} hat(phi) + a_{m+2} hat(phi)^2   (Eq. 2)
//
// Gamma_0 = exp, Gamma_1 = J_l (left Jacobian), Gamma_2 = the double integral of exp. J_r(phi) = J_l(-phi).
// Source: TAES (2), (5); Barfoot, State Estimation for Robotics (2017), ch. 7. Only this floor tests for small
// angles: power series below 0.5 rad, closed form above (docs/equations.md says why).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "liealign/core/lanes.hpp"
#include "liealign/core/types.hpp"

namespace liealign {

inline constexpr double kSeriesAngle = 0.5;  // rad; the one small-angle threshold of the project

// (-1)^k / (2k + n)!, n = 6, 7.
inline constexpr std::array<std::array<double, 8>, 2> kSeries = [] {
  std::array<std::array<double, 8>, 2> series{};
  for (std::size_t n = 6; n < 8; ++n) {
    double factorial = n == 6 ? 720.0 : 5040.0;
    for (std::size_t k = 0; k < 8; ++k) {
      series[n - 6][k] = (k % 2 == 0 ? 1.0 : -1.0) / factorial;
      const auto next = static_cast<double>(2 * k + n + 1);
      factorial *= next * (next + 1.0);
    }
  }
  return series;
}();

// The coefficients a_0 ... a_7 of (Eq. 1) at one squared angle.
template <typename Scalar>
using ExpCoefficients = std::array<Scalar, 8>;

inline constexpr std::array<double, 8> kInverseFactorials = {1.0,      1.0,       1.0 / 2,   1.0 / 6,
                                                             1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040};

namespace detail {

// a_n = 1/n! - theta^2 a_{n+2}: upwards this divides by theta^2 (closed form), downwards it is stable.
template <typename Scalar>
ExpCoefficients<Scalar> closed_coefficients(const Scalar& theta2) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  ExpCoefficients<Scalar> a;
  const Scalar theta = sqrt(theta2);
  a[0] = cos(theta);
  a[1] = sin(theta) / theta;
  for (std::size_t n = 2; n < a.size(); ++n) a[n] = (Scalar(kInverseFactorials[n - 2]) - a[n - 2]) / theta2;
  return a;
}

// Horner of eight terms, (-1)^k / (2k + n)!: the first one left out is below theta^16 n!/(16 + n)! < 1e-18 at 0.5 rad.
template <typename Scalar>
ExpCoefficients<Scalar> series_coefficients(const Scalar& theta2) {
  ExpCoefficients<Scalar> a;
  for (std::size_t n = 6; n < a.size(); ++n) {
    a[n] = Scalar(kSeries[n - 6][7]);
    for (std::size_t k = 7; k-- > 0;) a[n] = Scalar(kSeries[n - 6][k]) + theta2 * a[n];
  }
  for (std::size_t n = 6; n-- > 0;) a[n] = Scalar(kInverseFactorials[n]) - theta2 * a[n + 2];
  return a;
}

}  // namespace detail

// theta2 = |phi|^2 [rad^2]. Relative error below 1e-15 in the series; absolute error above it below 2e-15 up to a_5 and
// 1e-14 for a_6, a_7 (each division by theta^2 costs up to a factor four).
template <typename Scalar>
ExpCoefficients<Scalar> exp_coefficients(const Scalar& theta2) {
  return theta2 > Scalar(kSeriesAngle * kSeriesAngle) ? detail::closed_coefficients(theta2)
                                                      : detail::series_coefficients(theta2);
}

// Each lane by its own angle.
template <>
inline ExpCoefficients<Lanes> exp_coefficients(const Lanes& theta2) {
  ExpCoefficients<Lanes> a = detail::series_coefficients(theta2);
  for (int i = 0; i < Lanes::kCount; ++i) {
    if (!(theta2.x[i] > kSeriesAngle * kSeriesAngle)) continue;
    const ExpCoefficients<double> closed = detail::closed_coefficients(theta2.x[i]);
    for (std::size_t n = 0; n < a.size(); ++n) a[n].x[i] = closed[n];
  }
  return a;
}

// hat: the skew-symmetric matrix with hat(x) y = x cross y. TAES (1).
template <typename Derived>
Matrix3<typename Derived::Scalar> hat(const Eigen::MatrixBase<Derived>& x) {
  using S = typename Derived::Scalar;
  Matrix3<S> m;
  m << S(0), -x[2], x[1], x[2], S(0), -x[0], -x[1], x[0], S(0);
  return m;
}

// vee: inverse of hat.
template <typename Scalar>
Vector3<Scalar> vee(const Matrix3<Scalar>& m) {
  return Vector3<Scalar>(m(2, 1), m(0, 2), m(1, 0));
}

// Gamma_m(phi) of (Eq. 2) from coefficients already at hand, m = 0, 1, 2, 3.
template <int m, typename Scalar>
Matrix3<Scalar> gamma(const Vector3<Scalar>& phi, const ExpCoefficients<Scalar>& a) {
  constexpr std::array<double, 4> kInverseFactorial = {1.0, 1.0, 1.0 / 2, 1.0 / 6};
  static_assert(m >= 0 && m <= 3);
  const Scalar theta2 = phi.squaredNorm();
  Matrix3<Scalar> g = a[m + 2] * phi * phi.transpose();  // hat(phi)^2 = phi phi^T - theta^2 I
  g += a[m + 1] * hat(phi);
  g.diagonal().array() += Scalar(kInverseFactorial[m]) - theta2 * a[m + 2];
  return g;
}

template <int m, typename Scalar>
Matrix3<Scalar> gamma(const Vector3<Scalar>& phi) {
  return gamma<m>(phi, exp_coefficients<Scalar>(phi.squaredNorm()));
}

// d(Gamma_m(phi) f)/d phi, 3x3, from
//   d a_n/d theta = theta (n a_{n+2} - a_{n+1})                                          (Eq. 3)
// Used for the gyro-bias columns of the mechanization.
template <int m, typename Scalar>
Matrix3<Scalar> gamma_times_vector_derivative(const Vector3<Scalar>& phi, const Vector3<Scalar>& f,
                                              const ExpCoefficients<Scalar>& a) {
  static_assert(m >= 0 && m <= 2);
  constexpr int n1 = m + 1, n2 = m + 2;
  const Vector3<Scalar> phi_f = phi.cross(f);
  const Vector3<Scalar> phi_phi_f = phi.cross(phi_f);
  const Scalar slope1 = Scalar(n1) * a[n1 + 2] - a[n1 + 1];
  const Scalar slope2 = Scalar(n2) * a[n2 + 2] - a[n2 + 1];
  Matrix3<Scalar> d = (slope1 * phi_f + slope2 * phi_phi_f) * phi.transpose();
  d -= a[n1] * hat(f);
  d += a[n2] * (phi * f.transpose() - Scalar(2) * f * phi.transpose());
  d.diagonal().array() += a[n2] * phi.dot(f);
  return d;
}

// The group SO(3) with elements C, a rotation matrix. Tangent: rotation vector, rad.
template <typename Scalar_ = double>
struct SO3 {
  using Scalar = Scalar_;
  static constexpr int Dim = 3;
  using Tangent = Vector3<Scalar>;
  using Jacobian = Matrix3<Scalar>;

  Matrix3<Scalar> C = Matrix3<Scalar>::Identity();

  static SO3 exp(const Tangent& phi) { return {gamma<0>(phi)}; }
  SO3 inverse() const { return {C.transpose()}; }
  SO3 operator*(const SO3& other) const { return {C * other.C}; }

  // Rotation vector with |phi| <= pi. Through the quaternion, so that it holds up to pi; at pi itself the sign of
  // the axis is arbitrary.
  Tangent log() const;

  Jacobian Ad() const { return C; }
  static Jacobian ad(const Tangent& phi) { return hat(phi); }
  static Jacobian left_jacobian(const Tangent& phi) { return gamma<1>(phi); }
  static Jacobian right_jacobian(const Tangent& phi) { return gamma<1>(phi).transpose(); }
  static Jacobian left_jacobian_inverse(const Tangent& phi);
  static Jacobian right_jacobian_inverse(const Tangent& phi) { return left_jacobian_inverse(phi).transpose(); }
};

// J_l^-1 = I - hat/2 + (1 - a_1 / (2 a_2)) / theta^2 hat^2, |phi| < 2 pi.                 (Eq. 4)
template <typename Scalar>
typename SO3<Scalar>::Jacobian SO3<Scalar>::left_jacobian_inverse(const Tangent& phi) {
  const Scalar theta2 = phi.squaredNorm();
  Scalar c;
  if (theta2 > Scalar(kSeriesAngle * kSeriesAngle)) {
    const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(theta2);
    c = (Scalar(1) - a[1] / (Scalar(2) * a[2])) / theta2;
  } else {
    // sum_k |B_2k| / (2k)! theta^(2k - 2), Bernoulli numbers; the ratio of terms is (theta / 2 pi)^2 < 0.0064.
    constexpr std::array<double, 8> kTerms = {1.0 / 12,
                                              1.0 / 720,
                                              1.0 / 30240,
                                              1.0 / 1209600,
                                              1.0 / 47900160,
                                              691.0 / 1307674368000.0,
                                              1.0 / 74724249600.0,
                                              3617.0 / 10670622842880000.0};
    c = Scalar(kTerms[7]);
    for (std::size_t k = 7; k-- > 0;) c = Scalar(kTerms[k]) + theta2 * c;
  }
  const Matrix3<Scalar> h = hat(phi);
  return Matrix3<Scalar>::Identity() - Scalar(0.5) * h +
         c * (phi * phi.transpose() - theta2 * Matrix3<Scalar>::Identity());
}

template <typename Scalar>
typename SO3<Scalar>::Tangent SO3<Scalar>::log() const {
  using std::atan2;
  using std::sqrt;
  // Unit quaternion (w, q) from the largest of its four components (Shepperd).
  const Scalar trace = C.trace();
  Scalar w;
  Tangent q;
  int largest = 0;
  for (int i = 1; i < 3; ++i) {
    if (C(i, i) > C(largest, largest)) largest = i;
  }
  if (trace > C(largest, largest)) {
    w = Scalar(0.5) * sqrt(Scalar(1) + trace);
    q = vee<Scalar>(C - C.transpose()) / (Scalar(4) * w);
  } else {
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    const Scalar twice = sqrt(Scalar(1) + C(i, i) - C(j, j) - C(k, k));
    q[i] = Scalar(0.5) * twice;
    q[j] = (C(j, i) + C(i, j)) / (Scalar(2) * twice);
    q[k] = (C(k, i) + C(i, k)) / (Scalar(2) * twice);
    w = (C(k, j) - C(j, k)) / (Scalar(2) * twice);
    if (w < Scalar(0)) {
      w = -w;
      q = -q;
    }
  }
  const Scalar n2 = q.squaredNorm();  // sin^2(theta / 2)
  // theta = 2 atan2(|q|, w), and tan(theta / 2) stays below 0.2554 while theta < 0.5 rad.
  const Scalar ratio2 = n2 / (w * w);
  const double kTan = 0.255341921221036;  // tan(kSeriesAngle / 2)
  if (ratio2 > Scalar(kTan * kTan)) {
    const Scalar n = sqrt(n2);
    return Scalar(2) * atan2(n, w) / n * q;
  }
  Scalar sum(1.0 / 27);  // atan(x)/x = sum_k (-1)^k x^(2k) / (2k + 1); first term left out below 2e-18
  for (int k = 12; k >= 0; --k) sum = Scalar(1.0 / (2 * k + 1)) - ratio2 * sum;
  return Scalar(2) / w * sum * q;
}

}  // namespace liealign
