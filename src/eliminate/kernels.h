// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "geometry/loss.h"
#include "geometry/point_chart.h"
#include "lists/batches.h"
#include "lists/block_layout.h"
#include "lists/chunks.h"
#include "rows/row_layout.h"

namespace sheaf {

struct EliminateInput {
  const Batches* batches;
  const Chunks* chunks;
  const double* cameras;  ///< kCameraRecord per image
  const double* points;   ///< kPointGroup per group
  double damping;         ///< lambda: D = lambda diag(V), clamped as below
  bool points_held;
  ScaledLoss loss{};
  ChartRules chart{};
  /// Of each point, 8 per group: at least this much instead of `damping`; nullptr: none has its
  /// own.
  const double* own_damping = nullptr;
};
/// diag(J^T J) is clamped to this range before it is scaled by lambda.
constexpr double kDiagonalFloor = 1e-6, kDiagonalCeiling = 1e32;

struct EliminateOutput {
  double* factors;                ///< kFactorGroup per group
  double square_sum;              ///< sum |r|^2
  double point_decrease;          ///< sum |w|^2
  double gradient_max2;           ///< largest |w|^2 of a point
  double loss_sum = 0;            ///< sum rho(|r|^2); not summed without a loss
  double* metric = nullptr;       ///< kMetricBatch per batch; not written without a loss
  double* point_costs = nullptr;  ///< sum rho of each point, 8 per group; likewise
};

/// Once the cameras have stepped and the points followed by back-substitution, each point takes
/// Gauss-Newton steps by itself, its cameras held: cheap, and what the linear model got wrong about
/// the point is mended before the cost is judged ("embedded point iterations": Jeong, Nister,
/// Steedly, Szeliski, Kweon, Pushing the Envelope of Modern Methods for Bundle Adjustment, 2012).
/// A step that does not lower the point's own cost is not taken. Decreases are of sum |r|^2 (or rho
/// of it), as the point's own linear model predicts them, in mean_square by observation of the
/// point.
/// With a loss these are a Levenberg-Marquardt of its own: from where the step leads or, should
/// that have made the point worse than it was, from the cheaper of this and where it was, steps by
/// the loss's metric, by the weight alone where such a step fails, and with ten times the damping
/// where that fails too; each may take kTries tries for one of `inner_iterations`. A point that the
/// step made worse than where it was damps itself by more in the elimination to come, and by less
/// again after each step that served it.
namespace inner_iterations {
constexpr double kWorthOne = 1e-4;  ///< smaller decreases are left to the next iteration
constexpr double kWorthMore = 0.1;  ///< after a larger one, another step is looked at
/// Of the step's own D. Measured: 1 costs iterations, 0.1 led ladybug-49 into a worse minimum from
/// some starting dampings.
constexpr double kDamping = 0.3;
/// In a chart a point that the step leaves worse than this, and worse than if it had only followed
/// its base, follows its base: its distance is damped by what is seen of it, which may be little,
/// and a long step can end anywhere, in a camera's plane too.
constexpr double kLost = 1e4;
constexpr int kTries = 3;
/// Own damping: the least of a point that fell back, and of one whose steps fail.
constexpr double kLeastOwn = 1e-4;
/// Decreases that are worth a pass, in the last step's relative decrease of the whole cost: points
/// settle as the cameras do. Never more than kWorthOne.
constexpr double kWorthOfLast = 0.01, kLeastWorth = 1e-14;
/// Of a point that has fallen back to where it was, or followed its step; lambda: the common one.
inline double next_own_damping(bool fell, double lambda, double own) {
  const double most = own > lambda ? own : lambda;
  if (fell) return 10 * most > kLeastOwn ? 10 * most : kLeastOwn;
  return 0.1 * own < lambda ? 0 : 0.1 * own;
}
}  // namespace inner_iterations

/// What a point's own iterations go by under a loss.
struct OwnIterations {
  const double* held_costs =
      nullptr;         ///< of the points at the held state, as elimination left them
  double damping = 0;  ///< lambda of the step
  double worth = inner_iterations::kWorthOne;  ///< smaller decreases are left
};

/// The step of a point: `newton` times what back-substitution gives and `descent` times D^-1 g; of
/// points by X, Y, Z only.
struct PointBlend {
  double newton = 1, descent = 0;
  double inner_damping = inner_iterations::kDamping;
  bool plain() const { return newton == 1 && descent == 0; }
};

struct TrialInput {
  const Batches* batches;
  const double* cameras;        ///< held state, with the step
  const double* trial_cameras;  ///< stepped
  const double* points;
  const double* factors;
  bool count_newly_behind;
  int inner_iterations;  ///< at most, of each point
  double mean_square;    ///< sum |r|^2, or rho of it, at the held state by observation
  ScaledLoss loss{};
  const double* metric = nullptr;  ///< as elimination left it; nullptr: no loss
  ChartRules chart{};              ///< as in elimination; ChartBase::none where points are held
  PointBlend blend{};
  OwnIterations own{};
};

struct TrialOutput {
  double* points;                 ///< stepped
  double square_sum;              ///< sum |r|^2 at the stepped state
  double damping_term;            ///< sum d^T D d over points, d as back-substituted
  double step2_max;               ///< largest |d|^2 / |X|^2 of a point, or chart_step2
  std::uint64_t newly_behind;     ///< observations behind their camera that were not (if asked for)
  double loss_sum = 0;            ///< sum rho(|r|^2) there; not summed without a loss
  double left_decrease = 0;       ///< sum |w|^2 of the points that did not follow the step
  double* own_damping = nullptr;  ///< as EliminateInput; read and, with a loss, written
};

/// x is the step in the camera records.
struct ProductInput {
  const Batches* batches;
  const double* cameras;  ///< held state, with x as the step
  const double* points;
  const double* factors;
  const double* metric = nullptr;  ///< as elimination left it; nullptr: no loss
};
/// The same in single precision. Lengths are what the scene's are after (X - origin) scale, so that
/// neither the place of the scene nor its unit can take digits or leave the range of floats.
struct FloatProductInput {
  const Batches* batches;
  const float* cameras;   ///< kFloatCameraRecord per image, in these lengths, with x as the step
  const double* points;   ///< as they are
  const double* factors;  ///< as they are
  double origin[3], scale;
  const double* metric = nullptr;  ///< as elimination left it; nullptr: no loss
};
struct CoarseInput {
  const double* basis;          ///< kCoarseBasis per image
  const std::int32_t* cluster;  ///< of each image; -1: of none
  const std::int32_t* tile;     ///< of a pair of clusters row >= column, by triangle
  std::int32_t clusters;
};

/// Doubles of scratch for any of these chunks, and the records laid out in it.
std::size_t scratch_doubles(const Batches& batches, const Chunks& chunks);
Records records_in(double* scratch, const Chunks& chunks);
/// Doubles of `saved` that a product needs; as many bytes for one in floats.
std::size_t product_scratch_doubles(const Batches& batches);
/// Clusters that any one point can touch, and the doubles of scratch that coarse sums need.
inline std::size_t coarse_scratch_clusters(const Batches& batches, std::int32_t clusters) {
  const auto all = static_cast<std::uint32_t>(clusters);
  return all < batches.longest_track ? all : batches.longest_track;
}
std::size_t coarse_scratch_doubles(const Batches& batches, std::int32_t clusters);

/// One instruction set's hot kernels over one chunk. docs/math.md has the algebra.
struct Kernels {
  const char* name;
  bool fused;  ///< uses fused multiply-add: agrees bit for bit with the others that do

