// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/ranks.h"

#include <limits>

namespace sheaf {

Ranks::Ranks(MPI_Comm comm, std::uint32_t pieces) : comm_(comm), pieces_(pieces) {
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &count_);
  const auto count = static_cast<std::uint64_t>(count_);
  for (std::uint64_t r = 0; r <= count; ++r)
    first_.push_back(static_cast<std::uint32_t>(r * pieces_ / count));
  for (int r = 0; r < count_; ++r)
    for (std::uint32_t p = first_piece(r); p < first_piece(r + 1); ++p) rank_of_.push_back(r);
}

std::vector<double> Ranks::gather(std::size_t width, const std::vector<double>& mine) const {
  std::vector<int> counts, begins;
  for (int r = 0; r < count_; ++r) {
    begins.push_back(static_cast<int>(width * first_piece(r)));
    counts.push_back(static_cast<int>(width * (first_piece(r + 1) - first_piece(r))));
  }
  std::vector<double> out(width * pieces_);
  MPI_Allgatherv(mine.data(), static_cast<int>(mine.size()), MPI_DOUBLE, out.data(), counts.data(),
                 begins.data(), MPI_DOUBLE, comm_);
  return out;
}

std::vector<double> Ranks::sum(std::size_t width, const std::vector<double>& mine) const {
  const std::vector<double> all = gather(width, mine);
  std::vector<double> out(width, 0.0);
  for (std::size_t p = 0; p < pieces_; ++p)
    for (std::size_t k = 0; k < width; ++k) out[k] += all[width * p + k];
  return out;
}

double Ranks::max(double mine) const {
  // A NaN must not be lost, whichever way MPI compares it.
  const double given[] = {mine, mine != mine ? 1.0 : 0.0};
  double out[2];
  MPI_Allreduce(given, out, 2, MPI_DOUBLE, MPI_MAX, comm_);
  return out[1] > 0 ? std::numeric_limits<double>::quiet_NaN() : out[0];
}

bool Ranks::any(bool mine) const { return max(mine ? 1 : 0) > 0; }

std::string Ranks::first_text(const std::string& mine) const {
  const int candidate = mine.empty() ? count_ : rank_;
  int from = count_;
  MPI_Allreduce(&candidate, &from, 1, MPI_INT, MPI_MIN, comm_);
  if (from == count_) return {};
  int size = static_cast<int>(mine.size());
  MPI_Bcast(&size, 1, MPI_INT, from, comm_);
  std::string out = mine;
  out.resize(static_cast<std::size_t>(size));
  MPI_Bcast(out.data(), size, MPI_CHAR, from, comm_);
  return out;
}

}  // namespace sheaf
