#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what is missing, builds, refines a scene that needs no download, and then a real one
# where it can be had. Nothing outside this folder changes but the packages it says it installs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install-deps.sh
scripts/build.sh release --target sheaf_command
sheaf=build/release/sheaf

mkdir -p out
run() {
  echo "+ sheaf $*"
  "$sheaf" "$@"
}

echo
echo "demo: a generated scene, nothing to download"
run demo --ply out/demo.ply

echo
echo "demo: images of a generated scene, refined from their pixels"
run generate out/images --photometric --grey-noise 2 --brightness 0.1
run photometric out/images -o out/images-refined --pictures out/pictures --ply out/images.ply

echo
if scripts/get-data.sh; then
  scene=${SHEAF_DATA:-data}/bal/dubrovnik-16-22106-pre.txt
  name=dubrovnik-16
  echo "demo: the real scene dubrovnik-16"
else
  scene=out/generated.txt
  name=generated
  echo "demo: without the real scene, a generated one of its size, read from a file"
  run generate "$scene" --cameras 16 --points 22106
fi
run solve "$scene" -o "out/$name-refined.txt" --ply "out/$name.ply" --json "out/$name.json"

echo
echo "demo: solved $scene; in out/ now: $name-refined.txt, $name.json, pictures/ of patches before"
echo "demo: and after, and for a viewer of point clouds (start in grey, result in colour) $name.ply,"
echo "demo: demo.ply and images.ply"
