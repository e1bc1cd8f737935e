#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds library and command for 64-bit ARM with Debian's cross compiler, runs the command under
# user-mode emulation, and holds what it writes against this machine's own, byte for byte: NEON
# against AVX2. Debian's arm64 packages are unpacked in build/arm64-root: nothing is installed.
#   scripts/check-arm64.sh [--native PROGRAM]
# scripts/install-deps.sh --arm64 installs compiler and emulator. Real data: see scripts/get-data.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD/build/arm64-root
native=
[ "${1:-}" = --native ] && native=$(realpath "$2")

not_checked() {
  echo "arm64: $*: NOT CHECKED"
  exit 0
}
fail() {
  echo "arm64: $*" >&2
  exit 1
}
grep -qw avx2 /proc/cpuinfo || not_checked "this machine has no AVX2 to compare with"
emulator=$(command -v qemu-aarch64-static || command -v qemu-aarch64 || true)
[ -n "$emulator" ] || not_checked "no emulator is here (qemu-aarch64)"
command -v aarch64-linux-gnu-g++ >/dev/null || command -v aarch64-linux-gnu-g++-12 >/dev/null ||
  not_checked "no cross compiler is here (aarch64-linux-gnu-g++)"

# Debian 12's names, in an apt of its own that knows arm64 alone and takes nothing for installed.
packages=(libtbb-dev libtbb12 libtbbmalloc2 libtbbbind-2-5 libhwy-dev libhwy1 libfast-float-dev
          libeigen3-dev zlib1g-dev zlib1g libbz2-dev libbz2-1.0 libpng-dev libpng16-16 libjpeg-dev
          libjpeg62-turbo-dev libjpeg62-turbo libgeographiclib-dev libgeographiclib23 libsqlite3-dev
          libsqlite3-0 libexif-dev libexif12 libutf8proc-dev libmetis-dev libmetis5
          libutf8proc2 libcli11-dev libfmt-dev libfmt9 nlohmann-json3-dev)
unpack() {
  mkdir -p "$root"/apt/{lists,cache/archives}/partial "$root/packages"
  : >"$root/apt/status"
  cat >"$root/apt/apt.conf" <<CONF
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
APT::Sandbox::User "";
Dir::State "$root/apt";
Dir::State::status "$root/apt/status";
Dir::Cache "$root/apt/cache";
CONF
  export APT_CONFIG=$root/apt/apt.conf
  apt-get -qq update >"$root/log" 2>&1 || return 1
  (cd "$root/packages" && apt-get -qq download "${packages[@]}") >>"$root/log" 2>&1 || return 1
  local package
  for package in "$root"/packages/*.deb; do dpkg -x "$package" "$root"; done
  touch "$root/complete"
}
if [ ! -e "$root/complete" ] && ! (unpack); then
  tail -n 3 "$root/log"
  not_checked "Debian's arm64 packages cannot be had"
fi

echo "arm64: building in build/arm64 (log: build/arm64.log)"
started=$SECONDS
launcher=()
command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S . -B build/arm64 -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/arm64-linux.cmake" \
  -DSHEAF_ARM64_ROOT="$root" -DCMAKE_BUILD_TYPE=Release -DSHEAF_WERROR=ON \
  -DSHEAF_BUILD_TESTS=OFF -DSHEAF_BUILD_EXAMPLES=OFF "${launcher[@]}" >build/arm64.log 2>&1 &&
  cmake --build build/arm64 -j 2 >>build/arm64.log 2>&1 ||
  { tail -n 60 build/arm64.log >&2; fail "the build failed; the whole log is build/arm64.log"; }
echo "arm64: built in $((SECONDS - started)) s"
if [ -z "$native" ]; then
  scripts/build.sh ci --target sheaf_command
  native=$PWD/build/ci/sheaf
fi

libraries=$root/usr/lib/aarch64-linux-gnu:$root/lib/aarch64-linux-gnu
here() { "$native" "$@" --threads 2 --quiet >/dev/null; }
there() {
  "$emulator" -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH="$libraries" build/arm64/sheaf "$@" \
    --threads 2 --quiet >/dev/null
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/avx2" "$work/neon"
checked=0
# same WHAT FILE: what both wrote to FILE has the same bytes.
same() {
  diff -rq "$work/avx2/$2" "$work/neon/$2" || fail "$1: the bytes differ"
  checked=$((checked + 1))
  echo "arm64: the same bytes: $1"
}
generate() {  # NAME OPTION...
  here generate "$work/avx2/$1" "${@:2}"
  there generate "$work/neon/$1" "${@:2}"
  same "generate ${*:2}" "$1"
}
refine() {  # VERB PROBLEM OPTION...
  local in=$2
  [ -e "$in" ] || in=$work/avx2/$2
  local avx2=(--simd avx2) neon=(--simd neon)
  [ "$1" = photometric ] && avx2=() neon=()  # which has no such option, and one order of sums
  here "$1" "$in" -o "$work/avx2/out" "${avx2[@]}" "${@:3}"
  there "$1" "$in" -o "$work/neon/out" "${neon[@]}" "${@:3}"
  same "$1 ${2##*/} ${*:3}" out
  rm -rf "$work"/*/out
}

generate scene.txt --cameras 24 --points 3000
generate opencv --camera OPENCV --cameras 20 --points 1500
generate fisheye --camera OPENCV_FISHEYE --shared --cameras 12 --points 1000
generate patches --photometric --cameras 4 --points 300 --brightness 0.1 --start 0.5

bal=${SHEAF_DATA:-data}/bal/dubrovnik-16-22106-pre.txt
[ -e "$bal" ] || { echo "arm64: no real data is here: a generated scene instead"; bal=scene.txt; }
refine solve "$bal" --max-iterations 20
refine solve "$bal" --max-iterations 5 --points inverse-depth --loss huber:1
refine solve "$bal" --max-iterations 10 --fix points
refine solve scene.txt --max-iterations 20 --solver sparse --trust-region dogleg
refine solve scene.txt --max-iterations 10 --solver iterative-explicit --precision mixed
refine solve scene.txt --max-iterations 10 --solver iterative-implicit --precision mixed
refine solve opencv --max-iterations 10
refine solve opencv --max-iterations 10 --solver iterative-implicit --loss cauchy:2
refine solve fisheye --max-iterations 10
refine photometric patches --max-iterations 10
refine photometric patches --max-iterations 5 --points inverse-depth --interpolation bilinear
echo "arm64: NEON has the bits of AVX2 in all $checked"
