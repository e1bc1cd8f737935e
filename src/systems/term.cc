// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/term.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/camera_model.h"
#include "geometry/motion_log.h"
#include "scene/terms.h"
#include "systems/pose_terms.h"

namespace sheaf {
namespace {

using Kind = GaussianPrior::Block::Kind;

std::vector<TermPlace> pose_places(const TermPlaces& places, std::uint32_t image) {
  std::vector<TermPlace> out;
  places.add_pose(image, out);
  return out;
}

std::vector<TermPlace> kept_places(const TermPlaces& places,
                                   const std::vector<std::uint32_t>& kept) {
  std::vector<TermPlace> out;
  for (const std::uint32_t k : kept) places.add_kept(k, out);
  return out;
}

/// U (X - position) of a kept point.
class KeptPriorTerm : public Term {
 public:
  KeptPriorTerm(const PointPrior& prior, std::uint32_t kept, const TermPlaces& places)
      : Term(Part::points, 3, kept_places(places, {kept}), {}),
        kept_(kept),
        position_(prior.position),
        U_(*whitening(prior.covariance)) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    Vector3<double> e = at.kept[kept_];
    for (std::size_t k = 0; k < 3; ++k) e[k] -= position_[k];
    const Vector3<double> whitened = multiply(U_, e);
    std::copy(whitened.begin(), whitened.end(), r);
    if (J != nullptr) std::copy(U_.begin(), U_.end(), J);
  }

 private:
  std::uint32_t kept_;
  std::array<double, 3> position_;
  std::array<double, 9> U_;
};

/// (|a - b| - distance) / sigma. Where both points are in one place it has no direction.
class DistanceTerm : public Term {
 public:
  DistanceTerm(const DistancePrior& prior, std::uint32_t a, std::uint32_t b,
               const TermPlaces& places)
      : Term(Part::distances, 1, kept_places(places, {a, b}), prior.loss),
        a_(a),
        b_(b),
        prior_(prior) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const Vector3<double>&a = at.kept[a_], &b = at.kept[b_];
    const Vector3<double> d{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    r[0] = (length - prior_.distance) / prior_.sigma;
    if (J == nullptr) return;
    for (std::size_t k = 0; k < 3; ++k) {
      J[k] = length > 0 ? d[k] / (length * prior_.sigma) : 0;
      J[3 + k] = -J[k];
    }
  }

 private:
  std::uint32_t a_, b_;
  DistancePrior prior_;
};

/// S (d - mean), d the blocks' differences from their states.
class GaussianTerm : public Term {
 public:
  struct Block {
    GaussianPrior::Block of;
    std::uint32_t kept = 0;  ///< of a point
    std::size_t columns = 0;
  };
  GaussianTerm(const GaussianPrior& prior, std::vector<Block> blocks, std::vector<TermPlace> places,
               std::size_t rows)
      : Term(Part::gaussians, rows, std::move(places), prior.loss),
        prior_(prior),
        blocks_(std::move(blocks)) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const std::size_t columns = places().size();
    for (std::size_t row = 0; row < rows(); ++row) {
      r[row] = 0;
      for (std::size_t k = 0; k < columns && !prior_.mean.empty(); ++k)
        r[row] -= prior_.square_root[row * columns + k] * prior_.mean[k];
    }
    if (J != nullptr) std::copy(prior_.square_root.begin(), prior_.square_root.end(), J);
    std::size_t first = 0;
    for (const Block& block : blocks_) {
      const std::vector<double> d = difference(block, at);
      for (std::size_t row = 0; row < rows(); ++row)
        for (std::size_t k = 0; k < block.columns; ++k)
          r[row] += prior_.square_root[row * columns + first + k] * d[k];
      if (J != nullptr && block.of.kind == Kind::pose) turn_columns(d, first, J);
      first += block.columns;
    }
  }

 private:
  static RigidMotion<double> motion_of(const std::vector<double>& state) {
    return {{state[0], state[1], state[2], state[3]}, {state[4], state[5], state[6]}};
  }
  static std::vector<double> difference(const Block& block, const CameraState& at) {
    const std::vector<double>& state = block.of.state;
    if (block.of.kind == Kind::pose) {
      const auto d = log_of(composed(at.poses[block.of.index], inverse(motion_of(state))));
      return {d.begin(), d.end()};
    }
    std::vector<double> d(block.columns);
    for (std::size_t k = 0; k < d.size(); ++k)
      d[k] = (block.of.kind == Kind::camera ? at.sets[block.of.index][k] : at.kept[block.kept][k]) -
             state[k];
    return d;
  }
  /// Columns by d of a pose to those by a step of it.
  void turn_columns(const std::vector<double>& d, std::size_t first, double* J) const {
    const auto by_step = inverse_left_jacobian({d[0], d[1], d[2], d[3], d[4], d[5]});
    const std::size_t columns = places().size();
    for (std::size_t row = 0; row < rows(); ++row) {
      double* of_row = J + row * columns + first;
      std::array<double, 6> turned{};
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t k = 0; k < 6; ++k) turned[k] += of_row[i] * by_step[6 * i + k];
      std::copy(turned.begin(), turned.end(), of_row);
    }
  }

  GaussianPrior prior_;
  std::vector<Block> blocks_;
};

