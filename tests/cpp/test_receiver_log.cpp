// Laws of what a GNSS log shows of its receiver: arrival stamps go back to their grid and others stay, steps are those
// that the columns were rounded to, and the recordings say what they are known to say.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "liealign/core/units.hpp"
#include "liealign/ins/receiver_log.hpp"
#include "liealign/io/csv.hpp"

namespace liealign {
namespace {

constexpr double kMetresPerDegree = 111e3;  // of latitude, to a per cent

GnssRecord record_at(double t_s) {
  GnssRecord r;
  r.t_s = t_s;
  r.P_n_m2 = Matrix3d::Identity();
  return r;
}

std::vector<GnssRecord> records_at(const std::vector<double>& stamps) {
  std::vector<GnssRecord> records;
  for (const double t_s : stamps) records.push_back(record_at(t_s));
  return records;
}

double rounded(double value, double step) { return step * std::round(value / step); }

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// Differences a - b without their mean.
std::vector<double> centred(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> e(a.size());
  double mean = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) mean += (a[i] - b[i]) / static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) e[i] = a[i] - b[i] - mean;
  return e;
}

void expect_unchanged(const std::vector<double>& stamps, const char* what) {
  const StampGrid grid = stamp_grid(records_at(stamps));
  EXPECT_FALSE(grid.arrival) << what;
  EXPECT_EQ(grid.t_s, stamps) << what;
}

// ---- Stamps

struct Arrivals {
  std::vector<double> epochs;  // on the clock of the logger, with the constant delay
  std::vector<double> stamps;
};

// A receiver whose clock is 50 ppm fast, messages 40 ms late with a jitter of 8 ms, stamps to a millisecond; one message
// in 30 is late by up to 100 ms more, and one in 12 is lost.
Arrivals arrivals(double interval_s, unsigned seed, bool lose) {
  std::mt19937 random(seed);
  std::normal_distribution<double> jitter(0.0, 0.008);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Arrivals a;
  for (int k = 0; k < 2000; ++k) {
    if (lose && uniform(random) < 1.0 / 12.0) continue;
    const double pause_s = lose && k > 1000 ? 300.0 * interval_s : 0.0;
    const double epoch_s = 1000.0 + (k * interval_s + pause_s) * (1.0 - 50e-6);
    const double late_s = uniform(random) < 1.0 / 30.0 ? 0.1 * uniform(random) : 0.0;
    a.epochs.push_back(epoch_s);
    a.stamps.push_back(rounded(epoch_s + 0.04 + jitter(random) + late_s, 0.001));
  }
  return a;
}

TEST(StampGrid, puts_arrival_stamps_back_to_a_fraction_of_their_jitter) {
  for (const bool lose : {false, true}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const Arrivals a = arrivals(0.2, seed, lose);
      const StampGrid grid = stamp_grid(records_at(a.stamps));
      ASSERT_TRUE(grid.arrival) << seed;
      EXPECT_NEAR(grid.interval_s, 0.2 * (1.0 - 50e-6), 20e-6);
      EXPECT_NEAR(grid.jitter_s, 0.008, 0.0008);
      // A line over 41 stamps knows its middle to jitter / sqrt(41), its ends to twice that.
      EXPECT_LT(rms(centred(grid.t_s, a.epochs)), 0.25 * 0.008) << seed;
      EXPECT_GT(rms(centred(a.stamps, a.epochs)), 0.008) << seed;
    }
  }
}

// Over fewer fixes than a line has; the lines leave out late stamps, which the jitter counts.
TEST(StampGrid, wanders_by_what_its_walk_says) {
  double squares = 0.0, said = 0.0, n = 0.0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Arrivals a = arrivals(0.2, seed, false);
    const StampGrid grid = stamp_grid(records_at(a.stamps));
    const std::vector<double> off = centred(grid.t_s, a.epochs);
    constexpr std::size_t kLag = 15;
    for (std::size_t i = 30; i + kLag + 30 < off.size(); ++i) {
      squares += std::pow(off[i + kLag] - off[i], 2);
      said += std::pow(stamp_walk(grid), 2) * 0.2 * kLag;
      n += 1.0;
    }
  }
  EXPECT_LT(std::sqrt(squares / n), 1.15 * std::sqrt(said / n));
  EXPECT_GT(std::sqrt(squares / n), 0.75 * std::sqrt(said / n));
}

