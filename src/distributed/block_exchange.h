// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <petscsf.h>

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "distributed/ranks.h"
#include "pieces/scene_piece.h"

namespace sheaf {

/// Camera blocks of this rank: those that its pieces own stand one piece behind the other, and so
/// do its ghosts. State and steps go from owners to ghosts; shares of sums go back and are added in
/// the order of the pieces. Nothing else of the vectors ever moves.
class BlockExchange {
 public:
  /// Of each of this rank's pieces, how many blocks it owns and where its ghosts are among those of
  /// their owners.
  BlockExchange(const Ranks& ranks, const std::vector<std::uint32_t>& owned,
                const std::vector<std::vector<Ghost>>& ghosts);
  ~BlockExchange();
  BlockExchange(const BlockExchange&) = delete;
  BlockExchange& operator=(const BlockExchange&) = delete;

  std::size_t owned() const { return first_owned_.back(); }
  std::size_t ghosts() const { return first_ghost_.back(); }
  /// Of the rank's k-th piece, its first owned block and its first ghost.
  std::size_t first_owned(std::size_t k) const { return first_owned_[k]; }
  std::size_t first_ghost(std::size_t k) const { return first_ghost_[k]; }

  /// width numbers a block.
  void to_ghosts(int width, const double* owned, double* ghosts);
  /// Adds the ghosts' shares to what the owners have.
  void add_shares(int width, const double* ghosts, double* owned);

  /// Ghosts whose owner is at another rank: what a message is paid for.
  std::uint64_t remote_ghosts() const { return remote_; }
  std::uint64_t bytes_sent() const { return bytes_; }

 private:
  void run(PetscSF forest, int width, const double* from, double* to);
  MPI_Datatype blocks_of(int width);
  void make_way_back(const Ranks& ranks, const std::vector<PetscSFNode>& ghosts);

  int rank_;
  PetscSF out_ = nullptr, back_ = nullptr;
  std::map<int, MPI_Datatype> types_;
  std::vector<std::size_t> first_owned_{0}, first_ghost_{0};
  std::vector<std::size_t> first_share_{0};  ///< of each owned block
  std::vector<double> shares_;
  std::uint64_t remote_ = 0, bytes_ = 0;
};

}  // namespace sheaf
