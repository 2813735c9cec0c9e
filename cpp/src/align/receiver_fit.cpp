// Maximum likelihood of a receiver's errors, (Eq. 84).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/receiver_fit.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "liealign/align/quasi_newton.hpp"
#include "liealign/core/error.hpp"
#include "liealign/estimate/score.hpp"
#include "liealign/observe/kinds.hpp"

namespace liealign {
namespace {

// One parameter: its prior, and where it stands in ReceiverParameters.
struct Coordinate {
  LogNormal ReceiverPrior::*prior;
  double ReceiverParameters::*value;
};
constexpr Coordinate kCoordinates[] = {
    {&ReceiverPrior::tau_c_s, &ReceiverParameters::tau_c_s},
    {&ReceiverPrior::tau_u_s, &ReceiverParameters::tau_u_s},
    {&ReceiverPrior::white_scale, &ReceiverParameters::white_scale},
    {&ReceiverPrior::velocity_scale, &ReceiverParameters::velocity_scale},
    {&ReceiverPrior::sigma_s_mps, &ReceiverParameters::sigma_s_mps},
    {&ReceiverPrior::tau_s_s, &ReceiverParameters::tau_s_s},
    {&ReceiverPrior::jitter_s, &ReceiverParameters::jitter_s},
    {&ReceiverPrior::gyro_scale, &ReceiverParameters::gyro_scale},
    {&ReceiverPrior::accel_scale, &ReceiverParameters::accel_scale},
};

// theta at the medians of its prior.
ReceiverParameters medians(const ReceiverPrior& prior) {
  ReceiverParameters theta;
  theta.sigma_c = prior.sigma_c;
  for (const Coordinate& c : kCoordinates) theta.*c.value = (prior.*c.prior).median;
  return theta;
}

// The free parameters as one vector of logarithms, and back.
struct Chart {
  ReceiverPrior prior;
  std::vector<Coordinate> free;

  explicit Chart(const ReceiverPrior& of) : prior(of) {
    for (const Coordinate& c : kCoordinates) {
      if ((prior.*c.prior).is_free()) free.push_back(c);
    }
  }
  Eigen::VectorXd vector(const ReceiverParameters& theta) const {
    Eigen::VectorXd x(static_cast<Eigen::Index>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i) x[static_cast<Eigen::Index>(i)] = std::log(theta.*free[i].value);
    return x;
  }
  ReceiverParameters parameters(const Eigen::VectorXd& x) const {
    ReceiverParameters theta = medians(prior);
    for (std::size_t i = 0; i < free.size(); ++i) theta.*free[i].value = std::exp(x[static_cast<Eigen::Index>(i)]);
    return theta;
  }
  double prior_cost(const Eigen::VectorXd& x) const {
    double cost = 0.0;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const LogNormal& p = prior.*free[i].prior;
      const double off = (x[static_cast<Eigen::Index>(i)] - std::log(p.median)) / p.log_std;
      cost += 0.5 * off * off;
    }
    return cost;
  }
};

bool is_fix(const Observation& o) { return o.kind->gate == GateClass::position || o.kind->gate == GateClass::velocity; }

struct ScoreVisitor {
  Score<double> score;
  const FilterOptions& options;
  std::vector<std::size_t>* gross;  // records of messages that are beyond what any noise does; or nowhere to put them

  static constexpr bool keeps_changes = false;
  template <typename... Any>
  void before(const Any&...) {}
  template <typename... Any>
  void after(const Any&...) {}
  template <typename... Any>
  void node(const Any&...) {}
  void updated(const Observation& o, const Innovation<double>& i) {
    score.add(options, o, i);
    constexpr double kGross = 100.0;  // ten sigma
    if (gross != nullptr && is_fix(o) && i.nis > kGross) gross->push_back(o.record);
  }
};

// Passes over the part of the flight that theta is found from, over intervals that are cut once for its latencies.
template <int tail>
class FitPasses {
 public:
  using Model = LieModel<double, tail>;

  FitPasses(const ReceiverProblem& problem, const SampleBlocks& blocks, const std::vector<std::size_t>& left_out,
            const ReceiverLatency& latency)
      : problem_(problem), left_out_(left_out), latency_(latency) {
    std::vector<double> stops = {problem.cursor.t_s};
    for (const Observation& o : observations_of(medians(problem.prior)).observations) {
      if (o.t_s > problem.cursor.t_s) stops.push_back(o.t_s);
    }
    series_ = preintegrate(problem.data.imu(), blocks, stops);
  }

