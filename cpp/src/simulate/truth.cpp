// Inverse strapdown along a reference, (Eq. 42)-(Eq. 43), and the random numbers of the simulator.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/simulate/trajectory.hpp"

namespace liealign {

namespace {

void check(const std::vector<TruthEpoch>& reference, int oversample) {
  if (oversample < 1) throw Error("simulate: oversample is " + std::to_string(oversample) + "; expected 1 or more");
  const auto n = static_cast<std::size_t>(oversample);
  if (reference.size() < n + 1 || (reference.size() - 1) % n != 0) {
    throw Error("simulate: the reference has " + std::to_string(reference.size()) +
                " epochs; expected a multiple of oversample = " + std::to_string(oversample) + " plus one");
  }
  for (std::size_t k = 1; k < reference.size(); ++k) {
    if (reference[k].t_s > reference[k - 1].t_s) continue;
    throw Error("simulate: epoch " + std::to_string(k) + " of the reference is at " + std::to_string(reference[k].t_s) +
                " s; expected a time after " + std::to_string(reference[k - 1].t_s) + " s");
  }
}

}  // namespace

Truth truth_from_reference(const std::vector<TruthEpoch>& reference, Mechanization kind, GravityModel model,
                           int oversample) {
  check(reference, oversample);
  const auto n = static_cast<std::size_t>(oversample);
  Truth truth;
  truth.epochs.reserve((reference.size() - 1) / n + 1);
  truth.imu.reserve(truth.epochs.capacity());
  truth.epochs.push_back(reference.front());
  truth.imu.push_back({reference.front().t_s});
  SE23<double> X = reference.front().X;
  Vector3d angle = Vector3d::Zero(), velocity = Vector3d::Zero();  // integrals of rate and force since the last sample
  for (std::size_t k = 1; k < reference.size(); ++k) {
    const double dt = reference[k].t_s - reference[k - 1].t_s;
    // The exact inverse needs the position reached, for v' = v + omega_ie x p. The trapezoid gives it within 0.1 um at
    // 200 Hz, 1e-11 m/s in v; the reference's own would put its distance from the truth into the velocity.
    SE23<double> target = reference[k].X;
    target.p = X.p + 0.5 * dt * (X.v + target.v);
    const ImuInput<double> u = inverse_mechanize(X, target, dt, kind, model);
    X = mechanize(X, u, kind, model);
    angle += dt * u.omega_ib_b;
    velocity += dt * u.f_ib_b;
    if (k % n != 0) continue;
    const double t = reference[k].t_s, interval = t - reference[k - n].t_s;
    // One step: its own input, to the bit, not (w dt) / dt.
    truth.imu.push_back(n == 1 ? ImuSample{t, u.omega_ib_b, u.f_ib_b}
                               : ImuSample{t, angle / interval, velocity / interval});
    truth.epochs.push_back({t, X});
    angle.setZero();
    velocity.setZero();
  }
  truth.imu[0].omega_ib_b = truth.imu[1].omega_ib_b;
  truth.imu[0].f_ib_b = truth.imu[1].f_ib_b;
  return truth;
}

Truth drone_truth(const DroneFlight& flight, Mechanization kind, GravityModel model) {
  return truth_from_reference(drone_reference(flight), kind, model, flight.oversample);
}

// Seeds are mixed by the finaliser of SplitMix64 (Steele, Lea & Flood 2014), so that neighbouring seeds and streams
// give unrelated sequences.
Random::Random(std::uint64_t seed, std::uint64_t stream) {
  const auto mix = [](std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  };
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15ULL;
  engine_.seed(mix(mix(seed + kGolden) + kGolden * (stream + 1)));
}

double Random::uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  const double angle = 2.0 * kPi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

Vector3d Random::normal3() {
  Vector3d w;
  for (int i = 0; i < 3; ++i) w[i] = normal();
  return w;
}

Vector3d Random::unit3() {
  const double z = 2.0 * uniform() - 1.0;
  const double angle = 2.0 * kPi * uniform();
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace liealign
