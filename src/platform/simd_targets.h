// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which instruction sets Highway compiles the kernels for; included before <hwy/...>. On x86-64
// four are enough: what lies between them (SSSE3, AVX-512 with more integer instructions) brings
// doubles nothing and costs code size. The slowest is plain scalar code, for any machine.
#if defined(__x86_64__) || defined(_M_X64)
#define HWY_BASELINE_TARGETS HWY_SCALAR
// Else GCC from 12.3 on and clang would have EMU128 for a baseline, which is not among these.
#define HWY_BROKEN_EMU128 1
#if defined(SHEAF_FEW_INSTRUCTION_SETS)
// Slow builds that look for one kind of error: the others run the same lines but for a few
// shuffles.
#define HWY_DISABLED_TARGETS (~(HWY_SCALAR | HWY_AVX2))
#else
#define HWY_DISABLED_TARGETS (~(HWY_SCALAR | HWY_SSE4 | HWY_AVX2 | HWY_AVX3))
#endif
#elif defined(__aarch64__)
// One: NEON, which every such machine has, with fused multiply-add. SVE stays off, whose vectors
// have no size at compile time and go into no array. Without a choice at run time Highway marks no
// function as for another target than its file's, so that constructors which are not written out,
// and would not be marked, may take part. (Its older releases know the last name alone.)
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#define HWY_COMPILE_ONLY_STATIC 1
#define HWY_HAVE_RUNTIME_DISPATCH 0
#define TOOLCHAIN_MISS_SYS_AUXV_H 1
#endif
