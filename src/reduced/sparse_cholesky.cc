// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/sparse_cholesky.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>
#include <utility>

namespace sheaf {
namespace {

constexpr std::size_t kPanel = 32;
/// Products are made in blocks of these sizes, which stay in the nearest cache.
constexpr std::int32_t kRows = 96, kColumns = 32;
/// Rows of a panel that are updated and solved while they stay in the second-level cache; one
/// task's where threads share the panel.
constexpr std::size_t kRowsAlone = 288, kRowsShared = 96;

void subtract(const double* from, std::int32_t count, double* to) {
  for (std::int32_t i = 0; i < count; ++i) to[i] -= from[i];
}

/// sum a[i] b[i] in eight lanes and a fixed tree.
double dot(const double* a, const double* b, std::size_t n) {
  double lanes[8] = {}, tail = 0;
  const std::size_t whole = n / 8 * 8;
  for (std::size_t i = 0; i < whole; i += 8)
    for (int l = 0; l < 8; ++l) lanes[l] += a[i + l] * b[i + l];
  for (std::size_t i = whole; i < n; ++i) tail += a[i] * b[i];
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) +
         ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7])) + tail;
}

}  // namespace

/// One factorisation: who asks whether it is cancelled, and whether it has failed.
struct SparseCholesky::Job {
  Threads& threads;
  const Fill& fill;
  const std::function<bool()>* cancelled;
  std::thread::id caller = std::this_thread::get_id();
  std::atomic<bool> failed = false;

  bool stops() {
    if (failed.load(std::memory_order_relaxed)) return true;
    if (cancelled != nullptr && std::this_thread::get_id() == caller && (*cancelled)())
      failed.store(true, std::memory_order_relaxed);
    return failed.load(std::memory_order_relaxed);
  }
};

SparseCholesky::SparseCholesky(std::shared_ptr<const SymbolicFactor> symbolic,
                               const char* simd_name)
    : shared_(std::move(symbolic)),
      symbolic_(*shared_),
      kernels_(dense_kernels(simd_name)),
      panels_(symbolic_.panel_doubles),
      inverse_(symbolic_.size()),
      permuted_(symbolic_.size()),
      gathered_(symbolic_.size()) {
  list_updates();
  cut_into_subtrees();
}

std::uint64_t SparseCholesky::bytes(const SymbolicFactor& symbolic) {
  // Runs and updates: a few for each row of a supernode.
  return 8 * symbolic.panel_doubles + 4 * symbolic.rows.size() +
         (8 * 3 + 8) * static_cast<std::uint64_t>(symbolic.size());
}

void SparseCholesky::list_updates() {
  const std::vector<Supernode>& nodes = symbolic_.supernodes;
  std::vector<std::vector<Update>> of(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Supernode& from = nodes[k];
    const std::int32_t* rows = symbolic_.rows.data() + from.first_row;
    const auto top = static_cast<std::int32_t>(from.top);
    for (std::int32_t begin = 0; begin < from.below;) {
      const std::int32_t owner = symbolic_.owner[rows[begin]];
      const Supernode& to = nodes[owner];
      const std::int32_t* below = symbolic_.rows.data() + to.first_row;
      std::int32_t end = begin;
      while (end < from.below && rows[end] < to.first + to.width) ++end;
      Update update{static_cast<std::int32_t>(k), top + begin, top + end, runs_.size(), 0};
      std::int32_t at = 0;  // in the rows below `to`
      for (std::int32_t i = begin; i < from.below; ++i) {
        std::int32_t target = rows[i] - to.first;
        if (i >= end) {
          while (below[at] < rows[i]) ++at;
          target = static_cast<std::int32_t>(to.top) + at;
        }
        const bool extends =
            runs_.size() > update.first_run && runs_.back().target + runs_.back().count == target;
        if (extends)
          ++runs_.back().count;
        else
          runs_.push_back({top + i, target, 1});
      }
      update.end_run = runs_.size();
      of[owner].push_back(update);
      begin = end;
    }
  }
  first_update_.assign(1, 0);
  for (const std::vector<Update>& list : of) {
    updates_.insert(updates_.end(), list.begin(), list.end());
    first_update_.push_back(updates_.size());
  }
}

