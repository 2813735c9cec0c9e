// Four numbers side by side that go through the same arithmetic: a scalar for the templates, of which the compiler makes
// vector instructions without shuffling numbers about. In each lane the same comes out, whatever the others hold.
//
// A comparison holds when it holds in every lane. Code that branches by one has to be right for lanes that differ; where it
// cannot be, for_lanes() goes through them one by one. A lane that fails is not finite and leaves the others alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace liealign {

struct Lanes {
  static constexpr int kCount = 4;
  using Numbers = Eigen::Array<double, kCount, 1>;
  Numbers x;

  Lanes() = default;
  Lanes(double value)
      : x(Numbers::Constant(value)) {}  // NOLINT(google-explicit-constructor): a number is one in every lane
  // NOLINTNEXTLINE(modernize-pass-by-value): registers are copied, not moved
  explicit Lanes(const Numbers& numbers) : x(numbers) {}

  Lanes& operator+=(const Lanes& b) {
    x += b.x;
    return *this;
  }
  Lanes& operator-=(const Lanes& b) {
    x -= b.x;
    return *this;
  }
  Lanes& operator*=(const Lanes& b) {
    x *= b.x;
    return *this;
  }
  Lanes& operator/=(const Lanes& b) {
    x /= b.x;
    return *this;
  }
  friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(Numbers(a.x + b.x)); }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(Numbers(a.x - b.x)); }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(Numbers(a.x * b.x)); }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(Numbers(a.x / b.x)); }
  friend Lanes operator-(const Lanes& a) { return Lanes(Numbers(-a.x)); }
  friend Lanes sqrt(const Lanes& a) { return Lanes(Numbers(a.x.sqrt())); }
  friend Lanes abs(const Lanes& a) { return Lanes(Numbers(a.x.abs())); }

  friend bool operator<(const Lanes& a, const Lanes& b) { return (a.x < b.x).all(); }
  friend bool operator<=(const Lanes& a, const Lanes& b) { return (a.x <= b.x).all(); }
  friend bool operator>(const Lanes& a, const Lanes& b) { return (a.x > b.x).all(); }
  friend bool operator>=(const Lanes& a, const Lanes& b) { return (a.x >= b.x).all(); }
  friend bool operator==(const Lanes& a, const Lanes& b) { return (a.x == b.x).all(); }
  friend bool operator!=(const Lanes& a, const Lanes& b) { return !(a == b); }
};

// f(number) of each lane.
template <typename Function>
Lanes for_lanes(const Lanes& a, const Function& f) {
  Lanes out;
  for (int i = 0; i < Lanes::kCount; ++i) out.x[i] = f(a.x[i]);
  return out;
}

inline Lanes log(const Lanes& a) {
  return for_lanes(a, [](double x) { return std::log(x); });
}
inline Lanes sin(const Lanes& a) {
  return for_lanes(a, [](double x) { return std::sin(x); });
}
inline Lanes cos(const Lanes& a) {
  return for_lanes(a, [](double x) { return std::cos(x); });
}
// Of any lane: the others may have failed.
inline bool isfinite(const Lanes& a) { return a.x.isFinite().any(); }

// One lane of a matrix, and a matrix into one lane.
template <int rows, int cols>
Eigen::Matrix<double, rows, cols> lane(const Eigen::Matrix<Lanes, rows, cols>& M, int i) {
  return M.unaryExpr([i](const Lanes& a) { return a.x[i]; });
}
template <int rows, int cols>
void set_lane(Eigen::Matrix<Lanes, rows, cols>& M, int i, const Eigen::Matrix<double, rows, cols>& numbers) {
  for (int k = 0; k < rows * cols; ++k) M.data()[k].x[i] = numbers.data()[k];
}
inline double lane(const Lanes& a, int i) { return a.x[i]; }
inline void set_lane(Lanes& a, int i, double number) { a.x[i] = number; }

}  // namespace liealign

namespace Eigen {
template <>
struct NumTraits<liealign::Lanes> : NumTraits<double> {
  using Real = liealign::Lanes;
  using NonInteger = liealign::Lanes;
  using Nested = liealign::Lanes;
  using Literal = liealign::Lanes;
  enum { RequireInitialization = 0 };
};
}  // namespace Eigen
