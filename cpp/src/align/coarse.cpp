// The coarse stage, (Eq. 56)-(Eq. 57).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/coarse.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "liealign/align/force_vectors.hpp"
#include "liealign/align/heading_posterior.hpp"
#include "liealign/align/initial.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {
namespace {

constexpr std::size_t kFewest = 12;       // vectors in a window
constexpr double kInformative_rad = 0.5;  // a window whose heading is less certain says nothing
constexpr double kLeastStd_rad = 2.0 * kDegToRad;
constexpr double kCorrelated =
    2.0;  // second differences share fixes: about as many sigmas as independent ones would have

using Unknowns = Vector<double, 9>;  // delta, b_g, b_a of (Eq. 57)
using NormalMatrix = SquareMatrix<double, 9>;

// The fit of one window at one latency.
struct WindowFit {
  Matrix3d R = Matrix3d::Identity();  // n to L at the window's begin
  Vector3d b_g = Vector3d::Zero(), b_a = Vector3d::Zero();
  double scale = std::numeric_limits<double>::infinity();  // of the residuals, m/s^2
  NormalMatrix covariance = NormalMatrix::Zero();
  double modulus = 0.0, excitation = 0.0;
  std::size_t vectors = 0;
};

Matrix3d wahba(const std::vector<ForcePair>& pairs) {
  Matrix3d sum = Matrix3d::Zero();
  Vector3d mean_a = Vector3d::Zero(), mean_b = Vector3d::Zero();
  for (const ForcePair& p : pairs) {
    mean_a += p.alpha / static_cast<double>(pairs.size());
    mean_b += p.beta / static_cast<double>(pairs.size());
  }
  // Gravity would drown the rest: the mean vector and the deviations from it weigh alike.
  double squares = 0.0;
  for (const ForcePair& p : pairs) {
    sum += (p.beta - mean_b) * (p.alpha - mean_a).transpose();
    squares += (p.alpha - mean_a).squaredNorm();
  }
  sum += 4.0 * std::max(squares, 1e-6) / mean_a.squaredNorm() * mean_b * mean_a.transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Residual of (Eq. 57) at the biases found so far.
Vector3d residual_of(const WindowFit& fit, const ForcePair& p) {
  const Vector3d predicted = fit.R * p.alpha;
  return p.beta - predicted + p.beta.cross(p.G * fit.b_g) - p.C * fit.b_a;
}

WindowFit fit_window(const std::vector<ForcePair>& pairs, double gyro_std, double accel_std) {
  WindowFit fit;
  fit.vectors = pairs.size();
  if (pairs.size() < kFewest) return fit;
  fit.R = wahba(pairs);
  constexpr int kRounds = 5;
  constexpr double kHuber = 1.5;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> sizes;
    sizes.reserve(pairs.size());
    for (const ForcePair& p : pairs) sizes.push_back(residual_of(fit, p).norm());
    fit.scale = std::max(median_of(sizes) / 1.54, 1e-3);  // median of the norm of three normal numbers
    NormalMatrix N = NormalMatrix::Zero();
    Unknowns rhs = Unknowns::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ForcePair& p = pairs[i];
      const double weight =
          std::min(1.0, kHuber * fit.scale / std::max(sizes[i] / 1.73, 1e-9)) / (fit.scale * fit.scale);
      Eigen::Matrix<double, 3, 9> J;
      // beta = R alpha + d/d(delta) + ...: exp(delta) R alpha, beta x (-G b_g), C b_a
      J << -hat(Vector3d(fit.R * p.alpha)), -hat(p.beta) * p.G, p.C;
      N += weight * J.transpose() * J;
      rhs += weight * J.transpose() * residual_of(fit, p);
    }
    NormalMatrix prior = NormalMatrix::Zero();
    prior.diagonal() << Vector3d::Zero(), Vector3d::Constant(1.0 / (gyro_std * gyro_std)),
        Vector3d::Constant(1.0 / (accel_std * accel_std));
    Unknowns biases;
    biases << Vector3d::Zero(), fit.b_g, fit.b_a;
    const Eigen::LDLT<NormalMatrix> ldlt(N + prior);
    const Unknowns step = ldlt.solve(rhs - prior * biases);
    fit.R = gamma<0>(Vector3d(step.head<3>())) * fit.R;
    fit.b_g += step.segment<3>(3);
    fit.b_a += step.tail<3>();
    if (round + 1 == kRounds) fit.covariance = kCorrelated * kCorrelated * ldlt.solve(NormalMatrix::Identity());
  }
  double cross = 0.0, a2 = 0.0, b2 = 0.0;
  for (const ForcePair& p : pairs) {
    const Vector3d f_n = fit.R.transpose() * p.beta;
    const double weight = residual_of(fit, p).norm() < 6.0 * fit.scale ? 1.0 : 0.0;
    cross += weight * f_n.head<2>().dot(p.alpha.head<2>());
    a2 += weight * p.alpha.head<2>().squaredNorm();
    b2 += weight * f_n.head<2>().squaredNorm();
  }
  fit.modulus = cross / std::max(std::sqrt(a2 * b2), 1e-9);
  fit.excitation = std::sqrt(a2 / static_cast<double>(pairs.size()));
  return fit;
}

