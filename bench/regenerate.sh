#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Measures everything on this machine and rewrites BENCHMARKS.md, its plots and the README's table.
# What it uses, all optional, from the environment:
#   SHEAF_DATA          folder with bal/*.txt                                     [data]
#   SHEAF_PROBLEMS      files to run instead, separated by spaces
#   SHEAF_PEERS         peers installed in places of their own, "name=prefix ..."; they are taken
#                       to be built for this machine. Names begin with ceres, g2o, pba or rootba.
#                       A Ceres or g2o that CMake finds by itself is used as well, as
#                       ceres-<version> and g2o.
#   SHEAF_PEER_FLAGS    flags those in SHEAF_PEERS were built with                [-march=native]
#   SHEAF_PEER_MODULES  folder with CMake modules that a peer's package asks for
#   SHEAF_PEER_PYTHON   a Python that has the gtsam package                       [python3]
#   SHEAF_BENCH_RUNS, SHEAF_BENCH_THREADS                                         [5] [1,2]
#   SHEAF_SOLVERS       NAME:CONFIG,... instead of the list below
#   SHEAF_LADDER        folder for synthetic scenes: then suite.py measures the whole ladder too,
#                       for hours; SHEAF_SUITE holds options for it
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=$root/build/bench
peers=$build/peers
plots=docs/bench
mkdir -p "$peers"

only() { # PEER: options that leave all others out
  for peer in CERES G2O PBA ROOTBA; do
    [ "$peer" = "$1" ] || echo "-DSHEAF_PEER_$peer=OFF"
  done
}

build_peer() { # NAME PROGRAM CMAKE-ARGUMENTS...
  local name=$1 program=$2
  shift 2
  cmake -S "$root/bench/peers" -B "$build/adapter-$name" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_MODULE_PATH="${SHEAF_PEER_MODULES:-}" "$@" > "$build/adapter-$name.log" 2>&1 &&
    cmake --build "$build/adapter-$name" >> "$build/adapter-$name.log" 2>&1 || {
      echo "$name: its adapter does not build, see $build/adapter-$name.log" >&2
      return 0
    }
  if [ -x "$build/adapter-$name/$program" ]; then
    ln -sf "$build/adapter-$name/$program" "$peers/peer-$name"
  fi
}

echo "== building" >&2
# shellcheck disable=SC2046  # options are separated by white space
cmake -S "$root" -B "$build/sheaf" -DCMAKE_BUILD_TYPE=Release -DSHEAF_BUILD_BENCH=ON \
  -DSHEAF_BUILD_TESTS=OFF -DSHEAF_BUILD_EXAMPLES=OFF $(only NONE) > "$build/sheaf.log"
cmake --build "$build/sheaf" >> "$build/sheaf.log"
ln -sf "$(find "$build/sheaf" -name peer-evaluate -type f | head -n 1)" "$peers/peer-evaluate"
SHEAF_COMMAND=${SHEAF_COMMAND:-$(find "$build/sheaf" -name sheaf -type f -perm -u+x | head -n 1)}
export SHEAF_COMMAND

# shellcheck disable=SC2046
build_peer ceres-system peer-ceres $(only CERES)
if [ -L "$peers/peer-ceres-system" ]; then # named by its version, 2.1 and not 2.1.0
  version=$(sed -n 's/^-- Ceres \([0-9]*\.[0-9]*\).*/\1/p' "$build/adapter-ceres-system.log")
  mv "$peers/peer-ceres-system" "$peers/peer-ceres-$version"
fi
# shellcheck disable=SC2046
build_peer g2o-system peer-g2o $(only G2O)
if [ -L "$peers/peer-g2o-system" ]; then
  mv "$peers/peer-g2o-system" "$peers/peer-g2o"
