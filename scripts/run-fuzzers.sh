#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the fuzz targets with clang's libFuzzer, in the address sanitizer's build, and runs each for
# a while, two at a time.
#   scripts/run-fuzzers.sh [SECONDS_EACH [SEED]]    default 60 and 1: from an empty build/fuzz/corpus
# a seed tries the same inputs in the same order, as many as the seconds allow; 0 draws a seed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-60}
seed=${2:-1}

compiler=$(scripts/find-fuzz-compiler.sh)
if [ -z "$compiler" ]; then
  echo "fuzz: no clang with libFuzzer here: NOT RUN"
  exit 0
fi
scripts/build.sh asan --target fuzz/all -DCMAKE_CXX_COMPILER="$compiler" -DSHEAF_BUILD_FUZZ=ON
mkdir -p build/fuzz
mapfile -t targets < <(find build/asan/fuzz -maxdepth 1 -type f -executable -name '*fuzz*' | sort)
if [ ${#targets[@]} = 0 ]; then
  echo "fuzz: no target was built" >&2
  exit 1
fi
run_one() {
  local target=$1 seconds=$2 seed=$3 name corpus seeds=()
  name=$(basename "$target")
  corpus=build/fuzz/corpus/$name
  mkdir -p "$corpus"
  [ -d "fuzz/corpus/${name%_fuzz}" ] && seeds=("fuzz/corpus/${name%_fuzz}")
  if ! "$target" -seed="$seed" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=3000 -print_final_stats=1 \
    -artifact_prefix=build/fuzz/"$name"- "$corpus" "${seeds[@]}" >"build/fuzz/$name.log" 2>&1; then
    tail -n 60 "build/fuzz/$name.log" >&2
    echo "fuzz: $name found a failing input (build/fuzz/$name-*)" >&2
    return 1
  fi
  echo "fuzz: $name for $seconds s, seeds: ${seeds[*]:-none}, inputs:" \
    "$(sed -n 's/^stat::number_of_executed_units: *//p' "build/fuzz/$name.log")"
}
export -f run_one
printf '%s\0' "${targets[@]}" | xargs -0 -P 2 -I{} bash -c 'run_one "$@"' _ {} "$seconds" "$seed"
