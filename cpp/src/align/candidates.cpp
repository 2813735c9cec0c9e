// The candidate bank.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/candidates.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

#include "liealign/estimate/score.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

struct ScoringVisitor : SilentVisitor<Model> {
  FilterOptions options;
  Score<double> score;
  std::vector<ScoreTerm> terms;

  void updated(const Event& event, UpdateKind kind, const Innovation<double>& innovation) {
    const double before = score.negative_log_likelihood;
    score.add(options, kind, innovation);
    terms.push_back({event.t_s, score.negative_log_likelihood - before});
  }
};

struct RecordingVisitor : SilentVisitor<Model> {
  const FlightData& data;
  std::vector<FixInnovation> innovations;

  void updated(const Event& event, UpdateKind kind, const Innovation<double>& innovation) {
    if (kind == UpdateKind::position) innovations.push_back({data.fixes[event.index].record, innovation.z.norm()});
  }
};

FilterOptions scoring_options(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  return with_parameters(with_gates(problem.filter, candidate.gate_scales), candidate.parameters);
}

// `motion` stands at t_begin_s and goes through the pre-tuning and, shown to the visitor, the scored flight.
template <typename Motion, typename Visitor>
void run(const AlignmentProblem& problem, Motion motion, const HeadingCandidate& candidate, Visitor& visitor) {
  const FlightData data = with_parameters(problem.data, candidate.parameters, problem.t_start_s);
  const FilterOptions scoring = scoring_options(problem, candidate);
  FilterOptions filter = candidate.gated ? scoring : opened(scoring);
  filter.reacquire_after = 0;  // every candidate scores the same fixes
  Belief<Model> belief = start_belief(problem, with_parameters(problem.initial, candidate.parameters),
                                      candidate.heading_rad, candidate.heading_std_rad);
  if (!problem.motion) {
    SilentVisitor<Model> silent;
    forward_pass(motion, data, filter, belief, problem.t_start_s, silent);
    const Ekf<Model> ekf{filter.dynamics, filter.covariance_reset};
    motion.move_to(problem.t_start_s, ekf, belief, silent);
    set_heading(belief, candidate.heading_rad, candidate.heading_std_rad, data.l_ba_b);
  }
  forward_pass(motion, data, filter, belief, problem.t_end_s, visitor);
}

template <typename Motion>
CandidateScore evaluate(const AlignmentProblem& problem, const Motion& motion, const HeadingCandidate& candidate) {
  ScoringVisitor visitor{{}, scoring_options(problem, candidate), {}, {}};
  run(problem, motion, candidate, visitor);
  return {visitor.score.negative_log_likelihood, visitor.score.p_rms(),   visitor.score.nis_90(),
          visitor.score.gate_scales(),           visitor.score.positions, std::move(visitor.terms)};
}

// Where the cuts between the intervals lie.
using IntervalKey = std::pair<double, double>;

IntervalKey interval_key(const FlightParameters& p) { return {p.latency_s, p.clock_drift}; }

IntervalSeries preintegrate_for(const AlignmentProblem& problem, const FlightParameters& parameters) {
  const FlightData data = with_parameters(problem.data, parameters, problem.t_start_s);
  std::vector<double> stops = {problem.t_begin_s};
  for (const Event& event : data.events) {
    if (event.t_s > problem.t_begin_s && event.t_s <= problem.t_end_s) stops.push_back(event.t_s);
  }
  if (problem.t_start_s > problem.t_begin_s) stops.push_back(problem.t_start_s);
  std::sort(stops.begin(), stops.end());
  // Attitude is not known yet; the Earth's rate, which the gyro bias so contains, is a small one.
  const Belief<Model> at_start = start_belief(problem, problem.initial, 0.0, 0.0);
  return preintegrate(data.imu(), stops, at_start.X.second.x, problem.filter.dynamics.noise);
}