  struct Pass {
    double cost;
    Belief<Model> end;
  };
  Pass run(const ReceiverParameters& theta, std::vector<std::size_t>* gross = nullptr) const {
    const FlightData data = observations_of(theta);
    FilterOptions options = with_receiver(problem_, theta);
    // Bounded, never rejected: what a gate throws out says nothing, and then throwing out is the best fit.
    constexpr double kBound = 25.0;
    options.gate = options.velocity_gate = options.scalar_gate = {Outliers::weight, kBound};
    options.reacquire_after = 0;
    Belief<Model> belief = start_with_tail<tail>(
        problem_.start, options.tail, problem_.wide_position_std_m,
        {problem_.latency.position_s - latency_.position_s, problem_.latency.velocity_s - latency_.velocity_s});
    ByRescaledIntervals motion{ByIntervals(series_), data.imu(), options.dynamics.noise};
    ScoreVisitor visitor{{}, options, gross};
    forward_pass(motion, data, options, belief, problem_.fit_end_s, visitor);
    return {visitor.score.negative_log_likelihood, belief};
  }

 private:
  // Of a long rest its last part and the first fix, which says where c and p are together.
  FlightData observations_of(const ReceiverParameters& theta) const {
    FlightData data = with_receiver(problem_, theta, latency_);
    const auto first = std::find_if(data.observations.begin(), data.observations.end(),
                                    [&](const Observation& o) { return is_fix(o) && o.t_s > problem_.cursor.t_s; });
    const std::size_t message = first == data.observations.end() ? ObservationMemory::kNone : first->record;
    std::erase_if(data.observations, [&](const Observation& o) {
      if (o.t_s > problem_.fit_end_s) return true;
      return is_fix(o) && o.record != message &&
             (o.t_s < problem_.fit_begin_s || std::binary_search(left_out_.begin(), left_out_.end(), o.record));
    });
    return data;
  }

  const ReceiverProblem& problem_;
  const std::vector<std::size_t>& left_out_;  // records of messages, rising
  ReceiverLatency latency_;
  IntervalSeries series_;
};

template <int tail>
class ReceiverSearch {
 public:
  ReceiverSearch(const ReceiverProblem& problem, const Progress& progress)
      : problem_(problem),
        progress_(progress),
        chart_(problem.prior),
        blocks_(problem.data.imu(), problem.cursor.t_s, problem.fit_end_s, biases(problem.start.X),
                problem.filter.dynamics.noise) {}

  ReceiverFit find() {
    Attempt best;
    const auto keep_lower = [&](const Attempt& a) {
      if (a.cost < best.cost) best = a;
    };
    for (const ReceiverParameters& start : starts()) keep_lower(tried({start, problem_.latency}));
    if (!std::isfinite(best.cost)) throw NumericalError("no filter gets through the flight with the receiver's errors");
    leave_out_gross_errors(best);
    if (!left_out_.empty()) best = settle(best);
    const double interval_s = (problem_.fit_end_s - problem_.fit_begin_s) / std::max(positions_in_fit(), 1.0);
    if (best.parameters.tau_u_s > 0.0 && best.parameters.tau_u_s < interval_s) keep_lower(of_first_order(best));
    return {best.parameters, best.latency, latency_spread(best), best.settled, evaluations_};
  }

 private:
  static constexpr int kMostRounds = 3;
  static constexpr double kNear_s = 0.002;  // a latency that moves by less is linear enough

  struct Attempt {
    ReceiverParameters parameters;
    ReceiverLatency latency;
    double cost = std::numeric_limits<double>::infinity();
    bool settled = false;
  };

  void count(int evaluations) {
    evaluations_ += evaluations;
    if (progress_ && !progress_(static_cast<std::size_t>(evaluations_), kMostRounds * std::size_t{100}))
      throw Cancelled("cancelled");
  }

  std::vector<double> costs(const FitPasses<tail>& passes, const std::vector<ReceiverParameters>& all) const {
    std::vector<double> out(all.size(), std::numeric_limits<double>::infinity());
    std::vector<std::exception_ptr> failures(all.size());
    const auto n = static_cast<std::ptrdiff_t>(all.size());
#pragma omp parallel for schedule(dynamic, 1)
    for (std::ptrdiff_t i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      try {
        out[k] = passes.run(all[k]).cost;
        if (!std::isfinite(out[k])) out[k] = std::numeric_limits<double>::infinity();
      } catch (const NumericalError&) {
      } catch (...) {
        failures[k] = std::current_exception();  // none may leave a parallel region
      }
    }
    for (const std::exception_ptr& failure : failures) {
      if (failure) std::rethrow_exception(failure);
    }
    return out;
  }

