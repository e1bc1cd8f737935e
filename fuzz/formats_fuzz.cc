// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Bundler, NVM and libmv, told by their content: any bytes are refused with a message, or are a
// valid problem; what Sheaf writes of it reads back to the same.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "io/bundler.h"
#include "io/libmv.h"
#include "io/nvm.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "formats_fuzz: %s\n", what);
  std::abort();
}

using Reader = sheaf::Result<sheaf::Problem> (*)(std::string_view, const std::string&,
                                                 std::vector<std::string>&);

void check(Reader read, sheaf::Result<std::string> (*format)(const sheaf::Problem&),
           std::string_view bytes, bool exact) {
  std::vector<std::string> notes;
  const sheaf::Result<sheaf::Problem> problem = read(bytes, "input", notes);
  if (!problem.ok()) {
    const std::string message = problem.error().what();
    require(problem.error().code() == sheaf::ErrorCode::unreadable_input, "code of the error");
    require(message.rfind("input:", 0) == 0, "the message names the input");
    require(message.find("found") != message.npos && message.find("expected") != message.npos,
            "found and expected");
    return;
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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.starts_with(sheaf::kBundlerMark))
    check(sheaf::parse_bundler, sheaf::format_bundler, bytes, true);
  // Matrices and translations are written as quaternions and centres, which rounds.
  if (bytes.starts_with(sheaf::kNvmMark))
    check(sheaf::parse_nvm, sheaf::format_nvm, bytes, !bytes.starts_with("NVM_V3_R9T"));
  if (sheaf::is_libmv(bytes)) check(sheaf::parse_libmv, nullptr, bytes, true);
  return 0;
}
