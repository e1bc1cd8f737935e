#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the tests with sanitizers and runs them.
#   scripts/run-sanitizers.sh asan    addresses and undefined behaviour, nearly all tests
#   scripts/run-sanitizers.sh tsan    data races, the tests with several threads at work (by their names)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
kind=$1

run_ctest() { ctest --test-dir "build/$kind" -j "$(nproc)" --output-on-failure "$@"; }
case $kind in
  asan)
    # A clang with libFuzzer compiles kernels in two thirds of GCC's time, and makes the fuzz targets
    # of the same library.
    compiler=$(scripts/find-fuzz-compiler.sh)
    scripts/build.sh asan ${compiler:+-DCMAKE_CXX_COMPILER="$compiler" -DSHEAF_BUILD_FUZZ=ON}
    # Left out, besides tests/solve and tests/reduced (studies of how solves converge, through code
    # that the command's tests run too): what measures memory or errors on many large problems or
    # computes dense inverses beside them, and what reads sources alone.
    ASAN_OPTIONS=detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1 run_ctest \
      -E 'PhotometricProof|FamilySizes|Family\.|MemoryForecast|RealOutliers|CheckBits|MonteCarlo|Study|IsTheDenseInverseForEveryModel|Floors'
    ;;
  tsan)
    # The distribution's TBB is not instrumented: src/platform/parallel.h runs its tasks on plain
    # threads in this build.
    export TSAN_OPTIONS=halt_on_error=1
    # Wide address randomisation stops this sanitizer on some kernels: switch it off for the run.
    run=()
    setarch "$(uname -m)" -R true 2>/dev/null && run=(setarch "$(uname -m)" -R)
    echo 'int main() {}' | c++ -fsanitize=thread -x c++ - -o build/tsan-probe
    if ! "${run[@]}" build/tsan-probe 2>/dev/null; then
      echo "tsan: this kernel does not let the thread sanitizer run: NOT CHECKED"
      exit 0
    fi
    # Signals are left out: this sanitizer keeps them back while a call waits that is begun again,
    # and their handler, which no other thread reads, has nothing for it to find.
    "${run[@]}" scripts/build.sh tsan
    "${run[@]}" ctest --test-dir build/tsan -j "$(nproc)" --output-on-failure \
      -R 'Thread|Parallel|SameBitsFor|Hash|Examples.Arrays' --no-tests=error
    ;;
  *)
    echo "usage: scripts/run-sanitizers.sh asan|tsan" >&2
    exit 2
    ;;
esac
