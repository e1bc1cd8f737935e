// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/bundler.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "geometry/rotation.h"
#include "io/colmap_parts.h"
#include "io/line_cursor.h"
#include "io/point_text.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// Least text of a record: "0 0 0\n" for each row of numbers.
constexpr std::uint64_t kLeastImage = 30, kLeastPoint = 14, kLeastView = 8;
constexpr std::uint32_t kUnplaced = std::numeric_limits<std::uint32_t>::max();

struct Reader : PointText {
  std::vector<std::uint32_t> image_of_listed;

  std::optional<Error> image(std::uint32_t i);
  std::optional<Error> view();
};

std::optional<Error> Reader::image(std::uint32_t i) {
  const std::string of = " of image " + std::to_string(i);
  std::array<double, 3> lens{}, t{};
  std::array<double, 9> R{};
  if (auto e = reals(lens, "f, k1 or k2" + of)) return e;
  const std::uint64_t line = in.line_number();
  if (auto e = reals(R, "an entry of R" + of)) return e;
  if (auto e = reals(t, "an entry of t" + of)) return e;
  if (lens[0] == 0) {
    image_of_listed.push_back(kUnplaced);
    return {};
  }
  if (auto e = rotation(R, line + 1, of)) return e;
  image_of_listed.push_back(problem.add_image(
      {rotation_from_stated(R), t}, Camera{CameraModel::bal, {lens[0], lens[1], lens[2]}}));
  metadata.image_ids.push_back(i);
  metadata.stated_rotations.insert(metadata.stated_rotations.end(), R.begin(), R.end());
  return {};
}

std::optional<Error> Reader::view() {
  std::uint32_t listed = 0, key = 0;
  std::array<double, 2> xy{};
  const std::string most = std::to_string(image_of_listed.size() - 1);
  if (auto e = integer(listed, "the number of an image, 0 to " + most)) return e;
  if (listed >= image_of_listed.size()) return in.refuse("the number of an image, 0 to " + most);
  if (image_of_listed[listed] == kUnplaced)
    return in.refuse("the number of an image that was placed (its f is not 0)");
  if (auto e = integer(key, "the number of a key of image " + std::to_string(listed))) return e;
  if (auto e = reals(xy, "x or y of a view")) return e;
  problem.add_observation(image_of_listed[listed],
                          static_cast<std::uint32_t>(problem.num_points() - 1), xy[0], xy[1]);
  metadata.observation_feature.push_back(key);
  return {};
}

class Text {
 public:
  template <class Number>
  Text& put(Number value, char separator) {
    char buffer[40];
    out_.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr) += separator;
    return *this;
  }
  template <class Numbers>
  void row(const Numbers& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      put(numbers[i], i + 1 == numbers.size() ? '\n' : ' ');
  }
  std::string take() { return std::move(out_); }
  void add(std::string_view text) { out_ += text; }

 private:
  std::string out_;
};

void put_image(const Problem& problem, std::size_t j, bool as_read, Text& out) {
  const auto& k = problem.cameras[problem.image_camera[j]].parameters;
  out.row(std::array<double, 3>{k[0], k[1], k[2]});
  Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
  if (const double* stated = as_read ? stated_numbers(problem, j, 9) : nullptr)
    std::copy_n(stated, 9, R.begin());
  for (std::size_t r = 0; r < 9; r += 3) out.row(std::array<double, 3>{R[r], R[r + 1], R[r + 2]});
  out.row(problem.poses[j].translation);
}

}  // namespace

