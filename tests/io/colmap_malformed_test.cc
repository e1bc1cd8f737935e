// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>

#include "io/bytes.h"
#include "io/colmap.h"
#include "io/models.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Offsets in the files of tiny_binary.
constexpr std::size_t kModel = 12, kWidth = 16, kFocal = 32;
constexpr std::size_t kQuaternion = 12, kCameraId = 68, kName = 72;
constexpr std::size_t kFeatures = 72 + 15, kFeature0 = kFeatures + 8;
constexpr std::size_t kImage1 = kFeature0 + 3 * 24;
constexpr std::size_t kPointId = 8, kXyz = 16, kError = 43, kTrack = 51;
constexpr std::size_t kPoint1 = kTrack + 8 + 16;

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

struct Broken {
  const char* name;
  std::function<void(ColmapFiles&)> damage;
  const char* message;  ///< how it begins
};

void expect_refused(const Broken& broken, ColmapFiles files) {
  SCOPED_TRACE(broken.name);
  broken.damage(files);
  const Result<Problem> result = parse_colmap(files);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
  const std::string message = result.error().what();
  EXPECT_EQ(message.substr(0, std::strlen(broken.message)), broken.message);
  EXPECT_NE(message.find("found"), std::string::npos) << message;
  EXPECT_NE(message.find("expected"), std::string::npos) << message;
}

