// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "geometry/rotation.h"
#include "io/brown_lens.h"
#include "io/colmap_form.h"
#include "io/file_numbers.h"
#include "io/json_text.h"
#include "io/openmvg.h"
#include "io/view_model.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// What cereal adds to ids of pointers and types that occur first, and its type of what is no more
/// than its own.
constexpr std::uint64_t kFirst = 2147483648, kOwnType = 1073741824;

struct Intrinsics {
  std::string type;          ///< as "polymorphic_name" has it
  const char* coefficients;  ///< the member that holds them, or null
  double f = 1, cx = 0, cy = 0;
  std::vector<double> distortion;
};

Result<Intrinsics> intrinsics_of(std::size_t c, const Camera& camera) {
  const auto refuse = [&](const std::string& why) {
    return Error(ErrorCode::usage,
                 "camera " + std::to_string(c) + ": OpenMVG cannot state it: " + why);
  };
  const auto two_focals = [&] {
    return refuse("it has one focal length, and the " + std::string(to_string(camera.model)) +
                  " lens two, fx and fy (--fix f keeps equal ones equal)");
  };
  const auto& k = camera.parameters;
  if (camera.model == CameraModel::equirectangular) {
    if (!is_whole_panorama(camera))
      return refuse("its panoramas are twice as wide as high, and have the size of their images");
    return Intrinsics{"spherical", nullptr, 0, 0, 0, {}};
  }
  if (!(k[0] > 0)) return refuse("its focal length is not above 0");
  if (camera.model == CameraModel::opencv_fisheye) {
    if (k[0] != k[1]) return two_focals();
    return Intrinsics{"fisheye", "fisheye", k[0], k[2], k[3], {k.begin() + 4, k.begin() + 8}};
  }
  const Result<BrownLens> found = brown_lens(camera);
  if (!found.ok()) return refuse(found.error().what());
  const BrownLens& lens = found.value();
  if (lens.fx != lens.fy) return two_focals();
  Intrinsics out{"pinhole", nullptr, lens.fx, lens.cx, lens.cy, {}};
  if (lens.tangential()) {
    out.type = "pinhole_brown_t2", out.coefficients = "disto_t2";
    out.distortion = {lens.k[0], lens.k[1], lens.k[2], lens.p[0], lens.p[1]};
  } else if (camera.model == CameraModel::simple_radial) {
    out.type = "pinhole_radial_k1", out.coefficients = "disto_k1";
    out.distortion = {lens.k[0]};
  } else if (camera.model != CameraModel::simple_pinhole && camera.model != CameraModel::pinhole) {
    out.type = "pinhole_radial_k3", out.coefficients = "disto_k3";
    out.distortion.assign(lens.k.begin(), lens.k.end());
  }
  return out;
}

/// Numbers pointers and types as cereal does.
class Writer {
 public:
  JsonText out;

  void open_item(std::uint64_t key) {
    out.open('{');
    out.member("key", key);
    out.key("value");
    out.open('{');
  }
  void close_item() {
    out.close('}');
    out.close('}');
  }
  void open_pointer() {
    out.key("ptr_wrapper");
    out.open('{');
    out.member("id", kFirst + ++pointers_);
    out.key("data");
    out.open('{');
  }
  void close_pointer() {
    out.close('}');
    out.close('}');
  }
  void put_type(const std::string& name) {
    const auto [at, first] = types_.try_emplace(name, types_.size() + 1);
    out.member("polymorphic_id", at->second + (first ? kFirst : 0));
    if (first) out.member("polymorphic_name", std::string_view(name));
  }

 private:
  std::uint64_t pointers_ = 0;
  std::map<std::string, std::uint64_t> types_;
};

void put_view(const ColmapForm& form, std::size_t j, std::uint32_t pose, const std::string& members,
              Writer& writer) {
  const Problem& problem = *form.problem;
  const Camera& camera = problem.cameras[problem.image_camera[j]];
  JsonText& out = writer.out;
  const std::string& name = form.names[j];
  const std::size_t slash = name.find_last_of('/') + 1;
  writer.open_item(form.image_ids[j]);
  out.member("polymorphic_id", kOwnType);
  writer.open_pointer();
  out.member("local_path", std::string_view(name).substr(0, slash));
  out.member("filename", std::string_view(name).substr(slash));
  out.member("width", camera.width_px);
  out.member("height", camera.height_px);
  out.member("id_view", form.image_ids[j]);
  out.member("id_intrinsic", form.camera_ids[problem.image_camera[j]]);
  out.member("id_pose", pose);
  out.put_raw(members);
  writer.close_pointer();
  writer.close_item();
}

