// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "geometry/rotation.h"
#include "io/line_cursor.h"
#include "scene/stated_rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What Bundler's and NVM's texts have in common: fields apart by blanks and lines, and points as
/// X Y Z, red green blue, a number of views, the views.
struct PointText {
  LineCursor in;
  std::uint64_t size;  ///< of the text, bytes
  Problem problem{};
  SceneMetadata metadata{};

  /// Fills all of `numbers`; the error says what was expected.
  template <class Numbers>
  std::optional<Error> reals(Numbers& numbers, const std::string& what) {
    for (double& x : numbers) {
      in.seek_field();
      if (!in.read_real(x)) return in.refuse("a finite number, " + what);
    }
    return {};
  }

  template <class Integer>
  std::optional<Error> integer(Integer& value, const std::string& what) {
    in.seek_field();
    if (!in.read_integer(value)) return in.refuse(what);
    return {};
  }

  /// Refuses what is no rotation, as far as a file of few digits can state one.
  std::optional<Error> rotation(const std::array<double, 9>& R, std::uint64_t line,
                                const std::string& of) const {
    const char* found = no_rotation(R);
    if (found != nullptr)
      return in.refuse_at(line, std::string("found ") + found + ", expected the rotation" + of);
    return {};
  }

  /// Point i of the file; `view` reads one of its views, of at least `least_view` bytes.
  template <class View>
  std::optional<Error> point(std::uint64_t i, std::uint64_t least_view, const View& view) {
    const std::string of = " of point " + std::to_string(i);
    std::array<double, 3> X{};
    if (auto e = reals(X, "a coordinate" + of)) return e;
    problem.add_point(X[0], X[1], X[2]);
    std::array<std::uint8_t, 3> colour{};
    for (std::uint8_t& c : colour)
      if (auto e = integer(c, "a colour, 0 to 255," + of)) return e;
    metadata.point_colours.push_back(colour);
    std::uint64_t views = 0;
    if (auto e = integer(views, "the number of views" + of)) return e;
    if (views > size / least_view)
      return in.refuse("a number of views that the file can hold," + of);
    for (std::uint64_t k = 0; k < views; ++k)
      if (auto e = view()) return e;
    return {};
  }
};

}  // namespace sheaf
