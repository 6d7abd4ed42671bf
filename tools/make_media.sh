#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the pictures of the README: docs/media/purse_string.webp (the first bites at eight times real time, then the closure
# at four times) and docs/media/contact_sheet.jpg; and of the other three sutures docs/media/NAME.webp and NAME_sheet.jpg, complete
# and faster than real time. Runs the scenes, about ten minutes.
#   tools/make_media.sh [FOLDER]     folder of films and sheets, NAME.mp4 and NAME.png; missing ones are made
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/media}"
mkdir -p "$folder" docs/media

shoot() {  # shoot SCENE SPEED
  [ -f "$folder/$1.mp4" ] ||
    ./catgut run "$1" --seed 1 --headless --video "$folder/$1.mp4" --video-speed "$2" --contact-sheet "$folder/$1.png"
}

for scene in stay:6 connell:10 lembert:16; do
  name="${scene%%:*}"
  shoot "$name" "${scene##*:}"
  ffmpeg -v error -y -i "$folder/$name.mp4" -vf "fps=8,scale=400:-2:flags=lanczos" \
    -c:v libwebp_anim -quality 60 -compression_level 4 -loop 0 "docs/media/$name.webp"
  ffmpeg -v error -y -i "$folder/$name.png" -vf "scale='min(1600,iw)':-2:flags=lanczos" -frames:v 1 -q:v 6 "docs/media/${name}_sheet.jpg"
done

shoot purse_string 8
film="$folder/purse_string.mp4" sheet="$folder/purse_string.png"
length="$(ffprobe -v error -show_entries format=duration -of default=nw=1:nk=1 "$film")"
closing="$(awk -v l="$length" 'BEGIN { print l - 1.6 }')"
ffmpeg -v error -y -i "$film" -filter_complex "
  [0:v]split[a][b];
  [a]trim=0:4.2,setpts=PTS-STARTPTS,fps=10[bites];
  [b]trim=start=$closing,setpts=2*(PTS-STARTPTS),fps=10,tpad=stop_mode=clone:stop_duration=1[closing];
  [bites][closing]concat=n=2,scale=480:-2:flags=lanczos" \
  -c:v libwebp_anim -quality 75 -compression_level 4 -loop 0 docs/media/purse_string.webp
ffmpeg -v error -y -i "$sheet" -vf "scale='min(1600,iw)':-2:flags=lanczos" -frames:v 1 -q:v 5 docs/media/contact_sheet.jpg
ls -l docs/media
