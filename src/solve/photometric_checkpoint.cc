// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/photometric_checkpoint.h"

#include <algorithm>

#include "io/sha256.h"
#include "options/photometric_options.h"
#include "solve/checkpoint_fields.h"

namespace sheaf {

template <class A>
void archive(A& a, Brightness& x) {
  a(x.a, x.b);
}
template <class A>
void archive(A& a, Sight& x) {
  a(x.point, x.image);
}
template <class A>
void archive(A& a, PatchState& x) {
  a(x.poses, x.brightness, x.points);
}
template <class A>
void archive(A& a, PatchRound& x) {
  a(x.level, x.number, x.sights, x.anchor_sigma_grey, x.start);
}
template <class A>
void archive(A& a, PhotometricCheckpoint& x) {
  a(x.identity, x.solve, x.loop, x.progress, x.home, x.round, x.held, x.leaving,
    x.brightness_fitted, x.sigma_grey);
}

namespace {

constexpr CheckpointKind kKind{"SHEAFPCK", "photometric refinement", 1};

template <class T>
void add(Sha256& hash, const std::vector<T>& numbers) {
  const std::uint64_t count = numbers.size();
  hash.update(reinterpret_cast<const char*>(&count), sizeof count);
  hash.update(reinterpret_cast<const char*>(numbers.data()), count * sizeof(T));
}

/// Images are hashed where they are, for they are large.
std::string fingerprint(const PhotometricProblem& problem) {
  Sha256 hash;
  for (const GreyImage& image : problem.images) add(hash, image.pixels);
  ArchiveWriter a;
  const Pinhole& k = problem.camera;
  a(k.fx, k.fy, k.cx, k.cy, problem.poses, problem.points, problem.brightness);
  for (const GreyImage& image : problem.images) a(image.width, image.height);
  a(problem.patch.name, problem.patch.dx, problem.patch.dy, problem.patches);
  a(problem.host, problem.host_xy, problem.sight_point, problem.sight_image);
  a(problem.measured_point, problem.measured_image, problem.measured_xy);
  hash.update(a.bytes().data(), a.bytes().size());
  return hash.hex_digest();
}

bool fits(const PatchState& state, const PhotometricProblem& problem) {
  return state.poses.size() == problem.poses.size() &&
         state.brightness.size() == problem.poses.size() &&
         state.points.size() == problem.points.size();
}

/// That indices lie within what they count.
bool makes_sense(const PhotometricCheckpoint& c, const PhotometricProblem& problem, int levels) {
  const std::size_t steps = c.solve.iterations.size();
  const auto known = [&](const Sight& sight) {
    return sight.point < problem.num_points() && sight.image < problem.images.size();
  };
  return fits(c.held, problem) && fits(c.round.start, problem) && steps > 0 &&
         !c.solve.rounds.empty() && c.progress.round_begin <= steps &&
         c.progress.attempt_begin < steps && c.round.level >= 0 && c.round.level < levels &&
         c.round.number >= 1 && std::all_of(c.round.sights.begin(), c.round.sights.end(), known);
}

}  // namespace

RunIdentity identity_of(const PhotometricProblem& problem, const PhotometricOptions& options,
                        const std::string& simd) {
  return identity_of(fingerprint(problem), options, photometric_fields(), simd);
}

Result<void> write_checkpoint(const PhotometricCheckpoint& checkpoint, const std::string& path) {
  ArchiveWriter a;
  a(checkpoint);
  return write_checkpoint_file(kKind, a.bytes(), path);
}

Result<PhotometricCheckpoint> read_checkpoint(const std::string& path, const RunIdentity& expected,
                                              const PhotometricProblem& problem, int levels) {
  const Result<std::string> bytes = read_checkpoint_file(kKind, path);
  if (!bytes.ok()) return bytes.error();
  ArchiveReader a(bytes.value());
  PhotometricCheckpoint out;
  a(out);
  if (!a.complete()) return senseless_checkpoint(path);
  if (const Result<void> same = check_same(out.identity, expected, path); !same.ok())
    return same.error();
  if (!makes_sense(out, problem, levels)) return senseless_checkpoint(path);
  return out;
}

}  // namespace sheaf
