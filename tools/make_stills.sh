#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/NAME.jpg: one moment of each technique, at the best quality. Runs the scenes up to that moment, one or two
# minutes.
#   tools/make_stills.sh [FOLDER]     folder of the PNGs, NAME_still.png; missing ones are made
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder="${1:-out/stills}"
mkdir -p "$folder" docs/media

# Scene and moment [simulated s] of the scripted surgeon with seed 1.
for shot in purse_string:80.5 connell:63 stay:12 lembert:64; do
  name="${shot%%:*}" moment="${shot##*:}" png="$folder/${shot%%:*}_still.png"
  [ -f "$png" ] || ./catgut run "$name" --seed 1 --headless --no-expect --seconds "$(awk -v m="$moment" 'BEGIN { print m + 0.1 }')" --still "$moment:$png"
  for quality in 3 4 5 6 8 10; do  # best quality within 250 kB
    ffmpeg -v error -y -i "$png" -frames:v 1 -q:v "$quality" "docs/media/$name.jpg"
    [ "$(stat -c %s "docs/media/$name.jpg")" -gt 250000 ] || break
  done
done
ls -l docs/media/*.jpg
