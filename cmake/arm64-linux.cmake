# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Toolchain file: from Debian's cross compiler and a folder of unpacked arm64 packages, which
# scripts/check-arm64.sh makes, to 64-bit ARM.
#   cmake -S . -B build/arm64 -DCMAKE_TOOLCHAIN_FILE=cmake/arm64-linux.cmake -DSHEAF_ARM64_ROOT=...
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
find_program(CMAKE_CXX_COMPILER NAMES aarch64-linux-gnu-g++ aarch64-linux-gnu-g++-14
             aarch64-linux-gnu-g++-13 aarch64-linux-gnu-g++-12 REQUIRED)

list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SHEAF_ARM64_ROOT)
set(CMAKE_FIND_ROOT_PATH ${SHEAF_ARM64_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind INCLUDE LIBRARY PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${SHEAF_ARM64_ROOT})
set(ENV{PKG_CONFIG_LIBDIR}
    ${SHEAF_ARM64_ROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${SHEAF_ARM64_ROOT}/usr/share/pkgconfig)
set(CMAKE_CXX_STANDARD_INCLUDE_DIRECTORIES ${SHEAF_ARM64_ROOT}/usr/include/aarch64-linux-gnu)
# What the shared libraries there need in turn.
foreach(kind EXE SHARED)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT
      "-Wl,-rpath-link,${SHEAF_ARM64_ROOT}/lib/aarch64-linux-gnu:${SHEAF_ARM64_ROOT}/usr/lib/aarch64-linux-gnu")
endforeach()
