#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what Sheaf needs and this Debian or Ubuntu machine lacks.
#   scripts/install-deps.sh         to build and test
#   scripts/install-deps.sh --ci    also clang (fuzzing) and the pinned clang-format
set -euo pipefail

wanted=(cmake ninja-build g++ make pkg-config libtbb-dev libhwy-dev libfast-float-dev
        libeigen3-dev zlib1g-dev libbz2-dev libpng-dev libjpeg-dev libcli11-dev libfmt-dev
        nlohmann-json3-dev libgtest-dev libbenchmark-dev python3 python3-numpy)

is_installed() { dpkg-query -W -f '${db:Status-Status}\n' "$1" 2>/dev/null | grep -qx installed; }
is_offered() { apt-cache show "$1" >/dev/null 2>&1; }
as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    echo "install-deps: root rights are needed for: $*" >&2
    return 1
  fi
}

# The checks of CI: any clang with libFuzzer will do (the system's default first: it fits the
# system's C++ library), clang-format is pinned. The lists of packages may be empty on a new
# machine, so what is on offer is asked after `apt-get update` only.
default_clang() {
  grep -qE '^VERSION_CODENAME=bookworm' /etc/os-release && echo 14 || echo 18
}
ci_packages() {
  local version
  for version in $(default_clang) 19 18 16 15 14; do
    if is_installed "clang-$version" || is_offered "clang-$version"; then
      echo "clang-$version" "libclang-rt-$version-dev"
      break
    fi
  done
  if is_installed clang-format-14 || is_offered clang-format-14; then
    echo clang-format-14
  fi
}
missing_of() {
  local package
  for package in "$@"; do is_installed "$package" || echo "$package"; done
}
ci_complete() {
  local version
  version=$(default_clang)
  is_installed clang-format-14 && is_installed "clang-$version" &&
    is_installed "libclang-rt-$version-dev"
}

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "install-deps: no apt here; install by hand: ${wanted[*]}" >&2
  exit 0
fi

ci=false
[ "${1:-}" = --ci ] && ci=true
mapfile -t missing < <(missing_of "${wanted[@]}")
if [ ${#missing[@]} = 0 ] && { ! $ci || ci_complete; }; then
  echo "install-deps: nothing is missing"
  exit 0
fi

export DEBIAN_FRONTEND=noninteractive
apt_get() { as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 "$@"; }
echo "install-deps: asking for the list of packages (apt-get update)"
apt_get -qq update || echo "install-deps: apt-get update failed; trying with the lists at hand" >&2
if $ci; then
  read -r -a extra <<<"$(ci_packages | tr '\n' ' ')"
  mapfile -t missing < <(missing_of "${wanted[@]}" "${extra[@]}")
fi
if [ ${#missing[@]} = 0 ]; then
  echo "install-deps: nothing is missing"
  exit 0
fi
echo "install-deps: installing ${missing[*]}"
apt_get -qq install -y --no-install-recommends "${missing[@]}" >/dev/null
