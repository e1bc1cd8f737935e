// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include "geometry/camera_model.h"
#include "io/colmap_form.h"
#include "io/colmap_restate.h"

namespace sheaf {
namespace {

std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

template <class Numbers>
bool same(const Numbers& a, const Numbers& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (bits(a[i]) != bits(b[i])) return false;
  return true;
}

}  // namespace

std::string cameras_text(const ColmapForm& form, const std::string& source,
                         const ColmapForm* before) {
  const auto& cameras = form.problem->cameras;
  RecordLines lines{"# id, model, width, height, parameters\n", cameras.size()};
  lines.format = [&](std::size_t c, int, std::string& out) {
    put_field(out, std::uint64_t{form.camera_ids[c]});
    out.append(to_string(cameras[c].model)) += ' ';
    put_field(out, cameras[c].width_px);
    put_field(out, cameras[c].height_px);
    for (std::size_t k = 0; k < parameter_count(cameras[c].model); ++k)
      put_field(out, cameras[c].parameters[k]);
    end_line(out);
  };
  if (before == nullptr) return state(lines);
  lines.same = [&](std::size_t c, std::size_t were, int) {
    const Camera &now = cameras[c], &then = before->problem->cameras[were];
    return now.model == then.model && now.width_px == then.width_px &&
           now.height_px == then.height_px && same(now.parameters, then.parameters);
  };
  return restate(lines, source, numbers_now(before->camera_ids, form.camera_ids));
}

std::string images_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before) {
  const Problem& problem = *form.problem;
  const FeatureTable& features = form.features;
  RecordLines lines{
      "# id, qw qx qy qz, tx ty tz (camera from world), camera id, name\n# features: x, y, point "
      "id or -1\n",
      problem.num_images(), 2};
  lines.format = [&](std::size_t j, int line, std::string& out) {
    if (line == 0) {
      put_field(out, std::uint64_t{form.image_ids[j]});
      for (const double x : form.poses[j]) put_field(out, x);
      put_field(out, std::uint64_t{form.camera_ids[problem.image_camera[j]]});
      out += form.names[j];
    } else {
      for (std::uint64_t k = features.begin[j]; k < features.begin[j + 1]; ++k) {
        put_field(out, features.xy[2 * k]);
        put_field(out, features.xy[2 * k + 1]);
        if (features.point[k] == ColmapDraft::kNoPoint) {
          out += "-1 ";
        } else {
          put_field(out, features.point[k]);
        }
      }
    }
    end_line(out);
  };
  if (before == nullptr) return state(lines);
  lines.same = [&](std::size_t j, std::size_t were, int line) {
    if (line == 0)
      return form.camera_ids[problem.image_camera[j]] ==
                 before->camera_ids[before->problem->image_camera[were]] &&
             form.names[j] == before->names[were] && same(form.poses[j], before->poses[were]);
    const FeatureTable& then = before->features;
    const std::uint64_t begin = features.begin[j], begun = then.begin[were];
    const std::uint64_t count = features.begin[j + 1] - begin;
    if (then.begin[were + 1] - begun != count) return false;
    for (std::uint64_t k = 0; k < count; ++k)
      if (bits(features.xy[2 * (begin + k)]) != bits(then.xy[2 * (begun + k)]) ||
          bits(features.xy[2 * (begin + k) + 1]) != bits(then.xy[2 * (begun + k) + 1]) ||
          features.point[begin + k] != then.point[begun + k])
        return false;
    return true;
  };
  return restate(lines, source, numbers_now(before->image_ids, form.image_ids));
}

std::string points_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before) {
  const Problem& problem = *form.problem;
  const auto track = [](const ColmapForm& f, std::size_t p, auto&& use) {
    for (std::uint64_t k = f.features.track[p]; k < f.features.track[p + 1]; ++k) {
      const std::uint64_t i = f.features.order[k];
      use(f.image_ids[f.problem->observation_image[i]], f.features.of_observation[i]);
    }
  };
  RecordLines lines{"# id, x y z, r g b, mean error (px), track: image id, number of the feature\n",
                    problem.num_points()};
  lines.format = [&](std::size_t p, int, std::string& out) {
    put_field(out, form.point_ids[p]);
    for (std::size_t k = 0; k < 3; ++k) put_field(out, problem.points[3 * p + k]);
    for (const std::uint8_t c : form.colours[p]) put_field(out, std::uint64_t{c});
    put_field(out, form.errors_px[p]);
    track(form, p, [&](std::uint32_t image, std::uint32_t feature) {
      put_field(out, std::uint64_t{image});
      put_field(out, std::uint64_t{feature});
    });
    end_line(out);
  };
  if (before == nullptr) return state(lines);
  const auto elements = [&](const ColmapForm& f, std::size_t p) {
    std::vector<std::array<std::uint32_t, 2>> list;
    track(f, p, [&](std::uint32_t image, std::uint32_t feature) {
      list.push_back({image, feature});
    });
    return list;
  };
  lines.same = [&](std::size_t p, std::size_t were, int) {
    for (std::size_t k = 0; k < 3; ++k)
      if (bits(problem.points[3 * p + k]) != bits(before->problem->points[3 * were + k]))
        return false;
    return bits(form.errors_px[p]) == bits(before->errors_px[were]) &&
           form.colours[p] == before->colours[were] && elements(form, p) == elements(*before, were);
  };
  return restate(lines, source, numbers_now(before->point_ids, form.point_ids));
}

}  // namespace sheaf
