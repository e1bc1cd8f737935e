// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/checkpoint.h"

#include <algorithm>
#include <cmath>

#include "options/solve_options.h"
#include "solve/checkpoint_fields.h"

namespace sheaf {
namespace {

bool fits(const Estimate& state, const Problem& problem) {
  if (state.poses.size() != problem.num_images() ||
      state.cameras.size() != problem.cameras.size() ||
      state.points.size() != problem.points.size() ||
      state.sensors.size() != problem.rigs.num_sensors() ||
      state.frames.size() != problem.rigs.num_frames())
    return false;
  for (std::size_t c = 0; c < state.cameras.size(); ++c)
    if (state.cameras[c].model != problem.cameras[c].model) return false;
  return std::all_of(state.points.begin(), state.points.end(),
                     [](double x) { return std::isfinite(x); });
}

/// That indices lie within what they count.
bool makes_sense(const Checkpoint& c, const Problem& problem) {
  const std::size_t steps = c.summary.iterations.size();
  return fits(c.attempt_start, problem) && c.points.size() == problem.points.size() && steps > 0 &&
         !c.summary.rounds.empty() && c.progress.round_begin <= steps &&
         c.progress.attempt_begin < steps && c.progress.returns >= 0;
}

std::string fingerprint(const Problem& problem, const Fixed& fixed) {
  ArchiveWriter a;
  a(state_hash(problem), problem.observation_sigma);
  a(problem.rigs);
  a(problem.terms);
  a(fixed);
  return digest_of(a.bytes());
}

}  // namespace

RunIdentity identity_of(const Problem& problem, const SolveOptions& options,
                        const std::string& simd) {
  return identity_of(fingerprint(problem, options.fixed), options, solve_fields(), simd);
}

Result<void> write_checkpoint(const Checkpoint& checkpoint, const std::string& path) {
  ArchiveWriter a;
  a(checkpoint);
  return write_checkpoint_file(kSolveCheckpoint, a.bytes(), path);
}

Result<Checkpoint> read_checkpoint(const std::string& path, const RunIdentity& expected,
                                   const Problem& problem) {
  const Result<std::string> bytes = read_checkpoint_file(kSolveCheckpoint, path);
  if (!bytes.ok()) return bytes.error();
  ArchiveReader a(bytes.value());
  Checkpoint out;
  a(out);
  if (!a.complete()) return senseless_checkpoint(path);
  if (const Result<void> same = check_same(out.identity, expected, path); !same.ok())
    return same.error();
  if (!makes_sense(out, problem)) return senseless_checkpoint(path);
  return out;
}

}  // namespace sheaf
