// The fits of the heading search: in the heading alone, with the other parameters, and of the drift of the clock.
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/align/block_misfit.hpp"
#include "liealign/align/heading_search.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostLowerRefits = 3;
constexpr double kNarrowStep_rad = 0.3 * kDegToRad;

}  // namespace

// Every fit begins in the heading alone.
void HeadingSearch::start_fit(double heading_rad, const FlightParameters& parameters) {
  stage_ = Stage::open;
  base_ = parameters;
  best_ = {};
  best_.cost = kInfinity;
  gate_scales_ = {};
  correction_ = circle_start_;
  corrections_ = 0;
  surface_.reset();
  line_.emplace(heading_rad, options_.triple_step_rad, kPi, options_.tolerance_rad, options_.max_evaluations);
  ask_fit();
}

void HeadingSearch::ask_fit() {
  asked_.clear();
  if (surface_) {
    for (const SurfaceVector& x : surface_->ask()) asked_.push_back(candidate_at(x));
  } else {
    for (double x : line_->ask()) asked_.push_back(conditional(x, base_));
  }
}

void HeadingSearch::tell_fit(const std::vector<double>& costs, const std::vector<CandidateScore>& scores) {
  if (surface_) {
    surface_->tell(costs);
  } else {
    line_->tell(costs);
  }
  if (!drift_ && joins_a_fit()) {
    next_basin();
  } else if (surface_ ? !surface_->done() : !line_->done()) {
    ask_fit();
  } else if (stage_ == Stage::open) {
    if (joint()) {
      start_fine();
    } else {
      ask_gates();
    }
  } else {
    finish_fit(scores);
  }
}

// An outlier that an open filter has followed spoils what it says of the fixes after it, and so its own measure of the noise.
// A tight filter that copes with the flight tells better; a wide heading keeps it from losing fixes by that.
void HeadingSearch::ask_gates() {
  stage_ = Stage::gates;
  asked_.clear();
  const GateScales most = best_.gate_scales;
  for (double open = 1.0;; open *= 2.0) {
    const GateScales gates{std::min(open, most.position), std::min(open, most.velocity)};
    asked_.push_back({line_->best().x, options_.grid_std_rad, true, gates, base_});
    if (open >= std::max(most.position, most.velocity)) break;
  }
}

void HeadingSearch::tell_gates(const std::vector<CandidateScore>& scores) {
  constexpr double kSlack = 1.5;        // of a point of a few dozen fixes
  constexpr double kPlausible = 100.0;  // of a noise model; more is rather more outliers than a fifth
  const auto tightest = [&](GateScales CandidateScore::*which, double most) -> const GateScales* {
    for (std::size_t i = 0; i < scores.size(); ++i) {
      const GateScales &in_force = asked_[i].gate_scales, &found = scores[i].*which;
      if (std::max(in_force.position, in_force.velocity) <= most && std::isfinite(scores[i].cost) &&
          found.position <= kSlack * in_force.position && found.velocity <= kSlack * in_force.velocity)
        return &found;
    }
    return nullptr;
  };
  const GateScales* found = tightest(&CandidateScore::gate_scales, kPlausible);
  if (found == nullptr) found = tightest(&CandidateScore::gate_scales_of_most, kInfinity);
  gate_scales_ = found == nullptr ? best_.gate_scales : *found;
  start_fine();
}

// From the minimum of the open candidates: with the gates that tell_gates() has found, or with theta, and then still no fix is
// refused.
void HeadingSearch::start_fine() {
  stage_ = Stage::fine;
  const Parabola parabola = line_->parabola();
  const bool placed = line_->settled() && parabola.has_minimum();
  const double centre = placed ? parabola.minimum_x : line_->best().x;
  const double step = placed ? std::min(2.0 * parabola.sigma(), options_.triple_step_rad) : options_.triple_step_rad;
  start_fit_about(centre, step);
}

void HeadingSearch::start_fit_about(double heading_rad, double step_rad) {
  best_ = {};
  best_.cost = kInfinity;
  if (joint()) {
    start_surface(heading_rad, 0.5 * step_rad);
  } else {
    line_.emplace(heading_rad, step_rad, kPi, options_.tolerance_rad, options_.max_evaluations);
  }
  ask_fit();
}

void HeadingSearch::start_surface(double heading_rad, double heading_step_rad) {
  constexpr double kLatencyStep_s = 0.01, kLogScaleStep = 0.2;
  const auto n = static_cast<Eigen::Index>(variables_.size()) + 1;
  SurfaceVector x(n), h(n);
  x[0] = heading_rad;
  h[0] = heading_step_rad;
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i) + 1;
    const double value = base_.*variables_[i];
    x[k] = is_scale(variables_[i]) ? std::log(value) : value;
    h[k] = is_scale(variables_[i]) ? kLogScaleStep : kLatencyStep_s;
  }
  surface_.emplace(x, h, SurfaceLimits{});
}

