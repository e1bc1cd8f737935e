// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/sparse_cholesky.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>
#include <utility>

namespace sheaf {
namespace {

constexpr std::size_t kPanel = 32;
/// Products are made in blocks of these sizes, which stay in the nearest caches.
constexpr std::int32_t kRows = 192, kColumns = 32;
/// Rows of a panel that one task of a shared factorisation owns.
constexpr std::size_t kTaskRows = 96;

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

SparseCholesky::SparseCholesky(SymbolicFactor symbolic, const char* simd_name)
    : symbolic_(std::move(symbolic)),
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
      if (job.stops() || !factor_alone(s, job)) return job.failed.store(true);
  });
  for (std::int32_t s : above_)
    if (job.stops() || !factor_shared(s, job)) return false;
  return !job.failed;
}

bool SparseCholesky::factor_alone(std::size_t supernode, Job& job) {
  const Supernode& s = symbolic_.supernodes[supernode];
  double* A = panels_.data() + s.panel;
  double* inverse = inverse_.data() + s.first;
  const auto width = static_cast<std::size_t>(s.width);
  const std::size_t rows = s.rows_end();
  std::memset(A, 0, s.lda * width * sizeof(double));
  job.fill(supernode);
  apply_updates(supernode, 0, rows, scratch_[job.threads.worker()].data());
  for (std::size_t k = 0; k < width; k += kPanel) {
    const std::size_t w = std::min(kPanel, width - k), below = k + w == width ? s.top : k + w;
    if (!kernels_.factor_block(A, s.lda, k, w, inverse)) return false;
    kernels_.solve_rows(A, s.lda, k, w, inverse, below, rows);
    if (k + w < width) kernels_.update(A, s.lda, k, w, below, rows, below, width);
  }
  return true;
}

bool SparseCholesky::factor_shared(std::size_t supernode, Job& job) {
  const Supernode& s = symbolic_.supernodes[supernode];
  double* A = panels_.data() + s.panel;
  double* inverse = inverse_.data() + s.first;
  const auto width = static_cast<std::size_t>(s.width);
  const std::size_t rows = s.rows_end();
  const auto in_rows = [&](std::size_t from, const auto& task) {
    job.threads.for_each((rows - from + kTaskRows - 1) / kTaskRows, [&](std::size_t t) {
      const std::size_t first = from + t * kTaskRows;
      task(first, std::min(rows, first + kTaskRows));
    });
  };
  std::memset(A, 0, s.lda * width * sizeof(double));
  job.fill(supernode);
  in_rows(0, [&](std::size_t first, std::size_t end) {
    apply_updates(supernode, first, end, scratch_[job.threads.worker()].data());
  });
  for (std::size_t k = 0; k < width; k += kPanel) {
    const std::size_t w = std::min(kPanel, width - k), below = k + w == width ? s.top : k + w;
    if (!kernels_.factor_block(A, s.lda, k, w, inverse)) return false;
    in_rows(below, [&](std::size_t first, std::size_t end) {
      kernels_.solve_rows(A, s.lda, k, w, inverse, first, end);
    });
    if (k + w == width) break;
    in_rows(below, [&](std::size_t first, std::size_t end) {
      kernels_.update(A, s.lda, k, w, first, end, below, std::min(width, end));
    });
  }
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
  const Run* column_run = &runs_[update.first_run];
  double* columns[kColumns];
  for (std::int32_t c = update.begin; c < update.end; c += kColumns) {
    const std::int32_t c_end = std::min(update.end, c + kColumns);
    for (std::int32_t j = c; j < c_end; ++j) {
      while (column_run->source + column_run->count <= j) ++column_run;
      const auto target = static_cast<std::size_t>(column_run->target + j - column_run->source);
      columns[j - c] = panels_.data() + s.panel + target * s.lda;
    }
    const Run* at = run;
    for (std::int32_t r = std::max(first, c); r < end;) {
      const std::int32_t whole = r / 8 * 8, r_end = std::min(end, whole + kRows);
      kernels_.product(P, source.lda, source.width, whole, (r_end + 7) / 8 * 8, c, c_end, scratch,
                       kRows);
      for (; r < r_end;) {
        while (at->source + at->count <= r) ++at;
        const std::int32_t stop = std::min(r_end, at->source + at->count);
        const std::int32_t target = at->target + r - at->source;
        for (std::int32_t j = 0; j < c_end - c; ++j) {
          const double* from = scratch + j * kRows + (r - whole);
          double* to = columns[j] + target;
          for (std::int32_t i = 0; i < stop - r; ++i) to[i] -= from[i];
        }
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
