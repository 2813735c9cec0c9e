// The left error over a preintegrated interval, block by block, without a dense transition.
//
// In axes that stay those of the start, with nu' as in (Eq. 50), rho without its drift by nu', and time t into the interval:
//   x_0 = (phi, nu + (W + k) rho, rho),  W = hat(C^T omega_ie), k = T/2 C^T (grad gamma) C
//   x_t = x_0 + B_t b + w,               B_t of (Eq. 51);  w ~ Q_t
//   rho = dC^T y, nu = dC^T (z - (W - k) y), phi = dC^T phi_t,  y = rho_t + t nu_t - hat(dp) phi_t, z = nu_t - hat(dv) phi_t   (Eq. 53)
// The gradient of gravitation acts half at the start, half at the end of the interval (at its end alone k counts in the
// last line): within it nothing but drift is left.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/ins/nav_covariance.hpp"
#include "liealign/ins/preintegration.hpp"

namespace liealign {

// What (Eq. 53) needs of the state at the start.
template <typename Scalar>
struct StartAxes {
  Vector3<Scalar> omega_ie_b;  // C^T omega_ie, rad/s
  Matrix3<Scalar> kick;        // k, 1/s

  StartAxes(const SE23<Scalar>& X, const Scalar& T)
      : omega_ie_b(X.C.transpose() * wgs84::omega_ie_e<Scalar>()),
        kick((Scalar(0.5) * T) * (X.C.transpose() * gravitation_gradient_e(X.p) * X.C)) {}
};

// x_0 from the left error.
template <typename Scalar, int n>
void enter_interval(NavCovariance<Scalar, n>& P, const StartAxes<Scalar>& a) {
  P.add_to_nu(hat(a.omega_ie_b) + a.kick);
}

// (phi, z - (W - k) y, y) from x_t.
template <typename Scalar, int n>
void leave_interval(NavCovariance<Scalar, n>& P, const SE23<Scalar>& d, const Scalar& t, const StartAxes<Scalar>& a) {
  using detail::cross_columns;
  using detail::cross_rows;
  // M hat(x)^T = -M hat(x).
  P.b_rho += t * P.b_nu + cross_columns(P.b_phi, d.p);
  P.b_nu += cross_columns(P.b_phi, d.v);
  const Matrix3<Scalar> phi_nu = P.nu_phi.transpose(), phi_rho = P.rho_phi.transpose(), nu_rho = P.rho_nu.transpose();
  const Matrix3<Scalar> y_nu = P.rho_nu + t * P.nu_nu - cross_rows(d.p, phi_nu);
  const Matrix3<Scalar> y_rho = P.rho_rho + t * nu_rho - cross_rows(d.p, phi_rho);
  P.rho_phi += t * P.nu_phi - cross_rows(d.p, P.phi_phi);
  P.nu_phi -= cross_rows(d.v, P.phi_phi);
  P.rho_nu = y_nu + cross_columns(P.rho_phi, d.v);
  P.rho_rho = y_rho + t * y_nu + cross_columns(P.rho_phi, d.p);
  P.nu_nu += cross_columns(P.nu_phi, d.v) - cross_rows(d.v, phi_nu);
  P.add_to_nu(a.kick - hat(a.omega_ie_b));
}

// B M of (Eq. 51).
template <typename Scalar, int cols>
NavRows<Scalar, cols> bias_times(const Preintegrated<Scalar>& pre, const Eigen::Matrix<Scalar, 6, cols>& M) {
  const Eigen::Matrix<Scalar, 3, cols> M_a = M.template topRows<3>(), M_g = M.template bottomRows<3>();
  return {-pre.C_1.lazyProduct(M_g), -pre.C_1.lazyProduct(M_a) - pre.C_v.lazyProduct(M_g),
          pre.C_s.lazyProduct(M_a) - pre.C_q.lazyProduct(M_g)};
}

// Q_t, of which rho_nu is the covariance of rho (rows) and nu.
template <typename Scalar>
struct IntervalNoise {
  Scalar phi;                       // times the identity
  Vector3<Scalar> nu_phi, rho_phi;  // by hat()
  Matrix3<Scalar> nu, rho_nu, rho;

  explicit IntervalNoise(const Preintegrated<Scalar>& pre)
      : phi(pre.g), nu_phi(pre.g_v), rho_phi(pre.g_q), nu(-pre.g_vv), rho_nu(-pre.g_vq), rho(-pre.g_qq) {
    nu.diagonal().array() += pre.g_vv.trace() + pre.f;
    rho_nu.diagonal().array() += pre.g_vq.trace() - pre.f_s;
    rho.diagonal().array() += pre.g_qq.trace() + pre.f_ss;
  }

