// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/checkpoint.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "io/byte_source.h"
#include "io/output_file.h"
#include "io/sha256.h"
#include "options/solve_options.h"
#include "solve/checkpoint_fields.h"

namespace sheaf {
namespace {

/// Grows with what is written. A number of this machine's, so that another order of bytes is told.
constexpr std::uint32_t kVersion = 1;
constexpr std::string_view kMark = "SHEAFCKP";
constexpr std::size_t kDigest = 64;

std::string digest_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes.data(), bytes.size());
  return hash.hex_digest();
}

/// Steps are the same whatever these are.
bool matters(const std::string& name) {
  for (const char* other : {"threads", "time-limit", "lend-observations", "checkpoint",
                            "checkpoint-every", "resume", "simd"})
    if (name == other) return false;
  return true;
}

Error no_checkpoint(const std::string& path, const std::string& why) {
  return Error(ErrorCode::unreadable_input, path + ": " + why);
}

Result<void> check_same(const Checkpoint& found, const Checkpoint& expected,
                        const std::string& path) {
  const auto usage = [&](const std::string& text) {
    return Error(ErrorCode::usage, path + ": " + text);
  };
  if (found.problem != expected.problem)
    return usage("the checkpoint is of another problem, or of other priors or held parameters");
  for (std::size_t k = 0; k < expected.names.size(); ++k) {
    const auto at = std::find(found.names.begin(), found.names.end(), expected.names[k]);
    const std::string before =
        at == found.names.end() ? "not there"
                                : found.values[static_cast<std::size_t>(at - found.names.begin())];
    if (before != expected.values[k])
      return usage("the checkpoint's run has --" + expected.names[k] + " " + before +
                   ", this one has " + expected.values[k]);
  }
  return {};
}

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
  return c.names.size() == c.values.size() && fits(c.attempt_start, problem) &&
         c.points.size() == problem.points.size() && steps > 0 && !c.summary.rounds.empty() &&
         c.progress.round_begin <= steps && c.progress.attempt_begin < steps &&
         c.progress.returns >= 0;
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

Checkpoint identity_of(const Problem& problem, const SolveOptions& options,
                       const std::string& simd) {
  Checkpoint out;
  out.problem = fingerprint(problem, options.fixed);
  for (const OptionField<SolveOptions>& field : solve_fields()) {
    if (!matters(field.spec.name)) continue;
    out.names.push_back(field.spec.name);
    out.values.push_back(text_of(field.get(options)));
  }
  out.names.push_back("simd");
  out.values.push_back(simd);
  return out;
}

Result<void> write_checkpoint(const Checkpoint& checkpoint, const std::string& path) {
  ArchiveWriter a;
  a(kVersion, checkpoint);
  Result<OutputFile> file = OutputFile::create(path, Compression::none);
  if (!file.ok()) return file.error();
  file.value().write(kMark.data(), kMark.size());
  file.value().write(a.bytes());
  file.value().write(digest_of(a.bytes()));
  return file.value().commit();
}

Result<Checkpoint> read_checkpoint(const std::string& path, const Checkpoint& expected,
                                   const Problem& problem) {
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  std::string_view bytes = text.value();
  if (!bytes.starts_with(kMark)) return no_checkpoint(path, "found no checkpoint of a solve");
  bytes.remove_prefix(kMark.size());
  if (bytes.size() < kDigest) return no_checkpoint(path, "the checkpoint is cut off");
  const std::string_view digest = bytes.substr(bytes.size() - kDigest);
  bytes.remove_suffix(kDigest);
  if (digest != digest_of(bytes))
    return no_checkpoint(path, "the checkpoint is damaged: its checksum is another");
  ArchiveReader a(bytes);
  std::uint32_t version = 0;
  a(version);
  if (version != kVersion)
    return no_checkpoint(path, "found a checkpoint of version " + std::to_string(version) +
                                   ", expected " + std::to_string(kVersion));
  Checkpoint out;
  a(out);
  if (!a.complete() || !makes_sense(out, problem)) {
    // Of another problem its lists have other lengths, which is no damage.
    if (a.complete() && out.problem != expected.problem)
      if (const Result<void> same = check_same(out, expected, path); !same.ok())
        return same.error();
    return no_checkpoint(path, "the checkpoint does not hold what it should");
  }
  if (const Result<void> same = check_same(out, expected, path); !same.ok()) return same.error();
  return out;
}

}  // namespace sheaf
