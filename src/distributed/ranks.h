// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mpi.h>

#include <cstdint>
#include <string>
#include <vector>

namespace sheaf {

/// Which rank works at which pieces: each at consecutive ones. What ranks have to agree on goes
/// through here, piece by piece in the order of the pieces, so that the number of ranks changes no
/// bit.
class Ranks {
 public:
  /// pieces: no fewer than ranks.
  Ranks(MPI_Comm comm, std::uint32_t pieces);

  MPI_Comm comm() const { return comm_; }
  int rank() const { return rank_; }
  int count() const { return count_; }
  std::uint32_t pieces() const { return pieces_; }
  std::uint32_t first_piece(int rank) const { return first_[static_cast<std::size_t>(rank)]; }
  std::uint32_t first_piece() const { return first_piece(rank_); }
  std::uint32_t end_piece() const { return first_piece(rank_ + 1); }
  int rank_of(std::uint32_t piece) const { return rank_of_[piece]; }

  /// mine: `width` numbers of each of this rank's pieces, piece by piece. The sums over all pieces.
  std::vector<double> sum(std::size_t width, const std::vector<double>& mine) const;
  /// The numbers of all pieces, one behind the other.
  std::vector<double> gather(std::size_t width, const std::vector<double>& mine) const;
  double max(double mine) const;
  bool any(bool mine) const;
  /// The first text that is not empty, of the lowest rank that has one; empty: nobody has.
  std::string first_text(const std::string& mine) const;

 private:
  MPI_Comm comm_;
  int rank_ = 0, count_ = 1;
  std::uint32_t pieces_;
  std::vector<std::uint32_t> first_;  ///< one more than ranks
  std::vector<int> rank_of_;          ///< of each piece
};

}  // namespace sheaf
