// One-dimensional quadratic fit through three points, and its successive use.
//
//   x_4 = 1/2 (b_23 y_1 + b_31 y_2 + b_12 y_3) / (a_23 y_1 + a_31 y_2 + a_12 y_3)                 (Eq. 38)
//   c   = sum_i y_i / prod_{j != i} (x_i - x_j),  a minimum where c > 0;  sigma = 1/sqrt(2 c)      (Eq. 39)
//
// a_ij = x_i - x_j, b_ij = x_i^2 - x_j^2. Source: DRONES (7)-(8), TAES (31). y is a negative log density, so that its
// curvature 2c is the information.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "liealign/core/types.hpp"

namespace liealign {

struct FitPoint {
  double x = 0.0;
  double y = 0.0;
};

struct Parabola {
  double minimum_x = 0.0;  // (Eq. 38), meaningful where curvature > 0
  double minimum_y = 0.0;
  double curvature = 0.0;  // 2 c of (Eq. 39)

  bool has_minimum() const { return curvature > 0.0; }
  double sigma() const { return 1.0 / std::sqrt(curvature); }
};

// The parabola through three points with distinct x. Computed about the middle point, which (Eq. 38) allows: the fit does
// not depend on the origin, its rounding does.
inline Parabola fit_parabola(const FitPoint& p1, const FitPoint& p2, const FitPoint& p3) {
  const double x1 = p1.x - p2.x, x3 = p3.x - p2.x;   // x2 = 0
  const double y1 = p1.y - p2.y, y3 = p3.y - p2.y;   // y2 = 0
  const double c = (y1 / x1 - y3 / x3) / (x1 - x3);  // leading coefficient
  const double slope = y1 / x1 - c * x1;             // at the middle point
  const double at = -slope / (2.0 * c);
  return {p2.x + at, p2.y + 0.5 * slope * at, 2.0 * c};
}

// The successive fit of DRONES 2.4 as ask/tell. The best point and its neighbours on either side give the next one, which
// is the papers' "three best points" wherever those enclose the minimum, and is safe where they do not (a bounded loss makes
// the flanks of the curve concave). While the best point is the outermost, it walks on; where fits stop narrowing the
// bracket, it halves the larger side. Settled: a triple at +-2 sigma agrees with the sigma it was laid out for.
class QuadraticSearch {
 public:
  // First triple: centre - step, centre, centre + step. Settled when the minimum moves less than `tolerance`; walks at most
  // `reach` away from the centre.
  QuadraticSearch(double centre, double step, double reach, double tolerance, int max_evaluations)
      : centre_(centre),
        step_(step),
        reach_(reach),
        tolerance_(tolerance),
        max_evaluations_(max_evaluations),
        asked_{centre - step, centre, centre + step} {}

  // Where to evaluate next; empty when done.
  const std::vector<double>& ask() const { return asked_; }

  // Values at the points asked for, in their order. Non-finite values count as very large.
  void tell(const std::vector<double>& y);

  bool done() const { return asked_.empty(); }
  bool settled() const { return settled_; }
  const Parabola& parabola() const { return parabola_; }           // last fit
  const std::vector<FitPoint>& fitted() const { return fitted_; }  // its three points
  const std::vector<FitPoint>& points() const { return points_; }  // all, in order of x
  const FitPoint& best() const { return points_[best_index()]; }
  int evaluations() const { return static_cast<int>(points_.size()); }

 private:
  std::size_t best_index() const;
  void fit(const std::vector<FitPoint>& three);
  void next_point();
  void walk(double direction);
  void check_final_triple();
  void ask_triple(double centre, double half_width);

  double centre_, step_, reach_, tolerance_;
  int max_evaluations_;
  double bracket_ = 0.0;  // width of the bracket at the last fit
  bool final_triple_ = false, settled_ = false;
  std::vector<double> asked_;
  std::vector<FitPoint> points_, fitted_;
  Parabola parabola_;
};

}  // namespace liealign
