// BFGS on batches of evaluations.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/quasi_newton.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace liealign {
namespace {

using Point = Eigen::VectorXd;
using Hessian = Eigen::MatrixXd;

// Of the cost about a point.
struct Slope {
  Point gradient, curvature;
};

Slope slope_at(const BatchCost& cost, const Point& x, double value, double h, int& evaluations) {
  const Eigen::Index n = x.size();
  std::vector<Point> points;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (const double side : {h, -h}) {
      points.push_back(x);
      points.back()[i] += side;
    }
  }
  const std::vector<double> costs = cost(points);
  evaluations += static_cast<int>(costs.size());
  Slope slope{Point(n), Point(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const double plus = costs[static_cast<std::size_t>(2 * i)], minus = costs[static_cast<std::size_t>(2 * i + 1)];
    slope.gradient[i] = (plus - minus) / (2.0 * h);
    slope.curvature[i] = (plus - 2.0 * value + minus) / (h * h);
    if (!std::isfinite(slope.gradient[i])) slope.gradient[i] = 0.0;
    constexpr double kFlat = 0.1;  // a step of three standard deviations for one nat where nothing curves
    if (!(slope.curvature[i] > kFlat)) slope.curvature[i] = std::max(kFlat, std::abs(slope.gradient[i]));
  }
  return slope;
}

// B <- B - B s s^T B / s^T B s + y y^T / y^T s, where that stays positive definite.
void update_bfgs(Hessian& B, const Point& s, const Point& y) {
  const Point Bs = B * s;
  const double sBs = s.dot(Bs), ys = y.dot(s);
  if (!(ys > 0.1 * sBs)) return;
  B += y * y.transpose() / ys - Bs * Bs.transpose() / sBs;
}

// Rows and columns scaled so that the diagonal is this one.
void scale_diagonal(Hessian& B, const Point& diagonal) {
  const Point by = (diagonal.array() / B.diagonal().array()).sqrt();
  B = (by.asDiagonal() * B * by.asDiagonal()).eval();
}

}  // namespace

QuasiNewtonResult minimise(const BatchCost& cost, const Point& start, const QuasiNewtonOptions& options) {
  QuasiNewtonResult result;
  result.x = start;
  result.cost = cost({start}).front();
  result.evaluations = 1;
  if (start.size() == 0 || !std::isfinite(result.cost)) return result;
  Hessian& B = result.hessian;
  Point last_step, last_gradient;
  for (int round = 0; round < options.max_rounds; ++round) {
    const Slope slope = slope_at(cost, result.x, result.cost, options.difference, result.evaluations);
    if (round == 0) {
      B = slope.curvature.asDiagonal();
    } else {
      update_bfgs(B, last_step, slope.gradient - last_gradient);
      scale_diagonal(B, slope.curvature);
    }
    Point step = -B.ldlt().solve(slope.gradient);
    if (-0.5 * slope.gradient.dot(step) < options.tolerance) {
      result.settled = true;
      return result;
    }
    const double most = step.cwiseAbs().maxCoeff();
    if (most > options.longest) step *= options.longest / most;
    double best = std::numeric_limits<double>::infinity(), share = 0.0;
    for (const auto& [one, other] : {std::pair{1.0, 0.4}, std::pair{0.15, 0.04}}) {
      const std::vector<double> costs = cost({result.x + one * step, result.x + other * step});
      result.evaluations += 2;
      best = std::min(costs[0], costs[1]);
      share = costs[0] <= costs[1] ? one : other;
      if (best < result.cost) break;
    }
    if (!(best < result.cost)) return result;
    last_step = share * step;
    last_gradient = slope.gradient;
    result.x += last_step;
    const double fall = result.cost - best;
    result.cost = best;
    if (fall < options.tolerance) {
      result.settled = true;
      return result;
    }
  }
  return result;
}

}  // namespace liealign
