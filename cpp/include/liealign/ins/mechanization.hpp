// Strapdown mechanization in ECEF and its error-state transition, two of them.
//
// `exact`: constant rate and specific force over the sample, in closed form with Earth rotation, Coriolis and gravity.
// With v' = v_eb_e + omega_ie x p_eb_e (velocity against inertial space) and R = exp(-omega_ie dt):
//   C+  = R C Gamma_0(w dt)                                                                    (Eq. 14)
//   v'+ = R (v' + C Gamma_1(w dt) f dt + gamma dt)
//   p+  = R (p + v' dt + C Gamma_2(w dt) f dt^2 + gamma dt^2/2)
// gamma is the gravitation at the middle of the step. Error left out: gravitation changing along the step,
// |d gamma/dt| dt^3/12 in position (7e-4 m/s^3, mostly by Earth rotation): 6e-11 m per step at 100 Hz.
//
// `paper`: one step of the group, X+ = X exp(Omega(X, u) dt), TAES (13), (20). It leaves out the half-acceleration term
// of position and turns velocity and gravity with the body: kept for reproduction.
//
// Left error X = X_hat exp(eps), eps = (phi, nu, rho, b_a, b_g): eps+ = F eps + B n, n the input noise, which enters as
// the biases do. Source: DESIGN of the project; Brossard et al. (arXiv 2007.14097); Groves (2013) ch. 5.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"
#include "liealign/earth/gravity.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/ins/nav_state.hpp"
#include "liealign/lie/se23.hpp"

namespace liealign {

enum class Mechanization { exact, paper };

// Bias-corrected input of one step: omega_ib_b [rad/s], f_ib_b [m/s^2], constant over dt [s].
template <typename Scalar>
struct ImuInput {
  Vector3<Scalar> omega_ib_b;
  Vector3<Scalar> f_ib_b;
  Scalar dt;
};

// eps_nav+ = F eps_nav + B (b_a; b_g): 9x9 and 9x6, tangent order (phi, nu, rho).
template <typename Scalar>
struct NavTransition {
  SquareMatrix<Scalar, 9> F;
  Eigen::Matrix<Scalar, 9, 6> B;
};

namespace detail {

// What one exact step needs, computed once for the state and for the transition.
template <typename Scalar>
struct ExactStep {
  Matrix3<Scalar> R;           // exp(-omega_ie dt)
  Matrix3<Scalar> G0, G1, G2;  // Gamma_m(w dt)
  Vector3<Scalar> phi;         // w dt
  ExpCoefficients<Scalar> a;
  Vector3<Scalar> gamma_dt;  // gravitation times dt, ECEF at the start
};

template <typename Scalar>
ExactStep<Scalar> exact_step(const SE23<Scalar>& X, const ImuInput<Scalar>& u, GravityModel model) {
  ExactStep<Scalar> s;
  const Scalar dt(u.dt);
  s.phi = u.omega_ib_b * dt;
  s.a = exp_coefficients<Scalar>(s.phi.squaredNorm());
  s.G0 = gamma<0>(s.phi, s.a);
  s.G1 = gamma<1>(s.phi, s.a);
  s.G2 = gamma<2>(s.phi, s.a);
  s.R = gamma<0>(Vector3<Scalar>(-wgs84::omega_ie_e<Scalar>() * dt));
  // Gravitation at the middle, ECEF axes there; turned by half the Earth rotation into the axes of the start.
  const Vector3<Scalar> middle = X.p + Scalar(0.5) * dt * X.v;
  const Vector3<Scalar> gamma_middle = gravitation_e(middle, model);
  s.gamma_dt = dt * (gamma_middle + Scalar(0.5) * dt * wgs84::omega_ie_e<Scalar>().cross(gamma_middle));
  return s;
}

}  // namespace detail

// (Eq. 14).
template <typename Scalar>
SE23<Scalar> mechanize_exact(const SE23<Scalar>& X, const ImuInput<Scalar>& u, const detail::ExactStep<Scalar>& s) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  const Scalar dt(u.dt);
  const Vector3<Scalar> v_i = X.v + omega_ie.cross(X.p);  // v'
  SE23<Scalar> next;
  next.C = s.R * X.C * s.G0;
  next.p = s.R * (X.p + dt * (v_i + dt * (X.C * (s.G2 * u.f_ib_b)) + Scalar(0.5) * s.gamma_dt));
  next.v = s.R * (v_i + dt * (X.C * (s.G1 * u.f_ib_b)) + s.gamma_dt) - omega_ie.cross(next.p);
  return next;
}

