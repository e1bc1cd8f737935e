// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "platform/parallel.h"
#include "starts/sights.h"

namespace sheaf {

/// A ParameterSet that holds whatever there is.
inline constexpr ParameterSet kAllParameters = 0xffff;

/// What of the images may move.
struct FreeImages {
  std::vector<std::uint8_t> pose;       ///< 1 for each image whose pose may
  std::vector<ParameterSet> lens_held;  ///< of each camera, what may not
  std::vector<std::uint8_t> lens_own;   ///< 1 for each camera that one image alone has
};
FreeImages free_images(const Problem& problem, const Fixed& fixed);

/// Resects every image anew with the points held: its pose, and its lens where it has one of its
/// own, descend by themselves from where they are, from the rotation that turns the points'
/// directions best into the bearings of their pixels, and from a lens without distortion; the
/// lowest end stays.. No
/// image ever costs more than before.
void resect(const Sights& sights, const FreeImages& free, const ScaledLoss& loss,
            const std::function<bool()>& cancelled, Threads& threads, Estimate& state);

}  // namespace sheaf
