// Successive quadratic fits in n dimensions.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/surface_search.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace liealign {
namespace {

constexpr double kFarthest = 4.0;    // steps in one round: the fit says little about what lies beyond
constexpr double kStep_sigma = 1.5;  // wide enough for what is rough about a likelihood: fixes that pass samples, gates
constexpr double kFlattest = 1e-3;   // of the curvature in steps: flatter than that the way is not the fit's

}  // namespace

SurfaceMatrix Surface::covariance() const {
  const Eigen::LLT<SurfaceMatrix> llt(information);
  return llt.solve(SurfaceMatrix::Identity(information.rows(), information.cols()));
}

SurfaceSearch::SurfaceSearch(const SurfaceVector& centre, const SurfaceVector& steps, const SurfaceLimits& limits)
    : centre_(centre),
      steps_(steps),
      limits_(limits),
      best_(centre),
      best_steps_(steps),
      best_y_(std::numeric_limits<double>::infinity()) {
  ask_stencil();
}

// The centre, +-h_i, and +-(h_i, h_j) of each pair.
void SurfaceSearch::ask_stencil() {
  const Eigen::Index n = centre_.size();
  asked_ = {centre_};
  const auto ask = [&](double sign, Eigen::Index i, Eigen::Index j) {
    SurfaceVector x = centre_;
    x[i] += sign * steps_[i];
    if (j != i) x[j] += sign * steps_[j];
    asked_.push_back(x);
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j) {
      ask(1.0, i, j);
      ask(-1.0, i, j);
    }
  }
}

// (Eq. 59), in steps.
void SurfaceSearch::fit(const std::vector<double>& y) {
  const Eigen::Index n = centre_.size();
  SurfaceVector g(n), second(n);
  SurfaceMatrix H(n, n);
  std::size_t at = 1;
  std::vector<std::size_t> pair_at;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j, at += 2) {
      if (j == i) {
        g[i] = 0.5 * (y[at] - y[at + 1]);
        second[i] = y[at] + y[at + 1];
        H(i, i) = second[i] - 2.0 * y[0];
      } else {
        H(i, j) = y[at] + y[at + 1];
      }
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i + 1; j < n; ++j) {
      H(i, j) = H(j, i) = 0.5 * (H(i, j) - second[i] - second[j] + 2.0 * y[0]);
    }
  }
  const Eigen::SelfAdjointEigenSolver<SurfaceMatrix> eigen(H);
  const SurfaceVector curvature = eigen.eigenvalues();
  // Downhill along every axis, also where the fit curves the wrong way (a bounded loss makes flanks concave).
  SurfaceVector u = eigen.eigenvectors().transpose() * g;
  for (Eigen::Index k = 0; k < n; ++k) u[k] /= -std::max(std::abs(curvature[k]), kFlattest);
  u = (eigen.eigenvectors() * u).eval();
  const double farthest = u.cwiseAbs().maxCoeff();
  if (farthest > kFarthest) u *= kFarthest / farthest;

  surface_.has_minimum = curvature.minCoeff() > 0.0;
  surface_.minimum = centre_ + steps_.cwiseProduct(u);
  surface_.minimum_y = y[0] + g.dot(u) + 0.5 * u.dot(H * u);
  surface_.information = steps_.cwiseInverse().asDiagonal() * H * steps_.cwiseInverse().asDiagonal();

  const SurfaceVector old = steps_;
  bool steps_fit = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double wanted = H(i, i) > 0.0 ? kStep_sigma / std::sqrt(H(i, i)) : 3.0;  // in steps
    steps_[i] *= farthest > kFarthest ? 2.0 : std::clamp(wanted, 0.2, 3.0);        // far to go: not in small steps
    steps_fit = steps_fit && H(i, i) > 0.0 && wanted > 0.4 && wanted < 2.5;
  }
  // u^T H u: the squared distance to the minimum in its sigmas. A rough function keeps it wandering within a part of one.
  constexpr double kWandering = 10.0;  // tolerances
  const bool fits = surface_.has_minimum && steps_fit && farthest <= kFarthest;
  const double distance = fits ? std::sqrt(u.dot(H * u)) : std::numeric_limits<double>::infinity();
  near_ = distance <= kWandering * limits_.tolerance_sigma ? near_ + 1 : 0;
  settled_ = distance <= limits_.tolerance_sigma || near_ == 4;
  if (settled_) {
    steps_ = old;
    asked_.clear();
    return;
  }
  centre_ = surface_.minimum;
}

// To the lowest point seen, with smaller steps.
void SurfaceSearch::retreat() {
  centre_ = best_;
  best_steps_ *= 0.5;
  steps_ = best_steps_;
}

void SurfaceSearch::tell(const std::vector<double>& y) {
  const std::vector<SurfaceVector> points = std::move(asked_);
  asked_.clear();
  ++rounds_;
  const bool finite = std::all_of(y.begin(), y.end(), [](double value) { return std::isfinite(value); });
  const auto lowest = static_cast<std::size_t>(std::min_element(y.begin(), y.end()) - y.begin());
  constexpr double kRise = 0.5;  // nats that a new centre may lie higher
  const bool rises = y[0] > best_y_ + kRise;
  if (y[lowest] < best_y_) {
    best_y_ = y[lowest];
    best_ = points[lowest];
    best_steps_ = steps_;
  }
  if (!finite || rises) {
    retreat();
  } else {
    fit(y);
  }
  if (!settled_ && rounds_ < limits_.max_rounds) ask_stencil();
}

}  // namespace liealign
