// Laws of the output: the trajectory of another point of the body, what the SBET files hold, and which epochs are wanted.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "flights.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/estimate/output_frame.hpp"
#include "liealign/pipeline/trajectory_files.hpp"

namespace liealign {
namespace {

using namespace testing;
using Model = LieModel<double>;

const Vector3d kPoint(0.4, -0.2, 0.3);

Belief<Model> some_belief() {
  Random random(5, 1);
  Belief<Model> b;
  b.X.first.C = C_n_e(0.7, -0.4) * C_b_n_from_rpy({0.2, -0.3, 2.1});
  b.X.first.v = Vector3d(12.0, -3.0, 1.0);
  b.X.first.p = ecef_from_geodetic({0.7, -0.4, 120.0});
  b.X.second.x << 0.01, -0.02, 0.03, 1e-3, -2e-3, 3e-3;
  Eigen::Matrix<double, 15, 15> A;
  for (int i = 0; i < A.size(); ++i) A(i) = random.normal();
  b.P = 1e-4 * A * A.transpose();
  return b;
}

// As it stands at a node, with no error of the receiver.
NodeBelief whole_node(const Belief<Model>& b) { return node_belief<kNoTail>(b, Matrix3d::Zero()); }

OutputFrame some_frame() { return {kPoint, C_b_n_from_rpy({0.1, -1.4, 0.5})}; }

// The epoch's state as a function of the full error, and its covariance by numeric differentiation.
TEST(OutputFrame, covariance_is_the_jacobian_of_the_moved_state_times_P) {
  const Belief<Model> b = some_belief();
  const OutputFrame frame = some_frame();
  const Vector3d omega(0.8, -0.5, 0.3);
  const double variance = 1e-6, h = 1e-5;
  const Epoch at = epoch_of(1.0, whole_node(b), frame, omega, variance);

  // Nine numbers: attitude, velocity and position against the moved mean, along the wanted axes.
  const auto moved = [&](const Model::Tangent& eps, const Vector3d& noise) {
    Belief<Model> c = b;
    c.X = Model::retract(b.X, eps);
    const Epoch e = epoch_of(1.0, whole_node(c), frame, omega + noise, 0.0);
    Vector<double, 9> out;
    const Matrix3d C = at.X.first.C;
    out << SO3<double>{C.transpose() * e.X.first.C}.log(), C.transpose() * (e.X.first.v - at.X.first.v),
        C.transpose() * (e.X.first.p - at.X.first.p);
    return out;
  };
  Eigen::Matrix<double, 9, 15> J;
  for (int i = 0; i < 15; ++i) {
    const Model::Tangent eps = h * Model::Tangent::Unit(i);
    J.col(i) = (moved(eps, Vector3d::Zero()) - moved(-eps, Vector3d::Zero())) / (2.0 * h);
  }
  Eigen::Matrix<double, 9, 3> J_noise;
  for (int i = 0; i < 3; ++i) {
    const Vector3d noise = h * Vector3d::Unit(i);
    J_noise.col(i) = (moved(Model::Tangent::Zero(), noise) - moved(Model::Tangent::Zero(), -noise)) / (2.0 * h);
  }
  const SquareMatrix<double, 9> P = J * b.P * J.transpose() + variance * J_noise * J_noise.transpose();
  const double tolerance = 1e-7 * P.norm();  // of the central difference on metres of 6e6
  EXPECT_LT((at.P_phi - P.block<3, 3>(0, 0)).norm(), tolerance);
  EXPECT_LT((at.P_nu - P.block<3, 3>(3, 3)).norm(), tolerance);
  EXPECT_LT((at.P_rho - P.block<3, 3>(6, 6)).norm(), 1e-4 * P.norm());  // positions have nanometres, over h
}

TEST(OutputFrame, velocity_is_the_derivative_of_the_position) {
  // A body turning at a constant rate about a point that moves straight on.
  const Vector3d omega_eb_b(0.3, -0.2, 0.9);
  Belief<Model> b = some_belief();
  const OutputFrame frame = some_frame();
  const auto at = [&](double t) {
    Belief<Model> c = b;
    c.X.first.C = b.X.first.C * SO3<double>::exp(t * omega_eb_b).C;
    c.X.first.p = b.X.first.p + t * b.X.first.v;
    const Vector3d omega_ib_b = omega_eb_b + c.X.first.C.transpose() * wgs84::omega_ie_e<double>() + b_g(c.X);
    return epoch_of(t, whole_node(c), frame, omega_ib_b, 0.0);
  };
  const double h = 1e-3;
  const Vector3d derivative = (at(h).X.first.p - at(-h).X.first.p) / (2.0 * h);
  EXPECT_LT((at(0.0).X.first.v - derivative).norm(), 2e-6);  // a nanometre of a position over h, and h^2
}

TEST(OutputFrame, without_arm_and_boresight_it_is_the_IMU_to_the_last_bit) {
  const Belief<Model> b = some_belief();
  const Epoch moved = epoch_of(2.0, whole_node(b), {}, Vector3d(1.0, 2.0, 3.0), 1.0),
              imu = epoch_of(2.0, whole_node(b));
  EXPECT_EQ(moved.X.first.p, imu.X.first.p);
  EXPECT_EQ(moved.P_nu, imu.P_nu);
  EXPECT_TRUE(output_frame(Config{}).is_imu());
}

// ---- a flight -----------------------------------------------------------------------------------------------------

struct Processed {
  PreparedFlight prepared;
  HeadingResult heading;
  Solution solution;
};

const SimulatedFlight& flight() {
  static const SimulatedFlight simulated = table_1_flight(70.0, 4);
  return simulated;
}

Processed run(const std::function<void(OutputConfig&)>& change, bool keep_events = false) {
  static const HeadingResult heading = align(prepare_flight(flight().flight));  // the output does not touch it
  Flight changed = flight().flight;
  change(changed.config.output);
  const PreparedFlight prepared = prepare_flight(changed);
  return {prepared, heading, process(prepared, heading, {}, keep_events)};
}

const Processed& whole() {
  static const Processed all = run([](OutputConfig& o) { o.filtered = true; }, true);
  return all;
}

TEST(Output, another_point_and_other_axes_are_where_the_truth_puts_them) {
  const Processed r = run([](OutputConfig& o) {
    o.reference_point_b_m = {kPoint.x(), kPoint.y(), kPoint.z()};
    o.boresight_deg = {0.0, -90.0, 0.0};
    o.filtered = true;
  });
  const Matrix3d C_r_b = C_b_n_from_rpy({0.0, -0.5 * kPi, 0.0});
  double worst_p = 0.0, worst_v = 0.0, worst_angle = 0.0;
  for (const Epoch& e : r.solution.smoothed) {
    const SE23<double> truth = truth_at(flight().truth, e.t_s);
    worst_p = std::max(worst_p, (e.X.first.p - truth.p - truth.C * kPoint).norm());
    worst_angle = std::max(worst_angle, SO3<double>{e.X.first.C.transpose() * truth.C * C_r_b}.log().norm());
    worst_v = std::max(worst_v, (e.X.first.v - truth.v).norm());
  }
  EXPECT_LT(worst_p, 0.05);
  EXPECT_LT(worst_angle * kRadToDeg, 0.3);
  EXPECT_GT(worst_v, 0.05) << "the arm swings: its velocity is not that of the IMU";
  ASSERT_EQ(r.solution.filtered.size(), r.solution.smoothed.size());
  const Epoch &last = r.solution.filtered.back(), &imu = whole().solution.filtered.back();
  EXPECT_LT((last.X.first.p - imu.X.first.p - imu.X.first.C * kPoint).norm(), 1e-8);
}

TEST(Output, rate_and_span_choose_rows_of_the_whole_trajectory) {
  const Processed r = run([](OutputConfig& o) {
    o.rate_hz = 4.0;
    o.start_time_s = 1030.1;
    o.stop_time_s = 1050.0;
    o.filtered = true;
  });
  const std::vector<Epoch>& epochs = r.solution.smoothed;
  ASSERT_EQ(epochs.size(), 80U);  // 1030.25, 1030.5 ... 1050.0
  EXPECT_NEAR(epochs.front().t_s, 1030.26, 0.011) << "the first stamp of 50 Hz at or after the step";
  EXPECT_LE(epochs.back().t_s, 1050.0);
  std::size_t k = 0;
  for (const Epoch& e : epochs) {
    while (whole().solution.smoothed[k].t_s < e.t_s) ++k;
    EXPECT_EQ(whole().solution.smoothed[k].X.first.p, e.X.first.p);
    EXPECT_EQ(whole().solution.smoothed[k].P_phi, e.P_phi);
  }
  EXPECT_EQ(r.solution.filtered.size(), epochs.size());
  EXPECT_EQ(run([](OutputConfig& o) { o.rate_hz = 1e4; }).solution.smoothed.size(), whole().solution.smoothed.size());
}

TEST(Output, a_span_outside_the_trajectory_is_refused_before_the_work) {
  Flight changed = flight().flight;
  changed.config.output.start_time_s = 5000.0;
  EXPECT_THROW((void)prepare_flight(changed), InputError);
  changed.config.output.start_time_s = 1050.0;
  changed.config.output.stop_time_s = 1040.0;
  EXPECT_THROW((void)prepare_flight(changed), InputError);
  changed.config.output.stop_time_s = 1050.5;
  EXPECT_NO_THROW((void)prepare_flight(changed));
}

TEST(Output, at_events_filter_and_smoother_meet_at_the_end_and_the_smoother_knows_more_before) {
  const Solution& s = whole().solution;
  ASSERT_EQ(s.filtered_at_events.size(), s.smoothed_at_events.size());
  ASSERT_GT(s.filtered_at_events.size(), 30U);
  EXPECT_EQ(s.filtered_at_events.front().t_s, whole().prepared.t_begin_s);
  EXPECT_EQ(s.filtered_at_events.back().X.first.p, s.smoothed_at_events.back().X.first.p);
  for (std::size_t i = 0; i + 1 < s.filtered_at_events.size(); ++i) {
    EXPECT_EQ(s.filtered_at_events[i].t_s, s.smoothed_at_events[i].t_s);
    EXPECT_LE(s.smoothed_at_events[i].P_rho.trace(), 1.0001 * s.filtered_at_events[i].P_rho.trace());
  }
  EXPECT_TRUE(run([](OutputConfig&) {}).solution.smoothed_at_events.empty());
}

// The layout as published: 17 doubles from the start of the file, read by nothing but memcpy.
std::vector<std::vector<double>> records(const std::string& bytes, std::size_t width) {
  EXPECT_EQ(bytes.size() % (8 * width), 0U);
  std::vector<std::vector<double>> rows;
  for (std::size_t at = 0; at < bytes.size(); at += 8 * width) {
    rows.emplace_back(width);
    std::memcpy(rows.back().data(), bytes.data() + at, 8 * width);
  }
  return rows;
}

TrajectoryPart written(const PreparedFlight& flight, const std::vector<Epoch>& epochs, bool heading_std = true) {
  TrajectoryPart part;
  append_epochs(part, {.sbet = true}, flight, epochs, heading_std);
  return part;
}

TEST(Sbet, acceleration_and_rate_are_the_derivatives_of_the_trajectory) {
  const Processed r = run([](OutputConfig& o) { o.boresight_deg = {10.0, -20.0, 90.0}; });
  const std::vector<Epoch>& epochs = r.solution.smoothed;
  const auto rows = records(written(r.prepared, epochs).sbet, 17);
  ASSERT_EQ(rows.size(), epochs.size());
  double sum_a = 0.0, sum_w = 0.0, largest_a = 0.0;
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
    const double dt = epochs[i + 1].t_s - epochs[i - 1].t_s;
    const Matrix3d C = epochs[i].X.first.C;
    const Vector3d a = C.transpose() * (epochs[i + 1].X.first.v - epochs[i - 1].X.first.v) / dt;
    const Vector3d w = SO3<double>{epochs[i - 1].X.first.C.transpose() * epochs[i + 1].X.first.C}.log() / dt;
    sum_a += (Vector3d(rows[i].data() + 11) - a).squaredNorm();
    sum_w += (Vector3d(rows[i].data() + 14) - w).squaredNorm();
    largest_a = std::max(largest_a, a.norm());
    EXPECT_EQ(rows[i][10], 0.0);
  }
  const double n = static_cast<double>(rows.size());
  EXPECT_GT(largest_a, 2.0) << "the flight moves";
  EXPECT_LT(std::sqrt(sum_a / n), 0.05);  // one step of 20 ms of a manoeuvre, and the noise of the accelerometers
  EXPECT_LT(std::sqrt(sum_w / n), 0.01);
}

TEST(Sbet, records_hold_what_trajectory_csv_holds) {
  const Processed& r = whole();
  const std::vector<Epoch>& epochs = r.solution.smoothed;
  const auto sbet = records(written(r.prepared, epochs).sbet, 17);
  const auto smrmsg = records(written(r.prepared, epochs).smrmsg, 10);
  ASSERT_EQ(sbet.size(), smrmsg.size());
  for (std::size_t i = 0; i < sbet.size(); i += 97) {
    const NavRow row = nav_row(epochs[i]);
    EXPECT_EQ(sbet[i][0], row.t_s);
    EXPECT_EQ(sbet[i][1], row.lat_rad);
    EXPECT_EQ(sbet[i][2], row.lon_rad);
    EXPECT_EQ(sbet[i][3], row.height_m);
    EXPECT_EQ(Vector3d(sbet[i].data() + 4), row.v_n_mps);
    EXPECT_EQ(Vector3d(sbet[i].data() + 7), row.rpy_rad);
    EXPECT_EQ(smrmsg[i][0], row.t_s);
    EXPECT_EQ(Vector3d(smrmsg[i].data() + 1), row.std_p_n_m);
    EXPECT_EQ(Vector3d(smrmsg[i].data() + 4), row.std_v_n_mps);
    EXPECT_NEAR(smrmsg[i][9], row.std_rpy_rad[2] * 180.0 / kPi * 60.0, 1e-12);
  }
  const auto unknown = records(written(r.prepared, epochs, false).smrmsg, 10);
  EXPECT_EQ(unknown.front()[9], 10800.0);
}

TEST(ImuAtStamp, is_the_line_through_the_middles_of_the_two_samples) {
  ImuSeries imu(5);
  for (std::size_t k = 0; k < imu.size(); ++k) imu[k].t_s = 0.01 * static_cast<double>(k * k);  // unequal steps
  const auto rate = [](double t) { return Vector3d(1.0 + 2.0 * t, -t, 3.0); };
  for (std::size_t k = 1; k < imu.size(); ++k) imu[k].omega_ib_b = rate(0.5 * (imu[k - 1].t_s + imu[k].t_s));
  for (std::size_t k = 1; k + 1 < imu.size(); ++k)
    EXPECT_LT((imu_at_stamp(imu, k).omega_ib_b - rate(imu[k].t_s)).norm(), 1e-15);
  EXPECT_EQ(imu_at_stamp(imu, 0).omega_ib_b, imu[1].omega_ib_b);
  EXPECT_EQ(imu_at_stamp(imu, 4).omega_ib_b, imu[4].omega_ib_b);
  imu[3].gap_s = 0.05;
  EXPECT_EQ(imu_at_stamp(imu, 2).omega_ib_b, imu[2].omega_ib_b);
  EXPECT_EQ(imu_at_stamp(imu, 3).omega_ib_b, imu[4].omega_ib_b);
}

}  // namespace
}  // namespace liealign