TEST(StampGrid, goes_on_after_every_pause) {
  std::mt19937 random(9);
  std::normal_distribution<double> jitter(0.0, 0.005);
  std::vector<double> epochs, stamps;
  for (int k = 0; k < 600; ++k) {
    const double pause_s = 97.03 * (k / 30) + (k > 595 ? 50.0 : 0.0);  // the receiver starts anew each time
    epochs.push_back(0.1 * k + pause_s);
    stamps.push_back(epochs.back() + jitter(random));
  }
  const StampGrid grid = stamp_grid(records_at(stamps));
  ASSERT_FALSE(grid.arrival) << "no piece is as long as the window";
  EXPECT_EQ(grid.t_s, stamps);

  // One longer piece tells the interval; short ones are fitted as well, and the four last stamps stay.
  for (std::size_t i = 0; i < 300; ++i) epochs[i] = 0.1 * static_cast<double>(i) - 100.0;
  for (std::size_t i = 0; i < 300; ++i) stamps[i] = epochs[i] + jitter(random);
  const StampGrid longer = stamp_grid(records_at(stamps));
  ASSERT_TRUE(longer.arrival);
  EXPECT_LT(rms(centred(longer.t_s, epochs)), 0.5 * 0.005);
  EXPECT_EQ(longer.t_s.back(), stamps.back());
}

TEST(StampGrid, leaves_the_constant_delay_to_the_latency) {
  const Arrivals a = arrivals(0.2, 7, true);
  const StampGrid grid = stamp_grid(records_at(a.stamps));
  double mean = 0.0;
  for (std::size_t i = 0; i < a.stamps.size(); ++i) mean += a.stamps[i] - grid.t_s[i];
  EXPECT_NEAR(mean / static_cast<double>(a.stamps.size()), 0.0, 1e-10);
}

TEST(StampGrid, counts_a_stamp_that_is_late_by_more_than_half_an_interval_to_its_own_epoch) {
  std::mt19937 random(3);
  std::normal_distribution<double> jitter(0.0, 0.003);
  std::vector<double> epochs, stamps;
  for (int k = 0; k < 400; ++k) {
    epochs.push_back(0.1 * k);
    stamps.push_back(0.1 * k + jitter(random) + (k % 50 == 20 ? 0.07 : 0.0));
  }
  const StampGrid grid = stamp_grid(records_at(stamps));
  ASSERT_TRUE(grid.arrival);
  for (const double e : centred(grid.t_s, epochs)) EXPECT_NEAR(e, 0.0, 0.003);
}

TEST(StampGrid, leaves_stamps_that_are_the_epoch_alone) {
  std::mt19937 random(4);
  std::normal_distribution<double> microseconds(0.0, 3e-6);
  std::vector<double> exact, ticks, unix_time, tiny;
  for (int k = 0; k < 500; ++k) {
    exact.push_back(-0.92 + 0.1 * k);
    ticks.push_back(rounded(0.20003 * k, 0.001));  // the grid rounded, no jitter
    unix_time.push_back(1.7e9 + 0.2 * k);          // its doubles step by 0.2 us
    tiny.push_back(0.2 * k + microseconds(random));
  }
  expect_unchanged(exact, "exact");
  expect_unchanged(ticks, "rounded to ticks");
  expect_unchanged(unix_time, "Unix time");
  expect_unchanged(tiny, "microseconds");
}

TEST(StampGrid, sees_arrival_stamps_on_the_coarse_ticks_of_a_logger) {
  std::mt19937 random(5);
  std::normal_distribution<double> jitter(0.0, 0.012);
  std::vector<double> stamps;
  for (int k = 0; k < 500; ++k) stamps.push_back(rounded(0.2 * k + jitter(random), 0.01));
  EXPECT_TRUE(stamp_grid(records_at(stamps)).arrival);
}

TEST(StampGrid, sees_that_one_stamp_in_four_is_a_tick_late) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> epochs, stamps;
  for (int k = 0; k < 500; ++k) {
    epochs.push_back(0.2 * k);
    stamps.push_back(0.2 * k + (uniform(random) < 0.25 ? 0.02 : 0.0));
  }
  const StampGrid grid = stamp_grid(records_at(stamps));
  ASSERT_TRUE(grid.arrival);
  EXPECT_LT(rms(centred(grid.t_s, epochs)), 0.002);  // the late ones pull the first of the two fits
}

TEST(StampGrid, sees_a_jitter_that_is_small_against_the_interval) {
  std::mt19937 random(6);
  std::normal_distribution<double> jitter(0.0, 0.005);
  std::vector<double> stamps;
  for (int k = 0; k < 300; ++k) stamps.push_back(1.7e9 + rounded(k + jitter(random), 1e-6));
  const StampGrid grid = stamp_grid(records_at(stamps));
  EXPECT_TRUE(grid.arrival);
  EXPECT_NEAR(grid.jitter_s, 0.005, 0.001);
}

