// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "io/line_cursor.h"
#include "scene/terms.h"
#include "survey/constraint_files.h"

namespace sheaf {
namespace {

// What COLMAP supposes of a position without a covariance, in units of its frame.
constexpr double kPositionSigma = 1;
// Of gravity, which it states without one: what the sensors of a telephone reach.
constexpr double kGravitySigma_rad = 2 * std::numbers::pi / 180;
// Coordinates of a Cartesian frame that are larger are counted from an origin near them.
constexpr double kSmall = 1e4;
constexpr int kUndefined = -1, kWgs84 = 0, kCartesian = 1;

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

/// A path as a URI of SQLite has it.
std::string uri_of(const std::filesystem::path& path) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out = "file:";
  for (const char c : path.string()) {
    if (c == '%' || c == '?' || c == '#') {
      out += {'%', kDigits[static_cast<unsigned char>(c) >> 4], kDigits[c & 15]};
    } else {
      out += c;
    }
  }
  return out;
}

/// Whether there is a log of writes beside the database that are not yet in it.
bool has_log(const std::filesystem::path& path) {
  std::error_code missing;
  const auto bytes = std::filesystem::file_size(path.string() + "-wal", missing);
  return !missing && bytes > 0;
}

/// Three doubles or nine; empty where there are none, or where one is not finite.
struct Numbers {
  std::vector<double> values;
  std::string wrong;  ///< "found 20 bytes of position, expected 24: 3 doubles"
};

double little_endian_double(const unsigned char* bytes) {
  std::uint64_t bits = 0;
  for (int k = 7; k >= 0; --k) bits = bits << 8 | bytes[k];
  return std::bit_cast<double>(bits);
}

Numbers numbers_of(sqlite3_stmt* row, int column, std::size_t count, const std::string& what) {
  Numbers out;
  if (sqlite3_column_type(row, column) == SQLITE_NULL) return out;
  const auto* bytes = static_cast<const unsigned char*>(sqlite3_column_blob(row, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, column));
  if (size == 0 || bytes == nullptr) return out;
  if (size != 8 * count || sqlite3_column_type(row, column) != SQLITE_BLOB) {
    out.wrong = "found " + std::to_string(size) + " bytes of " + what + ", expected " +
                std::to_string(8 * count) + ": " + std::to_string(count) + " doubles";
    return out;
  }
  for (std::size_t k = 0; k < count; ++k) out.values.push_back(little_endian_double(bytes + 8 * k));
  if (!std::all_of(out.values.begin(), out.values.end(), [](double x) { return std::isfinite(x); }))
    out.values.clear();
  return out;
}

/// What COLMAP makes of the orientation in an image's EXIF: an axis of the camera, right to some
/// tens of degrees.
bool along_an_axis(const std::vector<double>& v) {
  return std::count(v.begin(), v.end(), 0.0) == 2;
}

/// Reads the table row by row and keeps the first error.
class Reading {
 public:
  explicit Reading(const std::filesystem::path& path) : path_(path) {
    out_.paths = {path.string()};
  }

  Result<Constraints> run() {
    if (auto e = open()) return *e;
    std::string query;
    if (auto e = choose(query)) return *e;
    Statement rows;
    if (auto e = prepare(query, rows)) return *e;
    int state = SQLITE_ROW;
    while ((state = sqlite3_step(rows.get())) == SQLITE_ROW)
      if (auto e = read_row(rows.get())) return *e;
    if (state != SQLITE_DONE) return refuse("table pose_priors: " + said());
    finish();
    return std::move(out_);
  }

 private:
  Error refuse(const std::string& words) const {
    return Error(ErrorCode::unreadable_input, path_.string() + ": " + words);
  }
  std::string said() const {
    return "found what SQLite calls " + sheaf::quoted(sqlite3_errmsg(database_.get())) +
           ", expected a database of COLMAP";
  }

