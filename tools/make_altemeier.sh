#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/altemeier_stages.jpg: six moments of scene altemeier with seed 1, up to the first bite. About two minutes.
#   tools/make_altemeier.sh [FOLDER]     folder of the PNGs (default out/altemeier)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/altemeier}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder"
stills=() inputs=() scaled="" names="" layout="" n=0
# Clamps secured, cut begun, half round, nearly complete, specimen removed, needle through both tubes.
for second in 11.5 14 22 29 38 47; do
  scaled+="[$n:v]scale=640:360:flags=lanczos[s$n];"
  names+="[s$n]" layout+="${layout:+|}$((n % 2 * 644))_$((n / 2 * 364))"
  stills+=(--still "$second:$folder/$second.png") inputs+=(-i "$folder/$second.png")
  n=$((n + 1))
done
# The camera stays where it is: over the surgeon's right shoulder.
"$catgut" run altemeier --seed 1 --seconds 48 --headless --no-expect --size 960x540 --camera 0.02,0.07,0.085,0,-0.014,0 "${stills[@]}"
ffmpeg -v error -y "${inputs[@]}" -filter_complex "$scaled${names}xstack=inputs=$n:layout=$layout:fill=white" \
  -frames:v 1 -q:v 4 docs/media/altemeier_stages.jpg
