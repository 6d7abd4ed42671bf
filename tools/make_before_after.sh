#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes docs/media/before_after_NAME.jpg: on the left a picture of an older version, on the right the same moment of the same scene
# with this program. The last three show the window; they need Xvfb and xdotool. About five
# minutes without a graphics card; on a busy machine WAIT=45 gives the window more time to open [s].
#   tools/make_before_after.sh FOLDER [NAME ...]     FOLDER with the older pictures, NAME.jpg; only these names
set -euo pipefail
quick="${CATGUT:-}"
before="$(cd "${1:?folder of the older pictures}" && pwd)"
shift
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root="$PWD" after="$PWD/out/after" catgut="${CATGUT:-$PWD/build/app/catgut}"
[ -n "$quick" ] || ./catgut --version  # builds
mkdir -p "$after" docs/media
wanted=("$@")
is_wanted() { [ ${#wanted[@]} -eq 0 ] || [[ " ${wanted[*]} " == *" $1 "* ]]; }

# Stills of the scripted surgeon with seed 1: NAME OLDER SCENE CAMERA SECONDS ..., four moments give four small pictures.
still() {
  local name="$1" older="$2" scene="$3" camera="$4" stills=() i=0 picture
  shift 4
  is_wanted "$name" || return 0
  for moment in "$@"; do stills+=(--still "$moment:$after/${name}_$((i++)).png"); done
  "$catgut" run "$scene" --seed 1 --headless --no-expect --camera "$camera" --size 1280x800 "${stills[@]}" >/dev/null
  picture="$after/${name}_0.png"
  if [ $i -eq 4 ]; then
    picture="$after/$name.png"
    ffmpeg -v error -y -i "$after/${name}_0.png" -i "$after/${name}_1.png" -i "$after/${name}_2.png" -i "$after/${name}_3.png" \
      -filter_complex "xstack=inputs=4:layout=0_0|w0_0|0_h0|w0_h0" -frames:v 1 "$picture"
  fi
  beside "$name" "$older" "$picture" 640:400
}

beside() {  # beside NAME OLDER PICTURE SIZE
  ffmpeg -v error -y -i "$before/$2.jpg" -i "$3" -filter_complex "[0]scale=$4:flags=lanczos,setsar=1[a];\
[1]scale=$4:flags=lanczos,setsar=1[b];[a][b]hstack" -frames:v 1 -q:v 4 "docs/media/before_after_$1.jpg"
}

still best_knot best_knot stay close 33.6
still knot knots_close stay close 31.6 32.6 33.6 35
still wrap wrap_inside_metal_stay_23s stay follow 23
still shank stay_31s_shank_seam stay follow 30.9
still bite worst_pale_ghost_strand purse_string close 21.35
still purse_string purse_finish purse_string close 105.1
still lembert lembert_finish lembert close 153.8

# The window: NAME OLDER STAGE SIZE, then what xdotool does.
window() {
  local name="$1" older="$2" stage="$3" size="$4"
  shift 4
  is_wanted "$name" || return 0
  export HOME="$after/home" SDL_VIDEODRIVER=x11
  unset XDG_CONFIG_HOME XDG_DATA_HOME
  rm -rf "$HOME" && mkdir -p "$HOME/.config/catgut"
  echo 'quality = "low"' >"$HOME/.config/catgut/settings.toml"
  DO="$*" PICTURE="$after/$name.png" STAGE="$stage" CATGUT="$catgut" SIZE="$size" xvfb-run -a -s "-screen 0 ${size}x24" bash -c '
    "$CATGUT" play --procedure first_stitch --mode tutorial --stage "$STAGE" --size "$SIZE" 2>/dev/null & child=$!
    trap "kill -9 $child" EXIT
    sleep "${WAIT:-12}"; kill -0 $child || exit 1
    eval "$DO"
    ffmpeg -v error -y -f x11grab -video_size "$SIZE" -i "$DISPLAY" -frames:v 1 "$PICTURE"'
  beside "$name" "$older" "$after/$name.png" 640:360
}
key='xdotool key' move='xdotool mousemove'
window overlap worst_overlap "first bite" 1280x720 "$key Return; sleep 2; for i in 1 2 3 4 5 6 7 8; do xdotool mousemove_relative -- -6 -4; sleep 0.3; done; sleep 2"
window winding worst_winding_behind_panel "first tail" 1280x720 "sleep 1"
# Slow enough for a picture of high quality that takes seconds.
window switch live_switch_to_high_looks_low "second wrap" 640x360 \
  "$key F2; sleep 3; $move 317 122; sleep 1; xdotool mousedown 1; sleep 2; xdotool mouseup 1; sleep 6; xdotool keydown Escape; sleep 2; xdotool keyup Escape; sleep 10"
ls -l "$root"/docs/media/before_after_*.jpg
