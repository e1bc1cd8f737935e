#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Prints the name of a clang that links libFuzzer, the newest first; nothing where there is none.
set -euo pipefail
probe=$(mktemp)
trap 'rm -f "$probe"' EXIT
for candidate in clang++-{20,19,18,17,16,15,14} clang++; do
  if command -v "$candidate" >/dev/null &&
    printf '#include <string>\nextern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long n) { return std::string(n, 0).size() != n; }\n' |
    "$candidate" -std=c++20 -fsanitize=fuzzer,address,undefined -x c++ - -o "$probe" 2>/dev/null; then
    echo "$candidate"
    exit 0
  fi
done
