// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/brown_lens.h"
#include "scene/source_files.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A problem that grows as a file of views is read, as OpenMVG and AliceVision have it: a view is
/// an image where both its pose and its lens are there. Ids are unique in their kind. What is wrong
/// is told as "found", or nothing.
class ViewModel {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  struct View {
    std::uint32_t id = kNone, pose = kNone, intrinsic = kNone;
    std::string name;     ///< of the image
    std::string members;  ///< of its object that mean nothing here
    std::string whole;    ///< all its members, for those that are not placed
    Pose sub_pose{};      ///< of its camera in its rig; the identity where it has none
  };

  std::string add_intrinsic(std::uint32_t id, const CameraOfFile& camera, std::string members);
  /// cam_from_world: R (row-major) and the centre.
  std::string add_pose(std::uint32_t id, const std::array<double, 9>& R,
                       const std::array<double, 3>& centre);
  std::string add_view(View view);
  /// Makes images of the views; before points.
  void place_views(std::vector<std::string>& notes);

  std::string add_point(std::uint64_t id, const std::array<double, 3>& X,
                        const std::array<std::uint8_t, 3>& colour);
  /// Of the point added last; false for a view that is no image. `scale` of its feature, or 0.
  bool add_observation(std::uint32_t view, std::uint32_t feature, const std::array<double, 2>& xy,
                       double scale);

  std::size_t views() const { return views_.size(); }
  Problem take(std::string format, std::string root_members);
  SceneMetadata& metadata() { return metadata_; }

 private:
  struct StatedPose {
    Pose pose;
    std::array<double, 9> R;
    std::array<double, 3> centre;
  };

  Problem problem_;
  SceneMetadata metadata_;
  SourceFiles source_;
  std::vector<View> views_;
  std::unordered_map<std::uint32_t, StatedPose> poses_;
  std::unordered_map<std::uint32_t, std::uint32_t> camera_of_id_, image_of_view_;
  std::unordered_map<std::uint32_t, std::size_t> view_of_id_;
  std::unordered_map<std::uint64_t, std::uint32_t> point_of_id_;
  bool scaled_ = false;
};

/// The ids of the images' poses when such a file is written: those that were read, where no two
/// images share one, else the images' own.
std::vector<std::uint32_t> pose_ids_of(const SourceFiles* source,
                                       const std::vector<std::uint32_t>& image_ids);

/// A number that a reader turns into `target` by `read`, which is monotone: `guess` or one next to
/// it, so that what rounds on the way back does not show.
double stated_for(double target, double guess, const std::function<double(double)>& read);

/// For writers that state centres: whether those of the poses are numbers, and give numbers when
/// they are read. Errors: usage, naming the image.
Result<void> check_centres(const Problem& problem);

}  // namespace sheaf
