// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/folder_files.h"
#include "sheaf/io.h"

namespace sheaf {

Result<void> write_photometric_details(const PhotometricDetails& details, std::size_t points,
                                       const std::filesystem::path& path) {
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
  if (auto r = write_text_file(path / "visibility.txt", put_images); !r.ok()) return r;
  const std::size_t each = details.of_inverse_depth ? 1 : 3;
  return write_text_file(path / "sigma.txt", [&](TextBuffer& text) {
    for (std::size_t k = 0; k < details.sigma.size(); ++k)
      text.put(details.sigma[k], (k + 1) % each == 0 ? '\n' : ' ');
  });
}

}  // namespace sheaf
