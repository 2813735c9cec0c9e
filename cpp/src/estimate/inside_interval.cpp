// Inside an interval, (Eq. 54) and (Eq. 55).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/inside_interval.hpp"

#include "liealign/core/error.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;
using Cov = Model::Covariance;
constexpr int kNav = 9, kBias = 6;

// K of (Eq. 53) on all fifteen components, from the left: x_0 = K eps.
template <int cols>
void enter_rows(Eigen::Matrix<double, 15, cols>& M, const Matrix3d& W) {
  M.template middleRows<3>(kNu) += W * M.template middleRows<3>(kRho);
}

}  // namespace

Adjoint adjoint_before(const IntervalStep& step, const Belief<Model>& smoothed, bool covariance_reset) {
  const Model::Tangent z_s = Model::local(step.predicted.X, smoothed.X);
  Cov P_s = smoothed.P;
  if (covariance_reset) {
    const Cov J_0 = Model::right_jacobian_inverse(z_s);
    P_s = J_0.lazyProduct(Cov(P_s.lazyProduct(J_0.transpose())));
  }
  const Eigen::LLT<Cov> llt(step.predicted.P);
  if (llt.info() != Eigen::Success) throw NumericalError("smoother: a predicted covariance is not positive definite");
  const Cov half = llt.solve(step.predicted.P - P_s);
  Adjoint at_end{llt.solve(z_s), llt.solve(half.transpose())};
  if (step.pre.T == 0.0) return at_end;

  const SE23<double> d{step.pre.dC, step.pre.dv, step.pre.dp};
  const NavTransition<double> t = interval_transition(StartAxes<double>(step.before.X.first, step.pre.T), d, step.pre);
  Cov F = Cov::Identity();
  F.topLeftCorner<kNav, kNav>() = t.F;
  F.topRightCorner<kNav, kBias>() = t.B;
  const Cov LF = at_end.Lambda.lazyProduct(F);
  return {F.transpose() * at_end.lambda, F.transpose().lazyProduct(LF)};
}

Belief<Model> smoothed_before(const IntervalStep& step, const Adjoint& adjoint, bool covariance_reset) {
  const Cov& P = step.before.P;
  const Model::Tangent eps = P * adjoint.lambda;
  const Cov PL = P.lazyProduct(adjoint.Lambda);
  Belief<Model> smoothed{Model::retract(step.before.X, eps), P - PL.lazyProduct(P)};
  if (covariance_reset) {
    const Cov J_1 = Model::right_jacobian(eps);
    smoothed.P = J_1.lazyProduct(Cov(smoothed.P.lazyProduct(J_1.transpose()))).eval();
  }
  Ekf<Model>::symmetrise(smoothed.P);
  return smoothed;
}

namespace {

// P and what the future says, in the coordinates of x_0.
struct AtStart {
  Cov P, M = Cov::Zero(), Lambda = Cov::Zero();
  Vector<double, 15> lambda = Vector<double, 15>::Zero(), x_0 = lambda;

  AtStart(const IntervalStep& step, const StartAxes<double>& axes, const Vector<double, 6>& half_walk,
          const Adjoint* adjoint)
      : P(step.before.P) {
    P.diagonal().tail<kBias>() += half_walk;
    const Matrix3d W = hat(axes.omega_ie_b) + axes.kick;
    enter_rows(P, W);
    P.transposeInPlace();
    enter_rows(P, W);
    if (adjoint == nullptr) return;
    // lambda and Lambda of x_0: K^-1 leaves rho by -W of nu'.
    lambda = adjoint->lambda;
    Lambda = adjoint->Lambda;
    lambda.segment<3>(kRho) -= W.transpose() * lambda.segment<3>(kNu);
    for (int side = 0; side < 2; ++side) {
      Lambda.middleRows<3>(kRho) -= W.transpose() * Lambda.middleRows<3>(kNu);
      Lambda.transposeInPlace();
    }
    M = P.lazyProduct(Lambda);
    x_0 = P * lambda;
    P -= Cov(M.lazyProduct(P));
  }
};

template <typename Scalar, int cols>
NavRows<Scalar, cols> rows_of(const Eigen::Matrix<double, kNav, cols>& M) {
  return {M.template topRows<3>().template cast<Scalar>(), M.template middleRows<3>(kNu).template cast<Scalar>(),
          M.template bottomRows<3>().template cast<Scalar>()};
}

template <typename Scalar>
NavState<Scalar> cast(const NavState<double>& X) {
  const SE23<double>& nav = X.first;
  return {{nav.C.cast<Scalar>(), nav.v.cast<Scalar>(), nav.p.cast<Scalar>()}, {X.second.x.cast<Scalar>()}};
}

template <typename Scalar>
IntervalPull<Scalar> cast(const IntervalPull<double>& pull) {
  IntervalPull<Scalar> to;
  to.start = pull.start.cast<Scalar>();
  to.slope = pull.slope.cast<Scalar>();
  to.bend = pull.bend.cast<Scalar>();
  return to;
}

}  // namespace

