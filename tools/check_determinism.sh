#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The golden hashes for every compiler and architecture: GCC and Clang on x86-64, each with the kernels for AVX-512, AVX2 and
# SSE4 (the last is all that the rest of the code uses), and AArch64, cross-built and run by qemu-user. Compares the bytes of the whole
# state too, between the builds. GCC's is that of build/, if there is one; the others are built in build/determinism, the library
# alone. Installs missing packages (Debian 12).
#   tools/check_determinism.sh [gcc] [clang] [aarch64]     default: all
# CATGUT_GOLDEN_SECONDS (10): simulated seconds of each case on x86-64. CATGUT_GOLDEN_SECONDS_ARM (10): on AArch64, which the
# emulator slows down about thirtyfold.
# Exit code 1 when anything differs.
set -uo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
work="$root/build/determinism"
seconds="${CATGUT_GOLDEN_SECONDS:-10}"
seconds_arm="${CATGUT_GOLDEN_SECONDS_ARM:-10}"
failed=0
what=("$@")
[ $# -gt 0 ] || what=(gcc clang aarch64)

install() {  # install PACKAGE...
  local as=()
  [ "$(id -u)" -eq 0 ] || as=(sudo)
  local missing=() package
  for package in "$@"; do dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -q '^installed' || missing+=("$package"); done
  [ ${#missing[@]} -eq 0 ] && return
  if [[ "${missing[*]}" == *:arm64* ]] && ! dpkg --print-foreign-architectures | grep -qx arm64; then
    "${as[@]}" dpkg --add-architecture arm64 && "${as[@]}" apt-get update -q >/dev/null
  fi
  { "${as[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}" ||
    { "${as[@]}" apt-get update -q && "${as[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"; }; } >"$work/install.log" 2>&1 ||
    { tail -n 15 "$work/install.log"; echo "check_determinism: cannot install ${missing[*]}"; exit 2; }
}

build() {  # build NAME CMAKE-OPTION...
  local name="$1"
  shift
  { cmake -S "$root" -B "$work/$name" -G Ninja -DCATGUT_APP=OFF -DCATGUT_WERROR="${CATGUT_WERROR:-OFF}" "$@" &&
    cmake --build "$work/$name" --target golden; } >"$work/$name.log" 2>&1 ||
    { grep -E -A 8 'error|FAILED' "$work/$name.log" | head -n 40; echo "check_determinism: $name cannot be built"; exit 2; }
}

built_by_gcc() {  # built_by_gcc FOLDER: a release build
  grep -q '^CMAKE_BUILD_TYPE:.*=Release$' "$1/CMakeCache.txt" 2>/dev/null && [ -x "$1/tests/determinism/golden" ] &&
    grep -qs 'CMAKE_CXX_COMPILER_ID "GNU"' "$1"/CMakeFiles/*/CMakeCXXCompiler.cmake
}

cases() { awk '!/^#/ { print $1, $2 }' "$root/tests/determinism/golden.txt" | uniq; }

check() {  # check NAME SECONDS COMMAND...: every case against golden.txt, and the whole state against the first build's
  local name="$1" limit="$2" start=$SECONDS bad=0
  shift 2
  # Two cases at a time; their output is printed in order.
  cases | xargs -P 2 -L 1 bash -c '
    log="$1/$2.$(printf %s_%s "${@: -2}")"
    "${@:4:$#-5}" check "$0/tests/determinism/golden.txt" "${@: -2}" --seconds "$3" >"$log" 2>&1 || { cat "$log"; exit 1; }' \
    "$root" "$work" "$name" "$limit" "$@" || bad=1
  if [ $bad -eq 0 ]; then echo "$name: equal, $(cases | wc -l) cases of at most $limit s ($((SECONDS - start)) s)"
  else echo "$name: DIFFERS ($((SECONDS - start)) s)"; failed=1; fi
}

whole_state() {  # whole_state NAME COMMAND...: hash_state after two seconds of each technique, equal to the first build's
  local name="$1" scene
  shift
  for scene in purse_string connell stay lembert; do "$@" print $scene default --seconds 2; done >"$work/$name.state" || { failed=1; return; }
  if [ -z "${first_state:-}" ]; then first_state="$work/$name.state"
  elif ! cmp -s "$first_state" "$work/$name.state"; then
    echo "$name: the whole state differs from that of $(basename "$first_state" .state):"
    diff "$first_state" "$work/$name.state" | head -n 6
    failed=1
  fi
}

x86() {  # x86 NAME [BUILD]
  local simd golden="${2:-$work/$1}/tests/determinism/golden"
  for simd in avx3 avx2 sse4; do
    if "$golden" print stay default --seconds 0.01 --simd $simd >/dev/null 2>"$work/simd.log"; then
      check "$1-$simd" "$seconds" "$golden" --simd $simd
      whole_state "$1-$simd" "$golden" --simd $simd
    else
      echo "$1-$simd: left out, $(cat "$work/simd.log")"
    fi
  done
}

mkdir -p "$work"
for one in "${what[@]}"; do
  case "$one" in
    gcc)
      if built_by_gcc "$root/build"; then
        cmake --build "$root/build" --target golden >"$work/gcc.log" 2>&1 || { tail -n 20 "$work/gcc.log"; exit 2; }
        x86 gcc "$root/build"
      else
        build gcc -DCMAKE_CXX_COMPILER=g++ && x86 gcc
      fi
      ;;
    clang)
      install clang
      build clang -DCMAKE_CXX_COMPILER=clang++ && x86 clang
      ;;
    aarch64)
      install g++-aarch64-linux-gnu qemu-user libfmt-dev:arm64 libhwy-dev:arm64 libassimp-dev:arm64 libxxhash-dev:arm64 zlib1g-dev:arm64
      build aarch64 -DCMAKE_TOOLCHAIN_FILE="$root/cmake/toolchains/aarch64-linux-gnu.cmake"
      arm=(qemu-aarch64 -L / "$work/aarch64/tests/determinism/golden")
      check aarch64 "$seconds_arm" "${arm[@]}"
      whole_state aarch64 "${arm[@]}"
      ;;
    *) echo "check_determinism: unknown: $one (gcc, clang, aarch64)"; exit 2 ;;
  esac
done
exit $failed
