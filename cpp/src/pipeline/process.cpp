// Forward pass and backward pass of a prepared flight.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/process.hpp"

#include <algorithm>
#include <cmath>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/interval_smoother.hpp"
#include "liealign/estimate/output_frame.hpp"
#include "liealign/estimate/parts.hpp"
#include "liealign/estimate/sample_smoother.hpp"
#include "liealign/pipeline/receiver.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign {
namespace {

using Model = LieModel<double>;

double initial_heading_std(const PreparedFlight& flight, const HeadingResult& heading) {
  const double widest = 20.0 * kDegToRad;  // what an error of first order can carry
  double std = std::max(flight.config.initial.heading_std_deg * kDegToRad, 5.0 * heading.sigma_rad.value_or(widest));
  if (flight.config.align.heading_guess_deg) std = std::min(std, flight.config.align.heading_guess_std_deg * kDegToRad);
  return std::min(std, widest);
}

// In the axes of the output: NED for what is in ECEF.
FixUpdate update_record(const Observation& o, const Innovation<double>& innovation) {
  const bool turns = o.kind->axes == ResidualAxes::ecef;
  const Matrix3d C = turns ? Matrix3d(C_n_e(o.place_e).transpose()) : Matrix3d::Identity();
  return {C * innovation.z, (C * innovation.S * C.transpose()).diagonal().cwiseSqrt(), innovation.nis,
          innovation.weight, innovation.verdict};
}

// Which epochs are wanted, of which point: [output].
struct Output {
  const ImuSeries& imu;
  const OutputConfig& config;
  OutputFrame frame;
  double gyro_arw;
  double latency_variance;  // s^2, of an estimated latency; at the start where the clock drifts

  Output(const PreparedFlight& flight, const FilterOptions& filter, double latency_std_s)
      : imu(flight.data.imu()),
        config(flight.config.output),
        frame(output_frame(flight.config)),
        gyro_arw(filter.dynamics.noise.gyro_arw),
        latency_variance(latency_std_s * latency_std_s) {}

  // The number of the step of output.rate_hz that t has reached; the slack is for stamps a rounding below it.
  double step(double t) const { return std::floor(t * *config.rate_hz + 1e-6); }

  bool wanted(std::size_t k) const {
    const double t = imu[k].t_s;
    if (t < config.start_time_s.value_or(t) || t > config.stop_time_s.value_or(t)) return false;
    return !config.rate_hz || k == 0 || step(t) > step(imu[k - 1].t_s);
  }

  // give(epoch) for each sample. Another point's needs the covariances with the biases as well.
  template <typename Give>
  void epochs(const SampleLanes& samples, const InsideInterval& inside, const Give& give) const {
    if (frame.is_imu()) {
      const NavBelief<Lanes> belief = inside.nav_at(samples);
      for (int i = 0; i < samples.count; ++i)
        give(with_latency(epoch_of(imu[samples.k[static_cast<std::size_t>(i)]].t_s, belief, i, inside)));
    } else {
      const WholeBelief<Lanes> all = inside.at(samples);
      for (int i = 0; i < samples.count; ++i) {
        const NavRows<Lanes, 3>& G = all.error.G;
        give(epoch(samples.k[static_cast<std::size_t>(i)],
                   {lane(all.belief, i),
                    {{lane(G.phi, i), lane(G.nu, i), lane(G.rho, i)}, lane(all.error.V, i), lane(all.error.c, i)},
                    inside.root()}));
      }
    }
  }

  Epoch epoch(std::size_t k, const NodeBelief& belief) const {
    if (frame.is_imu()) return with_latency(epoch_of(imu[k].t_s, belief));
    const ImuAtStamp at = imu_at_stamp(imu, k);
    return with_latency(epoch_of(imu[k].t_s, belief, frame, at.omega_ib_b, gyro_arw * gyro_arw / at.white_s));
  }

