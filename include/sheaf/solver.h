// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/options.h"
#include "sheaf/problem.h"
#include "sheaf/solve.h"

namespace sheaf {

/// Solves problems of one structure again and again: threads, the arrangement of observations and
/// all memory stay from one solve to the next. For windows that are refined many times a second,
/// for calibration loops and for trials with other noise.
///
/// A problem has the structure of the one before where the same images see the same points through
/// cameras of the same models, rigs and terms are the same, and there are sigmas or there are none.
/// All else may differ: poses, points, parameters of cameras, measurements and sigmas. An
/// observation is switched off by an infinite sigma, and on again by another one. A problem of
/// another structure is arranged anew, and is then the one that is kept.
///
/// The state that comes out has the bits of `solve` with the same arrays and options. A repeated
/// solve allocates nothing, but for what docs/windows.md names.
///
/// A solver is used by one thread at a time.
class Solver {
 public:
  /// The first solve tells what is wrong with the options. lend_observations says nothing.
  explicit Solver(const SolveOptions& options = {});
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  /// Other options; nothing is kept but the threads, and these where their number is the same.
  void set_options(const SolveOptions& options);
  const SolveOptions& options() const;

  /// Refines the problem in place, as `solve` does. The summary is the solver's, until the next
  /// solve. Errors: as `solve`; the next solve then begins from nothing.
  const Summary& solve(Problem& problem);
  Result<const Summary*> try_solve(Problem& problem);

  /// Whether the last solve found its arrangement and its memory kept.
  bool was_kept() const;
  /// Frees all that is kept for the next solve.
  void forget();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// These are the settings that marginalise() linearises with.
struct MarginaliseOptions {
  Fixed fixed{};  ///< as in the solve: what is held has no columns
  /// The loss is as at the solve's end, its scale given. Weights are of the residuals as they are.
  Loss loss{};
};

/// What images and points that leave a problem say of those that stay, as a term of these: a
/// Gaussian over the poses, cameras and points that some row ties to them. The rows are all
/// observations of these points and in these images, and all terms that name them. Cameras leave
/// with the last of their images. Exact where the rows are linear.
///
/// A block that a Gaussian of the problem names keeps that one's state: rows are linearised there
/// (first estimates), so that nothing is learnt along directions that measurements leave free;
/// their residuals are those of the problem's state. The other blocks get the problem's own state.
/// Indices are the problem's. Without blocks: nothing is said.
/// Errors: usage for a problem that `validate` refuses, images of rigs, indices that there are not,
/// a loss without a scale.
Result<GaussianPrior> marginalise(const Problem& problem, const std::vector<std::uint32_t>& images,
                                  const std::vector<std::uint32_t>& points,
                                  const MarginaliseOptions& options = {});

/// Where everything went.
struct Slide {
  static constexpr std::uint32_t kGone = 0xffffffff;
  std::vector<std::uint32_t> image, camera, point;  ///< new index of each old one, or kGone
};

/// Takes images and points out of a problem, with everything that names them, and puts what
/// marginalise() makes of them in its place. The order of what stays is kept. Bounds of cameras
/// that leave go too. Metadata do not follow and are dropped. Errors: as marginalise().
Result<Slide> slide(Problem& problem, const std::vector<std::uint32_t>& images,
                    const std::vector<std::uint32_t>& points,
                    const MarginaliseOptions& options = {});

}  // namespace sheaf