template <typename Scalar>
InsideInterval<Scalar>::InsideInterval(const IntervalStep& step, const Vector<double, 6>& half_walk,
                                       const Adjoint* adjoint, bool covariance_reset)
    : smoothed_(adjoint != nullptr),
      covariance_reset_(covariance_reset),
      X_0_(cast<Scalar>(step.before.X)),
      pull_(cast<Scalar>(step.pull)),
      axes_(X_0_.first, Scalar(0)) {
  const StartAxes<double> axes(step.before.X.first, step.pre.T);
  const AtStart start(step, axes, half_walk, adjoint);
  P_ = nav_covariance<Scalar>(start.P.template cast<Scalar>());
  P_bb_ = start.P.bottomRightCorner<kBias, kBias>();
  P_bb_lanes_ = start.P.bottomRightCorner<kBias, kBias>().template cast<Scalar>();
  M_nn_transposed_ = rows_of<Scalar, kNav>(start.M.topLeftCorner<kNav, kNav>().transpose());
  M_bn_ = start.M.bottomLeftCorner<kBias, kNav>().template cast<Scalar>();
  Lambda_ = rows_of<Scalar, kNav>(start.Lambda.topLeftCorner<kNav, kNav>());
  lambda_ = rows_of<Scalar, 1>(start.lambda.head<kNav>());
  x_0_ = rows_of<Scalar, 1>(start.x_0.head<kNav>());
  x_b_ = start.x_0.tail<kBias>().template cast<Scalar>();
}

// What both kinds of output begin with.
template <typename Scalar>
struct InsideInterval<Scalar>::Inside {
  NavCovariance<Scalar, kBias> P;  // of (phi, z - W y, y)
  NavState<Scalar> X;
  typename SE23<Scalar>::JacobianBlocks J;  // from there to the left error of X
};

