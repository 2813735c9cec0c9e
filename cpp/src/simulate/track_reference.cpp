// Splines through a track, (Eq. 67), and what a track may be.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/simulate/track_reference.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"

namespace liealign {
namespace {

constexpr double kMaxInterval = 2.0;        // s
constexpr double kMaxPitchDeg = 89.5;       // beyond, Euler angles turn too fast to be interpolated
constexpr double kMaxTurnDeg = 170.0;       // in one interval
constexpr double kMaxAcceleration = 200.0;  // m/s^2; beyond, the points are no flight
constexpr double kMaxTrackSteps = 2e7;      // some GB, as for a drone flight
constexpr double kSampleTolerance = 1e-3;   // of an IMU sample: stamps in files are rounded
constexpr int kRoll = 3, kHeading = 5;      // rows of TrackRow

// Position from the first point, ECEF [m]; roll, pitch, heading [rad].
using TrackRow = Vector<double, 6>;

struct TrackSpline {
  std::vector<double> t_s;  // from the first point
  std::vector<TrackRow> y;  // angles unwrapped
  std::vector<TrackRow> M;  // second derivatives
};

std::string place(const std::vector<TrackPoint>& track, std::size_t i) {
  return "track: point " + std::to_string(i) + " (" + std::to_string(track[i].t_s) + " s): ";
}

void check_points(const std::vector<TrackPoint>& track) {
  if (track.size() < 4)
    throw Error("track: it has " + std::to_string(track.size()) + " points; expected at least 4 for a spline");
  for (std::size_t i = 0; i < track.size(); ++i) {
    const TrackPoint& p = track[i];
    const double sum = p.t_s + p.lat_rad + p.lon_rad + p.height_m + p.rpy_rad.sum();
    if (!std::isfinite(sum)) throw Error(place(track, i) + "a value is not finite; expected time, position and angles");
    if (std::abs(p.lat_rad) > 0.5 * kPi * (1.0 + 1e-12))
      throw Error(place(track, i) + "the latitude is " + std::to_string(p.lat_rad * kRadToDeg) +
                  " deg; expected -90 to 90");
    if (!(p.height_m >= -1000.0 && p.height_m <= 100000.0))
      throw Error(place(track, i) + "the height is " + std::to_string(p.height_m) + " m; expected -1000 to 100000");
    if (std::abs(p.rpy_rad[1]) > kMaxPitchDeg * kDegToRad)
      throw Error(place(track, i) + "the pitch is " + std::to_string(p.rpy_rad[1] * kRadToDeg) +
                  " deg; expected -89.5 to 89.5: Euler angles, which the splines go through, are singular at 90");
    if (i == 0) continue;
    const double interval = p.t_s - track[i - 1].t_s;
    if (!(interval > 0.0))
      throw Error(place(track, i) + "expected a time after that of the point before, " +
                  std::to_string(track[i - 1].t_s) + " s");
    if (interval > kMaxInterval)
      throw Error(place(track, i) + "comes " + std::to_string(interval) +
                  " s after the one before; expected at most 2: what happened in between would be made up; "
                  "give more points or a part of the track");
  }
}

// The angle nearest to the one before, for roll and heading.
double unwrapped(const std::vector<TrackPoint>& track, std::size_t i, int row, double before) {
  const double turn = std::remainder(track[i].rpy_rad[row - kRoll] - before, 2.0 * kPi);
  if (std::abs(turn) > kMaxTurnDeg * kDegToRad)
    throw Error(place(track, i) + (row == kRoll ? "the roll" : "the heading") + " has changed by " +
                std::to_string(std::abs(turn) * kRadToDeg) +
                " deg since the point before; expected at most 170: the track is too coarse to tell which way, "
                "or passes the vertical; give more points");
  return before + turn;
}

// Second derivatives by elimination. The system is diagonally dominant.
std::vector<TrackRow> second_derivatives(const std::vector<double>& t_s, const std::vector<TrackRow>& y) {
  const std::size_t last = y.size() - 1;
  std::vector<TrackRow> M(y.size());
  std::vector<double> upper(y.size(), 0.0);
  M[0].setZero();
  for (std::size_t i = 1; i < last; ++i) {
    const double h_before = t_s[i] - t_s[i - 1], h = t_s[i + 1] - t_s[i];
    double diagonal = 2.0 * (h_before + h);
    if (i == 1) diagonal += h_before;  // M_0 = M_1
    if (i + 1 == last) diagonal += h;  // M_N = M_{N-1}
    const double lower = i == 1 ? 0.0 : h_before;
    const double pivot = diagonal - lower * upper[i - 1];
    const TrackRow bend = 6.0 * ((y[i + 1] - y[i]) / h - (y[i] - y[i - 1]) / h_before);
    upper[i] = h / pivot;
    M[i] = (bend - lower * M[i - 1]) / pivot;
  }
  for (std::size_t i = last - 1; i-- > 1;) M[i] -= upper[i] * M[i + 1];
  M[0] = M[1];
  M[last] = M[last - 1];
  return M;
}

// Between the points it is between theirs.
void check_acceleration(const std::vector<TrackPoint>& track, const TrackSpline& spline) {
  std::size_t worst = 0;
  double largest = 0.0;
  for (std::size_t i = 0; i < track.size(); ++i) {
    const double a = spline.M[i].head<3>().norm();
    if (a <= largest) continue;
    largest = std::isfinite(a) ? a : std::numeric_limits<double>::infinity();
    worst = i;
  }
  if (largest > kMaxAcceleration)
    throw Error(place(track, worst) + "the way through the points takes " + std::to_string(largest) +
                " m/s^2; expected at most 200: the points jump, or are rounded too much for being this close; "
                "smooth them or take fewer of them");
}

TrackSpline make_spline(const std::vector<TrackPoint>& track, const Vector3d& origin) {
  TrackSpline spline;
  spline.t_s.reserve(track.size());
  spline.y.reserve(track.size());
  for (std::size_t i = 0; i < track.size(); ++i) {
    const TrackPoint& p = track[i];
    TrackRow row;
    row << ecef_from_geodetic({p.lat_rad, p.lon_rad, p.height_m}) - origin, p.rpy_rad;
    if (i > 0) {
      for (const int angle : {kRoll, kHeading}) row[angle] = unwrapped(track, i, angle, spline.y.back()[angle]);
    }
    spline.t_s.push_back(p.t_s - track.front().t_s);
    spline.y.push_back(row);
  }
  spline.M = second_derivatives(spline.t_s, spline.y);
  check_acceleration(track, spline);
  return spline;
}

// (Eq. 67) in the interval i at t_s from the first point.
SE23<double> on_spline(const TrackSpline& spline, std::size_t i, double t_s, const Vector3d& origin) {
  const double s = t_s - spline.t_s[i], h = spline.t_s[i + 1] - spline.t_s[i];
  const TrackRow &y = spline.y[i], &M = spline.M[i], &M_after = spline.M[i + 1];
  const TrackRow b = (spline.y[i + 1] - y) / h - (h / 6.0) * (2.0 * M + M_after);
  const TrackRow jerk = (M_after - M) / h;
  const TrackRow at = y + s * (b + s * (0.5 * M + (s / 6.0) * jerk));
  const Vector3d v_eb_e = (b + s * (M + (0.5 * s) * jerk)).head<3>();
  const Vector3d p_eb_e = origin + at.head<3>();
  return {C_n_e(p_eb_e) * C_b_n_from_rpy(at.tail<3>()), v_eb_e, p_eb_e};
}

// Fine steps on the track: a multiple of oversample.
std::size_t track_steps(double duration_s, double rate_hz, int oversample) {
  if (!(rate_hz >= 1.0 && rate_hz <= 10000.0))
    throw Error("simulate: rate_hz is " + std::to_string(rate_hz) + "; expected 1 to 10000 [Hz]");
  if (oversample < 1) throw Error("simulate: oversample is " + std::to_string(oversample) + "; expected 1 or more");
  const double samples = std::floor(duration_s * rate_hz + kSampleTolerance);
  if (samples < 1.0)
    throw Error("track: it is " + std::to_string(duration_s) + " s long; expected at least one sample of the IMU at " +
                std::to_string(rate_hz) + " Hz");
  if (samples * oversample > kMaxTrackSteps)
    throw Error("track: " + std::to_string(duration_s) +
                " s times rate_hz times oversample make more than 2e7 steps; take a part of the track or a lower rate");
  return static_cast<std::size_t>(samples) * static_cast<std::size_t>(oversample);
}

}  // namespace

std::vector<TruthEpoch> track_reference(const std::vector<TrackPoint>& track, double rate_hz, int oversample) {
  check_points(track);
  const double begin_s = track.front().t_s, fine_rate = rate_hz * oversample;
  const std::size_t steps = track_steps(track.back().t_s - begin_s, rate_hz, oversample);
  const TrackPoint& first = track.front();
  const Vector3d origin = ecef_from_geodetic({first.lat_rad, first.lon_rad, first.height_m});
  const TrackSpline spline = make_spline(track, origin);
  std::vector<TruthEpoch> reference(steps + 1);
  std::size_t i = 0;
  for (std::size_t k = 0; k <= steps; ++k) {
    // The spline at the stamp as it is rounded: a large time costs even steps, no truth.
    const double stamp_s = begin_s + static_cast<double>(k) / fine_rate, t_s = stamp_s - begin_s;
    while (i + 2 < track.size() && t_s >= spline.t_s[i + 1]) ++i;
    reference[k] = {stamp_s, on_spline(spline, i, t_s, origin)};
  }
  return reference;
}

Truth track_truth(const std::vector<TrackPoint>& track, double rate_hz, int oversample, Mechanization kind,
                  GravityModel model) {
  return truth_from_reference(track_reference(track, rate_hz, oversample), kind, model, oversample);
}

}  // namespace liealign