  /// Linearises the chunk, factors its points' blocks and writes the records; adds to `out`.
  void (*linearize)(const EliminateInput&, const Chunk&, const Records&, EliminateOutput& out);
  /// Adds the records' products to the diagonal blocks and the right-hand side of a slice.
  void (*diagonal)(const Batches&, const Chunks&, const Chunk&, const Records&, double* diagonal);
  /// Adds the records' products to the off-diagonal blocks of a slice.
  void (*pairs)(const Chunks&, const Chunk&, const Records&, double* tiles);
  /// Adds Z^T of the records' products Z to the coarse sums of a slice: those of all pairs of
  /// observations of one point, but none with itself. scratch: coarse_scratch_doubles.
  void (*coarse)(const Batches&, const Chunk&, const Records&, const CoarseInput&, double* scratch,
                 double* sums);
  /// Back-substitutes the chunk's points and evaluates the cost there; adds to `out`.
  void (*trial)(const TrialInput&, const Chunk&, TrialOutput& out);
  /// y += (U - W (V + D)^-1 W^T) x of the chunk's points, kProductRecord doubles per image.
  void (*product)(const ProductInput&, const Chunk&, double* saved, double* y);
  /// The same with all but the sums over images in single precision; y_rho per `scale`d length.
  void (*product_float)(const FloatProductInput&, const Chunk&, float* saved, double* y);
  /// |r_x| of a batch's eight lanes, then |r_y|, 16 per batch of the chunk.
  void (*residuals)(const Batches&, const double* cameras, const double* points, const Chunk&,
                    double* out);
  /// Sum |r|^2 of the chunk.
  double (*square_sum)(const Batches&, const double* cameras, const double* points, const Chunk&);
  /// Observations of the chunk whose point lies behind its camera (P.z > 0).
  std::uint64_t (*count_behind)(const Batches&, const double* cameras, const double* points,
                                const Chunk&);
};

}  // namespace sheaf