void HeadingSearch::finish_fit(const std::vector<CandidateScore>& scores) {
  Fit fit;
  fit.best = best_;
  fit.gate_scales = gate_scales_;
  fit.parameters = base_;
  fit.start = correction_;
  fit.cost = best_.cost;
  fit.slope = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  if (!joint()) {
    const Parabola parabola = line_->parabola();
    fit.settled = line_->settled();
    fit.heading_rad = fit.settled && parabola.has_minimum() ? parabola.minimum_x : line_->best().x;
    if (parabola.has_minimum()) {
      fit.sigma_rad = parabola.sigma();
      fit.log_volume = std::log(parabola.sigma());
    }
    fit.triple = line_->fitted();
  } else {
    const Surface& surface = surface_->surface();
    fit.settled = surface_->settled();
    const SurfaceVector x = fit.settled ? surface.minimum : surface_->centre();
    fit.heading_rad = x[0];
    fit.parameters = candidate_at(x).parameters;
    if (surface.has_minimum) {
      SurfaceMatrix covariance = surface.covariance();
      const SurfaceVector misfit = block_misfit(covariance, surface_->steps(), scores);
      fit.misfit = misfit[0];
      covariance = (misfit.asDiagonal() * covariance * misfit.asDiagonal()).eval();
      fit.sigma_rad = std::sqrt(covariance(0, 0));
      const Eigen::LLT<SurfaceMatrix> llt(covariance);
      for (Eigen::Index i = 0; i < x.size(); ++i) fit.log_volume += std::log(llt.matrixLLT()(i, i));
      const auto std_of = [&](double FlightParameters::*which, std::optional<double>& std) {
        const auto found = std::find(variables_.begin(), variables_.end(), which);
        if (found == variables_.end()) return;
        const auto k = static_cast<Eigen::Index>(found - variables_.begin()) + 1;
        // of a scale: of its logarithm, times the scale
        const double unit = is_scale(which) ? fit.parameters.*which : 1.0;
        std = unit * std::sqrt(covariance(k, k));
        fit.slope.*which = covariance(k, 0) / covariance(0, 0);
      };
      std_of(&FlightParameters::latency_s, fit.std.latency_s);
      std_of(&FlightParameters::imu_noise_scale, fit.std.imu_noise_scale);
      std_of(&FlightParameters::accel_noise_scale, fit.std.accel_noise_scale);
      std_of(&FlightParameters::gnss_std_scale, fit.std.gnss_std_scale);
      std_of(&FlightParameters::velocity_std_scale, fit.std.velocity_std_scale);
    }
  }
  fits_.push_back(fit);
  if (drift_) return next_basin();
  ask_smoothed_start();
}

void HeadingSearch::ask_smoothed_start() {
  constexpr double kWidest_rad = 20.0 * kDegToRad;
  stage_ = Stage::smoothed_start;
  const Fit& fit = fits_.back();
  HeadingCandidate candidate = conditional(fit.heading_rad, fit.parameters);
  candidate.heading_std_rad = kWidest_rad;
  candidate.smoothed = true;
  asked_ = {candidate};
}

void HeadingSearch::tell_smoothed_start(const CandidateScore& score) {
  constexpr int kMost = 3;
  constexpr double kTilt_rad = 0.3 * kDegToRad;  // moves a heading by some 0.01 deg
  constexpr double kFar_rad = 1.5 * kDegToRad;   // where basins may lie elsewhere
  if (!score.start) return next_basin();
  const double tilt_rad =
      std::hypot(score.start->roll_rad - correction_.roll_rad, score.start->pitch_rad - correction_.pitch_rad);
  if (corrections_ == kMost || tilt_rad < kTilt_rad) {
    if (!astray(score.turn_rad)) return next_basin();
    ++lower_refits_;
    stage_ = Stage::fine;
    base_ = fits_.back().parameters;
    return start_fit_about(fits_.back().heading_rad + score.turn_rad, kNarrowStep_rad);
  }
  ++corrections_;
  correction_ = *score.start;
  const Fit fit = fits_.back();
  fits_.pop_back();
  if (tilt_rad > kFar_rad && circle_start_ == StartCorrection{} && !options_.guess_rad) {
    circle_start_ = correction_;
    basins_.clear();
    fits_.clear();
    best_fit_ = 0;
    start_whole_circle(fit.parameters);
  } else {
    refit(fit, fit.parameters);
  }
}

