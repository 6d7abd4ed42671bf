#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes twelve stills at 1920x1080, four techniques by needle in the wall, throw and finished repair, and their sheet
# docs/media/twelve.jpg. The purse-string is not tied: its thread drawn tight stands for the throw. Some two minutes.
#   tools/make_twelve.sh [FOLDER]     folder of the PNGs, NAME_needle.png and so on (default out/twelve)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/twelve}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder" docs/media

# Scene and its three moments [simulated s] of the scripted surgeon with seed 1.
shots=(stay:9.92:25:33.6 connell:12.68:30.5:82.9 lembert:4.3:16.2:150.2 purse_string:31:104.4:105.1)
for shot in "${shots[@]}"; do
  IFS=: read -r name needle throw finished <<<"$shot"
  "$catgut" run "$name" --seed 1 --headless --no-expect --camera close --size 1920x1080 \
    --still "$needle:$folder/${name}_needle.png" --still "$throw:$folder/${name}_throw.png" \
    --still "$finished:$folder/${name}_finished.png"
done

# A row per technique.
inputs=() row=0
for shot in "${shots[@]}"; do
  for moment in needle throw finished; do inputs+=(-i "$folder/${shot%%:*}_$moment.png"); done
done
layout=""
for row in 0 1 2 3; do for column in 0 1 2; do layout+="|$((column * 644))_$((row * 364))"; done; done
scaled="" names=""
for i in $(seq 0 11); do scaled+="[$i:v]scale=640:360:flags=lanczos[s$i];" names+="[s$i]"; done
ffmpeg -v error -y "${inputs[@]}" -filter_complex "$scaled${names}xstack=inputs=12:layout=${layout#|}:fill=white" \
  -frames:v 1 -q:v 4 docs/media/twelve.jpg
ls -l docs/media/twelve.jpg
