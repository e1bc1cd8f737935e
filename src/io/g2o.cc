// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/g2o.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <unordered_map>

#include "io/line_cursor.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::array<std::string_view, 4> kFirstWords{"VERTEX_", "PARAMS_", "EDGE_", "FIX"};
constexpr std::uint32_t kNone = 0xffffffff;

struct Edge {
  std::uint64_t line;
  std::uint32_t point, pose, parameters;  ///< ids; no parameters: the pose has a lens
  std::array<double, 2> uv;
  double sigma;
};

class Reader {
 public:
  Reader(std::string_view text, const std::string& name, std::vector<std::string>& notes)
      : in_(text, name), notes_(notes) {}

  Result<Problem> run() {
    while (in_.next_record())
      if (auto e = record()) return *e;
    for (const Edge& edge : edges_)
      if (auto e = place(edge)) return *e;
    give_lenses();
    note_rest();
    return take();
  }

 private:
  using Wrong = std::optional<Error>;

  Wrong record() {
    std::string_view tag;
    in_.read_word(tag);
    if (tag == "VERTEX_CAM") return camera(true);
    if (tag == "VERTEX_SE3:EXPMAP") return camera(false);
    if (tag == "VERTEX_XYZ" || tag == "VERTEX_TRACKXYZ") return point();
    if (tag == "PARAMS_CAMERAPARAMETERS") return parameters();
    if (tag == "EDGE_PROJECT_P2MC") return edge(false);
    if (tag == "EDGE_PROJECT_XYZ2UV:EXPMAP") return edge(true);
    if (tag == "FIX") return fix();
    if (tag == "EDGE_SE3:EXPMAP" || tag == "EDGE_CAM" || tag == "EDGE_SCALE") {
      in_.pass_line();
      ++between_;
      return {};
    }
    return in_.refuse(
        "one of VERTEX_CAM, VERTEX_SE3:EXPMAP, VERTEX_XYZ, VERTEX_TRACKXYZ, "
        "PARAMS_CAMERAPARAMETERS, EDGE_PROJECT_P2MC, EDGE_PROJECT_XYZ2UV:EXPMAP (monocular bundle "
        "adjustment; stereo and pose graphs are not read)");
  }

  template <class Numbers>
  Wrong reals(Numbers& numbers, const char* what) {
    for (double& x : numbers)
      if (!in_.read_real(x)) return in_.refuse(std::string("a finite number, ") + what);
    return {};
  }

  Wrong id(std::uint32_t& value, const char* what) {
    if (in_.read_integer(value) && value != kNone) return {};
    return in_.refuse(what);
  }

  Wrong end() {
    return in_.line_ended() ? Wrong()
                            : in_.refuse_as("found " + sheaf::quoted(in_.rest()) +
                                            ", expected the end of the line");
  }

  Wrong unique(bool is_new, std::uint32_t id) {
    if (is_new) return {};
    return in_.refuse_as("found vertex " + std::to_string(id) +
                         " a second time, expected ids that differ");
  }

  Wrong camera(bool with_lens) {
    std::uint32_t key = 0;
    std::array<double, 3> centre{};
    std::array<double, 4> xyzw{};
    if (auto e = id(key, "the id of a camera")) return e;
    if (auto e = reals(centre, "a coordinate of a camera")) return e;
    if (auto e = reals(xyzw, "an entry of a camera's quaternion x y z w")) return e;
    // The file has world_from_cam.
    const std::array<double, 4> stated{xyzw[3], -xyzw[0], -xyzw[1], -xyzw[2]};
    Pose pose;
    pose.rotation = rotation_from_stated(stated);
    pose.translation = translation_of(pose.rotation, centre);
    double norm2 = 0;
    for (const double q : pose.rotation) norm2 += q * q;
    if (!(std::abs(norm2 - 1) < 1e-6) ||
        !std::all_of(pose.translation.begin(), pose.translation.end(),
                     [](double t) { return std::isfinite(t); }))
      return in_.refuse_as("found no rotation, or a centre too far away, expected a camera's pose");
    if (auto e = unique(
            points_.count(key) == 0 && images_.emplace(key, problem_.poses.size()).second, key))
      return e;
    std::uint32_t lens = kNone;
    if (with_lens) {
      std::array<double, 5> k{};
      if (auto e = reals(k, "one of fx, fy, cx, cy and the baseline")) return e;
      lens = static_cast<std::uint32_t>(problem_.cameras.size());
      problem_.cameras.push_back({CameraModel::pinhole, {k[0], k[1], k[2], k[3]}});
    }
    problem_.add_image(pose, lens);
    metadata_.image_ids.push_back(key);
    metadata_.stated_rotations.insert(metadata_.stated_rotations.end(), stated.begin(),
                                      stated.end());
    return end();
  }

  Wrong point() {
    std::uint32_t key = 0;
    std::array<double, 3> X{};
    if (auto e = id(key, "the id of a point")) return e;
    if (auto e = reals(X, "a coordinate of a point")) return e;
    if (auto e = unique(
            images_.count(key) == 0 && points_.emplace(key, problem_.num_points()).second, key))
      return e;
    problem_.add_point(X[0], X[1], X[2]);
    metadata_.point_ids.push_back(key);
    return end();
  }

