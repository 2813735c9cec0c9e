// Filter and smoother sample by sample.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/sample_smoother.hpp"

#include <optional>
#include <utility>

#include "liealign/estimate/filter_steps.hpp"

namespace liealign {
namespace {

// Keeps what the smoother needs; an epoch waits for the updates that may come at its time.
template <typename Model>
struct SampleRecorder : SilentVisitor<Model> {
  static constexpr bool keeps_changes = true;
  struct Held {
    std::size_t k;
    Belief<Model> belief;
  };
  const FlightData& data;
  const SampleFilterSink<Model>& sink;
  std::vector<Checkpoint<Model>> checkpoints;
  std::optional<Held> held;

  SampleRecorder(const FlightData& of, const SampleFilterSink<Model>& to) : data(of), sink(to) {}

  void after(const Belief<Model>& belief, const NavTransition<double>&, std::size_t k, bool whole) {
    flush();
    if (whole && sink.wanted(k)) held = {k, belief};
  }
  void updated(const Observation& o, const Innovation<double>& i) { sink.updated(o, i); }
  void node(std::size_t next, const Belief<Model>& belief, const ImuCursor& cursor, const NodeChanges<Model>& changes) {
    checkpoints.push_back({belief, cursor, changes});
    if (held && data.imu()[held->k].t_s == cursor.t_s) held->belief = belief;
    if (sink.node) sink.node(next);
  }
  void flush() {
    if (held) sink.epoch(held->k, held->belief);
    held.reset();
  }
};

}  // namespace

template <typename Model>
std::vector<Checkpoint<Model>> filter_samples(const FlightData& data, const FilterOptions& options,
                                              const Belief<Model>& belief, const ImuCursor& start,
                                              const SampleFilterSink<Model>& sink) {
  SampleRecorder<Model> recorder(data, sink);
  recorder.checkpoints.push_back({belief, start, {}});
  if (data.imu()[start.k - 1].t_s == start.t_s && sink.wanted(start.k - 1)) recorder.held = {start.k - 1, belief};
  Belief<Model> moving = belief;
  forward_pass(data, options, moving, start, data.imu().back().t_s, recorder);
  recorder.flush();
  return std::move(recorder.checkpoints);
}

template <typename Model>
void smooth_samples(const FlightData& data, const FilterOptions& options,
                    const std::vector<Checkpoint<Model>>& checkpoints, const SampleSmootherSink<Model>& sink,
                    const Progress& progress) {
  smooth(
      Ekf<Model>{options.dynamics, options.covariance_reset}, data, checkpoints, sink.wanted, sink.epoch,
      [&](std::size_t i, const Belief<Model>& smoothed) {
        if (sink.node) sink.node(checkpoints[i], smoothed);
      },
      progress);
}

template std::vector<Checkpoint<LieModel<double>>> filter_samples(const FlightData&, const FilterOptions&,
                                                                  const Belief<LieModel<double>>&, const ImuCursor&,
                                                                  const SampleFilterSink<LieModel<double>>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<LieModel<double>>>&,
                             const SampleSmootherSink<LieModel<double>>&, const Progress&);
template std::vector<Checkpoint<MekfModel>> filter_samples(const FlightData&, const FilterOptions&,
                                                           const Belief<MekfModel>&, const ImuCursor&,
                                                           const SampleFilterSink<MekfModel>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<MekfModel>>&,
                             const SampleSmootherSink<MekfModel>&, const Progress&);
template std::vector<Checkpoint<EulerModel>> filter_samples(const FlightData&, const FilterOptions&,
                                                            const Belief<EulerModel>&, const ImuCursor&,
                                                            const SampleFilterSink<EulerModel>&);
template void smooth_samples(const FlightData&, const FilterOptions&, const std::vector<Checkpoint<EulerModel>>&,
                             const SampleSmootherSink<EulerModel>&, const Progress&);

}  // namespace liealign
