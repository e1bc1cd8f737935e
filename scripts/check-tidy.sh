#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Holds sources against .clang-tidy. A file takes some 5 to 13 s of a core, all of them over an hour,
# so that the usual run looks at few: the .cc files of src, cli, examples and tests that differ from
# BASE, for SECONDS at most. Headers are looked at through the files that include them. A file that
# there was no time for is named as NOT CHECKED, and fails nothing.
#   scripts/check-tidy.sh [--base COMMIT] [--seconds N]    by default the commit before, 120 s
#   scripts/check-tidy.sh --all                            every file, however long that takes
#   scripts/check-tidy.sh FILE...                          these
# It needs Debian's clang-tidy-14. CI does not run it yet: most files have not been looked at once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
base=HEAD~1 seconds=120 all=false
files=()
while [ $# -gt 0 ]; do
  case $1 in
    --base) base=$2; shift 2 ;;
    --seconds) seconds=$2; shift 2 ;;
    --all) all=true; shift ;;
    -*) echo "tidy: $1 is none of --base, --seconds, --all" >&2; exit 2 ;;
    *) files+=("$1"); shift ;;
  esac
done
if ! command -v clang-tidy-14 >/dev/null; then
  echo "tidy: clang-tidy-14 is not here: NOT CHECKED"
  exit 0
fi
folders=(src cli examples tests)
if $all; then
  mapfile -t files < <(find "${folders[@]}" -name '*.cc' | sort)
  seconds=$((24 * 3600))
elif [ ${#files[@]} -gt 0 ]; then
  seconds=$((24 * 3600))
else
  git rev-parse --quiet --verify "$base^{commit}" >/dev/null ||
    { echo "tidy: $base is no commit here: NOT CHECKED"; exit 0; }
  changed=$(git diff --name-only --diff-filter=d "$base" -- "${folders[@]}")
  mapfile -t files < <(grep '\.cc$' <<<"$changed" || true)
fi
if [ ${#files[@]} = 0 ]; then
  echo "tidy: no file has changed"
  exit 0
fi

# A build folder of its own, for its list of commands alone: nothing is compiled there.
mkdir -p build
cmake -S . -B build/tidy -G Ninja -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_BUILD_TYPE=Debug \
  >build/tidy.log 2>&1 || { tail -n 20 build/tidy.log >&2; exit 1; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export SHEAF_TIDY_WORK=$work SHEAF_TIDY_END=$(($(date +%s) + seconds))
# One file: an empty mark for each outcome, and what was found.
# shellcheck disable=SC2016
look='mark=$SHEAF_TIDY_WORK/$(tr / + <<<"$1")
  left=$((SHEAF_TIDY_END - $(date +%s)))
  [ "$left" -gt 0 ] || { touch "$mark.late"; exit 0; }
  status=0
  timeout "$left" clang-tidy-14 -p build/tidy --quiet "$1" >"$mark.found" 2>"$mark.err" || status=$?
  if [ "$status" = 124 ]; then touch "$mark.late"
  elif [ "$status" != 0 ]; then touch "$mark.bad"; cat "$mark.found"; grep "error:" "$mark.err" || true
  else touch "$mark.good"; fi'
printf '%s\0' "${files[@]}" | xargs -0 -P "$(nproc)" -n 1 bash -c "$look" look
count() { find "$work" -name "*.$1" | wc -l; }
find "$work" -name '*.late' -printf '%f\n' | sort | tr + / | sed 's/^/tidy: NOT CHECKED: /; s/\.late$//'
echo "tidy: $(count good) files are good, $(count bad) are not, $(count late) were not checked"
[ "$(count bad)" = 0 ]
