// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The camera models' bodies on lanes, once for each instruction set and each of what is wanted. A
// model costs a fifth of a second of compiling here, and nothing in the files of kernels.
#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rows/lens_lanes.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "rows/lens_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

template <Wanted kWanted>
struct ProjectOnLanes {
  const Lane* k;
  const Lane* P;
  LensJacobian<Lane>& out;

  template <class Lens>
  HWY_INLINE void operator()(Lens) const {
    if constexpr (kWanted == Wanted::parameters) return Lens::project(k, P, out);
    LensJacobian<Lane> J;
    Lens::project(k, P, J);
    for (int r = 0; r < 2; ++r) {
      out.pixel[r] = J.pixel[r];
      if constexpr (kWanted != Wanted::pixel)
        for (int i = 0; i < 3; ++i) out.point[r][i] = J.point[r][i];
    }
  }
};

template <Wanted kWanted>
void project_on_lanes(CameraModel model, const Lane* k, const Lane* P, LensJacobian<Lane>& out) {
  HWY_NAMESPACE::with_lens(model, ProjectOnLanes<kWanted>{k, P, out});
}

template void project_on_lanes<Wanted::pixel>(CameraModel, const Lane*, const Lane*,
                                              LensJacobian<Lane>&);
template void project_on_lanes<Wanted::point>(CameraModel, const Lane*, const Lane*,
                                              LensJacobian<Lane>&);
template void project_on_lanes<Wanted::parameters>(CameraModel, const Lane*, const Lane*,
                                                   LensJacobian<Lane>&);

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();
