// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The command, with these in place of the library's own: the n-th allocation that main makes fails,
// for the n of the variable SHEAF_FAILING_ALLOCATION, and only that one.

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "command_line.h"
#include "verb.h"

namespace {

std::atomic<long> left{0};

void* allocated(std::size_t size, std::size_t alignment) {
  if (left > 0 && --left == 0) {
    if (const std::new_handler told = std::get_new_handler()) told();
    throw std::bad_alloc();
  }
  if (size == 0) size = 1;
  void* memory = nullptr;
  if (alignment <= alignof(std::max_align_t))
    memory = std::malloc(size);
  else if (posix_memalign(&memory, alignment, size) != 0)
    memory = nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return allocated(size, 1); }
void* operator new[](std::size_t size) { return allocated(size, 1); }
void* operator new(std::size_t size, std::align_val_t to) {
  return allocated(size, static_cast<std::size_t>(to));
}
void* operator new[](std::size_t size, std::align_val_t to) {
  return allocated(size, static_cast<std::size_t>(to));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

int main(int argc, char** argv) {
  const char* text = std::getenv("SHEAF_FAILING_ALLOCATION");
  left = text != nullptr ? std::atol(text) : 0;
  return sheaf::run_command_line(argc, argv, sheaf::all_verbs);
}
