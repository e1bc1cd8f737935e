#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the fuzz targets with clang's libFuzzer and runs each for a while.
#   scripts/run-fuzzers.sh [SECONDS_EACH]    default 60
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-60}

mkdir -p build
compiler=
for candidate in clang++-{20,19,18,17,16,15,14} clang++; do
  if command -v "$candidate" >/dev/null &&
    printf '#include <string>\nextern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long n) { return std::string(n, 0).size() != n; }\n' |
    "$candidate" -std=c++20 -fsanitize=fuzzer,address,undefined -x c++ - -o build/fuzz-probe 2>/dev/null; then
    compiler=$candidate
    break
  fi
done
if [ -z "$compiler" ]; then
  echo "fuzz: no clang with libFuzzer here: NOT RUN"
  exit 0
fi

scripts/build.sh fuzz --target fuzz/all -DCMAKE_CXX_COMPILER="$compiler"
mapfile -t targets < <(find build/fuzz/fuzz -maxdepth 1 -type f -executable -name '*fuzz*' | sort)
if [ ${#targets[@]} = 0 ]; then
  echo "fuzz: no target was built" >&2
  exit 1
fi
for target in "${targets[@]}"; do
  name=$(basename "$target")
  corpus=build/fuzz/corpus/$name
  mkdir -p "$corpus"
  seeds=()
  [ -d "fuzz/corpus/${name%_fuzz}" ] && seeds=("fuzz/corpus/${name%_fuzz}")
  [ -d "fuzz/corpus/$name" ] && seeds=("fuzz/corpus/$name")
  echo "fuzz: $name for $seconds s, seeds: ${seeds[*]:-none}"
  if ! "$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=3000 -print_final_stats=1 \
    -artifact_prefix=build/fuzz/"$name"- "$corpus" "${seeds[@]}" >"build/fuzz/$name.log" 2>&1; then
    tail -n 60 "build/fuzz/$name.log" >&2
    echo "fuzz: $name found a failing input (build/fuzz/$name-*)" >&2
    exit 1
  fi
  grep -E 'number_of_executed_units|DONE' "build/fuzz/$name.log" | sed 's/^/fuzz:   /'
done
