#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Makes build/python-env, the virtual environment that the Python module is built and tested with:
# the system's Python and NumPy, and nanobind and mypy from the package index. Without the index
# the module is left out, and said to be; nothing else of the build needs it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
env=build/python-env
wanted=("nanobind>=3.1,<4" "mypy>=1.8,<3")

works() { "$env/bin/python" -c 'import nanobind, numpy, mypy' 2>/dev/null; }
if works; then exit 0; fi
python=$(command -v /usr/bin/python3 || command -v python3 || true)
if [ -z "$python" ]; then
  echo "python-env: SKIPPED, no python3 here: the Python module is not built"
  exit 0
fi
mkdir -p build
log=build/python-env.log
if "$python" -m venv --system-site-packages --clear "$env" >"$log" 2>&1 &&
  "$env/bin/python" -m pip install --quiet --disable-pip-version-check "${wanted[@]}" >>"$log" 2>&1 &&
  works; then
  echo "python-env: made in $env"
else
  echo "python-env: SKIPPED, ${wanted[*]} cannot be had (log: $log): the Python module is not built"
  rm -rf "$env"
fi
