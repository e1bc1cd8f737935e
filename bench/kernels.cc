// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The hot stages of one step, one core, on a BAL file or a generated scene of dubrovnik-16's size:
// time, flops and bytes of each, against the floor that this machine's own peak and bandwidth set.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "eliminate/kernel_table.h"
#include "geometry/rotation.h"
#include "machine_peak.h"
#include "reduced/dense_cholesky.h"
#include "sheaf/sheaf.h"
#include "systems/build.h"

namespace {

using namespace sheaf;

Problem load_problem() {
  const char* data = std::getenv("SHEAF_DATA");
  const std::filesystem::path file =
      std::filesystem::path(data ? data : "data") / "bal/dubrovnik-16-22106-pre.txt";
  if (std::filesystem::exists(file)) return read(file).value();
  SceneOptions options;
  options.images = 16;
  options.points = 22106;
  options.mean_track = 83718.0 / 22106;
  return generate(options).value().start;
}

/// A problem arranged for the kernels, with its state.
struct Bench {
  explicit Bench(const Kernels& k) : kernels(k), problem(load_problem()) {
    batches = arrange(problem);
    const auto images = static_cast<std::uint32_t>(problem.num_images());
    chunks = cut_into_chunks(batches, images, ChunkLists::pairs);
    cameras.allocate(kCameraRecord * images);
    for (std::size_t i = 0; i < images; ++i) {
      double* c = &cameras[kCameraRecord * i];
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
      std::copy(R.begin(), R.end(), c);
      for (int d = 0; d < 3; ++d) {
        c[camera_record::kTranslation + d] = problem.poses[i].translation[d];
        c[camera_record::kFocal + d] = problem.cameras[i].parameters[d];
      }
      std::fill(c + camera_record::kStep, c + kCameraRecord, 1e-6);
    }
    points.allocate(kPointGroup * batches.groups.size());
    for (std::size_t g = 0; g < batches.groups.size(); ++g)
      for (int l = 0; l < 8; ++l)
        for (int d = 0; d < 3; ++d)
          points[kPointGroup * g + 8 * d + l] =
              problem.points[3 * std::size_t(batches.lane_point[8 * g + l]) + d];
    trial_points.allocate(points.size());
    factors.allocate(kFactorGroup * batches.groups.size());
    tiles.allocate(kTileDoubles * chunks.tiles.size());
    diagonal.allocate(kDiagonalDoubles * images);
    tiles.fill(0), diagonal.fill(0);
    scratch.allocate(scratch_doubles(batches, chunks));
    in = {&batches, &chunks, cameras.data(), points.data(), 1e-4, false};
  }

  double observations() const { return static_cast<double>(batches.observations); }

  const Kernels& kernels;
  Problem problem;
  Threads threads{1};
  Batches batches;
  Chunks chunks;
  Buffer<double> cameras, points, trial_points, factors, tiles, diagonal, scratch;
  EliminateInput in;
};

double peak_gflops = 0;  ///< one core of this machine, measured at the start

void report_flops(benchmark::State& state, double flops) {
  using benchmark::Counter;
  state.counters["Gflop/s"] = Counter(flops, Counter::kIsIterationInvariantRate, Counter::kIs1000);
  state.counters["of peak"] =
      Counter(flops / (1e9 * peak_gflops), Counter::kIsIterationInvariantRate);
}

void report(benchmark::State& state, double flops, double bytes, const Bench& bench) {
  report_flops(state, flops);
  state.counters["bytes/obs"] = bytes / bench.observations();
  state.counters["flops/obs"] = flops / bench.observations();
}

enum Stage { kLinearize = 1, kDiagonal = 2, kPairs = 4 };

/// The passes over the chunks, any subset: a product alone repeats on records of the last
/// linearisation, so that its operands are in cache as they are in the whole pass.
void eliminate(benchmark::State& state, const Kernels* kernels, int stages) {
  Bench bench(*kernels);
  const Records records = records_in(bench.scratch.data(), bench.chunks);
  EliminateOutput out{bench.factors.data(), 0, 0, 0};
  for (const Chunk& c : bench.chunks.chunks) kernels->linearize(bench.in, c, records, out);
  for (auto _ : state) {
    for (const Chunk& c : bench.chunks.chunks) {
      if (stages & kLinearize) kernels->linearize(bench.in, c, records, out);
      if (stages & kDiagonal)
        kernels->diagonal(bench.batches, bench.chunks, c, records, bench.diagonal.data());
      if (stages & kPairs) kernels->pairs(bench.chunks, c, records, bench.tiles.data());
    }
    benchmark::ClobberMemory();
  }
  const double n = bench.observations(), pairs = static_cast<double>(bench.chunks.pairs.size());
  const double flops = (stages & kLinearize ? 600 * n : 0) + (stages & kDiagonal ? 410 * n : 0) +
                       (stages & kPairs ? 486 * pairs : 0);
  report(state, flops, (stages & kLinearize ? 20 * n : 0) + 384 * n, bench);
}

void trial(benchmark::State& state, const Kernels* kernels, int inner_iterations) {
  Bench bench(*kernels);
  const Records records = records_in(bench.scratch.data(), bench.chunks);
  EliminateOutput out{bench.factors.data(), 0, 0, 0};
  for (const Chunk& c : bench.chunks.chunks) kernels->linearize(bench.in, c, records, out);
  const TrialInput in{&bench.batches,       bench.cameras.data(),
                      bench.cameras.data(), bench.points.data(),
                      bench.factors.data(), false,
                      inner_iterations,     out.square_sum / bench.observations()};
  for (auto _ : state) {
    TrialOutput to{bench.trial_points.data(), 0, 0, 0, 0};
    for (const Chunk& c : bench.chunks.chunks) kernels->trial(in, c, to);
    benchmark::DoNotOptimize(to.square_sum);
  }
  // One inner iteration: 160 flops to linearise the point once more, 80 for the cost where it
  // leads.
  const double flops = inner_iterations > 0 ? 470 : 230;
  report(state, flops * bench.observations(), 28 * bench.observations(), bench);
}

void product(benchmark::State& state, const Kernels* kernels) {
  Bench bench(*kernels);
  const Records records = records_in(bench.scratch.data(), bench.chunks);
  EliminateOutput out{bench.factors.data(), 0, 0, 0};
  for (const Chunk& c : bench.chunks.chunks) kernels->linearize(bench.in, c, records, out);
  const ProductInput in{&bench.batches, bench.cameras.data(), bench.points.data(),
                        bench.factors.data()};
  Buffer<double> saved(product_scratch_doubles(bench.batches));
  Buffer<double> y(kProductRecord * bench.problem.num_images());
  y.fill(0);
  for (auto _ : state)
    for (const Chunk& c : bench.chunks.chunks) kernels->product(in, c, saved.data(), y.data());
  report(state, 280 * bench.observations(), 12 * bench.observations(), bench);
}

void square_sum(benchmark::State& state, const Kernels* kernels) {
  Bench bench(*kernels);
  for (auto _ : state) {
    double sum = 0;
    for (const Chunk& c : bench.chunks.chunks)
      sum += kernels->square_sum(bench.batches, bench.cameras.data(), bench.points.data(), c);
    benchmark::DoNotOptimize(sum);
  }
  report(state, 80 * bench.observations(), 24 * bench.observations(), bench);
}

void cholesky(benchmark::State& state, const Kernels* kernels) {
  const auto n = static_cast<std::size_t>(state.range(0));
  Threads threads(1);
  DenseCholesky matrix(n, kernels->name);
  Buffer<double> x((n + 7) / 8 * 8);
  for (auto _ : state) {
    matrix.clear(threads);
    for (std::size_t i = 0; i < n; ++i) {
      matrix.at(i, i) = static_cast<double>(n);
      for (std::size_t j = 0; j < i; ++j) matrix.at(i, j) = 0.5;
    }
    if (!matrix.factor(threads)) state.SkipWithError("not positive definite");
    x.fill(1);
    matrix.solve(x.data());
  }
  const double m = static_cast<double>(n);
  report_flops(state, m * m * m / 3 + 2 * m * m);
}

/// A problem set up as the solver does it.
struct Engine {
  SolveOptions options;
  std::optional<Build> build;
  std::unique_ptr<Home> home;

