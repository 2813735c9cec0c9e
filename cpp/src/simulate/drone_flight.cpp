// A multirotor survey flight: legs of constant velocity, smoothed three times, with the attitude of (Eq. 44).
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "flight_plan.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {
namespace {

constexpr double kMaxFineSteps = 2e7;                       // some GB; beyond, a slip of the pen
constexpr std::size_t kMargin = 3;                          // samples of rest that two central differences need
enum WindStream : std::uint64_t { kGusts = 101, kWobble };  // those of the sensors are in sensors.cpp

// v_N, v_E, v_D, heading rate, and 1 while airborne.
using Channels = Vector<double, 5>;

// out_k = mean of x_{k-n+1} ... x_k, by differences of the running sum: exactly zero again n samples after x is.
void moving_average(std::vector<Channels>& x, std::size_t n) {
  std::vector<Channels> sum(x.size() + 1, Channels::Zero());
  for (std::size_t k = 0; k < x.size(); ++k) sum[k + 1] = sum[k] + x[k];
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] = (sum[k + 1] - sum[k + 1 - std::min(n, k + 1)]) / static_cast<double>(n);
}

std::vector<Channels> commands(const Plan& plan, std::size_t begin, std::size_t size) {
  std::vector<Channels> x(size, Channels::Zero());
  std::size_t k = begin;
  for (const Leg& leg : plan.legs) {
    for (std::size_t j = 0; j < leg.samples; ++j, ++k) {
      const double angle = leg.course_rate * static_cast<double>(j) * plan.dt;
      const double c = std::cos(angle), s = std::sin(angle);
      x[k] << c * leg.v_n.x() - s * leg.v_n.y(), s * leg.v_n.x() + c * leg.v_n.y(), leg.v_n.z(), leg.yaw_rate, 1.0;
    }
  }
  return x;
}

// Band-limited random signal: sines of random phase, one in each of equal bands of log frequency.
struct Sines {
  static constexpr std::size_t kCount = 6;
  std::array<double, kCount> amplitude{}, omega{}, phase{};

  double operator()(double t) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) sum += amplitude[i] * std::sin(omega[i] * t + phase[i]);
    return sum;
  }
};

// rms of the signal itself (order 0) or of its second derivative (order 2).
Sines make_sines(Random& random, double low_hz, double high_hz, double rms, int order) {
  Sines s;
  for (std::size_t i = 0; i < Sines::kCount; ++i) {
    const double where = (static_cast<double>(i) + random.uniform()) / static_cast<double>(Sines::kCount);
    s.omega[i] = 2.0 * kPi * low_hz * std::pow(high_hz / low_hz, where);
    s.phase[i] = 2.0 * kPi * random.uniform();
    s.amplitude[i] = rms * std::sqrt(2.0 / static_cast<double>(Sines::kCount)) / std::pow(s.omega[i], order);
  }
  return s;
}

std::array<Sines, 3> make_wobble(const DroneFlight& f) {
  Random random(f.seed, kWobble);
  const double rms = f.attitude_wobble_deg * kDegToRad;
  std::array<Sines, 3> wobble;
  for (std::size_t i = 0; i < 3; ++i) wobble[i] = make_sines(random, 0.3, 3.0, i < 2 ? rms : 0.5 * rms, 0);
  return wobble;
}

// Displacement by gusts, so that a flight ends where it began; its velocity is added to the commanded one.
void add_gusts(std::vector<Channels>& x, const DroneFlight& f, double dt) {
  Random random(f.seed, kGusts);
  for (int axis = 0; axis < 3; ++axis) {
    const Sines gust = make_sines(random, 0.15, 1.0, axis < 2 ? f.gust_mps2 : 0.5 * f.gust_mps2, 2);
    std::vector<double> displacement(x.size());
    for (std::size_t k = 0; k < x.size(); ++k) displacement[k] = x[k][4] * gust(static_cast<double>(k) * dt);
    for (std::size_t k = 1; k + 1 < x.size(); ++k)
      x[k][axis] += (displacement[k + 1] - displacement[k - 1]) / (2.0 * dt);
  }
}

