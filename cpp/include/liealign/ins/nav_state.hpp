// The navigation state on SE_2(3) x T(6 + tail): X.first = (C_b_e, v_eb_e, p_eb_e), X.second = (b_a, b_g, tail), TAES (19).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"
#include "liealign/lie/product.hpp"
#include "liealign/lie/se23.hpp"
#include "liealign/lie/translation.hpp"

namespace liealign {

// A tail of n additive states rides behind the biases.
template <typename Scalar, int tail = 0>
using NavState = Product<SE23<Scalar>, Translation<Scalar, 6 + tail>>;

// Offsets of the error blocks; a tail begins at kTail.
inline constexpr int kPhi = 0, kNu = 3, kRho = 6, kBa = 9, kBg = 12, kTail = 15;

template <typename Scalar, int n>
Vector3<Scalar> b_a(const Product<SE23<Scalar>, Translation<Scalar, n>>& X) {
  return X.second.x.template head<3>();
}
template <typename Scalar, int n>
Vector3<Scalar> b_g(const Product<SE23<Scalar>, Translation<Scalar, n>>& X) {
  return X.second.x.template segment<3>(3);
}
// (b_a, b_g).
template <typename Scalar, int n>
Vector<Scalar, 6> biases(const Product<SE23<Scalar>, Translation<Scalar, n>>& X) {
  return X.second.x.template head<6>();
}

}  // namespace liealign