// A fit that has settled, again, where what it is made from has changed.
void HeadingSearch::refit(const Fit& fit, const FlightParameters& parameters) {
  stage_ = Stage::fine;
  base_ = parameters;
  const double sigma_rad = fit.settled ? fit.sigma_rad.value_or(kPi) : kPi;
  start_fit_about(fit.heading_rad, std::min(2.0 * sigma_rad, options_.triple_step_rad));
}

// Open candidates follow outliers, and can lead to where only outliers agree. A wide filter with gates finds its own way from
// there; gated conditional ones do not, for a degree off they lose every fix.
bool HeadingSearch::astray(double turn_rad) const {
  constexpr double kLeast_rad = 2.0 * kDegToRad, kSigmas = 5.0;
  const Fit& fit = fits_.back();
  return lower_refits_ < kMostLowerRefits && fit.sigma_rad &&
         std::abs(turn_rad) > std::max(kLeast_rad, kSigmas * *fit.sigma_rad);
}

// Of the conditional candidates over the circle one may see what is lower, if not how low. What belongs to the minimum that is
// left, the drift of the clock above all, is found again.
bool HeadingSearch::refit_from_lower(const std::vector<double>& costs) {
  constexpr double kLower = 10.0;  // nats; samples of the fit itself are above it, but for its own curvature
  const auto lowest = std::min_element(costs.begin(), costs.end());
  if (lower_refits_ == kMostLowerRefits || !(*lowest < fits_[best_fit_].cost - kLower)) return false;
  const HeadingCandidate from = asked_[static_cast<std::size_t>(lowest - costs.begin())];
  if (lies_in_a_fit(from.heading_rad)) return false;
  ++lower_refits_;
  corrections_ = 0;
  drift_.reset();
  drift_std_.reset();
  FlightParameters parameters = from.parameters;
  parameters.latency_s += 0.5 * options_.span_s * parameters.clock_drift;
  parameters.clock_drift = 0.0;
  Fit fit = fits_[best_fit_];
  fit.heading_rad = from.heading_rad;
  fit.settled = false;
  refit(fit, parameters);
  return true;
}

bool HeadingSearch::lies_in_a_fit(double heading_rad) const {
  return std::any_of(fits_.begin(), fits_.end(), [&](const Fit& fit) {
    return fit.settled && std::abs(wrap_pi(heading_rad - fit.heading_rad)) < 3.0 * fit.sigma_rad.value_or(0.0);
  });
}

// A later basin may lead to where an earlier one has led.
bool HeadingSearch::joins_a_fit() const {
  return lies_in_a_fit(surface_ ? surface_->surface().minimum[0] : line_->best().x);
}

void HeadingSearch::next_basin() {
  if (++basin_ < basins_.size()) {
    FlightParameters parameters = start_;
    parameters.latency_s = basins_[basin_].latency_s;
    start_fit(basins_[basin_].heading_rad, parameters);
    return;
  }
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    if (fits_[i].cost < fits_[best_fit_].cost) best_fit_ = i;
  }
  constexpr double kLongEnough_s = 120.0;
  if (options_.estimate_latency && options_.span_s >= kLongEnough_s && !drift_ && fits_[best_fit_].settled) {
    ask_drift();
  } else {
    ask_density();
  }
}

// The parameters of the best fit with a drift of the clock about the middle of the flight, where it leaves the latency as it is.
FlightParameters HeadingSearch::drifting(double clock_drift) const {
  FlightParameters parameters = fits_[best_fit_].parameters;
  parameters.latency_s -= 0.5 * options_.span_s * (clock_drift - parameters.clock_drift);
  parameters.clock_drift = clock_drift;
  return parameters;
}

void HeadingSearch::ask_drift() {
  constexpr double kStep = 5e-5, kReach = 1e-3, kTolerance = 1e-6;  // s/s
  stage_ = Stage::drift;
  correction_ = fits_[best_fit_].start;
  if (!drift_) drift_.emplace(0.0, kStep, kReach, kTolerance, options_.max_evaluations);
  asked_.clear();
  for (double drift : drift_->ask()) asked_.push_back(conditional(fits_[best_fit_].heading_rad, drifting(drift)));
}

void HeadingSearch::tell_drift(const std::vector<double>& costs) {
  drift_->tell(costs);
  if (!drift_->done()) return ask_drift();
  const Parabola parabola = drift_->parabola();
  if (drift_->settled() && parabola.has_minimum()) {
    constexpr double kSignificant = 3.0;
    drift_std_ = fits_[best_fit_].misfit * parabola.sigma();
    if (std::abs(parabola.minimum_x) > kSignificant * *drift_std_) {
      return refit(fits_[best_fit_], drifting(parabola.minimum_x));
    }
  }
  ask_density();
}

}  // namespace liealign
