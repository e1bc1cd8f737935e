// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/loss.h"
#include "lists/lens_tracks.h"
#include "systems/bal_view.h"
#include "systems/camera_state.h"

namespace sheaf {

/// A column of a block of rows.
struct TermPlace {
  std::uint32_t block;
  std::uint8_t column;

  static constexpr std::uint32_t kHeld = 0xffffffff;  ///< no block: the column is held
  bool stands() const { return block != kHeld; }
};

/// Rows without a point that is eliminated: a residual in sigmas and its derivatives by a few
/// camera-side columns. A kind of terms is a class like this one and an entry in make_terms.
class Term {
 public:
  /// What a term's cost is told as.
  enum class Part : std::uint8_t {
    observations,
    centres,
    rotations,
    gravities,
    relative_poses,
    parameters,
    points,
    distances,
    gaussians
  };

  virtual ~Term() = default;
  Part part() const { return part_; }
  /// Where each column of its Jacobian stands.
  const std::vector<TermPlace>& places() const { return places_; }
  std::size_t rows() const { return rows_; }
  /// Its own, or that of the observations.
  ScaledLoss loss(const ScaledLoss& of_observations) const {
    if (part_ == Part::observations) return of_observations;
    return {own_.kind, own_.scale, of_observations.floor};
  }
  /// r, rows() of them, and, unless it is null, J, rows() x places(), row-major.
  virtual void evaluate(const CameraState& at, double* r, double* J) const = 0;

 protected:
  Term(Part part, std::size_t rows, std::vector<TermPlace> places, const TermLoss& own)
      : part_(part), rows_(rows), places_(std::move(places)), own_(own) {}

 private:
  Part part_;
  std::size_t rows_;
  std::vector<TermPlace> places_;
  TermLoss own_;
};

/// Where poses, lenses' parameters and kept points stand among the blocks of rows.
class TermPlaces {
 public:
  /// Of BAL rows, where f, k1, k2 are in the images' blocks; kept points follow them.
  static TermPlaces of_bal(const Problem& problem);
  /// Of rows through lenses of any model.
  static TermPlaces of_lenses(const LensTracks& tracks);
  /// Of blocks of images, then of lenses with a column for each parameter, then of kept points.
  static TermPlaces of_parameters(const Problem& problem);

  std::uint32_t first_kept() const { return first_kept_; }
  void add_pose(std::uint32_t image, std::vector<TermPlace>& to) const;
  /// All parameters of the lens's model; what is held stands at kHeld.
  void add_lens(std::uint32_t lens, std::size_t parameters, std::vector<TermPlace>& to) const;
  void add_kept(std::uint32_t kept, std::vector<TermPlace>& to) const;

  static constexpr TermPlace kHeld{TermPlace::kHeld, 0};

 private:
  std::vector<std::vector<TermPlace>> lens_;  ///< of each parameter
  std::uint32_t first_kept_ = 0;
};

/// All terms of a problem, and the observations of its kept points, `kept`. view: where the state
/// is restated, else null.
std::vector<std::unique_ptr<Term>> make_terms(const Problem& problem, const TermPlaces& places,
                                              const std::vector<std::uint32_t>& kept,
                                              const std::vector<std::uint8_t>& skip,
                                              const BalView* view);

/// The tiles of rows' blocks, row > column, that terms couple; each once, ascending.
std::vector<Tile> tiles_of(const std::vector<std::unique_ptr<Term>>& terms);

}  // namespace sheaf
