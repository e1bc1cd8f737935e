// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/random.h"

#include <bit>
#include <cmath>

#include "platform/portable_math.h"

namespace sheaf {
namespace {

std::uint64_t splitmix64(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  // The stream is hashed before it meets the seed: (seed + 1, 0) is then not (seed, 1).
  std::uint64_t state = seed;
  if (stream != 0) state ^= splitmix64(stream);
  for (std::uint64_t& word : state_) word = splitmix64(state);
}

std::uint64_t Random::next() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t shifted = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

std::uint64_t Random::below(std::uint64_t count) {
  const std::uint64_t excess = (0 - count) % count;  // 2^64 mod count
  std::uint64_t bits = next();
  while (bits < excess) bits = next();
  return bits % count;
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double x, y, n;
  do {
    x = 2 * uniform() - 1;
    y = 2 * uniform() - 1;
    n = x * x + y * y;
  } while (n >= 1 || n == 0);
  const double scale = std::sqrt(-2 * portable_log(n) / n);
  spare_ = y * scale;
  has_spare_ = true;
  return x * scale;
}

}  // namespace sheaf
