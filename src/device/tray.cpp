// SPDX-License-Identifier: Apache-2.0
// device: see tray.h.
#include "device/tray.h"

#include <algorithm>

namespace catgut {

namespace {

bool is_assistants(const Snapshot& seen, size_t instrument) {
  return std::any_of(seen.tool.begin() + 2, seen.tool.end(),
                     [&](const ToolView& t) { return t.instrument == static_cast<int>(instrument); });
}

}  // namespace

Command next_from_tray(const Snapshot& seen, size_t hand) {
  const size_t n = seen.instrument.size();
  const bool empty = seen.tool[hand].instrument < 0;
  const size_t own = empty ? n - 1 : static_cast<size_t>(seen.tool[hand].instrument);
  for (size_t k = 1; k <= n; ++k) {
    const size_t i = (own + k) % n;
    if (seen.instrument[i].place == InstrumentPlace::tray)
      return {empty ? CommandKind::take : CommandKind::swap, static_cast<uint8_t>(hand), static_cast<uint16_t>(i)};
  }
  return {};
}

Command park_or_take_up(const Snapshot& seen, size_t hand) {
  const ToolView& tool = seen.tool[hand];
  if (tool.instrument >= 0)
    return {tool.held == Held::nothing ? CommandKind::lay_down : CommandKind::park, static_cast<uint8_t>(hand),
            static_cast<uint16_t>(tool.instrument)};
  Command found;
  float best = 1e30f;
  for (size_t i = 0; i < seen.instrument.size(); ++i) {
    const InstrumentView& v = seen.instrument[i];
    const float d = distance(v.pose.p, tool.hand.p);
    if (!(v.place == InstrumentPlace::parked || (v.held == Held::tissue && is_assistants(seen, i))) || d >= best) continue;
    best = d;
    found = {CommandKind::unpark, static_cast<uint8_t>(hand), static_cast<uint16_t>(i)};
  }
  return found;
}

}  // namespace catgut
