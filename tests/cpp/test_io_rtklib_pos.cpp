// Laws of RTKLIB solution files: every form of one solution reads alike, times become GPST, what is wrong is refused.
//
// Rows marked "rnx2rtkp" were written by rnx2rtkp 2.4.3 b34 (Debian) from simulated observations; the others by hand
// from its layout.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/earth/geodesy.hpp"
#include "liealign/io/gps_time.hpp"
#include "liealign/io/rtklib_pos.hpp"
#include "liealign/io/text_file.hpp"

namespace liealign {
namespace {

const std::string kLegend =
    "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\r\n";
const std::string kColumns =
    "latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  "
    "ratio";
const std::string kVelocityColumns =
    "    vn(m/s)    ve(m/s)    vu(m/s)      sdvn     sdve     sdvu    sdvne    sdveu    sdvun";
const std::string kLlh = kLegend + "%  GPST                  " + kColumns + "\r\n";
const std::string kUtc = kLegend + "%  UTC                   " + kColumns + "\r\n";
const std::string kRow = " 48.5 2.25 205.0 1 9 0.01 0.02 0.03 0.002 -0.003 0.004 0.00 3.0";  // after the time
const std::string kEcefColumns =
    "     x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)  sdxy(m)  sdyz(m)  sdzx(m) age(s) "
    " "
    "ratio\r\n";

// rnx2rtkp: one solution in four forms.
const std::string kFormDeg =
    kLegend + "%  GPST                  " + kColumns +
    "\r\n"
    "2019/10/11 11:17:08.000   48.747973007    2.102081575   204.9843   1   6   0.0105   0.0100   0.0307   0.0033  "
    "-0.0135   0.0076   0.00    8.4\r\n"
    "2019/10/11 11:17:09.000   48.747959616    2.102122358   205.0018   1   6   0.0105   0.0100   0.0307   0.0034  "
    "-0.0135   0.0076   0.00    7.4\r\n";
const std::string kFormDms =
    "% obs start : 2019/10/11 11:16:48.0 UTC (week2074 472626.0s)\n" + kLegend +
    "%  UTC             latitude(d'\")   longitude(d'\")  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  "
    "sdeu(m)  sdue(m) age(s)  ratio\r\n"
    "2074 472610.000   48 44 52.70282    2 06 07.49367   204.9843   1   6   0.0105   0.0100   0.0307   0.0033  -0.0135 "
    "  0.0076   0.00    8.4\r\n"
    "2074 472611.000   48 44 52.65462    2 06 07.64049   205.0018   1   6   0.0105   0.0100   0.0307   0.0034  -0.0135 "
    "  0.0076   0.00    7.4\r\n";
const std::string kFormEcef =
    "% obs start : 2019/10/11 20:16:48.0 JST (week2074 472626.0s)\n"
    "% (x/y/z-ecef=WGS84,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\r\n"
    "%  JST                 ,     x-ecef(m),     y-ecef(m),     z-ecef(m),  Q, ns,  sdx(m),  sdy(m),  sdz(m), sdxy(m), "
    "sdyz(m), sdzx(m),age(s), ratio,   vx(m/s),   vy(m/s),   vz(m/s),     sdvx,    sdvy,    sdvz,   sdvxy,   sdvyz,   "
    "sdvzx\r\n"
    "2019/10/11 20:16:50.000,  4210846.4704,   154557.9180,  4772278.8721,  1,  6,  0.0206,  0.0095,  0.0253, -0.0108, "
    "-0.0108,  0.0203,  0.00,   8.4,   1.02292,   3.03510,  -1.00627,  0.54106, 0.28521, "
    "0.72520,-0.31812,-0.32703, 0.55526\r\n"
    "2019/10/11 20:16:51.000,  4210847.4908,   154560.9568,  4772277.9033,  1,  6,  0.0206,  0.0095,  0.0253, -0.0108, "
    "-0.0107,  0.0203,  0.00,   7.4,   1.02484,   3.02388,  -0.96291,  0.54112, 0.28518, "
    "0.72543,-0.31810,-0.32705, 0.55537\r\n";
const std::string kFormTab =
    "% ref pos   : 48.750697637\\t   2.101999999\\t  205.0071\n" + kLegend +
    "%  GPST                \t latitude(deg)\tlongitude(deg)\t height(m)\t  Q\t ns\t  sdn(m)\t  sde(m)\t  sdu(m)\t "
    "sdne(m)\t sdeu(m)\t sdun(m)\tage(s)\t ratio\r\n"
    "2019/10/11 11:17:08.000\t  48.747973007\t   2.102081575\t  204.9843\t  1\t  6\t  0.0105\t  0.0100\t  0.0307\t  "
    "0.0033\t -0.0135\t  0.0076\t  0.00\t   8.4\r\n"
    "2019/10/11 11:17:09.000\t  48.747959616\t   2.102122358\t  205.0018\t  1\t  6\t  0.0105\t  0.0100\t  0.0307\t  "
    "0.0034\t -0.0135\t  0.0076\t  0.00\t   7.4\r\n";
// rnx2rtkp with out-fieldsep=;, out-timesys=utc and out-outvel=on.
const std::string kSemicolons =
    kLegend +
    "%  UTC                 ; latitude(deg);longitude(deg); height(m);  Q; ns;  sdn(m);  sde(m);  sdu(m); sdne(m); "
    "sdeu(m); sdun(m);age(s); ratio;   vn(m/s);   ve(m/s);   vu(m/s);     sdvn;    sdve;    sdvu;   sdvne;   sdveu;   "
    "sdvun\r\n"
    "2019/10/11 11:16:50.000;  48.747973006;   2.102081575;  204.9863;  1;  6;  0.0106;  0.0100;  0.0307;  0.0033; "
    "-0.0135;  0.0076;  0.00;   8.7;  -1.48864;   2.98503;   0.02151;  0.03672; 0.03571; 0.07839; "
    "0.00843;-0.03450; 0.01942\r\n";

struct RtklibPosFile : testing::Test {
  std::filesystem::path directory;
  std::vector<std::string> warnings;

