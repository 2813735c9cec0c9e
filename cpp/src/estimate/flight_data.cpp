// Events of a flight in the order of time.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/flight_data.hpp"

#include <algorithm>

namespace liealign {

void merge_events(FlightData& data) {
  data.events.clear();
  const double begin = data.imu().front().t_s, end = data.imu().back().t_s;
  const auto inside = [&](double t) { return t > begin && t <= end; };
  for (std::size_t i = 0; i < data.fixes.size(); ++i) {
    if (inside(data.fixes[i].t_s)) data.events.push_back({data.fixes[i].t_s, Event::Kind::fix, i});
  }
  for (std::size_t i = 0; i < data.rests.size(); ++i) {
    if (inside(data.rests[i].t_s)) data.events.push_back({data.rests[i].t_s, Event::Kind::rest, i});
  }
  std::stable_sort(data.events.begin(), data.events.end(),
                   [](const Event& a, const Event& b) { return a.t_s < b.t_s; });
}

}  // namespace liealign
