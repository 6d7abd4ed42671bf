#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the close-ups and films of knots of docs/thread.md: docs/media/knots.jpg, and knot_single.webp, knot_granny.webp,
# knot_square.webp and knot_surgeons.webp (480 x 360). Needs ffmpeg and the programs, built with or without the renderer:
# ninja -C build knot_pictures knot_films. Takes a few minutes.
#   tools/make_knot_films.sh [FOLDER]     folder of films, NAME.mp4; missing ones are made
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/knots}"
mkdir -p "$folder" docs/media

build/bench/knot_pictures "$folder/knots.png"
ffmpeg -v error -y -i "$folder/knots.png" -vf "scale=1400:-2:flags=lanczos" -frames:v 1 -q:v 3 docs/media/knots.jpg
for kind in single granny square surgeons; do
  [ -f "$folder/knot_$kind.mp4" ] || build/bench/knot_films "$folder" "$kind"
  ffmpeg -v error -y -i "$folder/knot_$kind.mp4" -vf "fps=12.5,scale=480:-2:flags=lanczos" \
    -c:v libwebp_anim -quality 60 -compression_level 4 -loop 0 "docs/media/knot_$kind.webp"
done
ls -l docs/media/knot*