fi
for entry in ${SHEAF_PEERS:-}; do
  name=${entry%%=*}
  case $name in
    ceres*) kind=ceres ;;
    g2o*) kind=g2o ;;
    pba*) kind=pba ;;
    rootba*) kind=rootba ;;
    *) echo "$name: no adapter of that name" >&2 && continue ;;
  esac
  # shellcheck disable=SC2046
  build_peer "$name" peer-$kind $(only "${kind^^}") -DCMAKE_PREFIX_PATH="${entry#*=}" \
    -DCMAKE_CXX_FLAGS="${SHEAF_PEER_FLAGS--march=native}"
done
python=${SHEAF_PEER_PYTHON:-python3}
if "$python" -c 'import gtsam' 2> /dev/null; then
  printf '#!/bin/sh\nexec "%s" "%s" "$@"\n' "$(command -v "$python")" \
    "$root/bench/peers/peer_gtsam.py" > "$peers/peer-gtsam"
  chmod +x "$peers/peer-gtsam"
fi

ceres_head="ceres-head:dense_schur-analytic,ceres-head:dense_schur-auto,ceres-head:dense_schur-analytic-radius=1e6,ceres-head:dense_schur-analytic-inner,ceres-head:dense_schur-analytic-inner-radius=1e6,ceres-head:sparse_schur-analytic,ceres-head:iterative_explicit-analytic,ceres-head:iterative_implicit-analytic,ceres-head:iterative_implicit-analytic-jacobi"
ceres_old="ceres-2.1:dense_schur-auto,ceres-2.1:dense_schur-analytic,ceres-2.1:dense_schur-analytic-radius=1e6,ceres-2.1:iterative_explicit-analytic"
g2o="g2o:eigen,g2o:eigen-lambda=1e-4,g2o:eigen-lambda=1e-2,g2o:eigen-lambda=1,g2o:cholmod-lambda=1e-2,g2o-omp:eigen-lambda=1e-2"
rootba="rootba:schur-double,rootba:schur-float,rootba:sqrt-double,rootba:sqrt-float"
solvers=${SHEAF_SOLVERS:-sheaf:auto,$ceres_head,$ceres_old,$g2o,$rootba,gtsam:cholesky-metis-ceres}
data=${SHEAF_DATA:-$root/data}/bal
problems=${SHEAF_PROBLEMS:-$data/dubrovnik-16-22106-pre.txt $data/trafalgar-21-11315-pre.txt $data/ladybug-49-7776-pre.txt}

echo "== measuring the machine and the kernels" >&2
machine=$(find "$build/sheaf" -name bench-machine -type f | head -n 1)
"$machine" --json > "$build/machine.json"
kernels=()
kernel_program=$(find "$build/sheaf" -name bench-kernels -type f | head -n 1)
if [ -n "$kernel_program" ]; then
  "$kernel_program" --benchmark_out="$build/kernels.json" --benchmark_out_format=json >&2
  kernels=("$build/kernels.json")
fi

echo "== running side by side" >&2
# shellcheck disable=SC2086  # problems are separated by spaces
python3 "$root/bench/side_by_side.py" --problems $problems --solvers "$solvers" \
  --peers "$peers" --threads "${SHEAF_BENCH_THREADS:-1,2}" --runs "${SHEAF_BENCH_RUNS:-5}" \
  --machine "$build/machine.json" --out "$build/results"
mkdir -p "$root/$plots"
cp "$build"/results/cost-*.svg "$root/$plots/"
python3 "$root/bench/write_pages.py" "$build/results/results.json" "$root" "$plots" "${kernels[@]}"
if [ -n "${SHEAF_LADDER:-}" ]; then
  echo "== the ladder" >&2
  # shellcheck disable=SC2086
  python3 "$root/bench/suite.py" --ladder "$SHEAF_LADDER" --peers "$peers" --pages "$root" \
    --machine "$build/machine.json" --out "$build/suite" ${SHEAF_SUITE:-}
fi
echo "wrote BENCHMARKS.md, $plots/*.svg and the README's table; runs: $build/results" >&2
