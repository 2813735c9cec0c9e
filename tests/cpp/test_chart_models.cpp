// Laws of the classical models: their derivatives are those of their own errors, and they agree where errors are small.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "flights.hpp"
#include "liealign/core/error.hpp"
#include "liealign/estimate/chart_models.hpp"
#include "observations.hpp"

namespace liealign {
namespace {

using namespace testing;

template <typename Model>
class ChartModels : public ::testing::Test {
 public:
  // Central difference of a function of the state by the model's own error.
  template <typename Function>
  static Eigen::MatrixXd derivative(const NavState<double>& X, const Function& f) {
    const Vector<double, 15> step = default_steps();
    Eigen::MatrixXd J;
    for (int i = 0; i < 15; ++i) {
      const Vector<double, 15> eps = step[i] * Vector<double, 15>::Unit(i);
      const Eigen::VectorXd column = (f(Model::retract(X, eps)) - f(Model::retract(X, -eps))) / (2 * step[i]);
      if (i == 0) J.resize(column.size(), 15);
      J.col(i) = column;
    }
    return J;
  }
};
using Both = ::testing::Types<MekfModel, EulerModel>;
TYPED_TEST_SUITE(ChartModels, Both);

TYPED_TEST(ChartModels, retract_and_local_are_inverse) {
  std::mt19937 rng(1);
  for (int i = 0; i < 20; ++i) {
    const NavState<double> X = random_state(rng);
    Vector<double, 15> eps;
    eps << normal3(rng, 0.1), normal3(rng), normal3(rng, 10.0), normal3(rng, 0.01), normal3(rng, 1e-3);
    // ECEF coordinates carry a nanometre
    EXPECT_LT((TypeParam::local(X, TypeParam::retract(X, eps)) - eps).norm(), 1e-7);
  }
}

TYPED_TEST(ChartModels, transition_is_the_derivative_of_the_step) {
  std::mt19937 rng(2);
  for (int i = 0; i < 20; ++i) {
    const NavState<double> X = random_state(rng);
    const Vector3d omega = normal3(rng), f = normal3(rng, 5.0) + Vector3d(0, 0, -9.8);
    const auto next = [&](NavState<double> from) {
      TypeParam::step(from, omega, f, 0.01, Mechanization::exact, GravityModel::normal);
      return from;
    };
    NavState<double> X_next = X;
    const NavTransition<double> t = TypeParam::step(X_next, omega, f, 0.01, Mechanization::exact, GravityModel::normal);
    const Eigen::MatrixXd J = TestFixture::derivative(
        X, [&](const NavState<double>& from) -> Eigen::VectorXd { return TypeParam::local(X_next, next(from)); });
    EXPECT_LT((t.F - J.topLeftCorner<9, 9>()).cwiseAbs().maxCoeff(), 2e-5) << t.F - J.topLeftCorner<9, 9>();
    EXPECT_LT((t.B - J.topRightCorner<9, 6>()).cwiseAbs().maxCoeff(), 2e-5) << t.B - J.topRightCorner<9, 6>();
  }
}

TYPED_TEST(ChartModels, measurement_matrices_are_derivatives) {
  std::mt19937 rng(3);
  const Vector3d omega(0.4, -0.3, 0.8), f(0.5, -0.4, -9.8);
  for (const ObservationKind* kind : observation_kinds()) {
    for (int i = 0; i < 20; ++i) {
      const NavState<double> X = random_state(rng);
      const Observation o = some_observation(*kind, X, rng);
      const auto seen_at = [&](const NavState<double>& at) { return seen_of(o, at, omega, f); };
      const Eigen::MatrixXd J =
          TestFixture::derivative(X, [&](const NavState<double>& at) -> Eigen::VectorXd { return -seen_at(at).z; });
      Sighting<double> seen = seen_at(X);
      TypeParam::error_columns(X, seen.H);
      // That the local axes turn with the position is left out of the heading: 1.6e-7 rad/m.
      EXPECT_LT((seen.H - J).cwiseAbs().maxCoeff(), 1e-5) << kind->name;
    }
  }
}

TYPED_TEST(ChartModels, a_belief_goes_there_and_back) {
  std::mt19937 rng(4);
  const NavState<double> X = random_state(rng);
  const SquareMatrix<double, 15> A = SquareMatrix<double, 15>::Random();
  const Belief<LieModel<double>> lie{X, A * A.transpose()};
  EXPECT_LT((lie_belief(belief_in<TypeParam>(lie)).P - lie.P).norm(), 1e-12 * lie.P.norm());
}

TEST(EulerModel, says_where_its_angles_end) {
  NavState<double> X;
  X.first.p = ecef_from_geodetic({0.8, 0.2, 300});
  X.first.C = C_n_e(X.first.p) * C_b_n_from_rpy({0.1, 89.7 * kDegToRad, 0.3});
  Eigen::Matrix<double, 3, kTail> H = position_of(X.first, Vector3d(0, 0, 1)).H;
  EXPECT_THROW(EulerModel::error_columns(X, H), NumericalError);
  X.first.C = C_n_e(X.first.p) * C_b_n_from_rpy({0.1, 89.0 * kDegToRad, 0.3});
  EXPECT_NO_THROW(EulerModel::error_columns(X, H));
}

// From a heading that is nearly right, filter and smoother of all models come to the same.
TEST(ClassicalModels, agree_with_the_lie_model_where_errors_are_small) {
  Config config = with_given_parameters({});
  config.output.rate_hz = 1.0;
  const SimulatedFlight s = table_1_flight(203.0, 5, config);
  PreparedFlight prepared = prepare_flight(s.flight);
  const HeadingResult heading = align(prepared);
  const Solution lie = process(prepared, heading);
  for (const char* model : {"mekf", "euler"}) {
    prepared.config.filter.model = model;
    const Solution other = process(prepared, heading);
    ASSERT_EQ(other.smoothed.size(), lie.smoothed.size()) << model;
    for (std::size_t k = 0; k < lie.smoothed.size(); ++k) {
      const NavRow a = nav_row(lie.smoothed[k]), b = nav_row(other.smoothed[k]);
      for (int i = 0; i < 3; ++i) {
        EXPECT_LT(std::abs(wrap_pi(a.rpy_rad[i] - b.rpy_rad[i])), 0.05 * a.std_rpy_rad[i]) << model << " " << a.t_s;
        EXPECT_NEAR(b.std_rpy_rad[i], a.std_rpy_rad[i], 0.02 * a.std_rpy_rad[i]) << model << " " << a.t_s;
      }
    }
    EXPECT_NEAR(other.score.negative_log_likelihood, lie.score.negative_log_likelihood, 0.5) << model;
  }
}

}  // namespace
}  // namespace liealign
