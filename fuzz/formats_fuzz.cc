// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Bundler, NVM, libmv, g2o, OpenSfM, OpenMVG and AliceVision, told by their content: any bytes are
// refused with a message, or are a valid problem; what Sheaf writes of it reads back, of the first
// three to the same. Behind a zero byte stands the file that lies beside a JSON one (tracks.csv).
// Other texts with a zero byte are SBA's cameras, points and, behind another one, calibration.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "io/bundler.h"
#include "io/format.h"
#include "io/g2o.h"
#include "io/json_lines.h"
#include "io/libmv.h"
#include "io/nvm.h"
#include "io/sba.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "formats_fuzz: %s\n", what);
  std::abort();
}

using Reader = sheaf::Result<sheaf::Problem> (*)(std::string_view, const std::string&,
                                                 std::vector<std::string>&);

void require_refusal(const sheaf::Error& error, const char* begins) {
  const std::string message = error.what();
  require(error.code() == sheaf::ErrorCode::unreadable_input, "code of the error");
  require(message.rfind(begins, 0) == 0, "the message names the input");
  require(message.find("found") != message.npos && message.find("expected") != message.npos,
          "found and expected");
}

void check(Reader read, sheaf::Result<std::string> (*format)(const sheaf::Problem&),
           std::string_view bytes, bool exact) {
  std::vector<std::string> notes;
  const sheaf::Result<sheaf::Problem> problem = read(bytes, "input", notes);
  if (!problem.ok()) {
    return require_refusal(problem.error(), "input:");
  }
  require(sheaf::validate(problem.value()).ok(), "what was read is valid");
  if (format == nullptr) return;
  const sheaf::Result<std::string> text = format(problem.value());
  require(text.ok(), "what was read can be written");
  const sheaf::Result<sheaf::Problem> again = read(text.value(), "again", notes);
  require(again.ok(), "what was written can be read");
  if (exact)
    require(sheaf::state_hash(again.value()) == sheaf::state_hash(problem.value()),
            "it is the same");
  require(format(again.value()).value() == text.value(), "and is written the same");
}

using Parsed = sheaf::Result<sheaf::Problem>;

Parsed parse(const sheaf::FileFormat& format, const std::string& text, const std::string& beside) {
  std::vector<std::string> notes;
  const sheaf::Result<sheaf::JsonValue> root = sheaf::parse_json(text, "input");
  const sheaf::FolderFiles files{
      "input", [&](const std::string&) { return !beside.empty(); },
      [&](const std::string&) { return sheaf::Result<std::string>(beside); }};
  return format.parse({text, "input", &root.value(), files, notes});
}

void check_json(const std::string& text, const std::string& beside) {
  const sheaf::Result<sheaf::JsonValue> root = sheaf::parse_json(text, "input");
  if (!root.ok()) return require_refusal(root.error(), "input:");
  for (const sheaf::FileFormat& format : sheaf::file_formats()) {
    if (format.is_json == nullptr || !format.is_json(root.value())) continue;
    const Parsed problem = parse(format, text, beside);
    if (!problem.ok()) return require_refusal(problem.error(), "input");
    require(sheaf::validate(problem.value()).ok(), "what was read is valid");
    const sheaf::Result<sheaf::FormatOutput> out = format.format(problem.value());
    if (!out.ok()) return;  // a name or a lens that the format cannot state
    const auto& files = out.value().beside;
    const Parsed again = parse(format, out.value().text, files.empty() ? "" : files[0].bytes);
    require(again.ok(), "what was written can be read");
    require(again.value().num_observations() == problem.value().num_observations(),
            "it has as many observations");
    return;
  }
}

/// What stands before the next zero byte, which is taken off with it.
std::string take_part(std::string_view& bytes) {
  const std::string part(bytes.substr(0, bytes.find('\0')));
  bytes.remove_prefix(std::min(bytes.size(), part.size() + 1));
  return part;
}

void check_sba(std::string_view bytes) {
  sheaf::SbaFiles files;
  files.cameras = {"input/cams.txt", take_part(bytes)};
  files.points = {"input/pts.txt", take_part(bytes)};
  files.calib = {"input/calib.txt", take_part(bytes)};
  std::vector<std::string> notes;
  const Parsed problem = sheaf::parse_sba(files, notes);
  if (!problem.ok()) return require_refusal(problem.error(), "input");
  require(sheaf::validate(problem.value()).ok(), "what was read is valid");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.starts_with(sheaf::kBundlerMark))
    check(sheaf::parse_bundler, sheaf::format_bundler, bytes, true);
  // Matrices and translations are written as quaternions and centres, which rounds.
  if (bytes.starts_with(sheaf::kNvmMark))
    check(sheaf::parse_nvm, sheaf::format_nvm, bytes, !bytes.starts_with("NVM_V3_R9T"));
  if (sheaf::is_g2o(bytes)) check(sheaf::parse_g2o, nullptr, bytes, true);
  if (bytes.starts_with('{') || bytes.starts_with('[')) {
    std::string_view rest = bytes;
    const std::string text = take_part(rest);
    check_json(text, std::string(rest));
  } else if (bytes.find('\0') != bytes.npos) {
    check_sba(bytes);
  }
  if (sheaf::is_libmv(bytes)) check(sheaf::parse_libmv, nullptr, bytes, true);
  return 0;
}
