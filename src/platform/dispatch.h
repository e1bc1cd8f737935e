// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The choice of the instruction set. A file of kernels has, in the namespace of each set that it is
// compiled for, a constexpr function that makes that set's table, a struct that begins with the
// set's name. Included before <hwy/...>.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "platform/simd_targets.h"
// After simd_targets.h:
#include <hwy/detect_targets.h>

#if HWY_TARGETS & HWY_AVX3
#define SHEAF_AVX512_TABLE(make) N_AVX3::make(),
#else
#define SHEAF_AVX512_TABLE(make)
#endif
#if HWY_TARGETS & HWY_AVX2
#define SHEAF_AVX2_TABLE(make) N_AVX2::make(),
#else
#define SHEAF_AVX2_TABLE(make)
#endif
#if HWY_TARGETS & HWY_SSE4
#define SHEAF_SSE4_TABLE(make) N_SSE4::make(),
#else
#define SHEAF_SSE4_TABLE(make)
#endif
/// The tables of all sets that a file is compiled for, the best first, where HWY_ONCE is true:
///   static constexpr Table tables[] = SHEAF_TABLES(make);
/// They are constants: to make one must not run a set's instructions, which a machine may lack.
#define SHEAF_TABLES(make)                                                    \
  {                                                                           \
    SHEAF_AVX512_TABLE(make)                                                  \
    SHEAF_AVX2_TABLE(make) SHEAF_SSE4_TABLE(make) HWY_STATIC_DISPATCH(make)() \
  }

namespace sheaf {

struct InstructionSet {
  const char* name;
  std::int64_t target;  ///< as Highway numbers it
};
constexpr InstructionSet kInstructionSets[] = {
#if defined(__aarch64__)
    {"neon", HWY_STATIC_TARGET},  // whichever of Highway's kinds of NEON
#endif
    {"avx512", HWY_AVX3},
    {"avx2", HWY_AVX2},
    {"sse4", HWY_SSE4},
    {"scalar", HWY_SCALAR}};

/// What tables of this target are called.
constexpr const char* set_name(std::int64_t target) {
  for (const InstructionSet& set : kInstructionSets)
    if (set.target == target) return set.name;
  return "baseline";
}

/// The target of tables of this name; 0: whatever the whole program was compiled for.
constexpr std::int64_t set_target(std::string_view name) {
  for (const InstructionSet& set : kInstructionSets)
    if (name == set.name) return set.target;
  return 0;
}

/// The table of this name; the last one, the baseline's, if there is none.
template <class Table, std::size_t kCount>
const Table& table_named(const Table (&tables)[kCount], std::string_view name) {
  for (const Table& table : tables)
    if (name == table.name) return table;
  return tables[kCount - 1];
}

}  // namespace sheaf
