#!/usr/bin/env bash
# Writes docs/performance.md and its pictures from measurements on this machine, which should have nothing else to do.
#   tools/update_performance.sh                all of it (half an hour on two cores)
#   tools/update_performance.sh scale stages   these parts anew; the others as they were measured last
#   tools/update_performance.sh --page         only the page, from what was measured last
# Parts: paper limits limits_200 scale stages kilohertz bullet. What was measured is kept in out/performance.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
out=out/performance
mkdir -p "$out" docs/media
all=(paper limits limits_200 scale stages kilohertz bullet)
techniques=(purse_string connell stay lembert)
threads=2 executions=${EXECUTIONS:-10}

measure() {  # measure PART: its text on standard output
  case "$1" in
    paper) ./catgut bench paper --threads $threads --executions "$executions" --out "$out/paper" >/dev/null && cat "$out/paper/tables.md" ;;
    limits) ./catgut bench limits --threads 1 --out "$out/limits" ;;
    limits_200)
      ./catgut bench limits --threads 1 --scene stress_two_bodies --set duration=9000 --sutures 200 --out "$out/limits_200"
      ;;
    scale)
      ./catgut bench scale --threads $threads --repeat 3
      echo
      ./catgut bench scale --scene purse_string --threads $threads --repeat 3
      ;;
    stages)
      for scene in "${techniques[@]}"; do
        ./catgut bench stages --scene "$scene" --set solver.preset=paper --threads $threads --seconds 30 --repeat 7
        echo
      done
      ;;
    kilohertz)
      ./catgut bench stages --scene lembert --set solver.tick_rate=1000 --set solver.substeps=1 --threads 1 --seconds 60
      ;;
    bullet)
      if [ -x build/bench/against_bullet ]; then build/bench/against_bullet --ticks 50 --upto 16 --threads $threads; else echo "Not measured: libbullet-dev was not installed."; fi
      ;;
  esac
}

wanted=("$@")
if [ "${1:-}" = --page ]; then
  [ $# -eq 1 ] || { echo "update_performance: --page stands alone" >&2; exit 2; }
  wanted=()
elif [ ${#wanted[@]} -eq 0 ]; then
  wanted=("${all[@]}")
fi
for part in "${wanted[@]}"; do
  [[ " ${all[*]} " = *" $part "* ]] || { echo "update_performance: no part $part; parts: ${all[*]}" >&2; exit 2; }
done
./catgut --version >/dev/null  # builds what has changed before anything is timed
for part in "${wanted[@]}"; do
  echo "update_performance: $part" >&2
  measure "$part" >"$out/$part.part"
  mv "$out/$part.part" "$out/$part.txt"
done
for scene in stress_one_body stress_two_bodies; do
  if [ -f "$out/limits/$scene.png" ]; then cp "$out/limits/$scene.png" "docs/media/limits_$scene.png"; fi
done

text() { if [ -s "$out/$1.txt" ]; then cat "$out/$1.txt"; else echo "Not measured yet."; fi; }
boxed() { printf '```\n'; text "$1"; printf '```\n'; }
{
  cat <<'END'
# Performance

Written by `tools/update_performance.sh` from what it measured; not by hand. What was tried to get there is in
[the performance log](performance_log.md), how to measure it yourself in [benchmarks](benchmarks.md). The machine is a shared virtual one:
read ratios within a table rather than milliseconds across tables. Parts are measured one by one, the slowest (200 sutures) the least often, so it may be
of an earlier state than the others.

## The paper's tables, ours beside them

`./catgut bench paper --threads 2`, with `--executions` as the table says

END
  text paper
  cat <<'END'

## What each further suture costs (figures 20 to 23)

`./catgut bench limits --threads 1`. Rows are minutes apart, and a shared machine is not as fast in one as in the other: what fifty sutures cost
is in the line below them, where the first and the last are sewn again in turns.

![solver time per suture, one body](media/limits_stress_one_body.png)
![solver time per suture, two bodies](media/limits_stress_two_bodies.png)

END
  boxed limits
  printf '\nTo 200 sutures in two bodies (`--scene stress_two_bodies --set duration=9000 --sutures 200`):\n\n'
  boxed limits_200
  printf '\n## More particles, and a second thread\n\n`./catgut bench scale --threads 2 --repeat 3`, and with `--scene purse_string`: the paper'"'"'s 8 substeps a tick, every rule on.\n\n'
  text scale
  printf '\n## Where a tick goes\n\n`./catgut bench stages --scene SCENE --set solver.preset=paper --threads 2 --seconds 30 --repeat 7`; in each the surgeon sews.\nWith this preset the wall is so soft that it gives way to the needle: in Lembert he needs several tries for the first bite.\n\n'
  boxed stages
  cat <<'END'

## The whole physics a thousand times a second

`./catgut bench stages --scene lembert --set solver.tick_rate=1000 --set solver.substeps=1 --threads 1 --seconds 60`, the scripted surgeon sewing

END
  boxed kilohertz
  printf '\n## Beside Bullet\n\n`build/bench/against_bullet --ticks 50 --upto 16 --threads 2`: Catgut on two threads, Bullet on the one it has\n\n'
  text bullet
} >docs/performance.md
echo "update_performance: docs/performance.md is written" >&2
