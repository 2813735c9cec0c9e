// The heading search in its stages; its fits, one basin after the other, are in heading_fits.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/heading_search.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/align/harmonic_fit.hpp"
#include "liealign/align/heading_grids.hpp"
#include "liealign/align/verdict.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr std::size_t kHalfDensity = 8;  // samples on either side of psi*

// What theta is worth before the flight is asked.
constexpr double kLatencyPriorStd_s = 0.5;
constexpr double kLogScalePriorStd = 1.5;
constexpr double kClockDriftPriorStd = 5e-5;  // quartz of loggers and receivers
// A receiver is hardly more than twenty times as good as it says: what it filters is not noise.
constexpr double kLeastStdScale = 0.05, kLogLeastStd = 0.1;

std::size_t lowest(const std::vector<double>& costs) {
  return static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
}

}  // namespace

bool HeadingSearch::is_scale(double FlightParameters::*variable) { return variable != &FlightParameters::latency_s; }

HeadingSearch::HeadingSearch(const HeadingSearchOptions& options) : options_(options) {
  if (options.estimate_latency) variables_.push_back(&FlightParameters::latency_s);
  if (options.estimate_imu_noise) {
    variables_.push_back(&FlightParameters::imu_noise_scale);
    variables_.push_back(&FlightParameters::accel_noise_scale);
  }
  if (options.estimate_gnss_std) variables_.push_back(&FlightParameters::gnss_std_scale);
  if (options.estimate_gnss_std && options.has_velocity) variables_.push_back(&FlightParameters::velocity_std_scale);
  if (options.estimate_imu_noise || options.estimate_gnss_std) {
    stage_ = Stage::scales;
    asked_ = scale_grid(options);
  } else if (options.estimate_latency && !options.seeds.empty()) {
    stage_ = Stage::latency;
    asked_ = latency_scan(options, start_);
  } else {
    asked_ = coarse_circle(options, start_);
  }
}

double HeadingSearch::cost_of(const HeadingCandidate& candidate, double negative_log_likelihood) const {
  double cost = negative_log_likelihood;
  const auto add = [&](double deviation, double std) { cost += 0.5 * (deviation / std) * (deviation / std); };
  if (options_.guess_rad) add(wrap_pi(candidate.heading_rad - *options_.guess_rad), options_.guess_std_rad);
  for (const auto variable : variables_) {
    const double value = candidate.parameters.*variable;
    if (is_scale(variable)) {
      add(std::log(value), kLogScalePriorStd);
    } else {
      add(value, kLatencyPriorStd_s);
    }
  }
  add(candidate.parameters.clock_drift, kClockDriftPriorStd);
  const FlightParameters& p = candidate.parameters;
  if (options_.estimate_gnss_std) {
    for (double scale : {p.gnss_std_scale, p.gnss_std_scale * p.velocity_std_scale}) {
      if (scale < kLeastStdScale) add(std::log(scale / kLeastStdScale), kLogLeastStd);
    }
  }
  // Turn-on biases are one draw of six numbers: a larger scale than the profile's wants more than one of them.
  add(std::log(candidate.parameters.turn_on_scale), kLogScalePriorStd);
  return cost;
}

HeadingCandidate HeadingSearch::conditional(double heading_rad, const FlightParameters& parameters) const {
  return {heading_rad, 0.0, stage_ != Stage::open && !joint(), gate_scales_, parameters, correction_};
}

HeadingCandidate HeadingSearch::candidate_at(const SurfaceVector& x) const {
  FlightParameters parameters = base_;
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    const double value = x[static_cast<Eigen::Index>(i) + 1];
    parameters.*variables_[i] = is_scale(variables_[i]) ? std::exp(value) : value;
  }
  return conditional(x[0], parameters);
}

void HeadingSearch::tell_scales(const std::vector<double>& costs) {
  start_ = asked_[lowest(costs)].parameters;
  start_.latency_s = 0.0;
  if (options_.estimate_latency && !options_.seeds.empty() && !latency_scanned_) {
    stage_ = Stage::latency;
    asked_ = latency_scan(options_, start_);
  } else {
    stage_ = Stage::circle;
    asked_ = coarse_circle(options_, start_);
  }
}

// A latency that is off raises the noise scales that fit it: where one has moved they are looked for again.
void HeadingSearch::tell_latency(const std::vector<double>& costs) {
  latency_scanned_ = true;
  bool moved = false;
  const auto each = static_cast<std::ptrdiff_t>(costs.size() / options_.seeds.size());
  for (std::size_t i = 0; i < options_.seeds.size(); ++i) {
    const auto first = costs.begin() + static_cast<std::ptrdiff_t>(i) * each;
    const auto best = static_cast<std::size_t>(std::min_element(first, first + each) - costs.begin());
    moved = moved || options_.seeds[i].latency_s != asked_[best].parameters.latency_s;
    options_.seeds[i].latency_s = asked_[best].parameters.latency_s;
  }
  if (moved && (options_.estimate_imu_noise || options_.estimate_gnss_std)) {
    stage_ = Stage::scales;
    asked_ = scale_grid(options_);
  } else {
    stage_ = Stage::circle;
    asked_ = coarse_circle(options_, start_);
  }
}

