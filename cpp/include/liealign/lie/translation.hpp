// T(n): the translation group R^n with addition; every Jacobian is the identity.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/core/types.hpp"

namespace liealign {

template <typename Scalar_, int n>
struct Translation {
  using Scalar = Scalar_;
  static constexpr int Dim = n;
  using Tangent = Vector<Scalar, n>;
  using Jacobian = SquareMatrix<Scalar, n>;

  Tangent x = Tangent::Zero();

  static Translation exp(const Tangent& xi) { return {xi}; }
  Tangent log() const { return x; }
  Translation inverse() const { return {-x}; }
  Translation operator*(const Translation& other) const { return {x + other.x}; }

  Jacobian Ad() const { return Jacobian::Identity(); }
  static Jacobian ad(const Tangent&) { return Jacobian::Zero(); }
  static Jacobian left_jacobian(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian left_jacobian_inverse(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian right_jacobian(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian right_jacobian_inverse(const Tangent&) { return Jacobian::Identity(); }
};

}  // namespace liealign
