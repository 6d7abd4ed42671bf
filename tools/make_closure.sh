#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/purse_string_thread.jpg: the rim gathered by its thread, and let go. And docs/media/connell_thread.jpg: the second
# bite, and the tied loop. Three minutes.
#   tools/make_closure.sh [FOLDER]     folder of the PNGs (default out/closure)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/closure}" catgut="${CATGUT:-./catgut}"
mkdir -p "$folder"
"$catgut" run purse_string_thread --seed 4 --seconds 89.5 --headless --no-expect --camera close --size 960x540 \
  --still "81.5:$folder/drawn.png" --still "88.5:$folder/let_go.png"
ffmpeg -v error -y -i "$folder/drawn.png" -i "$folder/let_go.png" -filter_complex hstack,scale=1280:360 -frames:v 1 -q:v 4 \
  docs/media/purse_string_thread.jpg
"$catgut" run connell_thread --seed 1 --headless --camera close --size 960x640 --still "23.5:$folder/bite.png" --still "90:$folder/tied.png"
ffmpeg -v error -y -i "$folder/bite.png" -i "$folder/tied.png" -filter_complex hstack,scale=1280:-2 -frames:v 1 -q:v 4 \
  docs/media/connell_thread.jpg