TEST(ColmapMalformed, BinaryFilesAreRefusedWithTheirByte) {
  const Broken kinds[] = {
      {"more cameras than bytes", [](auto& f) { put<std::uint64_t>(f.cameras, 0, 7); },
       "m/cameras.bin: byte 0: found 7 cameras, expected at most the 6"},
      {"absurd number of cameras", [](auto& f) { put<std::uint64_t>(f.cameras, 0, kNone); },
       "m/cameras.bin: byte 0: found 18446744073709551615 cameras"},
      {"unknown camera model", [](auto& f) { put<std::int32_t>(f.cameras, kModel, 99); },
       "m/cameras.bin: byte 12: found camera model 99, expected one that Sheaf knows: 0 SIMPLE"},
      {"negative camera model", [](auto& f) { put<std::int32_t>(f.cameras, kModel, -1); },
       "m/cameras.bin: byte 12: found camera model -1"},
      {"absurd width", [](auto& f) { put<std::uint64_t>(f.cameras, kWidth, kNone); },
       "m/cameras.bin: byte 8: found an image of 18446744073709551615 x 480 pixels"},
      {"focal length not a number", [](auto& f) { put(f.cameras, kFocal, kNaN); },
       "m/cameras.bin: byte 8: found a parameter that is not finite"},
      {"camera id twice", [](auto& f) { put<std::uint32_t>(f.cameras, 64, 7); },
       "m/cameras.bin: byte 64: found camera id 7 a second time"},
      {"bytes behind the cameras", [](auto& f) { f.cameras += "x"; },
       "m/cameras.bin: byte 152: found 1 more bytes"},
      {"more images than bytes", [](auto& f) { put<std::uint64_t>(f.images, 0, 1000); },
       "m/images.bin: byte 0: found 1000 images"},
      {"image id twice", [](auto& f) { put<std::uint32_t>(f.images, kImage1, 12); },
       "m/images.bin: byte 167: found image id 12 a second time"},
      {"quaternion of zeros",
       [](auto& f) { put(f.images, kQuaternion, 0.0), put(f.images, kQuaternion + 8, 0.0); },
       "m/images.bin: byte 8: found a quaternion of no direction"},
      {"infinite translation",
       [](auto& f) { put(f.images, kQuaternion + 32, std::numeric_limits<double>::infinity()); },
       "m/images.bin: byte 8: found a number that is not finite, expected a finite pose of image"},
      {"camera that is not there", [](auto& f) { put<std::uint32_t>(f.images, kCameraId, 8); },
       "m/images.bin: byte 8: found camera id 8 of image 12, expected the id of one of the 2"},
      {"name without an end",
       [](auto& f) {
         put<std::uint64_t>(f.images, 0, 1);
         f.images = f.images.substr(0, kName) + std::string(40, 'x');
       },
       "m/images.bin: byte 112: found the end of the file, expected the rest of image 1 of 1"},
      {"more features than bytes",
       [](auto& f) { put<std::uint64_t>(f.images, kFeatures, 1u << 30); },
       "m/images.bin: byte 87: found 1073741824 features, expected at most the "},
      {"feature not a number", [](auto& f) { put(f.images, kFeature0, kNaN); },
       "m/images.bin: byte 95: found a number that is not finite, expected the position of "
       "feature"},
      {"feature of a point that is not there",
       [](auto& f) { put<std::uint64_t>(f.images, kFeature0 + 24 + 16, 77); },
       "m/images.bin: byte 119: found feature 1 of image 12 naming point 77"},
      {"more points than bytes", [](auto& f) { put<std::uint64_t>(f.points, 0, 1u << 20); },
       "m/points3D.bin: byte 0: found 1048576 points"},
      {"point id twice", [](auto& f) { put<std::uint64_t>(f.points, kPoint1, 41); },
       "m/points3D.bin: byte 75: found point id 41 a second time"},
      {"point id of none", [](auto& f) { put<std::uint64_t>(f.points, kPointId, kNone); },
       "m/points3D.bin: byte 8: found point id 18446744073709551615"},
      {"coordinate not a number", [](auto& f) { put(f.points, kXyz, kNaN); },
       "m/points3D.bin: byte 8: found a number that is not finite, expected the coordinates"},
      {"error not a number", [](auto& f) { put(f.points, kError, kNaN); },
       "m/points3D.bin: byte 8: found a number that is not finite, expected the error"},
      {"track longer than the file",
       [](auto& f) { put<std::uint64_t>(f.points, kTrack, 1u << 20); },
       "m/points3D.bin: byte 51: found 1048576 track elements"},
      {"image that is not there", [](auto& f) { put<std::uint32_t>(f.points, kTrack + 8, 5); },
       "m/points3D.bin: byte 59: found image id 5 in the track of point 41"},
      {"feature that is not there", [](auto& f) { put<std::uint32_t>(f.points, kTrack + 12, 2); },
       "m/points3D.bin: byte 59: found feature 2 of image 4 in the track of point 41, expected one "
       "of its 2 features"},
      {"feature of no point", [](auto& f) { put<std::uint32_t>(f.points, kTrack + 12, 0); },
       "m/points3D.bin: byte 59: found feature 0 of image 4 in the track of point 41, expected a "
       "feature that names this point, not none"},
      {"feature of another point", [](auto& f) { put<std::uint32_t>(f.points, kTrack + 20, 2); },
       "m/points3D.bin: byte 67: found feature 2 of image 12 in the track of point 41, expected a "
       "feature that names this point, not 5"},
      {"feature twice",
       [](auto& f) {
         put<std::uint64_t>(f.points, kTrack + 8, 12),
             put<std::uint32_t>(f.points, kTrack + 16, 12);
       },
       "m/points3D.bin: byte 67: found feature 0 of image 12 in the track of point 41, expected a "
       "feature that no track has listed before"},
      {"bytes behind the points", [](auto& f) { f.points += "xy"; },
       "m/points3D.bin: byte 134: found 2 more bytes"},
  };
  for (const Broken& broken : kinds) expect_refused(broken, tiny_binary());
}

void replace(std::string& text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << what;
  text.replace(at, what.size(), with);
}

