#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the OpenXR runtime that the headset tests run on: Monado 25.0.0 (BSL-1.0), in the process of the program that uses it, without a
# service. Source: Debian's archive, verified by its checksum. Nothing is installed: the result lies in a cache outside this tree,
# ${CATGUT_XR_RUNTIME:-~/.cache/catgut/xr_runtime}, and only the tests use it. A user's own runtime comes with the headset.
#   tools/get_xr_runtime.sh            builds it (about two minutes on two cores) unless it is there; prints its manifest's path
#   tools/get_xr_runtime.sh --check    prints the path if it is there; exit code 1 if not
# Exit code 3: it cannot be had here (no package archive, no compiler); the tests then state that they were left out.
set -euo pipefail

cache="${CATGUT_XR_RUNTIME:-${XDG_CACHE_HOME:-$HOME/.cache}/catgut/xr_runtime}"
version=25.0.0+dfsg
sum=ddfa1899078173bea3db98034dc8b990df727a169f490896570ff6e3bda72113
built="$cache/monado-$version-60hz"
manifest="$built/openxr_monado-dev.json"
packages=(cmake ninja-build g++ python3 libeigen3-dev libvulkan-dev glslang-tools libudev-dev libgl-dev libegl-dev libcjson-dev
  libx11-xcb-dev libxcb-randr0-dev libxrandr-dev mesa-vulkan-drivers)
say() { echo "get_xr_runtime: $*" >&2; }

if [ -f "$built/complete" ]; then
  echo "$manifest"
  exit 0
fi
[ "${1:-}" = --check ] && exit 1

missing=()
for package in "${packages[@]}"; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
  line="apt-get install -y --no-install-recommends ${missing[*]}"
  as=()
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then as=(sudo); else
      say "packages are missing; install them first: sudo $line"
      exit 3
    fi
  fi
  say "installing ${missing[*]}"
  log="$(mktemp)"
  if ! { "${as[@]}" env DEBIAN_FRONTEND=noninteractive $line || { "${as[@]}" apt-get update && "${as[@]}" env DEBIAN_FRONTEND=noninteractive $line; }; } >"$log" 2>&1; then
    tail -n 5 "$log" >&2
    say "packages could not be installed; try: sudo apt-get update && sudo $line"
    exit 3
  fi
fi

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"

# This release of Monado is in Debian's next suite, as source. The mirror is the one that this machine uses.
mirror="$(apt-get indextargets --format '$(REPO_URI) $(RELEASE)' | awk '$2 == "bookworm" { print $1; exit }')"
if [ -z "$mirror" ]; then
  say "the package sources of this machine name no Debian 12 archive"
  exit 3
fi
mkdir -p apt/lists/partial apt/cache/archives/partial
touch apt/status
echo "deb-src $mirror trixie main" >apt/sources.list
state=(-oDir::State::Lists="$work/apt/lists" -oDir::Etc::sourcelist="$work/apt/sources.list" -oDir::Etc::sourceparts=/dev/null
  -oDir::State::status="$work/apt/status" -oDir::Cache="$work/apt/cache" -oAPT::Sandbox::User=root)
say "fetching the source of Monado $version"
apt-get "${state[@]}" update >apt/log 2>&1 || true
# An archive may lack the parts that only Debian's packaging needs; the original source with its checksum is enough.
apt-get "${state[@]}" source --download-only monado >>apt/log 2>&1 || true
source_file="$(ls monado_*.orig.tar.xz 2>/dev/null | head -n 1)" || true
if [ -z "$source_file" ]; then
  tail -n 5 apt/log >&2
  say "the source of Monado cannot be fetched here"
  exit 3
fi
if ! echo "$sum  $source_file" | sha256sum --check --quiet 2>/dev/null; then
  say "$source_file is not the release that was tested ($version, sha256 $sum)"
  exit 3
fi
mkdir source
tar -xf "$source_file" -C source --strip-components=1
# The compositor without a display runs at 20 Hz; hands are read once per frame.
sed -i 's|U_TIME_1S_IN_NS / 20;|U_TIME_1S_IN_NS / 60;|' source/src/xrt/compositor/null/null_compositor.c
grep -q 'U_TIME_1S_IN_NS / 60;' source/src/xrt/compositor/null/null_compositor.c || say "note: the runtime keeps its own frame rate"

off=()
for part in SDL2 OPENCV GST SYSTEMD DBUS LIBUVC LIBUSB HIDAPI WAYLAND BLUETOOTH JPEG LIBBSD; do off+=("-DXRT_HAVE_$part=OFF"); done
for driver in ANDROID ARDUINO DAYDREAM DEPTHAI EUROC HANDTRACKING HDK HYDRA ILLIXR NS NREAL_AIR OHMD OPENGLOVES PSMV PSSENSE PSVR REALSENSE \
  RIFT_S ROKID SIMULAVR STEAMVR_LIGHTHOUSE SURVIVE TWRAP ULV2 ULV5 V4L2 VF VIVE WMR XREAL_AIR; do
  off+=("-DXRT_BUILD_DRIVER_$driver=OFF")
done
rm -rf "$built"
mkdir -p "$built"
# Debug information would take a hundred times the space of the library.
if ! { cmake -G Ninja -S source -B "$built/build" -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF -DBUILD_DOC=OFF -DXRT_FEATURE_SERVICE=OFF \
  -DXRT_MODULE_MONADO_GUI=OFF -DXRT_MODULE_MONADO_CLI=OFF -DXRT_FEATURE_STEAMVR_PLUGIN=OFF -DXRT_FEATURE_SLAM=OFF \
  -DXRT_BUILD_SAMPLES=OFF "${off[@]}" && cmake --build "$built/build" --target openxr_monado; } >"$built/log" 2>&1; then
  tail -n 20 "$built/log" >&2
  say "Monado does not build here; the whole log is in $built/log"
  exit 3
fi
library="$(find "$built/build" -name 'libopenxr_monado.so' | head -n 1)"
cp "$library" "$built/libopenxr_monado.so"
rm -rf "$built/build"
cat >"$manifest" <<JSON
{"file_format_version": "1.0.0", "runtime": {"name": "Monado", "library_path": "$built/libopenxr_monado.so"}}
JSON
touch "$built/complete"
say "built"
echo "$manifest"
