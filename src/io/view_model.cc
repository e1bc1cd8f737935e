// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/view_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "scene/rigs.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

std::string twice(const char* what, std::uint64_t id) {
  return std::string(what) + " id " + std::to_string(id) + " a second time";
}

bool is_identity(const Pose& pose) { return same_bits(pose, Pose()); }

}  // namespace

std::string ViewModel::add_intrinsic(std::uint32_t id, const CameraOfFile& camera,
                                     std::string members) {
  if (!camera_of_id_.emplace(id, problem_.cameras.size()).second) return twice("intrinsic", id);
  problem_.cameras.push_back(camera.camera);
  metadata_.camera_ids.push_back(id);
  source_.unknown_parameters.push_back(camera.unknown);
  source_.camera_members.push_back(std::move(members));
  return {};
}

std::string ViewModel::add_pose(std::uint32_t id, const std::array<double, 9>& R,
                                const std::array<double, 3>& centre) {
  if (const char* found = no_rotation(R)) return found;
  StatedPose stated{{rotation_from_stated(R), {}}, R, centre};
  stated.pose.translation = translation_of(stated.pose.rotation, centre);
  for (const double t : stated.pose.translation)
    if (!std::isfinite(t)) return "a centre too far away";
  return poses_.emplace(id, stated).second ? std::string() : twice("pose", id);
}

std::string ViewModel::add_view(View view) {
  if (!view_of_id_.emplace(view.id, views_.size()).second) return twice("view", view.id);
  views_.push_back(std::move(view));
  return {};
}

void ViewModel::place_views(std::vector<std::string>& notes) {
  std::size_t unplaced = 0, in_rigs = 0;
  for (View& view : views_) {
    const auto pose = poses_.find(view.pose);
    const auto camera = camera_of_id_.find(view.intrinsic);
    if (pose == poses_.end() || camera == camera_of_id_.end()) {
      ++unplaced;
      source_.unplaced_views.emplace_back(view.id, std::move(view.whole));
      continue;
    }
    const bool alone = is_identity(view.sub_pose);
    in_rigs += !alone;
    const StatedPose& stated = pose->second;
    image_of_view_.emplace(view.id, problem_.num_images());
    problem_.add_image(alone ? stated.pose : pose_in_rig(view.sub_pose, stated.pose),
                       camera->second);
    metadata_.image_ids.push_back(view.id);
    metadata_.image_names.push_back(std::move(view.name));
    metadata_.stated_rotations.insert(metadata_.stated_rotations.end(), stated.R.begin(),
                                      stated.R.end());
    source_.centres.insert(source_.centres.end(), stated.centre.begin(), stated.centre.end());
    source_.pose_ids.push_back(view.pose);
    source_.image_members.push_back(std::move(view.members));
  }
  if (unplaced > 0)
    notes.push_back(std::to_string(unplaced) + " of " + std::to_string(views_.size()) +
                    " views have no pose or no intrinsics, and are no images");
  if (in_rigs > 0)
    notes.push_back(std::to_string(in_rigs) +
                    " images of rigs are read as images that move by themselves");
}

std::string ViewModel::add_point(std::uint64_t id, const std::array<double, 3>& X,
                                 const std::array<std::uint8_t, 3>& colour) {
  if (!point_of_id_.emplace(id, problem_.num_points()).second) return twice("landmark", id);
  problem_.add_point(X[0], X[1], X[2]);
  metadata_.point_ids.push_back(id);
  metadata_.point_colours.push_back(colour);
  return {};
}

bool ViewModel::add_observation(std::uint32_t view, std::uint32_t feature,
                                const std::array<double, 2>& xy, double scale) {
  const auto image = image_of_view_.find(view);
  if (image == image_of_view_.end()) return false;
  problem_.add_observation(image->second, static_cast<std::uint32_t>(problem_.num_points() - 1),
                           xy[0], xy[1]);
  metadata_.observation_feature.push_back(feature);
  source_.feature_scales.push_back(scale);
  scaled_ = scaled_ || scale != 0;
  return true;
}

Problem ViewModel::take(std::string format, std::string root_members) {
  if (!scaled_) source_.feature_scales.clear();
  source_.format = std::move(format);
  source_.root_members = std::move(root_members);
  metadata_.state_hash = state_hash(problem_);
  metadata_.source = std::make_shared<const SourceFiles>(std::move(source_));
  problem_.metadata = std::make_shared<const SceneMetadata>(std::move(metadata_));
  return std::move(problem_);
}

std::vector<std::uint32_t> pose_ids_of(const SourceFiles* source,
                                       const std::vector<std::uint32_t>& image_ids) {
  if (source == nullptr || source->pose_ids.size() != image_ids.size()) return image_ids;
  std::vector<std::uint32_t> sorted = source->pose_ids;
  std::sort(sorted.begin(), sorted.end());
  const bool shared = std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
  return shared ? image_ids : source->pose_ids;
}

double stated_for(double target, double guess, const std::function<double(double)>& read) {
  constexpr int kNear = 4;
  if (read(guess) == target) return guess;
  for (const double end :
       {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()}) {
    double x = guess;
    for (int i = 0; i < kNear; ++i)
      if (x = std::nextafter(x, end); read(x) == target) return x;
  }
  return guess;
}

Result<void> check_centres(const Problem& problem) {
  const auto finite = [](const std::array<double, 3>& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  };
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const std::array<double, 3> centre = centre_of(problem, j, nullptr);
    if (!finite(centre) || !finite(translation_of(problem.poses[j].rotation, centre)))
      return Error(ErrorCode::usage,
                   "the centre of image " + std::to_string(j) + " is beyond the range of numbers");
  }
  return {};
}

}  // namespace sheaf
