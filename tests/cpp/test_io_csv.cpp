// Laws of CSV input and output: what is accepted reads alike in every spelling, what is refused says where and why.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"
#include "liealign/io/csv.hpp"
#include "liealign/io/text_file.hpp"

namespace liealign {
namespace {

const std::string kImuHeader = "time_s,gyro_x_rps,gyro_y_rps,gyro_z_rps,accel_x_mps2,accel_y_mps2,accel_z_mps2";
const std::string kGnssHeader = "time_s,lat_deg,lon_deg,height_m,std_n_m,std_e_m,std_d_m";
const std::string kVelocityHeader = kGnssHeader + ",vn_mps,ve_mps,vd_mps,std_vn_mps,std_ve_mps,std_vd_mps";
const std::string kHeadingHeader = kGnssHeader + ",heading_deg,std_heading_deg";
const std::string kCovHeader = kGnssHeader + ",cov_ne_m2,cov_nd_m2,cov_ed_m2";

// A directory of its own for each test; file names in messages are compared without it.
struct Csv : testing::Test {
  std::filesystem::path directory;
  std::vector<std::string> warnings;

  void SetUp() override {
    directory = std::filesystem::temp_directory_path() / ("liealign_io_csv_" + std::to_string(std::random_device{}()));
    ASSERT_TRUE(std::filesystem::create_directories(directory));
  }
  void TearDown() override { std::filesystem::remove_all(directory); }

  std::string path(const std::string& name) const { return (directory / name).string(); }

  std::string without_directory(const std::string& message) const {
    const std::string prefix = path("");
    EXPECT_TRUE(message.starts_with(prefix)) << message;
    return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
  }

  ImuSeries imu(const std::string& text) {
    write_text_file(path("imu.csv"), text);
    return read_imu_csv(path("imu.csv"), warnings);
  }
  std::vector<GnssRecord> gnss(const std::string& text) {
    write_text_file(path("gnss.csv"), text);
    return read_gnss_csv(path("gnss.csv"), warnings);
  }

  std::vector<BaroRecord> baro(const std::string& text) {
    write_text_file(path("baro.csv"), text);
    return read_baro_csv(path("baro.csv"), warnings);
  }

