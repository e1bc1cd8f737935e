// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/nerfstudio.h"

#include <array>
#include <charconv>

#include "geometry/rotation.h"
#include "io/brown_lens.h"
#include "io/colmap_form.h"
#include "io/json_text.h"
#include "io/view_model.h"
#include "scene/camera_frame.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

Result<void> put_lens(std::size_t c, const Camera& camera, JsonText& out) {
  const auto& k = camera.parameters;
  const bool fisheye = camera.model == CameraModel::opencv_fisheye;
  BrownLens lens;
  if (fisheye) {
    lens = {k[0], k[1], k[2], k[3], {}, {}};
  } else {
    const Result<BrownLens> found = brown_lens(camera);
    if (!found.ok())
      return Error(ErrorCode::usage, "camera " + std::to_string(c) +
                                         ": nerfstudio has no such lens: " + found.error().what());
    lens = found.value();
  }
  out.member("camera_model", std::string_view(fisheye ? "OPENCV_FISHEYE" : "OPENCV"));
  out.member("w", camera.width_px);
  out.member("h", camera.height_px);
  out.member("fl_x", lens.fx);
  out.member("fl_y", lens.fy);
  out.member("cx", lens.cx);
  out.member("cy", lens.cy);
  if (fisheye) {
    for (std::size_t i = 0; i < 4; ++i) out.member("k" + std::to_string(i + 1), k[4 + i]);
    return {};
  }
  for (std::size_t i = 0; i < lens.k.size(); ++i)
    out.member("k" + std::to_string(i + 1), lens.k[i]);
  out.member("p1", lens.p[0]);
  out.member("p2", lens.p[1]);
  return {};
}

/// R^T and the centre, with y and z of the camera turned round.
void put_pose(const Problem& problem, std::size_t j, JsonText& out) {
  const Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
  const std::array<double, 3> C = centre_of(problem, j, nullptr);
  out.key("transform_matrix");
  out.open('[');
  for (std::size_t r = 0; r < 3; ++r) out.list(std::array{R[r], -R[3 + r], -R[6 + r], C[r]});
  out.list(std::array{0, 0, 0, 1});
  out.close(']');
}

std::string points_text(const ColmapForm& form) {
  const Problem& problem = *form.problem;
  std::string out =
      "ply\nformat ascii 1.0\nelement vertex " + std::to_string(problem.num_points()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uint8 red\nproperty uint8 "
      "green\nproperty uint8 blue\nend_header\n";
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    for (std::size_t k = 0; k < 3; ++k) {
      char buffer[40];
      const auto x = static_cast<float>(problem.points[3 * p + k]);
      out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr) += ' ';
    }
    for (std::size_t k = 0; k < 3; ++k)
      out.append(std::to_string(form.colours[p][k])) += k == 2 ? '\n' : ' ';
  }
  return out;
}

}  // namespace

Result<FormatOutput> format_nerfstudio(const Problem& given) {
  constexpr const char* kPoints = "sparse_pc.ply";
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  const ColmapForm form = colmap_form(problem, "nerfstudio");
  if (Result<void> good = check_json_names(problem); !good.ok()) return good.error();
  if (Result<void> good = check_centres(problem); !good.ok()) return good.error();
  const bool one = problem.cameras.size() == 1;
  JsonText out;
  out.open('{');
  if (one)
    if (Result<void> done = put_lens(0, problem.cameras[0], out); !done.ok()) return done.error();
  out.key("frames");
  out.open('[');
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    out.open('{');
    out.member("file_path", "images/" + form.names[j]);
    if (!one) {
      const std::uint32_t c = problem.image_camera[j];
      if (Result<void> done = put_lens(c, problem.cameras[c], out); !done.ok()) return done.error();
    }
    put_pose(problem, j, out);
    out.close('}');
  }
  out.close(']');
  out.key("applied_transform");
  out.open('[');
  for (std::size_t r = 0; r < 3; ++r)
    out.list(std::array{int{r == 0}, int{r == 1}, int{r == 2}, 0});
  out.close(']');
  out.member("ply_file_path", std::string_view(kPoints));
  out.close('}');
  return FormatOutput{out.take(), {{kPoints, points_text(form)}}};
}

}  // namespace sheaf