TEST(ColmapMalformed, TextFilesAreRefusedWithTheirLine) {
  const Broken kinds[] = {
      {"unknown model", [](auto& f) { replace(f.cameras, "OPENCV", "OPENCVV"); },
       "m/cameras.txt:4: found 'OPENCVV', expected a camera model that Sheaf knows"},
      {"BAL is no model of COLMAP's", [](auto& f) { replace(f.cameras, "OPENCV", "BAL"); },
       "m/cameras.txt:4: found 'BAL'"},
      {"too few parameters", [](auto& f) { replace(f.cameras, " -1e-2", ""); },
       "m/cameras.txt:2: found the end of the line, expected a finite number, k of SIMPLE_RADIAL"},
      {"too many parameters", [](auto& f) { replace(f.cameras, " -1e-2", " -1e-2 0"); },
       "m/cameras.txt:2: found '0', expected the end of the line behind the 4 parameters"},
      {"negative width", [](auto& f) { replace(f.cameras, "640", "-640"); },
       "m/cameras.txt:2: found '-640', expected the width"},
      {"number with a tail", [](auto& f) { replace(f.cameras, "500.0", "500.0px"); },
       "m/cameras.txt:2: found '500.0px', expected a finite number, f"},
      {"not a number", [](auto& f) { replace(f.images, "0.25 5.0", "nan 5.0"); },
       "m/images.txt:2: found 'nan', expected a finite number, one of qw qx"},
      {"overflow", [](auto& f) { replace(f.images, "0.25 5.0", "1e999 5.0"); },
       "m/images.txt:2: found '1e999'"},
      {"zero byte in a name", [](auto& f) { f.images[f.images.find("left") + 1] = '\0'; },
       "m/images.txt:2: found a zero byte or half a line's end, expected the name of image 12"},
      {"half a line's end in a name", [](auto& f) { f.images[f.images.find("left") + 1] = '\r'; },
       "m/images.txt:2: found a zero byte or half"},
      {"half a feature", [](auto& f) { replace(f.images, " 210.25 5", " 210.25"); },
       "m/images.txt:3: found the end of the line, expected the id of a point, or -1"},
      {"point id of -2", [](auto& f) { replace(f.images, "10 20 -1", "10 20 -2"); },
       "m/images.txt:3: found '-2', expected the id of a point, or -1"},
      {"no line of features", [](auto& f) { f.images.pop_back(); },
       "m/images.txt:7: found the end of the file, expected the features of image 9"},
      {"feature of a point that is not there",
       [](auto& f) { replace(f.images, "10 20 -1", "10 20 8"); },
       "m/images.txt:3: found feature 1 of image 12 naming point 8"},
      {"colour above 255", [](auto& f) { replace(f.points, "10 20 255", "10 20 256"); },
       "m/points3D.txt:2: found '256', expected one of r, g, b of a point, 0 to 255"},
      {"half a track element", [](auto& f) { replace(f.points, " 12 0\n", " 12\n"); },
       "m/points3D.txt:2: found the end of the line, expected the number of a feature"},
      {"point twice", [](auto& f) { replace(f.points, "\n5 ", "\n41 "); },
       "m/points3D.txt:3: found point id 41 a second time"},
      {"a line of points lost",
       [](auto& f) { f.points = f.points.substr(0, f.points.find("5 -0.125")); },
       "m/images.txt:3: found feature 2 of image 12 naming point 5"},
      {"binary data", [](auto& f) { f.points = std::string("\0\1\2", 3); },
       "m/points3D.txt:1: found '\\x00\\x01\\x02', expected the id of a point"},
  };
  for (const Broken& broken : kinds) expect_refused(broken, tiny_text());
}

