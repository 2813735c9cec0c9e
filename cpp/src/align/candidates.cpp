// The candidate bank.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <utility>
#include <variant>

#include "liealign/align/heading_posterior.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/score.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;
using LanesModel = LieModel<Lanes>;

// A heading so wrong that its filter breaks down is simply the worst.
CandidateScore failed() {
  CandidateScore score;
  score.cost = std::numeric_limits<double>::infinity();
  return score;
}

struct Scored {
  Score<double> score;
  std::vector<ScoreTerm> terms;

  void add(const FilterOptions& options, const Observation& o, const Innovation<double>& innovation) {
    const double before = score.negative_log_likelihood;
    score.add(options, o, innovation);
    terms.push_back({o.t_s, score.negative_log_likelihood - before});
  }

  CandidateScore result() {
    const double cost = score.negative_log_likelihood;
    if (std::isnan(cost)) return failed();  // a lane alone
    return {cost,
            score.p_rms(),
            score.nis_90(),
            score.gate_scales(),
            score.gate_scales_of_most(),
            score.positions,
            std::move(terms)};
  }
};

const Innovation<double>& lane(const Innovation<double>& one, int) { return one; }

// Shows what an update saw to `watcher`, where there is one: one type for every run, so that the filter is compiled once.
template <typename FilterModel>
struct Visitor : SilentVisitor<FilterModel> {
  using Seen = Innovation<typename FilterModel::Scalar>;
  std::function<void(const Observation&, const Seen&)> watcher;

  void updated(const Observation& o, const Seen& innovation) {
    if (watcher) watcher(o, innovation);
  }
};

// How lanes move, chosen at run time for the same reason.
struct LaneMotion {
  std::variant<ByIntervals, ByRescaledIntervals, ByShiftedIntervals<Lanes>> by;

  template <typename Motion>
  explicit LaneMotion(const Motion& motion) : by(std::in_place_type<Motion>, motion) {}

  void move_to(double t_target, const Ekf<LanesModel>& ekf, Belief<LanesModel>& belief, Visitor<LanesModel>& visitor) {
    std::visit([&](auto& motion) { motion.move_to(t_target, ekf, belief, visitor); }, by);
  }
  ImuReading reading() const {
    return std::visit([](const auto& motion) { return motion.reading(); }, by);
  }
  ImuCursor cursor() const {
    return std::visit([](const auto& motion) { return motion.cursor(); }, by);
  }
};

FilterOptions scoring_options(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  return with_parameters(with_gates(problem.filter, candidate.gate_scales), candidate.parameters);
}

// Candidates that differ in their headings alone.
using Headings = std::span<const HeadingCandidate>;

// set(belief, candidate) for each lane; lanes beyond the last candidate are its copies.
template <typename Set>
void for_each_belief(Headings headings, Belief<LanesModel>& beliefs, const Set& set) {
  for (int i = 0; i < Lanes::kCount; ++i) {
    const HeadingCandidate& candidate = headings[std::min(static_cast<std::size_t>(i), headings.size() - 1)];
    Belief<Model> belief = lane(beliefs, i);
    set(belief, candidate);
    set_lane(beliefs, i, belief);
  }
}
template <typename Set>
void for_each_belief(Headings one, Belief<Model>& belief, const Set& set) {
  set(belief, one.front());
}

// `motion` stands at t_begin_s and goes through the pre-tuning and, shown to the watcher, the scored flight.
template <typename FilterModel, typename Motion>
void run(const AlignmentProblem& problem, Motion motion, Headings headings,
         decltype(Visitor<FilterModel>::watcher) watcher) {
  const HeadingCandidate& candidate = headings.front();
  const FlightData data = with_parameters(problem.data, candidate.parameters, problem.t_start_s);
  const FilterOptions scoring = scoring_options(problem, candidate);
  FilterOptions filter = candidate.gated ? scoring : opened(scoring);
  filter.reacquire_after = 0;  // every candidate scores the same fixes
  const InitialStd initial = with_parameters(problem.initial, candidate.parameters);
  Belief<FilterModel> belief;
  for_each_belief(headings, belief, [&](Belief<Model>& one, const HeadingCandidate& c) {
    one = start_belief(problem, initial, c.heading_rad, c.heading_std_rad, c.start);
  });
  Visitor<FilterModel> visitor;
  if (!problem.motion) {
    forward_pass(motion, data, filter, belief, problem.t_start_s, visitor);
    const Ekf<FilterModel> ekf{filter.dynamics, filter.covariance_reset};
    motion.move_to(problem.t_start_s, ekf, belief, visitor);
    for_each_belief(headings, belief, [&](Belief<Model>& one, const HeadingCandidate& c) {
      set_heading(one, c.heading_rad, c.heading_std_rad, data.l_ba_b);
    });
  }
  visitor.watcher = std::move(watcher);
  forward_pass(motion, data, filter, belief, problem.t_end_s, visitor);
}

