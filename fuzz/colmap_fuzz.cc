// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The three to five files of a COLMAP model in one input: a byte for the form ('b' or 't'), then
// each file with its length (u32, little-endian) before it. Either they are refused with a message,
// or they are a valid problem that comes back byte for byte.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "io/colmap.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "colmap_fuzz: %s\n", what);
  std::abort();
}

std::string take(std::string_view& bytes) {
  std::uint32_t length = 0;
  if (bytes.size() < 4) return {};
  std::memcpy(&length, bytes.data(), 4);
  bytes.remove_prefix(4);
  const std::string file(bytes.substr(0, length));
  bytes.remove_prefix(file.size());
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.empty()) return 0;
  sheaf::ColmapFiles files;
  files.text = bytes[0] == 't';
  files.folder = "m/";
  bytes.remove_prefix(1);
  for (std::string* part :
       {&files.cameras, &files.images, &files.points, &files.rigs, &files.frames})
    *part = take(bytes);
  const sheaf::Result<sheaf::Problem> problem = sheaf::parse_colmap(files);
  if (!problem.ok()) {
    const std::string message = problem.error().what();
    require(problem.error().code() == sheaf::ErrorCode::unreadable_input, "code of the error");
    require(message.rfind("m/", 0) == 0, "the message names the file");
    require(message.find("found") != message.npos && message.find("expected") != message.npos,
            "found and expected");
    return 0;
  }
  require(sheaf::validate(problem.value()).ok(), "what was read is valid");
  const sheaf::Result<sheaf::ColmapFiles> again = sheaf::format_colmap(problem.value(), files.text);
  require(again.ok(), "what was read can be written");
  require(again.value().cameras == files.cameras, "cameras come back");
  require(again.value().images == files.images, "images come back");
  require(again.value().points == files.points, "points come back");
  const sheaf::Result<sheaf::ColmapFiles> other =
      sheaf::format_colmap(problem.value(), !files.text);
  if (!other.ok()) return 0;  // a name that text cannot state
  const sheaf::Result<sheaf::Problem> turned = sheaf::parse_colmap(other.value());
  require(turned.ok(), "the other form can be read");
  require(sheaf::state_hash(turned.value()) == sheaf::state_hash(problem.value()),
          "the other form says the same");
  return 0;
}
