// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A window of a few keyframes, solved again and again: what a solver that stays saves, and what a
// second thread brings. bench/window.py holds it against other solvers.
//   bench-window [--images N] [--points N] [--track T] [--steps K] [--pairs N] [--threads LIST]
//                [--write FILE]
// Steps of Levenberg-Marquardt under Huber's loss at one pixel, intrinsics held, from changed
// measurements and state to the end. Ways take turns, so that they share the machine's moods; the
// figures are medians over the pairs, on stdout as JSON. --write: the window as a BAL file instead.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "sheaf/sheaf.h"

namespace {

using namespace sheaf;

struct Arguments {
  SceneOptions scene{};
  int steps = 6, pairs = 101;
  std::vector<int> threads{1, 2};
  std::string write;
};

/// As 1,2,4.
std::vector<int> numbers(const char* text) {
  std::vector<int> out;
  for (char* end = nullptr; *text != '\0'; text = *end == ',' ? end + 1 : end) {
    out.push_back(static_cast<int>(std::strtol(text, &end, 10)));
    if (end == text) std::exit(2);
  }
  return out;
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  a.scene.images = 10, a.scene.points = 1500, a.scene.mean_track = 4;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    const char* value = argv[i + 1];
    if (name == "--images") a.scene.images = std::strtoull(value, nullptr, 10);
    if (name == "--points") a.scene.points = std::strtoull(value, nullptr, 10);
    if (name == "--track") a.scene.mean_track = std::strtod(value, nullptr);
    if (name == "--steps") a.steps = std::atoi(value);
    if (name == "--pairs") a.pairs = std::atoi(value);
    if (name == "--threads") a.threads = numbers(value);
    if (name == "--write") a.write = value;
  }
  return a;
}

double now_ms() {
  using namespace std::chrono;
  return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}
/// Of all threads of this process.
double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// One way of solving, and how long each time took.
struct Way {
  const char* name;
  int threads;
  Solver solver;
  std::vector<double> ms{};
  double cpu_ms = 0;            ///< of all times together
  std::vector<double> costs{};  ///< after each step of the last time
};

void print(const std::vector<Way>& ways, const Problem& window) {
  std::printf("{\"images\": %zu, \"points\": %zu, \"observations\": %zu, \"ways\": [",
              window.num_images(), window.num_points(), window.num_observations());
  for (const Way& way : ways) {
    std::printf(
        "%s\n  {\"way\": \"%s\", \"threads\": %d, \"ms\": %.4f, \"least_ms\": %.4f, "
        "\"cpu_ms\": %.4f, \"costs\": [",
        &way == ways.data() ? "" : ",", way.name, way.threads, median(way.ms),
        *std::min_element(way.ms.begin(), way.ms.end()),
        way.cpu_ms / static_cast<double>(way.ms.size()));
    for (const double& cost : way.costs)
      std::printf("%s%.17g", &cost == way.costs.data() ? "" : ", ", cost);
    std::printf("]}");
  }
  std::printf("\n]}\n");
}

int run(const Arguments& a) {
  const Problem window = generate(a.scene).value().start;
  if (!a.write.empty()) {
    write(window, a.write).value();
    return 0;
  }
  SolveOptions options;
  options.max_iterations = a.steps;
  options.tolerance = 0;
  options.loss = Huber{1.0};
  options.fixed.intrinsics = true;
  std::vector<Way> ways;
  for (const int threads : a.threads) {
    options.threads = threads;
    ways.push_back({"fresh", threads, Solver(options)});
    ways.push_back({"kept", threads, Solver(options)});
  }
  Problem problem = window;
  for (int pair = 0; pair < a.pairs + 3; ++pair)
    for (Way& way : ways) {
      problem = window;
      // What a camera would have seen otherwise: another number in every place.
      const double by = 1e-6 * pair;
      for (double& x : problem.observation_xy) x += by;
      const double cpu_begin = cpu_ms(), begin = now_ms();
      Summary fresh;
      const Summary* summary = &fresh;
      if (std::strcmp(way.name, "fresh") == 0)
        fresh = solve(problem, way.solver.options());
      else
        summary = &way.solver.solve(problem);
      const double end = now_ms();
      if (pair < 3) continue;
      way.ms.push_back(end - begin);
      way.cpu_ms += cpu_ms() - cpu_begin;
      way.costs.clear();
      for (const Iteration& it : summary->iterations) way.costs.push_back(it.cost);
    }
  print(ways, window);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(parse(argc, argv));
  } catch (const sheaf::Error& error) {
    std::fprintf(stderr, "bench-window: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}
