// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/page_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "geometry/camera_model.h"
#include "platform/parallel.h"
#include "report/alignment.h"
#include "report/matching.h"
#include "scene/camera_frame.h"
#include "scene/point_errors.h"

namespace sheaf {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The start's poses, lenses and points where the result has its own; what the start lacks stays
/// as the result has it.
void carry_start(const Problem& from, const Matching& matching, PageScene& scene) {
  Problem& to = scene.start;
  scene.start_image.assign(to.num_images(), matching.in_order);
  scene.start_point.assign(to.num_points(), matching.in_order);
  if (matching.in_order) {
    to.poses = from.poses;
    to.points = from.points;
    to.cameras = from.cameras;
    to.image_camera = from.image_camera;
    return;
  }
  // Each image gets a lens of its own: the two models may share them differently.
  to.cameras.clear();
  for (std::size_t i = 0; i < to.num_images(); ++i) {
    to.cameras.push_back(scene.result.cameras[scene.result.image_camera[i]]);
    to.image_camera[i] = static_cast<std::uint32_t>(i);
  }
  for (const Matching::Pair& pair : matching.images) {
    to.poses[pair.reference] = from.poses[pair.estimate];
    to.cameras[pair.reference] = from.cameras[from.image_camera[pair.estimate]];
    scene.start_image[pair.reference] = 1;
  }
  if (!matching.has_points) return;
  for (const Matching::Pair& pair : matching.points) {
    for (std::size_t k = 0; k < 3; ++k)
      to.points[3 * pair.reference + k] = from.points[3 * pair.estimate + k];
    scene.start_point[pair.reference] = 1;
  }
}

/// Without what was measured.
Problem state_of(const Problem& problem) {
  Problem out;
  out.poses = problem.poses;
  out.image_camera = problem.image_camera;
  out.cameras = problem.cameras;
  out.points = problem.points;
  out.bal_angle_axis = problem.bal_angle_axis;
  out.rigs = problem.rigs;
  return out;
}

/// Images of rigs stand where frames and sensors put them; nobody asks for these any more.
Problem plain(const Problem& problem) {
  Problem turned;
  const Problem* of = without_bal_cameras(problem, turned);
  Problem out = of == &turned ? std::move(turned) : problem;
  place_images(out);
  out.rigs = {};
  out.terms = {};
  return out;
}

void find_frames(PageScene& scene) {
  const Problem& p = scene.result;
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    const Camera& camera = p.cameras[p.image_camera[i]];
    ImageFrame frame;
    if (scene.has_bal_lenses || camera.width_px == 0 || camera.height_px == 0) {
      scene.sizes_known = false;
      frame.middle = principal_point_of(camera);
      for (std::uint64_t k = scene.begin[i]; k < scene.begin[i + 1]; ++k)
        for (std::size_t j = 0; j < 2; ++j)
          frame.half[j] =
              std::max(frame.half[j],
                       1.01 * std::abs(p.observation_xy[2 * scene.order[k] + j] - frame.middle[j]));
    } else {
      frame.half = {double(camera.width_px) / 2, double(camera.height_px) / 2};
      frame.middle = frame.half;
    }
    scene.frames.push_back(frame);
  }
}

void sort_by_image(PageScene& scene) {
  const Problem& p = scene.result;
  scene.begin.assign(p.num_images() + 1, 0);
  scene.track.assign(p.num_points(), 0);
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    ++scene.begin[p.observation_image[i] + 1];
    ++scene.track[p.observation_point[i]];
  }
  std::partial_sum(scene.begin.begin(), scene.begin.end(), scene.begin.begin());
  std::vector<std::uint64_t> next(scene.begin.begin(), scene.begin.end() - 1);
  scene.order.resize(p.num_observations());
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    scene.order[next[p.observation_image[i]]++] = i;
}

/// Where the start does not have the image or the point nothing is known.
void forget_unknown(const PageScene& scene, StateNumbers& state) {
  const Problem& p = scene.result;
  for (std::size_t i = 0; i < state.length.size(); ++i)
    if (!scene.start_image[p.observation_image[i]] || !scene.start_point[p.observation_point[i]])
      state.x[i] = state.y[i] = state.length[i] = static_cast<float>(kUnknown);
}

void find_poses(const Problem& problem, StateNumbers& state) {
  for (const Pose& pose : problem.poses) {
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    Vector3<double> c{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t j = 0; j < 3; ++j) c[k] -= R[3 * j + k] * pose.translation[j];
    state.rotation.push_back(R);
    state.centre.push_back(c);
  }
}

void find_residuals(const Problem& problem, int threads, StateNumbers& state) {
  // Farther off than any screen shows, and where squares of floats would overflow.
  constexpr double kMost_px = 1e15;
  const std::vector<double> r = residuals(problem, threads);
  const std::size_t count = problem.num_observations();
  state.x.resize(count), state.y.resize(count), state.length.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double length = std::sqrt(r[2 * i] * r[2 * i] + r[2 * i + 1] * r[2 * i + 1]);
    const bool known = length < kMost_px;
    state.x[i] = static_cast<float>(known ? r[2 * i] : kUnknown);
    state.y[i] = static_cast<float>(known ? r[2 * i + 1] : kUnknown);
    state.length[i] = static_cast<float>(known ? length : kUnknown);
  }
}

