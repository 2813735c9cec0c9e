// What a filter does with its observations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/estimate/dynamics.hpp"
#include "liealign/estimate/gating.hpp"
#include "liealign/observe/observation.hpp"

namespace liealign {

struct FilterOptions {
  Dynamics dynamics;
  bool covariance_reset = true;
  Gate gate;  // of positions
  Gate velocity_gate;
  Gate scalar_gate{Outliers::weight, 10.83};  // of observations of one row
  int reacquire_after = 5;                    // positions beyond the gate in a row before the filter yields; 0 = never
  TailModel tail;

  // Null for what no gate rejects.
  const Gate* gate_of(GateClass of) const {
    switch (of) {
      case GateClass::position:
        return &gate;
      case GateClass::velocity:
        return &velocity_gate;
      case GateClass::scalar:
        return &scalar_gate;
      case GateClass::none:
        break;
    }
    return nullptr;
  }
};

// The same options with both gates opened by these factors.
inline FilterOptions with_gates(FilterOptions options, const GateScales& scales) {
  options.gate = scaled(options.gate, scales.position);
  options.velocity_gate = scaled(options.velocity_gate, scales.velocity);
  return options;
}

// The same for a filter whose heading is not settled: a fix that it does not expect may be right. None is rejected, and only
// what lies five times as far as the gates loses weight, lest a gross outlier throws the filter.
inline FilterOptions opened(FilterOptions options) {
  constexpr double kOpen = 25.0;
  options = with_gates(options, {kOpen, kOpen});
  for (Gate* gate : {&options.gate, &options.velocity_gate}) {
    if (gate->outliers == Outliers::reject) gate->outliers = Outliers::weight;
  }
  return options;
}

}  // namespace liealign
