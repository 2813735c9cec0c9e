// Initial conditions from a rest: levelling, gyro bias, position; and a belief turned to a given heading.
//
//   pitch = atan2(f_x, hypot(f_y, f_z)), roll = atan2(-f_y, -f_z)                                (Eq. 35)
//   b_g = mean(w) - C_e_b omega_ie,  b_a = mean(f) (1 - |g|/|mean(f)|),  p = p_ea - C l
//   P_phiphi = C_n_b diag(sigma_NE^2, sigma_NE^2, sigma_psi^2) C_b_n,  rho = C^T dp_ea + l x phi     (Eq. 36)
//
// Source: TAES (26), DRONES (5), TAES P_0. The accelerometer bias along gravity is what |f| shows; its horizontal part
// and the tilt cannot be told apart at rest.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/align/rest.hpp"
#include "liealign/align/start_values.hpp"
#include "liealign/estimate/ekf.hpp"
#include "liealign/estimate/lie_model.hpp"

namespace liealign {

// What leads from one start to another, and the start that a correction leads to: its heading and its antenna stay.
StartCorrection correction_between(const NavState<double>& from, const NavState<double>& to);
NavState<double> corrected(const NavState<double>& start, const StartCorrection& correction, const Vector3d& l_ba_b);

// Roll and pitch [rad] from the mean specific force at rest, (Eq. 35).
Vector<double, 2> level(const Vector3d& mean_f_ib_b);

// The belief at rest with a given heading [rad, clockwise from north] and its standard deviation.
Belief<LieModel<double>> belief_at_rest(const RestStatistics& rest, double heading_rad, double heading_std_rad,
                                        const InitialStd& std, const Vector3d& l_ba_b, GravityModel gravity,
                                        const StartCorrection& correction = {});

// The belief in motion with a given heading and its standard deviation. The velocity does not turn with the heading: it is
// known from the fixes. phi as in (Eq. 36), nu and rho from the fixes.
Belief<LieModel<double>> belief_in_motion(const MotionStatistics& motion, double heading_rad, double heading_std_rad,
                                          const InitialStd& std, const Vector3d& l_ba_b,
                                          const StartCorrection& correction = {});

// Heading of a state, rad in (-pi, pi].
double heading_of(const NavState<double>& X);

// Turns the belief about local down through the antenna so that its heading is heading_rad, and replaces its heading
// variance: P <- Pi P Pi^T + sigma^2 u u^T, u the direction of that turn, Pi = I - u w^T, w = down in body axes.   (Eq. 37)
// The conditional candidate of the alignment is this with a standard deviation of zero.
void set_heading(Belief<LieModel<double>>& belief, double heading_rad, double heading_std_rad, const Vector3d& l_ba_b);

}  // namespace liealign
