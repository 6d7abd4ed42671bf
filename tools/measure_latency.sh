#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Latency from a motion of the mouse to its frame: opens the window on a private X server, moves the mouse for some seconds, and
# prints the program's table. On a desktop, `./catgut play SCENE --seconds 20` prints it for your own hands.
#   tools/measure_latency.sh [SCENE] [WxH] [QUALITY] [SECONDS]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scene="${1:-purse_string}" size="${2:-1280x720}" quality="${3:-low}" seconds="${4:-20}"
export SDL_VIDEODRIVER=x11 scene size quality seconds
exec xvfb-run -a -s "-screen 0 ${size}x24" bash -c '
  ./catgut play "$scene" --size "$size" --quality "$quality" --seconds "$seconds" &
  play=$!
  sleep 3
  for ((i = 0; ; ++i)); do
    kill -0 $play 2>/dev/null || break
    xdotool mousemove_relative -- $(((i / 20) % 2 ? 3 : -3)) $(((i / 10) % 2 ? 2 : -2)) 2>/dev/null || true
    sleep 0.013
  done
  wait $play'
