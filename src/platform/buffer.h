// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace sheaf {

/// An array aligned to cache lines whose elements are not initialised: pages are first touched by
/// whoever fills them, and nothing is written twice.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Buffer() = default;
  explicit Buffer(std::size_t size) { allocate(size); }

  /// Forgets the content and makes room for `size` elements. Throws std::bad_alloc.
  void allocate(std::size_t size) {
    data_.reset();
    size_ = 0;
    if (size == 0) return;
    // Of a large array, touching 4 KiB at a time for the first time costs more than filling it.
    const std::size_t alignment = size * sizeof(T) >= kLarge ? kHugePage : 64;
    const std::size_t bytes = (size * sizeof(T) + alignment - 1) / alignment * alignment;
    data_.reset(static_cast<T*>(std::aligned_alloc(alignment, bytes)));
    if (!data_) throw std::bad_alloc();
#if defined(__linux__)
    if (alignment == kHugePage) (void)::madvise(data_.get(), bytes, MADV_HUGEPAGE);
#endif
    size_ = size;
  }
  void fill(T value) { std::fill(begin(), end(), value); }

  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  T& operator[](std::size_t i) { return data_.get()[i]; }
  const T& operator[](std::size_t i) const { return data_.get()[i]; }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  static constexpr std::size_t kLarge = std::size_t(1) << 19, kHugePage = std::size_t(2) << 20;
  struct Free {
    void operator()(T* p) const { std::free(p); }
  };
  std::unique_ptr<T, Free> data_;
  std::size_t size_ = 0;
};

}  // namespace sheaf
