// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "inspect/pattern_figure.h"
#include "inspect/statistics.h"
#include "io/rotation_norms.h"
#include "json_document.h"
#include "outputs.h"
#include "platform/memory.h"
#include "read_input.h"
#include "rigs_option.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  RigsArguments rigs;
  std::string in, pattern;
};

// What --pattern draws, in numbers; null without it.
Json pattern_json(const std::string& path, const PatternCounts& c) {
  if (path.empty()) return {};
  return {{"path", path},
          {"links", c.links},
          {"fill", number(c.fill)},
          {"strongest_link", c.strongest_link},
          {"jacobian_rows", c.jacobian_rows},
          {"jacobian_columns", c.jacobian_columns},
          {"jacobian_nonzeros", c.jacobian_nonzeros},
          {"hessian_nonzeros", c.hessian_nonzeros},
          {"reduced_columns", c.reduced_columns}};
}

PatternCounts write_pattern(const Problem& problem, const std::string& name,
                            const std::string& path) {
  const PatternFigure figure =
      draw_patterns(problem,
                    std::filesystem::path(name).filename().string() + ": " + counts_text(problem))
          .value();
  write_text(figure.svg, path);
  const PatternCounts& c = figure.counts;
  print_out("network     {} pairs of images with points in common, {:.3g}% of all\n", c.links,
            100 * c.fill);
  print_out("patterns    {}\n", path);
  return c;
}

// One line for each of 0 ... 9 observations, then for each doubling: 10-19, 20-39, ...
void print_histogram(const Statistics& statistics) {
  std::uint64_t most = 1;
  std::vector<std::pair<std::string, std::uint64_t>> bars;
  std::uint64_t begin = 0, end = 1;
  auto next = statistics.track_histogram.begin();
  while (next != statistics.track_histogram.end()) {
    std::uint64_t points = 0;
    for (; next != statistics.track_histogram.end() && next->first < end; ++next)
      points += next->second;
    if (points > 0)
      bars.emplace_back(
          end - begin == 1 ? fmt::format("{}", begin) : fmt::format("{}-{}", begin, end - 1),
          points);
    most = std::max(most, points);
    begin = end;
    end = end < 10 ? end + 1 : 2 * end;
  }
  print_out("points by number of observations:\n");
  for (const auto& [label, points] : bars)
    print_out("{:>11}  {:>9}  {}\n", label, points, std::string(points * 40 / most, '#'));
}

std::map<std::string, std::size_t> lenses_of(const Problem& problem) {
  std::map<std::string, std::size_t> counts;
  for (const Camera& camera : problem.cameras) ++counts[std::string(to_string(camera.model))];
  return counts;
}

std::int64_t images_of_rigs(const Rigs& rigs) {
  return std::ssize(rigs.image_frame) -
         std::count(rigs.image_frame.begin(), rigs.image_frame.end(), Rigs::kNone);
}

std::vector<std::uint32_t> stale_poses(const Problem& problem) {
  return problem.metadata ? problem.metadata->stale_poses : std::vector<std::uint32_t>();
}

// Rotations that other programs may take for what they are not; nothing where there are none.
void print_norms(const Problem& problem) {
  const OffNorms off = off_norms(problem);
  if (off.images.empty()) return;
  print_out(
      "rotations   {} of {} stated by numbers off the length 1 by up to {:.2g}; normalised here, "
      "while COLMAP takes them as they are\n",
      off.images.size(), problem.num_images(), off.largest);
}

// "1 SIMPLE_RADIAL, 2 OPENCV"
std::string lenses_text(const Problem& problem) {
  std::string out;
  for (const auto& [model, count] : lenses_of(problem))
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", count, model);
  return out;
}