  // The fixes are where the flight was when the latency says; a wrong one moves the trajectory along itself:
  //   P_rho <- P_rho + sigma_tau^2 u u^T,   u = C^T v_eb_e                                        (Eq. 70)
  Epoch with_latency(Epoch epoch) const {
    const Vector3d u = epoch.X.first.C.transpose() * epoch.X.first.v;
    const Matrix3d along = latency_variance * u * u.transpose();
    epoch.P_rho += along;
    epoch.P_relative += along;
    return epoch;
  }
};

// A trajectory on its way to its sink, in the order of time.
struct Parts {
  const Output& output;
  const EpochSink& sink;
  bool wanted;
  std::vector<std::vector<Epoch>> epochs = std::vector<std::vector<Epoch>>(part_slots());

  void add(std::size_t slot, std::size_t k, const NodeBelief& belief) {
    if (wanted && output.wanted(k)) epochs[slot].push_back(output.epoch(k, belief));
  }
  // Of samples that are wanted.
  void add(std::size_t slot, const SampleLanes& samples, const InsideInterval& inside) {
    output.epochs(samples, inside, [&](const Epoch& epoch) { epochs[slot].push_back(epoch); });
  }
  void make(std::size_t slot) const { sink.make(slot, epochs[slot]); }
  void take(std::size_t slot) {
    sink.take(slot);
    epochs[slot].clear();
  }
  // Of a pass on one thread: a part whenever there is enough of it, and at the end.
  void hand_on(std::size_t at_least) {
    if (!wanted || epochs[0].size() < at_least) return;
    make(0);
    take(0);
  }
};

constexpr std::size_t kPartEpochs = 4096;

// What both ways through the flight share.
struct Run {
  const FlightData& data;
  const FilterOptions& filter;
  const Output& output;
  Parts smoothed, filtered;
  const Progress& progress;
  bool keep_events;
  Solution& solution;

  // Of `of` passes that take about as long, pass number `pass`.
  void report(std::size_t pass, std::size_t of, std::size_t done, std::size_t total) const {
    if (progress && !progress(pass * total + done, of * total)) throw Cancelled("cancelled");
  }

  void record(const Observation& o, const Innovation<double>& innovation) const {
    solution.score.add(filter, o, innovation);
    if (o.kind->gate == GateClass::none) return;
    const FixUpdate update = update_record(o, innovation);
    if (o.kind->gate == GateClass::scalar) {
      solution.others.push_back({o.t_s, o.kind, update});
      return;
    }
    FixRecord& fix = solution.fixes[o.record];
    (o.kind->gate == GateClass::position ? fix.position : fix.velocity) = update;
  }

