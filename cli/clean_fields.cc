// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "clean_fields.h"

namespace sheaf {

const OptionTable<CleanOptions>& clean_fields() {
  using F = FieldsOf<CleanOptions>;
  static const OptionTable<CleanOptions> kTable = {
      F::unless_zero(&CleanOptions::max_error_px,
                     {.name = "max-error",
                      .placeholder = "PX",
                      .unit = "px",
                      .range = above(0),
                      .help = "leave out observations whose residual is longer, or not finite"}),
      F::flag(&CleanOptions::behind,
              {.name = "drop-behind",
               .help = "leave out observations whose point lies behind the camera, in its plane or "
                       "at its centre"}),
      F::flag(&CleanOptions::repeated,
              {.name = "drop-repeated",
               .help = "leave out observations that occur twice, pixel and all"}),
      F::unless_zero(&CleanOptions::min_angle_deg,
                     {.name = "min-angle",
                      .placeholder = "DEGREES",
                      .unit = "deg",
                      .range = {.lowest = 0, .highest = 180, .above = true},
                      .help = "leave out points whose rays meet at less than this at most"}),
      F::unless_zero(&CleanOptions::min_track,
                     {.name = "min-track",
                      .placeholder = "N",
                      .range = from(1),
                      .help = "leave out points with fewer observations left"})};
  return kTable;
}

}  // namespace sheaf
