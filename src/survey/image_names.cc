// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/image_names.h"

#include "platform/unicode.h"

namespace sheaf {
namespace {

std::string last_part(const std::string& name) { return name.substr(name.find_last_of('/') + 1); }

}  // namespace

std::string image_name(const SceneMetadata* metadata, std::uint32_t image) {
  if (metadata == nullptr || metadata->image_names.empty()) return std::to_string(image);
  return metadata->image_names[image];
}

ImageNames::ImageNames(const Problem& problem) {
  for (std::uint32_t j = 0; j < problem.num_images(); ++j) {
    const std::string name = comparable_name(image_name(problem.metadata.get(), j));
    whole_.emplace(name, j);
    if (const auto [at, is_new] = last_.try_emplace(last_part(name), j); !is_new)
      at->second = Survey::kNone;
  }
}

std::uint32_t ImageNames::find(const std::string& stated) const {
  const std::string name = comparable_name(stated);
  if (const auto whole = whole_.find(name); whole != whole_.end()) return whole->second;
  const auto last = last_.find(last_part(name));
  return last == last_.end() ? Survey::kNone : last->second;
}

}  // namespace sheaf
