// The heading search in its stages.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/heading_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/align/block_misfit.hpp"
#include "liealign/align/harmonic_fit.hpp"
#include "liealign/align/heading_grids.hpp"
#include "liealign/align/verdict.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kHalfDensity = 8;  // samples on either side of psi*

// What theta is worth before the flight is asked.
constexpr double kLatencyPriorStd_s = 0.5;
constexpr double kLogScalePriorStd = 1.5;
constexpr double kClockDriftPriorStd = 5e-5;  // quartz of loggers and receivers
// A receiver is hardly more than twenty times as good as it says: what it filters is not noise.
constexpr double kLeastStdScale = 0.05, kLogLeastStd = 0.1;

bool is_scale(double FlightParameters::*variable) { return variable != &FlightParameters::latency_s; }

std::size_t lowest(const std::vector<double>& costs) {
  return static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
}

}  // namespace

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
  return {heading_rad, 0.0, stage_ != Stage::open && !joint(), gate_scales_, parameters};
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

// A latency that is off raises the noise scales that fit it: they are looked for again.
void HeadingSearch::tell_latency(const std::vector<double>& costs) {
  latency_scanned_ = true;
  const auto each = static_cast<std::ptrdiff_t>(costs.size() / options_.seeds.size());
  for (std::size_t i = 0; i < options_.seeds.size(); ++i) {
    const auto first = costs.begin() + static_cast<std::ptrdiff_t>(i) * each;
    const auto best = static_cast<std::size_t>(std::min_element(first, first + each) - costs.begin());
    options_.seeds[i].latency_s = asked_[best].parameters.latency_s;
  }
  if (options_.estimate_imu_noise || options_.estimate_gnss_std) {
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
      stage_ = Stage::whole_circle;
      FlightParameters parameters = start_;
      parameters.latency_s = basins_.front().latency_s;
      asked_ = whole_circle(options_, parameters);
      return;
    }
  }
  choose_basins();
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

// Every fit begins in the heading alone.
void HeadingSearch::start_fit(double heading_rad, const FlightParameters& parameters) {
  stage_ = Stage::open;
  base_ = parameters;
  best_ = {};
  best_.cost = kInfinity;
  gate_scales_ = {};
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
  constexpr double kSlack = 1.5;  // of the 90 % point of a few dozen fixes
  gate_scales_ = best_.gate_scales;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const GateScales &in_force = asked_[i].gate_scales, &found = scores[i].gate_scales;
    const bool copes = std::isfinite(scores[i].cost) && found.position <= kSlack * in_force.position &&
                       found.velocity <= kSlack * in_force.velocity;
    if (!copes) continue;
    gate_scales_ = found;
    break;
  }
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
  if (joint()) {
    start_surface(centre, 0.5 * step);
  } else {
    line_.emplace(centre, step, kPi, options_.tolerance_rad, options_.max_evaluations);
  }
  best_ = {};
  best_.cost = kInfinity;
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
  next_basin();
}

// A later basin may lead to where an earlier one has led.
bool HeadingSearch::joins_a_fit() const {
  const double heading = surface_ ? surface_->surface().minimum[0] : line_->best().x;
  return std::any_of(fits_.begin(), fits_.end(), [&](const Fit& fit) {
    return fit.settled && std::abs(wrap_pi(heading - fit.heading_rad)) < 3.0 * fit.sigma_rad.value_or(0.0);
  });
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
      base_ = drifting(parabola.minimum_x);
      stage_ = Stage::fine;
      best_ = {};
      best_.cost = kInfinity;
      const Fit& fit = fits_[best_fit_];
      start_surface(fit.heading_rad, fit.sigma_rad.value_or(options_.triple_step_rad));
      return ask_fit();
    }
  }
  ask_density();
}

// Along the valley about psi*, then over the circle.
void HeadingSearch::ask_density() {
  stage_ = Stage::density;
  const Fit& fit = fits_[best_fit_];
  gate_scales_ = fit.gate_scales;
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
  judge(r, fit.best.fixes, options_);
  return r;
}

}  // namespace liealign
