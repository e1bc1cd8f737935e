// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// A folder of images with points, or of RGB-D images, in one input: files one behind the other,
// each with the length of its name (a byte), its name, its own length (u16, little-endian) and its
// bytes. Either it is refused with a message, or it is a valid photometric problem.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <string_view>

#include "io/direct_folder.h"
#include "io/rgbd_folder.h"

namespace {

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::fprintf(stderr, "photometric_fuzz: %s\n", what.c_str());
  std::abort();
}

std::string take(std::string_view& bytes, std::size_t length) {
  const std::string out(bytes.substr(0, length));
  bytes.remove_prefix(out.size());
  return out;
}

std::size_t take_number(std::string_view& bytes, std::size_t width) {
  std::size_t value = 0;
  for (std::size_t k = 0; k < width && !bytes.empty(); ++k, bytes.remove_prefix(1))
    value |= std::size_t(static_cast<unsigned char>(bytes[0])) << (8 * k);
  return value;
}

void check(const sheaf::Result<sheaf::PhotometricFolder>& read) {
  if (!read.ok()) {
    const std::string message = read.error().what();
    require(read.error().code() == sheaf::ErrorCode::unreadable_input ||
                read.error().code() == sheaf::ErrorCode::usage,
            "code of the error");
    require(message.rfind("m", 0) == 0, "the message names the folder: " + message);
    return;
  }
  const sheaf::PhotometricFolder& folder = read.value();
  const bool valid = sheaf::validate(folder.problem).ok();
  const std::size_t images = folder.problem.images.size();
  require(folder.problem.poses.size() == images && folder.times.size() == images &&
              folder.files.size() == images,
          "an image, a pose, a time and a file each");
  if (folder.format != "direct" && valid)
    require(!folder.problem.sight_point.empty() && folder.problem.has_hosts(), "points are seen");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view bytes(reinterpret_cast<const char*>(data), size);
  std::map<std::string, std::string> held;
  while (!bytes.empty()) {
    const std::string name = take(bytes, take_number(bytes, 1));
    held[name] = take(bytes, take_number(bytes, 2));
  }
  const sheaf::FolderFiles files{"m", [&](const std::string& name) { return held.count(name) > 0; },
                                 [&](const std::string& name) -> sheaf::Result<std::string> {
                                   const auto at = held.find(name);
                                   if (at == held.end())
                                     return sheaf::Error(sheaf::ErrorCode::unreadable_input,
                                                         "m/" + name + ": not there");
                                   return at->second;
                                 }};
  check(held.count("poses.txt") > 0 ? sheaf::read_direct(files, {}) : sheaf::read_rgbd(files, {}));
  return 0;
}