// "2 rigs of 5 sensors took 12 images in 4 frames"; nothing for a problem without.
void print_rigs(const Problem& problem) {
  const Rigs& rigs = problem.rigs;
  if (!rigs.empty())
    print_out("rigs        {} of {} sensors, {} frames of {} images\n", rigs.count,
              rigs.num_sensors(), rigs.num_frames(), images_of_rigs(rigs));
  const std::vector<std::uint32_t> stale = stale_poses(problem);
  if (stale.empty()) return;
  constexpr std::size_t kShown = 8;
  const std::size_t shown = std::min(stale.size(), kShown);
  print_out(
      "stale       {} images have other poses in the file of images than frames and rigs give, "
      "which hold: images {}{}\n",
      stale.size(),
      fmt::join(stale.begin(), stale.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
      stale.size() > shown ? " ..." : "");
}

Json rigs_json(const Rigs& rigs) {
  return {{"count", rigs.count},
          {"sensors", rigs.num_sensors()},
          {"frames", rigs.num_frames()},
          {"images", images_of_rigs(rigs)}};
}

Json stale_json(const Problem& problem) {
  constexpr std::size_t kMostListed = 1000;
  std::vector<std::uint32_t> stale = stale_poses(problem);
  const std::size_t count = stale.size();
  stale.resize(std::min(count, kMostListed));
  return {{"count", count}, {"first", stale}};
}

Json norms_json(const Problem& problem) {
  constexpr std::size_t kMostListed = 1000;
  OffNorms off = off_norms(problem);
  const std::size_t count = off.images.size();
  off.images.resize(std::min(count, kMostListed));
  return {{"count", count}, {"first", off.images}, {"largest", number(off.largest)}};
}

std::uint32_t camera_id(const Problem& problem, std::size_t c) {
  const bool known = problem.metadata && !problem.metadata->camera_ids.empty();
  return known ? problem.metadata->camera_ids[c] : static_cast<std::uint32_t>(c);
}

// A line for each of the first lenses that images share.
void print_cameras(const Problem& problem, const std::vector<CameraStatistics>& statistics) {
  constexpr std::size_t kShown = 8;
  if (problem.cameras.size() >= problem.num_images() && problem.cameras.size() > kShown) return;
  for (std::size_t c = 0; c < std::min(problem.cameras.size(), kShown); ++c) {
    const Camera& camera = problem.cameras[c];
    std::vector<std::string> parameters;
    const std::vector<std::string_view> names = parameter_names(camera.model);
    for (std::size_t k = 0; k < names.size(); ++k)
      parameters.push_back(fmt::format("{} {:.6g}", names[k], camera.parameters[k]));
    print_out("camera {:<4} {}{}, {} images, mean error {:.6g} px: {}\n", camera_id(problem, c),
              to_string(camera.model),
              camera.width_px > 0 ? fmt::format(" {} x {}", camera.width_px, camera.height_px) : "",
              statistics[c].images, statistics[c].mean_error_px, fmt::join(parameters, ", "));
  }
  if (problem.cameras.size() > kShown)
    print_out("            and {} more\n", problem.cameras.size() - kShown);
}

// The first thousand.
Json cameras_json(const Problem& problem, const std::vector<CameraStatistics>& statistics) {
  constexpr std::size_t kMostListed = 1000;
  Json out = Json::array();
  for (std::size_t c = 0; c < std::min(problem.cameras.size(), kMostListed); ++c) {
    const Camera& camera = problem.cameras[c];
    std::vector<double> parameters(
        camera.parameters.begin(),
        camera.parameters.begin() + static_cast<std::ptrdiff_t>(parameter_count(camera.model)));
    out.push_back({{"id", camera_id(problem, c)},
                   {"model", to_string(camera.model)},
                   {"width_px", camera.width_px},
                   {"height_px", camera.height_px},
                   {"parameters", parameters},
                   {"images", statistics[c].images},
                   {"observations", statistics[c].observations},
                   {"mean_error_px", number(statistics[c].mean_error_px)}});
  }
  return out;
}

void print(const std::string& path, const InputFile& input, const Statistics& statistics,
           const Evaluation& evaluation) {
  const Range& images = statistics.observations_per_image;
  const Range& focal = statistics.focal_px;
  const std::string packed = input.compression == "none" ? "" : ", " + input.compression;
  print_out("{}: {}\n", path, counts_text(input.problem));
  print_out("file        {}{}, {} bytes, read in {:.3f} s\n", input.format, packed, input.bytes,
            input.read_s);
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  print_out("registered  {} images, mean {:.6g} observations ({:.0f} to {:.0f}, median {:.6g})\n",
            input.problem.num_images(), statistics.mean_observations_per_image, images.min,
            images.max, images.median);
  print_out("points      {}, mean track length {:.3f} ({:.0f} to {:.0f} observations)\n",
            input.problem.num_points(), statistics.mean_track, statistics.track.min,
            statistics.track.max);
  print_out("error       mean reprojection error {:.6g} px, rms {:.6g} px\n",
            statistics.mean_error_px, evaluation.rms_px);
  print_out("cost        {:.9e}\n", evaluation.cost);
  print_out("behind      {} observations behind their camera\n", evaluation.behind.size());
  if (!evaluation.not_finite.empty())
    print_out("not finite  {} observations, not in the cost\n", evaluation.not_finite.size());
  print_out("lenses      {}; focal {:.6g} to {:.6g} px, median {:.6g}\n",
            lenses_text(input.problem), focal.min, focal.max, focal.median);
  print_cameras(input.problem, camera_statistics(input.problem));
  print_rigs(input.problem);
  print_norms(input.problem);
  print_out("memory      {} bytes for the problem, {} bytes at most for the process\n",
            size_bytes(input.problem), peak_resident_bytes());
  print_histogram(statistics);
}

// A drawing is no raster image: names that say so are refused before any work.
void check_pattern(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".png" || ending == ".jpg" || ending == ".jpeg")
    throw Error(ErrorCode::usage, "--pattern: found " + path +
                                      ", expected a name that ends in .svg: the figure is a "
                                      "drawing, which browsers and editors of drawings show");
}

