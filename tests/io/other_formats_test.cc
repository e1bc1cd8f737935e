// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Bundler, NVM and libmv: small files made here, and the real ones where they are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "io/bundler.h"
#include "io/bytes.h"
#include "io/libmv.h"
#include "io/models.h"
#include "io/nvm.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;
using Notes = std::vector<std::string>;

/// Three images, of which the second was never placed; two points.
const std::string kBundler =
    "# Bundle file v0.3\n3 2\n"
    "500 -0.1 0.01\n1 0 0\n0 1 0\n0 0 1\n0.5 0 -5\n"
    "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n"
    "6.0000000000e+02 0 0\n0 0 1\n0 1 0\n-1 0 0\n0 0.25 -4\n"
    "0.1 0.2 0.3\n10 20 30\n2 0 17 60.5 20.25 2 4 -40 30\n"
    "-0.1 0 0\n255 0 1\n1 2 5 1.5 -2.5 \n";

Result<Problem> bundler(const std::string& text, Notes notes = {}) {
  return parse_bundler(text, "f", notes);
}

TEST(Bundler, ReadsImagesPointsAndViews) {
  Notes notes;
  const Problem p = parse_bundler(kBundler, "f", notes).value();
  ASSERT_TRUE(validate(p).ok());
  EXPECT_EQ(p.num_images(), 2u);
  EXPECT_EQ(p.cameras[0].parameters[1], -0.1);
  EXPECT_EQ(p.metadata->image_ids, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(p.observation_image, (std::vector<std::uint32_t>{0, 1, 1}));
  EXPECT_EQ(p.metadata->observation_feature, (std::vector<std::uint32_t>{17, 4, 5}));
  EXPECT_EQ(p.metadata->point_colours[1], (std::array<std::uint8_t, 3>{255, 0, 1}));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("1 of 3 images were never placed"), std::string::npos);
  // P = R X + t of the second image, by hand: (0.3, 0.45, -4.1); p = (0.3, 0.45) / 4.1.
  Problem one = p;
  one.observation_image = {1}, one.observation_point = {0};
  one.observation_xy = {600 * 0.3 / 4.1 + 3, 600 * 0.45 / 4.1 + 4};
  one.metadata = nullptr;
  EXPECT_NEAR(evaluate(one).cost, 12.5, 1e-9);
}

TEST(Bundler, ComesBackWithItsImagesThatWereNeverPlaced) {
  const Problem p = bundler(kBundler).value();
  const std::string text = format_bundler(p).value();
  EXPECT_NE(text.find("\n600 0 0\n0 0 1\n0 1 0\n-1 0 0\n"), std::string::npos) << text;
  const Problem again = bundler(text).value();
  EXPECT_TRUE(same_state(again, p));
  EXPECT_EQ(again.metadata->observation_feature, p.metadata->observation_feature);
  EXPECT_EQ(again.metadata->point_colours, p.metadata->point_colours);
  EXPECT_EQ(again.metadata->image_ids, p.metadata->image_ids);
  EXPECT_EQ(format_bundler(again).value(), text);
  EXPECT_TRUE(lost_in("bundler", p).empty());
}

TEST(Bundler, HoldsWhatBalDescribesAndRefusesTheRest) {
  const Problem radial =
      seen_by({{CameraModel::radial, {500, 320, 240, 0.01, 0.02}, 640, 480}}, 3, 6, 5);
  const Problem again = bundler(format_bundler(radial).value()).value();
  EXPECT_NEAR(evaluate(again).cost, 0, 1e-18);
  EXPECT_EQ(again.cameras.size(), 3u);
  const Problem wide = seen_by({{CameraModel::fov, {300, 310, 320, 240, 0.9}, 640, 480}}, 3, 6, 5);
  const Result<std::string> refused = format_bundler(wide);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(refused.error().what()).find("camera 0 is FOV"), std::string::npos);
}

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

struct Bad {
  std::string text;
  std::string message;
};

void expect_refused(const Bad& bad, const Result<Problem>& result) {
  ASSERT_FALSE(result.ok()) << bad.message;
  EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
  EXPECT_EQ(std::string(result.error().what()).substr(0, bad.message.size()), bad.message);
}

