// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "page/page_scene.h"

namespace sheaf {

/// Who sees what with whom: common points of images, lengths of tracks, angles at which rays meet,
/// patterns of the matrices. threads: 0 takes all; the text does not depend on it.
std::string structure_section(const PageScene& scene, int threads);

/// What the margin says of it.
std::string structure_words(const PageScene& scene);

}  // namespace sheaf
