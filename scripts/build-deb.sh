#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds Debian's source and binary packages (sheaf, libsheaf-dev) of what is committed, from a
# clean clone, in build/deb; has lintian look at them; unpacks them into an empty folder, and there
# runs the command and compiles and runs a program by find_package and by pkg-config.
#   scripts/build-deb.sh [--source-only]
# scripts/install-deps.sh --deb installs what this needs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD out=$PWD/build/deb
version=$(sed -n 's/^project(sheaf VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
packaged=$(sed -n '1s/.*(\(.*\)-[^-]*).*/\1/p' packaging/debian/changelog)
fail() {
  echo "deb: $*" >&2
  exit 1
}
[ "$version" = "$packaged" ] ||
  fail "packaging/debian/changelog: found version $packaged, expected $version as CMakeLists.txt has"
for tool in dpkg-buildpackage dh lintian fakeroot; do
  command -v "$tool" >/dev/null || fail "$tool is not here (scripts/install-deps.sh --deb)"
done

rm -rf "$out"
mkdir -p "$out"
tree=$out/sheaf-$version
git clone --quiet --no-hardlinks "$root" "$tree"
git -C "$tree" archive --prefix="sheaf-$version/" HEAD | gzip -n >"$out/sheaf_$version.orig.tar.gz"
rm -rf "$tree/.git"
cp -a packaging/debian "$tree/debian"

options=(${SHEAF_CMAKE_OPTIONS:-})  # more of them, from outside
if command -v ccache >/dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  # debhelper gives the build a home of its own, where ccache would begin anew.
  CCACHE_DIR=$(ccache --get-config cache_dir)
  CCACHE_BASEDIR=$(ccache --get-config base_dir)
  CCACHE_NOHASHDIR=1
  export CCACHE_DIR CCACHE_BASEDIR CCACHE_NOHASHDIR
fi
kind=full
[ "${1:-}" = --source-only ] && kind=source
started=$SECONDS
echo "deb: building $kind packages in build/deb (log: build/deb/log)"
(cd "$tree" && SHEAF_CMAKE_OPTIONS=${options[*]} DEB_BUILD_OPTIONS="noautodbgsym parallel=$(nproc)" \
  dpkg-buildpackage --build="$kind" --unsigned-source --unsigned-changes >"$out/log" 2>&1) ||
  { tail -n 60 "$out/log" >&2; fail "the build failed; the whole log is build/deb/log"; }
echo "deb: built in $((SECONDS - started)) s"
lintian --allow-root --fail-on error --tag-display-limit 0 "$out"/*.changes
[ "$kind" = source ] && exit 0

prefix=$out/installed
mkdir "$prefix"
for package in "$out"/*.deb; do
  dpkg-deb -x "$package" "$prefix"
  echo "deb: ${package##*/}, $(stat -c %s "$package") bytes"
done
found=$("$prefix/usr/bin/sheaf" --version)
[ "$found" = "sheaf $version" ] || fail "the packaged command says '$found'"
echo "deb: the packaged command says '$found'"
if command -v man >/dev/null; then
  warnings=$(man --warnings=all --local-file "$prefix/usr/share/man/man1/sheaf.1.gz" 2>&1 >/dev/null)
  [ -z "$warnings" ] || fail "the manual page: $warnings"
fi

echo "deb: by find_package"
cmake -S examples -B "$out/examples" -DCMAKE_PREFIX_PATH="$prefix/usr" -DCMAKE_BUILD_TYPE=Release \
  >"$out/examples.log"
cmake --build "$out/examples" --target example_01_arrays >>"$out/examples.log" || { cat "$out/examples.log"; exit 1; }
program=$(find "$out/examples" -name example_01_arrays -type f -perm -u+x)
"$program"

echo "deb: by pkg-config"
pc=$(find "$prefix" -name sheaf.pc)
read -r -a flags <<<"$(PKG_CONFIG_PATH=${pc%/*} pkg-config --cflags --libs sheaf)"
"${CXX:-c++}" -std=c++20 -O1 examples/01_arrays.cc "${flags[@]}" -o "$out/arrays"
"$out/arrays"
