// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "machine_peak.h"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine_peak.cc"
#include <hwy/foreach_target.h>  // first: compiles the rest once per instruction set
//
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sheaf::bench::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int chains = 12;  // latency 4 x 2 pipes asks for 8 at least; 16 registers allow 12

/// Runs `rounds` x 12 vector FMAs that do not wait for one another; returns flops done.
/// The sum goes to *sink so that nothing can be left out.
template <class T>
double multiply_add_chains(std::int64_t rounds, double* sink) {
  const hn::ScalableTag<T> d;
  const auto a = hn::Set(d, static_cast<T>(0.999999));
  const auto b = hn::Set(d, static_cast<T>(1e-6));
  auto x0 = hn::Iota(d, T{0}), x1 = hn::Iota(d, T{1}), x2 = hn::Iota(d, T{2});
  auto x3 = hn::Iota(d, T{3}), x4 = hn::Iota(d, T{4}), x5 = hn::Iota(d, T{5});
  auto x6 = hn::Iota(d, T{6}), x7 = hn::Iota(d, T{7}), x8 = hn::Iota(d, T{8});
  auto x9 = hn::Iota(d, T{9}), x10 = hn::Iota(d, T{10}), x11 = hn::Iota(d, T{11});
  for (std::int64_t i = 0; i < rounds; ++i) {
    x0 = hn::MulAdd(x0, a, b), x1 = hn::MulAdd(x1, a, b), x2 = hn::MulAdd(x2, a, b);
    x3 = hn::MulAdd(x3, a, b), x4 = hn::MulAdd(x4, a, b), x5 = hn::MulAdd(x5, a, b);
    x6 = hn::MulAdd(x6, a, b), x7 = hn::MulAdd(x7, a, b), x8 = hn::MulAdd(x8, a, b);
    x9 = hn::MulAdd(x9, a, b), x10 = hn::MulAdd(x10, a, b), x11 = hn::MulAdd(x11, a, b);
  }
  const auto low = hn::Add(hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)), hn::Add(x4, x5));
  const auto high = hn::Add(hn::Add(hn::Add(x6, x7), hn::Add(x8, x9)), hn::Add(x10, x11));
  *sink = static_cast<double>(hn::GetLane(hn::SumOfLanes(d, hn::Add(low, high))));
  return 2.0 * chains * static_cast<double>(hn::Lanes(d)) * static_cast<double>(rounds);
}

double double_chains(std::int64_t rounds, double* sink) {
  return multiply_add_chains<double>(rounds, sink);
}
double float_chains(std::int64_t rounds, double* sink) {
  return multiply_add_chains<float>(rounds, sink);
}

/// a = b + 3 c. `count` is a multiple of 64; the arrays are aligned to vectors.
void triad(double* a, const double* b, const double* c, std::size_t count, bool streaming) {
  const hn::ScalableTag<double> d;
  const auto s = hn::Set(d, 3.0);
  const std::size_t lanes = hn::Lanes(d);
  if (streaming) {  // does not read `a` first: a third less traffic where the machine can
    for (std::size_t i = 0; i < count; i += lanes)
      hn::Stream(hn::MulAdd(s, hn::Load(d, c + i), hn::Load(d, b + i)), d, a + i);
    hwy::FlushStream();
  } else {
    for (std::size_t i = 0; i < count; i += lanes)
      hn::Store(hn::MulAdd(s, hn::Load(d, c + i), hn::Load(d, b + i)), d, a + i);
  }
}

