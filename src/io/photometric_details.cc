// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/direct_folder.h"
#include "sheaf/io.h"

namespace sheaf {

Result<void> write_details(const PhotometricDetails& details, std::size_t points,
                           OutputFolder& out) {
  const auto put_images = [&](TextBuffer& text) {
    auto sight = details.seen.begin();
    for (std::size_t i = 0; i < points; ++i) {
      const auto seen = [&] { return sight != details.seen.end() && sight->point == i; };
      if (!seen()) text.end_line();
      while (seen()) {
        const std::uint32_t image = sight++->image;
        text.put(image, seen() ? ' ' : '\n');
      }
    }
  };
  if (auto r = write_text_file(out, "visibility.txt", put_images); !r.ok()) return r;
  const std::size_t each = details.of_inverse_depth ? 1 : 3;
  return write_text_file(out, "sigma.txt", [&](TextBuffer& text) {
    for (std::size_t k = 0; k < details.sigma.size(); ++k)
      text.put(details.sigma[k], (k + 1) % each == 0 ? '\n' : ' ');
  });
}

Result<void> write_photometric_details(const PhotometricDetails& details, std::size_t points,
                                       const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return unwritable(path, "it is no folder");
  Result<OutputFolder> out = OutputFolder::create(path);
  if (!out.ok()) return out.error();
  if (auto r = write_details(details, points, out.value()); !r.ok()) return r;
  return out.value().commit();
}

}  // namespace sheaf
