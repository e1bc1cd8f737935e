// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "platform/portable_math.h"
#include "platform/random.h"
#include "scene/start_state.h"
#include "scene/tracks.h"
#include "scene/view.h"
#include "sheaf/scene.h"

namespace sheaf {

Vector3<double> normal3(Random& random, double deviation) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {deviation * x, deviation * y, deviation * z};
}

namespace {

constexpr std::uint64_t kPixelStream = std::uint64_t{4} << 40;
constexpr std::uint64_t kMost = std::uint64_t{1} << 32;  // of a point's number in a stream
constexpr std::uint64_t kSample = 20000;
constexpr std::uint64_t kKept = 5000000;  // 120 MB; later points are made once more

Result<void> check(const FamilyOptions& o) {
  const auto refuse = [](const std::string& message) { return Error(ErrorCode::usage, message); };
  if (o.images < 8 || o.images >= kMost - 1)
    return refuse("a street or a collection needs from 8 to 2^32 - 2 images, not " +
                  std::to_string(o.images));
  if (o.points < o.images || o.points >= kMost - 1)
    return refuse("a street or a collection needs at least a point for each image, and at most " +
                  ("2^32 - 2, not " + std::to_string(o.points)));
  const double mean = static_cast<double>(o.observations) / static_cast<double>(o.points);
  const double most = std::min(0.4 * static_cast<double>(o.images), 30.0);
  if (!(mean >= 2.05 && mean <= std::max(most, 4.5)))
    return refuse("with so many images the mean track must be from 2.05 to " +
                  std::to_string(std::max(most, 4.5)) + ", not " + std::to_string(mean));
  const std::pair<const char*, double> sizes[] = {{"focal length", o.focal_px},
                                                  {"pixel noise", o.pixel_noise_px},
                                                  {"fraction of outliers", o.outliers},
                                                  {"drift", o.drift}};
  for (const auto& [name, value] : sizes)
    if (!(value >= 0) || !std::isfinite(value))
      return refuse(std::string("the ") + name + " must be a finite number from 0 up");
  if (o.outliers > 1) return refuse("the fraction of outliers must be at most 1");
  if (o.family > SceneFamily::collection) return refuse("the family is none that there is");
  return {};
}

std::uint64_t count(TrackMaker& maker, std::uint64_t points, std::uint64_t stride) {
  Track track;
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < points; i += stride) {
    maker.make(i, track);
    sum += track.views.size();
  }
  return sum;
}

// Tracks end up shorter than asked for where few images see their point. So the mean asked for is
// raised until a sample of the points, then all of them, come out with the observations wanted.
std::uint64_t settle(TrackMaker& maker, const FamilyOptions& options) {
  const double target =
      static_cast<double>(options.observations) / static_cast<double>(options.points);
  const auto corrected = [&](double mean, double found) {
    return 2 + (mean - 2) * std::clamp((target - 2) / std::max(found - 2, 1e-3), 0.5, 2.0);
  };
  double mean = target;
  const std::uint64_t stride = std::max<std::uint64_t>(1, options.points / kSample);
  const double sampled = static_cast<double>((options.points + stride - 1) / stride);
  for (int round = 0; round < 6; ++round) {
    maker.set_mean(mean);
    mean = corrected(mean, static_cast<double>(count(maker, options.points, stride)) / sampled);
  }
  std::uint64_t found = 0;
  for (int round = 0; round < 4; ++round) {
    maker.set_mean(mean);
    found = count(maker, options.points, 1);
    const double miss = static_cast<double>(found) / static_cast<double>(options.observations) - 1;
    if (std::fabs(miss) < 0.006) break;
    mean = corrected(mean, static_cast<double>(found) / static_cast<double>(options.points));
  }
  return found;
}

// Normal noise, and now and then a wrong match: 4 px off and more, with a heavy tail.
std::array<double, 2> disturbed(std::array<double, 2> pixel, const FamilyOptions& options,
                                Random& random) {
  const double x = random.normal(), y = random.normal(), wrong = random.uniform();
  pixel[0] += options.pixel_noise_px * x;
  pixel[1] += options.pixel_noise_px * y;
  if (wrong >= options.outliers) return pixel;
  const double u = random.uniform();
  const double size = std::min(4 + 4 * u / (1 - u), 60.0);
  const SineCosine to = portable_sine_cosine(6.28318530717958647692 * random.uniform());
  return {pixel[0] + size * to.cosine, pixel[1] + size * to.sine};
}

class Streamer {
 public:
  Streamer(const Layout& layout, TrackMaker& maker, const FamilyOptions& options, SceneState state)
      : layout_(layout),
        maker_(maker),
        options_(options),
        start_(state == SceneState::start),
        truth_(true_states(layout)),
        states_(start_ ? start_states(layout, options) : truth_) {}

