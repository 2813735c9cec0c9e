// The heading search: circle, then the successive conditional fit.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/heading_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {

double wrap_pi(double angle_rad) { return angle_rad - 2.0 * kPi * std::ceil(angle_rad / (2.0 * kPi) - 0.5); }

double wrap_2pi(double angle_rad) {
  const double wrapped = angle_rad - 2.0 * kPi * std::floor(angle_rad / (2.0 * kPi));
  return wrapped < 2.0 * kPi ? wrapped : 0.0;
}

namespace {

constexpr double kSecondModeMass = 0.01;

// Local minima of the circle with their share of exp(-cost): the mass of a mode is that of the points nearer to it than to
// any other.
std::vector<HeadingMode> modes_of(const std::vector<CurvePoint>& grid) {
  const std::size_t n = grid.size();
  double lowest = grid[0].cost;
  for (const CurvePoint& p : grid) lowest = std::min(lowest, p.cost);
  std::vector<HeadingMode> modes;
  for (std::size_t i = 0; i < n; ++i) {
    if (grid[i].cost < grid[(i + n - 1) % n].cost && grid[i].cost <= grid[(i + 1) % n].cost)
      modes.push_back({grid[i].heading_rad, 0.0});
  }
  if (modes.empty()) modes.push_back({grid[0].heading_rad, 0.0});  // a flat circle
  double total = 0.0;
  for (const CurvePoint& p : grid) {
    const auto nearest = std::min_element(modes.begin(), modes.end(), [&](const HeadingMode& a, const HeadingMode& b) {
      return std::abs(wrap_pi(p.heading_rad - a.heading_rad)) < std::abs(wrap_pi(p.heading_rad - b.heading_rad));
    });
    nearest->mass += std::exp(lowest - p.cost);
    total += std::exp(lowest - p.cost);
  }
  for (HeadingMode& m : modes) m.mass /= total;
  std::stable_sort(modes.begin(), modes.end(),
                   [](const HeadingMode& a, const HeadingMode& b) { return a.mass > b.mass; });
  return modes;
}

}  // namespace

std::vector<HeadingCandidate> HeadingSearch::ask() const {
  std::vector<HeadingCandidate> candidates;
  if (stage_ != Stage::wide) {
    for (double x : conditional_->ask()) candidates.push_back({x, 0.0, stage_ == Stage::gated, gate_scales_});
  } else if (options_.guess_rad) {
    candidates.push_back({*options_.guess_rad, options_.guess_std_rad, false, {}});
  } else {
    const int n = static_cast<int>(std::ceil(2.0 * kPi / options_.grid_step_rad - 1e-9));
    for (int i = 0; i < n; ++i) candidates.push_back({i * 2.0 * kPi / n, options_.grid_std_rad, false, {}});
  }
  return candidates;
}

double HeadingSearch::prior(double heading_rad) const {
  if (!options_.guess_rad) return 0.0;
  const double d = wrap_pi(heading_rad - *options_.guess_rad) / options_.guess_std_rad;
  return 0.5 * d * d;
}

void HeadingSearch::tell(const std::vector<CandidateScore>& scores) {
  if (stage_ == Stage::wide) {
    tell_wide(scores);
    return;
  }
  const std::vector<double> asked = conditional_->ask();
  std::vector<double> costs;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    costs.push_back(scores[i].cost + prior(asked[i]));
    curve_.push_back({wrap_2pi(asked[i]), 0.0, costs.back(), stage_ == Stage::gated});
    if (scores[i].cost < best_.cost) best_ = scores[i];
  }
  conditional_->tell(costs);
  if (stage_ == Stage::open && conditional_->done()) start_gated();
}

// From the minimum of the open candidates, with their own measure of how far the noise model is off.
void HeadingSearch::start_gated() {
  const bool placed = conditional_->settled() && conditional_->parabola().has_minimum();
  const double centre = placed ? conditional_->parabola().minimum_x : conditional_->best().x;
  const double step =
      placed ? std::min(2.0 * conditional_->parabola().sigma(), options_.triple_step_rad) : options_.triple_step_rad;
  stage_ = Stage::gated;
  gate_scales_ = best_.gate_scales;
  best_ = {};
  best_.cost = std::numeric_limits<double>::infinity();
  conditional_.emplace(centre, step, kPi, options_.tolerance_rad, options_.max_evaluations);
}

void HeadingSearch::tell_wide(const std::vector<CandidateScore>& scores) {
  const std::vector<HeadingCandidate> asked = ask();
  std::size_t best = 0;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    curve_.push_back({wrap_2pi(asked[i].heading_rad), asked[i].heading_std_rad, scores[i].cost, false});
    if (scores[i].cost < scores[best].cost) best = i;
  }
  if (!std::isfinite(scores[best].cost)) {
    throw NumericalError(
        "alignment: the filter fails from every heading; check units, axes and time stamps of the IMU");
  }
  if (asked.size() > 1) modes_ = modes_of(curve_);
  gate_scales_ = scores[best].gate_scales;
  best_.cost = std::numeric_limits<double>::infinity();
  stage_ = Stage::open;
  conditional_.emplace(asked[best].heading_rad, options_.triple_step_rad, kPi, options_.tolerance_rad,
                       options_.max_evaluations);
}

HeadingResult HeadingSearch::result() const {
  if (!done()) throw Error("HeadingSearch: result() before done()");
  HeadingResult r;
  r.curve = curve_;
  r.evaluations = static_cast<int>(curve_.size());
  r.settled = conditional_->settled();
  const Parabola& parabola = conditional_->parabola();
  const bool informative = parabola.has_minimum();
  r.heading_rad = wrap_2pi(r.settled && informative ? parabola.minimum_x : conditional_->best().x);
  r.nis_90 = best_.nis_90;
  // The gated filters may have lost fixes, the open ones have followed outliers: the tighter of the two.
  r.gate_scales = {std::min(gate_scales_.position, best_.gate_scales.position),
                   std::min(gate_scales_.velocity, best_.gate_scales.velocity)};
  if (informative) r.sigma_rad = parabola.sigma();
  r.modes = modes_.empty() ? std::vector<HeadingMode>{{r.heading_rad, 1.0}} : modes_;

  // What the flight itself says: a typed-in guess is not counted for the verdict.
  double information = r.sigma_rad ? 1.0 / (*r.sigma_rad * *r.sigma_rad) : 0.0;
  if (options_.guess_rad) information -= 1.0 / (options_.guess_std_rad * options_.guess_std_rad);
  if (best_.fixes == 0) information = 0.0;
  const double data_sigma = information > 0.0 ? 1.0 / std::sqrt(information) : 2.0 * kPi;
  constexpr double kInterval = 2.0 * 1.959963984540054;  // width of the 95 % interval in sigma
  const bool second_mode = r.modes.size() > 1 && r.modes[1].mass > kSecondModeMass;
  if (kInterval * data_sigma > kPi) {
    r.sigma_rad.reset();
    r.verdict = "unobservable";
    r.advice =
        "the flight holds no horizontal acceleration that would show the heading; fly straight legs with quick starts "
        "and "
        "stops";
  } else if (second_mode) {
    r.verdict = "ambiguous";
    r.advice = "more than one heading explains the flight; accelerate in two different horizontal directions";
  } else if (data_sigma <= options_.max_sigma_rad && r.settled) {
    r.verdict = "aligned";
    r.advice = "the heading is determined by the flight";
  } else {
    r.verdict = "weak";
    r.advice = "the heading is only roughly determined; longer or quicker horizontal accelerations sharpen it";
  }
  return r;
}

}  // namespace liealign
