#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Sheaf beside COLMAP's bundle adjuster on COLMAP models: those in $SHEAF_DATA/colmap, and generated
# ones of 500 images with one shared lens, three, and one each. Writes a table and JSON for each.
#   SHEAF_COMMAND=build/sheaf bench/models.sh [OUT]
# RUNS (5) of each solver, THREADS (1), IMAGES (500), POINTS (20000), SOLVERS (sheaf,colmap), ONLY (a
# part of the names of those to run). COLMAP's adapter needs a python3 that imports pycolmap.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
sheaf=$(realpath "${SHEAF_COMMAND:-build/sheaf}")
out=${1:-build/models}
mkdir -p "$out/peers"
ln -sf "$here/peers/peer_colmap.py" "$out/peers/peer-colmap"

compare() {  # name, model, more options
  local name=$1 model=$2
  shift 2
  case $name in *"${ONLY:-}"*) ;; *) return 0 ;; esac
  "$sheaf" compare "$model" --solvers "${SOLVERS:-sheaf,colmap}" --peers "$out/peers" \
    --runs "${RUNS:-5}" --threads "${THREADS:-1}" --json "$out/$name.json" --quiet "$@" |
    tee "$out/$name.txt"
}

make() {  # name, options of generate
  local name=$1
  shift
  case $name in *"${ONLY:-}"*) ;; *) return 0 ;; esac
  "$sheaf" generate "$out/$name" --cameras "${IMAGES:-500}" --points "${POINTS:-20000}" \
    --mean-track 6 "$@" > /dev/null
  compare "$name" "$out/$name"
}

for model in "${SHEAF_DATA:-data}"/colmap/*/; do
  [ -e "$model" ] && compare "$(basename "$model")" "$model"
done
make opencv-shared --camera OPENCV --shared
make opencv-three --camera OPENCV --lenses 3
make opencv-own --camera OPENCV
# COLMAP has no residuals behind the image plane: less than 180 degrees, start included.
make fisheye-shared --camera OPENCV_FISHEYE --shared --field-of-view 160