template <typename FilterModel, typename Motion>
std::vector<CandidateScore> evaluate(const AlignmentProblem& problem, const Motion& motion, Headings headings) {
  const FilterOptions options = scoring_options(problem, headings.front());
  std::vector<Scored> scored(headings.size());
  for (Scored& one : scored) {
    one.terms.reserve(problem.data.observations.size());
    one.score.position_nis.reserve(problem.data.observations.size());
  }
  run<FilterModel>(problem, motion, headings, [&](const Observation& o, const auto& innovation) {
    for (std::size_t i = 0; i < scored.size(); ++i) scored[i].add(options, o, lane(innovation, static_cast<int>(i)));
  });
  std::vector<CandidateScore> scores;
  scores.reserve(scored.size());
  for (Scored& one : scored) scores.push_back(one.result());
  return scores;
}

// Where the cuts between the intervals lie.
using IntervalKey = std::pair<double, double>;

IntervalKey interval_key(const FlightParameters& p) { return {p.latency_s, p.clock_drift}; }

bool differ_in_heading_alone(const HeadingCandidate& a, const HeadingCandidate& b) {
  return a.gated == b.gated && a.gate_scales == b.gate_scales && a.parameters == b.parameters && a.start == b.start;
}

// The candidates in their order, as many together as there are lanes, at most.
std::vector<Headings> side_by_side(const std::vector<HeadingCandidate>& candidates, std::size_t lanes) {
  std::vector<Headings> all;
  for (Headings rest(candidates); !rest.empty(); rest = rest.subspan(all.back().size())) {
    std::size_t n = 1;
    while (n < lanes && n < rest.size() && differ_in_heading_alone(rest[0], rest[n])) ++n;
    all.push_back(rest.first(n));
  }
  return all;
}

