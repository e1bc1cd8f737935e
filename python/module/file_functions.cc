// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "clean_fields.h"
#include "fork_safety.h"
#include "inspect/clean.h"
#include "io/folder_files.h"
#include "io/rig_configuration_file.h"
#include "keyword_options.h"
#include "page/report.h"
#include "scene/rig_configuration.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

ProblemHandle read_problem(const fs::path& path) {
  auto held = std::make_shared<HeldProblem>();
  const nb::gil_scoped_release released;
  InputFile input = read_file(path).value();
  held->problem = std::move(input.problem);
  held->format = std::move(input.format);
  held->notes = std::move(input.notes);
  return held;
}

void write_problem(const ProblemHandle& held, const fs::path& path, const std::string& format) {
  const ReadUse use(held);
  const nb::gil_scoped_release released;
  write(use.problem(), path, {.format = format}).value();
}

std::vector<std::string> losses_in(const ProblemHandle& held, const std::string& format) {
  const ReadUse use(held);
  return lost_in(format, use.problem());
}

nb::object record_of(const CleanRecord& record) {
  return nb::module_::import_("sheaf._records")
      .attr("CleanRecord")(record.observations, array_of(record.far_off), array_of(record.behind),
                           array_of(record.in_plane), array_of(record.at_centre),
                           array_of(record.repeated), array_of(record.narrow),
                           array_of(record.short_tracks));
}

nb::object clean_problem(const ProblemHandle& held, const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  CleanOptions options;
  take_options(left, bound(clean_fields(), options));
  check_all_taken(left, "clean");
  WriteUse use(held);
  use.resize("clean");
  CleanRecord record;
  {
    const nb::gil_scoped_release released;
    if (options.any()) record = clean(use.problem(), options);
  }
  return record_of(record);
}

void report_problem(const ProblemHandle& held, const fs::path& path, nb::handle before,
                    const fs::path& images, const fs::path& summary, const std::string& title,
                    bool sigmas, int threads) {
  const ReadUse use(held);
  std::optional<ReadUse> start;
  if (!before.is_none()) start.emplace(nb::cast<ProblemHandle>(before));
  const nb::gil_scoped_release released;
  ReportOptions options{.title = title, .images = images, .sigmas = sigmas};
  options.threads = threads_here(threads);
  if (!summary.empty()) {
    options.summary = bytes_of(summary).value();
    options.summary_name = summary.string();
  }
  write_report(start ? &start->problem() : nullptr, use.problem(), path, options).value();
}

std::vector<std::string> convert_file(const fs::path& in, const fs::path& out,
                                      const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  const nb::object named = left.attr("pop")("format", nb::str(""));
  CleanOptions options;
  take_options(left, bound(clean_fields(), options));
  check_all_taken(left, "convert");
  std::string format = named.is_none() ? "" : nb::cast<std::string>(nb::str(named));
  const nb::gil_scoped_release released;
  Problem problem = read(in).value();
  if (options.any()) clean(problem, options);
  if (format.empty()) format = write_format(problem, out);
  write(problem, out, {.format = format}).value();
  return lost_in(format, problem);
}

std::vector<std::string> lay_rigs_of_file(const ProblemHandle& held, const fs::path& path) {
  WriteUse use(held);
  use.resize("lay_rigs");
  const nb::gil_scoped_release released;
  const RigConfigurationFile file = read_rig_configuration(path).value();
  const Result<RigLayout> laid = lay_rigs(use.problem(), file.rigs);
  if (!laid.ok()) throw Error(laid.error().code(), path.string() + ": " + laid.error().what());
  return file.notes;
}

}  // namespace

void bind_files(nb::module_& module, ProblemClass& problem) {
  module.def("read", &read_problem, nb::arg("path"),
             nb::sig("def read(path: str | os.PathLike[str]) -> Problem"),
             "Reads a BAL, Bundler, NVM or libmv file, plain or compressed, or the folder of a "
             "COLMAP model; the content tells which. Raises sheaf.Error (unreadable_input) with "
             "file, line, what was found and what was expected.");
  problem.def(
      "write", &write_problem, nb::arg("path"), nb::arg("format") = "",
      nb::sig("def write(self, path: str | os.PathLike[str], format: str = '') -> None"),
      "Writes the problem, whole or not at all, in the format named or the one that the "
      "path's name means (docs/formats.md). Raises sheaf.Error (unwritable_output, usage).");
  problem.def(
      "report", &report_problem, nb::arg("path"), nb::kw_only(), nb::arg("before") = nb::none(),
      nb::arg("images") = "", nb::arg("summary") = "", nb::arg("title") = "",
      nb::arg("sigmas") = true, nb::arg("threads") = 0,
      nb::sig("def report(self, path: str | os.PathLike[str], *, before: Problem | None = None, "
              "images: str | os.PathLike[str] = '', summary: str | os.PathLike[str] = '', title: "
              "str = '', sigmas: bool = True, threads: int = 0) -> None"),
      "Writes one page of HTML that shows the problem (docs/report.md); before: the start that it "
      "came from, images: a folder of pictures, summary: the JSON of a solve by the command. "
      "Raises "
      "sheaf.Error (usage, unreadable_input, unwritable_output).");
  problem.def("lost_in", &losses_in, nb::arg("format"),
              "Sentences about what of the problem this format does not hold.");
  CleanOptions fresh;
  const std::vector<BoundOption> options = bound(clean_fields(), fresh);
  const std::string help = help_of(options);
  problem.def(
      "clean", &clean_problem, nb::arg("options"),
      nb::sig(signature_of("clean", "self", {}, options, "sheaf._records.CleanRecord").c_str()),
      ("Leaves out what misleads a solver; numbers are those before.\n" + help).c_str());
  problem.def("lay_rigs", &lay_rigs_of_file, nb::arg("path"),
              nb::sig("def lay_rigs(self, path: str | os.PathLike[str]) -> list[str]"),
              "Lays the rigs of COLMAP's rig_config.json over the images, by their names "
              "(docs/rigs.md). Returns sentences about what of the file is not used.");
  module.def(
      "convert", &convert_file, nb::arg("source"), nb::arg("target"), nb::arg("options"),
      nb::sig(signature_of("convert",
                           "source: str | os.PathLike[str], target: str | os.PathLike[str]",
                           {"format: str | None = None"}, options, "list[str]")
                  .c_str()),
      ("Reads a file and writes it in another format. Returns sentences about what that does "
       "not hold.\n" +
       help)
          .c_str());
}

}  // namespace sheaf
