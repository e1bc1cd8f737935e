// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace sheaf {

/// Random numbers that are the same bits on every machine: xoshiro256++ (Blackman and Vigna),
/// seeded by splitmix64. Streams of one seed are independent, so that drawing more from one does
/// not move another.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  /// 64 random bits.
  std::uint64_t next();

  /// In [0, 1), a multiple of 2^-53.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// In [0, count), each equally likely; count > 0.
  std::uint64_t below(std::uint64_t count);

  /// Mean 0, standard deviation 1 (Marsaglia's polar method).
  double normal();

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace sheaf
