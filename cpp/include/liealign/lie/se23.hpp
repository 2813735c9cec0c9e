// SE_2(3): the double direct isometries (C, v, p), closed form and templated on the scalar.
//
//   X = [C v p; 0 1 0; 0 0 1],   X1 X2 = (C1 C2, C1 v2 + v1, C1 p2 + p1)                   (Eq. 5)
//   exp(phi, nu, rho) = (Gamma_0(phi), Gamma_1(phi) nu, Gamma_1(phi) rho)                    (Eq. 6)
//
// Tangent order (phi, nu, rho): rad, then the units of v and p.
// Source: TAES (1)-(5), (19); Barrau (2015); the block Q equals Barfoot (2017) (7.86).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"
#include "liealign/lie/so3.hpp"

namespace liealign {

template <typename Scalar_ = double>
struct SE23 {
  using Scalar = Scalar_;
  static constexpr int Dim = 9;
  static constexpr int kPhi = 0, kNu = 3, kRho = 6;  // offsets of the tangent blocks
  using Tangent = Vector<Scalar, Dim>;
  using Jacobian = SquareMatrix<Scalar, Dim>;

  Matrix3<Scalar> C = Matrix3<Scalar>::Identity();
  Vector3<Scalar> v = Vector3<Scalar>::Zero();
  Vector3<Scalar> p = Vector3<Scalar>::Zero();

  static SE23 exp(const Tangent& xi) {
    const Vector3<Scalar> phi = xi.template segment<3>(kPhi);
    const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(phi.squaredNorm());
    const Matrix3<Scalar> J = gamma<1>(phi, a);
    return {gamma<0>(phi, a), J * xi.template segment<3>(kNu), J * xi.template segment<3>(kRho)};
  }

  Tangent log() const {
    Tangent xi;
    const Vector3<Scalar> phi = SO3<Scalar>{C}.log();
    const Matrix3<Scalar> J_inverse = SO3<Scalar>::left_jacobian_inverse(phi);
    xi << phi, J_inverse * v, J_inverse * p;
    return xi;
  }

  SE23 inverse() const { return {C.transpose(), -(C.transpose() * v), -(C.transpose() * p)}; }
  SE23 operator*(const SE23& other) const { return {C * other.C, C * other.v + v, C * other.p + p}; }

  // Ad(X) = [C 0 0; hat(v) C, C, 0; hat(p) C, 0, C], with X exp(xi) X^-1 = exp(Ad(X) xi). TAES (3).
  Jacobian Ad() const {
    Jacobian m = Jacobian::Zero();
    for (int i = 0; i < Dim; i += 3) m.template block<3, 3>(i, i) = C;
    m.template block<3, 3>(kNu, kPhi) = hat(v) * C;
    m.template block<3, 3>(kRho, kPhi) = hat(p) * C;
    return m;
  }

  // ad(xi) y = [xi, y]. TAES (4).
  static Jacobian ad(const Tangent& xi) {
    Jacobian m = Jacobian::Zero();
    for (int i = 0; i < Dim; i += 3) m.template block<3, 3>(i, i) = hat(xi.template segment<3>(kPhi));
    m.template block<3, 3>(kNu, kPhi) = hat(xi.template segment<3>(kNu));
    m.template block<3, 3>(kRho, kPhi) = hat(xi.template segment<3>(kRho));
    return m;
  }

  // J_l = [J 0 0; Q(phi, nu) J 0; Q(phi, rho) 0 J], J = Gamma_1(phi), by its blocks.          (Eq. 7)
  struct JacobianBlocks {
    Matrix3<Scalar> J, Q_nu, Q_rho;
  };
  static JacobianBlocks left_jacobian_blocks(const Tangent& xi) {
    const Vector3<Scalar> phi = xi.template segment<3>(kPhi);
    const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(phi.squaredNorm());
    const Matrix3<Scalar> J = gamma<1>(phi, a);
    return {J, coupling(phi, xi.template segment<3>(kNu), a, J), coupling(phi, xi.template segment<3>(kRho), a, J)};
  }

  static Jacobian left_jacobian(const Tangent& xi) {
    const JacobianBlocks b = left_jacobian_blocks(xi);
    return lower_triangle(b.J, b.Q_nu, b.Q_rho);
  }

  static Jacobian left_jacobian_inverse(const Tangent& xi) {
    const Vector3<Scalar> phi = xi.template segment<3>(kPhi);
    const ExpCoefficients<Scalar> a = exp_coefficients<Scalar>(phi.squaredNorm());
    const Matrix3<Scalar> J = gamma<1>(phi, a), J_inverse = SO3<Scalar>::left_jacobian_inverse(phi);
    return lower_triangle(J_inverse, -J_inverse * coupling(phi, xi.template segment<3>(kNu), a, J) * J_inverse,
                          -J_inverse * coupling(phi, xi.template segment<3>(kRho), a, J) * J_inverse);
  }

  static Jacobian right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }  // J_r(x) = J_l(-x), TAES (5)
  static Jacobian right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

 private:
  // Q(phi, x), from d(Gamma_1 x) = Q d phi - hat(Gamma_1 x) Gamma_1 d phi, what J_l does to the translation of exp.
  static Matrix3<Scalar> coupling(const Vector3<Scalar>& phi, const Vector3<Scalar>& x,
                                  const ExpCoefficients<Scalar>& a, const Matrix3<Scalar>& J) {
    return gamma_times_vector_derivative<1>(phi, x, a) + hat(Vector3<Scalar>(J * x)) * J;
  }

  static Jacobian lower_triangle(const Matrix3<Scalar>& J, const Matrix3<Scalar>& Q_nu, const Matrix3<Scalar>& Q_rho) {
    Jacobian m = Jacobian::Zero();
    for (int i = 0; i < Dim; i += 3) m.template block<3, 3>(i, i) = J;
    m.template block<3, 3>(kNu, kPhi) = Q_nu;
    m.template block<3, 3>(kRho, kPhi) = Q_rho;
    return m;
  }
};

}  // namespace liealign
