// What a filter believes, and what an update of it saw and did.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/lanes.hpp"
#include "liealign/core/types.hpp"
#include "liealign/estimate/gating.hpp"

namespace liealign {

// State and covariance of its left error.
template <typename Model>
struct Belief {
  typename Model::State X;
  typename Model::Covariance P;
};

// One lane of a belief, and a belief into one.
template <template <typename, int> typename Model, int tail>
Belief<Model<double, tail>> lane(const Belief<Model<Lanes, tail>>& belief, int i) {
  return {lane(belief.X, i), lane(belief.P, i)};
}
template <template <typename, int> typename Model, int tail>
void set_lane(Belief<Model<Lanes, tail>>& belief, int i, const Belief<Model<double, tail>>& one) {
  set_lane(belief.X, i, one.X);
  set_lane(belief.P, i, one.P);
}

// What one update saw and did, in the axes of its kind. An observation of fewer than three rows leaves the others zero.
template <typename Scalar>
struct Innovation {
  Vector3<Scalar> z;  // residual
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

// One update, as the smoother goes back through it.
template <typename Model>
struct Correction {
  using Tall = Eigen::Matrix<typename Model::Scalar, Model::Dim, 3>;
  Tall Ht, K;  // H^T, P H^T S^-1
  Matrix3<typename Model::Scalar> S_inverse;
  Vector3<typename Model::Scalar> S_inverse_z;
  typename Model::Scalar weight;
  typename Model::Tangent eps;  // that the state moved by
};

}  // namespace liealign