// Roll and pitch of (Eq. 44), rad, for the specific force a + c (v - w) - g in NED and a heading.
Vector3d thrust_attitude(const Vector3d& f_n, double heading) {
  const double c = std::cos(heading), s = std::sin(heading);
  const double forward = c * f_n.x() + s * f_n.y(), right = c * f_n.y() - s * f_n.x();
  return {std::atan2(right, std::hypot(forward, f_n.z())), std::atan2(-forward, -f_n.z()), heading};
}

[[noreturn]] void refuse_tilt(double t, double cos_tilt, double max_tilt_deg) {
  throw Error("drone flight: tilt " + std::to_string(t) + " s after the start is " +
              std::to_string(std::acos(cos_tilt) * kRadToDeg) + " deg; expected at most max_tilt_deg = " +
              std::to_string(max_tilt_deg) + "; lower speed_mps, gust_mps2, wind_mps or drag_per_s");
}

// Position by integration, attitude by (Eq. 44), at every fine step.
std::vector<TruthEpoch> fly(const std::vector<Channels>& x, const DroneFlight& f, double rate) {
  const double dt = 1.0 / rate;
  const std::array<Sines, 3> wobble = make_wobble(f);
  const Geodetic pad{f.lat_deg * kDegToRad, f.lon_deg * kDegToRad, f.height_m};
  const Matrix3d C = C_n_e(pad.lat_rad, pad.lon_rad);
  const Vector3d p_pad = ecef_from_geodetic(pad);
  const Vector3d g_n(0.0, 0.0, gravity_e(p_pad, GravityModel::normal).norm());
  const Vector3d parked(f.parked_roll_deg * kDegToRad, f.parked_pitch_deg * kDegToRad, 0.0);
  const double min_cos_tilt = std::cos(f.max_tilt_deg * kDegToRad);
  std::vector<TruthEpoch> epochs(x.size());
  Vector3d p_n = Vector3d::Zero();
  const Vector3d wind_n = -f.wind_mps * direction(f.wind_from_deg * kDegToRad);
  double heading = f.heading_deg * kDegToRad;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Channels& before = x[k == 0 ? 0 : k - 1];
    const Channels& after = x[std::min(k + 1, x.size() - 1)];
    if (k > 0) {
      p_n += 0.5 * dt * (before + x[k]).head<3>();
      heading += 0.5 * dt * (before[3] + x[k][3]);
    }
    const double t = static_cast<double>(k) * dt, airborne = x[k][4];
    const Vector3d v_n = x[k].head<3>();
    const Vector3d a_n = (after - before).head<3>() / (2.0 * dt);
    Vector3d rpy = thrust_attitude(a_n + f.drag_per_s * (v_n - airborne * wind_n) - g_n, heading);
    rpy += airborne * Vector3d(wobble[0](t), wobble[1](t), wobble[2](t)) + (1.0 - airborne) * parked;
    const Matrix3d C_b_n = C_b_n_from_rpy(rpy);
    if (C_b_n(2, 2) < min_cos_tilt) refuse_tilt(t, C_b_n(2, 2), f.max_tilt_deg);
    epochs[k].t_s = f.start_time_s + static_cast<double>(k) / rate;
    epochs[k].X = {C * C_b_n, C * v_n, p_pad + C * p_n};
  }
  return epochs;
}

