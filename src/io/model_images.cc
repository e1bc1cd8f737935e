// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/model_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "geometry/rotation.h"

namespace sheaf {
namespace {

using Vector = Vector3<double>;

/// Hosts keep so far away from their border, pixels.
constexpr double kMargin_px = 4;

std::string image_name(const Problem& model, std::size_t image) {
  return model.metadata ? model.metadata->image_names[image] : std::to_string(image);
}

/// fx, fy, cx, cy of a lens that is a pinhole, with our pixel centres.
std::optional<Pinhole> pinhole_of(const Camera& lens) {
  const auto& p = lens.parameters;
  if (lens.model == CameraModel::simple_pinhole) return Pinhole{p[0], p[0], p[1] - 0.5, p[2] - 0.5};
  if (lens.model == CameraModel::pinhole) return Pinhole{p[0], p[1], p[2] - 0.5, p[3] - 0.5};
  return {};
}

Result<Pinhole> common_pinhole(const Problem& model) {
  std::optional<Pinhole> common;
  for (std::size_t i = 0; i < model.num_images(); ++i) {
    const Camera& lens = model.cameras[model.image_camera[i]];
    const std::optional<Pinhole> own = pinhole_of(lens);
    if (!own)
      return Error(ErrorCode::usage,
                   "image " + image_name(model, i) + " has a " +
                       std::string(to_string(lens.model)) +
                       " lens; photometric refinement takes PINHOLE and SIMPLE_PINHOLE alone: "
                       "undistort the images first (colmap image_undistorter)");
    if (common && (common->fx != own->fx || common->fy != own->fy || common->cx != own->cx ||
                   common->cy != own->cy))
      return Error(ErrorCode::usage,
                   "image " + image_name(model, i) + " has other intrinsics than " +
                       image_name(model, 0) +
                       "; photometric refinement takes one pinhole for all images");
    common = own;
  }
  if (!common) return Error(ErrorCode::usage, "the model has no images");
  return *common;
}

Result<void> read_pixels(const FolderFiles& files, PhotometricFolder& folder) {
  const Problem& model = folder.model;
  for (std::size_t i = 0; i < model.num_images(); ++i) {
    const std::string name = image_name(model, i);
    const Camera& lens = model.cameras[model.image_camera[i]];
    Result<GreyImage> image = grey_in(files, name, {lens.width_px, lens.height_px, "its camera's"});
    if (!image.ok()) return image.error();
    folder.files.push_back(files.folder / name);
    folder.problem.images.push_back(std::move(image).value());
  }
  return {};
}

/// Of one image of a track.
struct View {
  std::uint32_t image;
  Vector direction;  ///< from the point to the camera, of length 1
  double distance;
  double x, y;  ///< of the point's projection
  bool inside;
};

View view_of(const PhotometricProblem& problem, std::uint32_t image, const double* X) {
  const Pose& pose = problem.poses[image];
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Vector P = multiply(R, Vector{X[0], X[1], X[2]});
  for (int d = 0; d < 3; ++d) P[d] += pose.translation[d];
  View view{image, {}, std::sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2]), 0, 0, false};
  for (int d = 0; d < 3; ++d)
    view.direction[d] = -(R[d] * P[0] + R[3 + d] * P[1] + R[6 + d] * P[2]) / view.distance;
  const Pinhole& k = problem.camera;
  view.x = k.fx * P[0] / P[2] + k.cx, view.y = k.fy * P[1] / P[2] + k.cy;
  const GreyImage& pixels = problem.images[image];
  view.inside = P[2] > 0 && view.x >= kMargin_px && view.y >= kMargin_px &&
                view.x <= pixels.width - 1 - kMargin_px && view.y <= pixels.height - 1 - kMargin_px;
  return view;
}

/// The image that sees the point most like all of them do, or nothing.
const View* best_view(const std::vector<View>& views) {
  Vector mean{};
  std::vector<double> distances;
  for (const View& view : views) {
    for (int d = 0; d < 3; ++d) mean[d] += view.direction[d];
    distances.push_back(view.distance);
  }
  const double norm = std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  const View* best = nullptr;
  double best_score = 0;
  for (const View& view : views) {
    if (!view.inside) continue;
    double cosine = 0;
    for (int d = 0; d < 3; ++d) cosine += view.direction[d] * mean[d] / norm;
    // Half: of cameras in a row the one above the point is nearer by as much as its cosine gains.
    const double score = cosine - std::abs(std::log(view.distance / *middle)) / 2;
    if (best != nullptr && !(score > best_score)) continue;
    best = &view;
    best_score = score;
  }
  return best;
}

/// Images of each point's track, each once and in order.
std::vector<std::vector<std::uint32_t>> tracks_of(const Problem& model) {
  std::vector<std::vector<std::uint32_t>> tracks(model.num_points());
  for (std::size_t i = 0; i < model.num_observations(); ++i)
    tracks[model.observation_point[i]].push_back(model.observation_image[i]);
  for (std::vector<std::uint32_t>& track : tracks) {
    std::sort(track.begin(), track.end());
    track.erase(std::unique(track.begin(), track.end()), track.end());
  }
  return tracks;
}

void host_points(PhotometricFolder& folder) {
  PhotometricProblem& problem = folder.problem;
  const auto tracks = tracks_of(folder.model);
  for (std::uint32_t i = 0; i < tracks.size(); ++i) {
    const double* X = &folder.model.points[3 * std::size_t(i)];
    std::vector<View> views;
    for (const std::uint32_t image : tracks[i]) views.push_back(view_of(problem, image, X));
    const View* host = views.size() < 2 ? nullptr : best_view(views);
    if (host == nullptr) continue;
    for (const View& view : views) {
      if (view.image == host->image) continue;
      problem.sight_point.push_back(static_cast<std::uint32_t>(problem.host.size()));
      problem.sight_image.push_back(view.image);
    }
    problem.points.insert(problem.points.end(), X, X + 3);
    problem.host.push_back(host->image);
    problem.host_xy.insert(problem.host_xy.end(), {host->x, host->y});
    folder.model_point.push_back(i);
  }
}

}  // namespace

Result<void> add_images(const FolderFiles& images, PhotometricFolder& folder) {
  const Result<Pinhole> camera = common_pinhole(folder.model);
  if (!camera.ok()) return camera.error();
  folder.problem.camera = camera.value();
  folder.problem.poses = folder.model.poses;
  if (Result<void> pixels = read_pixels(images, folder); !pixels.ok()) return pixels;
  host_points(folder);
  if (folder.model_point.empty())
    return Error(ErrorCode::unreadable_input,
                 images.folder.string() +
                     ": no point of the model is seen by two images and lies inside one of them");
  if (!folder.model.rigs.empty())
    folder.notes.push_back(
        "images of rigs are refined one by one, not as rigs, so that rigs and frames are not "
        "written");
  if (const std::size_t out = folder.model.num_points() - folder.model_point.size(); out > 0)
    folder.notes.push_back(std::to_string(out) +
                           " points that fewer than two images see, or none inside its border, "
                           "stay as they are");
  return {};
}

Problem model_with_state(const PhotometricFolder& folder) {
  Problem model = folder.model;
  model.poses = folder.problem.poses;
  model.rigs = {};  // images moved one by one
  for (std::size_t i = 0; i < folder.model_point.size(); ++i)
    std::copy_n(&folder.problem.points[3 * i], 3,
                &model.points[3 * std::size_t(folder.model_point[i])]);
  return model;
}

}  // namespace sheaf