template <typename Scalar>
typename InsideInterval<Scalar>::Inside InsideInterval<Scalar>::inside(const Preintegrated<Scalar>& pre) const {
  const SE23<Scalar> d{pre.dC, pre.dv, pre.dp};
  const IntervalNoise<Scalar> Q(pre);
  Inside out{P_, X_0_, {pre.dC.transpose(), Matrix3<Scalar>::Zero(), Matrix3<Scalar>::Zero()}};
  NavCovariance<Scalar, kBias>& P = out.P;
  add_biases(P, pre, P_bb_lanes_);
  add_noise(P, Q);
  out.X.first = advance_interval(X_0_.first, d, pre.T, pull_);
  if (!smoothed_) {
    leave_interval(P, d, pre.T, axes_);
    return out;
  }
  // A M Q + (A M Q)^T + Q Lambda Q = Y + Y^T, Y^T = Q H^T, H^T = M_nn^T + (B M_bn)^T + Lambda Q / 2.
  const NavRows<Scalar, kNav> B_M = bias_times<Scalar, kNav>(pre, M_bn_), Q_Lambda = Q.times(Lambda_);
  NavRows<Scalar, kNav> H = M_nn_transposed_;
  const auto add_transposed = [&](int row, const Eigen::Matrix<Scalar, 3, kNav>& from_B,
                                  const Eigen::Matrix<Scalar, 3, kNav>& from_Q) {
    const Eigen::Matrix<Scalar, 3, kNav> sum = from_B + Scalar(0.5) * from_Q;
    H.phi.template middleCols<3>(row) += sum.template middleCols<3>(kPhi).transpose();
    H.nu.template middleCols<3>(row) += sum.template middleCols<3>(kNu).transpose();
    H.rho.template middleCols<3>(row) += sum.template middleCols<3>(kRho).transpose();
  };
  add_transposed(kPhi, B_M.phi, Q_Lambda.phi);
  add_transposed(kNu, B_M.nu, Q_Lambda.nu);
  add_transposed(kRho, B_M.rho, Q_Lambda.rho);
  const NavRows<Scalar, kNav> Y = Q.times(H);
  const auto column = [&](int col) -> NavRows<Scalar, 3> {
    return {-Y.phi.template middleCols<3>(col), -Y.nu.template middleCols<3>(col), -Y.rho.template middleCols<3>(col)};
  };
  add_symmetric(P, column(kPhi), column(kNu), column(kRho));
  // M_bn Q.
  const NavRows<Scalar, kBias> M_bt{M_bn_.template middleCols<3>(kPhi).transpose(),
                                    M_bn_.template middleCols<3>(kNu).transpose(),
                                    M_bn_.template middleCols<3>(kRho).transpose()},
      Q_M = Q.times(M_bt);
  P.b_phi -= Q_M.phi.transpose();
  P.b_nu -= Q_M.nu.transpose();
  P.b_rho -= Q_M.rho.transpose();
  leave_interval(P, d, pre.T, axes_);

  const NavRows<Scalar, 1> B_x = bias_times<Scalar, 1>(pre, x_b_), Q_x = Q.times(lambda_);
  const Vector3<Scalar> phi = x_0_.phi + B_x.phi + Q_x.phi, nu = x_0_.nu + B_x.nu + Q_x.nu,
                        y = x_0_.rho + B_x.rho + Q_x.rho + pre.T * nu - d.p.cross(phi),
                        z = nu - d.v.cross(phi) - axes_.omega_ie_b.cross(y);
  typename LieModel<Scalar>::Tangent eps;
  eps << pre.dC.transpose() * phi, pre.dC.transpose() * z, pre.dC.transpose() * y, x_b_;
  out.X = LieModel<Scalar>::retract(out.X, eps);
  if (!covariance_reset_) return out;
  const typename SE23<Scalar>::JacobianBlocks J =
      SE23<Scalar>::left_jacobian_blocks(-eps.template head<SE23<Scalar>::Dim>());
  out.J = {J.J * pre.dC.transpose(), J.Q_nu * pre.dC.transpose(), J.Q_rho * pre.dC.transpose()};
  return out;
}

template <typename Scalar>
NavBelief<Scalar> InsideInterval<Scalar>::nav_at(const Preintegrated<Scalar>& pre) const {
  const Inside in = inside(pre);
  const NavCovariance<Scalar, kBias>& P = in.P;
  const Matrix3<Scalar>&J = in.J.J, Jt = J.transpose();
  const Matrix3<Scalar> J_phi = J * P.phi_phi;
  NavBelief<Scalar> out{in.X, J_phi * Jt, J * Matrix3<Scalar>(P.nu_nu * Jt), J * Matrix3<Scalar>(P.rho_rho * Jt)};
  if (!smoothed_ || !covariance_reset_) return out;
  // J nu + Q phi: J P_nu J^T + Z + Z^T, Z = (J P_nu_phi + Q P_phi / 2) Q^T
  const auto add = [&](Matrix3<Scalar>& sum, const Matrix3<Scalar>& cross, const Matrix3<Scalar>& Q) {
    const Matrix3<Scalar> half = J * cross + Scalar(0.5) * (Q * P.phi_phi), Z = half * Q.transpose();
    sum += Z + Z.transpose();
  };
  add(out.P_nu, P.nu_phi, in.J.Q_nu);
  add(out.P_rho, P.rho_phi, in.J.Q_rho);
  return out;
}

template <typename Scalar>
Belief<LieModel<Scalar>> InsideInterval<Scalar>::at(const Preintegrated<Scalar>& pre) const {
  Inside in = inside(pre);
  apply_jacobian(in.P, in.J);
  Belief<LieModel<Scalar>> belief{in.X, {}};
  belief.P.template bottomRightCorner<kBias, kBias>() = P_bb_lanes_;
  set_nav_covariance(belief.P, in.P);
  mirror(belief.P);
  return belief;
}

template class InsideInterval<double>;
template class InsideInterval<Lanes>;

}  // namespace liealign
