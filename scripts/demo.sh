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

echo
echo "demo: a generated scene (nothing to download)"
"$sheaf" demo

echo
mkdir -p out
if scripts/get-data.sh; then
  scene=${SHEAF_DATA:-data}/bal/dubrovnik-16-22106-pre.txt
  refined=out/dubrovnik-16-refined.txt
  echo "demo: the real scene dubrovnik-16"
else
  scene=out/generated.txt
  refined=out/generated-refined.txt
  echo "demo: the real scene could not be had: a generated one in a file instead"
  "$sheaf" generate "$scene" --cameras 16 --points 22000
fi
echo "+ sheaf solve $scene -o $refined --ply ${refined%.txt}.ply --json ${refined%.txt}.json"
"$sheaf" solve "$scene" -o "$refined" --ply "${refined%.txt}.ply" --json "${refined%.txt}.json"
echo "demo: wrote $refined, ${refined%.txt}.ply (open it in a point cloud viewer) and ${refined%.txt}.json"
