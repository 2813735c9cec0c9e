// The successive quadratic fit.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/quadratic_fit.hpp"

namespace liealign {
namespace {

constexpr double kVeryLarge = 1e300;

}  // namespace

std::size_t QuadraticSearch::best_index() const {
  const auto lower = [](const FitPoint& a, const FitPoint& b) { return a.y < b.y; };
  return static_cast<std::size_t>(std::min_element(points_.begin(), points_.end(), lower) - points_.begin());
}

void QuadraticSearch::fit(const std::vector<FitPoint>& three) {
  fitted_ = three;
  parabola_ = fit_parabola(three[0], three[1], three[2]);
}

void QuadraticSearch::tell(const std::vector<double>& y) {
  std::vector<FitPoint> told;
  for (std::size_t i = 0; i < asked_.size(); ++i) told.push_back({asked_[i], std::isfinite(y[i]) ? y[i] : kVeryLarge});
  points_.insert(points_.end(), told.begin(), told.end());
  std::stable_sort(points_.begin(), points_.end(), [](const FitPoint& a, const FitPoint& b) { return a.x < b.x; });
  asked_.clear();
  if (final_triple_) {
    fit(told);
    check_final_triple();
  } else {
    next_point();
  }
  if (evaluations() >= max_evaluations_) asked_.clear();
}

void QuadraticSearch::next_point() {
  const std::size_t i = best_index();
  if (i == 0 || i + 1 == points_.size()) {
    const std::size_t first = i == 0 ? 0 : points_.size() - 3;
    fit({points_[first], points_[first + 1], points_[first + 2]});
    walk(i == 0 ? -1.0 : 1.0);
    return;
  }
  fit({points_[i - 1], points_[i], points_[i + 1]});
  if (!parabola_.has_minimum()) return;  // three equal values: the data say nothing
  const double best = points_[i].x, width = points_[i + 1].x - points_[i - 1].x;
  if (std::abs(parabola_.minimum_x - best) < std::max(tolerance_, 0.5 * parabola_.sigma())) {
    ask_triple(parabola_.minimum_x, 2.0 * parabola_.sigma());
    return;
  }
  const bool narrowing = bracket_ == 0.0 || width < 0.5 * bracket_;
  bracket_ = width;
  const double left = best - points_[i - 1].x, right = points_[i + 1].x - best;
  asked_ = {narrowing ? parabola_.minimum_x : left > right ? best - 0.5 * left : best + 0.5 * right};
}

// The best point is the outermost: on, twice as far each time.
void QuadraticSearch::walk(double direction) {
  const bool flat = points_.front().y == points_.back().y;
  const double x = (direction < 0.0 ? points_.front().x : points_.back().x) + direction * step_;
  step_ *= 2.0;
  if (!flat && std::abs(x - centre_) <= reach_) asked_ = {x};
}

// The triple stands when its own sigma agrees with the width it was laid out for and its minimum lies near its centre.
void QuadraticSearch::check_final_triple() {
  if (!parabola_.has_minimum()) {
    final_triple_ = false;
    bracket_ = 0.0;
    next_point();
    return;
  }
  const double half_width = 0.5 * (fitted_[2].x - fitted_[0].x), centre = fitted_[1].x;
  const double ratio = 2.0 * parabola_.sigma() / half_width;
  const bool near = std::abs(parabola_.minimum_x - centre) < std::max(tolerance_, 0.5 * parabola_.sigma());
  if (near && ratio > 0.5 && ratio < 2.0) {
    settled_ = true;
    return;
  }
  const double shift = std::clamp(parabola_.minimum_x - centre, -2.0 * half_width, 2.0 * half_width);
  ask_triple(centre + shift, half_width * std::clamp(ratio, 0.1, 10.0));
}

// A triple never reaches farther than the search itself.
void QuadraticSearch::ask_triple(double centre, double half_width) {
  if (half_width > reach_) {
    asked_.clear();
    return;
  }
  final_triple_ = true;
  asked_ = {centre - half_width, centre, centre + half_width};
}

}  // namespace liealign
