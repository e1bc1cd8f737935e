// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "io/format.h"
#include "io/models.h"

namespace sheaf::test {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;
using Notes = std::vector<std::string>;

inline std::string text_of(double x) {
  std::array<char, 40> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%.17g", x);
  return buffer.data();
}

template <class Numbers>
std::string list_of(const Numbers& numbers, const char* quote = "") {
  std::string out;
  for (const double x : numbers)
    out += (out.empty() ? "[" : ", ") + std::string(quote) + text_of(x) + quote;
  return out + "]";
}

/// Two cameras and what they see, in plain numbers: rotations about y and x.
struct Scene {
  std::vector<Vec3> points{
      {0.3, -0.2, 0.1}, {-0.4, 0.25, -0.3}, {0.1, 0.4, 0.5}, {-0.2, -0.35, 0.2}};
  std::array<double, 2> turn{0.3, -0.2};  ///< rad, of the two cameras
  std::array<Vec3, 2> centre{{{0.2, 0.1, -4}, {-0.3, 0.2, -3.5}}};

  std::array<double, 9> rotation(std::size_t j) const {
    const double c = std::cos(turn[j]), s = std::sin(turn[j]);
    if (j == 0) return {c, 0, s, 0, 1, 0, -s, 0, c};
    return {1, 0, 0, 0, c, -s, 0, s, c};
  }
  Vec3 angle_axis(std::size_t j) const {
    return j == 0 ? Vec3{0, turn[0], 0} : Vec3{turn[1], 0, 0};
  }
  Vec3 in_camera(std::size_t j, const Vec3& X) const {
    const auto R = rotation(j);
    Vec3 out{};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t k = 0; k < 3; ++k) out[r] += R[3 * r + k] * (X[k] - centre[j][k]);
    return out;
  }
  Vec3 translation(std::size_t j) const { return in_camera(j, {0, 0, 0}); }
};

inline Vec2 straight(const Vec3& P) { return {P[0] / P[2], P[1] / P[2]}; }
inline Vec2 bent(const Vec3& P) {  ///< theta e
  const double r = std::hypot(P[0], P[1]), theta = std::atan2(r, P[2]);
  return {theta * P[0] / r, theta * P[1] / r};
}
inline Vec2 radial(const Vec2& p, const std::vector<double>& k) {
  const double r2 = p[0] * p[0] + p[1] * p[1];
  double factor = 1, power = r2;
  for (const double c : k) factor += c * power, power *= r2;
  return {factor * p[0], factor * p[1]};
}
inline Vec2 brown(const Vec2& p, const std::vector<double>& k, double p1, double p2) {
  const double r2 = p[0] * p[0] + p[1] * p[1];
  const Vec2 out = radial(p, k);
  return {out[0] + 2 * p1 * p[0] * p[1] + p2 * (r2 + 2 * p[0] * p[0]),
          out[1] + 2 * p2 * p[0] * p[1] + p1 * (r2 + 2 * p[1] * p[1])};
}

/// A lens as a file states it, and its formula.
struct Stated {
  std::string members;
  std::function<Vec2(const Vec3&)> project;
  CameraModel model;
};

inline Problem parsed(const char* format, const std::string& text, Notes& notes,
                      FolderFiles beside = {}) {
  const JsonValue root = parse_json(text, "f").value();
  const FileFormat* known = format_named(format);
  EXPECT_TRUE(known->is_json(root));
  return known->parse({text, "f", &root, std::move(beside), notes}).value();
}

inline FolderFiles holding(const std::string& name, const std::string& bytes) {
  return {"d", [=](const std::string& file) { return file == name; },
          [=](const std::string&) { return Result<std::string>(bytes); }};
}

/// Pixels of a lens with f = 500 and its principal point 10 px right of and 20 above the centre.
inline Vec2 pixel(const Vec2& p, double fy = 500) { return {500 * p[0] + 330, fy * p[1] + 220}; }

}  // namespace sheaf::test
