// IMU log to mean rates with coning and sculling, (Eq. 18).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/prepare_imu.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "liealign/core/error.hpp"

namespace liealign {
namespace {

double median_interval(const ImuSeries& log) {
  std::vector<double> dt(log.size() - 1);
  for (std::size_t k = 1; k < log.size(); ++k) dt[k - 1] = log[k].t_s - log[k - 1].t_s;
  const auto middle = dt.begin() + static_cast<std::ptrdiff_t>(dt.size() / 2);
  std::nth_element(dt.begin(), middle, dt.end());
  return *middle;
}

// Of an increment, the sample at `since` seconds from the one before. The one after a gap is taken over a usual interval,
// since the log lost the others.
void make_rate(ImuSample& s, double since, double median_dt, double max_gap_s) {
  const double dt = since > max_gap_s ? median_dt : since;
  s.omega_ib_b /= dt;
  s.f_ib_b /= dt;
}

// (Eq. 18) for the mean over dt, rate and force having slopes s_w and s_f.
void add_coning_and_sculling(ImuSample& s, double dt, const Vector3d& s_w, const Vector3d& s_f) {
  const ImuSample mean = s;
  const double c = dt * dt / 12.0;
  s.omega_ib_b += c * mean.omega_ib_b.cross(s_w);
  s.f_ib_b += c * (mean.omega_ib_b.cross(s_f) + mean.f_ib_b.cross(s_w));
}

}  // namespace

PreparedImu prepare_imu(ImuSeries log, ImuSampleKind kind, const Matrix3d& C_s_b, double max_gap_s) {
  if (log.size() < 2) throw InputError("the IMU log has fewer than two samples");
  PreparedImu out;
  out.median_dt_s = median_interval(log);
  if (max_gap_s < 1.5 * out.median_dt_s) {
    throw InputError("imu.max_gap_s is " + std::to_string(max_gap_s) + " s, but the IMU log has a sample every " +
                     std::to_string(out.median_dt_s) + " s; expected at least 1.5 times that");
  }
  out.samples = std::move(log);
  const auto in_body_axes = [&](ImuSample& s) {
    s.omega_ib_b = C_s_b * s.omega_ib_b;
    s.f_ib_b = C_s_b * s.f_ib_b;
  };
  ImuSample& first = out.samples[0];
  if (kind == ImuSampleKind::increment) make_rate(first, out.median_dt_s, out.median_dt_s, max_gap_s);
  ImuSample rate_before = first;  // as logged, sensor axes
  ImuSample before = first;       // mean over the interval before, uncorrected, sensor axes
  double before_dt = 0.0;         // 0: no slope can be formed
  in_body_axes(first);
  for (std::size_t k = 1; k < out.samples.size(); ++k) {
    ImuSample& s = out.samples[k];
    const double dt = s.t_s - rate_before.t_s;
    const bool gap = dt > max_gap_s;
    if (gap) out.gaps.push_back({rate_before.t_s, s.t_s});
    if (kind == ImuSampleKind::increment) make_rate(s, dt, out.median_dt_s, max_gap_s);
    const ImuSample rate = s;
    if (kind == ImuSampleKind::instant || gap) {
      s.omega_ib_b = 0.5 * (rate_before.omega_ib_b + rate.omega_ib_b);
      s.f_ib_b = 0.5 * (rate_before.f_ib_b + rate.f_ib_b);
    }
    s.gap_s = gap ? dt : 0.0;
    const ImuSample mean = s;
    // Instants know their own slope; means take it from the middle of the interval before.
    if (kind == ImuSampleKind::instant && !gap) {
      add_coning_and_sculling(s, dt, (rate.omega_ib_b - rate_before.omega_ib_b) / dt,
                              (rate.f_ib_b - rate_before.f_ib_b) / dt);
    } else if (before_dt > 0.0 && !gap) {
      add_coning_and_sculling(s, dt, 2.0 * (mean.omega_ib_b - before.omega_ib_b) / (dt + before_dt),
                              2.0 * (mean.f_ib_b - before.f_ib_b) / (dt + before_dt));
    }
    in_body_axes(s);
    rate_before = rate;
    before = mean;
    before_dt = gap ? 0.0 : dt;
  }
  return out;
}

ImuAtStamp imu_at_stamp(const ImuSeries& imu, std::size_t k) {
  const auto usable = [&](std::size_t i) { return i >= 1 && i < imu.size() && imu[i].gap_s == 0.0; };
  const auto dt = [&](std::size_t i) { return imu[i].t_s - imu[i - 1].t_s; };
  if (!usable(k) || !usable(k + 1)) {  // at the ends and beside a gap: one of them alone
    const std::size_t i = usable(k + 1) ? k + 1 : std::max<std::size_t>(k, 1);
    return {imu[i].omega_ib_b, imu[i].f_ib_b, dt(i)};
  }
  const double w = dt(k) / (dt(k) + dt(k + 1));
  return {(1.0 - w) * imu[k].omega_ib_b + w * imu[k + 1].omega_ib_b, (1.0 - w) * imu[k].f_ib_b + w * imu[k + 1].f_ib_b,
          dt(k) + dt(k + 1)};
}

Matrix3d C_s_b_from_axes(const std::string& axes) {
  Matrix3d C = Matrix3d::Zero();
  for (std::size_t i = 0; i < 3 && i < axes.size(); ++i) {
    const std::string letters = "FBRLDU";
    const std::size_t at = letters.find(axes[i]);
    if (at == std::string::npos) break;
    C(static_cast<Eigen::Index>(at / 2), static_cast<Eigen::Index>(i)) = at % 2 == 0 ? 1.0 : -1.0;
  }
  if (axes.size() != 3 || std::abs(C.col(0).cross(C.col(1)).dot(C.col(2)) - 1.0) > 0.5) {
    throw ConfigError(
        "imu.axes is \"" + axes +
        "\"; expected where x, y, z point: one letter each of F/B, R/L, D/U, right-handed, such as FRD, FLU or RFU");
  }
  return C;
}

}  // namespace liealign
