// The score of a filter: the negative log-likelihood of the fixes it saw, and the RMS of its innovations.
//
//   -log p(y_1:N) = sum_k 1/2 log|S_k| + loss(zeta_k)   (+ const)                              (Eq. 33)
//   P_RMS = sqrt( 1/(N_2 - N_1 + 1) sum_{k=N_1..N_2} |z_k|^2 )                                  (Eq. 34)
//
// Source: TAES (30), DRONES (12) with the bounded loss of (Eq. 26); DRONES 2.3 with its root and its number of terms.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/filter_options.hpp"

namespace liealign {

template <typename Scalar>
struct Score {
  Scalar negative_log_likelihood{0};
  Scalar position_squares{0};  // sum of |z|^2, m^2
  std::size_t positions = 0;
  std::vector<Scalar> position_nis, velocity_nis;

  // `options` has the gates that bound the loss. What no gate rejects is not scored.
  void add(const FilterOptions& options, const Observation& observation, const Innovation<Scalar>& innovation) {
    const Gate* gate = options.gate_of(observation.kind->gate);
    if (gate == nullptr) return;
    negative_log_likelihood += innovation.half_log_det_S + bounded_loss(*gate, innovation.nis);
    if (observation.kind->gate == GateClass::velocity) velocity_nis.push_back(innovation.nis);
    if (observation.kind->gate != GateClass::position) return;
    position_nis.push_back(innovation.nis);
    position_squares += innovation.z.squaredNorm();
    ++positions;
  }

  // The `percent` point of a set of NIS; nan for none.
  static Scalar nis_point(std::vector<Scalar> sorted, std::size_t percent) {
    if (sorted.empty()) return Scalar(std::numeric_limits<double>::quiet_NaN());
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(percent * sorted.size() / 100);
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }

  // 6.25 where the noise model is right.
  Scalar nis_90() const { return nis_point(position_nis, 90); }
  // Of few fixes the point may be an outlier itself: then the gates stay as they are.
  GateScales gate_scales() const { return gate_scales(80, kChiSquare3At80); }
  GateScales gate_scales_of_most() const { return gate_scales(60, kChiSquare3At60); }

  // P_RMS in m; nan without a position.
  Scalar p_rms() const {
    using std::sqrt;
    return sqrt(position_squares / Scalar(static_cast<double>(positions)));
  }

 private:
  GateScales gate_scales(std::size_t percent, double chi_square) const {
    constexpr std::size_t kEnough = 20;
    const auto scale = [&](const std::vector<Scalar>& nis) {
      return nis.size() < kEnough ? 1.0 : gate_scale(static_cast<double>(nis_point(nis, percent)), chi_square);
    };
    return {scale(position_nis), scale(velocity_nis)};
  }
};

}  // namespace liealign
