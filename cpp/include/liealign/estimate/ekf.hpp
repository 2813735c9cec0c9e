// D-LIE-EKF: the discrete extended Kalman filter on a Lie group, over any Model.
//
//   X_{k+1|k} = f(X_{k|k}, u)                                   P_{k+1|k} = F P F^T + B Sigma B^T + Q_b        (Eq. 27)
//   K = P H^T S^-1, S = H P H^T + R                             X+ = X exp(gamma K z)                          (Eq. 28)
//   P+ = J [(I - gamma K H) P (I - gamma K H)^T + gamma^2 K R K^T] J^T,  J = J_r(gamma K z)                    (Eq. 29)
//
// Source: TAES (14), (23)-(25), DRONES (6). Beyond them: the Joseph form takes the gain that was applied, gamma K, and the
// covariance is carried to the tangent of the updated state by J_r (reset of the left error; `covariance_reset`).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <cmath>

#include "liealign/core/error.hpp"
#include "liealign/estimate/gating.hpp"
#include "liealign/ins/imu.hpp"
#include "liealign/ins/interval_error.hpp"
#include "liealign/ins/mechanization.hpp"
#include "liealign/ins/noise_shape.hpp"

namespace liealign {

// State and covariance of its left error.
template <typename Model>
struct Belief {
  typename Model::State X;
  typename Model::Covariance P;
};

// One lane of a belief, and a belief into one.
template <template <typename> typename Model>
Belief<Model<double>> lane(const Belief<Model<Lanes>>& belief, int i) {
  return {lane(belief.X, i), lane(belief.P, i)};
}
template <template <typename> typename Model>
void set_lane(Belief<Model<Lanes>>& belief, int i, const Belief<Model<double>>& one) {
  set_lane(belief.X, i, one.X);
  set_lane(belief.P, i, one.P);
}

// What one update saw and did. ECEF axes (body axes for the zero rate).
template <typename Scalar>
struct Innovation {
  Vector3<Scalar> z;  // residual, m or m/s
  Matrix3<Scalar> S;  // its covariance
  Scalar nis;         // (Eq. 24)
  Scalar half_log_det_S;
  Scalar weight;  // gamma of (Eq. 25)
  Verdict verdict = Verdict::used;
};

// One lane. The verdict is that of all lanes together.
inline Innovation<double> lane(const Innovation<Lanes>& a, int i) {
  return {lane(a.z, i), lane(a.S, i), lane(a.nis, i), lane(a.half_log_det_S, i), lane(a.weight, i), a.verdict};
}

// How the state moves and how uncertain that is.
struct Dynamics {
  Mechanization mechanization = Mechanization::exact;
  GravityModel gravity = GravityModel::normal;
  ImuNoise noise;
};

// Density of the white noise of accelerometer and gyro, N^2; inside a gap of length T sigma_gap^2 T more, which adds up to
// sigma_gap^2 T^2 over the gap however fixes split it.
struct WhiteDensity {
  double accel, gyro;  // (m/s^2)^2 s, (rad/s)^2 s
};

inline WhiteDensity white_density(const ImuNoise& n, double gap_s) {
  return {n.accel_vrw * n.accel_vrw + n.accel_gap_mps2 * n.accel_gap_mps2 * gap_s,
          n.gyro_arw * n.gyro_arw + n.gyro_gap_rps * n.gyro_gap_rps * gap_s};
}

// The same where and when a sample was taken.
inline WhiteDensity white_density(const ImuNoise& n, const ImuSample& sample) {
  if (!n.shape) return white_density(n, sample.gap_s);
  const NoiseShape::Share share = n.shape->at(sample.t_s);
  return {share.accel * n.accel_vrw * n.accel_vrw + n.accel_gap_mps2 * n.accel_gap_mps2 * sample.gap_s,
          share.gyro * n.gyro_arw * n.gyro_arw + n.gyro_gap_rps * n.gyro_gap_rps * sample.gap_s};
}

// Variance of the mean input over dt (accelerometer first, as the biases).
inline Vector<double, 6> input_variance(const WhiteDensity& d, double dt) {
  const double a = d.accel / dt, g = d.gyro / dt;
  return (Vector<double, 6>() << a, a, a, g, g, g).finished();
}

inline Vector<double, 6> input_variance(const ImuNoise& n, double dt, double gap_s = 0.0) {
  return input_variance(white_density(n, gap_s), dt);
}

// What the biases gain over dt.
inline Vector<double, 6> bias_variance(const ImuNoise& n, double dt) {
  const double a = n.accel_bias_rw * n.accel_bias_rw * dt, g = n.gyro_bias_rw * n.gyro_bias_rw * dt;
  return (Vector<double, 6>() << a, a, a, g, g, g).finished();
}

template <typename Model>
struct Ekf {
  using Scalar = typename Model::Scalar;
  using Covariance = typename Model::Covariance;
  using MeasurementMatrix = Eigen::Matrix<Scalar, 3, Model::Dim>;
  static constexpr int kNav = 9, kBias = 6;
  static_assert(Model::Dim == kNav + kBias);

