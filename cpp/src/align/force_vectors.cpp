// The vectors of (Eq. 56).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/force_vectors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "liealign/earth/geodesy.hpp"
#include "liealign/earth/gravity.hpp"
#include "liealign/estimate/forward.hpp"
#include "liealign/lie/so3.hpp"

namespace liealign {
namespace {

constexpr double kSpan_s = 1.0;     // of a difference, at least
constexpr double kStride_s = 0.45;  // between differences
constexpr double kLongest = 1.6;    // times what was wanted: else fixes are missing
constexpr double kNode_s = 0.0075;

}  // namespace

ForceVectors::ForceVectors(const ImuSeries& imu, const std::vector<GnssFix>& fixes, Vector3d l_ba_b, double t_ref_s,
                           double t_end_s, const Vector3d& b_g_rps)
    : l_ba_b_(std::move(l_ba_b)) {
  constexpr double kBeyond_s = 1.5;  // where a latency may reach
  integrate(imu, t_ref_s, t_end_s + kBeyond_s, b_g_rps);
  difference(fixes, t_ref_s - kBeyond_s, t_end_s + kBeyond_s);
}

void ForceVectors::integrate(const ImuSeries& imu, double t_ref_s, double t_end_s, const Vector3d& b_g_rps) {
  constexpr double kMean_s = 3.0;
  Node now{t_ref_s, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Matrix3d::Identity(), Matrix3d::Zero()};
  nodes_ = {now};
  double averaged_s = 0.0;
  for (std::size_t k = cursor_at(imu, t_ref_s).k; k < imu.size() && now.t_s < t_end_s; ++k) {
    const double dt = imu[k].t_s - now.t_s;
    const Vector3d omega = imu[k].omega_ib_b - b_g_rps;
    const Matrix3d half = gamma<0>(Vector3d(0.5 * dt * omega));
    const Matrix3d C_middle = now.C * half;
    const Vector3d step = dt * (C_middle * imu[k].f_ib_b);
    now.S += dt * (now.V + 0.5 * step);
    now.V += step;
    now.G += dt * C_middle;
    now.C = C_middle * half;
    now.v_l = now.C * omega.cross(l_ba_b_);
    now.t_s = imu[k].t_s;
    if (now.t_s - nodes_.back().t_s >= kNode_s) nodes_.push_back(now);
    if (now.t_s > t_ref_s + kMean_s) continue;
    mean_force_ += dt * imu[k].f_ib_b;
    averaged_s += dt;
  }
  if (averaged_s > 0.0) mean_force_ /= averaged_s;
}

// Of velocities or second ones of positions, whichever the receiver states to be the less noisy.
void ForceVectors::difference(const std::vector<GnssFix>& fixes, double t_ref_s, double t_end_s) {
  std::vector<const GnssFix*> used;
  std::size_t with_velocity = 0;
  double variance_p = 0.0, variance_v = 0.0;
  for (const GnssFix& f : fixes) {
    if (f.t_s < t_ref_s || f.t_s > t_end_s) continue;
    used.push_back(&f);
    variance_p += f.R_p_e.trace();
    with_velocity += f.has_velocity ? 1 : 0;
    variance_v += f.R_v_e.trace();
  }
  // Over a second or more: p_3 - 2 p_2 + p_1 against v_2 - v_1.
  velocities_ = 2 * with_velocity > used.size() && 2.0 * variance_v < 6.0 * variance_p;
  if (velocities_) std::erase_if(used, [](const GnssFix* f) { return !f->has_velocity; });
  if (used.size() < 3) return;
  const Vector3d p_0 = used.front()->p_ea_e;
  const Matrix3d C_e_n = C_n_e(p_0).transpose();
  const Vector3d g_n(0.0, 0.0, gravity_e(p_0, GravityModel::normal).norm());
  const double interval = (used.back()->t_s - used.front()->t_s) / static_cast<double>(used.size() - 1);
  const double span = std::max(kSpan_s, interval);
  // The first one from `from` on at least a span later.
  const auto next = [&](std::size_t from) {
    std::size_t j = from + 1;
    while (j < used.size() && used[j]->t_s < used[from]->t_s + span - 0.3 * interval) ++j;
    return j;
  };
  double last_s = used.front()->t_s - kStride_s;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]->t_s < last_s + kStride_s) continue;
    const std::size_t j = next(i), k = velocities_ || j >= used.size() ? j : next(j);
    if (k >= used.size()) break;
    const double first = used[j]->t_s - used[i]->t_s, second = used[k]->t_s - used[j]->t_s;
    if (first > kLongest * span || second > kLongest * span) continue;
    last_s = used[i]->t_s;
    Vector3d a_e;
    if (velocities_) {
      a_e = (used[j]->v_ea_e - used[i]->v_ea_e) / first;
    } else {
      a_e = 2.0 / (first + second) *
            ((used[k]->p_ea_e - used[j]->p_ea_e) / second - (used[j]->p_ea_e - used[i]->p_ea_e) / first);
    }
    differences_.push_back({{used[i]->t_s, used[j]->t_s, used[k]->t_s}, C_e_n * a_e - g_n});
  }
}

ForceVectors::Node ForceVectors::at(double t_s) const {
  const auto later = [](double t, const Node& n) { return t < n.t_s; };
  const auto after =
      std::clamp(std::upper_bound(nodes_.begin(), nodes_.end(), t_s, later), nodes_.begin() + 1, nodes_.end() - 1);
  const Node &a = *(after - 1), &b = *after;
  const double dt = t_s - a.t_s, x = dt / (b.t_s - a.t_s);
  return {t_s,
          a.V + x * (b.V - a.V),
          a.S + dt * (a.V + 0.5 * x * (b.V - a.V)),
          a.v_l + x * (b.v_l - a.v_l),
          a.C + x * (b.C - a.C),
          a.G + x * (b.G - a.G)};
}

std::vector<ForcePair> ForceVectors::pairs(double begin_s, double end_s, double latency_s) const {
  std::vector<ForcePair> pairs;
  if (nodes_.size() < 3) return pairs;
  const Matrix3d G_begin = at(begin_s).G;
  for (const Difference& d : differences_) {
    const double t[3] = {d.t_s[0] - latency_s, d.t_s[1] - latency_s, d.t_s[2] - latency_s};
    if (t[0] < std::max(begin_s, nodes_.front().t_s) || t[2] > std::min(end_s, nodes_.back().t_s)) continue;
    const Node first = at(t[0]), last = at(t[2]);
    ForcePair pair;
    pair.alpha = d.alpha;
    if (velocities_) {
      pair.beta = (last.V + last.v_l - first.V - first.v_l) / (t[2] - t[0]);
    } else {
      const Node mid = at(t[1]);
      const auto p = [&](const Node& n) -> Vector3d { return n.S + n.C * l_ba_b_; };
      pair.beta = 2.0 / (t[2] - t[0]) * ((p(last) - p(mid)) / (t[2] - t[1]) - (p(mid) - p(first)) / (t[1] - t[0]));
    }
    const Node middle = at(0.5 * (t[0] + t[2]));
    pair.C = middle.C;
    pair.G = middle.G - G_begin;
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace liealign
