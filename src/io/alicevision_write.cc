// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "geometry/rotation.h"
#include "io/alicevision.h"
#include "io/brown_lens.h"
#include "io/colmap_form.h"
#include "io/file_numbers.h"
#include "io/json_text.h"
#include "io/line_cursor.h"
#include "io/view_model.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// Of a full frame, as AliceVision supposes where nothing else is known.
constexpr double kSensorWidth_mm = 36, kSensorHeight_mm = 24;

/// AliceVision's numbers are texts.
void number(const char* name, double value, JsonText& out) {
  char buffer[40];
  out.key(name);
  out.put(std::string_view(
      buffer,
      static_cast<std::size_t>(std::to_chars(buffer, buffer + sizeof buffer, value).ptr - buffer)));
}
void number(const char* name, std::uint64_t value, JsonText& out) {
  out.member(name, std::string_view(std::to_string(value)));
}
template <class Numbers>
void numbers(const char* name, const Numbers& values, JsonText& out) {
  out.key(name);
  if (values.empty()) return out.put(std::string_view());
  out.open('[');
  for (const auto x : values) {
    char buffer[40];
    const char* const end = std::to_chars(buffer, buffer + sizeof buffer, x).ptr;
    out.put(std::string_view(buffer, static_cast<std::size_t>(end - buffer)));
  }
  out.close(']');
}

struct Intrinsics {
  const char* type = "pinhole";
  BrownLens lens;
  std::vector<double> distortion;
};

constexpr const char* kNoFocals = "its focal lengths, or their ratio, are not above 0 and finite";

/// Both above 0, and so what is stated of them.
bool has_focals(const BrownLens& lens) {
  const auto is_stated = [](double x) { return x > 0 && std::isfinite(kSensorWidth_mm * x); };
  return is_stated(lens.fx) && is_stated(lens.fy) && is_stated(lens.fy / lens.fx);
}

Result<Intrinsics> intrinsics_of(std::size_t c, const Camera& camera) {
  const auto refuse = [&](const std::string& why) {
    return Error(ErrorCode::usage,
                 "camera " + std::to_string(c) + ": AliceVision cannot state it: " + why);
  };
  if (camera.width_px == 0 || camera.height_px == 0)
    return refuse("its images' size is not known, which focal lengths count by");
  const auto& k = camera.parameters;
  Intrinsics out;
  if (camera.model == CameraModel::opencv_fisheye || camera.model == CameraModel::fov) {
    out.lens = {k[0], k[1], k[2], k[3], {}, {}};
    if (!has_focals(out.lens)) return refuse(kNoFocals);
    const bool fov = camera.model == CameraModel::fov;
    out.type = fov ? "fisheye1" : "fisheye4";
    out.distortion.assign(k.begin() + 4, k.begin() + (fov ? 5 : 8));
    return out;
  }
  const Result<BrownLens> lens = brown_lens(camera);
  if (!lens.ok()) return refuse(lens.error().what());
  out.lens = lens.value();
  if (!has_focals(out.lens)) return refuse(kNoFocals);
  const auto& [fx, fy, cx, cy, radial, tangential] = out.lens;
  if (out.lens.tangential()) {
    out.type = "brown";
    out.distortion = {radial[0], radial[1], radial[2], tangential[0], tangential[1]};
  } else if (out.lens.radial_terms() > 1 || camera.model == CameraModel::radial ||
             camera.model == CameraModel::radial_k3 || camera.model == CameraModel::full_opencv ||
             camera.model == CameraModel::opencv) {
    out.type = "radial3";
    out.distortion.assign(radial.begin(), radial.end());
  } else if (camera.model == CameraModel::simple_radial) {
    out.type = "radial1";
    out.distortion = {radial[0]};
  }
  return out;
}

void put_intrinsics(std::uint32_t id, const Camera& camera, const Intrinsics& in,
                    const std::string& members, JsonText& out) {
  const auto width = static_cast<double>(camera.width_px);
  const auto height = static_cast<double>(camera.height_px);
  const double f = stated_for(in.lens.fx, in.lens.fx * kSensorWidth_mm / width,
                              [&](double mm) { return mm / kSensorWidth_mm * width; });
  const double ratio =
      in.lens.fx == in.lens.fy ? 1 : stated_for(in.lens.fy, in.lens.fy / in.lens.fx, [&](double r) {
        return f / kSensorWidth_mm * width * r;
      });
  const auto offset = [](double centre, double size) {
    return stated_for(centre, centre - size / 2, [=](double x) { return x + size / 2; });
  };
  out.open('{');
  number("intrinsicId", std::uint64_t{id}, out);
  number("width", camera.width_px, out);
  number("height", camera.height_px, out);
  number("sensorWidth", kSensorWidth_mm, out);
  number("sensorHeight", kSensorHeight_mm, out);
  out.member("type", std::string_view(in.type));
  number("focalLength", f, out);
  number("pixelRatio", ratio, out);
  numbers("principalPoint", std::array{offset(in.lens.cx, width), offset(in.lens.cy, height)}, out);
  numbers("distortionParams", in.distortion, out);
  numbers("undistortionOffset", std::array{0, 0}, out);
  numbers("undistortionParams", std::vector<double>(), out);
  if (members.empty()) {
    out.member("serialNumber", std::string_view());
    out.member("initializationMode", std::string_view("estimated"));
    number("initialFocalLength", -1.0, out);
    out.member("pixelRatioLocked", std::string_view(ratio == 1 ? "true" : "false"));
    out.member("distortionInitializationMode", std::string_view("none"));
    out.member("locked", std::string_view("false"));
  }
  out.put_raw(members);
  out.close('}');
}

