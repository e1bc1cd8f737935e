// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>

#include "io/direct_folder.h"
#include "io/rgbd_folder.h"
#include "scene/depth_points.h"

namespace sheaf {
namespace {

Error unreadable(const std::string& message) { return Error(ErrorCode::unreadable_input, message); }

/// What some cameras have where they saw nothing, as others have 0.
constexpr std::uint16_t kNoDepth = 65535;

/// An image, its depth map and its pose.
struct Frame {
  double time = 0;
  std::string image, depth;
  Pose pose;
};

/// The entry nearest in time, if it is near enough.
template <class Entry>
const Entry* nearest(const std::vector<Entry>& sorted, double time) {
  auto at = std::lower_bound(sorted.begin(), sorted.end(), time,
                             [](const Entry& entry, double t) { return entry.time < t; });
  if (at == sorted.end() || (at != sorted.begin() && time - (at - 1)->time < at->time - time)) --at;
  return std::abs(at->time - time) <= kSameMoment_s ? &*at : nullptr;
}

template <class Entry>
void sort_by_time(std::vector<Entry>& entries) {
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.time < b.time; });
}

/// Lists by time: an image goes with the depth and the pose that are nearest.
Result<std::vector<Frame>> frames_by_time(const FolderFiles& files, int every,
                                          std::vector<std::string>& notes) {
  const auto list = [&](const char* name) -> Result<std::vector<TimedFile>> {
    const Result<std::string> text = files.bytes(name);
    if (!text.ok()) return text.error();
    return parse_file_list(text.value(), files.name(name));
  };
  Result<std::vector<TimedFile>> images = list("rgb.txt"), depths = list("depth.txt");
  if (!images.ok()) return images.error();
  if (!depths.ok()) return depths.error();
  const Result<std::string> text = files.bytes("groundtruth.txt");
  if (!text.ok()) return text.error();
  auto poses = parse_trajectory(text.value(), files.name("groundtruth.txt"), true);
  if (!poses.ok()) return poses.error();
  sort_by_time(depths.value());
  sort_by_time(poses.value());
  std::vector<Frame> out;
  std::size_t alone = 0;
  for (std::size_t i = 0; i < images.value().size(); i += static_cast<std::size_t>(every)) {
    const TimedFile& image = images.value()[i];
    const TimedFile* depth = nearest(depths.value(), image.time);
    const TimedPose* pose = nearest(poses.value(), image.time);
    if (depth == nullptr || pose == nullptr)
      ++alone;
    else
      out.push_back({image.time, image.name, depth->name, pose->pose});
  }
  if (alone > 0)
    notes.push_back(std::to_string(alone) + " images have no depth or no pose within 0.02 s");
  if (out.size() < 2)
    return unreadable(files.name("rgb.txt") + ": found " + std::to_string(out.size()) +
                      " images with depth and pose at the same time (to 0.02 s), expected 2 or "
                      "more");
  return out;
}

/// NAME.png, or NAME.pgm where that is there.
std::string picture(const FolderFiles& files, const std::string& name) {
  return files.has(name + ".pgm") ? name + ".pgm" : name + ".png";
}

/// color/N.png and depth/N.png (or .pgm), counted from 0 or 1, one for each line of pose.txt.
Result<std::vector<Frame>> frames_by_number(const FolderFiles& files, int every) {
  const Result<std::string> text = files.bytes("pose.txt");
  if (!text.ok()) return text.error();
  const auto poses = parse_trajectory(text.value(), files.name("pose.txt"), false);
  if (!poses.ok()) return poses.error();
  const std::size_t first = files.has(picture(files, "color/0")) ? 0 : 1;
  std::vector<Frame> out;
  for (std::size_t i = 0; i < poses.value().size(); i += static_cast<std::size_t>(every)) {
    const std::string number = std::to_string(first + i);
    out.push_back({poses.value()[i].time, picture(files, "color/" + number),
                   picture(files, "depth/" + number), poses.value()[i].pose});
  }
  if (out.size() < 2)
    return unreadable(files.name("pose.txt") + ": found one image, expected 2 or more");
  return out;
}