// sigma of the heading: of the rotation about down, seen in L.
double heading_std(const WindowFit& fit) {
  const Vector3d down_L = fit.R.col(2);
  return std::sqrt(down_L.dot(fit.covariance.topLeftCorner<3, 3>() * down_L));
}

struct LaggedWindow {
  double begin_s, end_s;
  std::vector<WindowFit> fits;  // one per latency
  std::vector<double> cost;     // negative log likelihood of the latency, up to a constant
};

// The latencies that are tried.
struct Lags {
  double step_s;
  std::size_t half;

  std::size_t size() const { return 2 * half + 1; }
  double operator[](std::size_t i) const { return (static_cast<double>(i) - static_cast<double>(half)) * step_s; }
};

// Every window of this length, half of it apart, at every latency.
std::vector<LaggedWindow> solve_windows(const ForceVectors& vectors, double begin_s, double end_s, double window_s,
                                        const Lags& lags, double gyro_std, double accel_std) {
  std::vector<LaggedWindow> windows;
  for (double begin = begin_s; windows.empty() || begin + 0.5 * window_s < end_s; begin += 0.5 * window_s) {
    windows.push_back({begin, std::min(begin + window_s, end_s), std::vector<WindowFit>(lags.size()),
                       std::vector<double>(lags.size(), 0.0)});
  }
  const auto n = static_cast<std::ptrdiff_t>(windows.size() * lags.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    LaggedWindow& w = windows[static_cast<std::size_t>(i) / lags.size()];
    const std::size_t j = static_cast<std::size_t>(i) % lags.size();
    const WindowFit fit = w.fits[j] = fit_window(vectors.pairs(w.begin_s, w.end_s, lags[j]), gyro_std, accel_std);
    // Each vector is a residual of three numbers, of which half are independent.
    if (fit.vectors >= kFewest) w.cost[j] = 1.5 / kCorrelated * static_cast<double>(fit.vectors) * std::log(fit.scale);
  }
  return windows;
}

std::vector<double> total_cost(const std::vector<LaggedWindow>& windows) {
  std::vector<double> total(windows.front().cost.size(), 0.0);
  for (const LaggedWindow& w : windows) {
    for (std::size_t j = 0; j < total.size(); ++j) total[j] += w.cost[j];
  }
  return total;
}

std::size_t lowest_cost(const std::vector<double>& cost) {
  return static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
}

// What all windows together say of the gyro bias beyond the one integrated without; their covariance includes the prior.
Vector3d common_gyro_bias(const std::vector<LaggedWindow>& windows, std::size_t lag, double gyro_std) {
  const Matrix3d prior = Matrix3d::Identity() / (gyro_std * gyro_std);
  Matrix3d information = prior;
  Vector3d sum = Vector3d::Zero();
  for (const LaggedWindow& w : windows) {
    const WindowFit& f = w.fits[lag];
    if (f.vectors < kFewest) continue;
    const Matrix3d own = f.covariance.block<3, 3>(3, 3).llt().solve(Matrix3d::Identity());
    information += own;
    sum += own * f.b_g;
  }
  return information.llt().solve(sum);
}

double parabola_peak(double left, double middle, double right) {
  const double bend = left - 2.0 * middle + right;
  return bend > 0.0 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
}

}  // namespace

