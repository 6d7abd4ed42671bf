#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Updates the parts of pages that the program prints: docs/scene_reference.md, the metrics of docs/assessment.md, and the numbers in docs/one_tick.md (each block that
# opens with ```text NAME takes the lines after [NAME] of the sample one_tick). Run it after a change of keys or of physics.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
./catgut describe --markdown >build/reference.md
mv build/reference.md docs/scene_reference.md
./catgut assess --metrics >build/metrics.md
awk 'NR == FNR { table = table $0 "\n"; next }
     /^<!-- metrics -->$/ { print; printf "%s", table; skip = 1; next }
     /^<!-- end -->$/ { skip = 0 }
     !skip { print }' build/metrics.md docs/assessment.md >build/assessment.md
mv build/assessment.md docs/assessment.md
ninja -C build sample_one_tick >/dev/null
build/samples/sample_one_tick >build/one_tick.txt
awk 'NR == FNR { if ($0 ~ /^\[[a-z]+\]$/) name = substr($0, 2, length($0) - 2); else block[name] = block[name] $0 "\n"; next }
     /^```text [a-z]+$/ { print; printf "%s", block[$2]; skip = 1; next }
     /^```$/ { skip = 0 }
     !skip { print }' build/one_tick.txt docs/one_tick.md >build/one_tick.md
mv build/one_tick.md docs/one_tick.md
git diff --stat -- docs