void HeadingSearch::tell_circle(const std::vector<double>& costs) {
  // Of a ring, its local minima; all of what does not belong to one.
  const std::size_t ring = stage_ == Stage::whole_circle ? costs.size() : options_.guess_rad ? 1 : kCoarseCircle;
  const std::size_t in_rings = stage_ == Stage::whole_circle ? costs.size() : ring * circle_latencies(options_).size();
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const std::size_t from = i - i % ring, next = from + (i + 1 - from) % ring,
                      before = from + (i + ring - 1 - from) % ring;
    const bool lowest_here = i >= in_rings || (costs[i] <= costs[next] && costs[i] <= costs[before]);
    if (std::isfinite(costs[i]) && lowest_here)
      basins_.push_back({asked_[i].heading_rad, asked_[i].parameters.latency_s, costs[i]});
  }
  if (basins_.empty()) {
    throw NumericalError(
        "alignment: the filter fails from every heading; check units, axes and time stamps of the IMU");
  }
  std::stable_sort(basins_.begin(), basins_.end(), [](const Basin& a, const Basin& b) { return a.cost < b.cost; });
  if (stage_ == Stage::circle && !options_.guess_rad) {
    // Two harmonics describe a circle when no residual is more than a small part of their depth, or of a nat.
    bool described = true;
    const std::size_t circles = circle_latencies(options_).size();
    for (std::size_t j = 0; j < circles; ++j) {
      const auto from = costs.begin() + static_cast<std::ptrdiff_t>(j * kCoarseCircle);
      const std::vector<double> y(from, from + kCoarseCircle);
      if (asked_[j * kCoarseCircle].parameters.latency_s != basins_.front().latency_s) continue;
      const double depth = *std::max_element(y.begin(), y.end()) - *std::min_element(y.begin(), y.end());
      described = fit_harmonics(y).worst < std::max(1.0, 0.15 * depth);
    }
    if (!described) {
      FlightParameters parameters = start_;
      parameters.latency_s = basins_.front().latency_s;
      return start_whole_circle(parameters);
    }
  }
  choose_basins();
}

void HeadingSearch::start_whole_circle(const FlightParameters& parameters) {
  stage_ = Stage::whole_circle;
  asked_ = whole_circle(options_, parameters);
  for (HeadingCandidate& candidate : asked_) candidate.start = circle_start_;
}

// The best, and others far enough from it that are not hopeless.
void HeadingSearch::choose_basins() {
  constexpr double kHopeless = 30.0;  // nats
  constexpr std::size_t kMost = 3;
  const double apart = std::max(options_.grid_step_rad, 1.5 * options_.grid_std_rad) * 1.2;
  // The coarse stage knows the heading better than a grid does.
  const auto at_seed = [&](const Basin& b) {
    for (const HeadingSeed& seed : options_.seeds) {
      if (std::abs(wrap_pi(b.heading_rad - seed.heading_rad)) < apart && std::abs(b.latency_s - seed.latency_s) < 0.3)
        return Basin{seed.heading_rad, seed.latency_s, b.cost};
    }
    return b;
  };
  std::vector<Basin> chosen;
  for (const Basin& b : basins_) {
    const auto near = [&](const Basin& c) {
      return std::abs(wrap_pi(b.heading_rad - c.heading_rad)) < 2.0 * apart &&
             std::abs(b.latency_s - c.latency_s) < 0.3;
    };
    if (chosen.size() == kMost || b.cost > basins_.front().cost + kHopeless) break;
    if (std::none_of(chosen.begin(), chosen.end(), near)) chosen.push_back(at_seed(b));
  }
  basins_ = chosen;
  basin_ = 0;
  FlightParameters parameters = start_;
  parameters.latency_s = basins_[0].latency_s;
  start_fit(basins_[0].heading_rad, parameters);
}

// Along the valley about psi*, then over the circle.
void HeadingSearch::ask_density() {
  stage_ = Stage::density;
  const Fit& fit = fits_[best_fit_];
  gate_scales_ = fit.gate_scales;
  correction_ = fit.start;
  constexpr int kHalf = static_cast<int>(kHalfDensity);
  constexpr double kFarthest = 4.0;  // sigmas
  constexpr double kWidest = 0.5 * kPi;
  const double reach = std::min(kFarthest * fit.sigma_rad.value_or(kPi), kWidest);
  asked_.clear();
  for (int i = -kHalf; i <= kHalf; ++i) {
    const double off = reach * i / kHalf;
    FlightParameters parameters = fit.parameters;
    for (const auto variable : variables_) {
      double& value = parameters.*variable;
      value = is_scale(variable) ? value * std::exp(fit.slope.*variable * off) : value + fit.slope.*variable * off;
    }
    asked_.push_back(conditional(fit.heading_rad + off, parameters));
  }
  const int n = static_cast<int>(std::ceil(2.0 * kPi / options_.grid_step_rad - 1e-9));
  for (int i = 1; i < n; ++i) {
    const double off = wrap_pi(i * 2.0 * kPi / n);
    if (std::abs(off) > 1.01 * reach) asked_.push_back(conditional(fit.heading_rad + off, fit.parameters));
  }
}

