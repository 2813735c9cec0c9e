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

InsideInterval::InsideInterval(const IntervalStep& step, const Vector<double, 6>& half_walk, const Adjoint* adjoint,
                               bool covariance_reset)
    : step_(step),
      axes_(step.before.X.first, step.pre.T),
      smoothed_(adjoint != nullptr),
      covariance_reset_(covariance_reset) {
  Cov P = step.before.P;
  P.diagonal().tail<kBias>() += half_walk;
  const Matrix3d W = hat(axes_.omega_ie_b) + axes_.kick;
  enter_rows(P, W);
  P.transposeInPlace();
  enter_rows(P, W);
  if (smoothed_) {
    // lambda and Lambda of x_0: K^-1 leaves rho by -W of nu'.
    Vector<double, 15> lambda = adjoint->lambda;
    Cov Lambda = adjoint->Lambda;
    lambda.segment<3>(kRho) -= W.transpose() * lambda.segment<3>(kNu);
    for (int side = 0; side < 2; ++side) {
      Lambda.middleRows<3>(kRho) -= W.transpose() * Lambda.middleRows<3>(kNu);
      Lambda.transposeInPlace();
    }
    const Cov M = P.lazyProduct(Lambda);
    x_0_ = P * lambda;
    P -= Cov(M.lazyProduct(P));
    M_nn_ << M.topLeftCorner<kNav, kNav>(), Eigen::Matrix<double, 3, kNav>::Zero();
    M_bn_ = M.bottomLeftCorner<kBias, kNav>();
    Lambda_ = Lambda.topLeftCorner<kNav, kNav>();
    lambda_ = lambda.head<kNav>();
  }
  P_nn_ << P.topLeftCorner<kNav, kNav>(), Eigen::Matrix<double, 3, kNav>::Zero();
  P_nb_ << P.topRightCorner<kNav, kBias>(), Eigen::Matrix<double, 3, kBias>::Zero();
  P_bb_ = P.bottomRightCorner<kBias, kBias>();
}

NavBelief InsideInterval::compute(const Preintegrated<double>& pre, NavColumns<double, 6>* P_bn) const {
  using Tall6 = Eigen::Matrix<double, 12, kBias>;
  const double t = pre.T;
  const SE23<double> d{pre.dC, pre.dv, pre.dp};
  // Here the second half of the gradient has not acted yet.
  StartAxes<double> axes = axes_;
  axes.kick.setZero();
  const Tall6& B = pre.B;
  const auto drift_rows = [&](auto& M) { M.template middleRows<3>(kRho) += t * M.template middleRows<3>(kNu); };

  NavBelief out;
  out.P_bb = P_bb_;
  NavSquare<double>& S = out.P_nn;
  S = P_nn_;
  drift(S, t);
  drift_rows(S);
  // A P A^T = S + Y + Y^T.
  Tall6 D_P_nb = P_nb_;
  drift_rows(D_P_nb);
  const Tall6 BP = B.lazyProduct(P_bb_);
  const Tall6 half = D_P_nb + 0.5 * BP;
  NavSquare<double> Y = half.lazyProduct(B.topRows<kNav>().transpose()), N_transposed;
  S += pre.Q;

  Model::Tangent eps = Model::Tangent::Zero();
  if (smoothed_) {
    N_transposed = pre.Q;
    drift(N_transposed, -t);
    NavSquare<double> AM = M_nn_;
    drift_rows(AM);
    AM += B.lazyProduct(M_bn_) + 0.5 * N_transposed.lazyProduct(Lambda_);
    Y -= AM.lazyProduct(N_transposed.topRows<kNav>().transpose());

    Eigen::Matrix<double, 12, 1> moved = N_transposed.lazyProduct(lambda_) + B.lazyProduct(x_0_.tail<kBias>());
    Eigen::Matrix<double, 1, kNav> x = x_0_.head<kNav>().transpose();
    drift(x, t);
    x += moved.head<kNav>().transpose();
    leave_interval(x, d, axes);
    eps << x.transpose(), x_0_.tail<kBias>();
  }
  detail::symmetric_sum(S, Y);
  leave_interval(S, d, axes);
  detail::transpose(S);
  leave_interval(S, d, axes);
  if (P_bn != nullptr) {
    Tall6 S_nb = D_P_nb + BP;
    if (smoothed_) S_nb -= N_transposed.lazyProduct(M_bn_.transpose());
    *P_bn = S_nb.topRows<kNav>().transpose();
    leave_interval(*P_bn, d, axes);
  }

  out.X = step_.before.X;
  out.X.first = advance_interval(step_.before.X.first, d, t, step_.pull);
  if (!smoothed_) return out;
  out.X = Model::retract(out.X, eps);
  if (!covariance_reset_) return out;
  const Model::Reset J(eps);
  J.columns(S);
  detail::transpose(S);
  J.columns(S);
  if (P_bn != nullptr) J.columns(*P_bn);
  return out;
}

NavBelief InsideInterval::nav_at(const Preintegrated<double>& pre) const { return compute(pre, nullptr); }

Belief<Model> InsideInterval::at(const Preintegrated<double>& pre) const {
  NavColumns<double, kBias> P_bn;
  const NavBelief nav = compute(pre, &P_bn);
  Belief<Model> belief{nav.X, {}};
  belief.P << nav.P_nn.topRows<kNav>(), P_bn.transpose(), P_bn, nav.P_bb;
  return belief;
}

}  // namespace liealign
