// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/sba.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "io/brown_lens.h"
#include "io/byte_source.h"
#include "io/folder_files.h"
#include "io/line_cursor.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::size_t kPose = 7, kLens = 5, kDistortion = 5;

enum class Kind { none, cameras, points, calib };

/// By the first line with numbers.
Kind kind_of(const std::string& text) {
  LineCursor in(text, "");
  if (!in.next_record()) return Kind::none;
  std::vector<double> numbers;
  for (double x; !in.line_ended(); numbers.push_back(x))
    if (numbers.size() > 4096 || !in.read_real(x)) return Kind::none;
  const std::size_t n = numbers.size();
  if (n == 3) return Kind::calib;
  if (n > 4 && numbers[3] >= 1 &&
      n >= 4 + 3 * static_cast<std::size_t>(std::min(numbers[3], 1e6)) &&
      numbers[3] == std::floor(numbers[3]))
    return Kind::points;
  return n == kPose || n == kPose + kLens || n == kPose + kLens + kDistortion ? Kind::cameras
                                                                              : Kind::none;
}

/// Told by what stands in its beginning; other texts of a folder may be large.
Kind kind_of_file(const std::filesystem::path& path) {
  constexpr std::size_t kHead = 1 << 16;
  Result<RawBytes> bytes = RawBytes::open(path);
  if (!bytes.ok()) return Kind::none;
  std::string head(kHead, '\0');
  const Result<std::size_t> count = bytes.value().read(head.data(), head.size());
  if (!count.ok()) return Kind::none;
  head.resize(count.value());
  return kind_of(head);
}

class Reader {
 public:
  Reader(const SbaFiles& files, std::vector<std::string>& notes) : files_(files), notes_(notes) {}

  Result<Problem> run() {
    if (auto e = read_calib()) return *e;
    if (auto e = read_cameras()) return *e;
    if (auto e = read_points()) return *e;
    SourceFiles source;
    source.format = "sba";
    source.unknown_parameters = unknown_;
    metadata_.state_hash = state_hash(problem_);
    metadata_.source = std::make_shared<const SourceFiles>(std::move(source));
    problem_.metadata = std::make_shared<const SceneMetadata>(std::move(metadata_));
    return std::move(problem_);
  }

 private:
  using Wrong = std::optional<Error>;

  template <std::size_t kCount>
  static Wrong reals(LineCursor& in, std::array<double, kCount>& numbers, std::size_t count,
                     const char* what) {
    for (std::size_t k = 0; k < count; ++k)
      if (!in.read_real(numbers[k])) return in.refuse(std::string("a finite number, ") + what);
    return {};
  }

  static Wrong end(LineCursor& in) {
    std::string_view word;
    if (!in.read_word(word)) return {};
    return in.refuse("the end of the line (covariances are not read)");
  }

  /// fu u0 v0 ar s, and where they are there k1 k2 p1 p2 k3.
  Wrong add_lens(LineCursor& in, const std::array<double, kLens + kDistortion>& n, bool distorted) {
    if (!(n[0] > 0) || !(n[3] > 0) || !std::isfinite(n[0] * n[3]))
      return in.refuse_as("found no focal length or aspect ratio above 0, expected a lens");
    if (n[4] != 0)
      return in.refuse_as("found a skew of " + std::to_string(n[4]) +
                          ", expected 0: no lens here has one");
    BrownLens lens{n[0], n[0] * n[3], n[1], n[2], {}, {}};
    if (distorted) lens.k = {n[5], n[6], n[9]}, lens.p = {n[7], n[8]};
    const CameraOfFile camera = camera_of(lens, {distorted ? 3 : 0, distorted, false}, 0, 0);
    problem_.cameras.push_back(camera.camera);
    unknown_.push_back(camera.unknown);
    return {};
  }

  Wrong read_calib() {
    if (files_.calib.name.empty()) return {};
    LineCursor in(files_.calib.text, files_.calib.name);
    std::array<double, 9> K{};
    for (std::size_t r = 0; r < 9; r += 3) {
      std::array<double, 3> row{};
      if (!in.next_record())
        return in.refuse_as("found the end of the file, expected three rows of a matrix");
      if (auto e = reals(in, row, 3, "an entry of a calibration matrix")) return e;
      if (auto e = end(in)) return e;
      std::copy(row.begin(), row.end(), K.begin() + static_cast<std::ptrdiff_t>(r));
    }
    if (K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1)
      return in.refuse_as(
          "found a matrix that is no calibration, expected fu s u0, 0 fv v0, 0 0 1");
    notes_.push_back("SBA holds the calibration of its calib file; --fix intrinsics does so here");
    return add_lens(in, {K[0], K[2], K[5], K[4] / K[0], K[1]}, false);
  }

