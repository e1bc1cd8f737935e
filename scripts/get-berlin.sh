#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Fetches OpenSfM's example "berlin" (three photographs with GPS tags, control points in both of
# OpenSfM's forms) from its repository to ${SHEAF_DATA:-data}/berlin/. Its list of ten control points
# is of an older commit: the newer file has three, one of them without coordinates.
# Exit status: 0 all is there and its checksums are right; 1 it could not be had (said why).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

folder=${SHEAF_DATA:-data}/berlin
pages=https://raw.githubusercontent.com/mapillary/OpenSfM
new=238744cdf3b5d50149c50d136a87f7fea25ad5cd
old=04ac8afd8dbf5256cdf4119539e194e074f7b1ef
say() { echo "get-berlin: $*"; }

# get FILE COMMIT SHA256
get() {
  local target=$folder/$1 part=$folder/$1.part
  if [ -f "$target" ] && sha256sum --status -c - <<<"$3  $target"; then return; fi
  mkdir -p "$(dirname "$target")"
  if ! curl -fsSL --retry 2 --max-time 120 -o "$part" "$pages/$2/data/berlin/$1"; then
    rm -f "$part"
    say "$1 could not be had (offline?)"
    exit 1
  fi
  if ! sha256sum --status -c - <<<"$3  $part"; then
    rm -f "$part"
    say "$1 came with another checksum than it should have"
    exit 1
  fi
  mv "$part" "$target"
}

command -v curl >/dev/null || { say "curl is missing"; exit 1; }
get images/01.jpg $new 4b3fbfb5d2bda883f7e971535fb71ecb7b45c8fcda35606c6d856e1fb923ffce
get images/02.jpg $new d21b2fd5a3b41b9f244a6317400a8e4a44609dd318213598c2e894f9ead9141a
get images/03.jpg $new afec918e18fcf5ec6a66c5e3b2185117d3a04b583c31e8a1371f195a38b45501
get ground_control_points.json $new 6d49272cb75928145a6229f2ade3d06980419beffb63f2dac08482bc8b444ca3
get gcp_list.txt $old 930a2b4d311f114466791a88f94d009a8e9b90c1e2e2a9a93ee62e3fc9dd8fc1
say "$folder is there, checksums verified"
