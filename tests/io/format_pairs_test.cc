// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// From every format to every other: what the table of docs/formats.md says is kept is kept, and
// what it says is dropped is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "io/bytes.h"
#include "io/format.h"
#include "io/models.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;

/// The files that formats are written as here.
const std::map<std::string, std::string> kFiles{{"bal", "a.txt"},
                                                {"bundler", "a.out"},
                                                {"nvm", "a.nvm"},
                                                {"libmv", "a.problem"},
                                                {"opensfm", "reconstruction.json"},
                                                {"openmvg", "sfm_data.json"},
                                                {"alicevision", "a.sfm"},
                                                {"colmap", "model/"},
                                                {"colmap-text", "text/"}};

FormatHolds holds(const std::string& format) {
  if (!format.starts_with("colmap")) return format_named(format)->holds;
  FormatHolds all;
  all.idle_features = true;
  return all;
}

/// Three images by one pinhole, with noise, and all that files can say besides.
Problem scene() {
  Problem problem = seen_by({{CameraModel::simple_pinhole, {500, 320, 240}, 640, 480}}, 3, 7, 11);
  for (std::size_t i = 0; i < problem.observation_xy.size(); ++i)
    problem.observation_xy[i] += 0.5 * std::sin(static_cast<double>(i));
  auto metadata = std::make_shared<SceneMetadata>();
  metadata->camera_ids = {4};
  metadata->image_ids = {9, 3, 5};
  metadata->image_names = {"left 1.jpg", "b.jpg", "sub/c.jpg"};
  for (std::uint8_t p = 0; p < 7; ++p) {
    metadata->point_ids.push_back(20u - p);
    metadata->point_colours.push_back({p, 100, 200});
  }
  problem.metadata = metadata;
  return problem;
}

struct Kept {
  bool shared_lenses, sizes, names, point_ids, camera_ids, colours;
};

Kept kept_of(const Problem& problem, const Problem& original) {
  static const SceneMetadata kNone;
  const SceneMetadata& was = *original.metadata;
  const SceneMetadata& is = problem.metadata ? *problem.metadata : kNone;
  return {problem.cameras.size() == 1,
          problem.cameras[0].width_px == 640 && problem.cameras[0].height_px == 480,
          is.image_names == was.image_names,
          is.point_ids == was.point_ids,
          is.camera_ids == was.camera_ids,
          is.point_colours == was.point_colours};
}

bool told(const std::vector<std::string>& lost, const std::string& what) {
  return std::any_of(lost.begin(), lost.end(), [&](const std::string& sentence) {
    return sentence.find(what) != std::string::npos;
  });
}

TEST(FormatPairs, EachKeepsWhatTheTableSaysAndTellsTheRest) {
  const Problem original = scene();
  for (const auto& [format, file] : kFiles) {
    SCOPED_TRACE(format);
    const Folder folder;
    write(original, folder / file, {.format = format}).value();
    EXPECT_EQ(write_format(original, folder / file), format == "colmap-text" ? "colmap" : format);
    const InputFile again = read_file(folder / file).value();
    EXPECT_EQ(again.format, format);
    const Kept kept = kept_of(again.problem, original);
    const FormatHolds has = holds(format);
    const std::vector<std::string> lost = lost_in(format, original);
    EXPECT_EQ(kept.shared_lenses, has.shared_lenses);
    EXPECT_EQ(kept.sizes, has.sizes);
    EXPECT_EQ(kept.names, has.names);
    EXPECT_EQ(kept.point_ids, has.point_ids);
    // OpenSfM's lenses have names and no numbers.
    EXPECT_EQ(kept.camera_ids, has.camera_ids && format != "opensfm");
    EXPECT_EQ(kept.colours, has.colours);
    EXPECT_EQ(told(lost, "lenses that images share"), !has.shared_lenses);
    EXPECT_EQ(told(lost, "size of the images"), !has.sizes);
    EXPECT_EQ(told(lost, "image names are"), !has.names);
    EXPECT_EQ(told(lost, "ids are"), !has.point_ids || !has.camera_ids);
    EXPECT_EQ(told(lost, "colours are"), !has.colours);
    EXPECT_EQ(told(lost, "single precision"), !has.doubles);
    EXPECT_EQ(told(lost, "principal point"), !has.principal_points);
    // A second time nothing is lost that is not lost already.
    const Folder second;
    write(again.problem, second / file, {.format = format}).value();
    EXPECT_TRUE(same_state(read(second / file).value(), again.problem));
  }
}

