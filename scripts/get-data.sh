#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Fetches dubrovnik-16, a real bundle adjustment problem (16 cameras, 22106 points, 83718
# observations), to ${SHEAF_DATA:-data}/bal/. It comes inside Debian's and Ubuntu's source package
# ceres-solver; else from the project "Bundle Adjustment in the Large" itself. Nothing of the
# system's own apt state is touched, and no root rights are needed.
# Exit status: 0 the file is there and its checksum is right; 1 it could not be had (said why).
#   scripts/get-data.sh [--retry]    --retry: even if an attempt failed less than a day ago
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

top=${SHEAF_DATA:-data}
folder=$top/bal
target=$folder/dubrovnik-16-22106-pre.txt
sha256=e128b6b076399db26007a92323d98fe7b48db2a31089240273f40f582e612a91
name=problem-16-22106-pre.txt
page=https://grail.cs.washington.edu/projects/bal/data/dubrovnik/$name.bz2

say() { echo "get-data: $*"; }
is_right() { [ -f "$1" ] && [ "$(sha256sum <"$1" | cut -d' ' -f1)" = "$sha256" ]; }

if is_right "$target"; then
  say "$target is there, checksum verified"
  exit 0
fi
if ! command -v python3 >/dev/null; then
  say "python3 is missing: scripts/install-deps.sh installs it"
  exit 1
fi
mkdir -p "$top" 2>/dev/null || true
if [ ! -w "$top" ]; then
  say "cannot write to $top: going on without $name"
  exit 1
fi
failed_mark=$top/.download-failed
if [ "${1:-}" != --retry ] && [ -n "$(find "$failed_mark" -mmin -1440 2>/dev/null)" ]; then
  say "the download failed less than a day ago (scripts/get-data.sh --retry asks again)"
  exit 1
fi

scratch=$(mktemp -d "${TMPDIR:-/tmp}/sheaf-data.XXXXXX")
trap 'rm -rf "$scratch"' EXIT

# The machine's own package sources, turned into source package lists in a scratch folder.
write_source_lists() {
  local file
  mkdir -p "$scratch/parts" "$scratch/lists/partial" "$scratch/cache/archives/partial"
  for file in /etc/apt/sources.list.d/*.sources; do
    [ -f "$file" ] && grep -qE '^Components:.*(main|universe)' "$file" &&
      sed 's/^Types:.*/Types: deb-src/' "$file" >"$scratch/parts/$(basename "$file")"
  done
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [ -f "$file" ] && sed -nE 's/^[[:space:]]*deb[[:space:]](.*[[:space:]](main|universe)([[:space:]].*)?)$/deb-src \1/p' \
      "$file" >"$scratch/parts/$(basename "$file" .list).list"
  done
  find "$scratch/parts" -empty -type f -delete
  [ -n "$(ls "$scratch/parts")" ]
}

from_source_package() {
  command -v apt-get >/dev/null && write_source_lists || return 1
  local apt=(apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$scratch/parts"
             -o Dir::State::lists="$scratch/lists" -o Dir::Cache="$scratch/cache"
             -o Acquire::Languages=none -o Acquire::Retries=1 -o Acquire::http::Timeout=10
             -o Acquire::https::Timeout=10 -o APT::Sandbox::User= -o Debug::NoLocking=true)
  say "looking for the source package ceres-solver"
  (
    cd "$scratch"
    timeout 180 "${apt[@]}" update || true  # one dead source among several does not matter
    timeout 180 "${apt[@]}" source --download-only ceres-solver
  ) >"$scratch/apt.log" 2>&1 || return 1
  # Python's own reader: a small machine may lack xz.
  python3 - "$name" "$scratch/found.txt" "$scratch"/ceres-solver_*.orig.tar.* <<'PYTHON' || return 1
import shutil, sys, tarfile
name, out, *tarballs = sys.argv[1:]
for tarball in tarballs:
    with tarfile.open(tarball) as archive:
        for member in archive:
            if member.name.endswith("/data/" + name):
                with open(out, "wb") as file:
                    shutil.copyfileobj(archive.extractfile(member), file)
PYTHON
  is_right "$scratch/found.txt"
}

from_bal_page() {
  say "looking at the project's own page"
  timeout 120 python3 - "$page" "$scratch/found.txt" 2>/dev/null <<'PYTHON' || return 1
import bz2, sys, urllib.request
with urllib.request.urlopen(sys.argv[1], timeout=10) as answer, open(sys.argv[2], "wb") as out:
    out.write(bz2.decompress(answer.read()))
PYTHON
  is_right "$scratch/found.txt"
}

if from_source_package || from_bal_page; then
  mkdir -p "$folder"
  mv "$scratch/found.txt" "$target"
  chmod 644 "$target"
  rm -f "$failed_mark"
  say "$target fetched, checksum verified"
else
  touch "$failed_mark"
  say "$name could not be had (offline?): going on without it"
  exit 1
fi
