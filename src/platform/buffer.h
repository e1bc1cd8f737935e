// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

#include "platform/pages.h"

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
    if (size > SIZE_MAX / 2 / sizeof(T)) throw std::bad_alloc();
    const std::size_t bytes = size * sizeof(T);
    data_ = {static_cast<T*>(allocate_pages(bytes)), Free{bytes}};
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
  struct Free {
    std::size_t bytes = 0;
    void operator()(T* p) const { free_pages(p, bytes); }
  };
  std::unique_ptr<T, Free> data_;
  std::size_t size_ = 0;
};

}  // namespace sheaf