  std::optional<Error> open() {
    // A database that nobody writes is read without files beside it, wherever it lies.
    const std::string uri = uri_of(path_) + (has_log(path_) ? "?mode=ro" : "?immutable=1");
    sqlite3* opened = nullptr;
    const int state =
        sqlite3_open_v2(uri.c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database_.reset(opened);
    if (state != SQLITE_OK) return refuse(said());
    sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_exec(opened, "PRAGMA trusted_schema=OFF", nullptr, nullptr, nullptr);
    return {};
  }

  std::optional<Error> prepare(const std::string& query, Statement& statement) {
    sqlite3_stmt* prepared = nullptr;
    const int state = sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &prepared, nullptr);
    statement.reset(prepared);
    if (state != SQLITE_OK) return refuse(said());
    return {};
  }

  /// The columns of a table; none where there is no such table.
  std::optional<Error> columns(const std::string& table, std::set<std::string>& out) {
    Statement rows;
    if (auto e = prepare("SELECT name FROM pragma_table_info('" + table +
                             "') WHERE EXISTS (SELECT 1 FROM sqlite_master WHERE type = 'table' "
                             "AND name = '" +
                             table + "')",
                         rows))
      return e;
    int state = SQLITE_ROW;
    while ((state = sqlite3_step(rows.get())) == SQLITE_ROW)
      out.insert(reinterpret_cast<const char*>(sqlite3_column_text(rows.get(), 0)));
    if (state != SQLITE_DONE) return refuse(said());
    return {};
  }

  /// Up to 3.13 a row is of an image, from 4.0 on of a sensor's data, which image it is where the
  /// sensor is a camera (0).
  std::optional<Error> choose(std::string& query) {
    std::set<std::string> priors, images;
    if (auto e = columns("pose_priors", priors)) return e;
    if (auto e = columns("images", images)) return e;
    const auto has = [&priors](std::initializer_list<const char*> names) {
      return std::all_of(names.begin(), names.end(),
                         [&priors](const char* name) { return priors.contains(name); });
    };
    if (priors.empty())
      return refuse("found no table pose_priors, expected one as COLMAP has it from 3.11 on");
    if (!images.contains("image_id") || !images.contains("name"))
      return refuse("found no table images with image_id and name, expected COLMAP's");
    const std::string what = "i.name, p.position, p.position_covariance, p.coordinate_system, ";
    if (has({"image_id", "position", "position_covariance", "coordinate_system"})) {
      query = "SELECT p.image_id, 0, " + what +
              "NULL FROM pose_priors p LEFT JOIN images i ON i.image_id = p.image_id "
              "ORDER BY p.image_id";
      return {};
    }
    if (!has({"pose_prior_id", "corr_data_id", "corr_sensor_type", "position",
              "position_covariance", "coordinate_system"}))
      return refuse("table pose_priors: found other columns, expected those of COLMAP 3.11 to 4");
    query = "SELECT p.pose_prior_id, p.corr_sensor_type, " + what +
            (has({"gravity"}) ? "p.gravity" : "NULL") +
            " FROM pose_priors p LEFT JOIN images i ON i.image_id = p.corr_data_id "
            "ORDER BY p.pose_prior_id";
    return {};
  }

  std::optional<Error> read_row(sqlite3_stmt* row) {
    enum { kId, kSensor, kName, kPosition, kCovariance, kSystem, kGravity };
    if (sqlite3_column_int64(row, kSensor) != 0) return ++other_sensors_, std::nullopt;
    const std::string id = std::to_string(sqlite3_column_int64(row, kId));
    const unsigned char* name = sqlite3_column_text(row, kName);
    if (name == nullptr) return ++without_image_, std::nullopt;
    image_ = reinterpret_cast<const char*>(name);
    row_ = "table pose_priors, row " + id + " of image " + sheaf::quoted(image_) + ": ";
    const Numbers at = numbers_of(row, kPosition, 3, "position");
    const Numbers covariance = numbers_of(row, kCovariance, 9, "position_covariance");
    const Numbers gravity = numbers_of(row, kGravity, 3, "gravity");
    for (const Numbers* read : {&at, &covariance, &gravity})
      if (!read->wrong.empty()) return refuse(row_ + read->wrong);
    if (!gravity.values.empty()) add_gravity(gravity.values);
    if (at.values.empty()) return {};
    const std::int64_t system = sqlite3_column_int64(row, kSystem);
    if (system < kUndefined || system > kCartesian)
      return refuse(row_ + "found coordinate_system " + std::to_string(system) +
                    ", expected 0 (WGS84), 1 (Cartesian) or -1 (undefined)");
    return add_position(at.values, covariance.values, static_cast<int>(system));
  }

