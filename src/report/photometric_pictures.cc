// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/photometric_pictures.h"

#include <algorithm>

#include "image/png.h"
#include "io/folder_files.h"
#include "report/patch_sheet.h"
#include "report/residual_map.h"

namespace sheaf {
namespace {

constexpr std::size_t kRows = 6;

Result<void> write_png(const Image& image, OutputFolder& folder, const std::string& name) {
  const Result<std::string> bytes = encode_png(image);
  if (!bytes.ok()) return bytes.error();
  return write_bytes(folder, name, bytes.value());
}

}  // namespace

Result<std::vector<std::string>> write_pictures(const PatchComparison& comparison,
                                                const std::vector<GreyImage>& images,
                                                const std::filesystem::path& path) {
  Result<OutputFolder> folder = OutputFolder::create(path);
  if (!folder.ok()) return folder.error();
  std::vector<std::string> names;
  const auto put = [&](const Image& image, const std::string& name) {
    names.push_back(name);
    return write_png(image, folder.value(), name);
  };
  const std::vector<PatchFit> fits = rank_patches(comparison);
  const std::size_t rows = std::min(kRows, fits.size());
  const auto take = [&](std::size_t first) {
    const auto from = fits.begin() + static_cast<std::ptrdiff_t>(first);
    return std::vector<PatchFit>(from, from + static_cast<std::ptrdiff_t>(rows));
  };
  const Image worst =
      draw_patch_sheet(comparison, take(0), "The patches that fit worst after refinement").image;
  if (auto done = put(worst, "worst-patches.png"); !done.ok()) return done.error();
  const Image median = draw_patch_sheet(comparison, take((fits.size() - rows) / 2),
                                        "Patches in the middle: half fit better, half worse")
                           .image;
  if (auto done = put(median, "median-patches.png"); !done.ok()) return done.error();
  const double scale = rms_scale(comparison);
  for (std::uint32_t j = 0; j < images.size(); ++j) {
    const Image map = draw_residual_map(comparison, images[j], j, scale).image;
    if (auto done = put(map, "residuals-" + std::to_string(j) + ".png"); !done.ok())
      return done.error();
  }
  if (auto done = folder.value().commit(); !done.ok()) return done.error();
  return names;
}

}  // namespace sheaf
