// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace sheaf {

/// Large arrays are mappings of their own, so that what they hold of the machine's memory is known
/// beforehand and is given back at once, whatever the heap does. Mappings begin at a huge page: of
/// a large array, touching 4 KiB at a time for the first time costs more than filling it.
constexpr std::size_t kMappedFrom = std::size_t(1) << 19;

/// Bytes mapped for an array of so many: whole huge pages, and small pages for up to a quarter of
/// one; small pages alone where the system has no others.
std::size_t mapped_bytes(std::size_t bytes);

/// An array of `bytes`, aligned to cache lines and, if mapped, zero. Throws std::bad_alloc.
void* allocate_pages(std::size_t bytes);
void free_pages(void* p, std::size_t bytes);

/// What an array of so many bytes will be resident with, all of it touched.
inline std::uint64_t resident_bytes_of(std::uint64_t bytes) {
  return bytes < kMappedFrom ? bytes : mapped_bytes(bytes);
}

}  // namespace sheaf
