// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "sheaf/problem.h"
#include "sheaf/survey.h"

namespace sheaf {

/// The images of a problem by name (where they have none, by index), or by what stands behind the
/// last slash of a name, where that is of one image alone.
class ImageNames {
 public:
  explicit ImageNames(const Problem& problem);
  /// Survey::kNone where there is no such image.
  std::uint32_t find(const std::string& name) const;

 private:
  std::map<std::string, std::uint32_t> whole_, last_;
};

/// The name of an image, as above.
std::string image_name(const SceneMetadata* metadata, std::uint32_t image);

}  // namespace sheaf