TEST(Bundler, BrokenFilesAreRefusedWithTheirLine) {
  for (const Bad& bad : {
           Bad{with(kBundler, "v0.3", "v0.4"),
               "f:1: found '# Bundle file v0.4', expected '# Bundle"},
           Bad{with(kBundler, "3 2\n", "3000 2\n"),
               "f:2: found '3000', expected a number of images"},
           Bad{with(kBundler, "3 2\n", "3 4000000000\n"),
               "f:2: found '4000000000', expected a number of points"},
           Bad{with(kBundler, "3 2\n", "0 2\n"), "f:2: found '0', expected a number of images"},
           Bad{with(kBundler, "3 2\n", "-3 2\n"), "f:2: found '-3', expected the number of images"},
           Bad{with(kBundler, "-0.1 0.01", "nan 0.01"),
               "f:3: found 'nan', expected a finite number, f, k1"},
           Bad{with(kBundler, "1 0 0\n0 1 0", "1 0 0\n0 2 0"),
               "f:4: found rows that are not orthonormal"},
           Bad{with(kBundler, "1 0 0\n0 1 0", "-1 0 0\n0 1 0"), "f:4: found a reflection"},
           Bad{with(kBundler, "10 20 30", "10 20 300"),
               "f:19: found '300', expected a colour, 0 to 255"},
           Bad{with(kBundler, "\n2 0 17", "\n200000 0 17"),
               "f:20: found '200000', expected a number of views"},
           Bad{with(kBundler, "2 0 17", "2 3 17"),
               "f:20: found '3', expected the number of an image, 0 to 2"},
           Bad{with(kBundler, "2 0 17", "2 1 17"),
               "f:20: found '1', expected the number of an image that was placed"},
           Bad{with(kBundler, "2 0 17", "2 0 -17"),
               "f:20: found '-17', expected the number of a key"},
           Bad{with(kBundler, "60.5", "sixty"),
               "f:20: found 'sixty', expected a finite number, x or y"},
           Bad{kBundler + "7\n", "f:24: found '7', expected the end of the file"},
           Bad{kBundler.substr(0, kBundler.size() - 8),
               "f:23: found the end of the line, expected a finite"},
           Bad{kBundler.substr(0, kBundler.find("255 0 1")), "f:21: found the end of the line"},
       })
    expect_refused(bad, bundler(bad.text));
  for (std::size_t cut = 19; cut + 12 < kBundler.size(); ++cut)
    EXPECT_FALSE(bundler(kBundler.substr(0, cut)).ok()) << cut;
}

/// The second image's measurements are bent by r; 0.5 is the mean of two roots, so q is exact.
const std::string kNvm =
    "NVM_V3 \n\n2\n"
    "left.jpg 500 1 0 0 0 0.5 0 -5 0 0\n"
    "right.jpg 400 0.5 0.5 0.5 0.5 1 2 3 -0.25 0\n"
    "\n2\n"
    "0.1 0.2 0.3 10 20 30 2 0 17 -40.5 20.25 1 4 40 30 \n"
    "-0.1 0 0 255 0 1 1 1 5 80 -60\n"
    "\n0\n\n#the last part of an NVM file\n0\n";

TEST(Nvm, ReadsTheFirstModelAndMakesMeasurementsStraight) {
  Notes notes;
  const Problem p = parse_nvm(kNvm, "f", notes).value();
  ASSERT_TRUE(validate(p).ok());
  EXPECT_EQ(p.cameras[1].model, CameraModel::simple_pinhole);
  EXPECT_EQ(p.metadata->image_names[1], "right.jpg");
  EXPECT_EQ(p.poses[0].translation, (std::array<double, 3>{-0.5, 0, 5}));  // t = -R C
  EXPECT_EQ(p.poses[1].translation, (std::array<double, 3>{-3, -1, -2}));
  EXPECT_EQ(p.observation_xy[0], -40.5);
  // 1 - 0.25 (80^2 + 60^2) / 400^2
  EXPECT_DOUBLE_EQ(p.observation_xy[4], 80 * (1 - 0.25 * 10000 / 160000.0));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("made straight"), std::string::npos);
  const std::string text = format_nvm(p).value();
  const Problem again = parse_nvm(text, "f", notes).value();
  EXPECT_TRUE(same_state(again, p));
  EXPECT_EQ(again.metadata->observation_feature, p.metadata->observation_feature);
  EXPECT_EQ(format_nvm(again).value(), text);
  EXPECT_NE(text.find(" 80 -60"), std::string::npos) << "as measured";
}

