// A multirotor survey flight: legs of constant velocity, smoothed three times, with the attitude of (Eq. 44).
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {
namespace {

constexpr double kPeakAcceleration = 4.0;                   // m/s^2, of the commanded motion on the straight
constexpr double kCircleAcceleration = 2.5;                 // m/s^2
constexpr double kMaxFineSteps = 2e7;                       // some GB; beyond, a slip of the pen
constexpr std::size_t kMargin = 3;                          // samples of rest that two central differences need
enum WindStream : std::uint64_t { kGusts = 101, kWobble };  // those of the sensors are in sensors.cpp

// Commanded velocity (NED of the pad) turning at course_rate, and the rate of the heading.
struct Leg {
  std::size_t samples = 0;
  Vector3d v_n = Vector3d::Zero();
  double course_rate = 0.0;
  double yaw_rate = 0.0;
};

struct Plan {
  double dt = 0.0;
  std::vector<Leg> legs;
  Vector3d position = Vector3d::Zero();  // at the end of the last leg
  double heading = 0.0;
  std::size_t spare_leg = 0;  // the hover that takes the time left over

  std::size_t samples() const {
    std::size_t sum = 0;
    for (const Leg& leg : legs) sum += leg.samples;
    return sum;
  }
};

// How much of the flight is flown, from all of it to the least.
struct Extent {
  int min_lines;
  double line_scale;
  int circles;
  double hover_s;
  double transit_m;
};
constexpr std::array<Extent, 5> kExtents = {{{4, 1.0, 2, 10.0, 40.0},
                                             {2, 1.0, 1, 8.0, 30.0},
                                             {2, 1.0, 0, 5.0, 15.0},
                                             {2, 0.5, 0, 3.0, 10.0},
                                             {1, 0.25, 0, 1.0, 0.0}}};

Vector3d direction(double course) { return {std::cos(course), std::sin(course), 0.0}; }

double shortest_turn(double from, double to) { return std::remainder(to - from, 2.0 * kPi); }

void fly_to(Plan& plan, const Vector3d& target, double speed, double turn = 0.0) {
  const Vector3d way = target - plan.position;
  const auto samples = static_cast<std::size_t>(std::ceil(way.norm() / (speed * plan.dt) - 1e-9));
  if (samples == 0) return;
  const double duration = static_cast<double>(samples) * plan.dt;
  plan.legs.push_back({samples, way / duration, 0.0, turn / duration});
  plan.position = target;
  plan.heading += turn;
}

void hover(Plan& plan, double duration, double turn = 0.0) {
  const auto samples = std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(duration / plan.dt)));
  plan.legs.push_back({samples, Vector3d::Zero(), 0.0, turn / (static_cast<double>(samples) * plan.dt)});
  plan.heading += turn;
}

// One full circle, turning to the side of `sign`; the heading turns by `turn` meanwhile.
void circle(Plan& plan, const Vector3d& v_n, double sign, double turn) {
  const double speed = v_n.head<2>().norm();
  const double radius = std::max(12.0, speed * speed / kCircleAcceleration);
  const auto samples = static_cast<std::size_t>(std::ceil(2.0 * kPi * radius / (speed * plan.dt)));
  const double duration = static_cast<double>(samples) * plan.dt;
  plan.legs.push_back({samples, v_n, sign * 2.0 * kPi / duration, turn / duration});
  plan.position.z() += v_n.z() * duration;
  plan.heading += turn;
}

// Lines back and forth. The heading is kept for two lines, nose crab_deg right of the bearing; then as much left of it.
void survey(Plan& plan, const DroneFlight& f, double length, int lines) {
  const double bearing = f.line_bearing_deg * kDegToRad, crab = f.crab_deg * kDegToRad;
  const double turn_to_first = shortest_turn(plan.heading, bearing + crab);
  hover(plan, std::max(2.0, std::abs(turn_to_first) / (45.0 * kDegToRad)), turn_to_first);
  for (int i = 0; i < lines; ++i) {
    const double back_and_forth = i % 2 == 0 ? 1.0 : -1.0;
    fly_to(plan, plan.position + back_and_forth * length * direction(bearing), f.speed_mps);
    if (i + 1 == lines) break;
    const double nose = (i + 1) % 4 < 2 ? bearing + crab : bearing - crab;
    fly_to(plan, plan.position + f.line_spacing_m * direction(bearing + 0.5 * kPi), f.speed_mps,
           shortest_turn(plan.heading, nose));
  }
}