/// The reprojection of a kept point.
class KeptObservation : public Term {
 public:
  struct Sight {
    std::uint32_t image, lens, kept;
    CameraModel model;
    std::array<double, 2> xy;
    double inverse_sigma;
  };
  KeptObservation(const Sight& sight, std::vector<TermPlace> places)
      : Term(Part::observations, 2, std::move(places), {}), sight_(sight) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const RigidMotion<double>& pose = at.poses[sight_.image];
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    Vector3<double> P = multiply(R, at.kept[sight_.kept]);
    for (std::size_t k = 0; k < 3; ++k) P[k] += pose.translation[k];
    Camera camera;
    camera.model = sight_.model;
    camera.parameters = at.sets[sight_.lens];
    const LensJacobian<double> j = project_with_jacobian(camera, P);
    const std::array<double, 2> e = residual(camera, j.pixel, sight_.xy.data());
    const std::size_t columns = places().size(), parameters = columns - 9;
    for (std::size_t row = 0; row < 2; ++row) {
      r[row] = sight_.inverse_sigma * e[row];
      if (J == nullptr) continue;
      double* to = J + row * columns;
      const Vector3<double> a = j.point[row], turn = cross(P, a);
      for (std::size_t k = 0; k < 3; ++k) {
        to[k] = a[k], to[3 + k] = turn[k];
        to[6 + parameters + k] = a[0] * R[k] + a[1] * R[3 + k] + a[2] * R[6 + k];
      }
      for (std::size_t p = 0; p < parameters; ++p) to[6 + p] = j.parameters[row][p];
      for (std::size_t k = 0; k < columns; ++k) to[k] *= sight_.inverse_sigma;
    }
  }

 private:
  Sight sight_;
};

std::uint32_t number_of(const std::vector<std::uint32_t>& kept, std::uint32_t point) {
  return static_cast<std::uint32_t>(std::lower_bound(kept.begin(), kept.end(), point) -
                                    kept.begin());
}

std::unique_ptr<Term> gaussian_term(const Problem& problem, const GaussianPrior& prior,
                                    const TermPlaces& places,
                                    const std::vector<std::uint32_t>& kept) {
  std::vector<GaussianTerm::Block> blocks;
  std::vector<TermPlace> at;
  for (const GaussianPrior::Block& of : prior.blocks) {
    GaussianTerm::Block block{of};
    const std::size_t before = at.size();
    if (of.kind == Kind::pose) places.add_pose(of.index, at);
    if (of.kind == Kind::camera)
      places.add_lens(of.index, parameter_count(problem.cameras[of.index].model), at);
    if (of.kind == Kind::point) {
      block.kept = number_of(kept, of.index);
      places.add_kept(block.kept, at);
    }
    block.columns = at.size() - before;
    blocks.push_back(std::move(block));
  }
  const std::size_t rows = prior.square_root.size() / at.size();
  return std::make_unique<GaussianTerm>(prior, std::move(blocks), std::move(at), rows);
}

void add_observations(const Problem& problem, const TermPlaces& places,
                      const std::vector<std::uint32_t>& kept, const std::vector<std::uint8_t>& skip,
                      const BalView* view, std::vector<std::unique_ptr<Term>>& out) {
  if (kept.empty()) return;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t point = problem.observation_point[i];
    if ((!skip.empty() && skip[i] != 0) || !std::binary_search(kept.begin(), kept.end(), point))
      continue;
    if (!problem.observation_sigma.empty() && std::isinf(problem.observation_sigma[i])) continue;
    const std::uint32_t image = problem.observation_image[i], lens = problem.image_camera[image];
    KeptObservation::Sight sight{
        image,
        lens,
        number_of(kept, point),
        view ? CameraModel::bal : problem.cameras[lens].model,
        {problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]},
        problem.observation_sigma.empty() ? 1 : 1 / problem.observation_sigma[i]};
    if (view != nullptr) sight.xy = view->turned(problem, image, sight.xy);
    std::vector<TermPlace> at = pose_places(places, image);
    places.add_lens(lens, parameter_count(sight.model), at);
    places.add_kept(sight.kept, at);
    out.push_back(std::make_unique<KeptObservation>(sight, std::move(at)));
  }
}

}  // namespace

