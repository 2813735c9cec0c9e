// The pipeline of TAES Fig. 5 after the alignment: filter, then smoother, from the aligned heading.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "liealign/align/heading_search.hpp"
#include "liealign/align/receiver_fit.hpp"
#include "liealign/core/progress.hpp"
#include "liealign/estimate/score.hpp"
#include "liealign/estimate/solution.hpp"
#include "liealign/pipeline/flight.hpp"

namespace liealign {

// One update by a fix, NED.
struct FixUpdate {
  Vector3d residual_n = Vector3d::Zero();  // m or m/s
  Vector3d std_n = Vector3d::Zero();       // root of the diagonal of S
  double nis = 0.0;
  double weight = 0.0;
  Verdict verdict = Verdict::used;
};

// An update by another kind of observation than a fix's position or velocity; residual and std in the kind's own units.
struct UpdateRecord {
  double t_s = 0.0;
  const ObservationKind* kind = nullptr;
  FixUpdate update;
};

// What became of a GNSS record.
struct FixRecord {
  double t_s = 0.0;  // true time
  RecordUse use = RecordUse::update;
  std::optional<FixUpdate> position, velocity;
};

// What the summary says of the smoothed trajectory as a whole.
struct TrajectoryDigest {
  std::size_t epochs = 0;
  double begin_s = 0.0, end_s = 0.0;
  std::vector<NavRow> sample;  // some 2000 of its epochs: a median needs no more
};

// Where the epochs of a trajectory go, in parts: make() by several threads, each part in a slot of its own [0, part_slots())
// until take(), one at a time in order of time.
struct EpochSink {
  std::function<void(std::size_t slot, const std::vector<Epoch>& epochs)> make;
  std::function<void(std::size_t slot)> take;
};

// Trajectories are those of the point and the axes that [output] names, at the epochs that it names.
struct Solution {
  std::vector<Epoch> smoothed;   // at IMU stamps from the first rest to the last event; empty where a sink took them
  std::vector<Epoch> filtered;   // the same from the forward pass alone; empty unless output.filtered
  TrajectoryDigest digest;       // of smoothed
  std::vector<FixRecord> fixes;  // one per GNSS record
  std::vector<UpdateRecord> others;  // of other kinds that a gate may reject, in the order of time
  // Of the IMU, where something was observed, after the updates there; empty unless asked for.
  std::vector<Epoch> filtered_at_events, smoothed_at_events;
  Score<double> score;                  // of the forward pass
  std::optional<ReceiverFit> receiver;  // with the latencies of the whole flight; where its errors are modelled
  double heading_std_initial_rad = 0.0;
};

// Where the final run begins, and with what options.
struct RunStart {
  FlightData data;
  FilterOptions filter;  // its tail says how long that of the run is
  Belief<LieModel<double>> belief;
  ImuCursor cursor;
  double heading_std_rad = 0.0;
  std::optional<ReceiverFit> receiver;
  double wide_position_std_m = 0.0;
};

// From psi* of the alignment. The heading's initial standard deviation is at least five times the alignment's, so that the
// flight, which the alignment has already used, is not counted twice (its share in the posterior information is below 4 % up to
// a sigma of 4 deg; the first order of the error allows 20 deg at most); a typed-in prior with a smaller one is kept.
// Where the receiver's errors are modelled they are found here, and the noise of the IMU with them.
RunStart run_start(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress = {});

// The same from a belief that holds at `cursor`.
RunStart run_start(const PreparedFlight& flight, const HeadingResult& heading, const Belief<LieModel<double>>& belief,
                   const ImuCursor& cursor, const Progress& progress = {});

// Filter and smoother from run_start().
// Throws InputError when output.start_time_s and stop_time_s leave no epoch.
Solution process(const PreparedFlight& flight, const HeadingResult& heading, const Progress& progress = {},
                 bool keep_events = false);

// The same from another start.
Solution process(const PreparedFlight& flight, const HeadingResult& heading, const RunStart& start,
                 const Progress& progress = {}, bool keep_events = false);

// Hands a trajectory that is held in memory to a sink.
void hand_on(const std::vector<Epoch>& epochs, const EpochSink& sink);

// process() with the trajectories handed on as they are made: memory does not grow with their length.
Solution process(const PreparedFlight& flight, const HeadingResult& heading, const EpochSink& smoothed,
                 const EpochSink& filtered, const Progress& progress = {}, bool keep_events = false);
Solution process(const PreparedFlight& flight, const HeadingResult& heading, const RunStart& begin,
                 const EpochSink& smoothed, const EpochSink& filtered, const Progress& progress = {},
                 bool keep_events = false);

}  // namespace liealign
