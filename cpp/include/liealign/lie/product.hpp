// G1 x G2: the direct product of two groups; every operation acts block by block.
// SE_2(3) x T(6) of TAES (19) is Product<SE23<S>, Translation<S, 6>>.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "liealign/core/types.hpp"

namespace liealign {

template <typename First, typename Second>
struct Product {
  using Scalar = typename First::Scalar;
  static_assert(std::is_same_v<Scalar, typename Second::Scalar>);
  static constexpr int Dim = First::Dim + Second::Dim;
  using Tangent = Vector<Scalar, Dim>;
  using Jacobian = SquareMatrix<Scalar, Dim>;

  First first;
  Second second;

  static Product exp(const Tangent& xi) {
    return {First::exp(xi.template head<First::Dim>()), Second::exp(xi.template tail<Second::Dim>())};
  }
  Tangent log() const {
    Tangent xi;
    xi << first.log(), second.log();
    return xi;
  }
  Product inverse() const { return {first.inverse(), second.inverse()}; }
  Product operator*(const Product& other) const { return {first * other.first, second * other.second}; }

  Jacobian Ad() const { return blocks(first.Ad(), second.Ad()); }
  static Jacobian ad(const Tangent& xi) {
    return blocks(First::ad(xi.template head<First::Dim>()), Second::ad(xi.template tail<Second::Dim>()));
  }
  static Jacobian left_jacobian(const Tangent& xi) {
    return blocks(First::left_jacobian(xi.template head<First::Dim>()),
                  Second::left_jacobian(xi.template tail<Second::Dim>()));
  }
  static Jacobian left_jacobian_inverse(const Tangent& xi) {
    return blocks(First::left_jacobian_inverse(xi.template head<First::Dim>()),
                  Second::left_jacobian_inverse(xi.template tail<Second::Dim>()));
  }
  static Jacobian right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }
  static Jacobian right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

 private:
  static Jacobian blocks(const typename First::Jacobian& a, const typename Second::Jacobian& b) {
    Jacobian m = Jacobian::Zero();
    m.template topLeftCorner<First::Dim, First::Dim>() = a;
    m.template bottomRightCorner<Second::Dim, Second::Dim>() = b;
    return m;
  }
};

}  // namespace liealign