  // The noise of the IMU as its data sheet has it; and as the alignment found it, where that is another one. Either may be caught
  // where the other is not: too much noise hides a wrong latency, too little makes one.
  std::vector<ReceiverParameters> starts() const {
    std::vector<ReceiverParameters> all = {medians(problem_.prior)};
    constexpr double kAnother = 2.0;
    const auto differs = [](double scale) { return scale > kAnother || scale < 1.0 / kAnother; };
    if (!problem_.prior.gyro_scale.is_free()) return all;
    if (!differs(problem_.start_gyro_scale) && !differs(problem_.start_accel_scale)) return all;
    all.push_back(all.front());
    all.back().gyro_scale = problem_.start_gyro_scale;
    all.back().accel_scale = problem_.start_accel_scale;
    return all;
  }

  // What is bounded still costs, and drift and white noise grow until it costs less. Which messages they are is decided once: were
  // it for the parameters to say, none would fit better than those that throw out all.
  void leave_out_gross_errors(const Attempt& at) {
    const FitPasses<tail> passes(problem_, blocks_, left_out_, at.latency);
    count(1);
    std::vector<std::size_t> gross;
    passes.run(at.parameters, &gross);
    std::sort(gross.begin(), gross.end());
    gross.erase(std::unique(gross.begin(), gross.end()), gross.end());
    // Outliers stand alone, or two meet by chance; more in a row are a motion that the model does not follow, and say what it lacks.
    constexpr std::size_t kLongestRun = 2;
    std::vector<std::size_t> alone;
    for (std::size_t begin = 0, end = 0; begin < gross.size(); begin = end) {
      for (end = begin + 1; end < gross.size() && gross[end] == gross[end - 1] + 1;) ++end;
      if (end - begin > kLongestRun) continue;
      for (std::size_t i = begin; i < end; ++i) alone.push_back(gross[i]);
    }
    // Fewer are bounded well enough; where more are, the model is wrong.
    constexpr double kLeastShare = 0.01, kMostShare = 0.1;
    const double share = static_cast<double>(alone.size()) / std::max(positions_in_fit(), 1.0);
    if (share >= kLeastShare && share <= kMostShare) left_out_ = std::move(alone);
  }

  double positions_in_fit() const {
    const auto& all = problem_.data.observations;
    return static_cast<double>(std::count_if(all.begin(), all.end(), [&](const Observation& o) {
      return o.kind->gate == GateClass::position && o.t_s >= problem_.fit_begin_s && o.t_s <= problem_.fit_end_s;
    }));
  }

  // An error that is smoothed over less than the time between fixes looks much like one that is not, which no tau_u above zero
  // is; and the one parameter less is worth what the prior of tau_u was narrowed by, a nat or two.
  Attempt of_first_order(Attempt at) {
    constexpr double kWorth = 1.5;
    ReceiverPrior first_order = problem_.prior;
    first_order.tau_u_s = {0.0, 0.0};
    const Chart second_order = std::exchange(chart_, Chart(first_order));
    at.parameters.tau_u_s = 0.0;
    at = tried(at);
    at.cost -= kWorth;
    chart_ = second_order;
    return at;
  }

  // From a start that need not lead anywhere.
  Attempt tried(const Attempt& start) {
    try {
      return settle(start);
    } catch (const NumericalError&) {
      return {};
    }
  }

  // Parameters and latencies in turn, as long as the cost falls: under a poor model of the noise a filter may find latencies that
  // fit worse than those it was linearised about.
  Attempt settle(Attempt at) {
    linearise(at);
    improve(at);
    for (int round = 1; round < kMostRounds && std::isfinite(at.cost); ++round) {
      Attempt next = at;
      if (linearise(next) < kNear_s) return next;
      improve(next);
      if (!(next.cost < at.cost)) break;
      at = next;
    }
    return at;
  }

  // Moves the latencies to where the filter finds them until they stay; returns by how much they moved in all.
  double linearise(Attempt& at) {
    const ReceiverLatency first = at.latency;
    const auto apart = [](const ReceiverLatency& a, const ReceiverLatency& b) {
      return std::max(std::abs(a.position_s - b.position_s), std::abs(a.velocity_s - b.velocity_s));
    };
    constexpr int kMost = 4;
    for (int i = 0; i < kMost; ++i) {
      const FitPasses<tail> passes(problem_, blocks_, left_out_, at.latency);
      count(1);
      const ReceiverLatency next = found_latency<tail>(at.latency, passes.run(at.parameters).end);
      const double moved = apart(next, at.latency);
      at.latency = next;
      if (moved < kNear_s) break;
    }
    return apart(first, at.latency);
  }

