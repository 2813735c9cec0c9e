// The plans of the flight kinds: what is flown, and as much of it as there is time for.
// SPDX-License-Identifier: Apache-2.0
#include "flight_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

constexpr double kCircleShare = 0.625;          // of acceleration_mps2, in circles
constexpr double kTurnRate = 45.0 * kDegToRad;  // rad/s, of the nose on the spot

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
void circle(Plan& plan, const DroneFlight& f, const Vector3d& v_n, double sign, double turn) {
  const double speed = v_n.head<2>().norm();
  const double tightest = std::max(12.0, speed * speed / (kCircleShare * f.acceleration_mps2));
  const double radius = f.circle_radius_m > 0.0 ? f.circle_radius_m : tightest;
  const auto samples = static_cast<std::size_t>(std::ceil(2.0 * kPi * radius / (speed * plan.dt)));
  const double duration = static_cast<double>(samples) * plan.dt;
  plan.legs.push_back({samples, v_n, sign * 2.0 * kPi / duration, turn / duration});
  plan.position.z() += v_n.z() * duration;
  plan.heading += turn;
}

// Turns on the spot.
void turn_to(Plan& plan, double heading) {
  const double turn = shortest_turn(plan.heading, heading);
  hover(plan, std::max(2.0, std::abs(turn) / kTurnRate), turn);
}

// Lines back and forth. The heading is kept for two lines, nose crab_deg right of the bearing; then as much left of it.
void survey(Plan& plan, const DroneFlight& f, double length, int lines) {
  const double bearing = f.line_bearing_deg * kDegToRad, crab = f.crab_deg * kDegToRad;
  turn_to(plan, bearing + crab);
  for (int i = 0; i < lines; ++i) {
    const double back_and_forth = i % 2 == 0 ? 1.0 : -1.0;
    fly_to(plan, plan.position + back_and_forth * length * direction(bearing), f.speed_mps);
    if (i + 1 == lines) break;
    const double nose = (i + 1) % 4 < 2 ? bearing + crab : bearing - crab;
    fly_to(plan, plan.position + f.line_spacing_m * direction(bearing + 0.5 * kPi), f.speed_mps,
           shortest_turn(plan.heading, nose));
  }
}

// Hovers for the time left over, returns and lands.
void go_home(Plan& plan, const DroneFlight& f) {
  plan.spare_leg = plan.legs.size();
  hover(plan, 1.0);
  fly_to(plan, Vector3d(0.0, 0.0, plan.position.z()), f.speed_mps);
  fly_to(plan, Vector3d::Zero(), f.descent_mps, shortest_turn(plan.heading, f.heading_deg * kDegToRad));
}

Plan survey_plan(const DroneFlight& f, const Extent& extent, int lines, double dt) {
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
  const Vector3d v_n = f.speed_mps * direction(bearing) - Vector3d(0.0, 0.0, f.helix_climb_mps);
  if (extent.circles > 0) circle(plan, f, v_n, 1.0, 2.0 * kPi);
  if (extent.circles > 1) circle(plan, f, v_n + Vector3d(0.0, 0.0, 2.0 * f.helix_climb_mps), -1.0, -kPi);
  go_home(plan, f);
  return plan;
}

// Full circles one after the other, climbing at climb_mps.
void circles(Plan& plan, const DroneFlight& f, double climb_mps, int count) {
  const double bearing = f.line_bearing_deg * kDegToRad, sign = f.clockwise ? 1.0 : -1.0;
  turn_to(plan, bearing + f.crab_deg * kDegToRad);
  const Vector3d v_n = f.speed_mps * direction(bearing) - Vector3d(0.0, 0.0, climb_mps);
  for (int i = 0; i < count; ++i) circle(plan, f, v_n, sign, f.nose_follows * sign * 2.0 * kPi);
}