Plan make_plan(const DroneFlight& f, const Extent& extent, int lines, double dt) {
  const double bearing = f.line_bearing_deg * kDegToRad;
  Plan plan;
  plan.dt = dt;
  plan.heading = f.heading_deg * kDegToRad;
  fly_to(plan, Vector3d(0.0, 0.0, -f.altitude_m), f.climb_mps);
  hover(plan, 2.0);
  fly_to(plan, plan.position + extent.transit_m * direction(bearing - kPi / 3.0), f.speed_mps);
  survey(plan, f, extent.line_scale * f.line_length_m, lines);
  hover(plan, extent.hover_s);
  // A helix up with the nose fixed against the course, then one down to the other side with the nose lagging behind.
  const Vector3d v_n = f.speed_mps * direction(bearing) - Vector3d(0.0, 0.0, 0.5);
  if (extent.circles > 0) circle(plan, v_n, 1.0, 2.0 * kPi);
  if (extent.circles > 1) circle(plan, v_n + Vector3d(0.0, 0.0, 1.0), -1.0, -kPi);
  plan.spare_leg = plan.legs.size();
  hover(plan, 1.0);
  fly_to(plan, Vector3d(0.0, 0.0, plan.position.z()), f.speed_mps);
  fly_to(plan, Vector3d::Zero(), f.descent_mps, shortest_turn(plan.heading, f.heading_deg * kDegToRad));
  return plan;
}

// The fullest flight that takes no more than `available` samples, its spare time spent hovering.
Plan fit_plan(const DroneFlight& f, double dt, double available) {
  for (const Extent& extent : kExtents) {
    int lines = extent.min_lines;
    Plan plan = make_plan(f, extent, lines, dt);
    if (static_cast<double>(plan.samples()) > available) continue;
    while (true) {
      Plan longer = make_plan(f, extent, ++lines, dt);
      if (static_cast<double>(longer.samples()) > available) break;
      plan = std::move(longer);
    }
    plan.legs[plan.spare_leg].samples += static_cast<std::size_t>(available) - plan.samples();
    return plan;
  }
  const double least = static_cast<double>(make_plan(f, kExtents.back(), 1, dt).samples());
  throw Error("drone flight: duration_s is " + std::to_string(f.duration_s) + "; expected at least " +
              std::to_string(std::ceil(f.duration_s + (least - available) * dt)) +
              " with these parked phases, altitude and speeds; lengthen duration_s or shorten the parked phases");
}

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

// Roll and pitch of (Eq. 44), rad, for the specific force f = a + c v - g in NED and a heading.
Vector3d thrust_attitude(const Vector3d& f_n, double heading) {
  const double c = std::cos(heading), s = std::sin(heading);
  const double forward = c * f_n.x() + s * f_n.y(), right = c * f_n.y() - s * f_n.x();
  return {std::atan2(right, std::hypot(forward, f_n.z())), std::atan2(-forward, -f_n.z()), heading};
}

[[noreturn]] void refuse_tilt(double t, double cos_tilt, double max_tilt_deg) {
  throw Error("drone flight: tilt " + std::to_string(t) + " s after the start is " +
              std::to_string(std::acos(cos_tilt) * kRadToDeg) + " deg; expected at most max_tilt_deg = " +
              std::to_string(max_tilt_deg) + "; lower speed_mps, gust_mps2 or drag_per_s");
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
    Vector3d rpy = thrust_attitude(a_n + f.drag_per_s * v_n - g_n, heading);
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
  positive("rate_hz", f.rate_hz);
  positive("duration_s", f.duration_s);
  positive("speed_mps", f.speed_mps);
  positive("climb_mps", f.climb_mps);
  positive("descent_mps", f.descent_mps);
  positive("altitude_m", f.altitude_m);
  positive("line_length_m", f.line_length_m);
  positive("line_spacing_m", f.line_spacing_m);
  not_negative("parked_before_s", f.parked_before_s);
  not_negative("parked_after_s", f.parked_after_s);
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
    windows[i] =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(kShare[i] * dv / (kPeakAcceleration * dt))));
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