  Engine(const Problem& problem, const Kernels& kernels, Threads& threads) {
    options.solver = CameraSolverKind::dense;
    build.emplace(Build::plan(problem, options, {}, kernels, threads).value());
    home = build->make_home(problem);
  }
};

void setup(benchmark::State& state, const Kernels* kernels) {
  const Problem problem = load_problem();
  Threads threads(1);
  for (auto _ : state) {
    const Engine engine(problem, *kernels, threads);
    benchmark::DoNotOptimize(engine.home->bytes());
  }
}

void arrange_only(benchmark::State& state) {
  const Problem problem = load_problem();
  for (auto _ : state) benchmark::DoNotOptimize(arrange(problem).num_batches());
}

/// One whole step of the system, as the solver takes it.
void step(benchmark::State& state, const Kernels* kernels) {
  const Problem problem = load_problem();
  Threads threads(static_cast<int>(state.range(0)));
  const Engine engine(problem, *kernels, threads);
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine.home->propose({1e-4}).cost);
    benchmark::DoNotOptimize(engine.home->trial().cost);
  }
}

void register_all() {
  using benchmark::RegisterBenchmark;
  const auto ms = benchmark::kMillisecond;
  RegisterBenchmark("arrange", arrange_only)->Unit(ms);
  for (const Kernels* k : available_kernels()) {
    const std::string name = k->name;
    RegisterBenchmark((name + "/setup").c_str(), setup, k)->Unit(ms);
    RegisterBenchmark((name + "/linearize").c_str(), eliminate, k, kLinearize)->Unit(ms);
    RegisterBenchmark((name + "/diagonal").c_str(), eliminate, k, kDiagonal)->Unit(ms);
    RegisterBenchmark((name + "/pairs").c_str(), eliminate, k, kPairs)->Unit(ms);
    RegisterBenchmark((name + "/eliminate").c_str(), eliminate, k, kLinearize | kDiagonal | kPairs)
        ->Unit(ms);
    RegisterBenchmark((name + "/trial").c_str(), trial, k, 0)->Unit(ms);
    RegisterBenchmark((name + "/trial_inner").c_str(), trial, k, 3)->Unit(ms);
    RegisterBenchmark((name + "/product").c_str(), product, k)->Unit(ms);
    RegisterBenchmark((name + "/square_sum").c_str(), square_sum, k)->Unit(ms);
    RegisterBenchmark((name + "/cholesky").c_str(), cholesky, k)
        ->Arg(144)
        ->Arg(441)
        ->Arg(1000)
        ->Unit(ms);
    RegisterBenchmark((name + "/step").c_str(), step, k)->Arg(1)->Arg(2)->UseRealTime()->Unit(ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const sheaf::bench::MachinePeak peak = sheaf::bench::measure_machine(1, 1.0, 64u << 20);
  peak_gflops = peak.double_gflops_one;
  std::fputs(sheaf::bench::to_text(peak).c_str(), stderr);
  register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
