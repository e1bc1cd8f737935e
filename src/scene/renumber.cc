// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/renumber.h"

#include <algorithm>

namespace sheaf {
namespace {

using Block = GaussianPrior::Block;

/// Indices that terms have, by what they name; false where one of them is gone.
class Renumbering {
 public:
  explicit Renumbering(const NewNumbers& to) : to_(to) {}

  bool operator()(CentrePrior& of) const { return image(of.image); }
  bool operator()(RotationPrior& of) const { return image(of.image); }
  bool operator()(GravityPrior& of) const { return image(of.image); }
  bool operator()(RelativePosePrior& of) const { return image(of.first) && image(of.second); }
  bool operator()(ParameterPrior& of) const { return camera(of.camera); }
  bool operator()(ParameterBound& of) const { return camera(of.camera); }
  bool operator()(PointPrior& of) const { return point(of.point); }
  bool operator()(DistancePrior& of) const { return point(of.first) && point(of.second); }
  bool operator()(std::uint32_t& kept) const { return point(kept); }
  bool operator()(GaussianPrior& of) const {
    return std::all_of(of.blocks.begin(), of.blocks.end(), [this](Block& block) {
      switch (block.kind) {
        case Block::Kind::pose:
          return image(block.index);
        case Block::Kind::camera:
          return camera(block.index);
        case Block::Kind::point:
          return point(block.index);
      }
      return false;
    });
  }

  template <class Term>
  void all(std::vector<Term>& terms) const {
    std::vector<Term> staying;
    for (Term& term : terms)
      if ((*this)(term)) staying.push_back(std::move(term));
    terms = std::move(staying);
  }

 private:
  static bool take(const std::vector<std::uint32_t>& numbers, std::uint32_t& index) {
    if (numbers.empty()) return true;
    index = numbers[index];
    return index != NewNumbers::kGone;
  }
  bool image(std::uint32_t& index) const { return take(to_.image, index); }
  bool camera(std::uint32_t& index) const { return take(to_.camera, index); }
  bool point(std::uint32_t& index) const { return take(to_.point, index); }

  const NewNumbers& to_;
};

}  // namespace

void renumber(const NewNumbers& to, Terms& terms) {
  const Renumbering renumbering(to);
  renumbering.all(terms.centres);
  renumbering.all(terms.rotations);
  renumbering.all(terms.gravities);
  renumbering.all(terms.relative_poses);
  renumbering.all(terms.parameters);
  renumbering.all(terms.bounds);
  renumbering.all(terms.points);
  renumbering.all(terms.distances);
  renumbering.all(terms.kept_points);
  renumbering.all(terms.gaussians);
}

bool renumber(const NewNumbers& to, GaussianPrior& prior) { return Renumbering(to)(prior); }

}  // namespace sheaf
