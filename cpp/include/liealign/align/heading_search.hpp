// Heading alignment as ask/tell: which candidate filters to run next, and what their scores say.
//
//   phi(psi_0, theta) = -log p(y_1:N | psi_0, theta) + wrap(psi_0 - mu)^2 / (2 sigma_psi^2) - log p(theta)   (Eq. 40)
//
// theta: what the logs leave open, GNSS latency and noise scales; given ones are not searched. In stages:
//   scales   rough noise scales, at the headings that the coarse stage names;
//   latency  where it is unknown, wide candidates on either side of what the coarse stage says of it, then the scales again;
//   circle   wide candidates over the whole circle confirm or find the basins: eight and two harmonics (Eq. 60), or the
//            whole grid where those do not fit;
//   open     conditional candidates (heading variance zero) that use every fix, whatever the heading: the successive
//            quadratic fit in psi_0 alone;
//   gates    where theta is given: how far the gates of the outlier treatment have to open for the noise as it is, by wide
//            candidates with gates from tight to open, of which the first decides that finds its own gates wide enough;
//   fine     from there, with theta (Eq. 58); or, where that is given, with the outlier treatment of the final filter, so that a
//            few bad fixes do not decide. What the score's gradient does over the log says whether sigmas found with theta
//            can be trusted (Eq. 63);
//   start    after each of those fits: what its flight, smoothed, says of its own start; where the tilt differs by more than the
//            first order of the filter carries, the fit is repeated from there, and the whole circle where it differs by far;
//   drift    where the latency is unknown and the flight long enough, the drift of the IMU clock about its middle; fine again
//            with it where it is beyond three of its sigmas, for a drift is applied to the whole log;
//   density  conditional candidates around the minimum and over the circle: interval, modes, mean (Eq. 61). Where one of them
//            lies far below the minimum, which outliers can feign, the fit is made again from there; as it is from the
//            heading of the smoothed start where that is another one.
// Source: TAES IV-E, DRONES (9)-(12), 3.1, 4.2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "liealign/align/candidate.hpp"
#include "liealign/align/heading_posterior.hpp"
#include "liealign/align/quadratic_fit.hpp"
#include "liealign/align/surface_search.hpp"

namespace liealign {

// Where the coarse stage sees a heading, and the latency that goes with it.
struct HeadingSeed {
  double heading_rad = 0.0;
  double heading_std_rad = 0.0;
  double latency_s = 0.0;
};

struct HeadingSearchOptions {
  std::optional<double> guess_rad;  // prior mean mu of (Eq. 40); without it the prior is flat
  double guess_std_rad = 0.0;
  double grid_step_rad = 0.0;
  double grid_std_rad = 0.0;  // heading std of a grid candidate
  double triple_step_rad = 0.0;
  double tolerance_rad = 0.0;
  int max_evaluations = 40;    // conditional candidates of a fit in psi_0 alone
  double max_sigma_rad = 0.0;  // of the verdict "aligned"
  std::vector<HeadingSeed> seeds;
  bool estimate_latency = false;
  bool estimate_imu_noise = false;
  bool estimate_gnss_std = false;
  double span_s = 0.0;        // of the scored flight
  bool has_velocity = false;  // the fixes: then their velocities have a scale of their own
};

// One evaluated candidate of the curve.
struct CurvePoint {
  double heading_rad = 0.0;      // [0, 2 pi)
  double heading_std_rad = 0.0;  // 0 = conditional
  double cost = 0.0;             // (Eq. 40); comparable within wide, open and gated candidates
  bool gated = false;
  FlightParameters parameters;
};

// One sigma of FlightParameters; absent where they were given.
struct FlightParametersStd {
  std::optional<double> latency_s, clock_drift, imu_noise_scale, accel_noise_scale, gnss_std_scale, velocity_std_scale;
};

struct HeadingResult {
  double heading_rad = 0.0;         // psi*, [0, 2 pi)
  std::optional<double> sigma_rad;  // absent when the data say nothing
  bool settled = false;
  std::string verdict;  // aligned | weak | ambiguous | unobservable
  std::string advice;   // one sentence
  FlightParameters parameters;
  FlightParametersStd parameters_std;
  StartCorrection start;  // that the heading was found from
  HeadingPosterior posterior;
  std::vector<FitPoint> triple;   // the three points of the last parabola: heading [rad] about psi*, cost
  std::vector<CurvePoint> curve;  // every candidate, in order of evaluation
  int evaluations = 0;
  GateScales gate_scales;  // for the final filter
  double nis_90 = 0.0;     // of the best candidate's positions

