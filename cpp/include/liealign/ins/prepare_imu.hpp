// From a log to the samples the mechanization takes: mean rates with coning and sculling corrections, body axes.
//
// With the rate linear over two samples, the constant rate that gives the same rotation as the true one is
//   w' = w + dt^2/12 (w x s_w),   f' = f + dt^2/12 (w x s_f + f x s_w)                          (Eq. 18)
// s the slope between the middles of this sample and the one before. With equal steps these are Savage's two-sample
// terms 1/12 dtheta_{k-1} x dtheta_k. Source: Savage (1998); Groves (2013) 5.5.4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/ins/imu.hpp"

namespace liealign {

// An interval without samples, longer than the limit.
struct ImuGap {
  double begin_s = 0.0;
  double end_s = 0.0;
};

struct PreparedImu {
  ImuSeries samples;  // [0] only marks the start: sample k holds over (samples[k-1].t_s, samples[k].t_s]
  std::vector<ImuGap> gaps;
  double median_dt_s = 0.0;
};

// C_s_b turns the sensor's axes into body axes. A gap longer than max_gap_s [s] is bridged by the mean of its two
// neighbours (the filter adds noise there). Throws InputError for fewer than two samples. A log that is moved in becomes
// the samples: none of it is copied.
PreparedImu prepare_imu(ImuSeries log, ImuSampleKind kind, const Matrix3d& C_s_b, double max_gap_s);

// Rate and specific force at the stamp of sample k of a prepared series: between the means before and after it, on the
// line through their middles. `white_s` is the time over which their white noise averages: variance = N^2 / white_s.
struct ImuAtStamp {
  Vector3d omega_ib_b, f_ib_b;
  double white_s;
};
ImuAtStamp imu_at_stamp(const ImuSeries& imu, std::size_t k);

// C_s_b of an axis declaration: where the sensor's x, y, z point, letters of F B R L D U ("FRD" is the identity).
// Throws ConfigError when the letters are not a right-handed set.
Matrix3d C_s_b_from_axes(const std::string& axes);

}  // namespace liealign