  // The forward pass is number `pass` of `of`.
  void report_node(std::size_t next, std::size_t of) const {
    const std::size_t n = data.observations.size();
    if (next % (1 + n / 50) == 0) report(0, of, next, n);
  }
};

// By preintegrated intervals, the tail as long as it must be.
template <int tail>
void by_intervals(Run& run, const Belief<LieModel<double, tail>>& belief, const ImuCursor& start) {
  FilterSink filter;
  filter.wanted = [&](std::size_t k) { return run.filtered.wanted && run.output.wanted(k); };
  filter.epoch = [&](std::size_t k, const NodeBelief& b) { run.filtered.add(0, k, b); };
  filter.inside = [&](const SampleLanes& samples, const InsideInterval& inside) {
    run.filtered.add(0, samples, inside);
  };
  filter.updated = [&](const Observation& o, const Innovation<double>& i) { run.record(o, i); };
  filter.node = [&](std::size_t next) {
    run.filtered.hand_on(kPartEpochs);
    run.report_node(next, 3);
  };
  const ForwardRun<tail> forward = run_forward<tail>(run.data, run.filter, belief, start, filter);
  run.filtered.hand_on(0);
  if constexpr (tail > 0) {
    if (run.solution.receiver)
      run.solution.receiver->latency = found_latency<tail>(run.solution.receiver->latency, forward.end.belief);
  }

  struct EpochPair {
    Epoch filtered, smoothed;
  };
  std::vector<std::vector<EpochPair>> pairs(part_slots());
  SmootherSink sink;
  sink.wanted = [&](std::size_t k) { return run.output.wanted(k); };
  sink.epoch = [&](std::size_t slot, std::size_t k, const NodeBelief& b) { run.smoothed.add(slot, k, b); };
  sink.inside = [&](std::size_t slot, const SampleLanes& samples, const InsideInterval& inside) {
    run.smoothed.add(slot, samples, inside);
  };
  sink.node = [&](std::size_t slot, double t_s, const NodeBelief& filtered, const NodeBelief& smoothed) {
    if (run.keep_events) pairs[slot].push_back({epoch_of(t_s, filtered), epoch_of(t_s, smoothed)});
  };
  sink.made = [&](std::size_t slot) { run.smoothed.make(slot); };
  sink.take = [&](std::size_t slot) {
    for (const EpochPair& pair : pairs[slot]) {
      run.solution.filtered_at_events.push_back(pair.filtered);
      run.solution.smoothed_at_events.push_back(pair.smoothed);
    }
    pairs[slot].clear();
    run.smoothed.take(slot);
  };
  // The two passes that are left, in observations of the first.
  const std::size_t n = run.data.observations.size();
  smooth_run<tail>(run.data, run.filter, forward, sink, [&](std::size_t done, std::size_t total) {
    run.report(1, 3, done * 2 * n / total, n);
    return true;
  });
}

// Sample by sample, for what has no closed form over an interval. The smoother goes backwards, so that the whole trajectory is
// held until it is turned round.
template <typename AnyModel>
void by_samples(Run& run, const Belief<AnyModel>& belief, const ImuCursor& start) {
  const auto node_of = [](const Belief<AnyModel>& b) { return node_belief<0>(lie_belief(b), Matrix3d::Zero()); };
  SampleFilterSink<AnyModel> filter;
  filter.wanted = [&](std::size_t k) { return run.filtered.wanted && run.output.wanted(k); };
  filter.epoch = [&](std::size_t k, const Belief<AnyModel>& b) {
    run.filtered.hand_on(kPartEpochs);
    run.filtered.add(0, k, node_of(b));
  };
  filter.updated = [&](const Observation& o, const Innovation<double>& i) { run.record(o, i); };
  filter.node = [&](std::size_t next) { run.report_node(next, 2); };
  const std::vector<Checkpoint<AnyModel>> checkpoints = filter_samples(run.data, run.filter, belief, start, filter);
  run.filtered.hand_on(0);

  SampleSmootherSink<AnyModel> sink;
  sink.wanted = [&](std::size_t k) { return run.output.wanted(k); };
  sink.epoch = [&](std::size_t k, const Belief<AnyModel>& b) { run.smoothed.add(0, k, node_of(b)); };
  sink.node = [&](const Checkpoint<AnyModel>& at, const Belief<AnyModel>& b) {
    if (!run.keep_events) return;
    run.solution.filtered_at_events.push_back(epoch_of(at.cursor.t_s, node_of(at.updated)));
    run.solution.smoothed_at_events.push_back(epoch_of(at.cursor.t_s, node_of(b)));
  };
  smooth_samples(run.data, run.filter, checkpoints, sink, [&](std::size_t done, std::size_t total) {
    run.report(1, 2, done, total);
    return true;
  });
  for (std::vector<Epoch>* epochs :
       {&run.smoothed.epochs.front(), &run.solution.filtered_at_events, &run.solution.smoothed_at_events})
    std::reverse(epochs->begin(), epochs->end());
  run.smoothed.hand_on(0);
}

// The latencies of a clock that drifts, as they are in the middle of the trajectory: there one number says most of the flight.
void quote_in_the_middle(ReceiverLatency& latency, double drift, const TrajectoryDigest& trajectory) {
  const double middle_s = 0.5 * (trajectory.begin_s + trajectory.end_s), change_s = drift * (middle_s - latency.time_s);
  latency.position_s += change_s;
  latency.velocity_s += change_s;
  latency.time_s = middle_s;
}

// Takes note of what passes.
struct DigestOf {
  TrajectoryDigest& digest;
  std::size_t stride;

