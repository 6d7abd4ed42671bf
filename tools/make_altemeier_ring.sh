#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/altemeier_ring.jpg and altemeier_sheet.jpg: the end of scene altemeier with seed 1, at rest and while the colon
# is pulled, and a contact sheet of the whole run. About fifteen minutes; a recording that is in the folder already is used.
#   tools/make_altemeier_ring.sh [FOLDER]     folder of recording and PNGs (default out/altemeier)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/altemeier}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder"
[ -s "$folder/whole.cgrec" ] || "$catgut" run altemeier --seed 1 --headless --record "$folder/whole.cgrec"
"$catgut" replay "$folder/whole.cgrec" --check --size 640x360 --contact-sheet "$folder/sheet.png" \
  --still "416:$folder/rest.png" --still "423:$folder/pulled.png"
ffmpeg -v error -y -i "$folder/rest.png" -i "$folder/pulled.png" \
  -filter_complex "[0:v]pad=644:360:0:0:white[a];[a][1:v]hstack=inputs=2" -frames:v 1 -q:v 4 docs/media/altemeier_ring.jpg
ffmpeg -v error -y -i "$folder/sheet.png" -vf "scale=1300:-1:flags=lanczos" -q:v 4 docs/media/altemeier_sheet.jpg