// Transition of the exact step. In (phi, nu', rho), nu' the error of v', it does not depend on attitude, velocity or
// position but for the gravitation gradient:
//   phi+ = G0^T phi - dt J_r(w dt) b_g                                                          (Eq. 15)
//   nu'+ = G0^T (nu' - hat(G1 f dt) phi + C^T grad C rho dt - D1 dt^2 b_g - G1 dt b_a)
//   rho+ = G0^T (rho + nu' dt - hat(G2 f dt^2) phi + C^T grad C rho dt^2/2 - D2 dt^3 b_g - G2 dt^2 b_a)
// D_m = d(Gamma_m f)/d(w dt); then nu = nu' - hat(C^T omega_ie) rho at both ends.
template <typename Scalar>
NavTransition<Scalar> transition_exact(const SE23<Scalar>& X, const SE23<Scalar>& next, const ImuInput<Scalar>& u,
                                       const detail::ExactStep<Scalar>& s) {
  constexpr int kOfBa = 0, kOfBg = 3;  // columns of B
  const Scalar dt(u.dt);
  const Matrix3<Scalar> G0t = s.G0.transpose();
  const Matrix3<Scalar> W = hat(X.C.transpose() * wgs84::omega_ie_e<Scalar>());
  const Matrix3<Scalar> W_next = hat(next.C.transpose() * wgs84::omega_ie_e<Scalar>());
  const Matrix3<Scalar> gradient_dt = dt * (X.C.transpose() * gravitation_gradient_e(X.p) * X.C);
  const Matrix3<Scalar> v_by_rho = W + gradient_dt;  // of nu' at the end by rho at the start
  const Matrix3<Scalar> p_by_rho = Matrix3<Scalar>::Identity() + dt * (W + Scalar(0.5) * gradient_dt);

  NavTransition<Scalar> t;
  t.F.setZero();
  t.F.template block<3, 3>(kPhi, kPhi) = G0t;
  t.F.template block<3, 3>(kRho, kPhi) = -G0t * hat(Vector3<Scalar>(dt * dt * (s.G2 * u.f_ib_b)));
  t.F.template block<3, 3>(kRho, kNu) = dt * G0t;
  t.F.template block<3, 3>(kRho, kRho) = G0t * p_by_rho;
  t.F.template block<3, 3>(kNu, kPhi) = -G0t * hat(Vector3<Scalar>(dt * (s.G1 * u.f_ib_b)));
  t.F.template block<3, 3>(kNu, kNu) = G0t;
  t.F.template block<3, 3>(kNu, kRho) = G0t * v_by_rho;

  t.B.template block<3, 3>(kPhi, kOfBa).setZero();
  t.B.template block<3, 3>(kPhi, kOfBg) = -dt * s.G1.transpose();  // J_r(w dt) = Gamma_1(w dt)^T
  t.B.template block<3, 3>(kNu, kOfBa) = -dt * G0t * s.G1;
  t.B.template block<3, 3>(kNu, kOfBg) = -dt * dt * G0t * gamma_times_vector_derivative<1>(s.phi, u.f_ib_b, s.a);
  t.B.template block<3, 3>(kRho, kOfBa) = -dt * dt * G0t * s.G2;
  t.B.template block<3, 3>(kRho, kOfBg) = -dt * dt * dt * G0t * gamma_times_vector_derivative<2>(s.phi, u.f_ib_b, s.a);

  t.F.template middleRows<3>(kNu) -= W_next * t.F.template middleRows<3>(kRho);
  t.B.template middleRows<3>(kNu) -= W_next * t.B.template middleRows<3>(kRho);
  return t;
}

// Omega(X, u) of TAES (20), navigation part, per second. omega_ie_e = [0 0 omega_e] (the paper prints its NED form).
//   Omega = (w - C^T omega_ie,  f - 2 C^T (omega_ie x v) + C^T g,  C^T v)                       (Eq. 16)
template <typename Scalar>
Vector<Scalar, 9> paper_velocity(const SE23<Scalar>& X, const ImuInput<Scalar>& u, GravityModel model) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  Vector<Scalar, 9> Omega;
  Omega << u.omega_ib_b - X.C.transpose() * omega_ie,
      u.f_ib_b + X.C.transpose() * (gravity_e(X.p, model) - Scalar(2) * omega_ie.cross(X.v)), X.C.transpose() * X.v;
  return Omega;
}

// TAES (14a).
template <typename Scalar>
SE23<Scalar> mechanize_paper(const SE23<Scalar>& X, const ImuInput<Scalar>& u, GravityModel model) {
  return X * SE23<Scalar>::exp(paper_velocity(X, u, model) * Scalar(u.dt));
}

