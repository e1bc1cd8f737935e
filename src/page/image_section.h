// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "page/page_scene.h"
#include "page/thumbnails.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// By how much residuals of images are enlarged: 99 % of the vectors are shorter than 6 % of an
/// image's width.
double vector_scale(const PageScene& scene);

/// Images by their residuals, worst first: small multiples with vectors, and a table of all.
/// known: null where no covariances are.
std::string image_section(const PageScene& scene, const Thumbnails& thumbnails,
                          const Covariance* known);

/// What the margin says of them.
std::string image_words(const PageScene& scene);

/// Of each image the six that share most points with it, as an array of a script: [[image,
/// points] ...].
std::string neighbours_script(const PageScene& scene);

}  // namespace sheaf
