// What every observation is to the filter: a time, a few numbers, and a kind that knows what they mean.
//
// A kind is one file of this folder and one line of kinds.cpp. It says what it expects to see (z = y - h(X)), how that changes
// with the left error (H, and H_tail by the tail), and how well it sees (R): the forward pass, the bank, the smoother and the
// records ask no more.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include "liealign/core/lanes.hpp"
#include "liealign/ins/nav_state.hpp"
#include "liealign/observe/tail.hpp"

namespace liealign {

// What a kind may look at: the state, what the IMU reads at the time, and what its noise is.
template <typename Scalar>
struct StateView {
  const SE23<Scalar>& X;
  Vector3<Scalar> omega_ib_b, f_ib_b;  // less the biases; rad/s, m/s^2
  Vector3<Scalar> b_g;                 // rad/s
  TailVector<Scalar> tail;             // zero where there is none
  bool has_tail = false;               // else nobody looks at H_tail
  double gyro_arw = 0.0;               // rad/sqrt(s)
  double jitter_variance = 0.0;        // s^2; of a message whose jitter is no longer a state
};

// The most components of an observation. One with fewer leaves the rest as they are: they say nothing.
inline constexpr int kMostRows = 3;

// What an observation says of the error: y - h(X exp(eps)) = z - H eps - H_tail tail, with noise of covariance R.
template <typename Scalar>
struct Sighting {
  Vector3<Scalar> z = Vector3<Scalar>::Zero();
  Eigen::Matrix<Scalar, kMostRows, kTail> H = Eigen::Matrix<Scalar, kMostRows, kTail>::Zero();
  Eigen::Matrix<Scalar, kMostRows, kLongTail> H_tail = Eigen::Matrix<Scalar, kMostRows, kLongTail>::Zero();
  Matrix3<Scalar> R = Matrix3<Scalar>::Identity();
};

struct Observation;

// Which gate an observation passes.
enum class GateClass { none, position, velocity, scalar };

// The axes of a residual; records are turned to NED from ECEF.
enum class ResidualAxes { ecef, body, own };

struct ObservationKind {
  std::string_view name;  // in records and in the names of files
  int rows;
  GateClass gate;
  ResidualAxes axes;
  // Which of the blocks (phi, nu, rho, b_a, b_g) of the error H has columns for where there is no tail, one bit each; the
  // others are zero for good.
  unsigned blocks;
  bool has_jitter;        // its stamp is that of a message
  std::string_view unit;  // of its residuals in files, and how many of it make one of the kind's own
  double in_unit;
  void (*see)(const StateView<double>&, const Observation&, Sighting<double>&);
  void (*see_lanes)(const StateView<Lanes>&, const Observation&, Sighting<Lanes>&);
};

// The bits of ObservationKind::blocks.
inline constexpr unsigned kSeesPhi = 1, kSeesNu = 2, kSeesRho = 4, kSeesBa = 8, kSeesBg = 16;

struct Observation {
  double t_s = 0.0;  // true time, by the nominal latency of its stream
  const ObservationKind* kind = nullptr;
  std::size_t record = 0;         // of the log it came from; of one message where several kinds share it
  Vector3d y = Vector3d::Zero();  // as measured, in the units of the kind
  Matrix3d R = Matrix3d::Zero();  // covariance of its white part, that of its rounding in it
  Matrix3d root =
      Matrix3d::Zero();  // what a correlated error is multiplied by: for positions C_n_e times the root of the
                         // covariance that the file states, for velocities C_n_e; of zero rates what is
                         // added to their noise, rad/s
  Vector3d lever_b = Vector3d::Zero();  // from the IMU to where it is seen, or the direction of a baseline
  Vector3d place_e = Vector3d::Zero();  // about where, for local axes; m
  double span_s = 0.0;                  // what it is the mean over
  bool new_datum = false;               // the receiver's error starts anew
};

// The table entry of a kind. A kind that is written for one number at a time goes through the lanes one by one.
template <typename Kind>
void see_lane_by_lane(const StateView<Lanes>& view, const Observation& observation, Sighting<Lanes>& out) {
  for (int i = 0; i < Lanes::kCount; ++i) {
    const SE23<double> X{lane(view.X.C, i), lane(view.X.v, i), lane(view.X.p, i)};
    const StateView<double> one{X,
                                lane(view.omega_ib_b, i),
                                lane(view.f_ib_b, i),
                                lane(view.b_g, i),
                                lane(view.tail, i),
                                view.has_tail,
                                view.gyro_arw,
                                view.jitter_variance};
    Sighting<double> seen;
    Kind::see(one, observation, seen);
    set_lane(out.z, i, seen.z);
    set_lane(out.H, i, seen.H);
    set_lane(out.H_tail, i, seen.H_tail);
    set_lane(out.R, i, seen.R);
  }
}

// A template Kind::see<Scalar> is taken for both scalars; a plain one for doubles.
template <typename Kind>
constexpr ObservationKind kind_of() {
  ObservationKind kind{Kind::kName,      Kind::kRows, Kind::kGate, Kind::kAxes, Kind::kBlocks,
                       Kind::kHasJitter, "",          1.0,         nullptr,     nullptr};
  if constexpr (requires { Kind::kUnit; }) {
    kind.unit = Kind::kUnit;
    kind.in_unit = Kind::kInUnit;
  }
  if constexpr (requires { &Kind::template see<Lanes>; }) {
    kind.see = &Kind::template see<double>;
    kind.see_lanes = &Kind::template see<Lanes>;
  } else {
    kind.see = &Kind::see;
    kind.see_lanes = &see_lane_by_lane<Kind>;
  }
  return kind;
}

inline void see(const StateView<double>& view, const Observation& o, Sighting<double>& out) {
  o.kind->see(view, o, out);
}
inline void see(const StateView<Lanes>& view, const Observation& o, Sighting<Lanes>& out) {
  o.kind->see_lanes(view, o, out);
}

}  // namespace liealign
