// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "page/page_scene.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// Small grey JPEG images, base64, by the number of their image.
using Thumbnails = std::map<std::uint32_t, std::string>;

/// Of the images that are found under their names in a folder or, where names are paths, under
/// their last part: the worst dozen larger than the others. Images that are not there or cannot be
/// read are left out.
Thumbnails thumbnails(const PageScene& scene, const Problem& named,
                      const std::filesystem::path& folder, int threads);

/// An image that is in memory, likewise.
std::string grey_thumbnail(const GreyImage& grey);

}  // namespace sheaf