  void SetUp() override {
    directory = std::filesystem::temp_directory_path() / ("liealign_pos_" + std::to_string(std::random_device{}()));
    ASSERT_TRUE(std::filesystem::create_directories(directory));
  }
  void TearDown() override { std::filesystem::remove_all(directory); }

  std::string path(const std::string& name) const { return (directory / name).string(); }

  RtklibPos read(const std::string& text) {
    write_text_file(path("a.pos"), text);
    return read_rtklib_pos(path("a.pos"), warnings);
  }
  // The message without the directory.
  std::string error(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& e) {
      const std::string message = e.what();
      EXPECT_TRUE(message.starts_with(path(""))) << message;
      return message.substr(std::min(message.size(), path("").size()));
    }
    return "no error";
  }
  std::string warning(std::size_t i) const {
    return i < warnings.size() ? warnings[i].substr(path("").size()) : "no warning";
  }
  void expect_error(const std::string& text, const std::string& begin, const std::string& part = "") {
    const std::string message = error(text);
    EXPECT_TRUE(message.starts_with(begin)) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
};

// ---- Time

double seconds(const GpsTime& t) { return static_cast<double>(t.whole_s) + t.fraction_s; }

TEST(GpsTime, CalendarAndWeekAgree) {
  // RTKLIB's own header line: obs start : 2019/10/11 11:17:06.0 GPST (week2074 472626.0s).
  const double expected = 2074.0 * 604800.0 + 472626.0;
  EXPECT_EQ(seconds(gps_time({2019, 10, 11, 11, 17, 6.0}, TimeScale::gpst)), expected);
  EXPECT_EQ(seconds(gps_time(2074, 472626.0, TimeScale::gpst)), expected);
  EXPECT_EQ(seconds(gps_time({2019, 10, 11, 11, 16, 48.0}, TimeScale::utc)), expected);
  EXPECT_EQ(seconds(gps_time({2019, 10, 11, 20, 16, 48.0}, TimeScale::jst)), expected);
  EXPECT_EQ(seconds(gps_time(2074, 472608.0, TimeScale::utc)), expected);
  EXPECT_EQ(gps_time(2074, 604799.999, TimeScale::gpst).fraction_s, 604799.999 - 604799.0);
}

TEST(GpsTime, EveryLeapSecondIsOneSecondLong) {
  // IERS Bulletin C: last days of UTC with 86401 s since 1980.
  const std::vector<std::vector<int>> days = {
      {1981, 6, 30},  {1982, 6, 30},  {1983, 6, 30},  {1985, 6, 30}, {1987, 12, 31}, {1989, 12, 31},
      {1990, 12, 31}, {1992, 6, 30},  {1993, 6, 30},  {1994, 6, 30}, {1995, 12, 31}, {1997, 6, 30},
      {1998, 12, 31}, {2005, 12, 31}, {2008, 12, 31}, {2012, 6, 30}, {2015, 6, 30},  {2016, 12, 31}};
  int n = 0;
  for (const std::vector<int>& d : days) {
    const CalendarTime last{d[0], d[1], d[2], 23, 59, 59.5};
    CalendarTime leap = last;
    leap.second = 60.5;
    const bool june = d[1] == 6;
    const CalendarTime next{june ? d[0] : d[0] + 1, june ? 7 : 1, 1, 0, 0, 0.5};
    EXPECT_EQ(fault_of(leap, TimeScale::utc), "");
    EXPECT_NE(fault_of(leap, TimeScale::gpst), "");
    const double t = seconds(gps_time(last, TimeScale::utc));
    EXPECT_EQ(t - seconds(gps_time(last, TimeScale::gpst)), n);
    EXPECT_EQ(seconds(gps_time(leap, TimeScale::utc)), t + 1.0);
    EXPECT_EQ(seconds(gps_time(next, TimeScale::utc)), t + 2.0);
    EXPECT_EQ(leap_seconds(gps_time(last, TimeScale::utc)), n);
    EXPECT_EQ(leap_seconds(gps_time(next, TimeScale::utc)), n + 1);
    const CalendarTime jst_leap{next.year, next.month, next.day, 8, 59, 60.5};
    EXPECT_EQ(fault_of(jst_leap, TimeScale::jst), "");
    EXPECT_EQ(seconds(gps_time(jst_leap, TimeScale::jst)), t + 1.0);
    ++n;
  }
  EXPECT_EQ(n, 18);
}

TEST(GpsTime, ImpossibleTimesHaveAFault) {
  for (const CalendarTime& t :
       {CalendarTime{2019, 2, 29}, CalendarTime{2019, 13, 1}, CalendarTime{2019, 257, 1}, CalendarTime{2019, 1, 0},
        CalendarTime{2019, 1, 1, 24}, CalendarTime{2019, 1, 1, 0, 60}, CalendarTime{2019, 1, 1, 0, 0, 60.0},
        CalendarTime{2019, 1, 1, 0, 0, -1.0}, CalendarTime{1980, 1, 5, 23, 59, 59.0}, CalendarTime{19, 1, 1}}) {
    EXPECT_NE(fault_of(t, TimeScale::utc), "") << t.year << "/" << t.month << "/" << t.day;
  }
  EXPECT_EQ(fault_of({1980, 1, 6}, TimeScale::utc), "");
  EXPECT_NE(fault_of({1980, 1, 6, 8, 59, 59.0}, TimeScale::jst), "");
  EXPECT_EQ(seconds(gps_time({1980, 1, 6, 9}, TimeScale::jst)), 0.0);
}

// ---- What is accepted

TEST_F(RtklibPosFile, EveryFormOfOneSolutionReadsAlike) {
  const RtklibPos deg = read(kFormDeg);
  ASSERT_EQ(deg.records.size(), 2U);
  EXPECT_EQ(deg.week, 2074);
  EXPECT_EQ(deg.records[0].t_s, 472628.0);
  EXPECT_EQ(deg.records[0].lat_rad, 48.747973007 * kDegToRad);
  EXPECT_EQ(deg.records[0].lon_rad, 2.102081575 * kDegToRad);
  EXPECT_EQ(deg.records[0].height_m, 204.9843);
  EXPECT_EQ(deg.records[0].fix, 1);
  EXPECT_EQ(deg.records[0].line, 3U);
  Matrix3d P_n_m2;                                               // by hand: NE +, ED = -EU, ND = -UN
  P_n_m2 << 0.0105 * 0.0105, 0.0033 * 0.0033, -0.0076 * 0.0076,  //
      0.0033 * 0.0033, 0.0100 * 0.0100, 0.0135 * 0.0135,         //
      -0.0076 * 0.0076, 0.0135 * 0.0135, 0.0307 * 0.0307;
  EXPECT_LT((deg.records[0].P_n_m2 - P_n_m2).norm(), 1e-18);

  for (const std::string& form : {kFormDms, kFormEcef, kFormTab}) {
    const RtklibPos other = read(form);
    EXPECT_EQ(other.week, 2074);
    EXPECT_TRUE(other.height_stated);
    ASSERT_EQ(other.records.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const GnssRecord& a = deg.records[i];
      const GnssRecord& b = other.records[i];
      EXPECT_EQ(b.t_s, a.t_s);
      EXPECT_EQ(b.fix, a.fix);
      const Vector3d d_e = ecef_from_geodetic({a.lat_rad, a.lon_rad, a.height_m}) -
                           ecef_from_geodetic({b.lat_rad, b.lon_rad, b.height_m});
      EXPECT_LT(d_e.norm(), 3e-4) << form;  // 1e-5 arc seconds and 0.1 mm are printed
      // Digits of 0.1 mm: 2 s ds is 2e-6 m^2 for the largest root, 0.02 m, and the rotation mixes them.
      EXPECT_LT((a.P_n_m2 - b.P_n_m2).cwiseAbs().maxCoeff(), 5e-6) << form;
      EXPECT_EQ(b.P_n_m2, b.P_n_m2.transpose());
    }
  }
  EXPECT_EQ(read(kFormDeg).form, RtklibPosForm::llh_deg);
  EXPECT_EQ(read(kFormDms).form, RtklibPosForm::llh_dms);
  EXPECT_EQ(read(kFormDms).time_label, "UTC");
  EXPECT_TRUE(read(kFormDms).week_tow);
  EXPECT_EQ(read(kFormEcef).form, RtklibPosForm::ecef);
  EXPECT_EQ(read(kFormEcef).time_label, "JST");
}

TEST_F(RtklibPosFile, CovarianceInEcefIsTheTurnedOne) {
  // A known P_n, turned to ECEF and written as signed roots.
  const Geodetic g{-0.4, 2.9, 350.0};
  Matrix3d P_n;
  P_n << 0.04, 0.01, -0.02, 0.01, 0.09, 0.03, -0.02, 0.03, 0.25;
  const Matrix3d C = C_n_e(g.lat_rad, g.lon_rad);
  const Matrix3d P_e = C * P_n * C.transpose();
  const Vector3d p = ecef_from_geodetic(g);
  const auto root = [](double c) { return std::to_string(std::copysign(std::sqrt(std::abs(c)), c)) + "123 "; };
  const std::string roots =
      root(P_e(0, 0)) + root(P_e(1, 1)) + root(P_e(2, 2)) + root(P_e(0, 1)) + root(P_e(1, 2)) + root(P_e(2, 0));
  const Vector3d v_e = C * Vector3d(3.0, -4.0, 0.5);
  const std::string columns =
      kEcefColumns.substr(0, kEcefColumns.size() - 2) + " vx(m/s) vy(m/s) vz(m/s) sdvx sdvy sdvz sdvxy sdvyz sdvzx\r\n";
  const RtklibPos pos =
      read("%  GPST " + columns + "2200 10.25 " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " +
           std::to_string(p.z()) + " 2 7 " + roots + "0.0 1.0 " + std::to_string(v_e.x()) + " " +
           std::to_string(v_e.y()) + " " + std::to_string(v_e.z()) + " " + roots);
  ASSERT_EQ(pos.records.size(), 1U);
  const GnssRecord& r = pos.records[0];
  EXPECT_NEAR(r.lat_rad, g.lat_rad, 1e-12);
  EXPECT_NEAR(r.lon_rad, g.lon_rad, 1e-12);
  EXPECT_NEAR(r.height_m, g.height_m, 1e-5);
  EXPECT_LT((r.P_n_m2 - P_n).cwiseAbs().maxCoeff(), 1e-5);  // six decimals of a root
  EXPECT_TRUE(r.has_velocity);
  EXPECT_TRUE(r.has_velocity_std);
  EXPECT_LT((r.v_n_mps - Vector3d(3.0, -4.0, 0.5)).norm(), 1e-5);
  EXPECT_LT((r.std_v_n_mps - P_n.diagonal().cwiseSqrt()).norm(), 1e-4);
}

TEST_F(RtklibPosFile, VelocityUpBecomesDown) {
  const RtklibPos pos = read(kSemicolons);
  ASSERT_EQ(pos.records.size(), 1U);
  EXPECT_TRUE(pos.has_velocity);
  EXPECT_EQ(pos.records[0].t_s, 472628.0);
  EXPECT_TRUE(pos.records[0].has_velocity);
  EXPECT_EQ(pos.records[0].v_n_mps, Vector3d(-1.48864, 2.98503, -0.02151));
  EXPECT_TRUE(pos.records[0].has_velocity_std);
  EXPECT_LT((pos.records[0].std_v_n_mps - Vector3d(0.03672, 0.03571, 0.07839)).norm(), 1e-12);
  EXPECT_EQ(warnings.size(), 1U);
}

TEST_F(RtklibPosFile, ZerosForAVelocityAreNone) {
  const std::string header = kLegend + "%  GPST " + kColumns + kVelocityColumns + "\n";
  const RtklibPos pos = read(header + "2074 1.0" + kRow + " 0.00000 0.00000 0.00000 0.00000 0.0 0.0 0.0 0.0 0.0\n" +
                             "2074 2.0" + kRow + " 1.00000 0.00000 0.00000 0.00000 0.0 0.0 0.0 0.0 0.0\n" +  //
                             "2074 3.0" + kRow + " 0.00000 0.00000 0.00000 0.1 0.1 0.1 0.0 0.0 0.0\n");
  ASSERT_EQ(pos.records.size(), 3U);
  EXPECT_FALSE(pos.records[0].has_velocity);
  EXPECT_TRUE(pos.records[1].has_velocity);
  EXPECT_FALSE(pos.records[1].has_velocity_std);
  EXPECT_TRUE(pos.records[2].has_velocity_std);
  EXPECT_EQ(warning(1), "a.pos:3:1: 1 row without velocity (RTKLIB writes zeros): only the position is used");
  EXPECT_EQ(warning(2), "a.pos:4:1: 1 row with zero velocity sigmas: gnss.velocity_std_mps is used");
  expect_error(header + "2074 1.0" + kRow + " 1 0 0 0.1 0.0 0.1 0 0 0\n", "a.pos:3:19: the velocity covariance");
}

TEST_F(RtklibPosFile, MinusZeroDegreesIsSouthOrWest) {
  const std::string header = kLegend +
                             "%  GPST latitude(d'\") longitude(d'\") height(m) Q ns sdn(m) sde(m) sdu(m) "
                             "sdne(m) sdeu(m) sdue(m) age(s) ratio\n";
  const std::string rest =
      "  2799.9110   2   6   0.7133   0.9680   1.9564  -0.5036   0.4020  -0.3110   0.00    2.1\r\n";
  const RtklibPos pos = read(header + "2074 604797.000   -0 17 59.99505  -78 29 59.98566" + rest +
                             "2074 604798.000    0 17 59.99505   -0 29 60.00000" + rest);
  ASSERT_EQ(pos.records.size(), 2U);
  EXPECT_NEAR(pos.records[0].lat_rad * kRadToDeg, -0.299998624, 1e-9);  // rnx2rtkp in degrees
  EXPECT_NEAR(pos.records[0].lon_rad * kRadToDeg, -78.499996017, 1e-9);
  EXPECT_NEAR(pos.records[1].lat_rad * kRadToDeg, 0.299998624, 1e-9);
  EXPECT_NEAR(pos.records[1].lon_rad * kRadToDeg, -0.5, 1e-9);
  EXPECT_EQ(error(header + "2074 1.0  48 60 00.00000  2 00 00.0" + rest),
            "a.pos:3:4: latitude(d'\") is \"60\"; expected minutes from 0 to 59");
  EXPECT_EQ(error(header + "2074 1.0  90 00 00.10000  2 00 00.0" + rest),
            "a.pos:3:3: latitude(d'\") is \"90\"; expected a number from -90 to 90");
}

TEST_F(RtklibPosFile, TimeGoesOnPastTheEndOfTheWeek) {
  // rnx2rtkp, Saturday midnight.
  const RtklibPos week = read(kLlh + "2074 604799.000" + kRow + "\n2075      0.500" + kRow + "\n2076 1.25" + kRow);
  ASSERT_EQ(week.records.size(), 3U);
  EXPECT_EQ(week.week, 2074);
  EXPECT_TRUE(week.week_tow);
  EXPECT_EQ(week.records[0].t_s, 604799.0);
  EXPECT_EQ(week.records[1].t_s, 604800.5);
  EXPECT_EQ(week.records[2].t_s, 2.0 * 604800.0 + 1.25);
  const RtklibPos date = read(kLlh + "2019/10/12 23:59:59.000" + kRow + "\n2019/10/13 00:00:00.500" + kRow + "\n");
  EXPECT_EQ(date.week, 2074);
  EXPECT_FALSE(date.week_tow);
  EXPECT_EQ(date.records[1].t_s, 604800.5);
  // 18 s before midnight UTC the GPS week is over.
  const RtklibPos utc = read(kUtc + "2019/10/12 23:59:42.000" + kRow + "\n");
  EXPECT_EQ(utc.week, 2075);
  EXPECT_EQ(utc.records[0].t_s, 0.0);
}

TEST_F(RtklibPosFile, UtcAcrossALeapSecond) {
  const RtklibPos pos = read(kUtc + "2016/12/31 23:59:59.000" + kRow + "\n2016/12/31 23:59:60.000" + kRow +
                             "\n2016/12/31 23:59:60.800" + kRow + "\n2017/01/01 00:00:00.000" + kRow + "\n");
  ASSERT_EQ(pos.records.size(), 4U);
  EXPECT_EQ(pos.week, 1930);
  EXPECT_EQ(pos.records[0].t_s, 16.0);  // 2017-01-01 00:00:16 GPST
  EXPECT_EQ(pos.records[1].t_s, 17.0);
  EXPECT_NEAR(pos.records[2].t_s, 17.8, 1e-12);
  EXPECT_EQ(pos.records[3].t_s, 18.0);
  // rnx2rtkp writes GPST 16, 17, 18 s like this; the second time is lost.
  const std::string rtklib = "2016/12/31 23:59:59.000" + kRow + "\n2017/01/01 00:00:00.000" + kRow + "\n";
  expect_error(kUtc + rtklib + "2017/01/01 00:00:00.000" + kRow + "1\n",
               "a.pos:5:1: the time is 2017/01/01 00:00:00.000 as in", "out-timesys=gpst");
  expect_error(kUtc + rtklib + "2017/01/01 00:00:00.800" + kRow + "\n2017/01/01 00:00:00.200" + kRow + "\n",
               "a.pos:6:1: ", "out-timesys=gpst");
  expect_error(kUtc + "2017/12/31 23:59:60.000" + kRow, "a.pos:3:1: the time is \"2017/12/31 23:59:60.000\" UTC");
}

TEST_F(RtklibPosFile, AssumptionsAreStated) {
  read(kFormDeg);
  EXPECT_EQ(warning(0),
            "a.pos: RTKLIB solution in GPST; time_s counts GPS seconds of week 2074 (on past its end), and "
            "time_s of the IMU log must be on the same scale");
  warnings.clear();
  const RtklibPos pos = read("%  UTC " + kColumns + "\n2019/10/11 11:16:48.0" + kRow);
  EXPECT_FALSE(pos.height_stated);
  EXPECT_EQ(warning(0),
            "a.pos: RTKLIB solution in UTC, brought to GPST with 18 leap seconds; time_s counts GPS seconds "
            "of week 2074 (on past its end), and time_s of the IMU log must be on the same scale; the header "
            "does not say which height it is: taken as above the ellipsoid");
  EXPECT_EQ(warnings.size(), 1U);
  read(kUtc + "2027/06/27 23:00:00" + kRow);
  EXPECT_EQ(warnings.size(), 2U);
  read(kUtc + "2027/06/29 00:00:00" + kRow);
  EXPECT_NE(warning(3).find("leap seconds after 2027-06-28"), std::string::npos);
}

TEST_F(RtklibPosFile, RowsWithoutSolutionAndRepetitionsAreDroppedAndCounted) {
  const std::string none = " 0.0 0.0 0.0 0 0 0.0000 0.0000 0.0000 0.0 0.0 0.0 0.00 0.0\n";
  const RtklibPos pos = read(kLlh + "2074 1.0" + none + "2074 2.0" + kRow + "\n2074 2.0" + kRow + "\n2074 3.0" + none +
                             "2075 4.0" + kRow + "\n");
  ASSERT_EQ(pos.records.size(), 2U);
  EXPECT_EQ(pos.records[0].line, 4U);
  EXPECT_EQ(pos.records[1].t_s, 604804.0);
  EXPECT_EQ(warning(1), "a.pos:5:1: 1 row exactly as the row before: dropped");
  EXPECT_EQ(warning(2), "a.pos:3:1: 2 rows, this is the first, without solution (Q = 0): dropped");
  EXPECT_EQ(error(kLlh + "2074 1.0" + none),
            "a.pos: the file holds no solution; expected at least one row with Q above 0");
}

TEST_F(RtklibPosFile, CovarianceThatOnlyItsDigitsMakeSingularIsTaken) {
  const RtklibPos pos = read(kLlh + "2074 1.0 48.5 2.25 205.0 1 9 0.0010 0.0010 0.0020 0.0010 0 0 0.00 3.0\n");
  const Matrix3d& P = pos.records[0].P_n_m2;
  EXPECT_GT(P.determinant(), 0.0);
  EXPECT_NEAR(std::sqrt(P(0, 0)), 0.00105, 1e-12);
  EXPECT_NEAR(std::sqrt(P(0, 1)), 0.00095, 1e-12);
  EXPECT_TRUE(warning(1).starts_with("a.pos:3:1: 1 row with a covariance that is singular"));
  expect_error(kLlh + "2074 1.0 48.5 2.25 205.0 1 9 0.0010 0.0010 0.0020 0.0012 0 0 0.00 3.0\n",
               "a.pos:3:11: the position covariance is not positive definite");
}

TEST_F(RtklibPosFile, LongitudeIsBroughtToPlusMinus180) {
  const RtklibPos pos = read(kLlh + "2074 1.0 0 180" + kRow.substr(10) + "\n2074 2.0 0 270" + kRow.substr(10));
  EXPECT_EQ(pos.records[0].lon_rad, -180.0 * kDegToRad);
  EXPECT_EQ(pos.records[1].lon_rad, -90.0 * kDegToRad);
}

TEST_F(RtklibPosFile, JoinedFilesOfOneFormRead) {
  EXPECT_EQ(read(kLlh + "2074 1.0" + kRow + "\n" + kLlh + "2074 2.0" + kRow + "\n").records.size(), 2U);
  expect_error(kLlh + "2074 1.0" + kRow + "\n" + kUtc + "2074 2.0" + kRow,
               "a.pos:5:1: the columns differ from those on line 2");
}

TEST_F(RtklibPosFile, NameOrFirstLineTellsTheFormat) {
  write_text_file(path("a.txt"), "\r\n" + kFormDeg);
  write_text_file(path("b.csv"), "time_s,lat_deg\n% no\n");
  write_text_file(path("c.txt"), "");
  EXPECT_TRUE(looks_like_rtklib_pos(path("a.txt")));
  EXPECT_FALSE(looks_like_rtklib_pos(path("b.csv")));
  EXPECT_FALSE(looks_like_rtklib_pos(path("c.txt")));
  EXPECT_FALSE(looks_like_rtklib_pos(path("none")));
  EXPECT_TRUE(looks_like_rtklib_pos("none.pos"));
  EXPECT_TRUE(looks_like_rtklib_pos("NONE.POS"));
}

// ---- What is refused: the file and its header

TEST_F(RtklibPosFile, OtherFilesAreRefusedByName) {
  expect_error("% (lat/lon/height=WGS84/geodetic,Q=1:fix)\n" + kColumns, "a.pos:1:1: the heights are \"geodetic\"",
               "out-height=ellipsoidal");
  expect_error("% (lat/lon/height=Tokyo/ellipsoidal,Q=1:fix)\n", "a.pos:1:1: lat/lon/height is \"Tokyo/ellipsoidal\"");
  // rnx2rtkp
  expect_error(
      "% (e/n/u-baseline=WGS84,Q=1:fix)\n%  GPST                  e-baseline(m)  n-baseline(m)  u-baseline(m)"
      "   Q  ns   sde(m)   sdn(m)   sdu(m)  sden(m)  sdnu(m)  sdue(m) age(s)  ratio\n",
      "a.pos:2:1: the positions are e/n/u-baseline", "out-solformat=llh");
  expect_error("$GNRMC,111648.00,A,4844.8796479,N,00206.1201486,E,6.51,116.49,111019,0.0,E,R,V*43\n",
               "a.pos:1:1: this is NMEA", "out-solformat=llh");
  expect_error("$POS,2074,472626.000,1,1,2,3,0,0,0\n", "a.pos:1:1: this is RTKLIB's solution status");
  expect_error("456300.0 30.4 114.4 20.9 0.005 0.004 0.008\n",
               "a.pos:1:1: no line above names the columns");  // KF-GINS
  expect_error(std::string("\x01\x02", 2), "a.pos:1:1: the file is not text");
  expect_error("", "a.pos: the file holds no solution");
  expect_error(kLlh, "a.pos: the file holds no solution");
}

TEST_F(RtklibPosFile, ColumnsThatAreMissingAreNamed) {
  std::string columns = kColumns;
  columns.replace(columns.find("sdeu(m)"), 7, "       ");
  EXPECT_EQ(error("%  GPST " + columns + "\n"),
            "a.pos:1:1: column sdeu is missing; expected the columns that RTKLIB writes: run it again");
  expect_error("%  TAI " + kColumns, "a.pos:1:1: the time label is \"TAI\"; expected GPST, UTC or JST");
}

TEST_F(RtklibPosFile, OldTableOfLeapSecondsIsFound) {
  // RTKLIB 2.4.2 knew 16 leap seconds in 2019 (tomojitakasu/RTKLIB, issue 501).
  expect_error("% obs start : 2019/10/11 11:16:50.0 UTC (week2074 472626.0s)\n" + kUtc,
               "a.pos:1:1: the UTC of the header is 16 s from its GPST; expected 18 s", "out-timesys=gpst");
  EXPECT_EQ(
      read("% obs start : 2019/10/11 11:16:48.0 UTC (week2074 472626.0s)\n" + kUtc + "2074 1.0" + kRow).records.size(),
      1U);
}

// ---- What is refused: rows

TEST_F(RtklibPosFile, TimesMustAdvance) {
  // rnx2rtkp with pos1-soltype=backward.
  expect_error(
      kLlh + "2019/10/11 11:17:11.000" + kRow + "\r\n2019/10/11 11:17:10.000" + kRow + "\r\n",
      "a.pos:4:1: the time is 2019/10/11 11:17:10.000, before 2019/10/11 11:17:11.000 on line 3; times must not "
      "go back",
      "combined");
  expect_error(kLlh + "2074 1.0" + kRow + "\n2074 1.0" + kRow + "1\n",
               "a.pos:4:1: the time is 2074 1.0 as in 2074 1.0 on line 3");
  const std::string remark = "%" + std::string(2 * TextLines::kBlock, 'x') + "\n";  // line 3 is no longer in memory
  expect_error(kLlh + "2074 1.0" + kRow + "\n" + remark + "2074 0.5" + kRow + "\n",
               "a.pos:5:1: the time is 2074 0.5, before 2074 1.0 on line 3");
}

TEST_F(RtklibPosFile, TimesMustExist) {
  expect_error(kLlh + "1979/12/31 00:00:00" + kRow, "a.pos:3:1: ", "before GPS time began on 1980-01-06");
  expect_error(kLlh + "2019/02/30 00:00:00" + kRow, "a.pos:3:1: ", "no date of the calendar");
  expect_error(kLlh + "2019/10/11 11:17" + kRow, "a.pos:3:1: ", "expected yyyy/mm/dd hh:mm:ss.sss");
  EXPECT_EQ(error(kLlh + "2074.5 1" + kRow), "a.pos:3:1: GPST is \"2074.5\"; expected a GPS week from 0 to 9999");
  EXPECT_EQ(error(kLlh + "2074 604800.0" + kRow),
            "a.pos:3:2: GPST is \"604800.0\"; expected seconds of the week from 0 to below 604800");
}

TEST_F(RtklibPosFile, CellsMustBeGood) {
  const auto row = [&](const std::string& cells) { return error(kLlh + "2074 1.0 " + cells + " 0.00 3.0\n"); };
  EXPECT_EQ(row("48 2 205 1 9 0.01 0.02 0.03 0 0 0"), "no error");
  EXPECT_EQ(row("91 2 205 1 9 0.01 0.02 0.03 0 0 0"),
            "a.pos:3:3: latitude(deg) is \"91\"; expected a number from -90 to 90");
  EXPECT_EQ(row("48 361 205 1 9 0.01 0.02 0.03 0 0 0"),
            "a.pos:3:4: longitude(deg) is \"361\"; expected a number from -180 to 360");
  EXPECT_EQ(row("48 2 2e5 1 9 0.01 0.02 0.03 0 0 0"),
            "a.pos:3:5: height(m) is \"2e5\"; expected a number from -1000 to 100000, above the ellipsoid");
  EXPECT_EQ(row("48 2 205 1.5 9 0.01 0.02 0.03 0 0 0"), "a.pos:3:6: Q is \"1.5\"; expected an integer of 0 or more");
  EXPECT_EQ(row("48 2 205 1 9 0.01 0.0000 0.03 0 0 0"),
            "a.pos:3:9: sde(m) is \"0.0000\"; expected a number above 0: RTKLIB gives no accuracy for this epoch, "
            "remove the line");
  EXPECT_EQ(row("48 2 205 1 9 0.01 -0.02 0.03 0 0 0"),
            "a.pos:3:9: sde(m) is \"-0.02\"; expected a number of 0 or more");
  EXPECT_EQ(row("48 2 205 1 9 0.01 0.02 0.03 nan 0 0"), "a.pos:3:11: sdne(m) is \"nan\"; expected a finite number");
  EXPECT_EQ(row("48 2 205 1 9 0.01 0.02 0.03 0 0"),
            "a.pos:3:15: the row has 14 cells; expected 15 as line 2 names them (the time takes two)");
  expect_error(kLlh + "2074 1.0 48 2", "a.pos:3:5: the row has 4 cells", "cut off");
  expect_error(kSemicolons + "2019/10/11 11:16:51.000;;2.1;204;1;6;1;1;1;0;0;0;0;8;1;1;1;1;1;1;0;0;0\n",
               "a.pos:4:3: latitude(deg) is empty");
  expect_error("%  GPST " + kEcefColumns + "2074 1.0 1 2 3 1 9 0.01 0.02 0.03 0 0 0 0.00 3.0",
               "a.pos:2:3: the position is 3.7", "centre of the Earth");
}

}  // namespace
}  // namespace liealign