void put_views(const ColmapForm& form, const std::vector<std::uint32_t>& poses,
               const SourceFiles* source, JsonText& out) {
  const Problem& problem = *form.problem;
  const bool known = source != nullptr && source->image_members.size() == problem.num_images();
  out.key("views");
  out.open('[');
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Camera& camera = problem.cameras[problem.image_camera[j]];
    out.open('{');
    number("viewId", std::uint64_t{form.image_ids[j]}, out);
    number("poseId", std::uint64_t{poses[j]}, out);
    number("intrinsicId", std::uint64_t{form.camera_ids[problem.image_camera[j]]}, out);
    out.member("path", std::string_view(form.names[j]));
    number("width", camera.width_px, out);
    number("height", camera.height_px, out);
    out.put_raw(known ? source->image_members[j] : "\"metadata\": \"\"");
    out.close('}');
  }
  if (source != nullptr)
    for (const auto& [id, members] : source->unplaced_views) out.put_raw("{" + members + "}");
  out.close(']');
}

void put_poses(const Problem& problem, const std::vector<std::uint32_t>& ids, bool as_read,
               const SourceFiles* source, JsonText& out) {
  out.key("poses");
  out.open('[');
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
    if (const double* stated = as_read ? stated_numbers(problem, j, 9) : nullptr)
      std::copy_n(stated, 9, R.begin());
    out.open('{');
    number("poseId", std::uint64_t{ids[j]}, out);
    out.key("pose");
    out.open('{');
    out.key("transform");
    out.open('{');
    numbers("rotation", std::array{R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]}, out);
    numbers("center", centre_of(problem, j, source ? &source->centres : nullptr), out);
    out.close('}');
    out.member("locked", std::string_view("0"));
    out.close('}');
    out.close('}');
  }
  out.close(']');
}

void put_structure(const ColmapForm& form, const SourceFiles* source, JsonText& out) {
  const Problem& problem = *form.problem;
  const SceneMetadata* m = problem.metadata.get();
  const bool keys = m != nullptr && !m->observation_feature.empty();
  const bool scales =
      source != nullptr && source->feature_scales.size() == problem.num_observations();
  const std::vector<std::uint64_t> ids =
      numbers_of(form.point_ids, problem.num_points(), ViewModel::kNone - 1);
  out.key("structure");
  out.open('[');
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    out.open('{');
    number("landmarkId", ids[p], out);
    out.member("descType", std::string_view("sift"));
    std::array<unsigned, 3> colour;
    std::copy_n(form.colours[p].begin(), 3, colour.begin());
    numbers("color", colour, out);
    const double* X = &problem.points[3 * p];
    numbers("X", std::array{X[0], X[1], X[2]}, out);
    out.key("observations");
    out.open('[');
    for (std::uint64_t k = form.features.track[p]; k < form.features.track[p + 1]; ++k) {
      const std::uint64_t i = form.features.order[k];
      out.open('{');
      number("observationId", std::uint64_t{form.image_ids[problem.observation_image[i]]}, out);
      number("featureId",
             std::uint64_t{keys ? m->observation_feature[i] : form.features.of_observation[i]},
             out);
      numbers("x", std::array{problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]},
              out);
      number("scale", scales ? source->feature_scales[i] : 0.0, out);
      out.close('}');
    }
    out.close(']');
    out.close('}');
  }
  out.close(']');
}

}  // namespace

Result<FormatOutput> format_alicevision(const Problem& given) {
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  const SourceFiles* source =
      given.metadata && given.metadata->source && given.metadata->source->format == "alicevision"
          ? given.metadata->source.get()
          : nullptr;
  const ColmapForm form = colmap_form(problem, "alicevision");
  if (Result<void> good = check_json_names(problem); !good.ok()) return good.error();
  if (Result<void> good = check_centres(problem); !good.ok()) return good.error();
  const std::vector<std::uint32_t> poses = pose_ids_of(source, form.image_ids);
  JsonText out;
  out.open('{');
  numbers("version", std::array{1, 2, 6}, out);
  if (source != nullptr) out.put_raw(source->root_members);
  put_views(form, poses, source, out);
  out.key("intrinsics");
  out.open('[');
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const Result<Intrinsics> in = intrinsics_of(c, problem.cameras[c]);
    if (!in.ok()) return in.error();
    const bool known = source != nullptr && source->camera_members.size() == problem.cameras.size();
    put_intrinsics(form.camera_ids[c], problem.cameras[c], in.value(),
                   known ? source->camera_members[c] : "", out);
  }
  out.close(']');
  put_poses(problem, poses, is_as_read(given, "alicevision"), source, out);
  put_structure(form, source, out);
  out.close('}');
  return FormatOutput{out.take()};
}

}  // namespace sheaf
