// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "geometry/rotation.h"
#include "io/brown_lens.h"
#include "io/colmap_form.h"
#include "io/json_text.h"
#include "io/line_cursor.h"
#include "io/opensfm.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// What OpenSfM takes for a feature's scale where none is known: it weighs residuals by it.
constexpr double kScale = 0.004;

Error refuse(std::size_t camera, const std::string& why) {
  return Error(ErrorCode::usage,
               "camera " + std::to_string(camera) + ": OpenSfM cannot state it: " + why);
}

double side_of(const Camera& camera) {
  return static_cast<double>(std::max(camera.width_px, camera.height_px));
}
double middle(std::uint64_t pixels) { return static_cast<double>(pixels) / 2; }

void put_lens(const char* type, const Camera& camera, const BrownLens& lens, bool centred,
              std::initializer_list<std::pair<const char*, double>> coefficients, JsonText& out) {
  const double side = side_of(camera);
  out.member("projection_type", std::string_view(type));
  out.member("width", camera.width_px);
  out.member("height", camera.height_px);
  if (centred) {
    out.member("focal", lens.fx / side);
  } else {
    out.member("focal_x", lens.fx / side);
    out.member("focal_y", lens.fy / side);
    out.member("c_x", (lens.cx - middle(camera.width_px)) / side);
    out.member("c_y", (lens.cy - middle(camera.height_px)) / side);
  }
  for (const auto& [name, value] : coefficients) out.member(name, value);
}

bool is_centred(const Camera& camera, const BrownLens& lens) {
  return lens.fx == lens.fy && lens.cx == middle(camera.width_px) &&
         lens.cy == middle(camera.height_px);
}

/// In the unit of the file, which is the images' longer side.
bool has_focals(const Camera& camera, const BrownLens& lens) {
  return lens.fx / side_of(camera) > 0 && lens.fy / side_of(camera) > 0;
}
constexpr const char* kNoFocals = "a focal length is not above 0";

Result<void> put_camera(std::size_t c, const Camera& camera, JsonText& out) {
  if (camera.width_px == 0 || camera.height_px == 0)
    return refuse(c, "its images' size is not known, which is its unit");
  const auto& k = camera.parameters;
  if (camera.model == CameraModel::equirectangular) {
    if (!is_whole_panorama(camera))
      return refuse(c, "its panoramas are twice as wide as high, and have their images' size");
    out.member("projection_type", std::string_view("spherical"));
    out.member("width", camera.width_px);
    out.member("height", camera.height_px);
    return {};
  }
  if (camera.model == CameraModel::radial_fisheye || camera.model == CameraModel::opencv_fisheye ||
      camera.model == CameraModel::simple_radial_fisheye) {
    const bool opencv = camera.model == CameraModel::opencv_fisheye;
    BrownLens lens;
    lens.fx = k[0], lens.fy = opencv ? k[1] : k[0];
    lens.cx = k[opencv ? 2 : 1], lens.cy = k[opencv ? 3 : 2];
    if (!has_focals(camera, lens)) return refuse(c, kNoFocals);
    const std::size_t first = opencv ? 4 : 3;
    if (!opencv && is_centred(camera, lens)) {
      put_lens("fisheye", camera, lens, true, {{"k1", k[3]}, {"k2", k[4]}}, out);
    } else {
      put_lens("fisheye_opencv", camera, lens, false,
               {{"k1", k[first]},
                {"k2", k[first + 1]},
                {"k3", opencv ? k[6] : 0},
                {"k4", opencv ? k[7] : 0}},
               out);
    }
    return {};
  }
  const Result<BrownLens> lens = brown_lens(camera);
  if (!lens.ok()) return refuse(c, lens.error().what());
  const BrownLens& l = lens.value();
  if (!has_focals(camera, l)) return refuse(c, kNoFocals);
  if (is_centred(camera, l) && l.radial_terms() < 3 && !l.tangential()) {
    put_lens("perspective", camera, l, true, {{"k1", l.k[0]}, {"k2", l.k[1]}}, out);
  } else {
    put_lens("brown", camera, l, false,
             {{"k1", l.k[0]}, {"k2", l.k[1]}, {"p1", l.p[0]}, {"p2", l.p[1]}, {"k3", l.k[2]}}, out);
  }
  return {};
}

std::vector<std::string> camera_names(const Problem& problem, const SourceFiles* source) {
  if (source != nullptr && source->camera_names.size() == problem.cameras.size())
    return source->camera_names;
  std::vector<std::string> out;
  const SceneMetadata* m = problem.metadata.get();
  for (std::size_t c = 0; c < problem.cameras.size(); ++c)
    out.push_back("camera " + std::to_string(m && !m->camera_ids.empty() ? m->camera_ids[c] : c));
  return out;
}

