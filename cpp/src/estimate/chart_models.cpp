// The attitude errors of the classical models.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/chart_models.hpp"

namespace liealign {

Matrix3d EulerAttitude::body_from_error(const SE23<double>& X) {
  constexpr double kLeastCosine = 0.5 * kDegToRad;
  const Vector3d angles = rpy(X);
  const double sin_roll = std::sin(angles[0]), cos_roll = std::cos(angles[0]), sin_pitch = std::sin(angles[1]),
               cos_pitch = std::cos(angles[1]);
  if (cos_pitch < kLeastCosine) {
    throw NumericalError(
        "filter.model is \"euler\" and the pitch comes within half a degree of +-90 deg, where roll and heading are "
        "not "
        "defined; set it to \"lie\" or \"mekf\"");
  }
  return Matrix3d{
      {1.0, 0.0, -sin_pitch}, {0.0, cos_roll, sin_roll * cos_pitch}, {0.0, -sin_roll, cos_roll * cos_pitch}};
}

Vector3d EulerAttitude::between(const SE23<double>& from, const SE23<double>& to) {
  Vector3d by = rpy(to) - rpy(from);
  for (const int turns : {0, 2}) by[turns] = std::remainder(by[turns], 2.0 * kPi);
  return by;
}

}  // namespace liealign
