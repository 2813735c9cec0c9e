// Times as files write them (calendar or week and seconds; GPST, UTC or JST) to GPS time.
//
// GPST = UTC + n(UTC), n leap seconds since 1980-01-06 = (TAI - UTC) - 19 s; JST = UTC + 9 h.
// Source of n: IERS Bulletin C as in the leapseconds file of the IANA time zone data, release 2026.6.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace liealign {

enum class TimeScale { gpst, utc, jst };

// A calendar date and time of day in some time scale; second may reach 60 in a leap second.
struct CalendarTime {
  int year = 0;
  int month = 0;
  int day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0.0;
};

// Seconds since 1980-01-06 00:00:00 GPST; the fraction lies in [0, 1) and keeps the digits of the file.
struct GpsTime {
  std::int64_t whole_s = 0;
  double fraction_s = 0.0;
};

inline constexpr std::int64_t kSecondsPerWeek = 604800;

// The table holds every leap second from 1980-01-06 to this day; later ones are not known to this version.
inline constexpr std::chrono::year_month_day kLeapSecondsKnownTo{std::chrono::year{2027}, std::chrono::month{6},
                                                                 std::chrono::day{28}};

// What is wrong with a time, as the end of a sentence ("is ..."); empty when it exists in the scale.
std::string fault_of(const CalendarTime& time, TimeScale scale);

// Of a time without fault.
GpsTime gps_time(const CalendarTime& time, TimeScale scale);

// Of week >= 0 and 0 <= tow_s < 604800. In UTC and JST they count from 1980-01-06 in that scale, leap seconds left out,
// which is what RTKLIB writes.
GpsTime gps_time(int week, double tow_s, TimeScale scale);

// n at a GPS time, 0 for a date before the first leap second.
int leap_seconds(const GpsTime& time);

// Whether leap seconds after the end of the table could be missing at this time.
bool after_known_leap_seconds(const GpsTime& time);

}  // namespace liealign
