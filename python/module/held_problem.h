// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

namespace nb = nanobind;

/// A problem that Python holds, and who looks at it: arrays of NumPy that are views of its vectors,
/// and calls that work on it without the interpreter's lock.
class HeldProblem {
 public:
  Problem problem;
  std::string format;              ///< that it was read from, or ""
  std::vector<std::string> notes;  ///< what of the file is not in it

  /// How many arrays of NumPy look at the vectors.
  std::size_t views() const;
  /// Throws Error (usage) where a view would be left behind: while one lives, no vector moves.
  void check_resizable(const std::string& what) const;
  /// Throws Error (usage) while a call changes the problem.
  void check_idle() const;
  /// Throws Error (usage) while a call has the vectors for itself, since it resizes them.
  void check_at_hand() const;

 private:
  friend class ViewPin;
  friend class ReadUse;
  friend class WriteUse;
  mutable std::mutex mutex_;
  std::size_t views_ = 0;
  int readers_ = 0;
  bool writes_ = false, alone_ = false;

  void refuse_resize(const std::string& what) const;
};

using ProblemHandle = std::shared_ptr<HeldProblem>;

/// Counts as a view while it lives, and keeps the problem alive.
class ViewPin {
 public:
  explicit ViewPin(ProblemHandle held);
  ~ViewPin();
  ViewPin(const ViewPin&) = delete;
  ViewPin& operator=(const ViewPin&) = delete;

 private:
  ProblemHandle held_;
};

/// Whether a call asks that the problem is valid. Views are written to by whoever has them, so that
/// it need not be; what only passes it on does not look.
enum class Validity { asked, any };

/// A call that looks at the problem. Throws Error (usage) while another one changes it, and where
/// it is not valid.
class ReadUse {
 public:
  explicit ReadUse(ProblemHandle held, Validity validity = Validity::asked);
  ~ReadUse();
  ReadUse(const ReadUse&) = delete;
  ReadUse& operator=(const ReadUse&) = delete;
  const Problem& problem() const { return held_->problem; }

 private:
  ProblemHandle held_;
};

/// A call that changes the problem. Throws Error (usage) while another one uses it, and where it is
/// not valid.
class WriteUse {
 public:
  explicit WriteUse(ProblemHandle held, Validity validity = Validity::asked);
  ~WriteUse();
  WriteUse(const WriteUse&) = delete;
  WriteUse& operator=(const WriteUse&) = delete;
  Problem& problem() const { return held_->problem; }
  /// From now on nobody else gets at the vectors, so that they may be resized. Returns false, and
  /// changes nothing, where a view looks at them.
  bool alone();
  /// The same. Throws Error (usage) where a view looks at them; \`what\` stands in its message.
  void resize(const std::string& what);

 private:
  ProblemHandle held_;
};

/// An array that is the memory of a vector of the problem, of this shape, C-contiguous. It keeps
/// the problem alive, and the vector where it is.
template <class Number>
nb::object view_of(const ProblemHandle& held, Number* data,
                   std::initializer_list<std::size_t> shape) {
  static Number nothing{};  // what an empty vector has in place of an address
  held->check_at_hand();
  nb::capsule owner(new ViewPin(held),
                    [](void* pin) noexcept { delete static_cast<ViewPin*>(pin); });
  return nb::cast(nb::ndarray<nb::numpy, Number, nb::c_contig>(data == nullptr ? &nothing : data,
                                                               shape.size(), shape.begin(), owner));
}

}  // namespace sheaf
