// What is known of a receiver before the flight, measured on recordings: docs/gnss-errors.md.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/receiver_fit.hpp"

namespace liealign {

ReceiverPrior receiver_prior(FixClass of, bool has_velocity, bool arrival) {
  ReceiverPrior p;
  p.jitter_s = {arrival ? 0.001 : 0.01, 1.5};
  p.gyro_scale = p.accel_scale = {1.0, 1.5};
  p.tau_u_s = p.sigma_s_mps = {0.0, 0.0};
  p.tau_s_s = {2.0, 0.0};
  p.velocity_scale = {1.0, has_velocity ? 1.5 : 0.0};
  if (of == FixClass::fixed) {
    p.sigma_c = 0.9;
    p.tau_c_s = {60.0, 1.5};
    p.white_scale = {0.5, 1.0};
    return p;
  }
  p.sigma_c = 1.0;
  p.tau_c_s = {100.0, 1.5};
  p.tau_u_s = {1.0, 1.0};
  p.white_scale = {of == FixClass::single ? 0.1 : 0.3, 1.5};
  if (has_velocity) {
    p.sigma_s_mps = {0.1, 1.0};
    p.tau_s_s = {2.0, 0.7};
  }
  return p;
}

}  // namespace liealign