double read_sum(const double* a, std::size_t count) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  auto x0 = hn::Zero(d), x1 = x0, x2 = x0, x3 = x0;
  for (std::size_t i = 0; i < count; i += 4 * lanes) {
    x0 = hn::Add(x0, hn::Load(d, a + i));
    x1 = hn::Add(x1, hn::Load(d, a + i + lanes));
    x2 = hn::Add(x2, hn::Load(d, a + i + 2 * lanes));
    x3 = hn::Add(x3, hn::Load(d, a + i + 3 * lanes));
  }
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(hn::Add(x0, x1), hn::Add(x2, x3))));
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace sheaf::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf::bench {

HWY_EXPORT(double_chains);
HWY_EXPORT(float_chains);
HWY_EXPORT(triad);
HWY_EXPORT(read_sum);
HWY_EXPORT(target_name);

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Work a thread does in one pass; returns the amount done (flops or bytes).
using Pass = std::function<double(int thread)>;

/// All threads make passes side by side, each pass between two barriers; the best rate of any pass,
/// in 1e9 per second. The best, because other programs can only make it worse.
double best_rate(int threads, double seconds, const Pass& pass) {
  std::vector<double> amounts(threads, 0.0);
  double best = 0;
  bool more = true;
  auto start = Clock::now();
  const auto begin = start;
  bool running = false;
  std::barrier line(threads, [&]() noexcept {  // alternates: a pass begins, a pass ends
    if (running) {
      double total = 0;
      for (double amount : amounts) total += amount;
      best = std::max(best, 1e-9 * total / seconds_since(start));
      more = seconds_since(begin) < seconds;
    }
    running = !running;
    start = Clock::now();
  });
  auto work = [&](int thread) {
    while (more) {
      line.arrive_and_wait();
      amounts[thread] = pass(thread);
      line.arrive_and_wait();
    }
  };
  std::vector<std::thread> pool;
  for (int t = 1; t < threads; ++t) pool.emplace_back(work, t);
  work(0);
  for (std::thread& thread : pool) thread.join();
  return best;
}

struct FreeAligned {
  void operator()(double* p) const { ::operator delete[](p, std::align_val_t{128}); }
};
using Array = std::unique_ptr<double[], FreeAligned>;

Array allocate(std::size_t count) {
  return Array(
      static_cast<double*>(::operator new[](count * sizeof(double), std::align_val_t{128})));
}

void measure_flops(MachinePeak& peak, double seconds) {
  std::vector<double> sinks(static_cast<std::size_t>(peak.threads) * 16);
  const std::int64_t rounds = 1'000'000;
  const Pass in_double = [&](int t) {
    return HWY_DYNAMIC_DISPATCH(double_chains)(rounds, &sinks[t * 16]);
  };
  const Pass in_float = [&](int t) {
    return HWY_DYNAMIC_DISPATCH(float_chains)(rounds, &sinks[t * 16]);
  };
  peak.double_gflops_one = best_rate(1, seconds, in_double);
  peak.double_gflops_all = best_rate(peak.threads, seconds, in_double);
  peak.float_gflops_one = best_rate(1, seconds, in_float);
  peak.float_gflops_all = best_rate(peak.threads, seconds, in_float);
}

void measure_memory(MachinePeak& peak, double seconds, std::size_t array_bytes) {
  const std::size_t count = std::max<std::size_t>(array_bytes / sizeof(double) / 64, 64) * 64;
  const Array a = allocate(count), b = allocate(count), c = allocate(count);
  for (std::size_t i = 0; i < count; ++i) a[i] = 0, b[i] = 1, c[i] = 2;
  auto rate = [&](int threads, auto&& part) {
    const std::size_t share = count / 64 / threads * 64;
    return best_rate(threads, seconds, [&](int t) { return part(t * share, share); });
  };
  auto with_stores = [&](bool streaming) {
    return [&, streaming](std::size_t first, std::size_t n) {
      HWY_DYNAMIC_DISPATCH(triad)(&a[first], &b[first], &c[first], n, streaming);
      return 24.0 * static_cast<double>(n);
    };
  };
  double sink = 0;
  auto reading = [&](std::size_t first, std::size_t n) {
    const double sum = HWY_DYNAMIC_DISPATCH(read_sum)(&b[first], n);
    if (sum < 0) sink = sum;  // never, but the compiler cannot know
    return 8.0 * static_cast<double>(n);
  };
  peak.triad_gbytes_one = std::max(rate(1, with_stores(true)), rate(1, with_stores(false)));
  peak.triad_gbytes_all =
      std::max(rate(peak.threads, with_stores(true)), rate(peak.threads, with_stores(false)));
  peak.read_gbytes_one = rate(1, reading);
  peak.read_gbytes_all = rate(peak.threads, reading);
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "";
}

std::string format(const char* text, ...) {
  char buffer[1024];
  va_list arguments;
  va_start(arguments, text);
  std::vsnprintf(buffer, sizeof buffer, text, arguments);
  va_end(arguments);
  return buffer;
}

}  // namespace

MachinePeak measure_machine(int threads, double seconds, std::size_t array_bytes) {
  MachinePeak peak;
  peak.threads = std::max(threads, 1);
  peak.simd = HWY_DYNAMIC_DISPATCH(target_name)();
  peak.cpu = cpu_model();
  const double each = seconds / 10;  // ten measurements
  measure_flops(peak, each);
  measure_memory(peak, each, array_bytes);
  return peak;
}

std::string to_json(const MachinePeak& p) {
  return format(
      "{\"cpu\": \"%s\", \"simd\": \"%s\", \"threads\": %d, "
      "\"double_gflops\": {\"one\": %.1f, \"all\": %.1f}, "
      "\"float_gflops\": {\"one\": %.1f, \"all\": %.1f}, "
      "\"triad_gbytes_s\": {\"one\": %.1f, \"all\": %.1f}, "
      "\"read_gbytes_s\": {\"one\": %.1f, \"all\": %.1f}}\n",
      p.cpu.c_str(), p.simd.c_str(), p.threads, p.double_gflops_one, p.double_gflops_all,
      p.float_gflops_one, p.float_gflops_all, p.triad_gbytes_one, p.triad_gbytes_all,
      p.read_gbytes_one, p.read_gbytes_all);
}

std::string to_text(const MachinePeak& p) {
  return format(
      "%s, %s\n"
      "                       1 thread  %3d threads\n"
      "double   Gflop/s      %9.1f    %9.1f\n"
      "float    Gflop/s      %9.1f    %9.1f\n"
      "triad    GB/s         %9.1f    %9.1f\n"
      "read     GB/s         %9.1f    %9.1f\n",
      p.cpu.c_str(), p.simd.c_str(), p.threads, p.double_gflops_one, p.double_gflops_all,
      p.float_gflops_one, p.float_gflops_all, p.triad_gbytes_one, p.triad_gbytes_all,
      p.read_gbytes_one, p.read_gbytes_all);
}

}  // namespace sheaf::bench
#endif  // HWY_ONCE