// TAES (14f)-(14g): F = Ad(exp(-Omega dt)) + J_r(Omega dt) dt C, B = J_r dt dOmega/d(b_a, b_g).  (Eq. 17)
template <typename Scalar>
NavTransition<Scalar> transition_paper(const SE23<Scalar>& X, const ImuInput<Scalar>& u, GravityModel model) {
  constexpr int kOfBa = 0, kOfBg = 3;  // columns of B
  const Scalar dt(u.dt);
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  const Vector<Scalar, 9> step = paper_velocity(X, u, model) * dt;
  const Matrix3<Scalar> W = hat(X.C.transpose() * omega_ie);
  const Vector3<Scalar> pull = X.C.transpose() * (gravity_e(X.p, model) - Scalar(2) * omega_ie.cross(X.v));
  // Gravity gradient: attraction and centrifugal part.
  Matrix3<Scalar> gradient = gravitation_gradient_e(X.p);
  gradient -= hat(omega_ie) * hat(omega_ie);

  SquareMatrix<Scalar, 9> C_k = SquareMatrix<Scalar, 9>::Zero();  // dOmega/d eps
  C_k.template block<3, 3>(kPhi, kPhi) = -W;
  C_k.template block<3, 3>(kNu, kPhi) = hat(pull);
  C_k.template block<3, 3>(kNu, kNu) = Scalar(-2) * W;
  C_k.template block<3, 3>(kNu, kRho) = X.C.transpose() * gradient * X.C;
  C_k.template block<3, 3>(kRho, kPhi) = hat(X.C.transpose() * X.v);
  C_k.template block<3, 3>(kRho, kNu) = Matrix3<Scalar>::Identity();

  const SquareMatrix<Scalar, 9> J_r_dt = dt * SE23<Scalar>::right_jacobian(step);
  NavTransition<Scalar> t;
  t.F = SE23<Scalar>::exp(-step).Ad() + J_r_dt * C_k;
  t.B.template middleCols<3>(kOfBa) = -J_r_dt.template middleCols<3>(kNu);
  t.B.template middleCols<3>(kOfBg) = -J_r_dt.template middleCols<3>(kPhi);
  return t;
}

template <typename Scalar>
SE23<Scalar> mechanize_exact(const SE23<Scalar>& X, const ImuInput<Scalar>& u, GravityModel model) {
  return mechanize_exact(X, u, detail::exact_step(X, u, model));
}

// The state alone.
template <typename Scalar>
SE23<Scalar> mechanize(const SE23<Scalar>& X, const ImuInput<Scalar>& u, Mechanization kind, GravityModel model) {
  return kind == Mechanization::exact ? mechanize_exact(X, u, model) : mechanize_paper(X, u, model);
}

// X becomes the next state; its transition is returned.
template <typename Scalar>
NavTransition<Scalar> advance(SE23<Scalar>& X, const ImuInput<Scalar>& u, Mechanization kind, GravityModel model) {
  if (kind == Mechanization::paper) {
    const NavTransition<Scalar> t = transition_paper(X, u, model);
    X = mechanize_paper(X, u, model);
    return t;
  }
  const detail::ExactStep<Scalar> s = detail::exact_step(X, u, model);
  const SE23<Scalar> next = mechanize_exact(X, u, s);
  const NavTransition<Scalar> t = transition_exact(X, next, u, s);
  X = next;
  return t;
}

// Inverse strapdown: the input that takes X to `next` in attitude and velocity over dt.
// exact: inverse of (Eq. 14) in C and v'; paper: TAES (32)-(33) with C_e_b omega_ie added to the rate (missing in print).
// The position row is dropped: mechanizing the result gives the position that belongs to it.
template <typename Scalar>
ImuInput<Scalar> inverse_mechanize(const SE23<Scalar>& X, const SE23<Scalar>& next, double dt, Mechanization kind,
                                   GravityModel model) {
  const Vector3<Scalar> omega_ie = wgs84::omega_ie_e<Scalar>();
  ImuInput<Scalar> u{Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero(), dt};
  if (kind == Mechanization::paper) {
    const Vector<Scalar, 9> Omega = (X.inverse() * next).log() / Scalar(dt);
    u.omega_ib_b = Omega.template segment<3>(SE23<Scalar>::kPhi) + X.C.transpose() * omega_ie;
    u.f_ib_b = Omega.template segment<3>(SE23<Scalar>::kNu) +
               X.C.transpose() * (Scalar(2) * omega_ie.cross(X.v) - gravity_e(X.p, model));
    return u;
  }
  const Matrix3<Scalar> R_back = gamma<0>(Vector3<Scalar>(omega_ie * Scalar(dt)));
  const Vector3<Scalar> phi = SO3<Scalar>{X.C.transpose() * R_back * next.C}.log();
  u.omega_ib_b = phi / Scalar(dt);
  const detail::ExactStep<Scalar> s = detail::exact_step(X, u, model);
  const Vector3<Scalar> dv =
      X.C.transpose() * (R_back * (next.v + omega_ie.cross(next.p)) - X.v - omega_ie.cross(X.p) - s.gamma_dt);
  u.f_ib_b = SO3<Scalar>::left_jacobian_inverse(phi) * dv / Scalar(dt);
  return u;
}

}  // namespace liealign
