#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Opens the reports and the educator's page in Chromium at the sizes of a phone, a laptop and paper; checks numbers, forms, rights and
# accessibility. Needs a built program in build/, chromium and node; the npm packages are those of tests/page/package-lock.json.
#   tools/check_page.sh [OUT]               screenshots and pages; default build/page
#   tools/check_page.sh --cohort TABLE      the page with the cohort of studies/cohort.toml: time to open, learning curve
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
table=""
if [ "${1:-}" = --cohort ]; then
  table="$(realpath "${2:?check_page: --cohort needs the table of catgut study studies/cohort.toml}")"
  shift 2
fi
out="$(mkdir -p "${1:-$root/build/page}" && cd "${1:-$root/build/page}" && pwd)"
program="${CATGUT_PROGRAM:-$root/build/app/catgut}"
for needed in chromium node npm; do
  command -v "$needed" >/dev/null || { echo "check_page: $needed is missing: apt-get install chromium nodejs npm" >&2; exit 2; }
done
[ -x "$program" ] || { echo "check_page: build the program first: ./catgut --version" >&2; exit 2; }
work="$root/build/page_test"
mkdir -p "$work"
cp "$root"/tests/page/{package.json,package-lock.json,page.mjs,cohort.mjs} "$work/"
[ -d "$work/node_modules" ] && cmp -s "$work/package-lock.json" "$work/installed.json" ||
  { (cd "$work" && npm ci --no-audit --no-fund --ignore-scripts >npm.log 2>&1) || { tail -n 5 "$work/npm.log" >&2; exit 1; }; cp "$work/package-lock.json" "$work/installed.json"; }
cd "$work"
[ -z "$table" ] || exec node cohort.mjs "$program" "$out/cohort" "$(command -v chromium)" "$root/studies" "$table"
exec node page.mjs "$program" "$out/run" "$(command -v chromium)" "$root/tests/page/runs.csv"
