// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/columns.h"

namespace sheaf {

Columns number_columns(const Problem& problem, const Fixed& fixed) {
  return number_columns(problem, fixed, held_parameters(problem, fixed));
}

Columns number_columns(const Problem& problem, const Fixed& fixed,
                       const std::vector<ParameterSet>& held) {
  std::vector<char> pose_held(problem.num_images(), fixed.poses);
  for (std::uint32_t i : fixed.pose_ids) pose_held[i] = true;

  Columns out;
  out.of_image.assign(9 * problem.num_images(), Columns::kFixed);
  std::vector<std::int32_t> lens(3 * problem.cameras.size(), Columns::kFixed);
  std::vector<char> lens_numbered(problem.cameras.size(), false);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    std::int32_t* columns = &out.of_image[9 * i];
    if (!pose_held[i])
      for (int k = 0; k < 6; ++k) columns[k] = out.count++;
    const std::uint32_t camera = problem.image_camera[i];
    std::int32_t* parameters = &lens[3 * std::size_t(camera)];
    if (!lens_numbered[camera])
      for (int k = 0; k < 3; ++k)
        if ((held[camera] >> k & 1) == 0) parameters[k] = out.count++;
    for (int k = 0; k < 3; ++k) {
      columns[6 + k] = parameters[k];
      out.lens_shared = out.lens_shared || (lens_numbered[camera] && parameters[k] >= 0);
    }
    lens_numbered[camera] = true;
  }
  return out;
}

}  // namespace sheaf
