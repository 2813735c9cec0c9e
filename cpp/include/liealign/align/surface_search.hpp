// Minimum and Hessian of a smooth function of a few variables by successive quadratic fits: (Eq. 38)-(Eq. 39) in n dimensions.
//
//   y(c + h o u) = y_0 + g^T u + 1/2 u^T H u,   u* = -H^-1 g                                      (Eq. 58)
//   g_i  = (y_{+i} - y_{-i}) / 2,   H_ii = y_{+i} + y_{-i} - 2 y_0
//   H_ij = (y_{+i+j} + y_{-i-j} - y_{+i} - y_{-i} - y_{+j} - y_{-j} + 2 y_0) / 2                    (Eq. 59)
//
// c: centre, h: steps, one per variable (o: component by component). One round evaluates the stencil about c; the next
// centre is the fit's minimum or, where that lies higher, the lowest point seen, the next steps are one and a half of its
// conditional sigmas. Both quotients of differences are exact up to the
// fourth order. y is a negative log density: its Hessian is the information, H^-1 the covariance.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace liealign {

// How many variables there are is known only when the configuration is.
using SurfaceVector = Eigen::VectorXd;
using SurfaceMatrix = Eigen::MatrixXd;

struct Surface {
  SurfaceVector minimum;
  double minimum_y = 0.0;
  SurfaceMatrix information;  // Hessian at the minimum
  bool has_minimum = false;   // the Hessian is positive definite

  SurfaceMatrix covariance() const;  // inverse of the information; where it has a minimum
};

struct SurfaceLimits {
  double tolerance_sigma = 0.1;  // settled: the minimum moves less than this many of its sigmas
  int max_rounds = 20;
};

class SurfaceSearch {
 public:
  SurfaceSearch(const SurfaceVector& centre, const SurfaceVector& steps, const SurfaceLimits& limits);

  // Where to evaluate next; empty when done.
  const std::vector<SurfaceVector>& ask() const { return asked_; }

  // Values at the points asked for, in their order. Non-finite ones shrink the stencil.
  void tell(const std::vector<double>& y);

  bool done() const { return asked_.empty(); }
  bool settled() const { return settled_; }
  const Surface& surface() const { return surface_; }      // last fit
  const SurfaceVector& centre() const { return centre_; }  // of the last stencil: the lowest one seen
  const SurfaceVector& steps() const { return steps_; }

  // Where the points centre + h_i and, next to it, centre - h_i stand among those of a round.
  static std::size_t axis_index(Eigen::Index i, Eigen::Index n) {
    return static_cast<std::size_t>(1 + 2 * (i * n - i * (i - 1) / 2));
  }

 private:
  void ask_stencil();
  void fit(const std::vector<double>& y);
  void retreat();

  SurfaceVector centre_, steps_;
  SurfaceLimits limits_;
  SurfaceVector best_, best_steps_;  // the lowest point seen, and the steps of its stencil
  double best_y_;
  int rounds_ = 0, near_ = 0;  // near_: rounds in a row that hardly moved
  bool settled_ = false;
  std::vector<SurfaceVector> asked_;
  Surface surface_;
};

}  // namespace liealign