  Wrong read_cameras() {
    LineCursor in(files_.cameras.text, files_.cameras.name);
    while (in.next_record()) {
      std::array<double, kLens + kDistortion + kPose> n{};
      std::size_t count = 0;
      for (; !in.line_ended() && count < n.size(); ++count)
        if (!in.read_real(n[count])) return in.refuse("a finite number of a camera");
      const std::size_t lens = count - std::min(count, kPose);
      if (count < kPose || (lens != 0 && lens != kLens && lens != kLens + kDistortion) ||
          !in.line_ended())
        return in.refuse_as("found a line of " + std::to_string(count) +
                            " numbers or more, expected 7, 12 or 17: a lens, or none, and a pose");
      if (lens == 0 && files_.calib.name.empty())
        return in.refuse_as("found no lens, and no calib file beside it, expected one of them");
      std::array<double, kLens + kDistortion> k{};
      std::copy_n(n.begin(), lens, k.begin());
      if (lens > 0)
        if (auto e = add_lens(in, k, lens > kLens)) return e;
      const double* q = &n[lens];
      const std::array<double, 4> stated{q[0], q[1], q[2], q[3]};
      const Pose pose{rotation_from_stated(stated), {q[4], q[5], q[6]}};
      double norm2 = 0;
      for (const double x : pose.rotation) norm2 += x * x;
      if (!(std::abs(norm2 - 1) < 1e-6))
        return in.refuse_as("found a quaternion of no direction, expected w x y z of a camera");
      problem_.add_image(pose,
                         lens > 0 ? static_cast<std::uint32_t>(problem_.cameras.size() - 1) : 0);
      metadata_.stated_rotations.insert(metadata_.stated_rotations.end(), stated.begin(),
                                        stated.end());
    }
    return {};
  }

  Wrong read_points() {
    LineCursor in(files_.points.text, files_.points.name);
    while (in.next_record()) {
      std::array<double, 3> X{};
      std::uint64_t frames = 0;
      if (auto e = reals(in, X, 3, "a coordinate of a point")) return e;
      if (!in.read_integer(frames)) return in.refuse("the number of a point's frames");
      problem_.add_point(X[0], X[1], X[2]);
      for (std::uint64_t k = 0; k < frames; ++k) {
        std::uint32_t frame = 0;
        std::array<double, 2> xy{};
        const std::string what = "a frame below " + std::to_string(problem_.num_images());
        if (!in.read_integer(frame) || frame >= problem_.num_images()) return in.refuse(what);
        if (auto e = reals(in, xy, 2, "x or y of a projection")) return e;
        problem_.add_observation(frame, static_cast<std::uint32_t>(problem_.num_points() - 1),
                                 xy[0], xy[1]);
      }
      if (auto e = end(in)) return e;
    }
    return {};
  }

  const SbaFiles& files_;
  std::vector<std::string>& notes_;
  Problem problem_;
  SceneMetadata metadata_;
  std::vector<ParameterSet> unknown_;
};

}  // namespace

Result<std::optional<SbaFiles>> load_sba(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::vector<fs::path> texts;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.is_regular_file(ignored) && entry.path().extension() == ".txt")
      texts.push_back(entry.path());
  std::sort(texts.begin(), texts.end());
  SbaFiles out;
  for (const fs::path& path : texts) {
    const Kind kind = kind_of_file(path);
    if (kind == Kind::none) continue;
    Result<std::string> text = bytes_of(path);
    if (!text.ok()) return text.error();
    SbaFiles::File& file = kind == Kind::cameras  ? out.cameras
                           : kind == Kind::points ? out.points
                                                  : out.calib;
    if (!file.name.empty())
      return Error(ErrorCode::unreadable_input,
                   path.string() + ": found beside " + file.name +
                       ", expected one file of cameras, of points and of a calibration in a folder "
                       "of SBA");
    file = {path.string(), std::move(text).value()};
  }
  if (out.cameras.name.empty() || out.points.name.empty()) return std::optional<SbaFiles>();
  return std::optional<SbaFiles>(std::move(out));
}

Result<Problem> parse_sba(const SbaFiles& files, std::vector<std::string>& notes) {
  return Reader(files, notes).run();
}

}  // namespace sheaf
