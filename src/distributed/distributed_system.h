// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "distributed/block_exchange.h"
#include "distributed/krylov.h"
#include "distributed/rank_piece.h"
#include "distributed/ranks.h"
#include "platform/parallel.h"
#include "sheaf/options.h"
#include "systems/system.h"

namespace sheaf {

struct DistributedOptions {
  SolveOptions solve;
  /// What is held of a piece's problem; null: what solve.fixed says of all of its kind.
  std::function<Result<Fixed>(const Problem&)> fixed{};
};

/// The home of a scene in pieces on several machines: each rank works at its pieces' points, and
/// camera vectors lie with the images' owners. What ranks tell each other are the step of ghost
/// images and their shares of sums, kWidth numbers a block each way and product, and scalars. The
/// pieces fix the order of every sum: the number of ranks and of threads changes no bit.
class DistributedSystem : public System {
 public:
  /// Reads this rank's pieces. Errors, the same at every rank: usage for what it does not know,
  /// naming it; unreadable_input; memory_limit. Throws std::bad_alloc and std::runtime_error.
  static Result<std::unique_ptr<DistributedSystem>> make(const Ranks& ranks,
                                                         const std::filesystem::path& folder,
                                                         const DistributedOptions& options,
                                                         const Kernels& kernels, Threads& threads);

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;

  /// Writes this rank's pieces with the held state. Errors, the same at every rank:
  /// unwritable_output.
  Result<void> store(const std::filesystem::path& folder);

  std::uint64_t images() const { return images_; }
  std::uint64_t points() const { return scene_points_; }
  std::uint64_t observations() const { return observations_; }
  const PointChoice& point_choice() const { return choice_; }
  const BlockExchange& exchange() const { return *exchange_; }
  /// What this rank's pieces hold.
  std::uint64_t bytes() const;

 private:
  explicit DistributedSystem(const Ranks& ranks) : ranks_(ranks) {}
  Result<void> load(const std::filesystem::path& folder, const DistributedOptions& options,
                    const Kernels& kernels, Threads& threads);
  Result<std::vector<ScenePiece>> read(const std::filesystem::path& folder) const;
  Result<void> make_pieces(std::vector<ScenePiece> files, const PieceRules& rules,
                           const Kernels& kernels, Threads& threads);
  PieceRules rules_for(const std::vector<ScenePiece>& files, const DistributedOptions& options);
  void number_blocks();
  void place_charts();
  void eliminate(const StepRequest& request);
  double gather();
  void add_shares_of_sums();
  bool solve(const StepRequest& request, Step& step);
  void multiply(const double* x, double* y);
  void precondition(const double* r, double* z);
  double step_cameras(double stretch);

  const Ranks& ranks_;
  std::vector<std::unique_ptr<RankPiece>> pieces_;
  std::unique_ptr<BlockExchange> exchange_;
  std::unique_ptr<Krylov> krylov_;
  PointChoice choice_;
  bool floats_ = false;  ///< products in single precision, until StepRequest::precise
  std::uint64_t images_ = 0, scene_points_ = 0, observations_ = 0;

  // Of the last proposal. By piece:
  std::vector<std::vector<double>> sums_;      ///< RankPiece::kSums per block, with all shares
  std::vector<CameraVectors> vectors_;         ///< by column; those of ghosts say nothing
  std::vector<Buffer<double>> damping_;        ///< by column
  std::vector<Buffer<double>> columns_, out_;  ///< scratch by column
  // By owned block, RankPiece::kWidth each:
  std::vector<double> rhs_, owned_damping_, step_, ghosts_, shares_;
  StepRequest request_;
  ScaledLoss loss_;
  double point_decrease_ = 0, mean_square_ = 0;
};

}  // namespace sheaf
