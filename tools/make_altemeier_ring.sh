#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/altemeier_ring.jpg, altemeier_sheet.jpg and altemeier_film.webp: the end of scene altemeier with seed 2, at
# rest and while the colon is pulled; a contact sheet; and the whole run at forty times real time. One to three hours; a recording
# that is in the folder already is used.
#   tools/make_altemeier_ring.sh [FOLDER]     folder of recording, film and PNGs (default out/altemeier)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/altemeier}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder"
[ -s "$folder/whole.cgrec" ] && [ -s "$folder/whole.json" ] ||
  "$catgut" run altemeier --seed 2 --headless --record "$folder/whole.cgrec" --json "$folder/whole.json"
# The colon retracts in the last four seconds.
end="$(sed -nE 's/^ *"simulated_s": ([0-9]+)\..*/\1/p' "$folder/whole.json" | head -n 1)"
"$catgut" replay "$folder/whole.cgrec" --check --size 640x360 --contact-sheet "$folder/sheet.png" \
  --video "$folder/film.mp4" --video-speed 40 --still "$((end - 5)):$folder/rest.png" --still "$end:$folder/pulled.png"
ffmpeg -v error -y -i "$folder/rest.png" -i "$folder/pulled.png" \
  -filter_complex "[0:v]pad=644:360:0:0:white[a];[a][1:v]hstack=inputs=2" -frames:v 1 -q:v 4 docs/media/altemeier_ring.jpg
ffmpeg -v error -y -i "$folder/sheet.png" -vf "scale=1300:-1:flags=lanczos" -q:v 4 docs/media/altemeier_sheet.jpg
ffmpeg -v error -y -i "$folder/film.mp4" -vf "fps=6,scale=480:-1:flags=lanczos" \
  -c:v libwebp_anim -quality 60 -compression_level 4 -loop 0 docs/media/altemeier_film.webp