/// The largest subtrees of at most a sixteenth of the work.
void SparseCholesky::cut_into_subtrees() {
  const std::vector<Supernode>& nodes = symbolic_.supernodes;
  std::vector<double> work(nodes.size(), 0);
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const double w = nodes[s].width, u = nodes[s].below;
    work[s] += w * (w + u) * (w + u) + 1e4;
    if (nodes[s].parent >= 0) work[nodes[s].parent] += work[s];
  }
  double all = 0;
  for (std::size_t s = 0; s < nodes.size(); ++s)
    if (nodes[s].parent < 0) all += work[s];
  const auto small = [&](std::int32_t s) { return work[s] <= all / 16; };
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const std::int32_t parent = nodes[s].parent;
    if (!small(static_cast<std::int32_t>(s)))
      above_.push_back(static_cast<std::int32_t>(s));
    else if (parent < 0 || !small(parent))
      subtrees_.push_back(static_cast<std::int32_t>(s));
  }
}

std::uint64_t SparseCholesky::offset(std::int32_t row, std::int32_t column) const {
  const auto [c, r] = std::minmax(symbolic_.position[row], symbolic_.position[column]);
  const Supernode& s = symbolic_.supernodes[symbolic_.owner[c]];
  std::uint64_t at = r - s.first;
  if (r >= s.first + s.width) {
    const auto begin = symbolic_.rows.begin() + static_cast<std::ptrdiff_t>(s.first_row);
    at = s.top + static_cast<std::uint64_t>(std::lower_bound(begin, begin + s.below, r) - begin);
  }
  return s.panel + static_cast<std::uint64_t>(c - s.first) * s.lda + at;
}

bool SparseCholesky::factor(Threads& threads, const Fill& fill,
                            const std::function<bool()>* cancelled) {
  scratch_.resize(threads.count());
  for (Buffer<double>& scratch : scratch_)
    if (scratch.size() == 0) scratch.allocate(kRows * kColumns);
  Job job{threads, fill, cancelled};
  if (job.stops()) return false;
  threads.for_each(subtrees_.size(), [&](std::size_t t) {
    const std::int32_t root = subtrees_[t];
    for (std::int32_t s = symbolic_.supernodes[root].subtree; s <= root; ++s)
      if (job.stops() || !factor_supernode(s, job, false)) return job.failed.store(true);
  });
  for (std::int32_t s : above_)
    if (job.stops() || !factor_supernode(s, job, true)) return false;
  return !job.failed;
}

bool SparseCholesky::factor_supernode(std::size_t supernode, Job& job, bool shared) {
  const Supernode& s = symbolic_.supernodes[supernode];
  double* A = panels_.data() + s.panel;
  double* inverse = inverse_.data() + s.first;
  const auto width = static_cast<std::size_t>(s.width);
  const auto in_rows = [&](std::size_t from, std::size_t to, const auto& task) {
    const std::size_t step = shared ? kRowsShared : kRowsAlone,
                      tasks = (to - from + step - 1) / step;
    const auto run = [&](std::size_t t) {
      if (job.stops()) return;
      const std::size_t first = from + t * step, end = std::min(to, first + step);
      apply_updates(supernode, first, end, scratch_[job.threads.worker()].data());
      task(first, end);
    };
    if (shared) return job.threads.for_each(tasks, run);
    for (std::size_t t = 0; t < tasks; ++t) run(t);
  };
  std::memset(A, 0, s.lda * width * sizeof(double));
  job.fill(supernode);
  in_rows(0, s.top, [](std::size_t, std::size_t) {});
  for (std::size_t k = 0; k < width; k += kPanel) {
    if (job.stops()) return false;
    const std::size_t w = std::min(kPanel, width - k), below = k + w;
    if (!kernels_.factor_block(A, s.lda, k, w, inverse)) return false;
    if (below == width) break;
    kernels_.solve_rows(A, s.lda, k, w, inverse, below, s.top);
    kernels_.update(A, s.lda, k, w, below, s.top, below, width);
  }
  in_rows(s.top, s.rows_end(), [&](std::size_t first, std::size_t end) {
    for (std::size_t k = 0; k < width; k += kPanel) {
      const std::size_t w = std::min(kPanel, width - k), below = k + w;
      kernels_.solve_rows(A, s.lda, k, w, inverse, first, end);
      if (below < width) kernels_.update(A, s.lda, k, w, first, end, below, width);
    }
  });
  return true;
}