  void take(const std::vector<Epoch>& epochs) const {
    for (const Epoch& epoch : epochs) {
      if (!epoch.X.first.p.allFinite()) throw NumericalError("the smoothed trajectory is not finite");
      if (digest.epochs == 0) digest.begin_s = epoch.t_s;
      if (digest.epochs++ % stride == 0) digest.sample.push_back(nav_row(epoch));
      digest.end_s = epoch.t_s;
    }
  }
};

}  // namespace

RunStart run_start(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress) {
  const AlignmentProblem& problem = flight.problem;
  const double heading_std_rad = initial_heading_std(flight, heading);
  // A scale on white noise is none on the biases: where the noise is found with the receiver's errors, they stay the sheet's.
  const InitialStd initial =
      models_receiver(flight.config) ? problem.initial : with_parameters(problem.initial, heading.parameters);
  const Belief<Model> belief = start_belief(problem, initial, heading.heading_rad, heading_std_rad, heading.start);
  RunStart run = run_start(flight, heading, belief, cursor_at(flight.data.imu(), flight.t_begin_s), progress);
  run.heading_std_rad = heading_std_rad;
  return run;
}

RunStart run_start(const PreparedFlight& flight, const HeadingResult& heading, const Belief<Model>& belief,
                   const ImuCursor& cursor, const Progress& progress) {
  RunStart run;
  run.belief = belief;
  run.cursor = cursor;
  if (models_receiver(flight.config)) {
    const ReceiverProblem receiver = receiver_problem(flight, heading, flight.filter, run.belief, run.cursor);
    run.receiver = fit_receiver(receiver, progress);
    run.data = with_receiver(receiver, run.receiver->parameters, run.receiver->latency);
    run.filter = with_receiver(receiver, *run.receiver);
    run.wide_position_std_m = receiver.wide_position_std_m;
    return run;
  }
  run.data = with_parameters(flight.data, heading.parameters, flight.problem.t_start_s);
  add_other_observations(flight, flight.latency_s + heading.parameters.latency_s, run.data.observations);
  sort_observations(run.data.imu(), run.data.observations);
  run.filter = with_parameters(with_gates(flight.filter, heading.gate_scales), heading.parameters);
  if (!flight.baro.empty()) {
    run.filter.tail.baro_std_m = flight.config.baro.bias_std_m;
    run.filter.tail.baro_tau_s = flight.config.baro.bias_correlation_time_s;
  }
  return run;
}