CoarseAlignment coarse_alignment(const ImuSeries& imu, const std::vector<GnssFix>& fixes, const Vector3d& l_ba_b,
                                 double t_ref_s, double t_end_s, const CoarseOptions& options,
                                 const std::optional<Vector3d>& b_g_rps) {
  CoarseAlignment out;
  out.b_g_rps = b_g_rps.value_or(Vector3d::Zero());
  const double accel_std = options.accel_bias_std_mps2;
  constexpr double kStep_s = 0.05;
  const Lags lags{kStep_s, static_cast<std::size_t>(std::round(options.max_lag_s / kStep_s))};
  double gyro_std = b_g_rps ? options.rest_gyro_bias_std_rps : options.gyro_bias_std_rps;
  if (!b_g_rps) {
    // Short windows first: in them a bias of degrees per second stays of first order.
    for (const double window_s : {0.2 * options.window_s, 0.5 * options.window_s}) {
      const ForceVectors short_ones(imu, fixes, l_ba_b, t_ref_s, t_end_s, out.b_g_rps);
      const Lags few{4.0 * kStep_s, static_cast<std::size_t>(options.max_lag_s / (4.0 * kStep_s))};
      const std::vector<LaggedWindow> found =
          solve_windows(short_ones, t_ref_s, t_end_s, window_s, few, gyro_std, accel_std);
      out.b_g_rps += common_gyro_bias(found, lowest_cost(total_cost(found)), gyro_std);
      gyro_std *= 0.3;
    }
  }
  const ForceVectors vectors(imu, fixes, l_ba_b, t_ref_s, t_end_s, out.b_g_rps);
  const std::vector<LaggedWindow> windows =
      solve_windows(vectors, t_ref_s, t_end_s, options.window_s, lags, gyro_std, accel_std);
  const std::vector<double> total = total_cost(windows);
  const auto refined = [&](const std::vector<double>& cost, std::size_t j, double& std) {
    std = 0.0;
    if (lags.size() == 1) return 0.0;
    if (j == 0 || j + 1 == lags.size()) {
      std = options.max_lag_s;
      return lags[j];
    }
    const double bend = cost[j - 1] - 2.0 * cost[j] + cost[j + 1];
    std = std::max(0.005, kStep_s / std::sqrt(std::max(bend, 1e-3)));
    return lags[j] + kStep_s * parabola_peak(cost[j - 1], cost[j], cost[j + 1]);
  };

  // Heading at t_ref of a window's fit, and its sigma with what the gyros drift by until the window begins.
  const auto at_reference = [&](const LaggedWindow& w, const WindowFit& f, double& std) {
    const Matrix3d C_b_n = f.R.transpose() * gamma<0>(Vector3d(vectors.G_at(w.begin_s) * f.b_g));
    const double drift = std::sqrt(f.covariance.block<3, 3>(3, 3).trace() / 3.0) * (w.begin_s - t_ref_s);
    std = std::hypot(heading_std(f), drift);
    return rpy_from_C_b_n(C_b_n);
  };
  const std::size_t common = lowest_cost(total);
  double common_std = 0.0;
  const double common_latency = refined(total, common, common_std);

  double information = 0.0;
  const auto add_mode = [&](double heading, double std, double latency, double latency_std) {
    const double info = 1.0 / (std * std);
    information += info;
    for (CoarseMode& m : out.modes) {
      const double away = wrap_pi(heading - m.heading_rad);
      const bool same_lag = std::abs(latency - m.latency_s) < std::max(0.1, 2.0 * (latency_std + m.latency_std_s));
      if (!same_lag || std::abs(away) > std::max(3.0 * std::hypot(std, m.heading_std_rad), 10.0 * kDegToRad)) continue;
      const double share = info / (info + m.weight);
      m.heading_rad = wrap_pi(m.heading_rad + share * away);
      m.weight += info;
      m.heading_std_rad = std::max(kLeastStd_rad, 1.0 / std::sqrt(m.weight));
      return;
    }
    out.modes.push_back({wrap_pi(heading), std::max(kLeastStd_rad, std), latency, latency_std, info});
  };
  for (const bool own_latency : {false, true}) {
    for (const LaggedWindow& w : windows) {
      double latency_std = common_std;
      const std::size_t j = own_latency ? lowest_cost(w.cost) : common;
      const WindowFit& f = w.fits[j];
      if (f.vectors < kFewest) continue;
      const double latency = own_latency ? refined(w.cost, j, latency_std) : common_latency;
      double std = 0.0;
      const Vector3d rpy = at_reference(w, f, std);
      if (own_latency) {
        out.windows.push_back({w.begin_s, w.end_s, wrap_pi(rpy[2]), std, latency, f.modulus, f.excitation});
        // a window's own latency counts where it is another one, and certain
        if (std::abs(latency - common_latency) < std::max(0.15, 3.0 * (latency_std + common_std))) continue;
      }
      if (std < kInformative_rad) add_mode(rpy[2], std, latency, latency_std);
    }
  }
  std::stable_sort(out.modes.begin(), out.modes.end(),
                   [](const CoarseMode& a, const CoarseMode& b) { return a.weight > b.weight; });
  for (CoarseMode& m : out.modes) m.weight /= information;
  if (out.modes.size() > 4) out.modes.resize(4);

  const WindowFit& first = windows.front().fits[common];
  if (first.vectors >= kFewest) {
    const Vector3d rpy = rpy_from_C_b_n(first.R.transpose());
    out.roll_rad = rpy[0];
    out.pitch_rad = rpy[1];
    out.tilt_std_rad = std::max(3.0 * kDegToRad, std::sqrt(first.covariance.topLeftCorner<3, 3>().trace()));
    out.tilt_std_rad = std::min(out.tilt_std_rad, 15.0 * kDegToRad);
    out.b_g_rps += first.b_g;
    out.b_g_std_rps = std::sqrt(first.covariance.block<3, 3>(3, 3).trace() / 3.0);
  } else {
    const Vector<double, 2> roll_pitch = level(vectors.mean_force());
    out.roll_rad = roll_pitch[0];
    out.pitch_rad = roll_pitch[1];
    out.tilt_std_rad = 15.0 * kDegToRad;
    out.b_g_std_rps = gyro_std;
  }
  return out;
}

}  // namespace liealign
