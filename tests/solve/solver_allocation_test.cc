// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// That a solver which stays allocates nothing: operator new, aligned_alloc and mmap of this program
// are counted while it solves again.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

#include "sheaf/sheaf.h"
#include "solve/lens_problems.h"
#include "solve/rig_problems.h"
#include "solve/scenes.h"

// Sanitizers have allocators of their own, and other systems other calls.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SHEAF_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SHEAF_SANITIZED 1
#endif
#endif
#if defined(__linux__) && !defined(SHEAF_SANITIZED)
#define SHEAF_COUNTS_ALLOCATIONS 1
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<bool> counts{false};
std::atomic<long> counted{0};

void* allocated(std::size_t size, std::size_t alignment) {
  if (counts) ++counted;
  void* memory = nullptr;
  if (posix_memalign(&memory, alignment < sizeof(void*) ? 16 : alignment, size + (size == 0)) != 0)
    return nullptr;
  return memory;
}
void* or_throw(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return or_throw(allocated(size, 16)); }
void* operator new[](std::size_t size) { return or_throw(allocated(size, 16)); }
void* operator new(std::size_t size, std::align_val_t to) {
  return or_throw(allocated(size, static_cast<std::size_t>(to)));
}
void* operator new[](std::size_t size, std::align_val_t to) {
  return or_throw(allocated(size, static_cast<std::size_t>(to)));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return allocated(size, alignment);
}
extern "C" void* mmap(void* at, std::size_t size, int protection, int flags, int file,
                      off_t offset) noexcept {
  if (counts) ++counted;
  return reinterpret_cast<void*>(syscall(SYS_mmap, at, size, protection, flags, file, offset));
}
#endif

namespace sheaf {
namespace {

#if defined(SHEAF_COUNTS_ALLOCATIONS)

/// Of the third solve and those behind it, each with other numbers.
long allocations(const Problem& start, const SolveOptions& options) {
  Solver solver(options);
  long out = 0;
  Problem problem = start;
  for (int time = 0; time < 6; ++time) {
    problem.points = start.points;
    problem.poses = start.poses;
    problem.cameras = start.cameras;
    problem.rigs.rig_from_world = start.rigs.rig_from_world;
    problem.rigs.sensor_from_rig = start.rigs.sensor_from_rig;
    for (double& x : problem.observation_xy) x += 1e-3;
    if (!problem.observation_sigma.empty())
      problem.observation_sigma[static_cast<std::size_t>(time)] =
          std::numeric_limits<double>::infinity();
    counted = 0;
    counts = time >= 2;
    solver.solve(problem);
    counts = false;
    out += counted;
    EXPECT_EQ(solver.was_kept(), time > 0);
  }
  return out;
}

TEST(SolverAllocations, CountsWhatASolveTakes) {
  Problem problem = small_scene().start;
  counted = 0;
  counts = true;
  solve(problem);
  counts = false;
  EXPECT_GT(counted, 100);
}

TEST(SolverAllocations, ARepeatedSolveTakesNone) {
  for (const int threads : {1, 2}) {
    SCOPED_TRACE(threads);
    SolveOptions options;
    options.threads = threads;
    const Problem scene = small_scene().start;
    Problem weighed = scene;
    weighed.observation_sigma.assign(scene.num_observations(), 1.5);
    EXPECT_EQ(allocations(scene, options), 0);
    EXPECT_EQ(allocations(weighed, options), 0) << "sigmas";
    for (const auto solver : {CameraSolverKind::sparse, CameraSolverKind::dense}) {
      options.solver = solver;
      EXPECT_EQ(allocations(scene, options), 0) << "solver";
    }
    options.fixed.pose_ids = {0, 1};
    options.fixed.intrinsics = true;
    for (const Loss& loss : {Loss(Huber{1}), Loss(Huber{}), Loss(Tukey{kAutomaticScale, true})}) {
      options.loss = loss;
      EXPECT_EQ(allocations(scene, options), 0) << to_string(loss.kind);
      EXPECT_EQ(allocations(weighed, options), 0) << to_string(loss.kind);
    }
    options.points = PointParametrisation::inverse_depth;
    EXPECT_EQ(allocations(scene, options), 0) << "inverse depth";
  }
}

TEST(SolverAllocations, NorWithLensesOfAnyModelAndRigs) {
  SolveOptions options;
  options.threads = 1;
  options.loss = Huber{1};
  const std::vector<Camera> lenses(6, test::ordinary(CameraModel::opencv));
  const Problem p = test::thinned(test::disturbed(lenses, 6, 30, 3), 4);
  EXPECT_EQ(allocations(p, options), 0);
  options.fixed.intrinsics = true;
  EXPECT_EQ(allocations(p, options), 0);
  // Which frames are no more than an image's pose is listed.
  EXPECT_LE(allocations(test::rig_problem({}), options), 8);
}

#endif

}  // namespace
}  // namespace sheaf
