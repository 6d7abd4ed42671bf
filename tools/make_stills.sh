#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/NAME.jpg anew: one moment of each technique in progress, in the best quality. Runs the scenes up to that
# moment, which takes a minute or two.
#   tools/make_stills.sh [FOLDER]     where the PNGs are, or go: NAME_still.png; made when they are missing
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/stills}"
mkdir -p "$folder" docs/media

# Scene and moment [simulated s] of the scripted surgeon with seed 1.
for shot in purse_string:80.5 connell:63 stay:12 lembert:64; do
  name="${shot%%:*}" moment="${shot##*:}" png="$folder/${shot%%:*}_still.png"
  [ -f "$png" ] || ./catgut run "$name" --seed 1 --headless --no-expect --seconds "$(awk -v m="$moment" 'BEGIN { print m + 0.1 }')" --still "$moment:$png"
  for quality in 3 4 5 6 8 10; do  # as good as fits into 250 kB
    ffmpeg -v error -y -i "$png" -frames:v 1 -q:v "$quality" "docs/media/$name.jpg"
    [ "$(stat -c %s "docs/media/$name.jpg")" -gt 250000 ] || break
  done
done
ls -l docs/media/*.jpg
