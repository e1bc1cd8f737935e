// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/survey.h"

namespace sheaf {
namespace {

constexpr const char* kImages =
    "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT NOT NULL, camera_id INTEGER);"
    "INSERT INTO images VALUES (1, 'a.jpg', 1), (2, 'b.jpg', 1), (3, 'sub/c.jpg', 1);";
/// As COLMAP 3.11 to 3.13 make it, and as 4 does.
constexpr const char* kOld =
    "CREATE TABLE pose_priors (image_id INTEGER PRIMARY KEY NOT NULL, position BLOB, "
    "coordinate_system INTEGER NOT NULL, position_covariance BLOB);";
constexpr const char* kNew =
    "CREATE TABLE pose_priors (pose_prior_id INTEGER PRIMARY KEY NOT NULL, corr_data_id INTEGER "
    "NOT NULL, corr_sensor_id INTEGER NOT NULL, corr_sensor_type INTEGER NOT NULL, position BLOB, "
    "position_covariance BLOB, gravity BLOB, coordinate_system INTEGER NOT NULL);";

std::string blob(const std::vector<double>& values) {
  std::string out = "X'";
  for (const double x : values) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    for (int k = 0; k < 8; ++k)
      for (const int shift : {4, 0}) out += "0123456789ABCDEF"[bits >> (8 * k + shift) & 15];
  }
  return out + "'";
}
std::string diagonal(double a, double b, double c) { return blob({a, 0, 0, 0, b, 0, 0, 0, c}); }
std::string nans(std::size_t count) { return blob(std::vector<double>(count, std::nan(""))); }

class SurveyDatabase : public testing::Test {
 protected:
  void make(const std::string& statements) {
    const std::string path = folder_ / "database.db";
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(path + end);
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    char* words = nullptr;
    EXPECT_EQ(sqlite3_exec(database, statements.c_str(), nullptr, nullptr, &words), SQLITE_OK)
        << (words == nullptr ? "" : words);
    sqlite3_free(words);
    sqlite3_close(database);
  }
  Result<Constraints> read() { return read_constraints(folder_ / "database.db"); }
  std::string refusal() {
    const Result<Constraints> got = read();
    return got.ok() ? "read" : std::string(got.error().what());
  }
  TemporaryFolder folder_;
};

TEST_F(SurveyDatabase, RowsOfCamerasAreRead) {
  // COLMAP keeps its databases so, and closes them without a log beside them.
  make("PRAGMA journal_mode=WAL;" + std::string(kImages) + kNew +
       "INSERT INTO pose_priors VALUES (1, 1, 1, 0, " + blob({52.5, 13.4, 34}) + ", " +
       diagonal(0.25, 0.25, 1) + ", " + blob({0.1, 0.9, 0.3}) + ", 0), (2, 3, 1, 0, " +
       blob({52.6, 13.5, 35}) + ", " + nans(9) + ", " + blob({0, 1, 0}) + ", 0), (3, 2, 1, 0, " +
       nans(3) + ", " + nans(9) + ", " + nans(3) + ", -1), (4, 2, 1, 1, " + blob({1, 2, 3}) +
       ", NULL, NULL, 0), (5, 77, 1, 0, " + blob({1, 2, 3}) + ", NULL, NULL, 0);");
  const Constraints c = read().value();
  EXPECT_EQ(c.frame.kind, WorldKind::geodetic);
  ASSERT_EQ(c.positions.size(), 2u);
  EXPECT_EQ(c.positions[0].image, "a.jpg");
  EXPECT_EQ(c.positions[0].at, (std::array<double, 3>{52.5, 13.4, 34}));
  EXPECT_EQ(c.positions[0].covariance, (Covariance3{0.25, 0, 0, 0, 0.25, 0, 0, 0, 1}));
  EXPECT_EQ(c.positions[1].image, "sub/c.jpg");
  EXPECT_EQ(c.positions[1].covariance, kUnitCovariance3);
  ASSERT_EQ(c.gravities.size(), 1u);
  EXPECT_NEAR(std::hypot(c.gravities[0].down[0], c.gravities[0].down[1], c.gravities[0].down[2]), 1,
              1e-15);
  EXPECT_NEAR(c.gravities[0].down[1], 0.9 / std::sqrt(0.91), 1e-15);
  ASSERT_EQ(c.notes.size(), 4u);
  const std::string path = folder_ / "database.db";
  EXPECT_EQ(c.notes[0], path + ": 1 of the positions have no covariance: sigma is 1");
  EXPECT_EQ(c.notes[2], path + ": 1 rows of pose_priors are of sensors that are no cameras");
  EXPECT_EQ(c.notes[3], path + ": 1 rows of pose_priors are of no image of the database");
  // Nothing was left beside it.
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"database.db"});
}

