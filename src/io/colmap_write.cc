// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>
#include <optional>

#include "geometry/camera_model.h"
#include "io/colmap_form.h"
#include "io/colmap_lens.h"
#include "io/colmap_rigs.h"
#include "io/line_cursor.h"
#include "io/output_folder.h"
#include "scene/camera_frame.h"
#include "scene/point_errors.h"
#include "scene/rigs.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::uint8_t kGrey = 128;

template <class Id>
std::vector<Id> ids_or_numbers(const std::vector<Id>& ids, std::size_t count) {
  if (!ids.empty()) return ids;
  std::vector<Id> numbers(count);
  std::iota(numbers.begin(), numbers.end(), Id{1});
  return numbers;
}

bool writable_in_text(const std::string& name) {
  const auto bad = [](char c) { return c == '\n' || c == '\r'; };
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  return std::none_of(name.begin(), name.end(), bad) &&
         (name.empty() || (!blank(name.front()) && !blank(name.back())));
}

template <class Id>
std::optional<Id> repeated(std::vector<Id> ids) {
  std::sort(ids.begin(), ids.end());
  const auto twice = std::adjacent_find(ids.begin(), ids.end());
  return twice == ids.end() ? std::nullopt : std::optional(*twice);
}

/// What would be read back as something else, or not at all.
Result<void> check_names(const ColmapForm& form, bool text) {
  const auto twice = [](const char* of, std::uint64_t id) {
    return Error(ErrorCode::usage, std::string("two ") + of + " have the id " + std::to_string(id) +
                                       "; a COLMAP model has ids that differ");
  };
  if (const auto id = repeated(form.camera_ids)) return twice("cameras", *id);
  if (const auto id = repeated(form.image_ids)) return twice("images", *id);
  if (const auto id = repeated(form.point_ids)) return twice("points", *id);
  for (const std::string& name : form.names) {
    if (name.find('\0') != name.npos)
      return Error(ErrorCode::usage, "the image name " + sheaf::quoted(name) +
                                         " holds a zero byte, where a COLMAP model ends a name");
    if (text && !writable_in_text(name))
      return Error(ErrorCode::usage, "the image name " + sheaf::quoted(name) +
                                         " begins or ends with a blank or holds a line's end, "
                                         "which COLMAP's text form cannot state");
  }
  return {};
}

/// The text of what was read, line by line; anew without a source.
ColmapFiles text_files(const ColmapForm& form, const SourceFiles* source) {
  ColmapFiles files;
  files.text = true;
  if (source == nullptr) {
    files.cameras = cameras_text(form, "", nullptr);
    files.images = images_text(form, "", nullptr);
    files.points = points_text(form, "", nullptr);
    return files;
  }
  ColmapFiles were;
  were.text = true;
  were.cameras = source->cameras;
  were.images = source->images;
  were.points = source->points;
  were.rigs = source->rigs;
  were.frames = source->frames;
  const Result<Problem> before = parse_colmap(were);
  if (!before.ok()) return text_files(form, nullptr);
  const ColmapForm before_form = colmap_form(before.value(), "colmap-text");
  files.cameras = cameras_text(form, source->cameras, &before_form);
  files.images = images_text(form, source->images, &before_form);
  files.points = points_text(form, source->points, &before_form);
  return files;
}

Result<void> add_rigs(const ColmapForm& form, const SourceFiles* source, ColmapFiles& files) {
  const ColmapRigs before = source ? parse_rigs(*source) : ColmapRigs();
  const bool same_form = source && source->format == (files.text ? "colmap-text" : "colmap");
  const Result<ColmapRigs> rigs = rigs_of(form, before);
  if (!rigs.ok()) return rigs.error();
  if (rigs.value().empty()) {
    // Files without a record are kept as they stood.
    if (!same_form || !before.empty() || !form.problem->rigs.empty()) return {};
    files.rigs = source->rigs;
    files.frames = source->frames;
    return {};
  }
  if (!files.text) {
    files.rigs = rigs_binary(rigs.value());
    files.frames = frames_binary(rigs.value());
    return {};
  }
  files.rigs = rigs_text(rigs.value(), same_form ? source->rigs : "", before);
  files.frames = frames_text(rigs.value(), same_form ? source->frames : "", before);
  return {};
}