void put_intrinsics(std::uint32_t id, const Camera& camera, const Intrinsics& in, Writer& writer) {
  JsonText& out = writer.out;
  writer.open_item(id);
  writer.put_type(in.type);
  writer.open_pointer();
  const bool panorama = camera.model == CameraModel::equirectangular;
  if (panorama) out.key("value0"), out.open('{');
  out.member("width", camera.width_px);
  out.member("height", camera.height_px);
  if (panorama) {
    out.close('}');
  } else {
    out.member("focal_length", in.f);
    out.list_member("principal_point", std::array{in.cx, in.cy});
  }
  if (in.coefficients != nullptr) out.list_member(in.coefficients, in.distortion);
  writer.close_pointer();
  writer.close_item();
}

void put_pose(const Problem& problem, std::size_t j, std::uint32_t id, bool as_read,
              const SourceFiles* source, Writer& writer) {
  Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
  if (const double* stated = as_read ? stated_numbers(problem, j, 9) : nullptr)
    std::copy_n(stated, 9, R.begin());
  JsonText& out = writer.out;
  writer.open_item(id);
  out.key("rotation");
  out.open('[');
  for (std::size_t r = 0; r < 9; r += 3) out.list(std::array{R[r], R[r + 1], R[r + 2]});
  out.close(']');
  out.list_member("center", centre_of(problem, j, source ? &source->centres : nullptr));
  writer.close_item();
}

void put_structure(const ColmapForm& form, Writer& writer) {
  const Problem& problem = *form.problem;
  const SceneMetadata* m = problem.metadata.get();
  const bool keys = m != nullptr && !m->observation_feature.empty();
  const std::vector<std::uint64_t> ids =
      numbers_of(form.point_ids, problem.num_points(), ViewModel::kNone - 1);
  JsonText& out = writer.out;
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    const double* X = &problem.points[3 * p];
    writer.open_item(ids[p]);
    out.list_member("X", std::array{X[0], X[1], X[2]});
    out.key("observations");
    out.open('[');
    for (std::uint64_t k = form.features.track[p]; k < form.features.track[p + 1]; ++k) {
      const std::uint64_t i = form.features.order[k];
      writer.open_item(form.image_ids[problem.observation_image[i]]);
      out.member("id_feat", keys ? m->observation_feature[i] : form.features.of_observation[i]);
      out.list_member("x",
                      std::array{problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]});
      writer.close_item();
    }
    out.close(']');
    writer.close_item();
  }
}

template <class Put>
void put_list(const char* name, std::size_t count, Writer& writer, const Put& put) {
  writer.out.key(name);
  writer.out.open('[');
  for (std::size_t i = 0; i < count; ++i) put(i);
  writer.out.close(']');
}

}  // namespace

Result<FormatOutput> format_openmvg(const Problem& given) {
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  const SourceFiles* source =
      given.metadata && given.metadata->source && given.metadata->source->format == "openmvg"
          ? given.metadata->source.get()
          : nullptr;
  const ColmapForm form = colmap_form(problem, "openmvg");
  if (Result<void> good = check_json_names(problem); !good.ok()) return good.error();
  if (Result<void> good = check_centres(problem); !good.ok()) return good.error();
  std::vector<Intrinsics> intrinsics;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const Result<Intrinsics> in = intrinsics_of(c, problem.cameras[c]);
    if (!in.ok()) return in.error();
    intrinsics.push_back(in.value());
  }
  const std::size_t images = problem.num_images();
  const std::vector<std::uint32_t> poses = pose_ids_of(source, form.image_ids);
  const bool known = source != nullptr && source->image_members.size() == images;
  const bool as_read = is_as_read(given, "openmvg");
  Writer writer;
  writer.out.open('{');
  writer.out.member("sfm_data_version", std::string_view("0.3"));
  if (source == nullptr) writer.out.member("root_path", std::string_view());
  if (source != nullptr) writer.out.put_raw(source->root_members);
  const std::size_t unplaced = source != nullptr ? source->unplaced_views.size() : 0;
  put_list("views", images + unplaced, writer, [&](std::size_t j) {
    if (j < images)
      return put_view(form, j, poses[j], known ? source->image_members[j] : "", writer);
    const auto& [id, members] = source->unplaced_views[j - images];
    writer.open_item(id);
    writer.out.member("polymorphic_id", kOwnType);
    writer.open_pointer();
    writer.out.put_raw(members);
    writer.close_pointer();
    writer.close_item();
  });
  put_list("intrinsics", intrinsics.size(), writer, [&](std::size_t c) {
    put_intrinsics(form.camera_ids[c], problem.cameras[c], intrinsics[c], writer);
  });
  put_list("extrinsics", images, writer,
           [&](std::size_t j) { put_pose(problem, j, poses[j], as_read, source, writer); });
  writer.out.key("structure");
  writer.out.open('[');
  put_structure(form, writer);
  writer.out.close(']');
  if (source == nullptr) put_list("control_points", 0, writer, [](std::size_t) {});
  writer.out.close('}');
  return FormatOutput{writer.out.take()};
}

}  // namespace sheaf