void hand_on(const std::vector<Epoch>& epochs, const EpochSink& sink) {
  std::vector<std::vector<Epoch>> parts(part_slots());
  in_order((epochs.size() + kPartEpochs - 1) / kPartEpochs,
           [&](std::size_t part, std::size_t slot) {
             const auto at = [&](std::size_t i) {
               return epochs.begin() + static_cast<std::ptrdiff_t>(std::min(i, epochs.size()));
             };
             parts[slot].assign(at(part * kPartEpochs), at((part + 1) * kPartEpochs));
             sink.make(slot, parts[slot]);
           },
           [&](std::size_t, std::size_t slot) { sink.take(slot); });
}

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const EpochSink& smoothed,
                 const EpochSink& filtered, const Progress& progress, bool keep_events) {
  return process(flight, heading, run_start(flight, heading), smoothed, filtered, progress, keep_events);
}

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const RunStart& begin,
                 const EpochSink& smoothed, const EpochSink& filtered, const Progress& progress, bool keep_events) {
  const FlightData& data = begin.data;
  const FilterOptions& filter = begin.filter;
  const ImuCursor& start = begin.cursor;
  // A latency that is a state of the filter is in its covariance.
  const Output output(flight, filter, begin.receiver ? 0.0 : heading.parameters_std.latency_s.value_or(0.0));
  Solution solution;
  solution.heading_std_initial_rad = begin.heading_std_rad;
  solution.receiver = begin.receiver;
  for (std::size_t i = 0; i < flight.record_use.size(); ++i) {
    solution.fixes.push_back({flight.record_time_s[i], flight.record_use[i], {}, {}});
  }
  for (const Observation& o : data.observations) {
    if (o.kind->gate != GateClass::position) continue;
    solution.fixes[o.record].t_s = o.t_s;
    solution.fixes[o.record].use = RecordUse::update;
  }

  std::size_t wanted = 0;
  for (std::size_t k = start.k - 1; k < data.imu().size(); ++k) wanted += output.wanted(k) ? 1 : 0;
  const DigestOf digest{solution.digest, 1 + wanted / 2000};
  std::vector<const std::vector<Epoch>*> made(part_slots());
  EpochSink noted;
  noted.make = [&](std::size_t slot, const std::vector<Epoch>& epochs) {
    made[slot] = &epochs;
    smoothed.make(slot, epochs);
  };
  noted.take = [&](std::size_t slot) {
    digest.take(*made[slot]);
    smoothed.take(slot);
  };

  Run run{data,     filter,      output,  {output, noted, true}, {output, filtered, flight.config.output.filtered},
          progress, keep_events, solution};
  const std::string& model = flight.config.filter.model;
  if (model == "mekf") {
    by_samples(run, belief_in<MekfModel>(begin.belief), start);
  } else if (model == "euler") {
    by_samples(run, belief_in<EulerModel>(begin.belief), start);
  } else if (filter.dynamics.mechanization != Mechanization::exact) {
    by_samples(run, begin.belief, start);
  } else if (filter.tail.is_empty()) {
    by_intervals<kNoTail>(run, begin.belief, start);
  } else if (filter.tail.is_long()) {
    by_intervals<kLongTail>(run, start_with_tail<kLongTail>(begin.belief, filter.tail, begin.wide_position_std_m),
                            start);
  } else {
    by_intervals<kShortTail>(run, start_with_tail<kShortTail>(begin.belief, filter.tail, begin.wide_position_std_m),
                             start);
  }
  if (solution.receiver)
    quote_in_the_middle(solution.receiver->latency, heading.parameters.clock_drift, solution.digest);
  if (solution.digest.epochs == 0) {
    throw InputError(
        "output.rate_hz leaves no epoch between output.start_time_s and output.stop_time_s; raise it, or drop it");
  }
  return solution;
}

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const RunStart& start,
                 const Progress& progress, bool keep_events) {
  std::vector<Epoch> smoothed, filtered;
  const auto collect_into = [](std::vector<Epoch>& all, std::vector<const std::vector<Epoch>*>& made) {
    return EpochSink{
        [&made](std::size_t slot, const std::vector<Epoch>& epochs) { made[slot] = &epochs; },
        [&made, &all](std::size_t slot) { all.insert(all.end(), made[slot]->begin(), made[slot]->end()); }};
  };
  std::vector<const std::vector<Epoch>*> smoothed_parts(part_slots()), filtered_parts(part_slots());
  Solution solution = process(flight, heading, start, collect_into(smoothed, smoothed_parts),
                              collect_into(filtered, filtered_parts), progress, keep_events);
  solution.smoothed = std::move(smoothed);
  solution.filtered = std::move(filtered);
  return solution;
}

Solution process(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress,
                 bool keep_events) {
  return process(flight, heading, run_start(flight, heading), progress, keep_events);
}

}  // namespace liealign
