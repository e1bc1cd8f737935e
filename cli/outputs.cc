// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "outputs.h"

#include <fmt/format.h>

#include <filesystem>

#include "io/output_file.h"
#include "sheaf/error.h"
#include "sheaf/io.h"

namespace sheaf {

void check_outputs(const std::vector<NamedOutput>& outputs) {
  const auto normal = [](const std::string& path) {
    std::error_code ignored;
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, ignored), ignored);
  };
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i].path.empty()) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (!outputs[j].path.empty() && normal(outputs[i].path) == normal(outputs[j].path))
        throw Error(ErrorCode::usage,
                    fmt::format("{} and {} name the same file, {}", outputs[j].option,
                                outputs[i].option, outputs[i].path));
    }
    check_writable(outputs[i].path, outputs[i].model).value();
  }
}

std::uint64_t bytes_at(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return fs::file_size(path, ignored);
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(path, ignored))
    if (entry.is_regular_file(ignored)) bytes += entry.file_size(ignored);
  return bytes;
}

void print_losses(const std::string& format, const Problem& problem) {
  for (const std::string& sentence : lost_in(format, problem))
    fmt::print("dropped     {}\n", sentence);
}

void write_text(const std::string& text, const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path, Compression::none);
  if (!file.ok()) throw file.error();
  file.value().write(text);
  file.value().commit().value();
}

}  // namespace sheaf
