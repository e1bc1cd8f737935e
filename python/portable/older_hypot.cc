// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What wheels call in place of hypot(), which the linker is told to wrap: the version that glibc
// has had all along. It computes the same and sets errno besides.
extern "C" {
double sheaf_older_hypot(double x, double y) noexcept;
double __wrap_hypot(double x, double y) noexcept;

#if defined(__x86_64__)
__asm__(".symver sheaf_older_hypot, hypot@GLIBC_2.2.5");
#else
__asm__(".symver sheaf_older_hypot, hypot@GLIBC_2.17");
#endif

double __wrap_hypot(double x, double y) noexcept { return sheaf_older_hypot(x, y); }
}
