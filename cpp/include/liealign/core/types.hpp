// Fixed-size Eigen aliases used on every floor.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross()

namespace liealign {

template <typename Scalar, int N>
using Vector = Eigen::Matrix<Scalar, N, 1>;
template <typename Scalar, int N>
using SquareMatrix = Eigen::Matrix<Scalar, N, N>;

template <typename Scalar>
using Vector3 = Vector<Scalar, 3>;
template <typename Scalar>
using Matrix3 = SquareMatrix<Scalar, 3>;

using Vector3d = Vector3<double>;
using Matrix3d = Matrix3<double>;

}  // namespace liealign
