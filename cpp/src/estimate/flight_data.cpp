// Observations of a flight in the order of time.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/estimate/flight_data.hpp"

#include <algorithm>

#include "liealign/observe/kinds.hpp"

namespace liealign {

void add_observations(const GnssFix& fix, const Vector3d& l_ba_b, std::vector<Observation>& to) {
  Observation o;
  o.t_s = fix.t_s;
  o.kind = &kGnssPosition;
  o.record = fix.record;
  o.y = fix.p_ea_e;
  o.R = fix.R_p_e;
  o.lever_b = l_ba_b;
  o.place_e = fix.p_ea_e;
  to.push_back(o);
  if (!fix.has_velocity) return;
  o.kind = &kGnssVelocity;
  o.y = fix.v_ea_e;
  o.R = fix.R_v_e;
  to.push_back(o);
}

void add_observations(const RestUpdate& rest, const RestNoise& noise, std::vector<Observation>& to) {
  Observation o;
  o.t_s = rest.t_s;
  o.kind = &kZeroVelocity;
  o.R = noise.zupt_std_mps * noise.zupt_std_mps * Matrix3d::Identity();
  o.span_s = rest.duration_s;
  to.push_back(o);
  o.kind = &kZeroRate;
  o.y = rest.mean_omega_ib_b;
  // What the means scatter by is seen, and may be more than the gyros' own noise.
  o.R = rest.std_omega_ib_b.cwiseAbs2().asDiagonal();
  o.root = noise.zaru_std_rps * Matrix3d::Identity();
  to.push_back(o);
}

void sort_observations(const ImuSeries& imu, std::vector<Observation>& observations) {
  const double begin_s = imu.front().t_s, end_s = imu.back().t_s;
  std::erase_if(observations, [&](const Observation& o) { return o.t_s <= begin_s || o.t_s > end_s; });
  const auto earlier = [](const Observation& a, const Observation& b) { return a.t_s < b.t_s; };
  if (!std::is_sorted(observations.begin(), observations.end(), earlier))
    std::stable_sort(observations.begin(), observations.end(), earlier);
}

void list_observations(FlightData& data) {
  data.observations.clear();
  data.observations.reserve(2 * (data.fixes.size() + data.rests.size()) + data.others.size());
  for (const GnssFix& fix : data.fixes) add_observations(fix, data.l_ba_b, data.observations);
  for (const RestUpdate& rest : data.rests) add_observations(rest, data.rest_noise, data.observations);
  data.observations.insert(data.observations.end(), data.others.begin(), data.others.end());
  sort_observations(data.imu(), data.observations);
}

}  // namespace liealign
