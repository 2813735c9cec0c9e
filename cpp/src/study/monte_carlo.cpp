// Runs of a study, (Eq. 68)-(Eq. 69).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/study/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/parts.hpp"
#include "liealign/estimate/sample_smoother.hpp"
#include "liealign/estimate/solution.hpp"
#include "stopwatch.hpp"

namespace liealign {
namespace {

std::size_t stride(const Truth& truth, double interval_s) {
  const double dt = truth.epochs[1].t_s - truth.epochs[0].t_s;
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(interval_s / dt)));
}

// Which epochs count, and for what.
struct Epochs {
  std::size_t every, nees_every, nees_count;
  std::size_t first_moving = 0, last_moving = 0;

  Epochs(const StudyCase& study, const Truth& truth)
      : every(stride(truth, 1.0 / study.rate_hz)),
        nees_every(stride(truth, study.nees_interval_s)),
        nees_count((truth.epochs.size() - 1) / nees_every) {
    constexpr double kMoving_mps = 0.05;
    const auto moves = [](const TruthEpoch& e) { return e.X.v.norm() > kMoving_mps; };
    const auto& all = truth.epochs;
    first_moving = static_cast<std::size_t>(std::find_if(all.begin(), all.end(), moves) - all.begin());
    last_moving = all.size() - static_cast<std::size_t>(std::find_if(all.rbegin(), all.rend(), moves) - all.rbegin());
  }

  bool wanted(std::size_t k) const { return k % every == 0 || nees(k); }
  bool counted(std::size_t k) const { return k % every == 0; }
  bool flying(std::size_t k) const { return k >= first_moving && k < last_moving; }
  bool nees(std::size_t k) const { return k > 0 && k % nees_every == 0; }
};

struct Reference {
  const Truth& truth;
  const StudySensors& sensors;
  Epochs epochs;

  NavState<double> at(std::size_t k) const {
    NavState<double> X{truth.epochs[k].X, {}};
    X.second.x << sensors.b_a[k], sensors.b_g[k];
    return X;
  }
};

// Units of kStudyChannels.
ChannelValues errors_of(const NavState<double>& X, const NavState<double>& X_true) {
  const LocalFrame local = local_frame(X_true.first.p);
  const auto rpy = [](const SE23<double>& S) { return rpy_from_C_b_n(C_n_e(S.p).transpose() * S.C); };
  const Vector3d angles = rpy(X.first) - rpy(X_true.first);
  const Vector3d p_n = local.C_n_e.transpose() * (X.first.p - X_true.first.p);
  const auto degrees = [](double angle) { return std::remainder(angle, 2.0 * kPi) * kRadToDeg; };
  return {degrees(angles[0]),
          degrees(angles[1]),
          degrees(angles[2]),
          p_n.y(),
          p_n.x(),
          -p_n.z(),
          p_n.norm(),
          (X.first.v - X_true.first.v).norm(),
          (b_a(X) - b_a(X_true)).norm() / kMicroGToMps2,
          (b_g(X) - b_g(X_true)).norm() / kDegPerHourToRadPerSecond};
}

ChannelValues variances_of(double t_s, const Belief<LieModel<double>>& belief) {
  const NavRow row = nav_row(epoch_of(t_s, node_belief<0>(belief, Matrix3d::Zero())));
  const Vector3d rpy = (kRadToDeg * row.std_rpy_rad).cwiseAbs2(), p = row.std_p_n_m.cwiseAbs2();
  const Vector<double, 6> b = belief.P.diagonal().tail<6>();
  return {rpy[0],
          rpy[1],
          rpy[2],
          p[1],
          p[0],
          p[2],
          p.sum(),
          row.std_v_n_mps.squaredNorm(),
          b.head<3>().sum() / (kMicroGToMps2 * kMicroGToMps2),
          b.tail<3>().sum() / (kDegPerHourToRadPerSecond * kDegPerHourToRadPerSecond)};
}

void add(const ChannelValues& errors, const ChannelValues& variances, ErrorSums& sums) {
  for (std::size_t c = 0; c < errors.size(); ++c) {
    sums.squares[c] += errors[c] * errors[c];
    sums.variances[c] += variances[c];
  }
}

// One epoch that counts.
template <typename Model>
void add(const Reference& reference, std::size_t k, const Belief<Model>& belief, StageErrors& stage) {
  const NavState<double> X_true = reference.at(k);
  const ChannelValues errors = errors_of(belief.X, X_true);
  if (!belief.X.first.p.allFinite()) throw NumericalError("the state is not finite");
  if (reference.epochs.counted(k)) {
    const ChannelValues variances = variances_of(reference.truth.epochs[k].t_s, lie_belief(belief));
    add(errors, variances, stage.whole);
    if (reference.epochs.flying(k)) add(errors, variances, stage.flight);
  }
  if (!reference.epochs.nees(k)) return;
  const typename Model::Tangent eps = Model::local(belief.X, X_true);
  const std::size_t at = k / reference.epochs.nees_every - 1;
  stage.nees[at] = eps.dot(belief.P.ldlt().solve(eps));
  std::transform(errors.begin(), errors.end(), stage.squares[at].begin(), [](double e) { return e * e; });
}

