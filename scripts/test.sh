#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what is missing, builds, and runs all tests. Tests on real data are skipped, and named
# at the end, where the data is not there; scripts/get-data.sh fetches some of it.
#   scripts/test.sh [--preset NAME] [further arguments for ctest, such as -R Sphere]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=release
if [ "${1:-}" = --preset ]; then
  preset=$2
  shift 2
fi
scripts/install-deps.sh
scripts/python-env.sh
scripts/build.sh "$preset"
echo "test: real data is looked for in ${SHEAF_DATA:-data}"
exec ctest --test-dir "build/$preset" -j "$(nproc)" --output-on-failure "$@"
