#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Whether an installed tree has a menu entry that a desktop can start: entry, program and icon. For the packages of .ci/nightly.
#   tools/check_menu.sh [ROOT]     ROOT: of the tree, / when left out. Exit code 1: something is missing; every fault is printed.
set -uo pipefail
root="${1:-}"
root="${root%/}"
entry="$root/usr/share/applications/catgut.desktop"
bad=0
fault() { echo "check_menu: $*"; bad=1; }
[ -f "$entry" ] || { fault "no $entry"; exit 1; }
value() { sed -n "s/^$1=//p" "$entry" | head -n 1; }
[ "$(grep -v '^#' "$entry" | head -n 1)" = "[Desktop Entry]" ] || fault "$entry does not begin with [Desktop Entry]"
[ "$(value Type)" = Application ] || fault "Type is not Application"
for key in Name Exec Icon Categories; do [ -n "$(value $key)" ] || fault "$key is empty"; done
[[ "$(value Categories)" == *";" ]] || fault "Categories does not end in a semicolon"
program="$(value Exec)"
program="${program%% *}"
[ -x "$root/usr/bin/$program" ] || fault "Exec: no program $root/usr/bin/$program"
icons=0
for icon in "$root"/usr/share/icons/hicolor/*/apps/"$(value Icon)".{svg,png}; do
  [ -f "$icon" ] || continue
  icons=$((icons + 1))
  size="$(basename "$(dirname "$(dirname "$icon")")")"
  if [ "$size" = scalable ]; then
    grep -q '<svg ' "$icon" && grep -q '</svg>' "$icon" || fault "$icon is not an SVG picture"
    box="$(sed -nE 's/.*viewBox="0 0 ([0-9]+) ([0-9]+)".*/\1x\2/p' "$icon" | head -n 1)"
    [ -n "$box" ] && [ "${box%x*}" = "${box#*x}" ] || fault "$icon is not square: viewBox ${box:-missing}"
  else  # a PNG: signature, then width and height at byte 16
    [ "$(head -c 8 "$icon" | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] || { fault "$icon is not a PNG picture"; continue; }
    is="$(od -An -tu1 -j 16 -N 8 "$icon" | awk '{print (($1*256+$2)*256+$3)*256+$4 "x" (($5*256+$6)*256+$7)*256+$8}')"
    [ "$is" = "$size" ] || fault "$icon has $is pixels, its folder says $size"
  fi
done
[ $icons -gt 0 ] || fault "Icon: no picture $(value Icon) below $root/usr/share/icons/hicolor"
if command -v desktop-file-validate >/dev/null; then
  desktop-file-validate "$entry" || fault "desktop-file-validate refuses $entry"
else
  echo "check_menu: desktop-file-validate is not installed here (Debian: desktop-file-utils): its rules were not checked"
fi
[ $bad -eq 0 ] && echo "menu entry: $(value Name), starts $program, $icons icon(s)"
exit $bad