TEST(Nvm, ReadsMatricesAndWritesPinholesOnly) {
  Notes notes;
  const std::string text =
      "NVM_V3_R9T\n1\na.jpg 500 1 0 0 0 1 0 0 0 1 0.5 0.25 5 0 0\n1\n0 0 0 1 2 3 1 0 0 50 25\n";
  const Problem p = parse_nvm(text, "f", notes).value();
  EXPECT_EQ(p.poses[0].translation, (std::array<double, 3>{0.5, 0.25, 5}));
  EXPECT_EQ(evaluate(p).cost, 0);
  Problem moved = seen_by({{CameraModel::simple_pinhole, {500, 320, 240}, 640, 480}}, 3, 6, 5);
  moved.observation_xy[0] += 3;
  const Problem again = parse_nvm(format_nvm(moved).value(), "f", notes).value();
  EXPECT_NEAR(evaluate(again).cost, 4.5, 1e-9);
  const Problem bent = seen_by({{CameraModel::bal, {500, 0.1, 0}}}, 3, 6, 5);
  ASSERT_FALSE(format_nvm(bent).ok());
  EXPECT_EQ(format_nvm(bent).error().code(), ErrorCode::usage);
}

TEST(Nvm, BrokenFilesAreRefusedWithTheirLine) {
  Notes notes;
  for (const Bad& bad : {
           Bad{with(kNvm, "NVM_V3 ", "NVM_V3 FixedK 1 2 3 4"), "f:1: found 'NVM_V3 FixedK"},
           Bad{with(kNvm, "\n2\n", "\n2000\n"), "f:3: found '2000', expected a number of images"},
           Bad{with(kNvm, "500 1 0", "0 1 0"), "f:4: found '0', expected a focal length above 0"},
           Bad{with(kNvm, "500 1 0 0 0", "500 0 0 0 0"), "f:4: found no rotation"},
           Bad{with(kNvm, "2 0 17", "2 2 17"),
               "f:8: found '2', expected the number of an image, 0 to 1"},
           Bad{with(kNvm, "10 20 30", "10 20"), "f:8: found '30', expected a number of views"},
           Bad{with(kNvm, "30 2 0", "30 2000 0"), "f:8: found '2000', expected a number of views"},
       })
    expect_refused(bad, parse_nvm(bad.text, "f", notes));
  const std::size_t whole = kNvm.find("\n\n0\n");
  for (std::size_t cut = 7; cut + 3 < whole; ++cut)
    EXPECT_FALSE(parse_nvm(kNvm.substr(0, cut), "f", notes).ok()) << cut;
}

std::string libmv_bytes() {
  Bytes out;
  out.add('v').add('P');
  for (float k : {500.f, 320.f, 240.f, 0.1f, 0.02f, 0.003f, 0.0004f, -0.0005f}) out.add(k);
  out.add<std::int32_t>(2);
  for (std::int32_t image : {3, 8}) {
    out.add(image);
    for (float r : {0.f, 1.f, 0.f, -1.f, 0.f, 0.f, 0.f, 0.f, 1.f}) out.add(r);  // by columns
    for (float t : {0.f, 0.5f, 5.f}) out.add(t);
  }
  out.add<std::int32_t>(1).add<std::int32_t>(6);
  for (float x : {1.f, 0.5f, 0.f}) out.add(x);
  out.add<std::int32_t>(4);
  const auto marker = [&](std::int32_t image, std::int32_t track, float x, float y) {
    out.add(image).add(track).add(x).add(y);
  };
  marker(8, 6, 300, 400), marker(3, 7, 1, 2), marker(3, 6, 310, 410), marker(5, 6, 0, 0);
  return out.take();
}

