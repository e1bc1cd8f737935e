// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>

#include "platform/parallel.h"
#include "starts/sights.h"

namespace sheaf {

/// Intersects every point anew with the cameras held: from where it is and from where the rays of
/// its observations meet best (the point nearest to all of them, their distances weighted by the
/// inverse of how far away it is), it descends by itself, and the lower end stays. A point never
/// costs more than before, and never goes behind a camera that saw it.
void intersect(const Sights& sights, const ScaledLoss& loss, const std::function<bool()>& cancelled,
               Threads& threads, Estimate& state);

}  // namespace sheaf