TEST(ColmapMalformed, RigsAreHeldAgainstTheImages) {
  const auto with_rigs = [] {
    ColmapFiles files = tiny_binary();
    files.rigs = rigs_binary();
    files.frames = frames_binary();
    return files;
  };
  const Broken kinds[] = {
      {"more rigs than bytes", [](auto& f) { put<std::uint64_t>(f.rigs, 0, 100); },
       "m/rigs.bin: byte 0: found 100 rigs"},
      {"more sensors than bytes", [](auto& f) { put<std::uint32_t>(f.rigs, 12, 1u << 30); },
       "m/rigs.bin: byte 12: found 1073741824 sensors"},
      {"more frames than bytes", [](auto& f) { put<std::uint64_t>(f.frames, 0, 100); },
       "m/frames.bin: byte 0: found 100 frames"},
      {"bytes behind the frames", [](auto& f) { f.frames += '\0'; }, "m/frames.bin: byte "},
      {"an image without a frame",
       [](auto& f) { put<std::uint64_t>(f.frames, f.frames.size() - 8, 99); },
       "m/frames.bin: byte 176: found image id 99 in frame 12, expected the id of an image"},
  };
  for (const Broken& broken : kinds) expect_refused(broken, with_rigs());
  for (std::size_t cut = 1; cut < rigs_binary().size(); ++cut) {
    ColmapFiles files = with_rigs();
    files.rigs.resize(cut);
    EXPECT_FALSE(parse_colmap(files).ok()) << cut;
  }
  for (std::size_t cut = 1; cut < frames_binary().size(); ++cut) {
    ColmapFiles files = with_rigs();
    files.frames.resize(cut);
    EXPECT_FALSE(parse_colmap(files).ok()) << cut;
  }
}

/// A model of some hundred kilobytes, each of its files cut at every 97th byte, on disk.
TEST(ColmapMalformed, ABinaryModelCutAnywhereIsRefused) {
  Problem problem = seen_by({{CameraModel::opencv, {500, 510, 320, 240, 0.01, 0, 0, 0}, 640, 480},
                             {CameraModel::radial, {500, 320, 240, 0.01, 0}, 640, 480}},
                            12, 150, 4);
  const ColmapFiles files = format_colmap(problem, false).value();
  const Folder folder;
  write(problem, folder / "m", {.format = "colmap"}).value();
  std::size_t cuts = 0;
  for (const auto& [name, bytes] : {std::pair{"cameras.bin", &files.cameras},
                                    {"images.bin", &files.images},
                                    {"points3D.bin", &files.points}}) {
    for (std::size_t cut = 0; cut < bytes->size(); cut += 97, ++cuts) {
      spill(folder / "m" / name, std::string_view(*bytes).substr(0, cut));
      const Result<InputFile> result = read_file(folder / "m");
      ASSERT_FALSE(result.ok()) << name << " cut at " << cut;
      EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
      EXPECT_NE(std::string(result.error().what()).find(name), std::string::npos)
          << result.error().what();
    }
    spill(folder / "m" / name, *bytes);
  }
  EXPECT_GT(cuts, 600u);
  EXPECT_TRUE(read_file(folder / "m").ok());
}

TEST(ColmapMalformed, FoldersThatAreNoModelSayWhatIsMissing) {
  const Folder folder;
  const auto message = [&] {
    const Result<InputFile> result = read_file(folder / "");
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : std::string(result.error().what());
  };
  EXPECT_NE(message().find("expected a file or the folder of a COLMAP model"), std::string::npos);
  std::filesystem::create_directories(folder / "sparse/0");
  spill(folder / "sparse/0/cameras.bin", "x");
  EXPECT_NE(message().find("there is one in "), std::string::npos);
  const ColmapFiles files = tiny_binary();
  spill(folder / "cameras.bin", files.cameras);
  EXPECT_NE(message().find("images.bin: found: No such file"), std::string::npos);
  spill(folder / "images.bin", files.images);
  spill(folder / "points3D.bin", "");
  EXPECT_NE(message().find("points3D.bin: found an empty file"), std::string::npos);
  spill(folder / "points3D.bin", files.points);
  spill(folder / "rigs.bin", rigs_binary());
  EXPECT_NE(message().find("rigs.bin: found without "), std::string::npos);
  spill(folder / "frames.bin", frames_binary());
  EXPECT_TRUE(read_file(folder / "").ok());
}

}  // namespace
}  // namespace sheaf
