// Calendar and week times to GPS time, with the table of leap seconds.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/gps_time.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace liealign {
namespace {

using std::chrono::day;
using std::chrono::month;
using std::chrono::sys_days;
using std::chrono::year;
using std::chrono::year_month_day;

constexpr std::int64_t kSecondsPerMinute = 60;
constexpr std::int64_t kSecondsPerHourWhole = 3600;
constexpr std::int64_t kSecondsPerDay = 86400;
constexpr std::int64_t kJstMinusUtc_s = 9 * kSecondsPerHourWhole;
constexpr sys_days kGpsEpoch{year{1980} / 1 / 6};

constexpr std::int64_t days_since_epoch(const year_month_day& date) { return (sys_days{date} - kGpsEpoch).count(); }

// Days on which GPST - UTC grew by one second, at 00:00:00 UTC: entry i brought it to i + 1.
constexpr std::array<year_month_day, 18> kLeapDays = {
    year{1981} / 7 / 1, year{1982} / 7 / 1, year{1983} / 7 / 1, year{1985} / 7 / 1, year{1988} / 1 / 1,
    year{1990} / 1 / 1, year{1991} / 1 / 1, year{1992} / 7 / 1, year{1993} / 7 / 1, year{1994} / 7 / 1,
    year{1996} / 1 / 1, year{1997} / 7 / 1, year{1999} / 1 / 1, year{2006} / 1 / 1, year{2009} / 1 / 1,
    year{2012} / 7 / 1, year{2015} / 7 / 1, year{2017} / 1 / 1};

// n for a count of UTC seconds since the epoch that leaves leap seconds out.
std::int64_t leap_seconds_at_utc(std::int64_t utc_s) {
  std::size_t n = 0;
  while (n < kLeapDays.size() && utc_s >= days_since_epoch(kLeapDays[n]) * kSecondsPerDay) ++n;
  return static_cast<std::int64_t>(n);
}

std::int64_t minus_utc_s(TimeScale scale) { return scale == TimeScale::jst ? kJstMinusUtc_s : 0; }

year_month_day date_of(const CalendarTime& t) {
  return {year{t.year}, month{static_cast<unsigned>(t.month)}, day{static_cast<unsigned>(t.day)}};
}

// The minute as a count of seconds of its own scale since 1980-01-06 00:00:00.
std::int64_t minute_start_s(const CalendarTime& t) {
  return days_since_epoch(date_of(t)) * kSecondsPerDay + t.hour * kSecondsPerHourWhole + t.minute * kSecondsPerMinute;
}

// Leap seconds come at the end of a minute, so n of its beginning holds for the minute, second 60 included.
GpsTime gps_time_in_minute(std::int64_t minute_s, double second, TimeScale scale) {
  const double whole = std::floor(second);
  GpsTime out{minute_s + static_cast<std::int64_t>(whole), second - whole};
  if (scale == TimeScale::gpst) return out;
  const std::int64_t utc_minute_s = minute_s - minus_utc_s(scale);
  out.whole_s += leap_seconds_at_utc(utc_minute_s) - minus_utc_s(scale);
  return out;
}

bool ends_with_leap_second(std::int64_t minute_s, TimeScale scale) {
  if (scale == TimeScale::gpst) return false;
  const std::int64_t utc_s = minute_s - minus_utc_s(scale);
  return leap_seconds_at_utc(utc_s + kSecondsPerMinute) > leap_seconds_at_utc(utc_s);
}

}  // namespace

std::string fault_of(const CalendarTime& t, TimeScale scale) {
  if (t.year < 0 || t.year > 9999 || t.month < 1 || t.month > 12 || t.day < 1 || t.day > 31 || !date_of(t).ok()) {
    return "no date of the calendar";
  }
  if (!(t.hour >= 0 && t.hour < 24 && t.minute >= 0 && t.minute < 60 && t.second >= 0.0 && t.second < 61.0)) {
    return "no time of day";
  }
  const std::int64_t minute_s = minute_start_s(t);
  if (t.second >= 60.0 && !ends_with_leap_second(minute_s, scale)) return "no time of day (no leap second there)";
  if (minute_s < minus_utc_s(scale)) return "before GPS time began on 1980-01-06";
  return "";
}

GpsTime gps_time(const CalendarTime& time, TimeScale scale) {
  return gps_time_in_minute(minute_start_s(time), time.second, scale);
}

GpsTime gps_time(int week, double tow_s, TimeScale scale) {
  const double minute = std::floor(tow_s / static_cast<double>(kSecondsPerMinute));
  const std::int64_t minute_s = static_cast<std::int64_t>(minute) * kSecondsPerMinute;
  // whole and fraction of tow_s itself: subtracting the minute first would cost digits of the file
  const double whole = std::floor(tow_s);
  GpsTime out = gps_time_in_minute(week * kSecondsPerWeek + minute_s, whole - static_cast<double>(minute_s), scale);
  out.fraction_s = tow_s - whole;
  return out;
}

int leap_seconds(const GpsTime& time) {
  std::int64_t n = 0;
  for (const year_month_day& date : kLeapDays) {
    if (time.whole_s - (n + 1) >= days_since_epoch(date) * kSecondsPerDay) ++n;
  }
  return static_cast<int>(n);
}

bool after_known_leap_seconds(const GpsTime& time) {
  return time.whole_s > days_since_epoch(kLeapSecondsKnownTo) * kSecondsPerDay;
}

}  // namespace liealign