  Dynamics dynamics;
  bool covariance_reset = true;

  // (Eq. 27) over dt seconds of one IMU sample. Returns the transition, for the smoother.
  NavTransition<Scalar> predict(Belief<Model>& belief, const ImuSample& sample, double dt) const {
    const NavTransition<Scalar> t =
        Model::step(belief.X, sample.omega_ib_b, sample.f_ib_b, dt, dynamics.mechanization, dynamics.gravity);
    propagate_covariance(belief.P, t, dt, white_density(dynamics.noise, sample));
    return t;
  }

  // The same over a preintegrated interval whose samples were corrected by the biases b_0 (exact mechanization). Returns
  // what gravitation did.
  IntervalPull<Scalar> predict(Belief<Model>& belief, const Preintegrated<Scalar>& pre,
                               const Vector<Scalar, kBias>& b_0) const {
    const SE23<Scalar> d = increments<Scalar>(pre, belief.X.second.x - b_0);
    const StartAxes<Scalar> axes(belief.X.first, pre.T);
    propagate_interval<Scalar>(belief.P, axes, d, pre, half_walk(pre.T));
    const IntervalPull<Scalar> pull(belief.X.first, d, pre.T, dynamics.gravity);
    belief.X.first = advance_interval(belief.X.first, d, pre.T, pull);
    return pull;
  }

  // What each bias gains in one half of an interval of T seconds.
  Vector<Scalar, kBias> half_walk(const Scalar& T) const {
    return Scalar(0.5) * T * bias_variance(dynamics.noise, 1.0).template cast<Scalar>();
  }

  // z, S, zeta of a residual z = y - h(X) with measurement covariance R, at the belief as it is.
  // Throws NumericalError when S is not positive definite.
  Innovation<Scalar> innovate(const Belief<Model>& belief, const Vector3<Scalar>& z, const MeasurementMatrix& H,
                              const Matrix3d& R) const {
    using std::isfinite;
    Innovation<Scalar> innovation;
    innovation.z = z;
    innovation.S = H.lazyProduct(times_transposed(belief.P, H)) + R.cast<Scalar>();
    const Eigen::LLT<Matrix3<Scalar>> llt(innovation.S);
    const Vector3<Scalar> whitened = llt.matrixL().solve(z);
    innovation.nis = whitened.squaredNorm();
    if (llt.info() != Eigen::Success || !isfinite(innovation.nis)) {
      throw NumericalError("filter: the innovation covariance is not positive definite or the state is not finite");
    }
    innovation.half_log_det_S = half_log_det(llt);
    return innovation;
  }

  // (Eq. 28)-(Eq. 29) with gain weight * K. A weight of 0 leaves the belief as it is.
  void correct(Belief<Model>& belief, Innovation<Scalar>& innovation, const MeasurementMatrix& H,
               const Scalar& weight) const {
    innovation.weight = weight;
    innovation.verdict = weight == Scalar(0)  ? Verdict::rejected
                         : weight < Scalar(1) ? Verdict::weighted
                                              : Verdict::used;
    if (innovation.verdict == Verdict::rejected) return;
    const Tall PHt = times_transposed(belief.P, H);
    const Tall K = weight * solve_from_right(PHt, innovation.S);
    const typename Model::Tangent eps = K * innovation.z;
    belief.X = Model::retract(belief.X, eps);
    // (I - K H) P (I - K H)^T + K R K^T = P - K U^T - U K^T, U = P H^T - K S / 2, on and below the diagonal.
    const Tall U = PHt - Scalar(0.5) * K.lazyProduct(innovation.S);
    for (int j = 0; j < Model::Dim; j += 3)
      for (int i = j; i < Model::Dim; i += 3)
        belief.P.template block<3, 3>(i, j) -=
            K.template middleRows<3>(i).lazyProduct(U.template middleRows<3>(j).transpose()) +
            U.template middleRows<3>(i).lazyProduct(K.template middleRows<3>(j).transpose());
    if (covariance_reset) Model::reset(belief.P, eps);
    mirror(belief.P);
  }