  const std::vector<HeadingMode>& modes() const { return posterior.modes; }
};

class HeadingSearch {
 public:
  explicit HeadingSearch(const HeadingSearchOptions& options);

  // Candidates to evaluate next; empty when done.
  const std::vector<HeadingCandidate>& ask() const { return asked_; }

  // Their scores without prior, in their order.
  void tell(const std::vector<CandidateScore>& scores);

  bool done() const { return stage_ == Stage::done; }

  // Valid when done().
  HeadingResult result() const;

 private:
  enum class Stage { scales, latency, circle, whole_circle, open, gates, fine, smoothed_start, drift, density, done };

  struct Basin {
    double heading_rad, latency_s, cost;
  };

  // What the fit in one basin has come to.
  struct Fit {
    double heading_rad = 0.0;  // not wrapped
    std::optional<double> sigma_rad;
    bool settled = false;
    FlightParameters parameters, slope;  // at psi*, and along the valley per rad of heading
    FlightParametersStd std;
    StartCorrection start;
    std::vector<FitPoint> triple;
    double cost = 0.0, log_volume = 0.0;
    double misfit = 1.0;  // sigmas by blocks of the log over those of the curvature, of the heading
    CandidateScore best;
    GateScales gate_scales;  // that were in force
  };

  static bool is_scale(double FlightParameters::*variable);
  bool joint() const { return !variables_.empty(); }
  void ask_fit();
  void ask_density();
  void tell_scales(const std::vector<double>& costs);
  void tell_latency(const std::vector<double>& costs);
  void tell_circle(const std::vector<double>& costs);
  void tell_fit(const std::vector<double>& costs, const std::vector<CandidateScore>& scores);
  void tell_density(const std::vector<double>& costs);
  void start_whole_circle(const FlightParameters& parameters);
  void start_fit(double heading_rad, const FlightParameters& parameters);
  void ask_gates();
  void tell_gates(const std::vector<CandidateScore>& scores);
  void start_fine();
  void start_surface(double heading_rad, double heading_step_rad);
  void ask_drift();
  void tell_drift(const std::vector<double>& costs);
  FlightParameters drifting(double clock_drift) const;
  void finish_fit(const std::vector<CandidateScore>& scores);
  void start_fit_about(double heading_rad, double step_rad);
  void refit(const Fit& fit, const FlightParameters& parameters);
  bool refit_from_lower(const std::vector<double>& costs);
  bool astray(double turn_rad) const;
  void ask_smoothed_start();
  void tell_smoothed_start(const CandidateScore& score);
  bool joins_a_fit() const;
  bool lies_in_a_fit(double heading_rad) const;
  void next_basin();
  void choose_basins();
  double cost_of(const HeadingCandidate& candidate, double negative_log_likelihood) const;
  HeadingCandidate conditional(double heading_rad, const FlightParameters& parameters) const;
  HeadingCandidate candidate_at(const SurfaceVector& x) const;

  HeadingSearchOptions options_;
  std::vector<double FlightParameters::*> variables_;  // searched besides the heading
  std::vector<HeadingCandidate> asked_;
  std::vector<CurvePoint> curve_;
  FlightParameters start_;  // noise scales to start from
  std::vector<Basin> basins_;
  std::size_t basin_ = 0;
  GateScales gate_scales_;                // in force in this stage
  CandidateScore best_;                   // of this fit: the lowest cost
  FlightParameters base_;                 // of this fit: what its variables are added to
  StartCorrection circle_start_;          // that the circle's candidates begin from
  StartCorrection correction_;            // of this fit
  std::optional<QuadraticSearch> line_;   // in heading alone, not wrapped
  std::optional<SurfaceSearch> surface_;  // in heading and variables_
  std::optional<QuadraticSearch> drift_;
  std::optional<double> drift_std_;
  std::vector<Fit> fits_;
  std::size_t best_fit_ = 0;
  HeadingPosterior posterior_;
  Stage stage_ = Stage::circle;
  int corrections_ = 0;   // how often this fit was corrected
  int lower_refits_ = 0;  // how often a fit was left for what lies lower
  bool latency_scanned_ = false;
};

}  // namespace liealign
