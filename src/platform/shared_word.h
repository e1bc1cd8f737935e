// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// Words of an array that threads mark without an order between them, and that are plain again
/// afterwards: what std::atomic_ref does with std::memory_order_relaxed, which libc++ has only from
/// its release 19 on.
template <class Word>
Word load_shared(const Word& word) {
  return __atomic_load_n(&word, __ATOMIC_RELAXED);
}
template <class Word>
void store_shared(Word& word, Word value) {
  __atomic_store_n(&word, value, __ATOMIC_RELAXED);
}
/// Sets the given bits.
template <class Word>
void set_shared_bits(Word& word, Word bits) {
  __atomic_fetch_or(&word, bits, __ATOMIC_RELAXED);
}

}  // namespace sheaf
