// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes, plain or compressed: either they are refused with a message, or they are a valid
// problem, which does not depend on the reader's window and comes back bit for bit when written.

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "io/bal.h"
#include "sheaf/io.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "bal_fuzz: %s\n", what);
  std::abort();
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <class Numbers>
bool same(const Numbers& a, const Numbers& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_bits);
}

bool same(const sheaf::Problem& a, const sheaf::Problem& b) {
  if (a.num_images() != b.num_images() || a.observation_image != b.observation_image ||
      a.observation_point != b.observation_point || !same(a.observation_xy, b.observation_xy) ||
      !same(a.points, b.points) || !same(a.bal_angle_axis, b.bal_angle_axis))
    return false;
  for (std::size_t i = 0; i < a.num_images(); ++i)
    if (!same(a.poses[i].rotation, b.poses[i].rotation) ||
        !same(a.poses[i].translation, b.poses[i].translation) ||
        !same(a.cameras[i].parameters, b.cameras[i].parameters))
      return false;
  return true;
}

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const sheaf::Result<sheaf::Problem> whole = sheaf::parse_bal(bytes, "input");
  const sheaf::Result<sheaf::Problem> piecewise = sheaf::parse_bal(bytes, "input", 48);

  for (const auto* result : {&whole, &piecewise})
    if (!result->ok()) {
      const std::string message = result->error().what();
      require(result->error().code() == sheaf::ErrorCode::unreadable_input, "code of the error");
      require(message.rfind("input:", 0) == 0, "the message names the input");
      require(contains(message, "found") && contains(message, "expected"), "found and expected");
    }
  const bool too_long = !piecewise.ok() && contains(piecewise.error().what(), "of more than 48");
  require(too_long || whole.ok() == piecewise.ok(), "the outcome depends on the window");
  const bool packed = bytes.substr(0, 2) == "\x1f\x8b" || bytes.substr(0, 3) == "BZh";
  if (!whole.ok()) {
    // Corrupt compressed data and bad text may both be found; which comes first is open.
    require(packed || too_long || std::string(whole.error().what()) == piecewise.error().what(),
            "the message depends on the window");
    return 0;
  }
  require(too_long || same(whole.value(), piecewise.value()), "the window changes the problem");
  require(sheaf::validate(whole.value()).ok(), "what was read is valid");

  static const std::filesystem::path again =
      std::filesystem::temp_directory_path() / ("bal_fuzz-" + std::to_string(::getpid()));
  require(sheaf::write(whole.value(), again).ok(), "what was read can be written");
  require(same(whole.value(), sheaf::read(again).value()), "what was written comes back");
  std::filesystem::remove(again);
  return 0;
}
