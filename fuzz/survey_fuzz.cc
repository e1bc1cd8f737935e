// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Files of constraints, told by their content: any bytes are refused with a message, or are
// constraints whose sigmas are above 0.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "sheaf/survey.h"

namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "survey_fuzz: %s\n", what);
  std::abort();
}

bool above_zero(double x) { return x > 0 && std::isfinite(x); }

void check(const sheaf::Constraints& c) {
  for (const sheaf::ImagePosition& p : c.positions) {
    require(!p.image.empty(), "a position names its image");
    for (std::size_t k = 0; k < 3; ++k)
      require(std::isfinite(p.at[k]) && above_zero(p.covariance[4 * k]),
              "a position and its sigma");
  }
  for (const sheaf::SurveyPoint& point : c.points) {
    for (const double s : point.sigma) require(above_zero(s), "the sigma of a point");
    for (const sheaf::SurveyMark& mark : point.marks)
      require(above_zero(mark.sigma_px), "the sigma of a mark");
  }
  for (const sheaf::ScaleBar& bar : c.scale_bars)
    require(above_zero(bar.distance) && above_zero(bar.sigma), "a scale bar");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const sheaf::Result<sheaf::Constraints> read =
      sheaf::parse_constraints(std::string(reinterpret_cast<const char*>(data), size), "input");
  if (read.ok()) {
    check(read.value());
    return 0;
  }
  const std::string message = read.error().what();
  require(read.error().code() == sheaf::ErrorCode::unreadable_input, "code of the error");
  require(message.rfind("input", 0) == 0, "the message names the input");
  require(message.find("found") != message.npos && message.find("expected") != message.npos,
          "found and expected");
  return 0;
}
