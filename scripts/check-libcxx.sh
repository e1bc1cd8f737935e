#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Holds library, command and examples against what Macs have: libc++, which lacks some of GCC's
# library, and 64-bit integers of another type than std::size_t. Every file by itself, syntax only,
# with Clang 16 or what Clang with libc++ is here.
#   scripts/check-libcxx.sh [FILE...]
# scripts/install-deps.sh --libcxx installs what is needed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
started=$SECONDS
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# std::uint64_t is `unsigned long long` there; here it would be `unsigned long`, as std::size_t is
# on both. These stand before the C library's own.
mkdir "$scratch/bits"
for sign in int uint; do
  wide='long long'
  [ $sign = int ] || wide='unsigned long long'
  cat >"$scratch/bits/stdint-${sign}n.h" <<HEADER
#pragma once
#include <bits/types.h>
typedef __${sign}8_t ${sign}8_t;
typedef __${sign}16_t ${sign}16_t;
typedef __${sign}32_t ${sign}32_t;
typedef $wide ${sign}64_t;
HEADER
done
cat >"$scratch/library.cc" <<'PROGRAM'
#include <cstddef>
#include <cstdint>
#include <type_traits>
static_assert(_LIBCPP_VERSION > 0);
static_assert(std::is_same_v<std::uint64_t, unsigned long long>);
static_assert(std::is_same_v<std::size_t, unsigned long>);
PROGRAM
flags=(-std=c++20 -stdlib=libc++ "-I$scratch")

compiler=
for name in clang++-{16,17,18,19,20,21,15,14} clang++; do
  if command -v "$name" >/dev/null &&
    "$name" "${flags[@]}" -fsyntax-only "$scratch/library.cc" 2>/dev/null; then
    compiler=$name
    break
  fi
done
if [ -z "$compiler" ]; then
  echo "libc++: no Clang with libc++ is here: NOT CHECKED"
  exit 0
fi

read -r -a packages <<<"$(pkg-config --cflags eigen3 libhwy)"
flags+=(-Iinclude -Isrc -Icli "${packages[@]}" '-DSHEAF_VERSION="0"')
# The command's two large libraries once: they are most of a file's time.
printf '#include <CLI/CLI.hpp>\n#include <nlohmann/json.hpp>\n' >"$scratch/command.h"
"$compiler" "${flags[@]}" -x c++-header "$scratch/command.h" -o "$scratch/command.pch"

# A public header must stand by itself too.
files=("$@")
if [ ${#files[@]} = 0 ]; then
  mapfile -t files < <(find include -name '*.h' | sort; find src cli examples -name '*.cc' | sort)
fi
export compiler scratch
check_one() {
  local extra=()
  case $1 in
    *.h) extra=(-x c++ -Wno-pragma-once-outside-header) ;;
    cli/*) extra=(-include-pch "$scratch/command.pch") ;;
  esac
  "$compiler" "${@:2}" -fsyntax-only "${extra[@]}" "$1" 2>&1 || echo "libc++: $1 fails"
}
export -f check_one
printf '%s\0' "${files[@]}" |
  xargs -0 -P 2 -I{} bash -c 'check_one "$@"' _ {} "${flags[@]}" >"$scratch/log"
if grep -q . "$scratch/log"; then
  cat "$scratch/log"
  failed=$(grep -c '^libc++: .* fails$' "$scratch/log" || true)
  echo "libc++: $failed of ${#files[@]} files fail with $compiler"
  exit 1
fi
echo "libc++: ${#files[@]} files with $compiler in $((SECONDS - started)) s"
