// Monte Carlo over the runs of a case: errors of each filter and smoother against the truth, and what they say of them.
//
//   RMSE^2 = sum e^2 / n,   bound^2 = sum sigma^2 / n with sigma along the truth, of sensors without error      (Eq. 68)
//   NEES = eps^T P^-1 eps, eps the error of X_hat in the coordinates of its model: 15 in the mean              (Eq. 69)
//
// The covariance along the truth is the posterior Cramer-Rao bound of the model that the filter has: its noise enters the
// recursion, its measurements do not (Tichavsky, Muravchik & Nehorai 1998). Source: TAES V-D; Bar-Shalom et al. (2001) 5.4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "liealign/core/progress.hpp"
#include "liealign/study/study_case.hpp"

namespace liealign {

// position: of the three together, sqrt(N^2 + E^2 + D^2); velocity and biases likewise.
inline constexpr std::array<const char*, 10> kStudyChannels = {
    "roll_deg",   "pitch_deg",  "heading_deg",  "longitude_m",   "latitude_m",
    "altitude_m", "position_m", "velocity_mps", "accel_bias_ug", "gyro_bias_deg_h"};
using ChannelValues = std::array<double, kStudyChannels.size()>;

// Sums over the epochs of a window, of one estimator.
struct ErrorSums {
  ChannelValues squares{};    // of the errors
  ChannelValues variances{};  // as the estimator states them
};

// whole: every epoch from the start to the last fix. flight: those between the first and the last motion of the truth.
struct StageErrors {
  ErrorSums whole, flight;
  std::vector<double> nees;            // at nees_times(); nan where the run has no epoch
  std::vector<ChannelValues> squares;  // of the errors, at the same times
};

struct ModelErrors {
  StageErrors filter, smoother;
  double mean_nis = 0.0;                    // of the fixes: 3 where the noise is right
  double filter_s = 0.0, smoother_s = 0.0;  // time taken
  std::string failure;                      // why there is nothing else; empty for a run that went through
};

struct RunErrors {
  std::uint64_t seed = 0;
  std::size_t epochs = 0, flight_epochs = 0;
  std::size_t fixes = 0;  // that were updates
  double simulate_s = 0.0, align_s = 0.0;
  std::vector<ModelErrors> models;
};

// Times of the epochs that NEES is taken at, s.
std::vector<double> nees_times(const StudyCase& study, const Truth& truth);

// Runs first ... first + count - 1 of the case. Threads run over the runs; the errors do not depend on their number, nor on
// how the runs are split over calls. Throws Error for a field out of range, Cancelled; a filter that fails, or a start that all
// of them want, is a failure in the ModelErrors.
std::vector<RunErrors> run_study(const StudyCase& study, const Truth& truth, std::size_t first, std::size_t count,
                                 const Progress& progress = {});

// The bound of the Lie model: the variances of a run without errors, in the ErrorSums of its one model. Throws Error when that
// run cannot be made.
RunErrors study_bound(const StudyCase& study, const Truth& truth);

}  // namespace liealign