  // Q M.
  template <int cols>
  NavRows<Scalar, cols> times(const NavRows<Scalar, cols>& M) const {
    using detail::cross_rows;
    return {phi * M.phi - cross_rows(nu_phi, M.nu) - cross_rows(rho_phi, M.rho),
            cross_rows(nu_phi, M.phi) + nu.lazyProduct(M.nu) + rho_nu.transpose().lazyProduct(M.rho),
            cross_rows(rho_phi, M.phi) + rho_nu.lazyProduct(M.nu) + rho.lazyProduct(M.rho)};
  }
};

// P <- P + Q_t.
template <typename Scalar, int n>
void add_noise(NavCovariance<Scalar, n>& P, const IntervalNoise<Scalar>& Q) {
  P.phi_phi.diagonal().array() += Q.phi;
  P.nu_phi += hat(Q.nu_phi);
  P.rho_phi += hat(Q.rho_phi);
  P.nu_nu += Q.nu;
  P.rho_nu += Q.rho_nu;
  P.rho_rho += Q.rho;
}

// P <- [I B; 0 I] P [I B; 0 I]^T, P_bx that of the six biases with the n others of P, themselves first.
template <typename Scalar, int n>
void add_biases(NavCovariance<Scalar, n>& P, const Preintegrated<Scalar>& pre,
                const Eigen::Matrix<Scalar, 6, n>& P_bx) {
  using Columns = Eigen::Matrix<Scalar, 6, 3>;
  const NavRows<Scalar, n> B_bx = bias_times<Scalar, n>(pre, P_bx);
  const Scalar half(0.5);
  // B P_bn + P_nb B^T + B P_bb B^T = Y + Y^T
  const auto columns = [&](const Eigen::Matrix<Scalar, n, 3>& P_bn, const Eigen::Matrix<Scalar, 3, n>& B_b) -> Columns {
    return P_bn.template topRows<6>() + half * B_b.template leftCols<6>().transpose();
  };
  add_symmetric(P, bias_times<Scalar, 3>(pre, columns(P.b_phi, B_bx.phi)),
                bias_times<Scalar, 3>(pre, columns(P.b_nu, B_bx.nu)),
                bias_times<Scalar, 3>(pre, columns(P.b_rho, B_bx.rho)));
  P.b_phi += B_bx.phi.transpose();
  P.b_nu += B_bx.nu.transpose();
  P.b_rho += B_bx.rho.transpose();
}

// P (of the left error, biases and tail) over the whole interval, the tail as it is; half_walk is what the biases gain in one
// half of it: they walk on half before and half after, which leaves the mean of their products with the rest right.
template <typename Scalar, int dim>
void propagate_interval(SquareMatrix<Scalar, dim>& P, const StartAxes<Scalar>& axes, const SE23<Scalar>& d,
                        const Preintegrated<Scalar>& pre, const Vector<Scalar, 6>& half_walk) {
  constexpr int kBiases = 9, n = dim - kBiases;
  P.diagonal().template segment<6>(kBiases) += half_walk;
  NavCovariance<Scalar, n> nav = nav_covariance<Scalar, dim>(P);
  enter_interval(nav, axes);
  add_biases<Scalar, n>(nav, pre, P.template block<6, n>(kBiases, kBiases));
  add_noise(nav, IntervalNoise<Scalar>(pre));
  leave_interval(nav, d, pre.T, axes);
  turn(nav, d.C);
  set_nav_covariance<Scalar, dim>(P, nav);
  mirror(P);
  P.diagonal().template segment<6>(kBiases) += half_walk;
}

// ---- As matrices ----------------------------------------------------------------------------------------------------

// B_t of (Eq. 53).
template <typename Scalar>
Eigen::Matrix<Scalar, 9, 6> bias_columns(const Preintegrated<Scalar>& pre) {
  const NavRows<Scalar, 6> B = bias_times<Scalar, 6>(pre, SquareMatrix<Scalar, 6>::Identity());
  Eigen::Matrix<Scalar, 9, 6> out;
  out << B.phi, B.nu, B.rho;
  return out;
}

// x_t to the left error at time t, the last line of (Eq. 53).
template <typename Scalar>
SquareMatrix<Scalar, 9> leave_matrix(const SE23<Scalar>& d, const Scalar& t, const StartAxes<Scalar>& a) {
  SquareMatrix<Scalar, 9> L = SquareMatrix<Scalar, 9>::Identity();
  L.template block<3, 3>(kRho, kPhi) = -hat(d.p);
  L.template block<3, 3>(kRho, kNu).diagonal().setConstant(t);
  L.template block<3, 3>(kNu, kPhi) = -hat(d.v);
  const Matrix3<Scalar> W_k = hat(a.omega_ie_b) - a.kick;
  L.template middleRows<3>(kNu) -= W_k.lazyProduct(L.template middleRows<3>(kRho));
  for (const int block : {kPhi, kNu, kRho})
    L.template middleRows<3>(block) = d.C.transpose().lazyProduct(L.template middleRows<3>(block)).eval();
  return L;
}

// The transition (F, B) of the left error over the whole interval.
template <typename Scalar>
NavTransition<Scalar> interval_transition(const StartAxes<Scalar>& axes, const SE23<Scalar>& d,
                                          const Preintegrated<Scalar>& pre) {
  NavTransition<Scalar> t;
  t.F = leave_matrix(d, pre.T, axes);
  t.B = t.F.lazyProduct(bias_columns(pre));
  t.F.template middleCols<3>(kRho) += t.F.template middleCols<3>(kNu).lazyProduct(hat(axes.omega_ie_b) + axes.kick);
  return t;
}

}  // namespace liealign
