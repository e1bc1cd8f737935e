// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/photometric_pictures.h"

#include <algorithm>

#include "io/folder_files.h"
#include "report/patch_sheet.h"
#include "report/residual_map.h"

namespace sheaf {
namespace {

constexpr std::size_t kRows = 6;

}  // namespace

Result<std::vector<std::string>> write_pictures(const PatchComparison& comparison,
                                                const std::vector<GreyImage>& images,
                                                const std::filesystem::path& path) {
  Result<OutputFolder> folder = OutputFolder::create(path);
  if (!folder.ok()) return folder.error();
  std::vector<std::string> names;
  const auto put = [&](const auto& drawn, const std::string& name) -> Result<void> {
    if (!drawn.ok()) return drawn.error();
    names.push_back(name);
    return write_bytes(folder.value(), name, drawn.value().svg);
  };
  const std::vector<PatchFit> fits = rank_patches(comparison);
  const std::size_t rows = std::min(kRows, fits.size());
  const auto take = [&](std::size_t first) {
    const auto from = fits.begin() + static_cast<std::ptrdiff_t>(first);
    return std::vector<PatchFit>(from, from + static_cast<std::ptrdiff_t>(rows));
  };
  if (auto done =
          put(draw_patch_sheet(comparison, take(0), "The patches that fit worst after refinement"),
              "worst-patches.svg");
      !done.ok())
    return done.error();
  if (auto done = put(draw_patch_sheet(comparison, take((fits.size() - rows) / 2),
                                       "Patches in the middle: half fit better, half worse"),
                      "median-patches.svg");
      !done.ok())
    return done.error();
  const double scale = rms_scale(comparison);
  for (std::uint32_t j = 0; j < images.size(); ++j)
    if (auto done = put(draw_residual_map(comparison, images[j], j, scale),
                        "residuals-" + std::to_string(j) + ".svg");
        !done.ok())
      return done.error();
  if (auto done = folder.value().commit(); !done.ok()) return done.error();
  return names;
}

}  // namespace sheaf
