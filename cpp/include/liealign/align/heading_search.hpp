// Heading alignment as ask/tell: which candidate filters to run next, and what their scores say.
//
//   phi(psi_0) = -log p(y_1:N | psi_0) + wrap(psi_0 - mu)^2 / (2 sigma_psi^2)                   (Eq. 40)
//
// Wide candidates first: over the whole circle to find the basin, or one at the guess; they also show by how much the fixes
// disagree with the noise model (gate scales). Then three conditional candidates (heading variance zero) and the successive
// quadratic fit place the minimum and its sigma: first with filters that use every fix, whatever the heading; then, from
// there, with the outlier treatment of the final filter, so that a few bad fixes do not decide.
// Source: TAES IV-E, DRONES (9)-(12), 3.1.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "liealign/align/candidates.hpp"
#include "liealign/align/quadratic_fit.hpp"

namespace liealign {

struct HeadingSearchOptions {
  std::optional<double> guess_rad;  // prior mean mu of (Eq. 40); without it the prior is flat
  double guess_std_rad = 0.0;
  double grid_step_rad = 0.0;
  double grid_std_rad = 0.0;  // heading std of a grid candidate
  double triple_step_rad = 0.0;
  double tolerance_rad = 0.0;
  int max_evaluations = 40;    // conditional candidates
  double max_sigma_rad = 0.0;  // of the verdict "aligned"
};

// One evaluated candidate of the curve.
struct CurvePoint {
  double heading_rad = 0.0;      // [0, 2 pi)
  double heading_std_rad = 0.0;  // 0 = conditional
  double cost = 0.0;             // (Eq. 40); comparable within wide, open and gated candidates
  bool gated = false;
};

struct HeadingMode {
  double heading_rad = 0.0;
  double mass = 0.0;  // share of the posterior, from the wide candidates
};

struct HeadingResult {
  double heading_rad = 0.0;         // psi*, [0, 2 pi)
  std::optional<double> sigma_rad;  // absent when the data say nothing
  bool settled = false;
  std::string verdict;  // aligned | weak | ambiguous | unobservable
  std::string advice;   // one sentence
  std::vector<HeadingMode> modes;
  std::vector<CurvePoint> curve;  // every candidate, in order of evaluation
  int evaluations = 0;
  GateScales gate_scales;  // for the final filter
  double nis_90 = 0.0;     // of the best candidate's positions
};

class HeadingSearch {
 public:
  explicit HeadingSearch(const HeadingSearchOptions& options) : options_(options) {}

  // Candidates to evaluate next; empty when done.
  std::vector<HeadingCandidate> ask() const;

  // Their scores without prior, in their order.
  void tell(const std::vector<CandidateScore>& scores);

  bool done() const { return stage_ == Stage::gated && conditional_->done(); }

  // Valid when done().
  HeadingResult result() const;

 private:
  enum class Stage { wide, open, gated };

  void tell_wide(const std::vector<CandidateScore>& scores);
  void start_gated();
  double prior(double heading_rad) const;

  HeadingSearchOptions options_;
  Stage stage_ = Stage::wide;
  CandidateScore best_;     // of this stage: the lowest cost
  GateScales gate_scales_;  // in force in this stage
  std::vector<HeadingMode> modes_;
  std::vector<CurvePoint> curve_;
  std::optional<QuadraticSearch> conditional_;  // in heading, unwrapped about its centre
};

// Angle in (-pi, pi] and in [0, 2 pi).
double wrap_pi(double angle_rad);
double wrap_2pi(double angle_rad);

}  // namespace liealign
