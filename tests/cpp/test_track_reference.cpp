// Laws of a flight along a track (Eq. 67): it goes through the points, without jumps in force or rate; a flight sampled and
// flown again is the same flight; what cannot be flown is refused.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/simulate/track_reference.hpp"

namespace liealign {
namespace {

using Track = std::vector<TrackPoint>;

Vector3d rpy_of(const SE23<double>& X) { return rpy_from_C_b_n(C_n_e(X.p).transpose() * X.C); }

TrackPoint point_of(const TruthEpoch& e) {
  const Geodetic g = geodetic_from_ecef(e.X.p);
  return {e.t_s, g.lat_rad, g.lon_rad, g.height_m, rpy_of(e.X)};
}

// Every step-th epoch.
Track sampled(const std::vector<TruthEpoch>& epochs, std::size_t step) {
  Track track;
  for (std::size_t k = 0; k < epochs.size(); k += step) track.push_back(point_of(epochs[k]));
  return track;
}

// Metres along north, east, down from a place in the Alps to geodetic.
Geodetic place(const Vector3d& p_n) {
  const Geodetic origin{47.0 * kDegToRad, 11.0 * kDegToRad, 900.0};
  return geodetic_from_ecef(ecef_from_geodetic(origin) + C_n_e(origin.lat_rad, origin.lon_rad) * p_n);
}

// n points at uneven intervals of 10 to 400 ms, all multiples of 10 ms, on a winding way with turns through north and
// rolls over the back.
Track winding_track(int n) {
  Track track;
  double t = 0.0;
  for (int i = 0; i < n; ++i) {
    const Geodetic g = place({30.0 * std::sin(0.5 * t), 8.0 * t, 5.0 * std::cos(0.9 * t)});
    const Vector3d rpy(1.1 * t, 0.3 * std::sin(t), -0.7 * t);
    track.push_back({500.0 + t, g.lat_rad, g.lon_rad, g.height_m, rpy});
    t += 0.01 * (1 + (7 * i) % 40);
  }
  return track;
}

// Standing still: what the tests of errors spoil.
Track parked_track() {
  Track track;
  for (int i = 0; i < 20; ++i) track.push_back({100.0 + 0.1 * i, 0.8, 0.2, 300.0, Vector3d(0.02, -0.01, 2.0)});
  return track;
}

// The default drone flight, made once.
const std::vector<TruthEpoch>& drone() {
  static const std::vector<TruthEpoch> reference = drone_reference(DroneFlight{});
  return reference;
}

struct Difference {
  double attitude = 0.0, velocity = 0.0, position = 0.0;  // rad, m/s, m