TEST(StampGrid, has_no_grid_where_the_rate_is_not_uniform) {
  std::mt19937 random(1);
  std::exponential_distribution<double> pause(5.0);
  std::vector<double> at_random{0.0}, two_rates{0.0}, doubled, between;
  for (int k = 0; k < 500; ++k) {
    at_random.push_back(at_random.back() + 0.001 + pause(random));
    two_rates.push_back(two_rates.back() + (k < 250 ? 0.2 : 0.13) + 0.01 * std::sin(k));
    between.push_back(0.2 * k + 0.003 * std::sin(k) + (k % 8 == 5 ? 0.08 : 0.0));
    doubled.push_back(0.1 * (k / 2) + 0.002 * (k % 2) + 0.001 * std::sin(k));
  }
  expect_unchanged(at_random, "at random");
  expect_unchanged(two_rates, "two rates");
  expect_unchanged(between, "one stamp in eight between two epochs");
  std::sort(doubled.begin(), doubled.end());
  expect_unchanged(doubled, "two records for one epoch");
}

TEST(StampGrid, does_not_judge_a_short_log) {
  const Arrivals a = arrivals(0.2, 1, false);
  expect_unchanged({a.stamps.begin(), a.stamps.begin() + 40}, "40 records");
  expect_unchanged({1.0}, "one record");
  expect_unchanged({}, "no record");
}

// ---- Steps

// A car in the north-east at varying speed, at rest at times: positions in degrees and metres, velocities; not rounded.
std::vector<GnssRecord> drive(std::size_t count, double lat_deg, double lon_deg) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<GnssRecord> records;
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    const double t = 0.2 * static_cast<double>(k), speed = std::max(0.0, 6.0 * std::sin(0.02 * t));
    v = {speed * std::cos(0.05 * t), speed * std::sin(0.05 * t), 0.1 * std::sin(0.1 * t)};
    p += 0.2 * v;
    GnssRecord r = record_at(t);
    r.lat_rad = (lat_deg + (p(0) + 0.01 * noise(random)) / kMetresPerDegree) * kDegToRad;
    r.lon_rad = (lon_deg + (p(1) + 0.01 * noise(random)) / kMetresPerDegree) * kDegToRad;
    r.height_m = 100.0 - p(2) + 0.02 * noise(random);
    r.has_velocity = true;
    r.v_n_mps = v + 0.03 * Vector3d(noise(random), noise(random), noise(random));
    records.push_back(r);
  }
  return records;
}

template <typename Round>
void round_position(std::vector<GnssRecord>& records, const Round& round) {
  for (GnssRecord& r : records) {
    r.lat_rad = round(r.lat_rad * kRadToDeg) * kDegToRad;
    r.lon_rad = round(r.lon_rad * kRadToDeg) * kDegToRad;
  }
}

TEST(QuantisationSteps, are_zero_where_nothing_was_rounded) {
  for (const std::size_t count : {30U, 300U, 3000U}) {
    const QuantisationSteps steps = quantisation_steps(drive(count, 40.0, -105.0));
    EXPECT_EQ(steps.position_n_m, Vector3d::Zero().eval()) << count;
    EXPECT_EQ(steps.velocity_n_mps, Vector3d::Zero().eval()) << count;
  }
}

TEST(QuantisationSteps, are_those_of_the_decimals_of_each_column) {
  std::vector<GnssRecord> records = drive(1500, 60.0, 179.999);  // over the date line
  round_position(records, [](double deg) { return rounded(deg, 1e-7); });
  for (GnssRecord& r : records) {
    if (r.lon_rad > kPi) r.lon_rad -= 2.0 * kPi;
    r.height_m = rounded(r.height_m, 0.1);
    r.v_n_mps = {rounded(r.v_n_mps(0), 0.01), r.v_n_mps(1), rounded(r.v_n_mps(2), 0.05)};
  }
  const QuantisationSteps steps = quantisation_steps(records);
  EXPECT_NEAR(steps.position_n_m(0), 0.01114, 1e-5);  // a degree of latitude is 111.4 km at 60 deg
  EXPECT_NEAR(steps.position_n_m(1), 0.00558, 1e-5);  // of longitude 55.8 km
  EXPECT_NEAR(steps.position_n_m(2), 0.1, 1e-9);
  EXPECT_NEAR(steps.velocity_n_mps(0), 0.01, 1e-9);
  EXPECT_EQ(steps.velocity_n_mps(1), 0.0);
  EXPECT_NEAR(steps.velocity_n_mps(2), 0.05, 1e-9);
}