TEST(Libmv, ReadsItsBinaryEitherWayRound) {
  Notes notes;
  const std::string bytes = libmv_bytes();
  const Problem p = parse_libmv(bytes, "f", notes).value();
  ASSERT_TRUE(validate(p).ok());
  EXPECT_EQ(p.num_images(), 2u);
  EXPECT_EQ(p.cameras.size(), 1u);
  EXPECT_EQ(p.cameras[0].model, CameraModel::full_opencv);
  EXPECT_EQ(p.cameras[0].parameters[8], double{0.003f});  // k3
  EXPECT_EQ(p.observation_image, (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(p.metadata->feature_begin, (std::vector<std::uint64_t>{0, 2, 3}));
  EXPECT_EQ(notes.size(), 2u);
  // P = (-0.5, 1 + 0.5, 5): R turns x into y.
  Problem one = p;
  one.metadata = nullptr;
  const Camera& c = one.cameras[0];
  const auto pixel = project(c, {-0.5, 1.5, 5}).pixel;
  one.observation_xy = {pixel[0], pixel[1], pixel[0], pixel[1] + 2};
  EXPECT_NEAR(evaluate(one).cost, 2, 1e-12);

  std::string other = bytes;
  other[0] = 'V';
  for (std::size_t at = 2; at + 4 <= other.size(); at += 4)
    std::reverse(other.begin() + static_cast<std::ptrdiff_t>(at),
                 other.begin() + static_cast<std::ptrdiff_t>(at) + 4);
  EXPECT_TRUE(same_state(parse_libmv(other, "f", notes).value(), p));
}

/// What `libmv_bytes` holds, less the markers that observe nothing.
TEST(Libmv, ComesBack) {
  Notes notes;
  const Problem p = parse_libmv(libmv_bytes(), "f", notes).value();
  const std::string bytes = format_libmv(p).value();
  EXPECT_EQ(bytes.substr(0, 34), libmv_bytes().substr(0, 34));
  notes.clear();
  const Problem again = parse_libmv(bytes, "f", notes).value();
  EXPECT_TRUE(notes.empty());
  EXPECT_TRUE(same_state(again, p));
  EXPECT_EQ(again.metadata->image_ids, p.metadata->image_ids);
  EXPECT_EQ(again.metadata->point_ids, p.metadata->point_ids);
  EXPECT_EQ(format_libmv(again).value(), bytes);
  const auto lost = lost_in("libmv", p);
  EXPECT_NE(std::find(lost.begin(), lost.end(), "numbers are written in single precision"),
            lost.end());
}

TEST(Libmv, HoldsOneLensOfItsFormulaAndRefusesOthers) {
  Notes notes;
  for (const Camera& camera :
       {Camera{CameraModel::simple_pinhole, {500, 320, 240}},
        Camera{CameraModel::pinhole, {500, 500, 320, 240}},
        Camera{CameraModel::simple_radial, {500, 320, 240, 0.01}},
        Camera{CameraModel::radial, {500, 320, 240, 0.01, 0.02}},
        Camera{CameraModel::opencv, {500, 500, 320, 240, 0.01, 0.02, 1e-3, 2e-3}},
        Camera{CameraModel::full_opencv, {500, 500, 320, 240, 0.01, 0.02, 1e-3, 2e-3, 3e-3}}}) {
    const Problem problem = seen_by({camera}, 3, 6, 5);
    const Result<std::string> written = format_libmv(problem);
    ASSERT_TRUE(written.ok()) << written.error().what();
    const Problem again = parse_libmv(written.value(), "f", notes).value();
    EXPECT_LT(evaluate(again).rms_px, 1e-3) << to_string(camera.model);  // single precision
    EXPECT_EQ(again.cameras[0].model == CameraModel::radial, camera.parameters[6] == 0)
        << to_string(camera.model);
  }
  const Camera k3{CameraModel::radial_k3, {500, 320, 240, 0.01, 0.02, 3e-3}};
  const Problem cubic =
      parse_libmv(format_libmv(seen_by({k3}, 3, 6, 5)).value(), "f", notes).value();
  EXPECT_EQ(cubic.cameras[0].model, CameraModel::radial_k3);
  EXPECT_LT(evaluate(cubic).rms_px, 1e-3);
  const auto complaint = [](const Problem& problem) {
    const Result<std::string> refused = format_libmv(problem);
    EXPECT_FALSE(refused.ok());
    return refused.ok() ? "" : std::string(refused.error().what());
  };
  const Camera pinhole{CameraModel::pinhole, {500, 501, 320, 240}};
  EXPECT_NE(complaint(seen_by({pinhole}, 3, 6, 5)).find("fy = 501"), std::string::npos);
  EXPECT_NE(complaint(seen_by({pinhole, pinhole}, 3, 6, 5)).find("there are 2"), std::string::npos);
  const Camera fisheye{CameraModel::simple_radial_fisheye, {500, 320, 240, 0.01}};
  EXPECT_NE(complaint(seen_by({fisheye}, 3, 6, 5)).find("SIMPLE_RADIAL_FISHEYE"),
            std::string::npos);
}

TEST(Libmv, BrokenFilesAreRefusedWithTheirByte) {
  Notes notes;
  const std::string good = libmv_bytes();
  for (std::size_t cut = 2; cut < good.size(); ++cut)
    EXPECT_FALSE(parse_libmv(good.substr(0, cut), "f", notes).ok()) << cut;
  const auto changed = [&](std::size_t at, auto value) {
    std::string bytes = good;
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
  };
  for (const Bad& bad : {
           Bad{good + "x", "f: byte 230: found 1 more bytes"},
           Bad{changed(34, std::int32_t{-1}), "f: byte 34: found -1 cameras"},
           Bad{changed(34, std::int32_t{1000}), "f: byte 34: found 1000 cameras"},
           Bad{changed(38, std::int32_t{-3}),
               "f: byte 38: found -3, expected the number of an image"},
           Bad{changed(42, 5.0f), "f: byte 38: found rows that are not orthonormal"},
           Bad{changed(90, std::int32_t{3}), "f: byte 90: found image 3 a second time"},
           Bad{changed(2, std::nanf("")), "f: byte 2: found a number that is not finite"},
       })
    expect_refused(bad, parse_libmv(bad.text, "f", notes));
}

TEST(Formats, AreToldByContent) {
  const Folder folder;
  for (const auto& [format, bytes] :
       {std::pair{"bundler", kBundler}, {"nvm", kNvm}, {"libmv", libmv_bytes()}}) {
    spill(folder / "any", bytes);
    spill(folder / "packed", gzip(bytes));
    const InputFile plain = read_file(folder / "any", {.hash = true}).value();
    const InputFile packed = read_file(folder / "packed").value();
    EXPECT_EQ(plain.format, format);
    EXPECT_EQ(packed.format, format);
    EXPECT_EQ(packed.compression, "gzip");
    EXPECT_TRUE(same_state(plain.problem, packed.problem));
    EXPECT_FALSE(plain.notes.empty());
  }
  write(bundler(kBundler).value(), folder / "o.out.gz").value();
  EXPECT_EQ(read_file(folder / "o.out.gz").value().format, "bundler");
  EXPECT_EQ(write({}, folder / "x", {.format = "obj"}).error().code(), ErrorCode::usage);
}

TEST(FormatsData, RealFilesAreRead) {
  const char* root = std::getenv("SHEAF_DATA");
  const std::filesystem::path data(root ? root : "data");
  if (!std::filesystem::is_directory(data / "bundler")) GTEST_SKIP() << "no real files";
  const Problem balbianello = read(data / "bundler/balbianello/Balbianello.out").value();
  EXPECT_EQ(balbianello.num_images(), 5u);
  EXPECT_EQ(balbianello.num_points(), 544u);
  EXPECT_LT(evaluate(balbianello).rms_px, 0.5);
  const Problem libmv = read(data / "libmv/problem_01.bin").value();
  EXPECT_EQ(libmv.num_images(), 333u);
  EXPECT_EQ(libmv.num_points(), 26u);
  EXPECT_LT(evaluate(libmv).rms_px, 1.5);
  Notes notes;
  const std::string written = format_libmv(libmv).value();
  const Problem again = parse_libmv(written, "f", notes).value();
  EXPECT_TRUE(same_state(again, libmv));
  EXPECT_EQ(format_libmv(again).value(), written);
}

}  // namespace
}  // namespace sheaf
