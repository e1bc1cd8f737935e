// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "outputs.h"

#include <fmt/format.h>

#include <filesystem>

#include "io/folder_files.h"
#include "io/output_file.h"
#include "io/output_folder.h"
#include "scene/source_files.h"
#include "sheaf/error.h"
#include "sheaf/io.h"
#include "terminal.h"

namespace sheaf {

namespace {

namespace fs = std::filesystem;

/// Links are followed; a file need not be there yet.
bool is_same(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  if (fs::equivalent(a, b, ignored) && !ignored) return true;
  const auto normal = [&](const fs::path& path) {
    fs::path out = fs::weakly_canonical(fs::absolute(path, ignored), ignored);
    return out.has_filename() ? out : out.parent_path();
  };
  return normal(a) == normal(b);
}

/// Whether writing `output` would change `input`.
bool touches(const std::string& output, const std::string& input) {
  std::error_code ignored;
  if (fs::is_fifo(input, ignored) || fs::is_character_file(input, ignored)) return false;
  if (is_same(output, input)) return true;
  if (!fs::is_directory(input, ignored) || !fs::is_regular_file(output, ignored)) return false;
  for (fs::recursive_directory_iterator at(input, ignored), end; !ignored && at != end;
       at.increment(ignored)) {
    std::error_code of_one;
    if (at->is_regular_file(of_one) && fs::equivalent(output, at->path(), of_one)) return true;
  }
  return false;
}

/// What another model left in a folder, which would be mixed up with the one that is written; what
/// `write` would say after the solve is said before it.
void check_model_folder(const Problem& problem, const std::string& format,
                        const std::string& path) {
  const OutputFolder folder = OutputFolder::create(path).value();
  const bool text = format == "colmap-text";
  const SourceFiles* source = problem.metadata ? problem.metadata->source.get() : nullptr;
  const bool rigs = !problem.rigs.empty() || (source != nullptr && !source->rigs.empty());
  for (const char* stem : {"cameras", "images", "points3D", "rigs", "frames"}) {
    const std::string name = std::string(stem) + (text ? ".txt" : ".bin");
    const std::string other = std::string(stem) + (text ? ".bin" : ".txt");
    const bool of_rigs = stem[0] == 'r' || stem[0] == 'f';
    if (folder.had(other) || (of_rigs && !rigs && folder.had(name)))
      throw Error(ErrorCode::unwritable_output,
                  fmt::format("{}: cannot be written: it holds {} of another model, which would be "
                              "mixed up with what is written",
                              path, folder.had(other) ? other : name));
  }
}

}  // namespace

void check_outputs(const std::vector<NamedOutput>& outputs,
                   const std::vector<std::string>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const NamedOutput& output = outputs[i];
    std::error_code ignored;
    if (output.path.empty() || fs::is_character_file(output.path, ignored)) continue;
    for (std::size_t j = 0; j < i; ++j)
      if (!outputs[j].path.empty() && is_same(output.path, outputs[j].path))
        throw Error(ErrorCode::usage, fmt::format("{} and {} name the same file, {}",
                                                  outputs[j].option, output.option, output.path));
    for (const std::string& input : inputs)
      if (!input.empty() && touches(output.path, input))
        throw Error(
            ErrorCode::usage,
            fmt::format("{} names {}, which the input {} would be lost by: name another one",
                        output.option, output.path, input));
    if (output.folder)
      make_output_folder(output.path).value();
    else
      check_writable(output.path, output.model).value();
  }
}

void check_holds(const Problem& problem, const std::string& path) {
  if (path.empty()) return;
  const std::string format = write_format(problem, path);
  can_hold(format, problem).value();
  if (format.starts_with("colmap")) check_model_folder(problem, format, path);
}

void check_holds_refined(const Problem& problem, const Fixed& fixed, const std::string& path) {
  if (path.empty()) return;
  Problem refined;
  refined.poses = problem.poses;
  refined.image_camera = problem.image_camera;
  refined.cameras = problem.cameras;
  refined.metadata = problem.metadata;
  std::vector<bool> seen(problem.cameras.size(), false);
  for (const std::uint32_t image : problem.observation_image)
    seen[problem.image_camera[image]] = true;
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  // Any numbers that are not equal by chance.
  for (std::size_t c = 0; c < seen.size(); ++c)
    for (std::size_t k = 0; seen[c] && k < parameter_count(problem.cameras[c].model); ++k)
      if (((held[c] >> k) & 1u) == 0)
        refined.cameras[c].parameters[k] += 1e-3 * static_cast<double>(k + 1);
  const Result<void> held_by = can_hold(write_format(refined, path), refined);
  if (!held_by.ok())
    throw Error(held_by.error().code(),
                fmt::format("once its lenses are refined, {}", held_by.error().what()));
}

std::uint64_t bytes_at(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored))
    return fs::is_regular_file(path, ignored) ? fs::file_size(path, ignored) : 0;
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(path, ignored))
    if (entry.is_regular_file(ignored)) bytes += entry.file_size(ignored);
  return bytes;
}

void print_losses(const std::string& format, const Problem& problem) {
  for (const std::string& sentence : lost_in(format, problem))
    print_out("dropped     {}\n", sentence);
}

void write_text(const std::string& text, const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path, Compression::none);
  if (!file.ok()) throw file.error();
  file.value().write(text);
  file.value().commit().value();
}

}  // namespace sheaf