TEST(QuantisationSteps, show_degrees_that_went_through_a_float_also_with_seven_decimals) {
  for (const bool seven : {false, true}) {
    std::vector<GnssRecord> records = drive(1500, 44.9, -93.2);
    round_position(records, [&](double deg) {
      // Volatile, because GCC 12 forgets the float in the last elements of a vectorised loop.
      const volatile float single = static_cast<float>(deg);
      const double through_float = static_cast<double>(single);
      return seven ? rounded(through_float, 1e-7) : through_float;
    });
    const QuantisationSteps steps = quantisation_steps(records);
    EXPECT_NEAR(steps.position_n_m(0), std::ldexp(1.0, -18) * 111.13e3, 2e-3) << seven;  // 0.42 m
    EXPECT_NEAR(steps.position_n_m(1), std::ldexp(1.0, -17) * 79.0e3, 2e-3) << seven;    // 0.60 m
  }
}

TEST(QuantisationSteps, do_not_change_by_a_few_values_that_were_not_rounded) {
  std::vector<GnssRecord> records = drive(1500, 40.0, -105.0);
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (k % 500 != 3) records[k].height_m = rounded(records[k].height_m, 0.1);
  }
  EXPECT_NEAR(quantisation_steps(records).position_n_m(2), 0.1, 1e-4);
}

TEST(QuantisationSteps, do_not_take_a_constant_speed_for_a_step) {
  std::vector<GnssRecord> records = drive(600, 40.0, -105.0);
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.01);
  double metres = 0.0;
  for (std::size_t k = 0; k < records.size(); ++k) {
    metres += 3.4 * (1.0 + 0.01 * std::sin(0.02 * static_cast<double>(k)));  // 17 m/s within a per cent
    records[k].lat_rad = (40.0 + (metres + noise(random)) / kMetresPerDegree) * kDegToRad;
  }
  EXPECT_EQ(quantisation_steps(records).position_n_m(0), 0.0);
}

TEST(QuantisationSteps, do_not_look_at_rows_without_a_position) {
  std::vector<GnssRecord> records = drive(400, -38.0, 145.0);
  for (std::size_t k = 0; k < 200; ++k) {
    GnssRecord& r = records[k];
    r.lat_rad = (-38.0 + 0.001 * static_cast<double>(k % 2)) * kDegToRad;
    r.height_m = static_cast<double>(k % 3);
    r.P_n_m2 = Matrix3d::Identity() * 4294970.0 * 4294970.0;
  }
  EXPECT_EQ(quantisation_steps(records).position_n_m, Vector3d::Zero().eval());
  records.resize(200);
  EXPECT_EQ(quantisation_steps(records).position_n_m, Vector3d::Zero().eval());
  EXPECT_EQ(quantisation_steps({}).position_n_m, Vector3d::Zero().eval());
}

// ---- Stated standard deviations and classes

TEST(StatedStd, is_constant_where_every_row_with_a_position_states_the_same) {
  std::vector<GnssRecord> records = drive(10, 40.0, 0.0);
  EXPECT_TRUE(stated_std_is_constant(records));
  records[0].P_n_m2 *= 1e13;  // before the first fix
  EXPECT_TRUE(stated_std_is_constant(records));
  records[7].P_n_m2(2, 2) = 1.02;
  EXPECT_FALSE(stated_std_is_constant(records));
  EXPECT_FALSE(stated_std_is_constant({}));
}

TEST(FixClass, follows_the_fix_column_and_without_it_the_stated_std) {
  const auto by_fix = [](int fix, double std_m = 0.01) {
    GnssRecord r = record_at(0.0);
    r.fix = fix;
    r.P_n_m2 = std_m * std_m * Matrix3d::Identity();
    return fix_class(r);
  };
  EXPECT_EQ(by_fix(1), FixClass::fixed);
  EXPECT_EQ(by_fix(1, 0.9), FixClass::fixed);
  EXPECT_EQ(by_fix(1, 1.5), FixClass::single);  // no whole ambiguities leave metres
  for (const int fix : {0, 2, 3, 4, 6}) EXPECT_EQ(by_fix(fix), FixClass::other) << fix;
  EXPECT_EQ(by_fix(5), FixClass::single);

  const auto by_std = [](double std_n_m, double std_e_m) {
    GnssRecord r = record_at(0.0);
    r.P_n_m2.diagonal() << std_n_m * std_n_m, std_e_m * std_e_m, 100.0;
    return fix_class(r);
  };
  EXPECT_EQ(by_std(0.099, 0.099), FixClass::fixed);
  EXPECT_EQ(by_std(0.101, 0.101), FixClass::other);
  EXPECT_EQ(by_std(0.01, 0.15), FixClass::other);
  EXPECT_EQ(by_std(0.99, 0.99), FixClass::other);
  EXPECT_EQ(by_std(1.0, 1.01), FixClass::single);
}

