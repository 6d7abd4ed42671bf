#!/usr/bin/env bash
# Makes the pictures of the README anew: docs/media/purse_string.webp (the first bites at eight times real time, then the closure
# at four times) and docs/media/contact_sheet.jpg. Runs the demo's scene, which takes a few minutes.
#   tools/make_media.sh [FILM.mp4 SHEET.png]     of a run made with --video-speed 8; without them it makes one
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
film="${1:-out/media/film.mp4}" sheet="${2:-out/media/sheet.png}"
if [ $# -lt 2 ]; then
  mkdir -p out/media
  ./catgut run purse_string --seed 1 --headless --video "$film" --video-speed 8 --contact-sheet "$sheet"
fi
length="$(ffprobe -v error -show_entries format=duration -of default=nw=1:nk=1 "$film")"
closing="$(awk -v l="$length" 'BEGIN { print l - 1.6 }')"
mkdir -p docs/media
ffmpeg -v error -y -i "$film" -filter_complex "
  [0:v]split[a][b];
  [a]trim=0:4.2,setpts=PTS-STARTPTS,fps=10[bites];
  [b]trim=start=$closing,setpts=2*(PTS-STARTPTS),fps=10,tpad=stop_mode=clone:stop_duration=1[closing];
  [bites][closing]concat=n=2,scale=480:-2:flags=lanczos" \
  -c:v libwebp_anim -quality 75 -compression_level 4 -loop 0 docs/media/purse_string.webp
ffmpeg -v error -y -i "$sheet" -vf "scale='min(1600,iw)':-2:flags=lanczos" -frames:v 1 -q:v 5 docs/media/contact_sheet.jpg
ls -l docs/media