// The scores that job(headings) gives, for all candidates, threads over what goes side by side.
template <typename Job>
std::vector<CandidateScore> evaluate_all(const std::vector<HeadingCandidate>& candidates, std::size_t lanes,
                                         const Job& job) {
  const std::vector<Headings> all = side_by_side(candidates, lanes);
  std::vector<std::vector<CandidateScore>> scores(all.size());
  const auto n = static_cast<std::ptrdiff_t>(all.size());
  std::vector<std::exception_ptr> failures(all.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    try {
      scores[k] = job(all[k]);
    } catch (const NumericalError&) {
      scores[k].assign(all[k].size(), failed());
    } catch (...) {
      failures[k] = std::current_exception();  // none may leave a parallel region
    }
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  std::vector<CandidateScore> in_order;
  for (std::vector<CandidateScore>& some : scores) std::move(some.begin(), some.end(), std::back_inserter(in_order));
  return in_order;
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
  list_observations(out);
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
                           double heading_std_rad, const StartCorrection& correction) {
  const Vector3d& l_ba_b = problem.data.l_ba_b;
  const GravityModel gravity = problem.filter.dynamics.gravity;
  return problem.motion
             ? belief_in_motion(*problem.motion, heading_rad, heading_std_rad, initial, l_ba_b, correction)
             : belief_at_rest(problem.rest, heading_rad, heading_std_rad, initial, l_ba_b, gravity, correction);
}

IntervalSeries intervals_for(const AlignmentProblem& problem, const FlightParameters& parameters) {
  const FlightData data = with_parameters(problem.data, parameters, problem.t_start_s);
  std::vector<double> stops = {problem.t_begin_s};
  for (const Observation& o : data.observations) {
    if (o.t_s > problem.t_begin_s && o.t_s <= problem.t_end_s) stops.push_back(o.t_s);
  }
  if (problem.t_start_s > problem.t_begin_s) stops.push_back(problem.t_start_s);
  std::sort(stops.begin(), stops.end());
  return preintegrate(data.imu(), problem.blocks, stops);
}

void preintegrate(AlignmentProblem& problem) {
  // Attitude is not known yet; the Earth's rate, which the gyro bias so contains, is a small one.
  const Vector<double, 6> b_0 = start_belief(problem, problem.initial, 0.0, 0.0).X.second.x;
  problem.blocks =
      SampleBlocks(problem.data.imu(), problem.t_begin_s, problem.t_end_s, b_0, problem.filter.dynamics.noise);
  problem.intervals = intervals_for(problem, {});
}

namespace {

std::vector<CandidateScore> score_candidates(const AlignmentProblem& problem,
                                             const std::vector<HeadingCandidate>& candidates) {
  const std::size_t n = candidates.size();
  if (n == 0) return {};
  // `paper` has no closed form over an interval.
  if (problem.intervals.intervals.empty() || problem.filter.dynamics.mechanization != Mechanization::exact) {
    const ImuCursor start = cursor_at(problem.data.imu(), problem.t_begin_s);
    return evaluate_all(candidates, 1, [&](Headings one) {
      return evaluate<Model>(problem, BySamples{problem.data.imu(), start}, one);
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
    own.push_back(intervals_for(problem, candidates[i].parameters));
  }
  return evaluate_all(candidates, Lanes::kCount, [&](Headings some) {
    const std::size_t i = series_of[static_cast<std::size_t>(some.data() - candidates.data())];
    const IntervalSeries& series = i == 0 ? problem.intervals : own[i - 1];
    const FlightParameters& p = some.front().parameters;
    const bool as_prepared = p.imu_noise_scale == 1.0 && p.accel_noise_scale == 1.0;
    if (as_prepared) return evaluate<LanesModel>(problem, LaneMotion(ByIntervals(series)), some);
    const ByRescaledIntervals motion{ByIntervals(series), problem.data.imu(),
                                     with_parameters(problem.filter, p).dynamics.noise};
    return evaluate<LanesModel>(problem, LaneMotion(motion), some);
  });
}

// Always by intervals: where a run starts does not depend on the mechanization.
void smooth_start(const AlignmentProblem& problem, const HeadingCandidate& candidate, CandidateScore& score) {
  FlightData data = with_parameters(problem.data, candidate.parameters, problem.t_start_s);
  const auto late = [&](const auto& x) { return x.t_s > problem.t_end_s; };
  std::erase_if(data.fixes, late);
  std::erase_if(data.rests, late);
  list_observations(data);
  const FilterOptions scoring = scoring_options(problem, candidate);
  const FilterOptions filter = candidate.gated ? scoring : opened(scoring);
  const InitialStd initial = with_parameters(problem.initial, candidate.parameters);
  const auto start = [&](const StartCorrection& correction) {
    return start_belief(problem, initial, candidate.heading_rad, candidate.heading_std_rad, correction);
  };
  const ForwardRun<kNoTail> run =
      run_forward<kNoTail>(data, filter, start(candidate.start), cursor_at(data.imu(), problem.t_begin_s));
  const Belief<Model> smoothed = smoothed_at_start<kNoTail>(data, filter, run);
  score.start = correction_between(start({}).X, smoothed.X);
  score.turn_rad = wrap_pi(heading_of(smoothed.X) - candidate.heading_rad);
}

}  // namespace

std::vector<CandidateScore> evaluate_candidates(const AlignmentProblem& problem,
                                                const std::vector<HeadingCandidate>& candidates) {
  std::vector<CandidateScore> scores = score_candidates(problem, candidates);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!candidates[i].smoothed) continue;
    try {
      smooth_start(problem, candidates[i], scores[i]);
    } catch (const NumericalError&) {  // the start stays as it is
    }
  }
  return scores;
}

std::vector<CandidateScore> evaluate_clocks(const AlignmentProblem& problem, const IntervalSeries& series,
                                            const HeadingCandidate& candidate,
                                            const std::vector<ClockChange>& changes) {
  const ImuNoise noise = with_parameters(problem.filter, candidate.parameters).dynamics.noise;
  const std::vector<HeadingCandidate> each(changes.size(), candidate);
  return evaluate_all(each, Lanes::kCount, [&](Headings some) {
    Lanes ahead_s, drift;
    for (int i = 0; i < Lanes::kCount; ++i) {
      const auto in_lane = std::min(static_cast<std::size_t>(i), some.size() - 1);
      const ClockChange& change = changes[static_cast<std::size_t>(some.data() - each.data()) + in_lane];
      set_lane(ahead_s, i, -change.latency_s);
      set_lane(drift, i, -change.drift);
    }
    const ByRescaledIntervals by{ByIntervals(series), problem.data.imu(), noise};
    const ByShiftedIntervals<Lanes> motion{by, ahead_s, drift, problem.t_start_s};
    return evaluate<LanesModel>(problem, LaneMotion(motion), some);
  });
}

std::vector<FixInnovation> fix_innovations(const AlignmentProblem& problem, const HeadingCandidate& candidate) {
  const BySamples motion{problem.data.imu(), cursor_at(problem.data.imu(), problem.t_begin_s)};
  std::vector<FixInnovation> innovations;
  run<Model>(problem, motion, Headings(&candidate, 1), [&](const Observation& o, const Innovation<double>& innovation) {
    if (o.kind->gate != GateClass::position) return;
    innovations.push_back({o.record, innovation.z.norm()});
  });
  return innovations;
}

}  // namespace liealign