TEST_F(SurveyDatabase, TheOlderLayoutIsRead) {
  make(std::string(kImages) + kOld + "INSERT INTO pose_priors VALUES (1, " + blob({1, 2, 3}) +
       ", 1, " + blob({1, 0.5, 0, 0.5, 2, 0, 0, 0, 3}) + "), (2, " + blob({4, 5, 6}) +
       ", 1, NULL);");
  const Constraints c = read().value();
  EXPECT_EQ(c.frame.kind, WorldKind::local);
  ASSERT_EQ(c.positions.size(), 2u);
  EXPECT_EQ(c.positions[0].at, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(c.positions[0].covariance, (Covariance3{1, 0.5, 0, 0.5, 2, 0, 0, 0, 3}));
  make(std::string(kImages) + kOld + "INSERT INTO pose_priors VALUES (1, " + blob({500000, 2, 3}) +
       ", -1, NULL);");
  EXPECT_EQ(read().value().frame.kind, WorldKind::projected);
}

TEST_F(SurveyDatabase, BadDatabasesAreToldWithTableRowAndImage) {
  const std::string row = "database.db: table pose_priors, row 2 of image 'b.jpg': ";
  const std::string first = "INSERT INTO pose_priors VALUES (1, " + blob({1, 2, 3}) + ", 1, NULL)";
  const struct {
    std::string statements, expected;
  } kCases[] = {
      {kImages, "database.db: found no table pose_priors, expected one as COLMAP has it"},
      {kOld, "database.db: found no table images with image_id and name, expected COLMAP's"},
      {std::string(kImages) + "CREATE TABLE pose_priors (image_id INTEGER);",
       "database.db: table pose_priors: found other columns, expected those of COLMAP"},
      {std::string(kImages) + kOld + first + ", (2, X'0011', 1, NULL);",
       row + "found 2 bytes of position, expected 24: 3 doubles"},
      {std::string(kImages) + kOld + first + ", (2, " + blob({1, 2, 3}) + ", 1, X'00');",
       row + "found 1 bytes of position_covariance, expected 72: 9 doubles"},
      {std::string(kImages) + kOld + first + ", (2, " + blob({1, 2, 3}) + ", 0, NULL);",
       row + "found coordinate_system 0, expected 1 as of image 'a.jpg': frames of the world are "
             "mixed"},
      {std::string(kImages) + kOld + first + ", (2, " + blob({1, 2, 3}) + ", 7, NULL);",
       row + "found coordinate_system 7, expected 0 (WGS84), 1 (Cartesian) or -1"},
      {std::string(kImages) + kOld + first + ", (2, " + blob({1, 2, 3}) + ", 1, " +
           diagonal(1, 1, 0) + ");",
       row + "found a position_covariance that is not, expected one that is positive definite"},
      {std::string(kImages) + kOld + "INSERT INTO pose_priors VALUES (2, " + blob({91, 2, 3}) +
           ", 0, NULL);",
       row + "found a latitude or longitude out of range, expected degrees"},
  };
  for (const auto& [statements, expected] : kCases) {
    make(statements);
    EXPECT_NE(refusal().find(expected), std::string::npos) << refusal();
  }
}

TEST_F(SurveyDatabase, DamagedFilesAreErrors) {
  make(std::string(kImages) + kOld + "INSERT INTO pose_priors VALUES (1, " + blob({1, 2, 3}) +
       ", 1, NULL);");
  const std::string whole = contents_of(folder_ / "database.db");
  ASSERT_GT(whole.size(), 4096u);
  write_text(folder_ / "database.db", whole.substr(0, 4096));
  EXPECT_NE(refusal().find("found what SQLite calls"), std::string::npos) << refusal();
  std::string noise = whole;
  for (std::size_t i = 100; i < noise.size(); ++i) noise[i] = static_cast<char>(i * 37);
  write_text(folder_ / "database.db", noise);
  EXPECT_NE(refusal(), "read");
}

}  // namespace
}  // namespace sheaf
