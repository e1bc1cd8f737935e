// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Problems made of any numbers and names: a format either refuses to write one, and then leaves
// what was there under the name, or what it wrote is read again with as many images and
// observations, the points that are seen where they were, and images of the same names where the
// format has these.

#include <fuzzer/FuzzedDataProvider.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "io/format.h"
#include "sheaf/sheaf.h"

namespace {

namespace fs = std::filesystem;

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::fprintf(stderr, "writers_fuzz: %s\n", what.c_str());
  std::abort();
}

double number(FuzzedDataProvider& from) {
  switch (from.ConsumeIntegralInRange(0, 5)) {
    case 0:
      return from.ConsumeFloatingPointInRange<double>(-1.5e308, 1.5e308);
    case 1:
      return from.ConsumeFloatingPointInRange<double>(-1e60, 1e60);
    case 2:
      return from.ConsumeIntegralInRange(-9, 9);
    default:
      return from.ConsumeFloatingPointInRange<double>(-3, 3);
  }
}

sheaf::Camera lens(FuzzedDataProvider& from) {
  sheaf::Camera camera;
  camera.model = static_cast<sheaf::CameraModel>(
      from.ConsumeIntegralInRange<std::size_t>(0, sheaf::kCameraModels - 1));
  const std::size_t count = sheaf::parameter_count(camera.model);
  for (std::size_t k = 0; k < count; ++k) camera.parameters[k] = number(from);
  camera.width_px = from.ConsumeIntegralInRange<std::uint32_t>(0, 9000);
  camera.height_px = from.ConsumeIntegralInRange<std::uint32_t>(0, 9000);
  return camera;
}

sheaf::Problem problem_of(FuzzedDataProvider& from) {
  sheaf::Problem problem;
  auto metadata = std::make_shared<sheaf::SceneMetadata>();
  const int lenses = from.ConsumeIntegralInRange(1, 3), images = from.ConsumeIntegralInRange(1, 4);
  for (int c = 0; c < lenses; ++c) problem.cameras.push_back(lens(from));
  const bool named = from.ConsumeBool(), numbered = from.ConsumeBool(),
             coloured = from.ConsumeBool();
  for (int i = 0; i < images; ++i) {
    sheaf::Pose pose;
    for (double& t : pose.translation) t = number(from);
    for (double& q : pose.rotation) q = number(from);
    double norm = 0;
    for (double q : pose.rotation) norm += q * q;
    if (from.ConsumeBool() && norm > 0 && std::isfinite(norm))
      for (double& q : pose.rotation) q /= std::sqrt(norm);
    problem.add_image(pose, std::uint32_t(from.ConsumeIntegralInRange(0, lenses)));
    if (named) metadata->image_names.push_back(from.ConsumeRandomLengthString(12));
    if (numbered) metadata->image_ids.push_back(from.ConsumeIntegral<std::uint32_t>() % 8);
  }
  const int points = from.ConsumeIntegralInRange(1, 5);
  for (int i = 0; i < points; ++i) {
    problem.add_point(number(from), number(from), number(from));
    if (coloured) metadata->point_colours.push_back({1, 2, 3});
    if (numbered) metadata->point_ids.push_back(from.ConsumeIntegral<std::uint8_t>());
  }
  const int observations = from.ConsumeIntegralInRange(0, 12);
  for (int k = 0; k < observations; ++k)
    problem.add_observation(std::uint32_t(from.ConsumeIntegralInRange(0, images)),
                            std::uint32_t(from.ConsumeIntegralInRange(0, points)), number(from),
                            number(from));
  if (named || numbered || coloured) problem.metadata = metadata;
  return problem;
}

/// A format and how its files are named.
struct Target {
  std::string format, name;
};
const std::vector<Target>& targets() {
  static const std::vector<Target> kAll = [] {
    std::vector<Target> out = {{"colmap-text", "model"}, {"colmap", "model"}};
    for (const sheaf::FileFormat& format : sheaf::file_formats())
      if (format.format != nullptr || format.name == "bal")
        out.push_back({std::string(format.name), "file" + std::string(format.ending)});
    return out;
  }();
  return kAll;
}

/// Coordinates of the points that are seen, each of the three sorted by itself, once for each
/// observation: what no order of points or observations changes.
std::array<std::vector<double>, 3> seen_points(const sheaf::Problem& problem) {
  std::array<std::vector<double>, 3> out;
  for (const std::uint32_t p : problem.observation_point)
    for (std::size_t k = 0; k < 3; ++k) out[k].push_back(problem.points[3 * std::size_t(p) + k]);
  for (std::vector<double>& list : out) std::sort(list.begin(), list.end());
  return out;
}

std::vector<std::string> sorted_names(const sheaf::Problem& problem) {
  if (problem.metadata == nullptr) return {};
  std::vector<std::string> out = problem.metadata->image_names;
  std::sort(out.begin(), out.end());
  return out;
}

/// What is read again beside the counts. Formats may hold coordinates as texts of some digits.
void compare(const sheaf::Problem& problem, const sheaf::Problem& again, const std::string& format,
             const sheaf::FormatHolds& holds) {
  const auto before = seen_points(problem), after = seen_points(again);
  const double digits = holds.doubles ? 1e-12 : 1e-5;
  for (std::size_t k = 0; k < 3; ++k) {
    double largest = 1;
    for (const double x : before[k]) largest = std::max(largest, std::abs(x));
    for (std::size_t i = 0; i < before[k].size(); ++i)
      require(std::abs(before[k][i] - after[k][i]) <= digits * largest, format + ": points");
  }
  if (holds.names && !sorted_names(problem).empty())
    require(sorted_names(problem) == sorted_names(again), format + ": names");
}

void check(const sheaf::Problem& problem, const Target& target, const fs::path& folder) {
  const fs::path path = folder / target.name;
  fs::remove_all(path);
  const bool is_file = target.name != "model";
  if (is_file) std::ofstream(path) << "before";
  sheaf::WriteOptions options;
  options.format = target.format;
  const sheaf::Result<void> done = sheaf::write(problem, path, options);
  if (!done.ok()) {
    require(std::string(done.error().what()).size() > 8, "a refusal has words");
    require(!is_file || fs::file_size(path) == 6, "a refused file is as it was: " + target.format);
    return;
  }
  require(sheaf::validate(problem).ok(), "what is written is valid: " + target.format);
  const sheaf::FileFormat* format = sheaf::format_named(target.format);
  if (format != nullptr && (format->parse == nullptr || !format->holds.observations)) return;
  const sheaf::Result<sheaf::Problem> again = sheaf::read(path);
  require(again.ok(),
          target.format + " is read again: " + (again.ok() ? "" : again.error().what()));
  require(again.value().num_images() == problem.num_images(), target.format + ": images");
  require(again.value().num_observations() == problem.num_observations(),
          target.format + ": observations");
  compare(problem, again.value(), target.format,
          format == nullptr ? sheaf::FormatHolds{} : format->holds);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fs::path folder =
      fs::temp_directory_path() / ("writers_fuzz-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  FuzzedDataProvider from(data, size);
  const Target& target =
      targets()[from.ConsumeIntegralInRange<std::size_t>(0, targets().size() - 1)];
  check(problem_of(from), target, folder);
  fs::remove_all(folder);
  return 0;
}