  std::optional<Error> add_position(const std::vector<double>& at,
                                    const std::vector<double>& covariance, int system) {
    if (!system_) system_ = system, first_ = image_;
    if (system != *system_)
      return refuse(row_ + "found coordinate_system " + std::to_string(system) + ", expected " +
                    std::to_string(*system_) + " as of image " + sheaf::quoted(first_) +
                    ": frames of the world are mixed");
    if (system == kWgs84 && (std::abs(at[0]) > 90 || std::abs(at[1]) > 360))
      return refuse(row_ + "found a latitude or longitude out of range, expected degrees");
    ImagePosition& p = out_.positions.emplace_back();
    p.image = image_;
    std::copy(at.begin(), at.end(), p.at.begin());
    constexpr double kVariance = kPositionSigma * kPositionSigma;
    p.covariance = {kVariance, 0, 0, 0, kVariance, 0, 0, 0, kVariance};
    if (covariance.empty()) return ++without_sigma_, std::nullopt;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        p.covariance[3 * r + c] = (covariance[3 * r + c] + covariance[3 * c + r]) / 2;
    if (!whitening(p.covariance))
      return refuse(row_ +
                    "found a position_covariance that is not, expected one that is positive "
                    "definite, or NaN for none");
    return {};
  }

  void add_gravity(const std::vector<double>& v) {
    const double norm = std::hypot(v[0], v[1], v[2]);
    if (!(norm > 0) || along_an_axis(v)) return static_cast<void>(++rough_gravity_);
    ImageGravity& g = out_.gravities.emplace_back();
    g.image = image_;
    g.down = {v[0] / norm, v[1] / norm, v[2] / norm};
    g.sigma_rad = kGravitySigma_rad;
  }

  void note(std::size_t count, const std::string& words) {
    if (count > 0)
      out_.notes.push_back(path_.string() + ": " + std::to_string(count) + " " + words);
  }

  void finish() {
    const bool large =
        std::any_of(out_.positions.begin(), out_.positions.end(), [](const ImagePosition& p) {
          return std::any_of(p.at.begin(), p.at.end(),
                             [](double x) { return std::abs(x) > kSmall; });
        });
    if (system_ == kWgs84) {
      out_.frame = {WorldKind::geodetic, "WGS84", {}};
    } else if (large) {
      out_.frame.kind = WorldKind::projected;
    }
    note(without_sigma_, "of the positions have no covariance: sigma is 1");
    note(rough_gravity_,
         "directions of gravity are an axis of the camera, as the orientation in EXIF "
         "gives them, and are not used");
    note(other_sensors_, "rows of pose_priors are of sensors that are no cameras");
    note(without_image_, "rows of pose_priors are of no image of the database");
  }

  std::filesystem::path path_;
  Database database_;
  Constraints out_;
  std::string image_, row_;    ///< of the row, and how messages begin
  std::optional<int> system_;  ///< of the positions
  std::string first_;          ///< whose it was
  std::size_t without_sigma_ = 0, rough_gravity_ = 0, other_sensors_ = 0, without_image_ = 0;
};

}  // namespace

Result<Constraints> read_pose_priors(const std::filesystem::path& path) {
  return Reading(path).run();
}

}  // namespace sheaf