  template <typename Work>
  std::string error_of(const Work& work) const {
    try {
      work();
    } catch (const InputError& error) {
      return without_directory(error.what());
    }
    return "no error";
  }
  std::string imu_error(const std::string& text) {
    return error_of([&] { imu(text); });
  }
  std::string gnss_error(const std::string& text) {
    return error_of([&] { gnss(text); });
  }
  std::string baro_error(const std::string& text) {
    return error_of([&] { baro(text); });
  }
  // The error of one data row below a good header.
  std::string gnss_row_error(const std::string& header, const std::string& row) {
    return gnss_error(header + "\n" + row + "\n");
  }
};

bool same_sample(const ImuSample& a, const ImuSample& b) {
  return a.t_s == b.t_s && a.omega_ib_b == b.omega_ib_b && a.f_ib_b == b.f_ib_b;
}

// ---- What is accepted

TEST_F(Csv, ImuColumnsLandInTheirFields) {
  const ImuSeries samples = imu(kImuHeader + "\n0.5,1,2,3,4,5,6\n");
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_TRUE(same_sample(samples[0], {0.5, {1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(warnings.empty());
}

TEST_F(Csv, OrderOfColumnsAndFurtherColumnsDoNotMatter) {
  const ImuSeries samples =
      imu("temperature,accel_z_mps2,accel_y_mps2,accel_x_mps2,note,gyro_z_rps,gyro_y_rps,gyro_x_rps,time_s,\n"
          "warm,6,5,4,\"a, \"\"b\"\", c\",3,2,1,0.5,\n");
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_TRUE(same_sample(samples[0], {0.5, {1, 2, 3}, {4, 5, 6}}));
}

TEST_F(Csv, EverySpellingOfTheSameTableReadsAlike) {
  const ImuSeries plain = imu(kImuHeader + "\n0,1,-2,3,4,5,600\n1,1,-2,3,4,5,0\n");
  const std::vector<std::string> spellings = {
      "\xEF\xBB\xBF" + kImuHeader + "\r\n0,1,-2,3,4,5,600\r\n1,1,-2,3,4,5,0\r\n",               // BOM and CRLF
      kImuHeader + "\n0,1,-2,3,4,5,600\n1,1,-2,3,4,5,0",                                        // no last newline
      "# hand\n\n" + kImuHeader + "\n \t\n# x,y\n0,1,-2,3,4,5,600\n  #\n\n1,1,-2,3,4,5,0\n\n",  // blank, '#'
      kImuHeader + "\n 0 , +1,\t-2 , 3.,4.0,5e0,+6.0E+2 \n+1e0,1,-2,3,.4e1,50e-1,1e-400\n",     // spaces, exponents
      "\"" + kImuHeader.substr(0, 6) + "\"" + kImuHeader.substr(6) + "\n\"0\",1,-2,3,4,5,600\n1,1,-2,3,4,5,-0\n"};
  for (const std::string& spelling : spellings) {
    const ImuSeries samples = imu(spelling);
    ASSERT_EQ(samples.size(), 2U) << spelling;
    EXPECT_TRUE(same_sample(samples[0], plain[0])) << spelling;
    EXPECT_TRUE(same_sample(samples[1], plain[1])) << spelling;
  }
  EXPECT_TRUE(warnings.empty());
}

TEST_F(Csv, IdenticalRepeatedRowsAreDroppedWithOneWarning) {
  const ImuSeries samples =
      imu(kImuHeader + "\n0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n1.0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n");
  EXPECT_EQ(samples.size(), 2U);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(without_directory(warnings[0]),
            "imu.csv:3:1: 3 rows repeat the row before them exactly and were dropped; this is the first");

  warnings.clear();
  EXPECT_EQ(gnss(kGnssHeader + "\n0,1,2,3,1,1,1\n0,1,2,3,1,1,1\n").size(), 1U);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(without_directory(warnings[0]), "gnss.csv:3:1: 1 row repeats the row before it exactly and was dropped");
}

TEST_F(Csv, GnssMinimumIsPositionWithDiagonalCovariance) {
  const std::vector<GnssRecord> records = gnss(kGnssHeader + "\n\n10,45,-90,123.5,1,2,3\n");
  ASSERT_EQ(records.size(), 1U);
  const GnssRecord& record = records[0];
  EXPECT_EQ(record.t_s, 10.0);
  EXPECT_EQ(record.lat_rad, 45.0 * kDegToRad);
  EXPECT_EQ(record.lon_rad, -90.0 * kDegToRad);
  EXPECT_EQ(record.height_m, 123.5);
  EXPECT_EQ(record.P_n_m2, Matrix3d(Vector3d(1, 4, 9).asDiagonal()));
  EXPECT_FALSE(record.has_velocity);
  EXPECT_FALSE(record.has_velocity_std);
  EXPECT_EQ(record.fix, -1);
  EXPECT_EQ(record.line, 3U);
}

TEST_F(Csv, GnssCovarianceVelocityAndFixLandInTheirFields) {
  const std::vector<GnssRecord> records =
      gnss(kVelocityHeader + ",cov_ne_m2,cov_nd_m2,cov_ed_m2,fix\n10,45,9,1,1,2,3,7,8,-9,.1,.2,.3,0.5,-0.25,0.75,2\n");
  ASSERT_EQ(records.size(), 1U);
  Matrix3d P_n_m2;
  P_n_m2 << 1, 0.5, -0.25, 0.5, 4, 0.75, -0.25, 0.75, 9;
  EXPECT_EQ(records[0].P_n_m2, P_n_m2);
  EXPECT_TRUE(records[0].has_velocity);
  EXPECT_EQ(records[0].v_n_mps, Vector3d(7, 8, -9));
  EXPECT_TRUE(records[0].has_velocity_std);
  EXPECT_EQ(records[0].std_v_n_mps, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(records[0].fix, 2);
}

TEST_F(Csv, GnssGroupsMayBeEmptyInSomeRows) {
  const std::vector<GnssRecord> records =
      gnss(kVelocityHeader + "\n0,1,2,3,1,1,1,,,,,,\n1,1,2,3,1,1,1,7,8,9,,,\n2,1,2,3,1,1,1,7,8,9,1,1,1\n");
  ASSERT_EQ(records.size(), 3U);
  EXPECT_FALSE(records[0].has_velocity);
  EXPECT_TRUE(records[1].has_velocity);
  EXPECT_FALSE(records[1].has_velocity_std);
  EXPECT_TRUE(records[2].has_velocity_std);

  const std::vector<GnssRecord> correlated = gnss(kCovHeader + "\n0,1,2,3,1,1,1,,,\n1,1,2,3,1,1,1,.5,0,0\n");
  EXPECT_EQ(correlated[0].P_n_m2, Matrix3d::Identity());
  EXPECT_EQ(correlated[1].P_n_m2(1, 0), 0.5);
}

TEST_F(Csv, GnssHeadingLandsInItsFieldsAndMayBeEmptyInSomeRows) {
  const std::vector<GnssRecord> records = gnss(kHeadingHeader + "\n0,1,2,3,1,1,1,90,0.5\n1,1,2,3,1,1,1,,\n");
  ASSERT_EQ(records.size(), 2U);
  EXPECT_TRUE(records[0].has_heading);
  EXPECT_EQ(records[0].heading_rad, 90.0 * kDegToRad);
  EXPECT_EQ(records[0].std_heading_rad, 0.5 * kDegToRad);
  EXPECT_FALSE(records[1].has_heading);
  EXPECT_EQ(records[1].heading_rad, 0.0);
  EXPECT_FALSE(gnss(kGnssHeader + "\n0,1,2,3,1,1,1\n")[0].has_heading);
}

TEST_F(Csv, HeadingIsBroughtToOneTurn) {
  const std::array<std::array<double, 2>, 6> cases = {
      {{-180, 180}, {-0.5, 359.5}, {0, 0}, {179.5, 179.5}, {359.5, 359.5}, {360, 0}}};
  for (const auto& [heading_deg, expected_deg] : cases) {
    const std::string row = "0,1,2,3,1,1,1," + std::to_string(heading_deg) + ",1";
    EXPECT_EQ(gnss(kHeadingHeader + "\n" + row + "\n")[0].heading_rad, expected_deg * kDegToRad) << heading_deg;
  }
}

TEST_F(Csv, BaroColumnsLandInTheirFields) {
  const std::vector<BaroRecord> with_std = baro("std_m,time_s,height_m\n0.25,10,-3.5\n,11,4\n");
  ASSERT_EQ(with_std.size(), 2U);
  EXPECT_EQ(with_std[0].t_s, 10.0);
  EXPECT_EQ(with_std[0].height_m, -3.5);
  EXPECT_TRUE(with_std[0].has_std);
  EXPECT_EQ(with_std[0].std_m, 0.25);
  EXPECT_EQ(with_std[0].line, 2U);
  EXPECT_FALSE(with_std[1].has_std);

  const std::vector<BaroRecord> without = baro("time_s,height_m\n0,1\n0,1\n1,2\n");
  ASSERT_EQ(without.size(), 2U);
  EXPECT_FALSE(without[0].has_std);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(without_directory(warnings[0]), "baro.csv:3:1: 1 row repeats the row before it exactly and was dropped");
}

TEST_F(Csv, LongitudeIsBroughtToPlusMinus180) {
  const std::array<std::array<double, 2>, 7> cases = {
      {{-180, -180}, {-0.5, -0.5}, {0, 0}, {179.5, 179.5}, {180, -180}, {270, -90}, {360, 0}}};
  for (const auto& [lon_deg, expected_deg] : cases) {
    const std::vector<GnssRecord> records = gnss(kGnssHeader + "\n0,0," + std::to_string(lon_deg) + ",0,1,1,1\n");
    EXPECT_EQ(records[0].lon_rad, expected_deg * kDegToRad) << lon_deg;
  }
}

TEST_F(Csv, SlipInAnOptionalNameIsWarnedOf) {
  gnss(kGnssHeader + ",Fix,satellites\n0,1,2,3,1,1,1,4,12\n");
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(without_directory(warnings[0]), "gnss.csv:1:8: column Fix is ignored; did you mean fix?");
}

// ---- Files longer than a block

TEST_F(Csv, ABlockMayEndAnywhereInARow) {
  const std::string row = "2,1,-2,3.25,4,5,-60.5\r\n";
  for (std::size_t before = 0; before <= row.size(); ++before) {  // bytes of the row before the border
    std::string text = kImuHeader + "\r\n1,0,0,0,0,0,0\r\n#";
    text.append(TextLines::kBlock - before - text.size() - 2, ' ');
    text += "\r\n" + row + "3,0,0,0,0,0,0\r\n";
    const ImuSeries samples = imu(text);
    ASSERT_EQ(samples.size(), 3U) << before;
    EXPECT_TRUE(same_sample(samples[1], {2.0, {1, -2, 3.25}, {4, 5, -60.5}})) << before;
    EXPECT_EQ(imu_error(text + "4,0,0,0,0,0\r\n"), "imu.csv:6:7: the row has 6 cells; expected 7 as in the header");
    EXPECT_EQ(imu_error(text + "4,0,0,0,0,0"),
              "imu.csv:6:7: the row has 6 cells; expected 7 as in the header; the file ends within this line: if it "
              "was cut off, remove the line");
  }
}

TEST_F(Csv, AFileMayEndWithTheBlockWithOrWithoutANewline) {
  for (const std::size_t size : {TextLines::kBlock - 1, TextLines::kBlock, TextLines::kBlock + 1}) {
    for (const std::string end : {"", "\n", "\r\n"}) {
      std::string text = kImuHeader + "\n#";
      const std::string row = "\n0.5,1,2,3,4,5,6" + end;
      text.append(size - text.size() - row.size(), 'x');
      const ImuSeries samples = imu(text + row);
      ASSERT_EQ(samples.size(), 1U) << size;
      EXPECT_TRUE(same_sample(samples[0], {0.5, {1, 2, 3}, {4, 5, 6}})) << size;
    }
  }
}

TEST_F(Csv, ALineMayBeLongerThanSeveralBlocks) {
  const std::string note(5 * TextLines::kBlock + 7, 'x');
  const ImuSeries samples = imu("#" + note + "\nnote," + kImuHeader + "\n\"" + note + ",\",0,1,2,3,4,5,6\n" + note +
                                ",1,1,2,3,4,5,6\n,2,1,2,3,4,5,6");
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[1].t_s, 1.0);
  EXPECT_TRUE(same_sample(samples[2], {2.0, {1, 2, 3}, {4, 5, 6}}));
}

// A message that quotes the row before must not read it from a block that is gone.
TEST_F(Csv, RowsOnBothSidesOfABorderAreCompared) {
  std::string text = kImuHeader + "\n100000.123456789012345,1,2,3,4,5,6\n#";
  text.append(2 * TextLines::kBlock, 'x');
  EXPECT_EQ(imu_error(text + "\n1,1,2,3,4,5,6\n"),
            "imu.csv:4:1: time_s is 1, before 100000.123456789012345 on line 2; times must not go back: sort the file "
            "by time_s or remove the line");
}

TEST_F(Csv, APipeReadsLikeAFile) {
  std::string text = kImuHeader + "\n";
  for (int k = 0; k < 40000; ++k) text += std::to_string(k) + ",1,2,3,4,5," + std::to_string(k % 7) + "\n";
  const ImuSeries from_file = imu(text);
  if (std::system(("mkfifo " + path("pipe.csv")).c_str()) != 0) GTEST_SKIP() << "needs mkfifo";
  std::thread writer([&] {
    std::ofstream pipe(path("pipe.csv"), std::ios::binary);
    for (std::size_t at = 0; at < text.size(); at += 1001) pipe << text.substr(at, 1001) << std::flush;
  });
  const ImuSeries from_pipe = read_imu_csv(path("pipe.csv"), warnings);
  writer.join();
  ASSERT_GT(text.size(), TextLines::kBlock);
  ASSERT_EQ(from_pipe.size(), from_file.size());
  EXPECT_TRUE(std::equal(from_pipe.begin(), from_pipe.end(), from_file.begin(), same_sample));
}

// Ten hours of samples are half a gigabyte: doubling would take that once more while it moves them.
TEST_F(Csv, ALongLogHasItsRoomFromTheSizeOfTheFile) {
  std::string text = kImuHeader + "\n";
  for (int k = 0; k < 70000; ++k) text += std::to_string(1000000 + k) + ",1.5,2.5,-3.5,4.5,5.5,-6.5\n";
  const ImuSeries samples = imu(text);
  ASSERT_EQ(samples.size(), 70000U);
  EXPECT_LT(static_cast<double>(samples.capacity()), 1.1 * 70000.0);
}

// ---- What is refused: the file and its header

TEST_F(Csv, MissingOrUnreadableFileIsRefused) {
  EXPECT_EQ(error_of([&] { read_imu_csv(path("none.csv"), warnings); }),
            "none.csv: cannot be read: No such file or directory");
  std::filesystem::create_directory(directory / "folder");
  EXPECT_EQ(error_of([&] { read_gnss_csv(path("folder"), warnings); }), "folder: cannot be read: Is a directory");
}

TEST_F(Csv, EmptyFileIsRefused) {
  EXPECT_EQ(imu_error(""), "imu.csv: the file is empty; expected the header " + kImuHeader);
  EXPECT_EQ(gnss_error("\xEF\xBB\xBF"), "gnss.csv: the file is empty; expected the header " + kGnssHeader);
  EXPECT_EQ(imu_error("# nothing\n\n"),
            "imu.csv: the file holds only blank lines and comments; expected the header " + kImuHeader);
}

TEST_F(Csv, HeaderWithoutRowsIsRefused) {
  EXPECT_EQ(imu_error("# log\n" + kImuHeader + "\n\n"),
            "imu.csv:2:1: no row follows the header; expected at least one row of numbers");
}

TEST_F(Csv, MissingHeaderIsRefused) {
  EXPECT_EQ(imu_error("# " + kImuHeader + "\n0,1,2,3,4,5,6\n"),
            "imu.csv:2:1: the first row holds numbers; expected the header " + kImuHeader +
                " above it (a line that starts with # is a comment)");
}

TEST_F(Csv, OtherSeparatorsAreRefused) {
  EXPECT_EQ(imu_error("time_s;gyro_x_rps\n0;1\n"),
            "imu.csv:1:1: the columns are separated by semicolons; expected commas between columns and points in "
            "numbers: header " +
                kImuHeader);
  EXPECT_EQ(imu_error("time_s\tgyro_x_rps\n0\t1\n"),
            "imu.csv:1:1: the columns are separated by tabs; expected commas between columns and points in numbers: "
            "header " +
                kImuHeader);
}

TEST_F(Csv, BinaryFileIsRefusedWithoutPrintingIt) {
  EXPECT_EQ(imu_error("ULog\x01\x12\x35,\x02"),
            "imu.csv:1:1: the file is not UTF-8 text; expected a CSV file with the header " + kImuHeader);
}

TEST_F(Csv, MissingColumnNamesTheColumnsFound) {
  EXPECT_EQ(gnss_error("time_s,lat_deg,lon_deg,std_n_m,std_e_m,std_d_m\n"),
            "gnss.csv:1:1: column height_m is missing; found time_s,lat_deg,lon_deg,std_n_m,std_e_m,std_d_m");
}

TEST_F(Csv, MissingColumnInAnotherUnitSaysTheUnitExpected) {
  EXPECT_EQ(imu_error("time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,accel_x_mps2,accel_y_mps2,accel_z_mps2\n"),
            "imu.csv:1:2: column gyro_x_rps is missing; found "
            "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,accel_x_mps2,accel_y_mps2,accel_z_mps2; did you mean gyro_x_dps? "
            "It must be named gyro_x_rps and be in rad/s");
  EXPECT_EQ(gnss_error("time_s,latitude,longitude\n"),
            "gnss.csv:1:2: column lat_deg is missing; found time_s,latitude,longitude; did you mean latitude? It must "
            "be named lat_deg and be in deg");
}

TEST_F(Csv, MissingColumnNamesTheSlip) {
  EXPECT_EQ(imu_error("gyro_y_rps,Tiem_s\n"),
            "imu.csv:1:2: column time_s is missing; found gyro_y_rps,Tiem_s; did you mean Tiem_s? It must be named "
            "time_s and be in s");
  // A column that is wanted under its own name is no slip of another.
  EXPECT_EQ(imu_error("time_s,gyro_y_rps,gyro_z_rps\n"),
            "imu.csv:1:1: column gyro_x_rps is missing; found time_s,gyro_y_rps,gyro_z_rps");
}

TEST_F(Csv, DuplicateColumnIsRefused) {
  EXPECT_EQ(imu_error(kImuHeader + ",gyro_x_rps\n0,1,2,3,4,5,6,7\n"),
            "imu.csv:1:8: column gyro_x_rps appears twice, first as column 2; keep one of the two");
}

TEST_F(Csv, HalfAGroupOfColumnsIsRefused) {
  EXPECT_EQ(gnss_error(kGnssHeader + ",vn_mps,ve_mps\n"),
            "gnss.csv:1:8: vd_mps is missing but vn_mps is not; expected all of vn_mps,ve_mps,vd_mps or none");
  EXPECT_EQ(gnss_error(kGnssHeader + ",cov_nd_m2\n"),
            "gnss.csv:1:8: cov_ne_m2 is missing but cov_nd_m2 is not; expected all of cov_ne_m2,cov_nd_m2,cov_ed_m2 or "
            "none");
  EXPECT_EQ(gnss_error(kGnssHeader + ",std_vn_mps,std_ve_mps,std_vd_mps\n"),
            "gnss.csv:1:8: std_vn_mps is given without a velocity; add the columns vn_mps,ve_mps,vd_mps or remove "
            "std_vn_mps,std_ve_mps,std_vd_mps");
  EXPECT_EQ(gnss_error(kGnssHeader + ",heading_deg\n"),
            "gnss.csv:1:8: std_heading_deg is missing but heading_deg is not; expected all of "
            "heading_deg,std_heading_deg or none");
}

TEST_F(Csv, BaroWithoutHeightNamesTheColumnsFound) {
  EXPECT_EQ(baro_error("time_s,pressure_pa\n"), "baro.csv:1:1: column height_m is missing; found time_s,pressure_pa");
}

// ---- What is refused: rows and cells

TEST_F(Csv, WrongNumberOfCellsIsRefused) {
  EXPECT_EQ(imu_error(kImuHeader + "\n0,1,2,3,4,5\n1,1,2,3,4,5,6\n"),
            "imu.csv:2:7: the row has 6 cells; expected 7 as in the header");
  EXPECT_EQ(imu_error(kImuHeader + "\n0,1,2,3,4,5,6,7,8\n"),
            "imu.csv:2:8: the row has 9 cells; expected 7 as in the header");
  EXPECT_EQ(imu_error(kImuHeader + "\n0,1,2,3,4,5,6\n1"),
            "imu.csv:3:2: the row has 1 cell; expected 7 as in the header; the file ends within this line: if it was "
            "cut off, remove the line");
}

TEST_F(Csv, CellThatIsNoFiniteNumberIsRefused) {
  for (const std::string cell : {"nan", "NaN", "inf", "-Infinity", "1e400", "x", "1.5x", "0x10", "1 2", "--1", "+-1",
                                 "++1", "+", "1e", "1.2.3"}) {
    EXPECT_EQ(imu_error(kImuHeader + "\n\n0,1," + cell + ",3,4,5,6\n"),
              "imu.csv:3:3: gyro_y_rps is \"" + cell + "\"; expected a finite number [rad/s]");
  }
  EXPECT_EQ(imu_error(kImuHeader + "\n0,1,2,3,4,5,\n"),
            "imu.csv:2:7: accel_z_mps2 is empty; expected a finite number [m/s^2]");
  EXPECT_EQ(imu_error(kImuHeader + "\n" + std::string(50, 'x') + ",1,2,3,4,5,6\n"),
            "imu.csv:2:1: time_s is \"" + std::string(40, 'x') + "...\"; expected a finite number [s]");
}

TEST_F(Csv, TimeGoingBackIsRefused) {
  EXPECT_EQ(imu_error(kImuHeader + "\n0,1,2,3,4,5,6\n0.030,1,2,3,4,5,6\n# reset\n0.020,1,2,3,4,5,6\n"),
            "imu.csv:5:1: time_s is 0.020, before 0.030 on line 3; times must not go back: sort the file by time_s or "
            "remove the line");
  EXPECT_EQ(gnss_error(kGnssHeader + "\n1,1,2,3,1,1,1\n0,1,2,3,1,1,1\n"),
            "gnss.csv:3:1: time_s is 0, before 1 on line 2; times must not go back: sort the file by time_s or remove "
            "the line");
}

TEST_F(Csv, RepeatedTimeWithOtherValuesIsRefused) {
  EXPECT_EQ(imu_error(kImuHeader + "\n0.5,1,2,3,4,5,6\n0.5,1,2,9,4,5,6\n"),
            "imu.csv:3:1: time_s is 0.5 as on line 2, but gyro_z_rps differs; expected one row for each time: remove "
            "one of the two lines");
  EXPECT_EQ(gnss_error(kVelocityHeader + "\n0,1,2,3,1,1,1,,,,,,\n0,1,2,3,1,1,1,1,1,1,,,\n"),
            "gnss.csv:3:1: time_s is 0 as on line 2, but vn_mps differs; expected one row for each time: remove one of "
            "the two lines");
}

TEST_F(Csv, PositionOffTheEarthIsRefused) {
  const auto error = [&](const std::string& lat_lon_height) {
    return gnss_row_error(kGnssHeader, "0," + lat_lon_height + ",1,1,1");
  };
  EXPECT_EQ(error("90.5,0,0"), "gnss.csv:2:2: lat_deg is \"90.5\"; expected a number from -90 to 90 [deg]");
  EXPECT_EQ(error("-91,0,0"), "gnss.csv:2:2: lat_deg is \"-91\"; expected a number from -90 to 90 [deg]");
  EXPECT_EQ(error("0,360.1,0"), "gnss.csv:2:3: lon_deg is \"360.1\"; expected a number from -180 to 360 [deg]");
  EXPECT_EQ(error("0,-181,0"), "gnss.csv:2:3: lon_deg is \"-181\"; expected a number from -180 to 360 [deg]");
  EXPECT_EQ(error("0,0,-1001"),
            "gnss.csv:2:4: height_m is \"-1001\"; expected a number from -1000 to 100000 [m above the ellipsoid]");
  EXPECT_EQ(error("0,0,1e6"),
            "gnss.csv:2:4: height_m is \"1e6\"; expected a number from -1000 to 100000 [m above the ellipsoid]");
  EXPECT_EQ(error("90,360,100000"), "no error");
  EXPECT_EQ(error("-90,-180,-1000"), "no error");
}

TEST_F(Csv, StandardDeviationMustBePositive) {
  EXPECT_EQ(gnss_row_error(kGnssHeader, "0,1,2,3,0,1,1"),
            "gnss.csv:2:5: std_n_m is \"0\"; expected a number above 0 [m]");
  EXPECT_EQ(gnss_row_error(kGnssHeader, "0,1,2,3,1,1,-0.1"),
            "gnss.csv:2:7: std_d_m is \"-0.1\"; expected a number above 0 [m]");
  EXPECT_EQ(gnss_row_error(kVelocityHeader, "0,1,2,3,1,1,1,7,8,9,1,0.0,1"),
            "gnss.csv:2:12: std_ve_mps is \"0.0\"; expected a number above 0 [m/s]");
}

TEST_F(Csv, CovarianceMustBePositiveDefinite) {
  EXPECT_EQ(gnss_row_error(kCovHeader, "0,1,2,3,2,1,1,2.5,0,0"),
            "gnss.csv:2:8: the position covariance is not positive definite (correlations NE 1.250, ND 0.000, ED "
            "0.000); expected covariances in m^2 that fit the standard deviations (RTKLIB's sdne, sdeu, sdun are "
            "signed roots: square them, keep the sign)");
  // Every pair is possible, the three together are not: det R = 1 - 3 * 0.81 - 2 * 0.729 < 0.
  EXPECT_NE(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,0.9,0.9,-0.9"), "no error");
  EXPECT_NE(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,1,0,0"), "no error");  // singular
  EXPECT_NE(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,0,3,3"), "no error");  // det R < 0 through ND and ED alone
  EXPECT_NE(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,3,3,9"), "no error");  // det R may be positive; NE is not
  EXPECT_EQ(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,0.9,0.9,0.9"), "no error");
  EXPECT_EQ(gnss_row_error(kCovHeader, "0,1,2,3,1e-4,1e-4,1e-4,9e-9,0,0"), "no error");  // scale does not matter
}

TEST_F(Csv, HalfAGroupOfCellsIsRefused) {
  EXPECT_EQ(gnss_row_error(kVelocityHeader, "0,1,2,3,1,1,1,7,,9,,,"),
            "gnss.csv:2:9: ve_mps is empty but vn_mps is not; expected all of vn_mps,ve_mps,vd_mps or none");
  EXPECT_EQ(gnss_row_error(kVelocityHeader, "0,1,2,3,1,1,1,7,8,9,,1,1"),
            "gnss.csv:2:11: std_vn_mps is empty but std_ve_mps is not; expected all of "
            "std_vn_mps,std_ve_mps,std_vd_mps or none");
  EXPECT_EQ(gnss_row_error(kVelocityHeader, "0,1,2,3,1,1,1,,,,1,1,1"),
            "gnss.csv:2:11: std_vn_mps is given but vn_mps,ve_mps,vd_mps are empty; expected both or neither");
  EXPECT_EQ(gnss_row_error(kCovHeader, "0,1,2,3,1,1,1,0,0,"),
            "gnss.csv:2:10: cov_ed_m2 is empty but cov_ne_m2 is not; expected all of cov_ne_m2,cov_nd_m2,cov_ed_m2 or "
            "none");
  EXPECT_EQ(gnss_row_error(kVelocityHeader, "0,1,2,3,1,1,1,7,nan,9,,,"),
            "gnss.csv:2:9: ve_mps is \"nan\"; expected a finite number [m/s]");
}

TEST_F(Csv, HeadingOutsideATurnOrWithoutASigmaIsRefused) {
  const auto error = [&](const std::string& cells) { return gnss_row_error(kHeadingHeader, "0,1,2,3,1,1,1," + cells); };
  EXPECT_EQ(error("361,1"), "gnss.csv:2:8: heading_deg is \"361\"; expected a number from -180 to 360 [deg]");
  EXPECT_EQ(error("-181,1"), "gnss.csv:2:8: heading_deg is \"-181\"; expected a number from -180 to 360 [deg]");
  EXPECT_EQ(error("nan,1"), "gnss.csv:2:8: heading_deg is \"nan\"; expected a number from -180 to 360 [deg]");
  EXPECT_EQ(error("10,0"), "gnss.csv:2:9: std_heading_deg is \"0\"; expected a number above 0 [deg]");
  EXPECT_EQ(error("10,"),
            "gnss.csv:2:9: std_heading_deg is empty but heading_deg is not; expected all of "
            "heading_deg,std_heading_deg or none");
  EXPECT_EQ(error(",1"),
            "gnss.csv:2:8: heading_deg is empty but std_heading_deg is not; expected all of "
            "heading_deg,std_heading_deg or none");
}

TEST_F(Csv, BaroRowThatCannotBeUsedIsRefused) {
  const auto error = [&](const std::string& rows) { return baro_error("time_s,height_m,std_m\n" + rows + "\n"); };
  EXPECT_EQ(error("0,,1"), "baro.csv:2:2: height_m is empty; expected a number from -1000 to 100000 [m]");
  EXPECT_EQ(error("0,101325,1"), "baro.csv:2:2: height_m is \"101325\"; expected a number from -1000 to 100000 [m]");
  EXPECT_EQ(error("0,1,0"), "baro.csv:2:3: std_m is \"0\"; expected a number above 0 [m]");
  EXPECT_EQ(error("1,1,1\n0,1,1"),
            "baro.csv:3:1: time_s is 0, before 1 on line 2; times must not go back: sort the file by time_s or remove "
            "the line");
  EXPECT_EQ(error("1,1,1\n1,2,1"),
            "baro.csv:3:1: time_s is 1 as on line 2, but height_m differs; expected one row for each time: remove one "
            "of the two lines");
}

TEST_F(Csv, FixMustBeANaturalNumber) {
  const std::string expected = "; expected an integer of 0 or more (RTKLIB's Q)";
  for (const std::string cell : {"1.5", "-1", "RTK", "1e300", "nan"}) {
    EXPECT_EQ(gnss_row_error(kGnssHeader + ",fix", "0,1,2,3,1,1,1," + cell),
              "gnss.csv:2:8: fix is \"" + cell + "\"" + expected);
  }
  EXPECT_EQ(gnss_row_error(kGnssHeader + ",fix", "0,1,2,3,1,1,1,"), "gnss.csv:2:8: fix is empty" + expected);
}

// ---- Writing

TEST_F(Csv, ShortestNotationReadsBackToTheSameBits) {
  std::mt19937_64 random(1);
  std::vector<double> numbers = {0.0,
                                 -0.0,
                                 0.1,
                                 1.0 / 3.0,
                                 1e22,
                                 5e-324,
                                 2.2250738585072014e-308,
                                 std::numeric_limits<double>::max(),
                                 std::numeric_limits<double>::lowest()};
  while (numbers.size() < 7000) {
    const auto x = std::bit_cast<double>(random());
    if (std::isfinite(x)) numbers.push_back(x);
  }
  write_csv(path("imu.csv"),
            {{"time_s", 0},
             {"gyro_x_rps", -1},
             {"gyro_y_rps", -1},
             {"gyro_z_rps", -1},
             {"accel_x_mps2", -1},
             {"accel_y_mps2", -1},
             {"accel_z_mps2", -1}},
            numbers.size(), [&](std::size_t row, double* cells) {
              cells[0] = static_cast<double>(row);
              for (std::size_t i = 1; i < 7; ++i) cells[i] = numbers[(row + i) % numbers.size()];
            });
  const ImuSeries samples = read_imu_csv(path("imu.csv"), warnings);
  ASSERT_EQ(samples.size(), numbers.size());
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const std::size_t at = row + 1 + static_cast<std::size_t>(axis);
      EXPECT_EQ(std::bit_cast<std::uint64_t>(samples[row].omega_ib_b(axis)),
                std::bit_cast<std::uint64_t>(numbers[at % numbers.size()]));
      EXPECT_EQ(std::bit_cast<std::uint64_t>(samples[row].f_ib_b(axis)),
                std::bit_cast<std::uint64_t>(numbers[(at + 3) % numbers.size()]));
    }
  }
}

TEST_F(Csv, FixedNotationHasItsDecimalsAndNoNegativeZero) {
  const std::vector<double> numbers = {1.0, 2.5e-4, -2.5e-4, -0.0, -1.0006, 1e21};
  write_csv(path("out.csv"), {{"a_m", 3}, {"b", 0}}, numbers.size(), [&](std::size_t row, double* cells) {
    cells[0] = numbers[row];
    cells[1] = -numbers[row] / 4.0;
  });
  EXPECT_EQ(read_text_file(path("out.csv")),
            "a_m,b\n1.000,0\n0.000,0\n0.000,0\n0.000,0\n-1.001,0\n"
            "1000000000000000000000.000,-250000000000000000000\n");
}

// The cell that is written for x, and what std::to_chars writes, without a sign that says nothing.
std::string cell_text(double x, int decimals) {
  std::string out;
  append_csv_row(out, {{"a", decimals}}, &x);
  out.pop_back();
  return out;
}

std::string exact_text(double x, int decimals) {
  std::array<char, 400> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), x, std::chars_format::fixed, decimals);
  std::string out(digits.data(), end.ptr);
  return out.front() == '-' && out.find_first_not_of("-0.") == std::string::npos ? out.substr(1) : out;
}

// Numbers of every size, and numbers about the middle between two texts, where a rounding on the way would show.
TEST_F(Csv, FixedNotationIsExactToTheLastDigit) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0), exponent(-20.0, 17.0);
  std::size_t ties = 0;
  for (int decimals = 0; decimals <= 17; ++decimals) {
    const double unit_of_last = std::pow(10.0, -decimals);
    std::vector<double> numbers = {0.0, 0.5, 1.5, 2.5, 0.125, 0.375, 9.9999995, 99.5, 1e15, 9007199254740991.0, 5e-324};
    for (int k = 0; k < 20000; ++k) numbers.push_back(std::pow(10.0, exponent(random)) * unit(random));
    for (int k = 0; k < 5000; ++k) {
      const double middle = (std::floor(std::pow(10.0, 15.0 * unit(random))) + 0.5) * unit_of_last;
      numbers.insert(numbers.end(), {middle, std::nextafter(middle, 0.0), std::nextafter(middle, 1e300)});
    }
    for (int k = 0; k < 5000; ++k) {  // middles that a double holds: a tie goes to the even digit
      const auto n = static_cast<double>(random() >> (24 + random() % 40));
      numbers.push_back(std::ldexp(2.0 * n + 1.0, -decimals - 1));
      ties += exact_text(numbers.back(), decimals) != exact_text(std::nextafter(numbers.back(), 1e300), decimals);
    }
    for (const double x : numbers) {
      ASSERT_EQ(cell_text(x, decimals), exact_text(x, decimals)) << decimals;
      ASSERT_EQ(cell_text(-x, decimals), exact_text(-x, decimals)) << decimals;
    }
  }
  EXPECT_GT(ties, 10000U);
}

TEST_F(Csv, PartsOfATableInOrderAreTheTable) {
  const std::vector<CsvColumn> columns = {{"time_s", 3}, {"a,b", -1}};
  const auto fill = [](std::size_t row, double* cells) { cells[0] = 0.1 * static_cast<double>(row); };
  write_csv(path("out.csv"), columns, 100, fill, {"word", [](std::size_t row) { return std::to_string(row) + ","; }});
  std::string text;
  append_csv_header(text, columns, "word");
  for (std::size_t row = 0; row < 100; ++row) {
    std::array<double, 2> cells = {0.0, std::numeric_limits<double>::quiet_NaN()};
    fill(row, cells.data());
    append_csv_row(text, columns, cells.data(), std::to_string(row) + ",");
  }
  EXPECT_EQ(read_text_file(path("out.csv")), text);
  EXPECT_TRUE(text.starts_with("time_s,\"a,b\",word\n0.000,,\"0,\"\n0.100,,\"1,\"\n"));
}

TEST_F(Csv, CellsThatAreNotFiniteOrNotSetAreEmpty) {
  write_csv(path("out.csv"), {{"a", 1}, {"b", -1}, {"c", 1}}, 2, [](std::size_t row, double* cells) {
    if (row == 0) cells[0] = 1.0;
    if (row == 1) cells[1] = std::numeric_limits<double>::infinity();
    if (row == 1) cells[2] = 2.0;
  });
  EXPECT_EQ(read_text_file(path("out.csv")), "a,b,c\n1.0,,\n,,2.0\n");
}

TEST_F(Csv, LastColumnOfWordsIsQuotedWhereNeeded) {
  const std::vector<std::string> words = {"accepted", "late, dropped", "a \"b\"", ""};
  write_csv(path("out.csv"), {{"time_s", 1}}, words.size(),
            [](std::size_t row, double* cells) { cells[0] = static_cast<double>(row); },
            {"verdict", [&](std::size_t row) { return words[row]; }});
  EXPECT_EQ(read_text_file(path("out.csv")),
            "time_s,verdict\n0.0,accepted\n1.0,\"late, dropped\"\n2.0,\"a \"\"b\"\"\"\n3.0,\n");
}

TEST_F(Csv, LongTablesSurviveTheBuffer) {
  constexpr std::size_t kRows = 200000;
  write_csv(path("imu.csv"),
            {{"time_s", 3},
             {"gyro_x_rps", 9},
             {"gyro_y_rps", 9},
             {"gyro_z_rps", 9},
             {"accel_x_mps2", 6},
             {"accel_y_mps2", 6},
             {"accel_z_mps2", 6}},
            kRows, [](std::size_t row, double* cells) {
              cells[0] = 0.005 * static_cast<double>(row);
              for (std::size_t i = 1; i < 7; ++i) cells[i] = std::sin(static_cast<double>(row * i));
            });
  const ImuSeries samples = read_imu_csv(path("imu.csv"), warnings);
  ASSERT_EQ(samples.size(), kRows);
  for (std::size_t row = 0; row < kRows; ++row) {
    ASSERT_NEAR(samples[row].t_s, 0.005 * static_cast<double>(row), 1e-12);                // exact to 3 decimals
    ASSERT_NEAR(samples[row].omega_ib_b(0), std::sin(static_cast<double>(row)), 0.51e-9);  // half of the last decimal
    ASSERT_NEAR(samples[row].f_ib_b(2), std::sin(static_cast<double>(row * 6)), 0.51e-6);
  }
}

// ---- Files that are whole or absent

TEST_F(Csv, FailureWhileWritingLeavesTheOldFileAndNoPart) {
  write_text_file(path("out.csv"), "old");
  const auto fill = [](std::size_t row, double* cells) {
    if (row == 50000) throw std::runtime_error("no more");
    cells[0] = static_cast<double>(row);
  };
  EXPECT_THROW(write_csv(path("out.csv"), {{"a", -1}}, 100000, fill), std::runtime_error);
  EXPECT_EQ(read_text_file(path("out.csv")), "old");
  EXPECT_FALSE(std::filesystem::exists(path("out.csv.part")));
}

TEST_F(Csv, WritingReplacesTheOldFileAndLeavesNoPart) {
  write_text_file(path("a.txt"), "something long");
  const std::string bytes("a\0\r\n", 4);
  write_text_file(path("a.txt"), bytes);
  EXPECT_EQ(read_text_file(path("a.txt")), bytes);
  EXPECT_FALSE(std::filesystem::exists(path("a.txt.part")));
}

TEST_F(Csv, PlaceThatCannotBeWrittenIsRefused) {
  EXPECT_EQ(error_of([&] { write_text_file(path("none/a.txt"), "x"); }),
            "none/a.txt: cannot be written: No such file or directory");
  EXPECT_EQ(error_of([&] {
              write_csv(path("none/a.csv"), {{"a", 1}}, 0, [](std::size_t, double*) {});
            }),
            "none/a.csv: cannot be written: No such file or directory");
  std::filesystem::create_directory(directory / "folder");
  EXPECT_EQ(error_of([&] { write_text_file(path("folder"), "x"); }), "folder: cannot be written: Is a directory");
  EXPECT_FALSE(std::filesystem::exists(path("folder.part")));
}

TEST_F(Csv, FullDiskIsReported) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
  std::filesystem::create_symlink("/dev/full", directory / "a.txt.part");
  EXPECT_EQ(error_of([&] { write_text_file(path("a.txt"), "x"); }),
            "a.txt: cannot be written: No space left on device");
  EXPECT_FALSE(std::filesystem::exists(path("a.txt")));
  EXPECT_FALSE(std::filesystem::is_symlink(path("a.txt.part")));
}

}  // namespace
}  // namespace liealign