// Sides of a rectangle, one after the other. The nose is turned on the first third of a side.
void rectangle(Plan& plan, const DroneFlight& f, int sides) {
  const double quarter = f.clockwise ? 0.5 * kPi : -0.5 * kPi;
  double course = f.line_bearing_deg * kDegToRad;
  turn_to(plan, course + f.crab_deg * kDegToRad);
  for (int i = 0; i < sides; ++i, course += quarter) {
    const Vector3d side = (i % 2 == 0 ? f.line_length_m : f.line_spacing_m) * direction(course);
    const Vector3d corner = plan.position;
    fly_to(plan, corner + side / 3.0, f.speed_mps, i == 0 ? 0.0 : f.nose_follows * quarter);
    fly_to(plan, corner + side, f.speed_mps);
  }
}

// A flight of `count` lines, circles or sides.
Plan kind_plan(const DroneFlight& f, int count, double dt) {
  Plan plan;
  plan.dt = dt;
  plan.heading = f.heading_deg * kDegToRad;
  fly_to(plan, Vector3d(0.0, 0.0, -f.altitude_m), f.climb_mps);
  if (f.kind == FlightKind::lines) survey(plan, f, f.line_length_m, count);
  if (f.kind == FlightKind::circles) circles(plan, f, 0.0, count);
  if (f.kind == FlightKind::helical) circles(plan, f, f.helix_climb_mps, count);
  if (f.kind == FlightKind::rectangular) rectangle(plan, f, count);
  go_home(plan, f);
  return plan;
}

[[noreturn]] void refuse_duration(const DroneFlight& f, double missing_s) {
  throw Error("drone flight: duration_s is " + std::to_string(f.duration_s) + "; expected at least " +
              std::to_string(std::ceil(f.duration_s + missing_s)) +
              " with these parked phases, altitude and speeds; lengthen duration_s or shorten the parked phases");
}

// As many as fit: make(count) from `least` upwards.
template <typename Make>
std::optional<Plan> longest(const Make& make, int least, double available) {
  Plan plan = make(least);
  if (static_cast<double>(plan.samples()) > available) return std::nullopt;
  for (int count = least + 1;; ++count) {
    Plan longer = make(count);
    if (static_cast<double>(longer.samples()) > available) break;
    plan = std::move(longer);
  }
  plan.legs[plan.spare_leg].samples += static_cast<std::size_t>(available) - plan.samples();
  return plan;
}

Plan fit_survey(const DroneFlight& f, double dt, double available) {
  for (const Extent& extent : kExtents) {
    const auto make = [&](int lines) { return survey_plan(f, extent, lines, dt); };
    if (std::optional<Plan> plan = longest(make, extent.min_lines, available)) return *std::move(plan);
  }
  refuse_duration(f, (static_cast<double>(survey_plan(f, kExtents.back(), 1, dt).samples()) - available) * dt);
}

// Nothing to repeat: up, and down again.
Plan fit_hover(const DroneFlight& f, double dt, double available) {
  Plan plan = kind_plan(f, 0, dt);
  const double missing = static_cast<double>(plan.samples()) - available;
  if (missing > 0.0) refuse_duration(f, missing * dt);
  plan.legs[plan.spare_leg].samples += static_cast<std::size_t>(-missing);
  return plan;
}

}  // namespace

Vector3d direction(double course_rad) { return {std::cos(course_rad), std::sin(course_rad), 0.0}; }

Plan fit_plan(const DroneFlight& flight, double dt, double available) {
  switch (flight.kind) {
    case FlightKind::survey:
      return fit_survey(flight, dt, available);
    case FlightKind::hover:
      return fit_hover(flight, dt, available);
    case FlightKind::parked:
      return {};
    default:
      break;
  }
  const auto make = [&](int count) { return kind_plan(flight, count, dt); };
  if (std::optional<Plan> plan = longest(make, 1, available)) return *std::move(plan);
  refuse_duration(flight, (static_cast<double>(make(1).samples()) - available) * dt);
}

}  // namespace liealign
