// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "inspect/statistics.h"
#include "json_document.h"
#include "outputs.h"
#include "platform/memory.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  std::string in;
};

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
  fmt::print("points by number of observations:\n");
  for (const auto& [label, points] : bars)
    fmt::print("{:>11}  {:>9}  {}\n", label, points, std::string(points * 40 / most, '#'));
}

void print(const std::string& path, const InputFile& input, const Statistics& statistics,
           const Evaluation& evaluation) {
  const Range& images = statistics.observations_per_image;
  const Range& focal = statistics.focal_px;
  const std::string packed = input.compression == "none" ? "" : ", " + input.compression;
  fmt::print("{}: {}\n", path, counts_text(input.problem));
  fmt::print("file        {}{}, {} bytes, read in {:.3f} s\n", input.format, packed, input.bytes,
             input.read_s);
  fmt::print("cost        {:.9e}\n", evaluation.cost);
  fmt::print("rms         {:.6g} px\n", evaluation.rms_px);
  fmt::print("behind      {} observations behind their camera\n", evaluation.behind.size());
  if (!evaluation.not_finite.empty())
    fmt::print("not finite  {} observations, not in the cost\n", evaluation.not_finite.size());
  fmt::print("images      {:.0f} to {:.0f} observations, median {:.6g}\n", images.min, images.max,
             images.median);
  fmt::print("focal       {:.6g} to {:.6g} px, median {:.6g}\n", focal.min, focal.max,
             focal.median);
  fmt::print("tracks      {:.0f} to {:.0f} observations a point, mean {:.3f}\n",
             statistics.track.min, statistics.track.max, statistics.mean_track);
  fmt::print("memory      {} bytes for the problem, {} bytes at most for the process\n",
             size_bytes(input.problem), peak_resident_bytes());
  print_histogram(statistics);
}

int run(const Arguments& arguments) {
  const Timer total;
  const std::string& json = arguments.common.json;
  check_outputs({{"--json", json}});
  const InputFile input = read_file(arguments.in, {.hash = !json.empty()}).value();
  const Statistics statistics = statistics_of(input.problem);
  const Evaluation evaluation = evaluate(input.problem);
  print(arguments.in, input, statistics, evaluation);
  if (json.empty()) return 0;
  Json document = {{"version", SHEAF_VERSION}, {"input", input_json(arguments.in, input)}};
  document.update(statistics_json(statistics));
  document["cost"] = number(evaluation.cost);
  document["rms_px"] = number(evaluation.rms_px);
  document["behind_camera"] = observations_json(evaluation.behind, input.problem);
  document["not_finite"] = observations_json(evaluation.not_finite, input.problem);
  document["memory"] = {{"problem_bytes", size_bytes(input.problem)},
                        {"peak_bytes", peak_resident_bytes()}};
  document["time"] = {{"read_s", input.read_s}, {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& verb =
      *app.add_subcommand("info", "what is in a problem, and how well it fits as it is");
  verb.add_option("IN", arguments->in, "problem: BAL, plain or .gz or .bz2 (told by content)")
      ->type_name("FILE")
      ->required();
  add_common_options(verb, arguments->common);
  verb.footer("Example:\n  sheaf info problem.txt --json info.json");
  verb.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace sheaf
