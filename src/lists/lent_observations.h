// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "lists/batches.h"
#include "sheaf/problem.h"

namespace sheaf {

class Threads;

/// The observations of a problem are given up while its batches, which hold them too, live; the
/// destructor puts them back, the same bytes in the same order. Only for problems that list them by
/// point and then by image, all of them in the batches.
class LentObservations {
 public:
  static bool possible(const Problem& problem, const Batches& batches, Threads& threads);
  /// What is given up.
  static std::uint64_t bytes(const Problem& problem, bool with_xy);

  /// with_xy: the batches have the problem's measurements; else these stay where they are.
  LentObservations(Problem& problem, const Batches& batches, Threads& threads, bool with_xy = true);
  /// Where memory does not suffice for them any more, the problem stays without observations.
  ~LentObservations();
  LentObservations(const LentObservations&) = delete;
  LentObservations& operator=(const LentObservations&) = delete;

 private:
  void put_back();

  Problem& problem_;
  const Batches& batches_;
  Threads& threads_;
  const bool with_xy_;
};

}  // namespace sheaf