void summarise(const Problem& problem, StateNumbers& state) {
  std::vector<double> image(problem.num_images(), 0), point(problem.num_points(), 0);
  std::vector<std::uint64_t> of_image(image.size(), 0);
  std::vector<std::uint32_t> of_point(point.size(), 0);
  std::vector<float> lengths;
  lengths.reserve(state.length.size());
  double sum = 0;
  for (std::size_t i = 0; i < state.length.size(); ++i) {
    const double e = state.length[i];
    if (!std::isfinite(e)) continue;
    sum += e * e;
    image[problem.observation_image[i]] += e * e;
    ++of_image[problem.observation_image[i]];
    point[problem.observation_point[i]] += e * e;
    ++of_point[problem.observation_point[i]];
    lengths.push_back(state.length[i]);
  }
  const auto root = [](double total, std::uint64_t count) {
    return count > 0 ? std::sqrt(total / static_cast<double>(count)) : kUnknown;
  };
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = root(image[i], of_image[i]);
  for (std::size_t i = 0; i < point.size(); ++i) point[i] = root(point[i], of_point[i]);
  state.image_rms = std::move(image);
  state.point_rms = std::move(point);
  state.counted = lengths.size();
  state.rms = lengths.empty() ? 0 : root(sum, lengths.size());
  state.median = quantile(lengths, 0.5);
  state.q99 = quantile(lengths, 0.99);
}

/// Camera centres and a fair sample of points: what both states are laid onto one another by.
void align_start(PageScene& scene) {
  constexpr std::size_t kMostPoints = 2000;
  std::vector<Vector3<double>> from, to;
  for (std::size_t i = 0; i < scene.num_images(); ++i)
    if (scene.start_image[i]) {
      from.push_back(scene.before.centre[i]);
      to.push_back(scene.after.centre[i]);
    }
  const std::size_t step = std::max<std::size_t>(1, scene.num_points() / kMostPoints);
  const auto place = [](const Problem& p, std::size_t k) {
    return Vector3<double>{p.points[3 * k], p.points[3 * k + 1], p.points[3 * k + 2]};
  };
  for (std::size_t p = 0; p < scene.num_points(); p += step)
    if (scene.start_point[p]) {
      from.push_back(place(scene.start, p));
      to.push_back(place(scene.result, p));
    }
  if (from.size() < 3) return;
  const Alignment found = align_robustly(from, to).alignment;
  if (found.certainty > 1e-9) scene.onto_result = found.similarity;
}

std::vector<std::string> names_of(const Problem& problem) {
  const SceneMetadata* known = problem.metadata.get();
  if (known != nullptr && !known->image_names.empty()) return short_names(known->image_names);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    names.push_back("image " + std::to_string(known != nullptr && !known->image_ids.empty()
                                                  ? known->image_ids[i]
                                                  : std::uint32_t(i)));
  return names;
}

void rank_images(PageScene& scene) {
  const std::vector<double>& rms = scene.after.image_rms;
  for (std::uint32_t i = 0; i < scene.num_images(); ++i)
    if (std::isfinite(rms[i])) scene.worst.push_back(i);
  std::stable_sort(scene.worst.begin(), scene.worst.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return rms[a] > rms[b]; });
}

void find_result(int threads, PageScene& scene) {
  sort_by_image(scene);
  find_frames(scene);
  find_poses(scene.result, scene.after);
  find_residuals(scene.result, threads, scene.after);
  summarise(scene.result, scene.after);
  // The length of two normal coordinates has the median sigma sqrt(2 ln 2).
  scene.sigma = scene.after.median / std::sqrt(2 * std::log(2.0));
  rank_images(scene);
}

void find_links(PageScene& scene) {
  for_each_link(scene.result, tracks_of(scene.result),
                [&](std::uint32_t a, std::uint32_t b, std::uint32_t points) {
                  scene.links.push_back({a, b, points});
                });
}

Result<void> find_start(const Problem& start, const Problem& result,
                        const PageSceneOptions& options, PageScene& scene) {
  const Result<Matching> matching = match_models(start, result);
  if (!matching.ok()) return matching.error();
  scene.has_start = true;
  scene.start = scene.result;
  carry_start(plain(state_of(start)), matching.value(), scene);
  find_poses(scene.start, scene.before);
  find_residuals(scene.start, options.threads, scene.before);
  forget_unknown(scene, scene.before);
  summarise(scene.start, scene.before);
  return {};
}

}  // namespace

double quantile(std::vector<float>& values, double part) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[std::size_t(at)];
}

std::vector<std::string> short_names(std::vector<std::string> names) {
  if (names.size() < 2) return names;
  const auto shared = [&](auto&& end_of) {
    const std::string first = end_of(names.front());
    return !first.empty() && std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return end_of(name) == first;
    });
  };
  const auto folder = [](const std::string& name) {
    const std::size_t slash = name.find('/');
    return slash == std::string::npos ? std::string() : name.substr(0, slash + 1);
  };
  while (shared(folder)) {
    const std::size_t length = folder(names.front()).size();
    for (std::string& name : names) name.erase(0, length);
  }
  const auto ending = [](const std::string& name) {
    const std::size_t dot = name.rfind('.');
    return dot == std::string::npos || dot == 0 ? std::string() : name.substr(dot);
  };
  if (shared(ending)) {
    const std::size_t length = ending(names.front()).size();
    for (std::string& name : names) name.erase(name.size() - length);
  }
  return names;
}

Result<PageScene> page_scene(const Problem* start, const Problem& result,
                             const PageSceneOptions& options) {
  PageScene scene;
  scene.has_bal_lenses = has_bal_cameras(result);
  scene.result = plain(result);
  scene.names = names_of(result);
  Result<void> carried;
  // Both states and the links write what no other reads.
  Threads(options.threads).for_each(3, [&](std::size_t task) {
    if (task == 0) find_result(options.threads, scene);
    if (task == 1 && start != nullptr) carried = find_start(*start, result, options, scene);
    if (task == 2) find_links(scene);
  });
  if (!carried.ok()) return carried.error();
  if (scene.has_start && !options.placed) align_start(scene);
  return scene;
}

}  // namespace sheaf