  StreamedScene run(std::uint64_t observations, SceneSink& sink) {
    sink.counts(options_.images, options_.points, observations);
    for (std::uint64_t i = 0; i < options_.points && sink.more(); ++i) stream_track(i, sink);
    for (const ViewState& state : states_)
      sink.image(state.angle_axis, state.translation, state.intrinsics);
    for (const Vector3<double>& X : kept_) sink.point(X);
    for (std::uint64_t i = kept_.size(); i < options_.points && sink.more(); ++i) {
      maker_.make(i, track_);
      sink.point(point_of(i, track_));
    }
    out_.rms_px =
        std::sqrt(sum_ / static_cast<double>(std::max<std::uint64_t>(1, out_.observations)));
    return out_;
  }

 private:
  Vector3<double> point_of(std::uint64_t i, const Track& track) const {
    return start_ ? start_point(layout_, options_, i, track) : track.X;
  }

  void stream_track(std::uint64_t i, SceneSink& sink) {
    maker_.make(i, track_);
    const Vector3<double> X = point_of(i, track_);
    if (i < kKept) kept_.push_back(X);
    for (std::uint32_t& v : track_.views) v = layout_.views[v].file_index;
    std::sort(track_.views.begin(), track_.views.end());
    Random random(options_.seed, kPixelStream + i);
    for (const std::uint32_t image : track_.views) {
      bool behind = false;
      std::array<double, 2> pixel = project(truth_[image], track_.X, behind);
      if (start_) pixel = disturbed(pixel, options_, random);
      sink.observation(image, static_cast<std::uint32_t>(i), pixel[0], pixel[1]);
      const std::array<double, 2> here = project(states_[image], X, behind);
      const double dx = here[0] - pixel[0], dy = here[1] - pixel[1];
      sum_ += dx * dx + dy * dy;
      out_.behind += behind;
      ++out_.observations;
    }
  }

  const Layout& layout_;
  TrackMaker& maker_;
  const FamilyOptions& options_;
  const bool start_;
  const std::vector<ViewState> truth_, states_;
  Track track_;
  std::vector<Vector3<double>> kept_;  // in the file points come last: the first ones are kept
  double sum_ = 0;
  StreamedScene out_;
};

class ProblemSink : public SceneSink {
 public:
  void counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) override {
    problem.poses.reserve(images);
    problem.cameras.reserve(images);
    problem.image_camera.reserve(images);
    problem.bal_angle_axis.reserve(3 * images);
    problem.points.reserve(3 * points);
    problem.observation_image.reserve(observations);
    problem.observation_point.reserve(observations);
    problem.observation_xy.reserve(2 * observations);
  }
  void observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) override {
    problem.add_observation(image, point, x_px, y_px);
  }
  void image(const std::array<double, 3>& angle_axis, const std::array<double, 3>& translation,
             const std::array<double, 3>& intrinsics) override {
    // As a reader of the file would convert it, so that the writer recognises it.
    problem.add_image({quaternion_from_angle_axis(angle_axis), translation},
                      Camera{CameraModel::bal, {intrinsics[0], intrinsics[1], intrinsics[2]}});
    problem.bal_angle_axis.insert(problem.bal_angle_axis.end(), angle_axis.begin(),
                                  angle_axis.end());
  }
  void point(const std::array<double, 3>& xyz) override {
    problem.add_point(xyz[0], xyz[1], xyz[2]);
  }

  Problem problem;
};

Layout layout_of(const FamilyOptions& options) {
  return options.family == SceneFamily::street ? make_street(options) : make_collection(options);
}

}  // namespace

Result<StreamedScene> stream(const FamilyOptions& options, SceneState state, SceneSink& sink) {
  if (Result<void> result = check(options); !result.ok()) return result.error();
  const Layout layout = layout_of(options);
  TrackMaker maker(layout, options);
  const std::uint64_t observations = settle(maker, options);
  return Streamer(layout, maker, options, state).run(observations, sink);
}

Result<Scene> generate(const FamilyOptions& options) {
  if (Result<void> result = check(options); !result.ok()) return result.error();
  const Layout layout = layout_of(options);
  TrackMaker maker(layout, options);
  const std::uint64_t observations = settle(maker, options);
  ProblemSink start, truth;
  Streamer(layout, maker, options, SceneState::start).run(observations, start);
  Streamer(layout, maker, options, SceneState::truth).run(observations, truth);
  return Scene{std::move(start.problem), std::move(truth.problem)};
}

}  // namespace sheaf
