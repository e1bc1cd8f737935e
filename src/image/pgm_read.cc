// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "image/pgm.h"

namespace sheaf {
namespace {

bool blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// The number behind blanks and comments, which reach from # to the line's end.
bool read_number(std::string_view bytes, std::size_t& at, std::uint32_t& value) {
  while (at < bytes.size() && (blank(bytes[at]) || bytes[at] == '#')) {
    if (bytes[at] == '#') at = std::min(bytes.find('\n', at), bytes.size() - 1);
    ++at;
  }
  const char* const end = bytes.data() + bytes.size();
  const auto [stop, error] = std::from_chars(bytes.data() + at, end, value);
  at = static_cast<std::size_t>(stop - bytes.data());
  return error == std::errc();
}

}  // namespace

Result<Raster> decode_pgm(std::string_view bytes, const std::string& name,
                          const ImageBounds& bounds) {
  constexpr std::uint32_t kWidest = 1 << 20, kLargest = 65535;
  const auto refuse = [&](std::size_t byte, const std::string& found_and_expected) {
    return Error(ErrorCode::unreadable_input,
                 name + ": byte " + std::to_string(byte) + ": " + found_and_expected);
  };
  std::size_t at = kPgmMark.size();
  std::array<std::uint32_t, 3> header{};  // width, height, largest value
  if (!bytes.starts_with(kPgmMark)) return refuse(0, "found no PGM image, expected one (P5)");
  for (std::uint32_t& x : header)
    if (!read_number(bytes, at, x) || x == 0)
      return refuse(at, "found no number, expected width, height and largest value of a PGM image");
  const auto [width, height, largest] = header;
  if (width > kWidest || height > kWidest || largest > kLargest)
    return refuse(at, "found an absurd size or largest value, expected those of a PGM image");
  if (const std::string wrong = bounds.refusal(width, height, bytes.size()); !wrong.empty())
    return Error(ErrorCode::unreadable_input, name + ": " + wrong);
  ++at;  // one blank
  const std::size_t size = largest > 255 ? 2 : 1;
  const std::uint64_t needed = std::uint64_t{width} * height * size;
  if (at > bytes.size() || bytes.size() - at < needed)
    return refuse(bytes.size(), "found the end of the file, expected " + std::to_string(needed) +
                                    " bytes of samples (truncated?)");
  Raster out{static_cast<int>(width), static_cast<int>(height), 1, size == 2 ? 16 : 8, {}};
  out.samples.reserve(std::size_t{width} * height);
  for (std::uint64_t i = 0; i < needed; i += size) {
    const auto byte = [&](std::uint64_t k) {
      return static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[at + i + k]));
    };
    out.samples.push_back(size == 2 ? static_cast<std::uint16_t>(byte(0) << 8 | byte(1)) : byte(0));
  }
  return out;
}

}  // namespace sheaf
