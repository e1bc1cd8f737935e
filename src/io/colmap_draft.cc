// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap_draft.h"

#include <algorithm>
#include <cmath>

#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kMatched = ColmapDraft::kNoPoint - 1;
constexpr std::uint64_t kWidestPx = 1'000'000'000;

std::string found(const std::string& what, const std::string& expected) {
  return "found " + what + ", expected " + expected;
}

template <class Numbers>
bool finite(const Numbers& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace

bool UniqueIds::add(std::uint64_t id) {
  if (seen_.empty()) {
    const bool begun = count_ > 0;
    ascending_ = ascending_ && (!begun || id > last_);
    descending_ = descending_ && (!begun || id < last_);
    if (ascending_ || descending_) {
      last_ = id;
      ++count_;
      run_.push_back(id);
      return true;
    }
    seen_.insert(run_.begin(), run_.end());
    run_ = {};
  }
  return seen_.insert(id).second;
}

ColmapDraft::Refusal ColmapDraft::add_camera(std::uint32_t id, const Camera& camera) {
  if (!finite(camera.parameters))
    return found("a parameter that is not finite",
                 "finite parameters of camera " + std::to_string(id));
  if (camera.width_px > kWidestPx || camera.height_px > kWidestPx)
    return found("an image of " + std::to_string(camera.width_px) + " x " +
                     std::to_string(camera.height_px) + " pixels",
                 "at most " + std::to_string(kWidestPx) + " each way");
  if (!camera_of_id_.emplace(id, problem_.cameras.size()).second)
    return found("camera id " + std::to_string(id) + " a second time", "ids that differ");
  problem_.cameras.push_back(camera);
  metadata_.camera_ids.push_back(id);
  return {};
}

ColmapDraft::Refusal ColmapDraft::add_image(std::uint32_t id, const std::array<double, 7>& pose,
                                            std::uint32_t camera_id, std::string name,
                                            std::uint64_t place) {
  const std::string which = "of image " + std::to_string(id);
  if (!finite(pose)) return found("a number that is not finite", "a finite pose " + which);
  const std::array<double, 4> stated{pose[0], pose[1], pose[2], pose[3]};
  Pose placed;
  placed.rotation = rotation_from_stated(stated);
  double norm2 = 0;
  for (const double q : placed.rotation) norm2 += q * q;
  if (!(std::abs(norm2 - 1) < 1e-6))
    return found("a quaternion of no direction or an absurd length", "the rotation " + which);
  placed.translation = {pose[4], pose[5], pose[6]};
  const auto camera = camera_of_id_.find(camera_id);
  if (camera == camera_of_id_.end())
    return found("camera id " + std::to_string(camera_id) + " " + which,
                 "the id of one of the " + std::to_string(problem_.cameras.size()) + " cameras");
  if (!image_of_id_.emplace(id, problem_.num_images()).second)
    return found("image id " + std::to_string(id) + " a second time", "ids that differ");
  problem_.add_image(placed, camera->second);
  rotations_restated_ = rotations_restated_ || placed.rotation != stated;
  metadata_.stated_rotations.insert(metadata_.stated_rotations.end(), stated.begin(), stated.end());
  metadata_.image_ids.push_back(id);
  metadata_.image_names.push_back(std::move(name));
  metadata_.feature_begin.push_back(feature_point_.size());
  places_.push_back(place);
  return {};
}

ColmapDraft::Refusal ColmapDraft::add_feature(double x, double y, std::uint64_t point_id) {
  if (!std::isfinite(x) || !std::isfinite(y))
    return found("a number that is not finite",
                 "the position of feature " +
                     std::to_string(feature_point_.size() - metadata_.feature_begin.back()) +
                     " of image " + std::to_string(metadata_.image_ids.back()));
  if (point_id == kMatched) return found("point id 2^64 - 2", "a smaller one");
  metadata_.feature_xy.insert(metadata_.feature_xy.end(), {x, y});
  feature_point_.push_back(point_id);
  return {};
}

ColmapDraft::Refusal ColmapDraft::add_point(std::uint64_t id, const std::array<double, 3>& xyz,
                                            const std::array<std::uint8_t, 3>& colour,
                                            double error_px) {
  const auto which = [id] { return " of point " + std::to_string(id); };  // built only to refuse
  if (!finite(xyz)) return found("a number that is not finite", "the coordinates" + which());
  if (!std::isfinite(error_px)) return found("a number that is not finite", "the error" + which());
  if (id >= kMatched) return found("point id " + std::to_string(id), "a smaller one");
  if (!point_ids_.add(id))
    return found("point id " + std::to_string(id) + " a second time", "ids that differ");
  problem_.add_point(xyz[0], xyz[1], xyz[2]);
  metadata_.point_ids.push_back(id);
  metadata_.point_colours.push_back(colour);
  metadata_.point_errors_px.push_back(error_px);
  return {};
}

ColmapDraft::Refusal ColmapDraft::add_track_element(std::uint32_t image_id, std::uint32_t feature) {
  const std::uint64_t id = metadata_.point_ids.back();
  const auto refuse = [&](const std::string& what, const std::string& expected) {
    return found(what + " in the track of point " + std::to_string(id), expected);
  };
  const auto where = [&] {
    return "feature " + std::to_string(feature) + " of image " + std::to_string(image_id);
  };
  const auto image = image_of_id_.find(image_id);
  if (image == image_of_id_.end())
    return refuse("image id " + std::to_string(image_id), "the id of an image");
  const std::uint64_t begin = metadata_.feature_begin[image->second];
  const std::uint64_t end = image->second + 1 < metadata_.feature_begin.size()
                                ? metadata_.feature_begin[image->second + 1]
                                : feature_point_.size();
  if (feature >= end - begin)
    return refuse(where(), "one of its " + std::to_string(end - begin) + " features");
  std::uint64_t& point = feature_point_[begin + feature];
  if (point != id)
    return refuse(where(), point == kMatched ? "a feature that no track has listed before"
                           : point == kNoPoint
                               ? "a feature that names this point, not none"
                               : "a feature that names this point, not " + std::to_string(point));
  point = kMatched;
  const double* xy = &metadata_.feature_xy[2 * (begin + feature)];
  problem_.add_observation(image->second, static_cast<std::uint32_t>(problem_.num_points() - 1),
                           xy[0], xy[1]);
  metadata_.observation_feature.push_back(feature);
  return {};
}

std::optional<ColmapDraft::Unmatched> ColmapDraft::unmatched() const {
  for (std::size_t i = 0; i < feature_point_.size(); ++i) {
    if (feature_point_[i] == kMatched || feature_point_[i] == kNoPoint) continue;
    const auto next =
        std::upper_bound(metadata_.feature_begin.begin(), metadata_.feature_begin.end(), i);
    const auto image = static_cast<std::size_t>(next - metadata_.feature_begin.begin()) - 1;
    const std::uint64_t feature = i - metadata_.feature_begin[image];
    return Unmatched{places_[image], feature,
                     found("feature " + std::to_string(feature) + " of image " +
                               std::to_string(metadata_.image_ids[image]) + " naming point " +
                               std::to_string(feature_point_[i]),
                           "a point whose track lists this feature")};
  }
  return {};
}

void ColmapDraft::place_image(std::uint32_t image, const Pose& pose, bool stale) {
  Pose& placed = problem_.poses[image];
  StatedPose& stated = stated_poses_[metadata_.image_ids[image]];
  std::copy_n(&metadata_.stated_rotations[4 * std::size_t(image)], 4, stated.numbers.begin());
  std::copy_n(placed.translation.begin(), 3, stated.numbers.begin() + 4);
  stated.placed = pose;
  stated.stale = stale;
  placed = pose;
  if (stale) metadata_.stale_poses.push_back(image);
}

void ColmapDraft::set_rigs(Rigs rigs, std::vector<std::uint32_t> rig_ids,
                           std::vector<std::uint32_t> frame_ids,
                           std::vector<std::uint32_t> sensor_ids) {
  problem_.rigs = std::move(rigs);
  metadata_.rig_ids = std::move(rig_ids);
  metadata_.frame_ids = std::move(frame_ids);
  metadata_.sensor_ids = std::move(sensor_ids);
}

Problem ColmapDraft::take(SourceFiles source) {
  metadata_.feature_begin.push_back(feature_point_.size());
  if (!rotations_restated_) metadata_.stated_rotations.clear();
  metadata_.state_hash = state_hash(problem_);
  source.stated_poses = std::move(stated_poses_);
  metadata_.source = std::make_shared<const SourceFiles>(std::move(source));
  problem_.metadata = std::make_shared<const SceneMetadata>(std::move(metadata_));
  return std::move(problem_);
}

}  // namespace sheaf