void check(const DroneFlight& f) {
  const auto require = [](bool good, const char* name, double value, const char* allowed) {
    if (!good)
      throw Error(std::string("drone flight: ") + name + " is " + std::to_string(value) + "; expected " + allowed);
  };
  const auto positive = [&](const char* name, double value) {
    require(value > 0.0 && std::isfinite(value), name, value, "a finite number above 0");
  };
  const auto not_negative = [&](const char* name, double value) {
    require(value >= 0.0 && std::isfinite(value), name, value, "a finite number, 0 or more");
  };
  const auto finite = [&](const char* name, double value) {
    require(std::isfinite(value), name, value, "a finite number");
  };
  finite("lon_deg", f.lon_deg);
  finite("height_m", f.height_m);
  finite("start_time_s", f.start_time_s);
  finite("parked_roll_deg", f.parked_roll_deg);
  finite("parked_pitch_deg", f.parked_pitch_deg);
  finite("heading_deg", f.heading_deg);
  finite("line_bearing_deg", f.line_bearing_deg);
  finite("crab_deg", f.crab_deg);
  finite("nose_follows", f.nose_follows);
  finite("wind_from_deg", f.wind_from_deg);
  finite("helix_climb_mps", f.helix_climb_mps);
  positive("rate_hz", f.rate_hz);
  positive("duration_s", f.duration_s);
  positive("speed_mps", f.speed_mps);
  positive("climb_mps", f.climb_mps);
  positive("descent_mps", f.descent_mps);
  positive("altitude_m", f.altitude_m);
  positive("acceleration_mps2", f.acceleration_mps2);
  positive("line_length_m", f.line_length_m);
  positive("line_spacing_m", f.line_spacing_m);
  not_negative("parked_before_s", f.parked_before_s);
  not_negative("parked_after_s", f.parked_after_s);
  not_negative("circle_radius_m", f.circle_radius_m);
  not_negative("wind_mps", f.wind_mps);
  not_negative("drag_per_s", f.drag_per_s);
  not_negative("gust_mps2", f.gust_mps2);
  not_negative("attitude_wobble_deg", f.attitude_wobble_deg);
  require(f.oversample >= 1, "oversample", f.oversample, "1 or more");
  const double fine_steps = (f.duration_s + f.parked_before_s + f.parked_after_s) * f.rate_hz * f.oversample;
  require(fine_steps <= kMaxFineSteps, "the time times rate_hz times oversample", fine_steps, "at most 2e7");
  require(std::abs(f.lat_deg) <= 90.0, "lat_deg", f.lat_deg, "-90 to 90");
  require(f.max_tilt_deg > 0.0 && f.max_tilt_deg < 80.0, "max_tilt_deg", f.max_tilt_deg, "a number between 0 and 80");
}

}  // namespace

std::vector<TruthEpoch> drone_reference(const DroneFlight& flight) {
  check(flight);
  const double rate = flight.rate_hz * flight.oversample, dt = 1.0 / rate;
  const auto steps = [&](double s) {
    return static_cast<std::size_t>(std::llround(s * flight.rate_hz) * static_cast<long long>(flight.oversample));
  };
  // Box windows 1 : 0.6 : 0.4: the acceleration after a step dv peaks at dv over the longest one.
  const double dv = std::max({std::sqrt(2.0) * flight.speed_mps, flight.climb_mps, flight.descent_mps});
  std::array<std::size_t, 3> windows{};
  double settle = 0.0;  // samples until a command has gone through
  for (std::size_t i = 0; i < windows.size(); ++i) {
    constexpr std::array<double, 3> kShare = {1.0, 0.6, 0.4};
    windows[i] = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::llround(kShare[i] * dv / (flight.acceleration_mps2 * dt))));
    settle += static_cast<double>(windows[i]);
  }
  const std::size_t last = steps(flight.duration_s), begin = steps(flight.parked_before_s) + kMargin;
  const double available = static_cast<double>(last) - static_cast<double>(begin) - settle -
                           static_cast<double>(steps(flight.parked_after_s) + kMargin);
  const Plan plan = fit_plan(flight, dt, available);
  std::vector<Channels> x = commands(plan, begin, last + 1);
  for (const std::size_t n : windows) moving_average(x, n);
  add_gusts(x, flight, dt);
  return fly(x, flight, rate);
}

}  // namespace liealign