  void improve(Attempt& at) {
    const FitPasses<tail> passes(problem_, blocks_, left_out_, at.latency);
    const auto cost = [&](const std::vector<Eigen::VectorXd>& points) {
      std::vector<ReceiverParameters> all;
      all.reserve(points.size());
      for (const Eigen::VectorXd& x : points) all.push_back(chart_.parameters(x));
      std::vector<double> out = costs(passes, all);
      for (std::size_t i = 0; i < out.size(); ++i) out[i] += chart_.prior_cost(points[i]);
      count(static_cast<int>(points.size()));
      return out;
    };
    const QuasiNewtonResult found = minimise(cost, chart_.vector(at.parameters));
    at.parameters = chart_.parameters(found.x);
    at.cost = found.cost;
    at.settled = found.settled;
  }

  // Against the alignment's, of white errors and one latency for both; without the jitter; and with an error of first order where
  // it is of second: models that nobody could rule out by eye.
  double latency_spread(const Attempt& best) {
    const FitPasses<tail> passes(problem_, blocks_, left_out_, best.latency);
    double spread = std::abs(best.latency.position_s - problem_.latency.position_s);
    for (double ReceiverParameters::*left_out : {&ReceiverParameters::jitter_s, &ReceiverParameters::tau_u_s}) {
      if (best.parameters.*left_out == 0.0) continue;
      ReceiverParameters other = best.parameters;
      other.*left_out = 0.0;
      count(1);
      const ReceiverLatency there = found_latency<tail>(best.latency, passes.run(other).end);
      spread = std::max(spread, std::abs(there.position_s - best.latency.position_s));
    }
    return spread;
  }

  const ReceiverProblem& problem_;
  const Progress& progress_;
  Chart chart_;
  SampleBlocks blocks_;
  std::vector<std::size_t> left_out_;
  int evaluations_ = 0;
};

}  // namespace

FilterOptions with_receiver(const ReceiverProblem& problem, const ReceiverParameters& theta) {
  FilterOptions options = problem.filter;
  // A scale on white noise is none on the biases, whose walk stays the sheet's: the two are told apart badly, and a scale below 1
  // would state biases that are too sure.
  options.dynamics.noise.gyro_arw *= theta.gyro_scale;
  options.dynamics.noise.accel_vrw *= theta.accel_scale;
  options.tail = {theta.sigma_c,
                  theta.tau_c_s,
                  theta.tau_u_s,
                  theta.sigma_s_mps,
                  theta.tau_s_s,
                  problem.latency.position_std_s,
                  problem.latency.velocity_std_s,
                  theta.jitter_s,
                  problem.baro_std_m,
                  problem.baro_tau_s,
                  problem.latency_walk};
  return options;
}

FilterOptions with_receiver(const ReceiverProblem& problem, const ReceiverFit& fit) {
  // The flight may move them as far as the part that they were found from leaves open, thrice over.
  constexpr double kLeast_s = 0.005, kOpen = 3.0;
  const auto open = [&](double prior_s, double std_s) { return std::min(prior_s, std::max(kLeast_s, kOpen * std_s)); };
  FilterOptions options = with_receiver(problem, fit.parameters);
  options.tail.latency_std_s = open(options.tail.latency_std_s, fit.latency.position_std_s);
  options.tail.velocity_latency_std_s = open(options.tail.velocity_latency_std_s, fit.latency.velocity_std_s);
  return options;
}

FlightData with_receiver(const ReceiverProblem& problem, const ReceiverParameters& theta,
                         const ReceiverLatency& latency) {
  FlightData data;
  data.samples = problem.data.samples;
  data.l_ba_b = problem.data.l_ba_b;
  data.rest_noise = problem.data.rest_noise;
  data.observations = problem.data.observations;
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    Observation& o = data.observations[i];
    if (o.kind->gate == GateClass::position) {
      o.t_s -= latency.position_s;
      o.R = theta.white_scale * theta.white_scale * o.R + problem.rounding[i];
    } else if (o.kind->gate == GateClass::velocity) {
      o.t_s -= latency.velocity_s;
      o.R = theta.velocity_scale * theta.velocity_scale * o.R + problem.rounding[i];
    } else if (o.kind == &kExternalHeading) {
      o.t_s -= latency.position_s;
    }
  }
  sort_observations(data.imu(), data.observations);
  return data;
}

ReceiverFit fit_receiver(const ReceiverProblem& problem, const Progress& progress) {
  const FilterOptions options = with_receiver(problem, medians(problem.prior));
  if (options.tail.is_long()) return ReceiverSearch<kLongTail>(problem, progress).find();
  return ReceiverSearch<kShortTail>(problem, progress).find();
}

}  // namespace liealign
