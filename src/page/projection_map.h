// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "page/page_scene.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// How far the pixel of a place that rests in the world moves as a lens and its images' poses vary,
/// over the image, one sigma. Nothing without `Covariance::lens_motions` and the image's size.
std::string projection_chart(const PageScene& scene, std::uint32_t lens, const std::string& name,
                             const Covariance& known);

/// Which parameters of a lens go together. Nothing where fewer than three are free.
std::string correlation_chart(const PageScene& scene, std::uint32_t lens, const std::string& name,
                              const Covariance& known);

}  // namespace sheaf