int run(const Arguments& arguments) {
  const Timer total;
  check_pattern(arguments.pattern);
  const std::string& json = arguments.common.json;
  check_outputs({{"--pattern", arguments.pattern}, {"--json", json}},
                {arguments.in, arguments.rigs.path});
  InputFile input = read_input(arguments.in, arguments.common);
  const Json read = input_json(arguments.in, input);
  const Json laid = lay_rigs(arguments.rigs, input, arguments.common.quiet);
  const Statistics statistics = statistics_of(input.problem);
  const Evaluation evaluation = evaluate(input.problem);
  print(arguments.in, input, statistics, evaluation);
  PatternCounts pattern;
  if (!arguments.pattern.empty())
    pattern = write_pattern(input.problem, arguments.in, arguments.pattern);
  if (json.empty()) return 0;
  Json document = {{"version", SHEAF_VERSION}, {"input", read}};
  document.update(statistics_json(statistics));
  document["cameras"] = cameras_json(input.problem, camera_statistics(input.problem));
  document["lenses"] = Json::array();
  for (const auto& [model, count] : lenses_of(input.problem))
    document["lenses"].push_back({{"model", model}, {"count", count}});
  document["rigs"] = rigs_json(input.problem.rigs);
  document["rig_configuration"] = laid;
  document["stale_poses"] = stale_json(input.problem);
  document["rotation_norms"] = norms_json(input.problem);
  document["cost"] = number(evaluation.cost);
  document["rms_px"] = number(evaluation.rms_px);
  document["mean_error_px"] = number(statistics.mean_error_px);
  document["behind_camera"] = observations_json(evaluation.behind, input.problem);
  document["not_finite"] = observations_json(evaluation.not_finite, input.problem);
  document["pattern"] = pattern_json(arguments.pattern, pattern);
  document["memory"] = {{"problem_bytes", size_bytes(input.problem)},
                        {"peak_bytes", peak_resident_bytes()}};
  document["time"] = {{"read_s", input.read_s}, {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
}

}  // namespace

Verb info_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"info", "what is in a problem, and how well it fits as it is",
            "Example:\n  sheaf info problem.txt --json info.json --pattern pattern.svg"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, problem_in())}, *a);
  verb.options = joined(
      {bound<Arguments>({F::text(&Arguments::pattern,
                                 {.name = "pattern",
                                  .placeholder = "FILE",
                                  .help = "also draw the network of images and the patterns of "
                                          "Jacobian, Hessian and reduced camera matrix, as SVG"})},
                        *a),
       options_of(a->rigs), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
