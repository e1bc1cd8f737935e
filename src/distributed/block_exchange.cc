// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/block_exchange.h"

#include <algorithm>
#include <numeric>

#include "distributed/petsc_check.h"

namespace sheaf {

BlockExchange::BlockExchange(const Ranks& ranks, const std::vector<std::uint32_t>& owned,
                             const std::vector<std::vector<Ghost>>& ghosts)
    : rank_(ranks.rank()) {
  // Everybody knows where the owned blocks of every piece stand at its rank.
  const std::vector<double> counts = ranks.gather(1, {owned.begin(), owned.end()});
  std::vector<std::size_t> first(ranks.pieces());
  for (int r = 0; r < ranks.count(); ++r) {
    std::size_t at = 0;
    for (std::uint32_t p = ranks.first_piece(r); p < ranks.first_piece(r + 1); ++p) {
      first[p] = at;
      at += static_cast<std::size_t>(counts[p]);
    }
  }
  std::vector<PetscSFNode> from;
  for (std::size_t k = 0; k < owned.size(); ++k) {
    first_owned_.push_back(first_owned_.back() + owned[k]);
    first_ghost_.push_back(first_ghost_.back() + ghosts[k].size());
    for (const Ghost& ghost : ghosts[k]) {
      const int rank = ranks.rank_of(ghost.piece);
      from.push_back({rank, static_cast<PetscInt>(first[ghost.piece] + ghost.index)});
      remote_ += rank != rank_;
    }
  }
  petsc_check(PetscSFCreate(ranks.comm(), &out_));
  petsc_check(PetscSFSetGraph(out_, static_cast<PetscInt>(this->owned()),
                              static_cast<PetscInt>(from.size()), nullptr, PETSC_COPY_VALUES,
                              from.data(), PETSC_COPY_VALUES));
  petsc_check(PetscSFSetFromOptions(out_));
  petsc_check(PetscSFSetUp(out_));
  make_way_back(ranks, from);
}

/// Each rank tells owners where their ghosts are; an owner sorts what it is told by rank and place
/// there, which is the order of the pieces.
void BlockExchange::make_way_back(const Ranks& ranks, const std::vector<PetscSFNode>& ghosts) {
  const auto count = static_cast<std::size_t>(ranks.count());
  std::vector<std::vector<int>> asks(count);  // root, leaf
  for (std::size_t i = 0; i < ghosts.size(); ++i) {
    auto& to = asks[static_cast<std::size_t>(ghosts[i].rank)];
    to.push_back(static_cast<int>(ghosts[i].index));
    to.push_back(static_cast<int>(i));
  }
  std::vector<int> sizes(count), got(count), begins(count, 0), places(count, 0), sent;
  for (std::size_t r = 0; r < count; ++r) {
    sizes[r] = static_cast<int>(asks[r].size());
    sent.insert(sent.end(), asks[r].begin(), asks[r].end());
  }
  MPI_Alltoall(sizes.data(), 1, MPI_INT, got.data(), 1, MPI_INT, ranks.comm());
  for (std::size_t r = 1; r < count; ++r) {
    begins[r] = begins[r - 1] + sizes[r - 1];
    places[r] = places[r - 1] + got[r - 1];
  }
  std::vector<int> told(static_cast<std::size_t>(places.back() + got.back()));
  MPI_Alltoallv(sent.data(), sizes.data(), begins.data(), MPI_INT, told.data(), got.data(),
                places.data(), MPI_INT, ranks.comm());
  struct Share {
    int root, rank, leaf;
  };
  std::vector<Share> shares;
  for (std::size_t r = 0; r < count; ++r)
    for (int i = places[r]; i < places[r] + got[r]; i += 2)
      shares.push_back({told[static_cast<std::size_t>(i)], static_cast<int>(r),
                        told[static_cast<std::size_t>(i) + 1]});
  std::stable_sort(shares.begin(), shares.end(),
                   [](const Share& a, const Share& b) { return a.root < b.root; });
  std::vector<PetscSFNode> from;
  std::size_t next = 0;
  for (std::size_t i = 0; i < owned(); ++i) {
    for (; next < shares.size() && static_cast<std::size_t>(shares[next].root) == i; ++next)
      from.push_back({shares[next].rank, shares[next].leaf});
    first_share_.push_back(from.size());
  }
  petsc_check(PetscSFCreate(ranks.comm(), &back_));
  petsc_check(PetscSFSetGraph(back_, static_cast<PetscInt>(this->ghosts()),
                              static_cast<PetscInt>(from.size()), nullptr, PETSC_COPY_VALUES,
                              from.data(), PETSC_COPY_VALUES));
  petsc_check(PetscSFSetFromOptions(back_));
  petsc_check(PetscSFSetUp(back_));
}

BlockExchange::~BlockExchange() {
  for (auto& [width, type] : types_) MPI_Type_free(&type);
  PetscSFDestroy(&out_);
  PetscSFDestroy(&back_);
}

MPI_Datatype BlockExchange::blocks_of(int width) {
  const auto [at, added] = types_.try_emplace(width, MPI_DATATYPE_NULL);
  if (added) {
    MPI_Type_contiguous(width, MPI_DOUBLE, &at->second);
    MPI_Type_commit(&at->second);
  }
  return at->second;
}

void BlockExchange::run(PetscSF forest, int width, const double* from, double* to) {
  const MPI_Datatype type = blocks_of(width);
  petsc_check(PetscSFBcastBegin(forest, type, from, to, MPI_REPLACE));
  petsc_check(PetscSFBcastEnd(forest, type, from, to, MPI_REPLACE));
  bytes_ += sizeof(double) * static_cast<std::uint64_t>(width) * remote_;
}

void BlockExchange::to_ghosts(int width, const double* owned, double* ghosts) {
  run(out_, width, owned, ghosts);
}

void BlockExchange::add_shares(int width, const double* ghosts, double* owned) {
  const auto wide = static_cast<std::size_t>(width);
  shares_.resize(first_share_.back() * wide);
  run(back_, width, ghosts, shares_.data());
  for (std::size_t i = 0; i < this->owned(); ++i)
    for (std::size_t s = first_share_[i]; s < first_share_[i + 1]; ++s)
      for (std::size_t k = 0; k < wide; ++k) owned[wide * i + k] += shares_[wide * s + k];
}

}  // namespace sheaf