  void include(const SE23<double>& X, const SE23<double>& Y) {
    attitude = std::max(attitude, SO3<double>{X.C.transpose() * Y.C}.log().norm());
    velocity = std::max(velocity, (X.v - Y.v).norm());
    position = std::max(position, (X.p - Y.p).norm());
  }
};

// ---- the curve ------------------------------------------------------------------------------------------------------

TEST(TrackReference, goes_through_the_points) {
  const Track track = winding_track(60);
  const std::vector<TruthEpoch> reference = track_reference(track, 100.0, 4);
  for (const TrackPoint& p : track) {
    const std::size_t k = static_cast<std::size_t>(std::llround((p.t_s - 500.0) * 400.0));
    ASSERT_LT(k, reference.size());
    const SE23<double>& X = reference[k].X;
    ASSERT_NEAR(reference[k].t_s, p.t_s, 1e-9);
    EXPECT_LT((X.p - ecef_from_geodetic({p.lat_rad, p.lon_rad, p.height_m})).norm(), 1e-7) << p.t_s;
    EXPECT_LT((C_n_e(X.p) * C_b_n_from_rpy(p.rpy_rad) - X.C).norm(), 1e-8) << p.t_s;
  }
}

// Ends included: a parabola is its own spline with this run-out. The geodetic way back costs nanometres. Unix stamps are
// 0.24 us apart, which is 1 um of way: it is met at the stamps as they are.
TEST(TrackReference, meets_a_constant_acceleration) {
  const Vector3d v(3.0, -2.0, 1.0), a(0.5, 1.5, -0.4), rate(0.02, 0.001, -0.06), bend(0.0005, 0.0002, 0.003);
  const Vector3d p_0 = ecef_from_geodetic(place(Vector3d::Zero()));
  for (const double begin : {500.0, 1.7e9}) {
    Track track = winding_track(40);
    for (TrackPoint& point : track) {
      point.t_s += begin - 500.0;
      const double t = point.t_s - begin;
      const Geodetic g = geodetic_from_ecef(p_0 + t * v + 0.5 * t * t * a);
      point = {point.t_s, g.lat_rad, g.lon_rad, g.height_m, t * rate + 0.5 * t * t * bend};
    }
    for (const TruthEpoch& e : track_reference(track, 100.0, 4)) {
      const double t = e.t_s - begin;
      const Vector3d p = p_0 + t * v + 0.5 * t * t * a, rpy = t * rate + 0.5 * t * t * bend;
      ASSERT_LT((e.X.p - p).norm(), 1e-7) << t;
      ASSERT_LT((e.X.v - (v + t * a)).norm(), 1e-5) << t;
      ASSERT_LT((C_n_e(p) * C_b_n_from_rpy(rpy) - e.X.C).norm(), 1e-8) << t;
    }
  }
}

// The force changes by jerk times step, 60 m/s^3 over 2.5 ms at most, where a curve with corners would jump by jerk times
// interval; so does the rate. And the velocity is that of the position.
TEST(TrackReference, has_no_jumps) {
  const double dt = 1.0 / 400.0;
  const std::vector<TruthEpoch> r = track_reference(winding_track(60), 100.0, 4);
  double force = 0.0, turn = 0.0, slip = 0.0;
  Vector3d a_before = Vector3d::Zero(), w_before = Vector3d::Zero();
  for (std::size_t k = 1; k < r.size(); ++k) {
    const Vector3d a = (r[k].X.v - r[k - 1].X.v) / dt;
    const Vector3d w = SO3<double>{r[k - 1].X.C.transpose() * r[k].X.C}.log() / dt;
    if (k > 1) {
      force = std::max(force, (a - a_before).norm());
      turn = std::max(turn, (w - w_before).norm());
    }
    a_before = a;
    w_before = w;
    // Trapezoid: off by jerk dt^3 / 12.
    slip = std::max(slip, (r[k].X.p - r[k - 1].X.p - 0.5 * dt * (r[k].X.v + r[k - 1].X.v)).norm());
  }
  EXPECT_LT(force, 60.0 * dt);
  EXPECT_LT(turn, 5.0 * dt);
  EXPECT_LT(slip, 60.0 * dt * dt * dt / 12.0 + 4e-9);
}

// 10 deg each second, through north and over the back, as files have it: in [0, 360) and (-180, 180].
TEST(TrackReference, turns_the_shorter_way) {
  Track track = parked_track();
  for (std::size_t i = 0; i < track.size(); ++i) {
    const double turned = 10.0 * static_cast<double>(i);
    track[i].t_s = 100.0 + static_cast<double>(i);
    track[i].rpy_rad =
        Vector3d(std::remainder(100.0 + turned, 360.0), 0.0, std::fmod(285.0 + turned, 360.0)) * kDegToRad;
  }
  for (const TruthEpoch& e : track_reference(track, 10.0, 1)) {
    const double turned = 10.0 * (e.t_s - 100.0);
    const Matrix3d expected = C_b_n_from_rpy(Vector3d(100.0 + turned, 0.0, 285.0 + turned) * kDegToRad);
    ASSERT_LT((C_n_e(e.X.p).transpose() * e.X.C - expected).norm(), 1e-9) << e.t_s;
  }
}

// North-east-down turns by 1 deg for each degree of latitude that the track goes.
TEST(TrackReference, attitude_is_against_the_local_level) {
  Track track;
  for (int i = 0; i < 200; ++i)
    track.push_back({0.1 * i, (40.0 + 0.01 * i) * kDegToRad, 3.1415, 5e3, Vector3d::Zero()});
  const std::vector<TruthEpoch> reference = track_reference(track, 50.0, 1);
  EXPECT_GT(SO3<double>{reference.front().X.C.transpose() * reference.back().X.C}.log().norm(), 1.9 * kDegToRad);
  for (const TruthEpoch& e : reference) ASSERT_LT(rpy_of(e.X).norm(), 1e-12) << e.t_s;
}

// The last epoch is the last sample of the IMU that is inside; stamps rounded to the microsecond do not cost it.
TEST(TrackReference, ends_on_the_last_sample) {
  Track track = parked_track();
  for (const double end_s : {101.9, 101.8999995, 101.9049, 101.9051}) {
    track.back().t_s = end_s;
    const std::vector<TruthEpoch> reference = track_reference(track, 200.0, 8);
    ASSERT_EQ(reference.size(), (end_s > 101.905 ? 381u : 380u) * 8u + 1u) << end_s;
    EXPECT_EQ(reference.front().t_s, 100.0);
    EXPECT_NEAR(reference.back().t_s, end_s > 101.905 ? 101.905 : 101.9, 1e-9);
  }
}

// ---- a flight, sampled and flown again -------------------------------------------------------------------------------

// 300 s of the drone flight at 20 and 50 Hz, with its gusts, its wobble of up to 3 Hz, and its ends. Measured 8.7e-5 rad,
// 2.0e-5 m/s, 3.4e-7 m and 3.4e-5 rad, 2.0e-6 m/s, 1.4e-8 m, of which 5 nm are the way through geodetic coordinates; the
// attitude, that of a force with corners, gains least.
TEST(TrackReference, gives_a_flight_back) {
  struct Case {
    std::size_t step;
    double attitude, velocity, position;  // rad, m/s, m
  };
  for (const Case& c : {Case{80, 1.5e-4, 4e-5, 1e-6}, Case{32, 6e-5, 4e-6, 5e-8}}) {
    const std::vector<TruthEpoch> flown = track_reference(sampled(drone(), c.step), 200.0, 8);
    ASSERT_EQ(flown.size(), drone().size());
    Difference d;
    for (std::size_t k = 0; k < flown.size(); ++k) d.include(flown[k].X, drone()[k].X);
    EXPECT_LT(d.attitude, c.attitude);
    EXPECT_LT(d.velocity, c.velocity);
    EXPECT_LT(d.position, c.position);
  }
}

// The law of the simulator, as for its own flights: the exact truth is the reference, in position as well. Measured 3.8e-5 m:
// rounding, 1e-10 m in each fine step.
TEST(TrackReference, is_its_own_exact_truth) {
  const Track track = sampled(drone(), 80);
  const std::vector<TruthEpoch> reference = track_reference(track, 200.0, 8);
  const Truth truth = track_truth(track, 200.0, 8, Mechanization::exact, GravityModel::normal);
  ASSERT_EQ(truth.epochs.size(), 60001u);
  ASSERT_EQ(truth.imu.size(), truth.epochs.size());
  Difference d;
  for (std::size_t k = 0; k < truth.epochs.size(); ++k) d.include(truth.epochs[k].X, reference[8 * k].X);
  EXPECT_LT(d.attitude, 1e-13);
  EXPECT_LT(d.velocity, 2e-11);
  EXPECT_LT(d.position, 1e-4);
}

// The oscillation of a spline before a take-off fades by 0.27 for each interval.
TEST(TrackReference, parked_is_still) {
  for (const TruthEpoch& e : track_reference(sampled(drone(), 80), 200.0, 8)) {
    if (e.t_s > 1038.0 && e.t_s < 1282.0) continue;  // in the air from 1040 to 1280
    ASSERT_LT(e.X.v.norm(), 1e-9) << e.t_s;
    ASSERT_LT((e.X.C - drone().front().X.C).norm(), 1e-9) << e.t_s;
  }
}

// 0.24 us are some ten-thousandths of a fine step. Measured 3 mm/s^2 of force, from the points' own stamps.
TEST(TrackReference, takes_unix_times) {
  const auto forces = [](double shift_s) {
    Track track = winding_track(60);
    for (TrackPoint& p : track) p.t_s += shift_s;
    return track_truth(track, 200.0, 8, Mechanization::exact, GravityModel::normal).imu;
  };
  const ImuSeries here = forces(0.0), there = forces(1.7e9);
  ASSERT_EQ(here.size(), there.size());
  double worst = 0.0;
  for (std::size_t k = 0; k < here.size(); ++k) worst = std::max(worst, (here[k].f_ib_b - there[k].f_ib_b).norm());
  EXPECT_LT(worst, 0.01);
}

// ---- what is refused -------------------------------------------------------------------------------------------------

std::string refusal(const Track& track, double rate_hz = 100.0, int oversample = 2) {
  try {
    track_reference(track, rate_hz, oversample);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(TrackReference, refuses_points_that_are_no_flight) {
  struct Case {
    std::function<void(Track&)> spoil;
    const char* says;
  };
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto turn = [](Track& t, int axis, double deg) {
    for (std::size_t i = 5; i < t.size(); ++i) t[i].rpy_rad[axis] += deg * kDegToRad;
  };
  const Case cases[] = {
      {[](Track& t) { t.resize(3); }, "track: it has 3 points; expected at least 4"},
      {[](Track& t) { t.clear(); }, "track: it has 0 points"},
      {[](Track& t) { t[5].t_s = t[4].t_s; }, "point 5 (100.400000 s): expected a time after"},
      {[](Track& t) { t[5].t_s = 99.0; }, "point 5 (99.000000 s): expected a time after"},
      {[&](Track& t) { t[0].t_s = nan; }, "point 0 (nan s): a value is not finite"},
      {[&](Track& t) { t[7].lat_rad = nan; }, "point 7 (100.700000 s): a value is not finite"},
      {[&](Track& t) { t[7].lon_rad = inf; }, "point 7 (100.700000 s): a value is not finite"},
      {[&](Track& t) { t[7].height_m = -inf; }, "point 7 (100.700000 s): a value is not finite"},
      {[&](Track& t) { t[19].rpy_rad[1] = nan; }, "point 19 (101.900000 s): a value is not finite"},
      {[](Track& t) { t[7].lat_rad = 48.0; }, "point 7 (100.700000 s): the latitude is 2750.19"},
      {[](Track& t) { t[7].height_m = -1001.0; }, "the height is -1001.000000 m; expected -1000 to 100000"},
      {[](Track& t) { t[7].height_m = 1e6; }, "the height is 1000000.000000 m"},
      {[](Track& t) { t[7].rpy_rad[1] = 89.6 * kDegToRad; },
       "the pitch is 89.600000 deg; expected -89.5 to 89.5: Euler"},
      {[](Track& t) { t[7].rpy_rad[1] = -89.6 * kDegToRad; }, "the pitch is -89.600000 deg"},
      {[&](Track& t) { turn(t, 2, 171.0); }, "point 5 (100.500000 s): the heading has changed by 171.000000 deg"},
      {[&](Track& t) { turn(t, 2, -171.0); }, "point 5 (100.500000 s): the heading has changed by 171.000000 deg"},
      {[&](Track& t) { turn(t, 0, 179.0); }, "point 5 (100.500000 s): the roll has changed by 179.000000 deg"},
      {[](Track& t) {
         for (std::size_t i = 9; i < t.size(); ++i) t[i].t_s += 2.0;
       },
       "point 9 (102.900000 s): comes 2.1"},
      {[](Track& t) {
         t[4].t_s = std::nextafter(t[3].t_s, 1e3);
         t[4].height_m += 1.0;
       },
       "through the points takes"},
      {[](Track& t) { t[7].height_m += 2.0; }, "point 7 (100.700000 s): the way through the points takes "},
  };
  for (const Case& c : cases) {
    Track track = parked_track();
    EXPECT_EQ(refusal(track), "");
    c.spoil(track);
    EXPECT_NE(refusal(track).find(c.says), std::string::npos) << c.says << "\n" << refusal(track);
  }
}

// Just inside what is refused.
TEST(TrackReference, takes_points_at_the_limits) {
  const std::function<void(Track&)> changes[] = {
      [](Track& t) { t.resize(4); },
      [](Track& t) {
        for (TrackPoint& p : t) p.rpy_rad[1] = 89.4 * kDegToRad;
      },
      [](Track& t) {
        for (std::size_t i = 5; i < t.size(); ++i) t[i].rpy_rad[2] -= 169.0 * kDegToRad;
      },
      [](Track& t) {
        for (std::size_t i = 9; i < t.size(); ++i) t[i].t_s += 1.89;
      },
      [](Track& t) {
        for (TrackPoint& p : t) p.lat_rad = -0.5 * kPi;
      },
  };
  for (const auto& change : changes) {
    Track track = parked_track();
    change(track);
    EXPECT_EQ(refusal(track), "");
  }
}

TEST(TrackReference, refuses_rates_out_of_range) {
  const Track track = parked_track();
  for (const double rate : {0.0, -1.0, 0.9, 10001.0, std::nan("")})
    EXPECT_NE(refusal(track, rate).find("rate_hz is "), std::string::npos) << rate;
  EXPECT_NE(refusal(track, 100.0, 0).find("oversample is 0"), std::string::npos);
  EXPECT_NE(refusal(track, 1e4, 2000).find("more than 2e7 steps"), std::string::npos);
  Track brief = track;
  for (std::size_t i = 0; i < brief.size(); ++i) brief[i].t_s = 100.0 + 1e-4 * static_cast<double>(i);
  EXPECT_NE(refusal(brief, 100.0).find("at least one sample of the IMU"), std::string::npos);
}

}  // namespace
}  // namespace liealign