Result<Problem> parse_bundler(std::string_view text, const std::string& name,
                              std::vector<std::string>& notes) {
  Reader reader{{LineCursor(text, name), text.size()}, {}};
  LineCursor& in = reader.in;
  in.next_line();
  if (in.rest() != "# Bundle file v0.3")
    return in.refuse_as("found " + quoted(in.rest()) + ", expected '# Bundle file v0.3'");
  in.pass_line();
  std::uint32_t images = 0;
  std::uint64_t points = 0;
  if (auto e = reader.integer(images, "the number of images")) return *e;
  if (images == 0 || images > text.size() / kLeastImage)
    return in.refuse("a number of images that the file can hold");
  if (auto e = reader.integer(points, "the number of points")) return *e;
  if (points > text.size() / kLeastPoint)
    return in.refuse("a number of points that the file can hold");
  for (std::uint32_t i = 0; i < images; ++i)
    if (auto e = reader.image(i)) return *e;
  for (std::uint64_t i = 0; i < points; ++i)
    if (auto e = reader.point(i, kLeastView, [&] { return reader.view(); })) return *e;
  if (in.seek_field()) {
    std::string_view word;
    in.read_word(word);
    return in.refuse("the end of the file behind the last point");
  }
  Problem& problem = reader.problem;
  if (problem.num_images() < images)
    notes.push_back(std::to_string(images - problem.num_images()) + " of " +
                    std::to_string(images) + " images were never placed (f = 0)");
  auto source = std::make_shared<SourceFiles>();
  source->format = "bundler";
  source->listed_images = images;
  reader.metadata.source = std::move(source);
  reader.metadata.state_hash = state_hash(problem);
  problem.metadata = std::make_shared<const SceneMetadata>(std::move(reader.metadata));
  return std::move(problem);
}

Result<std::string> format_bundler(const Problem& given) {
  Problem turned;
  const Result<const Problem*> as_bal = with_bal_cameras(given, turned);
  if (!as_bal.ok()) return as_bal.error();
  const Problem& problem = *as_bal.value();
  if (problem.num_images() == 0)
    return Error(ErrorCode::usage, "the problem has no images; Bundler's files have at least one");
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    if (problem.cameras[problem.image_camera[j]].parameters[0] == 0)
      return Error(ErrorCode::usage, "image " + std::to_string(j) +
                                         " has focal length 0, which Bundler keeps for images "
                                         "that were never placed");
  const SceneMetadata* metadata = problem.metadata.get();
  const bool listed = metadata && metadata->source && metadata->source->format == "bundler";
  const std::size_t images = listed ? metadata->source->listed_images : problem.num_images();
  const bool as_read = is_as_read(given, "bundler");
  const auto number = [&](std::size_t j) { return listed ? metadata->image_ids[j] : j; };

  Text out;
  out.add("# Bundle file v0.3\n");
  out.put(images, ' ').put(problem.num_points(), '\n');
  std::size_t next = 0;
  for (std::size_t i = 0; i < images; ++i) {
    if (next < problem.num_images() && number(next) == i) {
      put_image(problem, next++, as_read, out);
    } else {
      out.add("0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n");
    }
  }
  const FeatureTable features =
      feature_table(problem, std::vector<std::uint64_t>(problem.num_points(), 0));
  const bool keys = metadata && !metadata->observation_feature.empty();
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    const double* X = &problem.points[3 * p];
    out.put(X[0], ' ').put(X[1], ' ').put(X[2], '\n');
    std::array<std::uint8_t, 3> colour{128, 128, 128};
    if (metadata && !metadata->point_colours.empty()) colour = metadata->point_colours[p];
    for (std::size_t c = 0; c < 3; ++c) out.put(unsigned{colour[c]}, c == 2 ? '\n' : ' ');
    out.put(features.track[p + 1] - features.track[p], ' ');
    for (std::uint64_t k = features.track[p]; k < features.track[p + 1]; ++k) {
      const std::uint64_t i = features.order[k];
      out.put(number(problem.observation_image[i]), ' ');
      out.put(keys ? metadata->observation_feature[i] : features.of_observation[i], ' ');
      out.put(problem.observation_xy[2 * i], ' ').put(problem.observation_xy[2 * i + 1], ' ');
    }
    out.add("\n");
  }
  return out.take();
}

}  // namespace sheaf
