// The tables and binary files of a run.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/trajectory_files.hpp"

#include <array>
#include <limits>

#include "liealign/core/units.hpp"
#include "liealign/earth/gravity.hpp"
#include "liealign/estimate/output_frame.hpp"
#include "liealign/io/sbet.hpp"
#include "liealign/pipeline/results.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign {
namespace {

constexpr std::size_t kTrajectoryColumns = 22, kBiasColumns = 13;
constexpr double kRadToArcMinutes = 60.0 * kRadToDeg;
constexpr double kUnknownHeading_arcmin = 180.0 * 60.0;

void put3(double* cells, const Vector3d& v, double factor = 1.0) {
  for (int i = 0; i < 3; ++i) cells[i] = factor * v[i];
}

void put_update(double* cells, const std::optional<FixUpdate>& update) {
  if (!update) return;
  put3(cells, update->residual_n);
  put3(cells + 3, update->std_n);
  cells[6] = update->nis;
  cells[7] = update->weight;
}

// (Eq. 49) in body axes.
struct BodyMotion {
  Vector3d a, omega;
};

BodyMotion body_motion(const ImuAtStamp& imu, const NavState<double>& X, const Matrix3d& C_b_e, GravityModel gravity) {
  const Vector3d omega_ie = wgs84::omega_ie_e<double>();
  const Vector3d pull = gravity_e(X.first.p, gravity) - 2.0 * omega_ie.cross(X.first.v);
  return {imu.f_ib_b - b_a(X) + C_b_e.transpose() * pull, imu.omega_ib_b - b_g(X) - C_b_e.transpose() * omega_ie};
}

void append_csv(std::string& out, const std::vector<CsvColumn>& columns, const NavRow& row, bool heading_std) {
  std::array<double, kTrajectoryColumns> c;
  c[0] = row.t_s;
  c[1] = row.lat_rad * kRadToDeg;
  c[2] = row.lon_rad * kRadToDeg;
  c[3] = row.height_m;
  put3(&c[4], row.v_n_mps);
  put3(&c[7], row.rpy_rad, kRadToDeg);
  if (c[9] >= 360.0 - 5e-7) c[9] = 0.0;  // 360.000000 is not in [0, 360)
  put3(&c[10], row.std_p_n_m);
  put3(&c[13], row.std_v_n_mps);
  put3(&c[16], row.std_rpy_rad, kRadToDeg);
  if (!heading_std) c[18] = std::numeric_limits<double>::quiet_NaN();
  put3(&c[19], row.relative_std_p_n_m);
  append_csv_row(out, columns, c.data());
}

void append_biases(std::string& out, const std::vector<CsvColumn>& columns, const Epoch& epoch) {
  std::array<double, kBiasColumns> c;
  c[0] = epoch.t_s;
  put3(&c[1], b_a(epoch.X));
  put3(&c[4], b_g(epoch.X));
  put3(&c[7], epoch.variance_b_a.cwiseSqrt());
  put3(&c[10], epoch.variance_b_g.cwiseSqrt());
  append_csv_row(out, columns, c.data());
}

SbetRecord sbet_record(const NavRow& row, const BodyMotion& motion, const Matrix3d& C_b_r) {
  SbetRecord r{};
  r.time_s = row.t_s;
  r.lat_rad = row.lat_rad;
  r.lon_rad = row.lon_rad;
  r.height_m = row.height_m;
  put3(r.v_mps, row.v_n_mps);
  r.roll_rad = row.rpy_rad[0];
  r.pitch_rad = row.rpy_rad[1];
  r.platform_heading_rad = row.rpy_rad[2];
  put3(r.a_b_mps2, C_b_r * motion.a);
  put3(r.omega_b_rps, C_b_r * motion.omega);
  return r;
}

SmrmsgRecord smrmsg_record(const NavRow& row, bool heading_std) {
  SmrmsgRecord r{};
  r.time_s = row.t_s;
  put3(r.std_p_n_m, row.std_p_n_m);
  put3(r.std_v_n_mps, row.std_v_n_mps);
  put3(r.std_rpy_arcmin, row.std_rpy_rad, kRadToArcMinutes);
  if (!heading_std) r.std_rpy_arcmin[2] = kUnknownHeading_arcmin;
  return r;
}

}  // namespace

bool states_heading_std(const HeadingResult& heading) {
  return heading.verdict == "aligned" || heading.verdict == "weak";
}

std::vector<CsvColumn> trajectory_columns() {
  return {{"time_s", 6},           {"lat_deg", 11},        {"lon_deg", 11},        {"height_m", 5},
          {"vn_mps", 6},           {"ve_mps", 6},          {"vd_mps", 6},          {"roll_deg", 6},
          {"pitch_deg", 6},        {"heading_deg", 6},     {"std_n_m", 5},         {"std_e_m", 5},
          {"std_d_m", 5},          {"std_vn_mps", 6},      {"std_ve_mps", 6},      {"std_vd_mps", 6},
          {"std_roll_deg", 6},     {"std_pitch_deg", 6},   {"std_heading_deg", 6}, {"relative_std_n_m", 5},
          {"relative_std_e_m", 5}, {"relative_std_d_m", 5}};
}