  // P <- [F B; 0 I] P [F B; 0 I]^T + [B Sigma B^T, 0; 0, Q_b], with the zeros and identities used.
  void propagate_covariance(Covariance& P, const NavTransition<Scalar>& t, double dt, const WhiteDensity& white) const {
    const Vector<Scalar, kBias> Sigma = input_variance(white, dt).template cast<Scalar>();
    const SquareMatrix<Scalar, kNav> P_nn = P.template topLeftCorner<kNav, kNav>();
    const Eigen::Matrix<Scalar, kNav, kBias> P_nb = P.template topRightCorner<kNav, kBias>();
    SquareMatrix<Scalar, kBias> P_bb = P.template bottomRightCorner<kBias, kBias>();
    const Eigen::Matrix<Scalar, kNav, kBias> P_nb_next = t.F * P_nb + t.B * P_bb;
    const Eigen::Matrix<Scalar, kNav, kBias> M = P_nb_next + t.B * Sigma.asDiagonal();
    const SquareMatrix<Scalar, kNav> half = P_nn * t.F.transpose() + P_nb * t.B.transpose();
    // F P_nb B^T stands twice here; symmetrising makes the second one its transpose.
    P.template topLeftCorner<kNav, kNav>() = t.F * half + M * t.B.transpose();
    P.template topRightCorner<kNav, kBias>() = P_nb_next;
    P.template bottomLeftCorner<kBias, kNav>() = P_nb_next.transpose();
    P_bb.diagonal() += bias_variance(dynamics.noise, dt).template cast<Scalar>();
    P.template bottomRightCorner<kBias, kBias>() = P_bb;
    symmetrise(P);
  }

  // P <- (P + P^T) / 2, against rounding.
  static void symmetrise(Covariance& P) { P = (Scalar(0.5) * (P + P.transpose())).eval(); }

 private:
  using Tall = Eigen::Matrix<Scalar, Model::Dim, 3>;

  // P H^T. A measurement sees two or three of the five blocks of the error, the others are left out.
  static Tall times_transposed(const Covariance& P, const MeasurementMatrix& H) {
    Tall out = Tall::Zero();
    for (int block = 0; block < Model::Dim; block += 3) {
      const Matrix3<Scalar> H_block = H.template middleCols<3>(block);
      if (!H_block.isZero(0.0)) out += P.template middleCols<3>(block).lazyProduct(H_block.transpose());
    }
    return out;
  }

  // M S^-1 with S = L L^T: by columns, where a solve would divide row by row.
  static Tall solve_from_right(const Tall& M, const Matrix3<Scalar>& S) {
    const Eigen::LLT<Matrix3<Scalar>> llt(S);
    const Matrix3<Scalar>& L = llt.matrixLLT();
    const Vector3<Scalar> inverse = L.diagonal().cwiseInverse();
    Tall K;
    K.col(0) = inverse[0] * M.col(0);
    K.col(1) = inverse[1] * (M.col(1) - L(1, 0) * K.col(0));
    K.col(2) = inverse[2] * (M.col(2) - L(2, 0) * K.col(0) - L(2, 1) * K.col(1));
    K.col(2) *= inverse[2];
    K.col(1) = inverse[1] * (K.col(1) - L(2, 1) * K.col(2));
    K.col(0) = inverse[0] * (K.col(0) - L(1, 0) * K.col(1) - L(2, 0) * K.col(2));
    return K;
  }

  static Scalar half_log_det(const Eigen::LLT<Matrix3<Scalar>>& llt) {
    using std::log;
    return log(llt.matrixLLT().diagonal().prod());
  }
};

}  // namespace liealign