// job(i) for each candidate, threads over candidates.
template <typename Job>
std::vector<CandidateScore> evaluate_all(std::size_t candidates, const Job& job) {
  std::vector<CandidateScore> scores(candidates);
  const auto n = static_cast<std::ptrdiff_t>(candidates);
  std::vector<std::exception_ptr> failures(candidates);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    try {
      scores[k] = job(k);
    } catch (const NumericalError&) {
      // A heading so wrong that its filter breaks down is simply the worst.
      scores[k].cost = std::numeric_limits<double>::infinity();
    } catch (...) {
      failures[k] = std::current_exception();  // none may leave a parallel region
    }
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  return scores;
}

}  // namespace

FlightData with_parameters(const FlightData& data, const FlightParameters& parameters, double t_start_s) {
  FlightData out = data;
  const double variance = parameters.gnss_std_scale * parameters.gnss_std_scale;
  const double variance_v = variance * parameters.velocity_std_scale * parameters.velocity_std_scale;
  for (GnssFix& fix : out.fixes) {
    fix.t_s -= parameters.latency_s + parameters.clock_drift * (fix.t_s - t_start_s);
    fix.R_p_e *= variance;
    fix.R_v_e *= variance_v;
  }
  if (parameters.latency_s != 0.0 || parameters.clock_drift != 0.0) merge_events(out);
  return out;
}

FilterOptions with_parameters(FilterOptions options, const FlightParameters& parameters) {
  options.dynamics.noise = scaled(options.dynamics.noise, parameters.imu_noise_scale,
                                  parameters.imu_noise_scale * parameters.accel_noise_scale);
  return options;
}

InitialStd with_parameters(InitialStd std, const FlightParameters& parameters) {
  const double scale = parameters.imu_noise_scale * parameters.turn_on_scale;
  std.gyro_bias_rps *= scale;
  std.accel_bias_mps2 *= scale;
  return std;
}

Belief<Model> start_belief(const AlignmentProblem& problem, const InitialStd& initial, double heading_rad,
                           double heading_std_rad) {
  const GravityModel gravity = problem.filter.dynamics.gravity;
  return problem.motion
             ? belief_in_motion(*problem.motion, heading_rad, heading_std_rad, initial, problem.data.l_ba_b)
             : belief_at_rest(problem.rest, heading_rad, heading_std_rad, initial, problem.data.l_ba_b, gravity);
}

IntervalSeries preintegrate(const AlignmentProblem& problem) { return preintegrate_for(problem, {}); }

std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates) {
  const std::size_t n = candidates.size();
  if (n == 0) return {};
  // `paper` has no closed form over an interval.
  if (problem.intervals.intervals.empty() || problem.filter.dynamics.mechanization != Mechanization::exact) {
    const ImuCursor start = cursor_at(problem.data.imu(), problem.t_begin_s);
    return evaluate_all(n, [&](std::size_t i) {
      return evaluate(problem, BySamples{problem.data.imu(), start}, candidates[i]);
    });
  }
  std::vector<IntervalKey> keys = {interval_key({})};
  std::vector<IntervalSeries> own;
  std::vector<std::size_t> series_of(n);
  for (std::size_t i = 0; i < n; ++i) {
    const IntervalKey key = interval_key(candidates[i].parameters);
    series_of[i] = static_cast<std::size_t>(std::find(keys.begin(), keys.end(), key) - keys.begin());
    if (series_of[i] < keys.size()) continue;
    keys.push_back(key);
    own.push_back(preintegrate_for(problem, candidates[i].parameters));
  }
  return evaluate_all(n, [&](std::size_t i) {
    const IntervalSeries& series = series_of[i] == 0 ? problem.intervals : own[series_of[i] - 1];
    const FlightParameters& p = candidates[i].parameters;
    const bool as_prepared = p.imu_noise_scale == 1.0 && p.accel_noise_scale == 1.0;
    if (as_prepared) return evaluate(problem, ByIntervals(series), candidates[i]);
    const ByRescaledIntervals motion{ByIntervals(series), problem.data.imu(),
                                     with_parameters(problem.filter, p).dynamics.noise};
    return evaluate(problem, motion, candidates[i]);
  });
}

std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  RecordingVisitor visitor{{}, problem.data, {}};
  run(problem, BySamples{problem.data.imu(), cursor_at(problem.data.imu(), problem.t_begin_s)}, candidate, visitor);
  return visitor.innovations;
}

}  // namespace liealign