  Wrong parameters() {
    std::uint32_t key = 0;
    std::array<double, 4> k{};
    if (auto e = id(key, "the id of parameters")) return e;
    if (auto e = reals(k, "one of f, cx, cy and the baseline")) return e;
    if (!lenses_.emplace(key, problem_.cameras.size()).second)
      return in_.refuse_as("found parameters " + std::to_string(key) +
                           " a second time, expected ids that differ");
    problem_.cameras.push_back({CameraModel::simple_pinhole, {k[0], k[1], k[2]}});
    return end();
  }

  Wrong edge(bool with_parameters) {
    Edge edge{in_.line_number(), 0, 0, kNone, {}, 1};
    std::array<double, 3> information{};
    if (auto e = id(edge.point, "the id of a point")) return e;
    if (auto e = id(edge.pose, "the id of a camera")) return e;
    if (with_parameters)
      if (auto e = id(edge.parameters, "the id of parameters")) return e;
    if (auto e = reals(edge.uv, "u or v of a measurement")) return e;
    if (auto e = reals(information, "an entry of the information matrix, upper triangle")) return e;
    const auto [a, b, c] = information;
    if (!(a > 0) || b != 0 || a != c)
      return in_.refuse_as(
          "found an information matrix that is no multiple of the identity, expected one: "
          "measurements have one sigma here");
    edge.sigma = a == 1 ? 1 : 1 / std::sqrt(a);
    if (!(edge.sigma > 0) || !std::isfinite(edge.sigma))
      return in_.refuse_as("found an absurd information, expected that of a measurement in pixels");
    edges_.push_back(edge);
    return end();
  }

  Wrong fix() {
    std::uint32_t key = 0;
    for (; !in_.line_ended(); fixed_.push_back(key))
      if (auto e = id(key, "the id of a vertex")) return e;
    return {};
  }

  Wrong place(const Edge& edge) {
    const auto refuse = [&](const char* what, std::uint32_t id) {
      return in_.refuse_at(edge.line, std::string("found ") + what + " " + std::to_string(id) +
                                          " in an edge, expected the id of one in the file");
    };
    const auto point = points_.find(edge.point);
    const auto image = images_.find(edge.pose);
    if (point == points_.end()) return refuse("point", edge.point);
    if (image == images_.end()) return refuse("camera", edge.pose);
    std::uint32_t& lens = problem_.image_camera[image->second];
    std::uint32_t own = lens;
    if (edge.parameters != kNone) {
      const auto at = lenses_.find(edge.parameters);
      if (at == lenses_.end()) return refuse("parameters", edge.parameters);
      own = at->second;
    }
    if (own == kNone) return refuse("a camera without a lens,", edge.pose);
    if (lens != kNone && lens != own) return refuse("a second lens of camera", edge.pose);
    lens = own;
    problem_.add_observation(image->second, point->second, edge.uv[0], edge.uv[1]);
    problem_.observation_sigma.push_back(edge.sigma);
    return {};
  }

  /// Images that observe nothing get some lens.
  void give_lenses() {
    for (std::uint32_t& lens : problem_.image_camera) {
      if (lens != kNone) continue;
      if (problem_.cameras.empty()) problem_.cameras.push_back({CameraModel::simple_pinhole, {1}});
      lens = 0;
    }
    const bool plain =
        std::all_of(problem_.observation_sigma.begin(), problem_.observation_sigma.end(),
                    [](double s) { return s == 1; });
    if (plain) problem_.observation_sigma.clear();
  }

  void note_rest() {
    if (between_ > 0)
      notes_.push_back(std::to_string(between_) + " edges between cameras were left out");
    if (fixed_.empty()) return;
    std::string sentence = "vertices that the file fixes are not held";
    for (std::size_t i = 0; i < fixed_.size(); ++i)
      if (images_.count(fixed_[i]) > 0)
        sentence += (i == 0 ? "; hold them by --fix pose=" : ",pose=") + std::to_string(fixed_[i]);
    notes_.push_back(std::move(sentence));
  }

  Problem take() {
    SourceFiles source;
    source.format = "g2o";
    metadata_.state_hash = state_hash(problem_);
    metadata_.source = std::make_shared<const SourceFiles>(std::move(source));
    problem_.metadata = std::make_shared<const SceneMetadata>(std::move(metadata_));
    return std::move(problem_);
  }

  LineCursor in_;
  std::vector<std::string>& notes_;
  Problem problem_;
  SceneMetadata metadata_;
  std::vector<Edge> edges_;
  std::unordered_map<std::uint32_t, std::uint32_t> images_, points_, lenses_;
  std::vector<std::uint32_t> fixed_;
  std::size_t between_ = 0;
};

}  // namespace

bool is_g2o(std::string_view head) {
  return std::any_of(kFirstWords.begin(), kFirstWords.end(),
                     [&](std::string_view word) { return head.starts_with(word); });
}

Result<Problem> parse_g2o(std::string_view text, const std::string& name,
                          std::vector<std::string>& notes) {
  return Reader(text, name, notes).run();
}

}  // namespace sheaf
