#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# One scene in pieces, by 1 to 3 ranks of 1 and 2 threads, against `sheaf solve`: the costs, and
# whether the pieces' files are the same bytes. The rows of docs/machines.md.
#   bench/machines.sh SCENE PIECES [OPTIONS OF BOTH SOLVES...]     SHEAF_BUILD: default build/ci
set -euo pipefail
build=$(realpath "${SHEAF_BUILD:-build/ci}")
scene=$(realpath "$1") pieces=$2
shift 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMP_NUM_THREADS=1
"$build/sheaf" split "$scene" "$folder/pieces" --pieces "$pieces" --quiet >/dev/null
"$build/sheaf" solve "$scene" --quiet --json "$folder/solve.json" "$@" >/dev/null
for ranks in 1 2 3; do
  for threads in 1 2; do
    rm -rf "$folder/out"
    timeout 600 mpirun --allow-run-as-root --oversubscribe -n "$ranks" "$build/sheaf-mpi" solve \
      "$folder/pieces" -o "$folder/out" --quiet --threads "$threads" --json "$folder/mpi.json" "$@" \
      >/dev/null </dev/null
    echo "$ranks ranks of $threads threads: $(cat "$folder"/out/* | sha256sum | cut -c1-16)"
  done
done
"$build/sheaf" join "$scene" "$folder/out" --quiet --json "$folder/join.json" >/dev/null
python3 - "$folder" <<'P'
import json, sys
solve, mpi, join = (json.load(open(f"{sys.argv[1]}/{name}.json")) for name in ("solve", "mpi", "join"))
own, found = solve["final_cost"], mpi["final_cost"]
iterations = lambda run: sum(step["linear_iterations"] for step in run["iterations"])
print(f"solve {own:.15g}, sheaf-mpi {found:.15g}: {(found - own) / own:.1e} apart; plain cost joined "
      f"{join['final_cost']:.15g}; conjugate gradients {iterations(solve)} and {iterations(mpi)}")
P
