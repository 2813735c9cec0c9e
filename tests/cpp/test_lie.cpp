// Laws of the groups: axioms, closed forms against their defining series, Jacobians against numeric derivatives,
// over the angles and positions the design lists.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <vector>

#include "liealign/core/units.hpp"
#include "liealign/lie/gaussian.hpp"
#include "liealign/lie/product.hpp"
#include "liealign/lie/se23.hpp"
#include "liealign/lie/so3.hpp"
#include "liealign/lie/translation.hpp"

namespace liealign {
namespace {

using NavGroup = Product<SE23<double>, Translation<double, 6>>;

const std::vector<double> kAngles = {0,    1e-9, 1e-8,   1e-7,   1e-6, 1e-5, 1e-4,      1e-3,
                                     1e-2, 1e-1, 0.4999, 0.5001, 1,    3,    kPi - 1e-6};
const std::vector<double> kPositions = {0, 1, 6.4e6};

// Group-specific tangents: the first three entries are the rotation vector where there is one.
template <typename Group>
typename Group::Tangent tangent(double angle, double length, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  typename Group::Tangent xi;
  for (int i = 0; i < Group::Dim; ++i) xi[i] = normal(rng);
  if constexpr (Group::Dim >= 9) {
    xi.template segment<3>(3) *= 10.0 / xi.template segment<3>(3).norm();
    xi.template segment<3>(6) *= length / xi.template segment<3>(6).norm();
  }
  if constexpr (Group::Dim != 6) xi.template head<3>() *= angle / xi.template head<3>().norm();
  return xi;
}

// sum_k (+-)^k ad^k / (k + 1)!: the definition of the Jacobians, TAES (5), in long double.
template <typename Group>
typename Group::Jacobian jacobian_by_series(const typename Group::Tangent& xi, bool left) {
  using Wide = Eigen::Matrix<long double, Group::Dim, Group::Dim>;
  const Wide ad = Group::ad(xi).template cast<long double>() * (left ? 1.0L : -1.0L);
  Wide sum = Wide::Identity(), term = Wide::Identity();
  for (int k = 1; k < 60; ++k) {
    term = (term * ad / static_cast<long double>(k + 1)).eval();
    sum += term;
  }
  return sum.template cast<double>();
}

template <typename Group>
double difference(const Group& a, const Group& b) {
  return (a.inverse() * b).log().cwiseAbs().maxCoeff();
}

template <typename Group>
class GroupLaws : public ::testing::Test {
 protected:
  template <typename Check>
  void for_each_tangent(Check check) {
    std::mt19937 rng(7);
    for (double angle : kAngles) {
      for (double length : kPositions) {
        for (int draw = 0; draw < 5; ++draw) check(tangent<Group>(angle, length, rng), std::max(1.0, length), angle);
      }
    }
  }
};

using Groups = ::testing::Types<SO3<double>, SE23<double>, Translation<double, 6>, NavGroup>;
TYPED_TEST_SUITE(GroupLaws, Groups);

TYPED_TEST(GroupLaws, log_inverts_exp_below_pi) {
  this->for_each_tangent([](const auto& xi, double scale, double angle) {
    // Near pi the angle is known to sqrt(eps)-free accuracy through the quaternion; J_l^-1 grows like 1/(2 pi - angle).
    EXPECT_LT((TypeParam::exp(xi).log() - xi).cwiseAbs().maxCoeff(), 1e-14 * scale + 4e-15 * scale * angle) << angle;
  });
}

TYPED_TEST(GroupLaws, inverse_and_associativity) {
  std::mt19937 rng(11);
  this->for_each_tangent([&](const auto& xi, double scale, double) {
    const TypeParam X = TypeParam::exp(xi);
    EXPECT_LT((X * X.inverse()).log().cwiseAbs().maxCoeff(), 1e-14 * scale);
    const TypeParam Y = TypeParam::exp(tangent<TypeParam>(0.7, 1.0, rng)),
                    Z = TypeParam::exp(tangent<TypeParam>(1.9, 1.0, rng));
    EXPECT_LT(difference((X * Y) * Z, X * (Y * Z)), 2e-14 * scale);
  });
}

TYPED_TEST(GroupLaws, adjoint_moves_the_exponential_across) {
  std::mt19937 rng(13);
  this->for_each_tangent([&](const auto& xi, double scale, double) {
    const TypeParam X = TypeParam::exp(xi);
    const typename TypeParam::Tangent y = 0.3 * tangent<TypeParam>(1.0, 1.0, rng);
    const TypeParam left = X * TypeParam::exp(y) * X.inverse();
    const TypeParam right = TypeParam::exp(X.Ad() * y);
    EXPECT_LT(difference(left, right), 5e-14 * scale);
  });
}

TYPED_TEST(GroupLaws, small_adjoint_is_the_derivative_of_the_adjoint) {
  std::mt19937 rng(17);
  const typename TypeParam::Tangent xi = tangent<TypeParam>(1.0, 1.0, rng);
  const double h = 1e-6;
  const typename TypeParam::Jacobian numeric = (TypeParam::exp(h * xi).Ad() - TypeParam::exp(-h * xi).Ad()) / (2 * h);
  EXPECT_LT((numeric - TypeParam::ad(xi)).cwiseAbs().maxCoeff(), 1e-8);
}

TYPED_TEST(GroupLaws, jacobians_equal_their_defining_series) {
  this->for_each_tangent([](const auto& xi, double scale, double) {
    EXPECT_LT((TypeParam::left_jacobian(xi) - jacobian_by_series<TypeParam>(xi, true)).cwiseAbs().maxCoeff(),
              3e-15 * scale * 3);
    EXPECT_LT((TypeParam::right_jacobian(xi) - jacobian_by_series<TypeParam>(xi, false)).cwiseAbs().maxCoeff(),
              3e-15 * scale * 3);
  });
}

TYPED_TEST(GroupLaws, jacobian_inverses_invert) {
  this->for_each_tangent([](const auto& xi, double scale, double) {
    const typename TypeParam::Jacobian left = TypeParam::left_jacobian(xi) * TypeParam::left_jacobian_inverse(xi);
    const typename TypeParam::Jacobian right = TypeParam::right_jacobian(xi) * TypeParam::right_jacobian_inverse(xi);
    EXPECT_LT((left - TypeParam::Jacobian::Identity()).cwiseAbs().maxCoeff(), 1e-14 * scale);
    EXPECT_LT((right - TypeParam::Jacobian::Identity()).cwiseAbs().maxCoeff(), 1e-14 * scale);
  });
}

TYPED_TEST(GroupLaws, right_jacobian_is_the_numeric_derivative) {
  std::mt19937 rng(19);
  for (double angle : kAngles) {
    const typename TypeParam::Tangent xi = tangent<TypeParam>(angle, 1.0, rng);
    const typename TypeParam::Jacobian J = TypeParam::right_jacobian(xi);
    const TypeParam X = TypeParam::exp(xi);
    const double h = 1e-5;
    for (int i = 0; i < TypeParam::Dim; ++i) {
      const typename TypeParam::Tangent step = h * TypeParam::Tangent::Unit(i);
      const typename TypeParam::Tangent plus = (X.inverse() * TypeParam::exp(xi + step)).log();
      const typename TypeParam::Tangent minus = (X.inverse() * TypeParam::exp(xi - step)).log();
      // central difference: h^2 truncation times |v| = 10, and eps/h rounding
      EXPECT_LT(((plus - minus) / (2 * h) - J.col(i)).cwiseAbs().maxCoeff(), 5e-9) << angle;
    }
  }
}

TEST(So3, exp_coefficients_equal_their_series_in_long_double) {
  for (double angle : kAngles) {
    const ExpCoefficients<double> a = exp_coefficients<double>(angle * angle);
    for (int n = 0; n < 8; ++n) {
      long double term = 1, sum = 0;
      for (int k = 1; k <= n; ++k) term /= k;
      for (int k = 0; k < 40; ++k) {
        sum += term;
        term *= -static_cast<long double>(angle) * angle / ((2.0L * k + n + 1) * (2.0L * k + n + 2));
      }
      EXPECT_NEAR(a[static_cast<std::size_t>(n)], static_cast<double>(sum), n < 6 ? 2e-15 : 1e-14)
          << n << " at " << angle;
      if (angle < kSeriesAngle) {
        EXPECT_NEAR(a[static_cast<std::size_t>(n)] / static_cast<double>(sum), 1.0, 1e-15) << n;
      }
    }
  }
}

// Below the threshold and above it, side by side.
TEST(So3, exp_coefficients_of_lanes_are_those_of_each) {
  Lanes theta2;
  theta2.x << 0.0, 1e-4, 0.26, 9.0;
  const ExpCoefficients<Lanes> together = exp_coefficients(theta2);
  for (int i = 0; i < Lanes::kCount; ++i) {
    const ExpCoefficients<double> alone = exp_coefficients(theta2.x[i]);
    for (std::size_t n = 0; n < alone.size(); ++n) EXPECT_EQ(together[n].x[i], alone[n]) << i << " " << n;
  }
}

TEST(So3, gammas_equal_their_defining_series) {
  std::mt19937 rng(23);
  for (double angle : kAngles) {
    const Vector3d phi = tangent<SO3<double>>(angle, 0, rng);
    Matrix3d sums[4] = {};
    for (auto& s : sums) s.setZero();
    Matrix3d power = Matrix3d::Identity();
    for (int k = 0; k < 40; ++k) {
      for (int m = 0; m < 4; ++m) sums[m] += power / std::tgamma(k + m + 1.0);
      power = (power * hat(phi)).eval();
    }
    EXPECT_LT((gamma<0>(phi) - sums[0]).cwiseAbs().maxCoeff(), 3e-15 * (1 + angle * angle));
    EXPECT_LT((gamma<1>(phi) - sums[1]).cwiseAbs().maxCoeff(), 3e-15 * (1 + angle * angle));
    EXPECT_LT((gamma<2>(phi) - sums[2]).cwiseAbs().maxCoeff(), 3e-15 * (1 + angle * angle));
    EXPECT_LT((gamma<3>(phi) - sums[3]).cwiseAbs().maxCoeff(), 3e-15 * (1 + angle * angle));
  }
}

template <int m>
void check_gamma_derivative(double angle, std::mt19937& rng) {
  const Vector3d phi = tangent<SO3<double>>(angle, 0, rng), f(3.0, -5.0, -9.8);
  const Matrix3d analytic = gamma_times_vector_derivative<m>(phi, f, exp_coefficients<double>(phi.squaredNorm()));
  const double h = 1e-5;
  for (int i = 0; i < 3; ++i) {
    const Vector3d step = h * Vector3d::Unit(i);
    const Vector3d numeric = (gamma<m>(Vector3d(phi + step)) * f - gamma<m>(Vector3d(phi - step)) * f) / (2 * h);
    EXPECT_LT((numeric - analytic.col(i)).cwiseAbs().maxCoeff(), 3e-9) << m << " at " << angle;
  }
}

TEST(So3, gamma_times_vector_derivatives_equal_numeric_ones) {
  std::mt19937 rng(29);
  for (double angle : kAngles) {
    check_gamma_derivative<0>(angle, rng);
    check_gamma_derivative<1>(angle, rng);
    check_gamma_derivative<2>(angle, rng);
  }
}

TEST(So3, log_near_and_at_pi_returns_the_rotation) {
  for (double angle : {kPi - 1e-9, kPi - 1e-12, kPi}) {
    for (int i = 0; i < 3; ++i) {
      const Vector3d phi = angle * (Vector3d::Unit(i) + 0.1 * Vector3d::Ones()).normalized();
      const Matrix3d C = gamma<0>(phi);
      EXPECT_LT((gamma<0>(SO3<double>{C}.log()) - C).cwiseAbs().maxCoeff(), 1e-14);
    }
  }
}

TEST(So3, vee_inverts_hat) {
  const Vector3d x(1, -2, 3), y(4, 5, -6);
  EXPECT_EQ(vee<double>(hat(x)), x);
  EXPECT_EQ(hat(x) * y, x.cross(y));
}

TEST(ConcentratedGaussian, samples_have_the_mean_and_covariance_they_were_drawn_with) {
  std::mt19937 rng(31);
  std::normal_distribution<double> normal;
  const NavGroup mean = NavGroup::exp(tangent<NavGroup>(2.0, 6.4e6, rng));
  NavGroup::Jacobian A;
  for (int i = 0; i < NavGroup::Dim; ++i)
    for (int j = 0; j < NavGroup::Dim; ++j) A(i, j) = normal(rng);
  const NavGroup::Jacobian P = 1e-3 * (A * A.transpose() / NavGroup::Dim + NavGroup::Jacobian::Identity());
  NavGroup::Tangent sum = NavGroup::Tangent::Zero();
  NavGroup::Jacobian outer = NavGroup::Jacobian::Zero();
  const int n = 20000;
  double mahalanobis = 0;
  for (int k = 0; k < n; ++k) {
    NavGroup::Tangent unit;
    for (int i = 0; i < NavGroup::Dim; ++i) unit[i] = normal(rng);
    const NavGroup X = sample_concentrated_gaussian(mean, P, unit);
    const NavGroup::Tangent eps = (mean.inverse() * X).log();
    sum += eps;
    outer += eps * eps.transpose();
    // density at X against density at the mean gives the Mahalanobis distance
    mahalanobis +=
        -2 * (concentrated_gaussian_log_density(X, mean, P) - concentrated_gaussian_log_density(mean, mean, P));
  }
  const double largest = P.diagonal().maxCoeff();
  EXPECT_LT((sum / n).cwiseAbs().maxCoeff(), 5 * std::sqrt(largest / n));
  EXPECT_LT((outer / n - P).cwiseAbs().maxCoeff(), 6 * largest * std::sqrt(2.0 / n));
  EXPECT_NEAR(mahalanobis / n, NavGroup::Dim, 5 * std::sqrt(2.0 * NavGroup::Dim / n));
}

TEST(ConcentratedGaussian, density_integrates_to_one_on_the_line) {
  using Line = Translation<double, 1>;
  Line::Jacobian P;
  P << 0.04;
  double integral = 0;
  for (double x = -3; x < 3; x += 1e-3) {
    Line X;
    X.x << x;
    integral += 1e-3 * std::exp(concentrated_gaussian_log_density(X, Line{}, P));
  }
  EXPECT_NEAR(integral, 1.0, 1e-9);
}

TEST(ConcentratedGaussian, refuses_an_indefinite_covariance) {
  EXPECT_THROW(sample_concentrated_gaussian(SO3<double>{}, Matrix3d(-Matrix3d::Identity()), Vector3d(0, 0, 0)),
               NumericalError);
}

}  // namespace
}  // namespace liealign