void HeadingSearch::tell_density(const std::vector<double>& costs) {
  if (refit_from_lower(costs)) return;
  std::vector<PosteriorSample> samples;
  const Fit& best = fits_[best_fit_];
  const double temper = 1.0 / (best.misfit * best.misfit);
  if (joint()) {  // of the profile along the valley: -2, 0 and 2 sigmas
    for (const std::size_t i : {kHalfDensity / 2, kHalfDensity, 3 * kHalfDensity / 2})
      fits_[best_fit_].triple.push_back({asked_[i].heading_rad, costs[i]});
  }
  for (std::size_t i = 0; i < costs.size(); ++i) samples.push_back({asked_[i].heading_rad, temper * costs[i]});
  posterior_ = heading_posterior(std::move(samples), best.heading_rad);
  // The other basins, each with its own parameters: by the volume of its fit.
  double sum = 1.0;
  std::vector<HeadingMode> others;
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    const double away = std::abs(wrap_pi(fits_[i].heading_rad - best.heading_rad));
    if (i == best_fit_ || !best.sigma_rad || away < 5.0 * *best.sigma_rad) continue;
    const auto sampled = [&](const HeadingMode& mode) {
      return std::abs(wrap_pi(mode.heading_rad - fits_[i].heading_rad)) < options_.grid_step_rad;
    };
    if (std::any_of(posterior_.modes.begin(), posterior_.modes.end(), sampled)) continue;
    others.push_back({wrap_2pi(fits_[i].heading_rad),
                      std::exp(temper * (best.cost - fits_[i].cost) + fits_[i].log_volume - best.log_volume)});
    sum += others.back().mass;
  }
  for (HeadingMode& mode : posterior_.modes) mode.mass /= sum;
  for (const HeadingMode& mode : others) posterior_.modes.push_back({mode.heading_rad, mode.mass / sum});
  std::stable_sort(posterior_.modes.begin(), posterior_.modes.end(),
                   [](const HeadingMode& a, const HeadingMode& b) { return a.mass > b.mass; });
  asked_.clear();
  stage_ = Stage::done;
}

void HeadingSearch::tell(const std::vector<CandidateScore>& scores) {
  std::vector<double> costs;
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const HeadingCandidate& c = asked_[i];
    costs.push_back(cost_of(c, scores[i].cost));
    if (!c.smoothed)
      curve_.push_back({wrap_2pi(c.heading_rad), c.heading_std_rad, costs.back(), c.gated, c.parameters});
    if ((stage_ == Stage::open || stage_ == Stage::fine) && costs.back() < best_.cost) {
      best_ = scores[i];
      best_.cost = costs.back();
    }
  }
  switch (stage_) {
    case Stage::scales:
      tell_scales(costs);
      break;
    case Stage::latency:
      tell_latency(costs);
      break;
    case Stage::circle:
    case Stage::whole_circle:
      tell_circle(costs);
      break;
    case Stage::open:
    case Stage::fine:
      tell_fit(costs, scores);
      break;
    case Stage::gates:
      tell_gates(scores);
      break;
    case Stage::smoothed_start:
      tell_smoothed_start(scores.front());
      break;
    case Stage::drift:
      tell_drift(costs);
      break;
    case Stage::density:
      tell_density(costs);
      break;
    case Stage::done:
      break;
  }
}

HeadingResult HeadingSearch::result() const {
  if (!done()) throw Error("HeadingSearch: result() before done()");
  const Fit& fit = fits_[best_fit_];
  HeadingResult r;
  r.heading_rad = wrap_2pi(fit.heading_rad);
  r.sigma_rad = fit.sigma_rad;
  r.settled = fit.settled;
  r.parameters = fit.parameters;
  r.start = fit.start;
  r.parameters_std = fit.std;
  r.parameters_std.clock_drift = drift_std_;
  // The latency is that at the start: half a flight from where a drift leaves it alone.
  if (fit.parameters.clock_drift != 0.0 && fit.std.latency_s)
    r.parameters_std.latency_s = std::hypot(*fit.std.latency_s, 0.5 * options_.span_s * *drift_std_);
  r.posterior = posterior_;
  r.triple = fit.triple;
  r.curve = curve_;
  r.evaluations = static_cast<int>(curve_.size());
  r.nis_90 = fit.best.nis_90;
  // The gated filters may have lost fixes, the open ones have followed outliers: the tighter of the two.
  r.gate_scales = joint() ? fit.best.gate_scales
                          : GateScales{std::min(gate_scales_.position, fit.best.gate_scales.position),
                                       std::min(gate_scales_.velocity, fit.best.gate_scales.velocity)};
  judge(r, fit.best, options_);
  return r;
}

}  // namespace liealign