/// Subtracts from rows [first, end) of the panel what its descendants owe them.
void SparseCholesky::apply_updates(std::size_t supernode, std::size_t first, std::size_t end,
                                   double* scratch) {
  const Supernode& s = symbolic_.supernodes[supernode];
  const auto low = static_cast<std::int32_t>(first), high = static_cast<std::int32_t>(end);
  for (std::uint64_t i = first_update_[supernode]; i < first_update_[supernode + 1]; ++i) {
    const Run* begin = &runs_[updates_[i].first_run];
    const Run* stop = &runs_[updates_[i].end_run - 1] + 1;
    const Run* run =
        std::partition_point(begin, stop, [&](const Run& r) { return r.target + r.count <= low; });
    const Run* last =
        std::partition_point(run, stop, [&](const Run& r) { return r.target < high; });
    if (run == last) continue;
    const Run& back = *(last - 1);
    const std::int32_t from = run->source + std::max(0, low - run->target);
    const std::int32_t to = back.source + std::min(back.count, high - back.target);
    apply_update(updates_[i], s, run, from, to, scratch);
  }
}

/// Rows [first, end) of the source, which begin in `run`.
void SparseCholesky::apply_update(const Update& update, const Supernode& s, const Run* run,
                                  std::int32_t first, std::int32_t end, double* scratch) {
  const Supernode& source = symbolic_.supernodes[update.source];
  const double* P = panels_.data() + source.panel;
  double* columns[SymbolicFactor::kWidest];
  const Run* column_run = &runs_[update.first_run];
  for (std::int32_t c = update.begin; c < update.end; ++c) {
    while (column_run->source + column_run->count <= c) ++column_run;
    const auto target = static_cast<std::size_t>(column_run->target + c - column_run->source);
    columns[c - update.begin] = panels_.data() + s.panel + target * s.lda;
  }
  for (std::int32_t low = first / 8 * 8; low < end; low += kRows) {
    const std::int32_t high = std::min(end, low + kRows), low_row = std::max(first, low);
    while (run->source + run->count <= low_row) ++run;
    // Above the diagonal nothing is owed.
    for (std::int32_t c = update.begin; c < std::min(update.end, high); c += kColumns) {
      const std::int32_t c_end = std::min(update.end, c + kColumns);
      const std::int32_t whole = std::max(low, c / 8 * 8);
      kernels_.product(P, source.lda, static_cast<std::size_t>(source.width), whole,
                       (high + 7) / 8 * 8, c, c_end, scratch, kRows);
      const Run* at = run;
      for (std::int32_t r = std::max(low_row, c); r < high;) {
        while (at->source + at->count <= r) ++at;
        const std::int32_t stop = std::min(high, at->source + at->count);
        const double* from = scratch + (r - whole);
        for (std::int32_t j = 0; j < c_end - c; ++j, from += kRows)
          subtract(from, stop - r, columns[c - update.begin + j] + at->target + r - at->source);
        r = stop;
      }
    }
  }
}

void SparseCholesky::solve(double* x) {
  for (std::size_t c = 0; c < symbolic_.size(); ++c) permuted_[symbolic_.position[c]] = x[c];
  for (const Supernode& s : symbolic_.supernodes) forward(s);
  for (std::size_t i = symbolic_.supernodes.size(); i-- > 0;) backward(symbolic_.supernodes[i]);
  for (std::size_t c = 0; c < symbolic_.size(); ++c) x[c] = permuted_[symbolic_.position[c]];
}

void SparseCholesky::forward(const Supernode& s) {
  const auto width = static_cast<std::size_t>(s.width), below = static_cast<std::size_t>(s.below);
  double* x = permuted_.data() + s.first;
  double* sums = gathered_.data();
  std::fill_n(sums, below, 0.0);
  for (std::size_t j = 0; j < width; ++j) {
    const double* column = panels_.data() + s.panel + j * s.lda;
    const double xj = x[j] *= inverse_[s.first + j];
    for (std::size_t i = j + 1; i < width; ++i) x[i] -= column[i] * xj;
    for (std::size_t i = 0; i < below; ++i) sums[i] += column[s.top + i] * xj;
  }
  const std::int32_t* rows = symbolic_.rows.data() + s.first_row;
  for (std::size_t i = 0; i < below; ++i) permuted_[rows[i]] -= sums[i];
}

void SparseCholesky::backward(const Supernode& s) {
  const auto width = static_cast<std::size_t>(s.width), below = static_cast<std::size_t>(s.below);
  double* x = permuted_.data() + s.first;
  double* gathered = gathered_.data();
  const std::int32_t* rows = symbolic_.rows.data() + s.first_row;
  for (std::size_t i = 0; i < below; ++i) gathered[i] = permuted_[rows[i]];
  for (std::size_t j = width; j-- > 0;) {
    const double* column = panels_.data() + s.panel + j * s.lda;
    const double owed =
        dot(column + j + 1, x + j + 1, width - j - 1) + dot(column + s.top, gathered, below);
    x[j] = (x[j] - owed) * inverse_[s.first + j];
  }
}

}  // namespace sheaf