std::vector<CsvColumn> bias_columns() {
  std::vector<CsvColumn> columns = {{"time_s", 6}};
  for (const char* prefix : {"", "std_"}) {
    for (const char* axis : {"x", "y", "z"})
      columns.push_back({std::string(prefix) + "accel_bias_" + axis + "_mps2", 8});
    for (const char* axis : {"x", "y", "z"})
      columns.push_back({std::string(prefix) + "gyro_bias_" + axis + "_rps", 10});
  }
  return columns;
}

void append_epochs(TrajectoryPart& part, const TrajectoryText& wanted, const PreparedFlight& flight,
                   const std::vector<Epoch>& epochs, bool heading_std) {
  static const std::vector<CsvColumn> csv = trajectory_columns(), biases = bias_columns();
  const ImuSeries& imu = flight.data.imu();
  const Matrix3d C_b_r = output_frame(flight.config).C_r_b.transpose();
  std::size_t k = epochs.empty() ? 0 : cursor_at(imu, epochs.front().t_s).k - 1;
  for (const Epoch& epoch : epochs) {
    if (wanted.biases) append_biases(part.biases, biases, epoch);
    if (!wanted.csv && !wanted.sbet) continue;
    const NavRow row = nav_row(epoch);
    if (wanted.csv) append_csv(part.csv, csv, row, heading_std);
    if (!wanted.sbet) continue;
    while (imu[k].t_s < epoch.t_s) ++k;
    const BodyMotion motion =
        body_motion(imu_at_stamp(imu, k), epoch.X, epoch.X.first.C * C_b_r, flight.filter.dynamics.gravity);
    append_sbet(part.sbet, sbet_record(row, motion, C_b_r));
    append_smrmsg(part.smrmsg, smrmsg_record(row, heading_std));
  }
}

void write_innovations_csv(PartFile& file, const std::vector<FixRecord>& fixes) {
  const std::vector<CsvColumn> columns = {
      {"time_s", 6},       {"res_n_m", 5},        {"res_e_m", 5},    {"res_d_m", 5},    {"std_n_m", 5},
      {"std_e_m", 5},      {"std_d_m", 5},        {"nis", 4},        {"weight", 6},     {"res_vn_mps", 5},
      {"res_ve_mps", 5},   {"res_vd_mps", 5},     {"std_vn_mps", 5}, {"std_ve_mps", 5}, {"std_vd_mps", 5},
      {"nis_velocity", 4}, {"weight_velocity", 6}};
  const auto fill = [&](std::size_t i, double* c) {
    c[0] = fixes[i].t_s;
    put_update(c + 1, fixes[i].position);
    put_update(c + 9, fixes[i].velocity);
  };
  write_csv(file, columns, fixes.size(), fill, {"verdict", [&](std::size_t i) { return verdict_word(fixes[i]); }});
}

void write_updates_csv(PartFile& file, const ObservationKind& kind, const std::vector<UpdateRecord>& updates) {
  std::vector<CsvColumn> columns = {{"time_s", 6}};
  const std::string unit = kind.unit.empty() ? "" : "_" + std::string(kind.unit);
  for (const char* what : {"residual", "std"}) {
    for (int i = 1; i <= kind.rows; ++i)
      columns.push_back({what + (kind.rows > 1 ? "_" + std::to_string(i) : "") + unit, 6});
  }
  columns.push_back({"nis", 4});
  columns.push_back({"weight", 6});
  write_csv(file, columns, updates.size(), [&](std::size_t i, double* c) {
    const FixUpdate& u = updates[i].update;
    *c++ = updates[i].t_s;
    for (int row = 0; row < kind.rows; ++row) *c++ = kind.in_unit * u.residual_n[row];
    for (int row = 0; row < kind.rows; ++row) *c++ = kind.in_unit * u.std_n[row];
    *c++ = u.nis;
    *c = u.weight;
  });
}

Json sbet_side_file(const PreparedFlight& flight, const TrajectoryDigest& trajectory, bool heading_std) {
  const OutputConfig& output = flight.config.output;
  Json json;
  json["gps_week"] = flight.config.gnss.week;
  json["time_scale"] = "GPST";
  json["time"] = "seconds since the start of gps_week, on past its end; as the clock of the IMU log counts them";
  json["begin_time_s"] = trajectory.begin_s;
  json["end_time_s"] = trajectory.end_s;
  json["records"] = trajectory.epochs;
  json["datum"] = "that of the GNSS positions, on the ellipsoid WGS 84";
  json["height"] = "above the ellipsoid";
  json["velocity_axes"] = "north, east, down";
  json["wander_angle_rad"] = 0.0;
  json["heading"] = "platform heading = true heading, clockwise from north, 0 to 2 pi";
  json["heading_std"] = heading_std ? "one sigma" : "unknown: 10800 arc-minutes stand for it";
  json["attitude"] = "roll, pitch, heading (ZYX) of forward-right-down axes against north-east-down";
  json["reference_point"] = "from the IMU: forward, right, down";
  json["reference_point_b_m"] = JsonArray(output.reference_point_b_m.begin(), output.reference_point_b_m.end());
  json["boresight"] = "roll, pitch, yaw (ZYX) of the axes of this file in the body";
  json["boresight_deg"] = JsonArray(output.boresight_deg.begin(), output.boresight_deg.end());
  json["acceleration"] = "of the IMU against the Earth, gravity taken off, along the axes of this file";
  json["angular_rate"] = "against the Earth, along the axes of this file";
  json["sbet"] = "17 little-endian doubles a record";
  json["smrmsg"] = "10 little-endian doubles a record; attitude in arc-minutes; one sigma";
  return json;
}

}  // namespace liealign
