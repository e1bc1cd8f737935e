// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "io/folder_files.h"
#include "sheaf/error.h"
#include "sheaf/io.h"

namespace sheaf {

/// A photometric problem of a COLMAP model (`folder.model`) and its images. COLMAP's first pixel
/// has its centre at (0.5, 0.5), ours at (0, 0). A point's host is the image of its track that sees
/// it best: along the mean of the track's rays, at the median of its distances; it is seen by the
/// others of its track. Errors: usage for lenses that are no pinholes or not all the same;
/// unreadable_input for images that are missing or of another size.
Result<void> add_images(const FolderFiles& images, PhotometricFolder& folder);

/// The model with the problem's poses and points.
Problem model_with_state(const PhotometricFolder& folder);

}  // namespace sheaf
