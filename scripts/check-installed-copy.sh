#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs a build to a scratch prefix, moves it (an installed copy must not remember where it was
# made), and compiles and runs the examples against it: by find_package and by pkg-config.
#   scripts/check-installed-copy.sh BUILD_FOLDER
set -euo pipefail
build=$(cd "$1" && pwd)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
scratch=$build/installed-copy
rm -rf "$scratch"
mkdir -p "$scratch"

echo "installed-copy: installing to $scratch/prefix"
cmake --install "$build" --prefix "$scratch/first" >"$scratch/install.log"
mv "$scratch/first" "$scratch/prefix"
if grep -rlF -e "$root/src" -e "$scratch/first" "$scratch/prefix" --include='*.cmake' --include='*.pc'; then
  echo "installed-copy: these files name the folder they were built in" >&2
  exit 1
fi
"$scratch/prefix/bin/sheaf" --version

echo "installed-copy: by find_package"
cmake -S "$root/examples" -B "$scratch/build" -DCMAKE_PREFIX_PATH="$scratch/prefix" \
  -DCMAKE_BUILD_TYPE=Release >"$scratch/configure.log"
cmake --build "$scratch/build" -j2 >"$scratch/build.log" || { cat "$scratch/build.log"; exit 1; }
(cd "$scratch/build" && ctest --output-on-failure)

echo "installed-copy: by pkg-config"
pc=$(find "$scratch/prefix" -name sheaf.pc)
export PKG_CONFIG_PATH=${pc%/*}
read -r -a flags <<<"$(pkg-config --cflags --libs sheaf)"
"${CXX:-c++}" -std=c++20 -O1 "$root/examples/01_arrays.cc" "${flags[@]}" \
  -Wl,-rpath,"$(dirname "$PKG_CONFIG_PATH")" -o "$scratch/arrays"
"$scratch/arrays"