void put_shot(const ColmapForm& form, std::size_t j, const std::string& camera,
              const std::string& members, JsonText& out) {
  const Problem& problem = *form.problem;
  out.key(form.names[j]);
  out.open('{');
  const auto stated = stated_rotation(problem, j);
  out.list_member("rotation",
                  stated ? *stated : angle_axis_from_quaternion(problem.poses[j].rotation));
  out.list_member("translation", problem.poses[j].translation);
  out.member("camera", std::string_view(camera));
  out.put_raw(members);
  out.close('}');
}

void put_points(const ColmapForm& form, JsonText& out) {
  out.key("points");
  out.open('{');
  for (std::size_t p = 0; p < form.point_ids.size(); ++p) {
    const double* X = &form.problem->points[3 * p];
    out.key(std::to_string(form.point_ids[p]));
    out.open('{');
    std::array<unsigned, 3> colour;
    std::copy_n(form.colours[p].begin(), 3, colour.begin());
    out.list_member("color", colour);
    out.list_member("coordinates", std::array{X[0], X[1], X[2]});
    out.close('}');
  }
  out.close('}');
}

template <class Number>
void put(std::string& out, Number value) {
  char buffer[40];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr) += '\t';
}

std::string tracks_text(const ColmapForm& form, const SourceFiles* source, bool as_read) {
  const Problem& problem = *form.problem;
  std::string out = "OPENSFM_TRACKS_VERSION_v2\n";
  const bool scales =
      source != nullptr && source->feature_scales.size() == problem.num_observations();
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i], point = problem.observation_point[i];
    const Camera& camera = problem.cameras[problem.image_camera[image]];
    out.append(form.names[image]) += '\t';
    put(out, form.point_ids[point]);
    put(out, form.features.of_observation[i]);
    const std::array<std::uint64_t, 2> size{camera.width_px, camera.height_px};
    for (std::size_t k = 0; k < 2; ++k)
      put(out, as_read ? source->normalised_xy[2 * i + k]
                       : (problem.observation_xy[2 * i + k] - middle(size[k])) / side_of(camera));
    put(out, scales && source->feature_scales[i] != 0 ? source->feature_scales[i] : kScale);
    for (const std::uint8_t c : form.colours[point]) put(out, unsigned{c});
    out += "-1\t-1\n";
  }
  return out;
}

Result<void> check_names(const ColmapForm& form) {
  for (const std::string& name : form.names)
    if (name.empty() || name.find_first_of(std::string_view("\t\r\n\0", 4)) != name.npos)
      return Error(ErrorCode::usage, "the image name " + sheaf::quoted(name) +
                                         " is empty or holds a tab, a zero byte or a line's end, "
                                         "which tracks.csv cannot state");
  std::vector<std::string> names = form.names;
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  if (twice == names.end()) return {};
  return Error(ErrorCode::usage, "two images are called " + sheaf::quoted(*twice) +
                                     "; OpenSfM tells images by their names");
}

}  // namespace

Result<FormatOutput> format_opensfm(const Problem& given) {
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  const bool as_read = is_as_read(given, "opensfm");
  const SourceFiles* source =
      given.metadata && given.metadata->source && given.metadata->source->format == "opensfm"
          ? given.metadata->source.get()
          : nullptr;
  const ColmapForm form = colmap_form(problem, "opensfm");
  if (Result<void> good = check_json_names(problem); !good.ok()) return good.error();
  if (Result<void> good = check_names(form); !good.ok()) return good.error();
  const std::vector<std::string> cameras = camera_names(problem, source);
  const auto members = [&](const std::vector<std::string>* all, std::size_t i, std::size_t count) {
    return source != nullptr && all->size() == count ? (*all)[i] : std::string();
  };
  JsonText out;
  out.open('[');
  out.open('{');
  out.key("cameras");
  out.open('{');
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    out.key(cameras[c]);
    out.open('{');
    if (Result<void> done = put_camera(c, problem.cameras[c], out); !done.ok()) return done.error();
    out.put_raw(members(source ? &source->camera_members : nullptr, c, cameras.size()));
    out.close('}');
  }
  out.close('}');
  out.key("shots");
  out.open('{');
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    put_shot(form, j, cameras[problem.image_camera[j]],
             members(source ? &source->image_members : nullptr, j, problem.num_images()), out);
  out.close('}');
  put_points(form, out);
  if (source != nullptr) out.put_raw(source->root_members);
  out.close('}');
  out.close(']');
  return FormatOutput{out.take(), {{"tracks.csv", tracks_text(form, source, as_read)}}};
}

}  // namespace sheaf
