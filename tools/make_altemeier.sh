#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/altemeier_stages.jpg: four moments of scene altemeier with seed 2. About two minutes.
#   tools/make_altemeier.sh [FOLDER]     folder of the PNGs (default out/altemeier)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/altemeier}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder"
stills=() inputs=() scaled="" names=""
for second in 11.5 29 38 47; do # cut begun, nearly complete, specimen removed, needle through both tubes
  scaled+="[$((${#inputs[@]} / 2)):v]scale=640:360:flags=lanczos[s$((${#inputs[@]} / 2))];"
  names+="[s$((${#inputs[@]} / 2))]"
  stills+=(--still "$second:$folder/$second.png") inputs+=(-i "$folder/$second.png")
done
"$catgut" run altemeier --seed 2 --seconds 50 --headless --no-expect --size 960x540 "${stills[@]}"
ffmpeg -v error -y "${inputs[@]}" -filter_complex "$scaled${names}xstack=inputs=4:layout=0_0|644_0|0_364|644_364:fill=white" \
  -frames:v 1 -q:v 4 docs/media/altemeier_stages.jpg
