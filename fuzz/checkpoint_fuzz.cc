// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Checkpoints with any bytes behind what tells whose they are, under a checksum that is right: they
// are refused with a sentence, or a run goes on from them and ends. The input is edits of a real
// one: four bytes for a place, one for what is done there, and eight that are put there.

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "sheaf/sheaf.h"
#include "solve/checkpoint.h"

namespace {

namespace fs = std::filesystem;

struct Run {
  sheaf::Problem start;
  sheaf::SolveOptions options;
  std::string path, archived;
};

const Run& whole_run() {
  static const Run kRun = [] {
    Run run;
    sheaf::SceneOptions scene;
    scene.images = 4;
    scene.points = 30;
    run.start = sheaf::generate(scene).value().start;
    run.options.threads = 1;
    run.options.max_iterations = 4;
    run.options.time_limit_s = 2;
    run.options.loss = {sheaf::LossKind::huber, sheaf::kAutomaticScale};
    run.path = fs::temp_directory_path() / ("checkpoint_fuzz-" + std::to_string(::getpid()));
    sheaf::SolveOptions writes = run.options;
    writes.checkpoint = run.path;
    writes.checkpoint_every_s = 0;
    sheaf::Problem copy = run.start;
    sheaf::solve(copy, writes);
    run.archived = sheaf::read_checkpoint_file(sheaf::kSolveCheckpoint, run.path).value();
    return run;
  }();
  return kRun;
}

void edit(std::string& bytes, const std::uint8_t* record) {
  std::uint32_t place = 0;
  std::memcpy(&place, record, sizeof place);
  if (bytes.empty()) return;
  const std::size_t at = place % bytes.size(), room = std::min<std::size_t>(8, bytes.size() - at);
  switch (record[4] % 4) {
    case 0:
      bytes[at] = static_cast<char>(record[5]);
      break;
    case 1:
      std::memcpy(&bytes[at], record + 5, room);
      break;
    case 2:
      bytes.erase(at, record[5] % 16);
      break;
    default:
      bytes.insert(at, reinterpret_cast<const char*>(record + 5), record[12] % 9);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kRecord = 13;
  const Run& run = whole_run();
  std::string bytes = run.archived;
  for (; size >= kRecord; data += kRecord, size -= kRecord) edit(bytes, data);
  if (!sheaf::write_checkpoint_file(sheaf::kSolveCheckpoint, bytes, run.path).ok()) std::abort();
  sheaf::Problem problem = run.start;
  sheaf::SolveOptions options = run.options;
  options.resume = run.path;
  const sheaf::Result<sheaf::Summary> done = sheaf::try_solve(problem, options);
  if (!done.ok() && std::string(done.error().what()).find(run.path) != 0) {
    std::fprintf(stderr, "checkpoint_fuzz: %s\n", done.error().what());
    std::abort();
  }
  fs::remove(run.path);
  return 0;
}
