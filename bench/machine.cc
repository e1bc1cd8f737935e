// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Measures what this machine can do at best: the floor that the kernels are held against.
//   bench-machine [--threads N] [--seconds S] [--array-mib M] [--json]
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "machine_peak.h"

int main(int argc, char** argv) {
  int threads = static_cast<int>(std::thread::hardware_concurrency());
  double seconds = 5;
  std::size_t array_mib = 128;
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--json") {
      json = true;
    } else if (name == "--threads" && i + 1 < argc) {
      threads = std::atoi(argv[++i]);
    } else if (name == "--seconds" && i + 1 < argc) {
      seconds = std::atof(argv[++i]);
    } else if (name == "--array-mib" && i + 1 < argc) {
      array_mib = static_cast<std::size_t>(std::atol(argv[++i]));
    } else {
      std::fprintf(stderr, "usage: %s [--threads N] [--seconds S] [--array-mib M] [--json]\n",
                   argv[0]);
      return 2;
    }
  }
  const auto peak = sheaf::bench::measure_machine(threads, seconds, array_mib << 20);
  std::fputs((json ? to_json(peak) : to_text(peak)).c_str(), stdout);
  return 0;
}
