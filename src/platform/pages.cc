// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/pages.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

// The address sanitizer watches the edges of what malloc gives, not those of a mapping.
#if defined(__SANITIZE_ADDRESS__)
#define SHEAF_PLAIN_MEMORY 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SHEAF_PLAIN_MEMORY 1
#endif
#endif
#if !defined(__linux__)
#define SHEAF_PLAIN_MEMORY 1
#endif

namespace sheaf {
namespace {

constexpr std::size_t kLine = 64, kPage = 4096, kHugePage = std::size_t(2) << 20;

std::size_t round_up(std::size_t bytes, std::size_t to) { return (bytes + to - 1) / to * to; }

void* from_heap(std::size_t bytes) {
  void* p = std::aligned_alloc(kLine, round_up(bytes, kLine));
  if (p == nullptr) throw std::bad_alloc();
  return p;
}

/// Whether the system gives huge pages where they are asked for.
bool huge_pages() {
  static const bool given = [] {
    char text[64] = "";
    std::FILE* file = std::fopen("/sys/kernel/mm/transparent_hugepage/enabled", "r");
    if (file == nullptr) return false;
    const bool read = std::fgets(text, sizeof text, file) != nullptr;
    std::fclose(file);
    return read && std::strstr(text, "[never]") == nullptr;
  }();
  return given;
}

}  // namespace

std::size_t mapped_bytes(std::size_t bytes) {
  const std::size_t over = bytes % kHugePage;
  return over > kHugePage / 4 && huge_pages() ? bytes - over + kHugePage : round_up(bytes, kPage);
}

#if defined(SHEAF_PLAIN_MEMORY)

void* allocate_pages(std::size_t bytes) { return from_heap(bytes); }
void free_pages(void* p, std::size_t) { std::free(p); }

#else

void* allocate_pages(std::size_t bytes) {
  if (bytes < kMappedFrom) return from_heap(bytes);
  const std::size_t size = mapped_bytes(bytes), all = size + kHugePage;
  if (all < bytes) throw std::bad_alloc();
  void* mapped = ::mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) throw std::bad_alloc();
  char* const begin = static_cast<char*>(mapped);
  const std::size_t before = -reinterpret_cast<std::uintptr_t>(begin) % kHugePage;
  if (before > 0) ::munmap(begin, before);
  ::munmap(begin + before + size, kHugePage - before);
  (void)::madvise(begin + before, size, MADV_HUGEPAGE);
  return begin + before;
}

void free_pages(void* p, std::size_t bytes) {
  if (bytes < kMappedFrom)
    std::free(p);
  else
    ::munmap(p, mapped_bytes(bytes));
}

#endif

}  // namespace sheaf
