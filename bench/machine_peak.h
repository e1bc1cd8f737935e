// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace sheaf::bench {

/// What this machine can do at best, measured now. "One" is one busy thread, "all" is all of them
/// together, so all / one tells what the cores share.
struct MachinePeak {
  int threads = 1;               ///< used for "all"
  std::string simd;              ///< instruction set the kernels ran with
  std::string cpu;               ///< model name, empty when the system does not tell
  double double_gflops_one = 0;  ///< independent fused multiply-adds, 2 flops each
  double double_gflops_all = 0;
  double float_gflops_one = 0;
  double float_gflops_all = 0;
  double triad_gbytes_one = 0;  ///< a = b + s c from memory, 24 bytes an element (the write
  double triad_gbytes_all = 0;  ///< counted once); streaming or plain stores, the better
  double read_gbytes_one = 0;   ///< sum of an array in memory, 8 bytes an element
  double read_gbytes_all = 0;
};

/// Takes about `seconds` in all. The arrays hold `array_bytes` each (three of them, split among the
/// threads); they should be several times the last cache.
MachinePeak measure_machine(int threads, double seconds, std::size_t array_bytes);

std::string to_json(const MachinePeak& peak);
std::string to_text(const MachinePeak& peak);

}  // namespace sheaf::bench
