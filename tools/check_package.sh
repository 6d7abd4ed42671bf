#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks Catgut from outside: installs the library and builds a program against it, without SDL, Filament,
# Boost or GoogleTest; writes the Debian packages, unpacks them, runs the program from there and builds against the unpacked library.
# Needs a built program in build/ (./catgut --version, or ninja -C build) and Debian's dpkg-dev.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
die() { echo "check_package: $*" >&2; exit 1; }
quiet() { "$@" >"$work/log" 2>&1 || { tail -n 40 "$work/log"; die "failed: $*"; }; }

if ! command -v dpkg-shlibdeps >/dev/null; then
  as=()
  [ "$(id -u)" -eq 0 ] || as=(sudo)
  { "${as[@]}" apt-get install -y -q --no-install-recommends dpkg-dev || { "${as[@]}" apt-get update && "${as[@]}" apt-get install -y -q --no-install-recommends dpkg-dev; }; } >/dev/null
fi

unwanted=()
for package in SDL2 Boost GTest filament nlohmann_json CLI11; do unwanted+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON"); done

outside() {  # outside PREFIX NAME: samples/embed, copied out of the repository, against the Catgut in PREFIX
  cp -r "$root/samples/embed" "$work/$2"
  quiet cmake -S "$work/$2" -B "$work/$2/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$1" "${unwanted[@]}"
  quiet cmake --build "$work/$2/build"
  if ldd "$work/$2/build/embed" | grep -iE 'sdl|filament|boost|gtest'; then die "$2 links what it should not"; fi
  (cd / && env -u CATGUT_SCENES CATGUT_DATA_DIR="$1/share/catgut" "$work/$2/build/embed") || die "$2 failed"
  # The same by pkg-config.
  local flags
  flags="$(PKG_CONFIG_PATH="$(dirname "$(find "$1" -name catgut.pc)")" pkg-config --cflags --libs catgut)"
  # shellcheck disable=SC2086
  quiet c++ -std=c++20 -O1 "$work/$2/main.cpp" $flags -o "$work/$2/by_pkg_config"
  (cd / && CATGUT_DATA_DIR="$1/share/catgut" "$work/$2/by_pkg_config" >/dev/null) || die "$2, built with pkg-config, failed"
}

echo "library alone"
quiet cmake -S "$root" -B "$root/build/library" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCATGUT_APP=OFF -DCATGUT_WERROR="${CATGUT_WERROR:-OFF}" "${unwanted[@]}"
quiet cmake --build "$root/build/library" --target catgut golden
quiet cmake --install "$root/build/library" --prefix "$work/prefix"
if grep -rIlF "$root" "$work/prefix"; then die "the path of the sources is in what is installed"; fi
outside "$work/prefix" against_prefix

echo "Debian packages"
[ -x "$root/build/app/catgut" ] || die "build the program first: ./catgut --version"
rm -f "$root"/build/*.deb
quiet cmake --build "$root/build" --target catgut catgut_app
(cd "$root/build" && quiet cpack)  # the target "package" would build all tests first
mkdir "$work/tree"
for deb in "$root"/build/*.deb; do
  echo "$(basename "$deb"), $(($(stat -c %s "$deb") / 1024)) KiB, depends: $(dpkg-deb -f "$deb" Depends)"
  dpkg-deb -x "$deb" "$work/tree"
done
# A scene that exists only in the unpacked tree.
cp "$work/tree/usr/share/catgut/scenes/stay.toml" "$work/tree/usr/share/catgut/scenes/only_here.toml"
(cd / && env -u CATGUT_SCENES -u CATGUT_DATA_DIR "$work/tree/usr/bin/catgut" run only_here --headless --seconds 2 --no-expect) || die "the packaged program failed"
(cd / && env -u CATGUT_SCENES -u CATGUT_DATA_DIR "$work/tree/usr/bin/catgut" run stay --headless --seconds 2 --no-expect --json "$work/run.json" >/dev/null) && [ -s "$work/run.json" ] || die "no results"
for file in usr/share/applications/catgut.desktop usr/share/icons/hicolor/scalable/apps/catgut.svg usr/share/doc/catgut/copyright; do
  [ -s "$work/tree/$file" ] || die "$file is not in the package"
done
outside "$work/tree/usr" against_packages
echo "packages: ok"
