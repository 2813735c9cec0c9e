// The names of the flight kinds, and flights drawn at random.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "liealign/core/error.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {
namespace {

constexpr std::uint64_t kPlanStream = 103;  // gusts and wobble have theirs in drone_flight.cpp

constexpr std::array<std::pair<FlightKind, const char*>, 7> kNames = {{{FlightKind::survey, "survey"},
                                                                       {FlightKind::lines, "lines"},
                                                                       {FlightKind::circles, "circles"},
                                                                       {FlightKind::helical, "helical"},
                                                                       {FlightKind::rectangular, "rectangular"},
                                                                       {FlightKind::hover, "hover"},
                                                                       {FlightKind::parked, "parked"}}};

// What a brisk flight and a gentle one are drawn from, each from low to high.
struct Range {
  double low, high;
};
struct Style {
  Range acceleration_mps2;
  Range speed_s, climb_s;   // speeds over the acceleration
  Range altitude_s;         // height over the speed of the climb
  Range line_s, spacing_s;  // lengths over the speed
  Range gust, wobble_deg;   // gusts over the acceleration
  Range wind_mps;
};
constexpr Style kBrisk = {{2.2, 3.0}, {2.4, 3.0},   {0.8, 1.0}, {2.0, 4.0}, {6.0, 14.0},
                          {4.0, 8.0}, {0.03, 0.08}, {0.3, 1.0}, {0.0, 4.0}};
constexpr Style kGentle = {{0.1, 0.3},  {6.0, 10.0},  {2.0, 4.0},  {2.0, 5.0}, {15.0, 25.0},
                           {8.0, 15.0}, {0.05, 0.15}, {0.05, 0.2}, {0.0, 2.0}};

}  // namespace

FlightKind flight_kind(const std::string& name) {
  std::string all;
  for (const auto& [kind, text] : kNames) {
    if (name == text) return kind;
    all += std::string(all.empty() ? "" : ", ") + text;
  }
  throw Error("drone flight: kind is \"" + name + "\"; expected one of: " + all);
}

std::string flight_kind_name(FlightKind kind) {
  for (const auto& [known, text] : kNames) {
    if (kind == known) return text;
  }
  throw Error("drone flight: a kind without a name");
}

DroneFlight random_flight(FlightKind kind, bool gentle, std::uint64_t seed) {
  const Style& style = gentle ? kGentle : kBrisk;
  Random random(seed, kPlanStream);
  const auto draw = [&](const Range& range) { return range.low + (range.high - range.low) * random.uniform(); };
  DroneFlight f;
  f.kind = kind;
  f.seed = seed;
  f.parked_before_s = 30.0;
  f.lat_deg = draw({-65.0, 65.0});
  f.lon_deg = draw({-180.0, 180.0});
  f.heading_deg = draw({0.0, 360.0});
  f.parked_roll_deg = draw({-2.0, 2.0});
  f.parked_pitch_deg = draw({-2.0, 2.0});
  f.line_bearing_deg = draw({0.0, 360.0});
  f.crab_deg = draw({-180.0, 180.0});
  f.nose_follows = draw({0.0, 1.0});
  f.clockwise = random.uniform() < 0.5;
  const double a = f.acceleration_mps2 = draw(style.acceleration_mps2);
  f.speed_mps = a * draw(style.speed_s);
  f.climb_mps = f.descent_mps = a * draw(style.climb_s);
  f.altitude_m = f.climb_mps * draw(style.altitude_s);
  f.helix_climb_mps = 0.2 * f.climb_mps;
  f.line_length_m = f.speed_mps * draw(style.line_s);
  f.line_spacing_m = f.speed_mps * draw(style.spacing_s);
  f.circle_radius_m = f.speed_mps * f.speed_mps / a * draw({1.6, 2.4});
  f.max_tilt_deg = 50.0;
  f.gust_mps2 = a * draw(style.gust);
  f.attitude_wobble_deg = draw(style.wobble_deg);
  f.wind_mps = draw(style.wind_mps);
  f.wind_from_deg = draw({0.0, 360.0});
  if (kind == FlightKind::hover || kind == FlightKind::parked) {
    f.wind_mps = 0.0;
    f.gust_mps2 = 0.0009;  // six sines an axis: below 0.005 m/s^2 at any time
    f.attitude_wobble_deg = 0.05;
    if (kind == FlightKind::hover) f.parked_roll_deg = f.parked_pitch_deg = 0.0;
  }
  return f;
}

}  // namespace liealign