TermPlaces TermPlaces::of_bal(const Problem& problem) {
  TermPlaces out;
  out.lens_.resize(problem.cameras.size());
  for (std::uint32_t i = 0; i < problem.num_images(); ++i) {
    std::vector<TermPlace>& lens = out.lens_[problem.image_camera[i]];
    for (std::uint8_t k = 0; lens.size() < 3; ++k)
      lens.push_back({i, static_cast<std::uint8_t>(6 + k)});
  }
  out.first_kept_ = static_cast<std::uint32_t>(problem.num_images());
  return out;
}

TermPlaces TermPlaces::of_lenses(const LensTracks& tracks) {
  TermPlaces out;
  out.lens_.resize(tracks.lenses.size());
  for (std::uint32_t i = 0; i < tracks.image_lens.size(); ++i) {
    const LensPlaces& lens = tracks.lenses[tracks.image_lens[i]];
    std::vector<TermPlace>& places = out.lens_[tracks.image_lens[i]];
    places.clear();
    for (const std::int8_t place : lens.place) {
      const int beyond = place - LensPlaces::kRiders;
      if (place < 0)
        places.push_back(kHeld);
      else if (beyond < 0)
        places.push_back({i, static_cast<std::uint8_t>(6 + place)});
      else
        places.push_back({lens.first_block + static_cast<std::uint32_t>(beyond / 9),
                          static_cast<std::uint8_t>(beyond % 9)});
    }
  }
  out.first_kept_ = tracks.num_blocks;
  return out;
}

TermPlaces TermPlaces::of_parameters(const Problem& problem) {
  TermPlaces out;
  auto block = static_cast<std::uint32_t>(problem.num_images());
  for (const Camera& camera : problem.cameras) {
    std::vector<TermPlace>& places = out.lens_.emplace_back();
    for (std::uint8_t p = 0; p < parameter_count(camera.model); ++p) places.push_back({block, p});
    ++block;
  }
  out.first_kept_ = block;
  return out;
}

void TermPlaces::add_pose(std::uint32_t image, std::vector<TermPlace>& to) const {
  for (std::uint8_t k = 0; k < 6; ++k) to.push_back({image, k});
}

void TermPlaces::add_lens(std::uint32_t lens, std::size_t parameters,
                          std::vector<TermPlace>& to) const {
  for (std::size_t p = 0; p < parameters; ++p)
    to.push_back(p < lens_[lens].size() ? lens_[lens][p] : kHeld);
}

void TermPlaces::add_kept(std::uint32_t kept, std::vector<TermPlace>& to) const {
  for (std::uint8_t k = 0; k < 3; ++k) to.push_back({first_kept_ + kept, k});
}

std::vector<Tile> tiles_of(const std::vector<std::unique_ptr<Term>>& terms) {
  std::vector<std::uint64_t> keys;
  for (const auto& term : terms)
    for (const TermPlace& a : term->places())
      for (const TermPlace& b : term->places())
        if (a.stands() && b.stands() && a.block > b.block)
          keys.push_back(std::uint64_t(a.block) << 32 | b.block);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<Tile> out;
  for (const std::uint64_t key : keys)
    out.push_back({static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)});
  return out;
}

std::vector<std::unique_ptr<Term>> make_terms(const Problem& problem, const TermPlaces& places,
                                              const std::vector<std::uint32_t>& kept,
                                              const std::vector<std::uint8_t>& skip,
                                              const BalView* view) {
  std::vector<std::unique_ptr<Term>> out;
  add_observations(problem, places, kept, skip, view, out);
  const Terms& terms = problem.terms;
  add_pose_terms(problem, places, view, out);
  for (const PointPrior& of : terms.points)
    if (std::binary_search(kept.begin(), kept.end(), of.point))
      out.push_back(std::make_unique<KeptPriorTerm>(of, number_of(kept, of.point), places));
  for (const DistancePrior& of : terms.distances)
    out.push_back(std::make_unique<DistanceTerm>(of, number_of(kept, of.first),
                                                 number_of(kept, of.second), places));
  for (const GaussianPrior& of : terms.gaussians)
    out.push_back(gaussian_term(problem, of, places, kept));
  return out;
}

}  // namespace sheaf
