#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the pictures of the window: docs/media/screen_NAME.jpg for every screen at 1280x720, screen_results_4k.jpg at
# 3840x2160, and window.jpg for the README. Needs Xvfb; takes some minutes without a graphics
# card.
#   tools/make_screens.sh [NAME ...]     only these: start settings practice lesson pause developer results results_4k view window
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root="$PWD"
./catgut --version
folder="$root/out/screens"
mkdir -p "$folder" docs/media
cd "$folder"
# Default settings, and a neutral home folder.
export HOME="$folder/home" SDL_VIDEODRIVER=x11
unset XDG_CONFIG_HOME
rm -rf "$HOME" && mkdir -p "$HOME"

recording=purse_string.cgrec
[ -f "$recording" ] || "$root/build/app/catgut" run purse_string --seed 1 --headless --no-expect --record "$recording"

shoot() {  # shoot NAME WxH ARGUMENT ...
  local name="$1" size="$2"
  shift 2
  [ ${#wanted[@]} -eq 0 ] || [[ " ${wanted[*]} " == *" ${name#screen_} "* ]] || return 0
  echo "$name"
  xvfb-run -a -s "-screen 0 ${size}x24" "$root/build/app/catgut" "$@" --quality "${quality:-medium}" --size "$size" --after 4 \
    --screenshot "$name.png" 2>"$name.log" || { cat "$name.log" >&2; return 1; }
  ffmpeg -v error -y -i "$name.png" -q:v 4 "$root/docs/media/$name.jpg"
}
wanted=("$@")

shoot screen_start 1280x720 play --screen start
shoot screen_settings 1280x720 play --screen settings
shoot screen_practice 1280x720 play purse_string --screen practice --at 1
shoot screen_lesson 1280x720 play --procedure first_stitch --mode tutorial --stage "first tail"
shoot screen_pause 1280x720 play stay --surgeon scripted --screen pause --at 7
shoot screen_developer 1280x720 play stay --surgeon scripted --screen developer --at 5
shoot screen_results 1280x720 view "$recording" --screen results
quality=low shoot screen_results_4k 3840x2160 view "$recording" --screen results
shoot screen_view 1280x720 view "$recording" --screen view --at 38
shoot window 1280x720 play purse_string --surgeon scripted --screen practice --at 9
ls -l "$root"/docs/media/screen_*.jpg "$root/docs/media/window.jpg"