/// Where an image's pose is what frame and sensor gave when they were read, it is what the file
/// stated beside them; a stale one only in a model that comes back as it was. A quaternion of
/// another length than 1 likewise, as COLMAP does not normalise it.
std::array<double, 7> stated_pose(const Problem& problem, std::size_t image, std::uint32_t id,
                                  bool as_it_was, bool as_read) {
  const Pose pose = pose_of(problem, image);
  const SourceFiles* source = problem.metadata ? problem.metadata->source.get() : nullptr;
  if (source != nullptr) {
    const auto stated = source->stated_poses.find(id);
    if (stated != source->stated_poses.end() && same_bits(stated->second.placed, pose) &&
        (as_it_was || !stated->second.stale) &&
        (as_read || states_a_rotation(stated->second.numbers)))
      return stated->second.numbers;
  }
  const auto& t = pose.translation;
  std::array<double, 4> q = pose.rotation;
  if (as_read && same_bits(problem.poses[image], pose))
    if (const double* numbers = stated_numbers(problem, image, 4))
      std::copy_n(numbers, 4, q.begin());
  return {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
}

/// The text form names models, the binary form numbers them as COLMAP does.
Result<void> check_lenses(const Problem& problem, bool text) {
  for (std::size_t c = 0; c < problem.cameras.size() && !text; ++c)
    if (!colmap_lens(problem.cameras[c]))
      return Error(ErrorCode::usage, "camera " + std::to_string(c) + " is " +
                                         std::string(to_string(problem.cameras[c].model)) +
                                         ", which COLMAP has no number for; its text form names "
                                         "models (--format colmap-text)");
  return {};
}

}  // namespace

ColmapForm colmap_form(const Problem& problem, const std::string& format) {
  static const SceneMetadata kNone;
  const SceneMetadata& metadata = problem.metadata ? *problem.metadata : kNone;
  ColmapForm form;
  form.problem = &problem;
  form.unchanged = problem.metadata && state_hash(problem) == metadata.state_hash;
  form.as_read = is_as_read(problem, format);
  form.camera_ids = ids_or_numbers(metadata.camera_ids, problem.cameras.size());
  form.image_ids = ids_or_numbers(metadata.image_ids, problem.num_images());
  form.point_ids = ids_or_numbers(metadata.point_ids, problem.num_points());
  form.names = metadata.image_names;
  if (form.names.empty())
    for (const std::uint32_t id : form.image_ids)
      form.names.push_back("image-" + std::to_string(id));
  form.colours = metadata.point_colours;
  if (form.colours.empty()) form.colours.assign(problem.num_points(), {kGrey, kGrey, kGrey});
  form.features = feature_table(problem, form.point_ids);
  form.errors_px = form.unchanged && !metadata.point_errors_px.empty() ? metadata.point_errors_px
                                                                       : mean_point_errors(problem);
  const bool as_it_was = form.unchanged && metadata.source && metadata.source->format == format;
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    form.poses.push_back(stated_pose(problem, j, form.image_ids[j], as_it_was, form.as_read));
  return form;
}

Result<ColmapFiles> format_colmap(const Problem& given, bool text) {
  Problem turned;
  const Problem* problem = without_bal_cameras(given, turned);
  const ColmapForm form = colmap_form(*problem, text ? "colmap-text" : "colmap");
  if (Result<void> good = check_names(form, text); !good.ok()) return good.error();
  const SourceFiles* source = given.metadata ? given.metadata->source.get() : nullptr;
  ColmapFiles files;
  if (Result<void> good = check_lenses(*problem, text); !good.ok()) return good.error();
  if (text) {
    files = text_files(form, source && source->format == "colmap-text" ? source : nullptr);
  } else {
    files.cameras = cameras_binary(form);
    files.images = images_binary(form);
    files.points = points_binary(form);
  }
  if (Result<void> done = add_rigs(form, source, files); !done.ok()) return done.error();
  return files;
}

Result<void> put_colmap(const ColmapFiles& files, OutputFolder& out) {
  const auto refuse = [&](const std::string& why) { return unwritable(out.shown(), why); };
  const auto name_of = [](const char* stem, bool text) {
    return std::string(stem) + (text ? ".txt" : ".bin");
  };
  for (const auto& [stem, bytes] : {std::pair{"cameras", &files.cameras},
                                    {"images", &files.images},
                                    {"points3D", &files.points},
                                    {"rigs", &files.rigs},
                                    {"frames", &files.frames}}) {
    const std::string name = name_of(stem, files.text), other = name_of(stem, !files.text);
    if (out.had(other))
      return refuse("it holds " + other + ", which would be mixed up with what is written");
    if (bytes->empty() && bytes != &files.points && out.had(name))
      return refuse("it holds " + name + " of a model with rigs, which this one has not");
    if (bytes->empty() && bytes != &files.points) continue;
    Result<OutputFile> file = out.create_file(name);
    if (!file.ok()) return file.error();
    file.value().write(*bytes);
    if (Result<void> done = file.value().commit(); !done.ok()) return done;
  }
  return {};
}

}  // namespace sheaf