// ---- The recordings

struct Known {
  const char* name;
  bool arrival;
  double jitter_s;
  Vector3d position_n_m;
  Vector3d velocity_n_mps;
  bool constant_std;
  FixClass last_class;
};

// Jitter and steps as the columns show them to the eye; comma_car's stamps are receive times, by its source.
const std::vector<Known>& known_recordings() {
  const Vector3d millimetres = Vector3d::Constant(0.001);
  static const std::vector<Known> known = {
      {"rtk_car_drive0708", false, 0.0, {0.0111, 0.0085, 0.001}, millimetres, false, FixClass::fixed},
      {"p4rtk_full_dot7", false, 0.0, {1.11e-5, 9.36e-6, 0.1}, {0, 0, 0}, true, FixClass::fixed},
      {"walk_0827_raw", false, 0.0, {0.0111, 0.0085, 0.001}, millimetres, false, FixClass::other},
      {"comma_car", true, 0.0065, {0.0111, 0.0088, 0.001}, {0, 0, 0}, true, FixClass::single},
      {"px4_optflow", true, 0.0038, {0.0111, 0.0088, 0.001}, millimetres, false, FixClass::single},
      {"apm_x8_testlog2", false, 0.0, {0.0111, 0.0088, 0.01}, {1e-4, 1e-4, 0.01}, true, FixClass::single}};
  return known;
}

std::filesystem::path recordings() {
  const char* folder = std::getenv("LIEALIGN_DATA");
  if (folder != nullptr) return folder;
  const std::filesystem::path checkout = std::filesystem::path(__FILE__).parent_path().parent_path().parent_path();
  return checkout.parent_path() / "shared" / "data";
}

TEST(Recordings, show_the_facts_of_their_receivers) {
  const std::filesystem::path folder = recordings();
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "the recordings are not at " << folder << "; set LIEALIGN_DATA to their folder";
  }
  for (const Known& known : known_recordings()) {
    std::vector<std::string> warnings;
    const std::vector<GnssRecord> records = read_gnss_csv((folder / known.name / "gnss.csv").string(), warnings);
    const StampGrid grid = stamp_grid(records);
    EXPECT_EQ(grid.arrival, known.arrival) << known.name;
    EXPECT_NEAR(grid.jitter_s, known.jitter_s, 3e-4) << known.name;
    const QuantisationSteps steps = quantisation_steps(records);
    EXPECT_TRUE(steps.position_n_m.isApprox(known.position_n_m, 0.01))
        << known.name << " " << steps.position_n_m.transpose();
    EXPECT_LT((steps.velocity_n_mps - known.velocity_n_mps).norm(), 1e-6)
        << known.name << " " << steps.velocity_n_mps.transpose();
    EXPECT_EQ(stated_std_is_constant(records), known.constant_std) << known.name;
    EXPECT_EQ(fix_class(records.back()), known.last_class) << known.name;
  }
}

// Between two fixes the antenna goes as far as the velocity column says: the better the stamps, the better it fits.
TEST(Recordings, fit_their_own_velocity_when_the_stamps_are_put_back) {
  const std::filesystem::path folder = recordings();
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "the recordings are not at " << folder << "; set LIEALIGN_DATA to their folder";
  }
  std::vector<std::string> warnings;
  const std::vector<GnssRecord> records = read_gnss_csv((folder / "comma_car" / "gnss.csv").string(), warnings);
  const StampGrid grid = stamp_grid(records);
  std::vector<double> as_stamped, put_back;
  for (std::size_t i = 1; i < records.size(); ++i) {
    const GnssRecord &a = records[i - 1], &b = records[i];
    constexpr double kMetresPerRadian = 6.36e6;
    const double north_m = (b.lat_rad - a.lat_rad) * kMetresPerRadian, v_mps = 0.5 * (a.v_n_mps(0) + b.v_n_mps(0));
    as_stamped.push_back(north_m - v_mps * (b.t_s - a.t_s));
    put_back.push_back(north_m - v_mps * (grid.t_s[i] - grid.t_s[i - 1]));
  }
  EXPECT_LT(rms(put_back), 0.2 * rms(as_stamped));
}

}  // namespace
}  // namespace liealign