TEST(FormatPairs, FromEachToEachTheCostIsTheSame) {
  const Problem original = scene();
  const double cost = evaluate(original).cost;
  for (const auto& [from, from_file] : kFiles) {
    const Folder folder;
    write(original, folder / from_file, {.format = from}).value();
    const Problem read_back = read(folder / from_file).value();
    for (const auto& [to, to_file] : kFiles) {
      SCOPED_TRACE(from + " to " + to);
      const Folder target;
      const Result<void> written = write(read_back, target / to_file, {.format = to});
      const bool in_pixels_of_a_size = to == "opensfm" || to == "alicevision";
      // A lens for each image, which one for all cannot be; sizes that are not known.
      if (to == "libmv" && !holds(from).shared_lenses) {
        EXPECT_FALSE(written.ok());
        continue;
      }
      if (in_pixels_of_a_size && (from == "nvm" || from == "libmv")) {
        ASSERT_FALSE(written.ok());
        EXPECT_NE(std::string(written.error().what()).find("size is not known"), std::string::npos);
        continue;
      }
      ASSERT_TRUE(written.ok()) << written.error().what();
      const bool single = from == "libmv" || to == "libmv";
      EXPECT_NEAR(evaluate(read(target / to_file).value()).cost, cost,
                  (single ? 1e-3 : 1e-9) * cost);
    }
  }
}

/// The table of docs/formats.md is made of what formats say of themselves.
TEST(FormatPairs, TheTableOfThePageIsRight) {
  std::ifstream page("docs/formats.md");
  std::map<std::string, std::vector<std::string>> rows;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| `")) continue;
    std::vector<std::string> cells;
    for (std::size_t at = 2; at < line.size();) {
      const std::size_t end = line.find(" | ", at);
      cells.push_back(line.substr(at, end == line.npos ? line.size() - 2 - at : end - at));
      if (end == line.npos) break;
      at = end + 3;
    }
    rows[cells[0].substr(1, cells[0].size() - 2)] = cells;
  }
  const auto mark = [](bool kept) { return std::string(kept ? "yes" : "-"); };
  for (const auto& [format, file] : kFiles) {
    SCOPED_TRACE(format);
    const FormatHolds has = holds(format);
    ASSERT_EQ(rows.count(format), 1u);
    const std::vector<std::string>& cells = rows[format];
    ASSERT_EQ(cells.size(), 10u);
    EXPECT_EQ(cells[1], mark(has.shared_lenses));
    EXPECT_EQ(cells[2], mark(has.principal_points));
    EXPECT_EQ(cells[3], mark(has.sizes));
    EXPECT_EQ(cells[4], mark(has.names));
    EXPECT_EQ(cells[5], mark(has.point_ids));
    EXPECT_EQ(cells[6], mark(has.camera_ids));
    EXPECT_EQ(cells[7], mark(has.colours));
    EXPECT_EQ(cells[8], mark(has.idle_features));
    EXPECT_EQ(cells[9], mark(has.doubles));
  }
}

TEST(FormatFiles, WhatIsNotReadIsToldWithTheWayRound) {
  const Folder folder;
  const auto message = [&](const std::string& bytes) {
    spill(folder / "x", bytes);
    const Result<InputFile> refused = read_file(folder / "x");
    EXPECT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code(), ErrorCode::unreadable_input);
    return std::string(refused.error().what());
  };
  const auto says = [&](const std::string& bytes, const std::vector<std::string>& parts) {
    const std::string text = message(bytes);
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << " not in: " << text;
  };
  says("hello\n", {"found 'hello'", "BAL", "NVM", "OpenSfM", "OpenMVG", "AliceVision", "g2o"});
  says(std::string("SQLite format 3\0", 16), {"database", "colmap mapper"});
  says("<?xml version=\"1.0\"?><document>", {"Metashape", "Bundler"});
  says("ply\nformat", {"PLY", "observations"});
  says("{\"frames\": []}", {"nerfstudio", "OpenSfM"});
  says("{\"a\": [}", {"x:1: found '}'", "JSON"});
}

TEST(FormatFiles, AJsonIsWhatItWasReadAsOrMustBeNamed) {
  const Folder folder;
  const Problem original = scene();
  const Result<void> refused = write(original, folder / "o.json");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(refused.error().what()).find("sfm_data.json"), std::string::npos);
  write(original, folder / "sfm_data.json").value();
  EXPECT_EQ(write_format(read(folder / "sfm_data.json").value(), folder / "o.json"), "openmvg");
  EXPECT_EQ(write_format(original, folder / "sub/transforms.json"), "nerfstudio");
}

/// tracks.csv has more than the reconstruction, and is another program's.
TEST(FormatFiles, TheFileBesideThatWasReadIsNotOverwritten) {
  const Folder folder;
  std::filesystem::create_directory(folder / "other");
  write(scene(), folder / "reconstruction.json").value();
  const Problem problem = read(folder / "reconstruction.json").value();
  const std::string tracks = slurp(folder / "tracks.csv");
  Problem moved = problem;
  moved.points[0] += 1e-3;
  const Result<void> refused = write(moved, folder / "refined.json");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code(), ErrorCode::unwritable_output);
  EXPECT_EQ(slurp(folder / "tracks.csv"), tracks);
  EXPECT_EQ(folder.files(), 3u);
  EXPECT_TRUE(write(moved, folder / "other/reconstruction.json").ok());
  std::filesystem::remove(folder / "tracks.csv");
  const InputFile alone = read_file(folder / "reconstruction.json").value();
  EXPECT_EQ(alone.problem.num_observations(), 0u);
  EXPECT_NE(alone.notes.at(0).find("no tracks.csv"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
