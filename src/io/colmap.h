// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/output_folder.h"
#include "io/source_files.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A COLMAP model is a folder of files: cameras, images and points3D, and in newer ones rigs and
/// frames; all binary (.bin) or all text (.txt). docs/formats.md has their layout.
struct ColmapFiles {
  bool text = false;
  std::string folder;  ///< for messages; the names of the files follow it
  std::string cameras, images, points;
  std::string rigs, frames;  ///< empty: the model has none
  std::uint64_t bytes = 0;   ///< of them all

  std::string name(const char* stem) const { return folder + stem + (text ? ".txt" : ".bin"); }
};

/// Reads the files of a folder whole; the binary ones where it has both. Errors: unreadable_input.
Result<ColmapFiles> load_colmap(const std::filesystem::path& folder);

/// Lossless: what the problem's arrays have no place for is in its metadata. Errors:
/// unreadable_input, with file and line or byte, for what is truncated, absurd or inconsistent
/// (ids that occur twice or nowhere, tracks and features that disagree).
Result<Problem> parse_colmap(const ColmapFiles& files);

/// What a folder will hold; the files that nothing changed are, byte for byte, those that were
/// read, where the form (binary or text) is the same. A problem with rigs has rigs and frames, each
/// image in one; those of a model whose frames are all trivial follow their images. Errors: usage,
/// for a problem that the form cannot hold.
Result<ColmapFiles> format_colmap(const Problem& problem, bool text);

/// Puts them into a folder of outputs. Refuses a folder with files of a model that these would not
/// replace: the two together would be misread.
Result<void> put_colmap(const ColmapFiles& files, OutputFolder& out);
/// The same of a problem. Errors: usage, for one that is not valid or that the form cannot hold.
Result<void> put_model(const Problem& problem, bool text, OutputFolder& out);

}  // namespace sheaf