// The start itself where it is on a stamp of the IMU, else the stamp after it.
std::size_t first_epoch(const StudyStart& start) {
  const std::size_t k = start.cursor.k;
  return start.data.imu()[k - 1].t_s == start.cursor.t_s ? k - 1 : k;
}

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

template <typename Model>
ModelErrors run_model(const StudyStart& start, const Reference& reference) {
  ModelErrors errors;
  for (StageErrors* stage : {&errors.filter, &errors.smoother}) {
    stage->nees.assign(reference.epochs.nees_count, kAbsent);
    stage->squares.emplace_back().fill(kAbsent);
    stage->squares.resize(reference.epochs.nees_count, stage->squares.front());
  }
  const Stopwatch begin;
  double nis = 0.0;
  std::size_t fixes = 0;
  const auto wanted = [&](std::size_t k) { return reference.epochs.wanted(k); };
  SampleFilterSink<Model> filter;
  filter.wanted = wanted;
  filter.epoch = [&](std::size_t k, const Belief<Model>& b) { add(reference, k, b, errors.filter); };
  filter.updated = [&](const Observation& o, const Innovation<double>& innovation) {
    if (o.kind->gate != GateClass::position) return;
    nis += innovation.nis;
    ++fixes;
  };
  const std::vector<Checkpoint<Model>> checkpoints =
      filter_samples(start.data, start.filter, belief_in<Model>(start.belief), start.cursor, filter);
  errors.mean_nis = nis / static_cast<double>(std::max<std::size_t>(fixes, 1));
  errors.filter_s = begin.seconds();

  const Stopwatch filtered;
  SampleSmootherSink<Model> smoother;
  smoother.wanted = wanted;
  smoother.epoch = [&](std::size_t k, const Belief<Model>& b) { add(reference, k, b, errors.smoother); };
  smooth_samples(start.data, start.filter, checkpoints, smoother);
  errors.smoother_s = filtered.seconds();
  return errors;
}

ModelErrors run_model(const std::string& name, const StudyStart& start, const Reference& reference) {
  try {
    if (name == "mekf") return run_model<MekfModel>(start, reference);
    if (name == "euler") return run_model<EulerModel>(start, reference);
    return run_model<LieModel<double>>(start, reference);
  } catch (const NumericalError& error) {
    ModelErrors failed;
    failed.failure = error.what();
    return failed;
  }
}

RunErrors errors_of_run(const StudyCase& study, const Truth& truth, std::uint64_t seed, bool perfect) {
  const std::vector<std::string> models = perfect ? std::vector<std::string>{"lie"} : study.models;
  RunErrors errors;
  errors.seed = seed;
  StudyRun run;
  const auto fail = [&](const char* why) {
    errors.models.assign(models.size(), {});
    for (ModelErrors& model : errors.models) model.failure = why;
    return errors;
  };
  try {
    run = study_run(study, truth, seed, perfect);
  } catch (const InputError& error) {
    return fail(error.what());
  } catch (const NumericalError& error) {
    return fail(error.what());
  }
  const Reference reference{truth, run.sensors, Epochs(study, truth)};
  errors.simulate_s = run.simulate_s;
  errors.align_s = run.align_s;
  const std::vector<Observation>& observations = run.start.data.observations;
  errors.fixes =
      static_cast<std::size_t>(std::count_if(observations.begin(), observations.end(), [&](const Observation& o) {
        return o.kind->gate == GateClass::position && o.t_s > run.start.cursor.t_s;
      }));
  // As the smoother gives them: from the start to the last observation.
  const double end_s = observations.empty() ? run.start.cursor.t_s : observations.back().t_s;
  for (std::size_t k = first_epoch(run.start); k < truth.epochs.size() && truth.epochs[k].t_s <= end_s; ++k) {
    if (!reference.epochs.counted(k)) continue;
    ++errors.epochs;
    if (reference.epochs.flying(k)) ++errors.flight_epochs;
  }
  for (const std::string& model : models) errors.models.push_back(run_model(model, run.start, reference));
  return errors;
}

}  // namespace

std::vector<double> nees_times(const StudyCase& study, const Truth& truth) {
  const Epochs epochs(study, truth);
  std::vector<double> times;
  for (std::size_t k = 0; k < truth.epochs.size(); ++k) {
    if (epochs.nees(k)) times.push_back(truth.epochs[k].t_s);
  }
  return times;
}

std::vector<RunErrors> run_study(const StudyCase& study, const Truth& truth, std::size_t first, std::size_t count,
                                 const Progress& progress) {
  std::vector<RunErrors> runs(count);
  in_order(
      count, [&](std::size_t i, std::size_t) { runs[i] = errors_of_run(study, truth, study.seed + first + i, false); },
      [&](std::size_t i, std::size_t) {
        if (progress && !progress(i + 1, count)) throw Cancelled("cancelled");
      });
  return runs;
}

RunErrors study_bound(const StudyCase& study, const Truth& truth) {
  RunErrors errors = errors_of_run(study, truth, study.seed, true);
  const std::string& failure = errors.models.front().failure;
  if (!failure.empty()) throw Error("study: the run without errors, for the bound, fails: " + failure);
  return errors;
}

}  // namespace liealign
