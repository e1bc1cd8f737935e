#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what Sheaf needs and this Debian or Ubuntu machine lacks.
#   scripts/install-deps.sh             to build and test
#   scripts/install-deps.sh --ci        also clang (fuzzing), the pinned clang-format, Chromium
#   scripts/install-deps.sh --libcxx    also clang with libc++, for scripts/check-libcxx.sh
#   scripts/install-deps.sh --arm64     also what scripts/check-arm64.sh builds and runs with
#   scripts/install-deps.sh --deb       also what scripts/build-deb.sh packages with
#   scripts/install-deps.sh --docs      also Doxygen, for scripts/build-docs.sh
#   scripts/install-deps.sh --mpi       also MPI and PETSc, for sheaf-mpi (docs/machines.md)
# Several at once will do.
set -euo pipefail

wanted=(cmake ninja-build g++ make pkg-config libtbb-dev libhwy-dev libfast-float-dev
        libeigen3-dev zlib1g-dev libbz2-dev libpng-dev libjpeg-dev libgeographiclib-dev
        libsqlite3-dev libexif-dev libutf8proc-dev libmetis-dev libcli11-dev libfmt-dev nlohmann-json3-dev
        libgtest-dev libbenchmark-dev python3 python3-numpy python3-dev python3-venv python3-pip)

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
# For the browser's test, which is skipped without. What Ubuntu calls chromium-browser is a snap, of no
# use in a container; a machine that has a browser by another way needs none.
has_browser() {
  local name
  for name in chromium chromium-browser google-chrome google-chrome-stable; do
    if command -v "$name" >/dev/null; then return 0; fi
  done
  return 1
}
install_browser() {
  if has_browser; then return 0; fi
  local started=$SECONDS
  if is_offered chromium &&
    as_root env DEBIAN_FRONTEND=noninteractive timeout 300 apt-get -qq \
      -o DPkg::Lock::Timeout=120 install -y --no-install-recommends chromium >/dev/null; then
    echo "install-deps: installed chromium in $((SECONDS - started)) s"
  else
    echo "install-deps: no Chromium can be had here; the browser's test will be skipped" >&2
  fi
}
# Clang 16 with the library that Macs have, or what comes next to it.
libcxx_packages() {
  local version
  for version in 16 17 18 19 15 14; do
    if is_installed "libc++-$version-dev" || is_offered "libc++-$version-dev"; then
      echo "clang-$version" "libc++-$version-dev" "libc++abi-$version-dev"
      return
    fi
  done
}
# A cross compiler, and an emulator that runs what it makes.
arm64_packages=(g++-aarch64-linux-gnu qemu-user-static)
# dpkg-buildpackage's helpers, what looks at its packages, and what reads the manual page.
deb_packages=(dpkg-dev debhelper fakeroot lintian git man-db)
missing_of() {
  local package
  for package in "$@"; do is_installed "$package" || echo "$package"; done
}
ci_complete() {
  $ci || return 0
  local version
  version=$(default_clang)
  is_installed clang-format-14 && is_installed "clang-$version" &&
    is_installed "libclang-rt-$version-dev" && has_browser
}
libcxx_complete() {
  ! $libcxx || { is_installed clang-16 && is_installed libc++-16-dev; }
}

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "install-deps: no apt here; install by hand: ${wanted[*]}" >&2
  exit 0
fi

ci=false libcxx=false
for flag in "$@"; do
  case $flag in
    --ci) ci=true ;;
    --libcxx) libcxx=true ;;
    --arm64) wanted+=("${arm64_packages[@]}") ;;
    --deb) wanted+=("${deb_packages[@]}") ;;
    --docs) wanted+=(doxygen) ;;
    --mpi) wanted+=(libpetsc-real-dev libopenmpi-dev openmpi-bin) ;;
    *) echo "install-deps: $flag is none of --ci, --libcxx, --arm64, --deb, --docs, --mpi" >&2
       exit 2 ;;
  esac
done
mapfile -t missing < <(missing_of "${wanted[@]}")
if [ ${#missing[@]} = 0 ] && ci_complete && libcxx_complete; then
  echo "install-deps: nothing is missing"
  exit 0
fi

export DEBIAN_FRONTEND=noninteractive
apt_get() { as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 "$@"; }
echo "install-deps: asking for the list of packages (apt-get update)"
apt_get -qq update || echo "install-deps: apt-get update failed; trying with the lists at hand" >&2
extra=()
if $ci; then read -r -a extra <<<"$(ci_packages | tr '\n' ' ')"; fi
if $libcxx; then read -r -a extra <<<"${extra[*]} $(libcxx_packages)"; fi
mapfile -t missing < <(missing_of "${wanted[@]}" "${extra[@]}")
if [ ${#missing[@]} = 0 ]; then
  echo "install-deps: no package is missing"
else
  echo "install-deps: installing ${missing[*]}"
  apt_get -qq install -y --no-install-recommends "${missing[@]}" >/dev/null
fi
if $ci; then install_browser; fi
