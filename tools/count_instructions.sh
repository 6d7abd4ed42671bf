#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Instructions per tick of every technique's scene, at rest and during the procedure, compared with the record in
# bench/instructions.txt. Times on shared machines vary by tens of percent, counts do not.
#   tools/count_instructions.sh            counts and compares; exit code 1 when a count is more than 10 % above its record
#   tools/count_instructions.sh --update   counts and writes the record
#   tools/count_instructions.sh --compare NOW RECORD   only compares two lists
# What is counted: bench/scenes/count_ticks.cpp. How to read it: docs/benchmarks.md. Half a minute after the build.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
record="$root/bench/instructions.txt"
die() { echo "count_instructions: $*" >&2; exit 2; }

compare() {  # compare NOW RECORD
  [ -r "$1" ] && [ -r "$2" ] || die "$1 or $2 is not there; tools/count_instructions.sh --update makes the record"
  awk -v limit=10 '
    /^#/ || NF == 0 { next }
    NF != 3 || $3 !~ /^[1-9][0-9]*$/ { printf "%s:%d: not \"scene moment count\": %s\n", FILENAME, FNR, $0; bad = 1; next }
    FILENAME == ARGV[1] && FNR == NR { now[$1 " " $2] = $3; order[++rows] = $1 " " $2; next }
    { recorded[$1 " " $2] = $3 }
    END {
      if (!rows) { print "nothing was counted"; bad = 1 }
      if (!bad || rows) printf "%-13s %-6s %12s %12s %8s   instructions a tick\n", "scene", "moment", "recorded", "now", "change"
      for (i = 1; i <= rows; ++i) {
        name = order[i]; split(name, word, " ")
        if (!(name in recorded)) { printf "%-13s %-6s %12s %12d   not on record\n", word[1], word[2], "-", now[name]; bad = 1; continue }
        change = 100 * (now[name] / recorded[name] - 1)
        note = change > limit ? "   DEARER" : change < -limit ? "   cheaper" : ""
        printf "%-13s %-6s %12d %12d %+7.2f%%%s\n", word[1], word[2], recorded[name], now[name], change, note
        if (change > limit) dearer = 1
        if (change < -limit) cheaper = 1
      }
      for (name in recorded) if (!(name in now)) { print name ": on record, but was not counted"; bad = 1 }
      if (dearer) {
        print "ALARM: a tick takes more than " limit " % more instructions than on record. Either find what became dear (valgrind"
        print "--tool=callgrind as in this script, then callgrind_annotate), or, where it is worth its price, put it on record with"
        print "the reason in the commit: tools/count_instructions.sh --update"
      }
      if (cheaper) {
        print "Note: a tick takes more than " limit " % fewer instructions than on record: good, and the record is stale. Until it is"
        print "written anew, what was gained can be lost again unseen: tools/count_instructions.sh --update"
      }
      if (bad) print "The lists do not fit each other: tools/count_instructions.sh --update"
      exit (dearer || bad) ? 1 : 0
    }' "$1" "$2"
}

count() {  # count FILE: writes "scene moment instructions-a-tick"
  grep -qw avx2 /proc/cpuinfo 2>/dev/null || die "counts are those of AVX2 code, and this processor has none"
  if ! command -v valgrind >/dev/null || [ ! -e /usr/include/valgrind/callgrind.h ]; then
    local as=()
    [ "$(id -u)" -eq 0 ] || as=(sudo)
    { "${as[@]}" apt-get install -y -q --no-install-recommends valgrind ||
      { "${as[@]}" apt-get update && "${as[@]}" apt-get install -y -q --no-install-recommends valgrind; }; } >/dev/null ||
      die "valgrind is missing: apt-get install valgrind"
  fi
  [ -f "$root/build/CMakeCache.txt" ] || die "nothing is built yet: ./catgut test, or cmake --preset release"
  # Configured again, because the target exists only if valgrind is installed.
  { cmake -S "$root" -B "$root/build" && cmake --build "$root/build" --target count_ticks bench_thread bench_physical; } >"$work/build.log" 2>&1 ||
    { tail -n 30 "$work/build.log" >&2; die "count_ticks cannot be built"; }
  local program="$root/build/bench/count_ticks"
  (cd "$root" && "$program" write "$work/ticks") || die "the scenes could not be sewn"
  # Highway times its clock while it is loaded, by rdtscp. Valgrind knows that instruction only where the processor announces it,
  # and virtual machines do not always. Nothing here uses the clock.
  echo 'namespace hwy::platform { unsigned long TimerResolution() { return 1; } }' |
    "${CXX:-c++}" -std=c++17 -shared -fPIC -x c++ - -o "$work/no_clock.so" || die "a shared library cannot be built"
  LD_PRELOAD="$work/no_clock.so" valgrind --tool=callgrind --instr-atstart=no --collect-atstart=no --callgrind-out-file="$work/dump" \
    "$program" run "$work/ticks" >"$work/moments" 2>"$work/valgrind.log" ||
    { tail -n 30 "$work/valgrind.log" >&2; die "the ticks could not be counted"; }
  local number=0 scene moment ticks total
  : >"$1"
  while read -r scene moment ticks; do
    number=$((number + 1))
    total="$(grep -a -m 1 '^totals: ' "$work/dump.$number" | cut -d ' ' -f 2)"
    echo "$scene $moment $((total / ticks))" >>"$1"
  done <"$work/moments"
  # A millisecond of the physical thread, 300 segments with a 2-1-1 knot; of wall and thread, a stitch with a throw drawn tight.
  local bench
  for bench in bench_thread bench_physical; do
    LD_PRELOAD="$work/no_clock.so" valgrind --tool=callgrind --instr-atstart=no --collect-atstart=no --callgrind-out-file="$work/$bench" \
      "$root/build/bench/$bench" count >"$work/moments" 2>"$work/valgrind.log" ||
      { tail -n 30 "$work/valgrind.log" >&2; die "$bench could not be counted"; }
    read -r scene moment ticks <"$work/moments"
    total="$(grep -a -m 1 '^totals: ' "$work/$bench.1" | cut -d ' ' -f 2)"
    echo "$scene $moment $((total / ticks))" >>"$1"
  done
}

case "${1:-}" in
  --compare)
    [ $# -eq 3 ] || die "--compare NOW RECORD"
    compare "$2" "$3"
    exit
    ;;
  "" | --update) ;;
  *) die "unknown: $1 (nothing, --update, or --compare NOW RECORD)" ;;
esac
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
count "$work/now"
if [ "${1:-}" = --update ]; then
  {
    echo "# Instructions a tick takes, one thread, AVX2: scene, moment, count. Written by tools/count_instructions.sh --update;"
    echo "# compared in CI. Counted with $(valgrind --version), $(c++ --version | head -n 1)."
    cat "$work/now"
  } >"$record"
  cat "$record"
else
  compare "$work/now" "$record" || { echo "the record says: $(sed -n 2p "$record"); here: $(valgrind --version), $(c++ --version | head -n 1)"; exit 1; }
fi