Result<DepthMap> depth_in_folder(const FolderFiles& files, const std::string& name,
                                 const ImageBounds& bounds, double scale) {
  const Result<Raster> raster = raster_in(files, name, bounds);
  if (!raster.ok()) return raster.error();
  const Raster& from = raster.value();
  if (from.channels != 1 || from.bits != 16)
    return unreadable(files.name(name) + ": found " + std::to_string(from.channels) +
                      (from.channels == 1 ? " channel of " : " channels of ") +
                      std::to_string(from.bits) + " bits, expected a depth map: 1 of 16 bits");
  DepthMap out{from.width, from.height, {}};
  out.depth.reserve(from.samples.size());
  for (const std::uint16_t sample : from.samples)
    out.depth.push_back(sample == kNoDepth ? 0.0f : static_cast<float>(sample / scale));
  return out;
}

Result<std::vector<DepthMap>> read_images(const FolderFiles& files,
                                          const std::vector<Frame>& frames, double depth_scale,
                                          PhotometricFolder& folder) {
  std::vector<DepthMap> maps;
  for (const Frame& frame : frames) {
    Result<GreyImage> image = grey_in(files, frame.image);
    if (!image.ok()) return image.error();
    const ImageBounds same{static_cast<std::uint64_t>(image.value().width),
                           static_cast<std::uint64_t>(image.value().height),
                           "those of " + frame.image + ","};
    Result<DepthMap> map = depth_in_folder(files, frame.depth, same, depth_scale);
    if (!map.ok()) return map.error();
    folder.problem.images.push_back(std::move(image).value());
    maps.push_back(std::move(map).value());
    folder.problem.poses.push_back(frame.pose);
    folder.times.push_back(frame.time);
    folder.files.push_back(files.folder / frame.image);
    folder.depth_files.push_back(files.folder / frame.depth);
  }
  return maps;
}

std::optional<Error> find_points(const FolderFiles& files, const PhotometricReadOptions& options,
                                 const std::vector<DepthMap>& maps, PhotometricFolder& folder) {
  PhotometricProblem& problem = folder.problem;
  if (files.has("hosts.txt")) {
    const Result<std::string> text = files.bytes("hosts.txt");
    if (!text.ok()) return text.error();
    auto hosts = parse_rgbd_hosts(text.value(), files.name("hosts.txt"), folder);
    if (!hosts.ok()) return hosts.error();
  } else {
    choose_points(maps, {options.cell_px, options.least_slope, options.max_points}, problem);
  }
  if (problem.host.empty())
    return unreadable(files.folder.string() + ": no pixel has both a depth and a slope of " +
                      std::to_string(options.least_slope) + " grey levels per pixel");
  if (options.noise.rotation_rad != 0 || options.noise.center != 0) {
    folder.given_poses = problem.poses;
    if (auto moved = disturb(problem, options.noise); !moved.ok()) return moved.error();
  }
  find_sights(maps, options.depth_tolerance, problem);
  if (!problem.sight_point.empty()) return {};
  return unreadable(files.folder.string() +
                    ": no point is seen by a second image at the depth that its map says; the "
                    "poses (world_from_camera), the intrinsics or the depth scale may be others");
}

}  // namespace

Result<PhotometricFolder> read_rgbd(const FolderFiles& files,
                                    const PhotometricReadOptions& options) {
  PhotometricFolder folder;
  const bool timed = files.has("rgb.txt");
  folder.format = timed ? "rgbd" : "rgbd-numbered";
  if (auto k = find_intrinsics(files, options.camera, folder); !k.ok()) return k.error();
  const auto frames = timed ? frames_by_time(files, options.every, folder.notes)
                            : frames_by_number(files, options.every);
  if (!frames.ok()) return frames.error();
  const auto maps = read_images(files, frames.value(), options.depth_scale, folder);
  if (!maps.ok()) return maps.error();
  if (files.has("brightness.txt")) {
    const Result<std::string> text = files.bytes("brightness.txt");
    if (!text.ok()) return text.error();
    auto looks = parse_direct_brightness(text.value(), files.name("brightness.txt"), folder);
    if (!looks.ok()) return looks.error();
  }
  if (auto wrong = find_points(files, options, maps.value(), folder)) return *wrong;
  return folder;
}

}  // namespace sheaf
