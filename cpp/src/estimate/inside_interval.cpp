// Inside an interval, (Eq. 55).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/inside_interval.hpp"

namespace liealign {
namespace {

constexpr int kNav = 9, kBias = 6, kCore = kNav + kBias;

// K of (Eq. 53) on all components, from the left: x_0 = K eps.
template <int rows, int cols>
void enter_rows(Eigen::Matrix<double, rows, cols>& M, const Matrix3d& W) {
  M.template middleRows<3>(kNu) += W * M.template middleRows<3>(kRho);
}

// P and what the future says, in the coordinates of x_0.
template <int tail>
struct Entered {
  static constexpr int kDim = kCore + tail;
  using Cov = SquareMatrix<double, kDim>;
  Cov P, M = Cov::Zero(), Lambda = Cov::Zero();
  Vector<double, kDim> lambda = Vector<double, kDim>::Zero(), x_0 = lambda;

  Entered(const AtStart<tail>& start, const StartAxes<double>& axes, const Vector<double, 6>& half_walk)
      : P(start.step.before.P) {
    P.diagonal().template segment<kBias>(kNav) += half_walk;
    const Matrix3d W = hat(axes.omega_ie_b) + axes.kick;
    enter_rows(P, W);
    P.transposeInPlace();
    enter_rows(P, W);
    if (start.adjoint == nullptr) return;
    // lambda and Lambda of x_0: K^-1 leaves rho by -W of nu'.
    lambda = start.adjoint->lambda;
    Lambda = start.adjoint->Lambda;
    lambda.template segment<3>(kRho) -= W.transpose() * lambda.template segment<3>(kNu);
    for (int side = 0; side < 2; ++side) {
      Lambda.template middleRows<3>(kRho) -= W.transpose() * Lambda.template middleRows<3>(kNu);
      Lambda.transposeInPlace();
    }
    M = P.lazyProduct(Lambda);
    x_0 = P * lambda;
    P -= Cov(M.lazyProduct(P));
  }
};

template <int cols>
NavRows<Lanes, cols> rows_of(const Eigen::Matrix<double, kNav, cols>& M) {
  return {M.template topRows<3>().template cast<Lanes>(), M.template middleRows<3>(kNu).template cast<Lanes>(),
          M.template bottomRows<3>().template cast<Lanes>()};
}

NavState<Lanes> in_lanes(const SE23<double>& nav, const Vector<double, 6>& b) {
  return {{nav.C.cast<Lanes>(), nav.v.cast<Lanes>(), nav.p.cast<Lanes>()}, {b.cast<Lanes>()}};
}

IntervalPull<Lanes> in_lanes(const IntervalPull<double>& pull) {
  IntervalPull<Lanes> to;
  to.start = pull.start.cast<Lanes>();
  to.slope = pull.slope.cast<Lanes>();
  to.bend = pull.bend.cast<Lanes>();
  return to;
}

}  // namespace

template <int tail>
InsideInterval::InsideInterval(const AtStart<tail>& start, const FilterOptions& options)
    : smoothed_(start.adjoint != nullptr),
      covariance_reset_(options.covariance_reset),
      straight_(tail > 0),
      tail_(options.tail),
      root_(start.step.root),
      X_0_(in_lanes(start.step.before.X.first, biases(start.step.before.X))),
      pull_(in_lanes(start.step.pull)),
      axes_(X_0_.first, Scalar(0)) {
  const IntervalStep<tail>& step = start.step;
  const StartAxes<double> axes(step.before.X.first, step.pre.T);
  const Entered<tail> entered(start, axes, 0.5 * bias_variance(options.dynamics.noise, step.pre.T));
  const SquareMatrix<double, kCore> P = entered.P.template topLeftCorner<kCore, kCore>();
  P_ = nav_covariance<Scalar, kCore>(P.template cast<Scalar>());
  P_bb_ = P.template bottomRightCorner<kBias, kBias>();
  P_bb_lanes_ = P_bb_.template cast<Scalar>();
  M_nn_transposed_ = rows_of<kNav>(entered.M.template topLeftCorner<kNav, kNav>().transpose());
  M_bn_ = entered.M.template block<kBias, kNav>(kNav, 0).template cast<Scalar>();
  Lambda_ = rows_of<kNav>(entered.Lambda.template topLeftCorner<kNav, kNav>());
  lambda_ = rows_of<1>(entered.lambda.template head<kNav>());
  x_0_ = rows_of<1>(entered.x_0.template head<kNav>());
  x_b_ = entered.x_0.template segment<kBias>(kNav).template cast<Scalar>();
  has_error_ = tail > 0 && tail_.sigma_c > 0.0;
  if constexpr (tail > 0) {
    Vector<double, kCore + tail> mean = entered.x_0;
    mean.template tail<tail>() += step.before.X.second.x.template tail<tail>();
    if (has_error_) set_error<tail>(entered.P, entered.M, entered.Lambda, mean, entered.lambda);
  }
}

template <int tail>
void InsideInterval::set_error(const SquareMatrix<double, kTail + tail>& P, const SquareMatrix<double, kTail + tail>& M,
                               const SquareMatrix<double, kTail + tail>& Lambda,
                               const Vector<double, kTail + tail>& mean, const Vector<double, kTail + tail>& lambda) {
  const auto columns = [&](int at) {
    return ErrorColumns{rows_of<3>(P.template block<kNav, 3>(0, at)),
                        rows_of<3>(M.template block<kNav, 3>(0, at)),
                        rows_of<3>(M.template block<3, kNav>(at, 0).transpose()),
                        rows_of<3>(Lambda.template block<kNav, 3>(0, at)),
                        P.template block<kBias, 3>(kNav, at).template cast<Scalar>(),
                        M.template block<kBias, 3>(kNav, at).template cast<Scalar>(),
                        mean.template segment<3>(at).template cast<Scalar>(),
                        lambda.template segment<3>(at).template cast<Scalar>()};
  };
  const auto blocks = [&](int row, int col) {
    return ErrorBlocks{P.template block<3, 3>(row, col).template cast<Scalar>(),
                       M.template block<3, 3>(row, col).template cast<Scalar>(),
                       Lambda.template block<3, 3>(row, col).template cast<Scalar>()};
  };
  constexpr int c = kTail + kTailC, u = kTail + kTailU;
  c_ = columns(c);
  cc_ = blocks(c, c);
  if constexpr (tail == kLongTail) {
    if (!tail_.is_coloured()) return;
    u_ = columns(u);
    cu_ = blocks(c, u);
    uc_ = blocks(u, c);
    uu_ = blocks(u, u);
  }
}

// What both kinds of output begin with.
struct InsideInterval::Inside {
  NavCovariance<Scalar, kBias> P;  // of (phi, z - W y, y)
  NavState<Scalar> X;
  ResetBlocks<Scalar> J;  // from there to the left error of X
  IntervalNoise<Scalar> Q;
  ErrorCorrelation<Scalar> error;
};

InsideInterval::Inside InsideInterval::inside(const Preintegrated<Scalar>& pre) const {
  const SE23<Scalar> d{pre.dC, pre.dv, pre.dp};
  const Matrix3<Scalar> turn = pre.dC.transpose(), none = Matrix3<Scalar>::Zero();
  Inside out{P_, X_0_, {turn, turn, none, none}, IntervalNoise<Scalar>(pre), {}};
  const IntervalNoise<Scalar>& Q = out.Q;
  NavCovariance<Scalar, kBias>& P = out.P;
  add_biases<Scalar, kBias>(P, pre, P_bb_lanes_);
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
  const Vector<Scalar, kNav> nav = eps.template head<kNav>();
  if (straight_) {
    out.X.first = retract_straight(out.X.first, nav);
    out.X.second.x += x_b_;
  } else {
    out.X = LieModel<Scalar>::retract(out.X, eps);
  }
  if (!covariance_reset_) return out;
  const ResetBlocks<Scalar> J = straight_ ? straight_reset(nav) : group_reset(nav);
  out.J = {J.J * turn, J.R * turn, J.Q_nu * turn, J.Q_rho * turn};
  return out;
}

// c with the navigation error, in the coordinates of (Eq. 53) first:
//   c_t = a c + b u + w,  cov(w, (c, u)_t) = (q_t, r_t);   (q, r) = [a b; 0 a_u]^-1 (q_t, r_t)
//   G = A (a P_c + b P_u - q M_c - r M_u) - Q (a M_c'^T + b M_u'^T + q Lambda_c + r Lambda_u)
// M' the rows of P Lambda that belong to c and u. The inverse brings the noise at t to the start, where Lambda holds; what is
// left of the vehicle's error in these coordinates does not move.
void InsideInterval::add_error(const SampleLanes& samples, Inside& in) const {
  const Preintegrated<Scalar>& pre = samples.pre;
  Scalar a(0), b(0), q(0), r(0), noise(0);
  for (int i = 0; i < samples.count; ++i) {
    const ErrorStep step = error_step(tail_, pre.T.x[i]);
    a.x[i] = step.keep;
    b.x[i] = step.from_driver;
    noise.x[i] = step.noise;
    r.x[i] = step.with_driver / step.keep_driver;
    q.x[i] = (step.noise - step.from_driver * r.x[i]) / step.keep;
  }
  const bool coloured = tail_.is_coloured();
  const auto mix = [&](const auto& of_c, const auto& of_u, const Scalar& by_c, const Scalar& by_u) {
    auto sum = (by_c * of_c).eval();
    if (coloured) sum += by_u * of_u;
    return sum;
  };
  const auto rows = [&](const NavRows<Scalar, 3>& of_c, const NavRows<Scalar, 3>& of_u, const Scalar& by_c,
                        const Scalar& by_u) {
    return NavRows<Scalar, 3>{mix(of_c.phi, of_u.phi, by_c, by_u), mix(of_c.nu, of_u.nu, by_c, by_u),
                              mix(of_c.rho, of_u.rho, by_c, by_u)};
  };
  const auto add = [](NavRows<Scalar, 3>& to, const NavRows<Scalar, 3>& what, const Scalar& by) {
    to.phi += by * what.phi;
    to.nu += by * what.nu;
    to.rho += by * what.rho;
  };
  NavRows<Scalar, 3> x = rows(c_.P, u_.P, a, b);
  Eigen::Matrix<Scalar, 6, 3> x_b = mix(c_.P_b, u_.P_b, a, b);
  if (smoothed_) {
    add(x, rows(c_.M, u_.M, q, r), Scalar(-1));
    x_b -= mix(c_.M_b, u_.M_b, q, r);
    NavRows<Scalar, 3> future = rows(c_.M_transposed, u_.M_transposed, a, b);
    add(future, rows(c_.Lambda, u_.Lambda, q, r), Scalar(1));
    add(x, in.Q.times(future), Scalar(-1));
  }
  add(x, bias_times<Scalar, 3>(pre, x_b), Scalar(1));
  // As in leave_interval().
  using detail::cross_rows;
  const Matrix3<Scalar> y = x.rho + pre.T * x.nu - cross_rows(pre.dp, x.phi),
                        z = x.nu - cross_rows(pre.dv, x.phi) - cross_rows(axes_.omega_ie_b, y);
  in.error.G = {in.J.J * x.phi, in.J.R * z + in.J.Q_nu * x.phi, in.J.R * y + in.J.Q_rho * x.phi};

  Matrix3<Scalar> V = mix(mix(cc_.P, uc_.P, a, b), mix(cu_.P, uu_.P, a, b), a, b);
  V.diagonal().array() += noise;
  if (smoothed_) {
    // (a M_c + b M_u)(q, r)^T and its transpose, and (q, r) Lambda (q, r)^T.
    const Matrix3<Scalar> Y = mix(mix(cc_.M, uc_.M, a, b), mix(cu_.M, uu_.M, a, b), q, r);
    V -= Y + Y.transpose() + mix(mix(cc_.Lambda, uc_.Lambda, q, r), mix(cu_.Lambda, uu_.Lambda, q, r), q, r);
  }
  in.error.V = V;
  in.error.c = mix(c_.mean, u_.mean, a, b) + mix(c_.lambda, u_.lambda, q, r);
}

NavBelief<Lanes> InsideInterval::nav_at(const SampleLanes& samples) const {
  Inside in = inside(samples.pre);
  const NavCovariance<Scalar, kBias>& P = in.P;
  const Matrix3<Scalar>&J = in.J.J, &R = in.J.R, Rt = R.transpose();
  NavBelief<Scalar> out{in.X,
                        J * Matrix3<Scalar>(P.phi_phi * J.transpose()),
                        R * Matrix3<Scalar>(P.nu_nu * Rt),
                        R * Matrix3<Scalar>(P.rho_rho * Rt),
                        {},
                        Vector3<Scalar>::Zero()};
  if (smoothed_ && covariance_reset_ && !straight_) {
    // R nu + Q phi: R P_nu R^T + Z + Z^T, Z = (R P_nu_phi + Q P_phi / 2) Q^T
    const auto add = [&](Matrix3<Scalar>& sum, const Matrix3<Scalar>& cross, const Matrix3<Scalar>& Q) {
      const Matrix3<Scalar> half = R * cross + Scalar(0.5) * (Q * P.phi_phi), Z = half * Q.transpose();
      sum += Z + Z.transpose();
    };
    add(out.P_nu, P.nu_phi, in.J.Q_nu);
    add(out.P_rho, P.rho_phi, in.J.Q_rho);
  }
  out.P_relative = out.P_rho;
  if (!has_error_) return out;
  add_error(samples, in);
  const Matrix3<Scalar> S = out.X.first.C.transpose() * root_.cast<Scalar>();
  out.P_relative = relative_covariance<Scalar>(out.P_rho, in.error.G.rho, in.error.V, S);
  out.c = in.error.c;
  return out;
}

WholeBelief<Lanes> InsideInterval::at(const SampleLanes& samples) const {
  Inside in = inside(samples.pre);
  if (has_error_) {
    add_error(samples, in);
  } else {
    const Matrix3<Scalar> none = Matrix3<Scalar>::Zero();
    in.error = {{none, none, none}, none, Vector3<Scalar>::Zero()};
  }
  apply_reset(in.P, in.J);
  WholeBelief<Lanes> out{{in.X, {}}, in.error};
  out.belief.P.template bottomRightCorner<kBias, kBias>() = P_bb_lanes_;
  set_nav_covariance<Scalar, kCore>(out.belief.P, in.P);
  mirror(out.belief.P);
  return out;
}

template InsideInterval::InsideInterval(const AtStart<kNoTail>&, const FilterOptions&);
template InsideInterval::InsideInterval(const AtStart<kShortTail>&, const FilterOptions&);
template InsideInterval::InsideInterval(const AtStart<kLongTail>&, const FilterOptions&);

}  // namespace liealign
