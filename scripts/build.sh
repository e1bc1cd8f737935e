#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Configures and builds one preset in build/PRESET; quiet unless something goes wrong.
#   scripts/build.sh PRESET [--target NAME] [-D...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=$1
shift
targets=()
definitions=()
while [ $# -gt 0 ]; do
  case $1 in
    --target) targets+=(--target "$2"); shift 2 ;;
    *) definitions+=("$1"); shift ;;
  esac
done
if command -v ccache >/dev/null; then
  definitions+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

mkdir -p build
log=build/$preset.log
started=$SECONDS
echo "build: $preset in build/$preset (log: $log)"
fail() {
  tail -n 60 "$log" >&2
  echo "build: failed; the whole log is $log" >&2
  exit 1
}
cmake --preset "$preset" "${definitions[@]}" >"$log" 2>&1 || fail
# Kernels compiled for several instruction sets take up to 1 GB each to compile.
jobs=$(awk -v cores="$(nproc)" '/MemAvailable/ {n = int($2 / 1.2e6); if (n > cores) n = cores;
       if (n < 1) n = 1; print n}' /proc/meminfo)
cmake --build "build/$preset" -j "$jobs" "${targets[@]}" >>"$log" 2>&1 || fail
echo "build: done in $((SECONDS - started)) s"
