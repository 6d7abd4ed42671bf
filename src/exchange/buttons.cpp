// SPDX-License-Identifier: Apache-2.0
// exchange: see buttons.h.
#include "exchange/buttons.h"

#include <algorithm>
#include <limits>

namespace catgut {

uint32_t suture_to_cut(const Snapshot& seen, size_t hand) {
  const ToolView& tool = seen.tool[hand];
  if (tool.held == Held::needle) return tool.held_suture;
  uint32_t nearest = seen.active_suture;
  float best = std::numeric_limits<float>::max();
  for (uint32_t k = 0; k < seen.suture.size(); ++k) {
    const SutureView& s = seen.suture[k];
    for (size_t i = 0; i + 1 < s.thread_order.size(); ++i) {
      if (i < s.thread_cut.size() && s.thread_cut[i]) continue;
      const Vec3 a = seen.particle[s.thread_order[i]], b = seen.particle[s.thread_order[i + 1]];
      const float along = dot(tool.pose.p - a, b - a) / std::max(length2(b - a), 1e-12f);
      const float d = distance(lerp(a, b, std::clamp(along, 0.0f, 1.0f)), tool.pose.p);
      if (d < best) best = d, nearest = k;
    }
  }
  return nearest;
}

uint32_t suture_to_replace(const Snapshot& seen, size_t hand) {
  const ToolView& tool = seen.tool[hand];
  return tool.held == Held::needle || tool.held == Held::thread ? tool.held_suture : seen.active_suture;
}

void add_commands(CommandList& out, size_t hand, uint32_t pressed, const Snapshot& seen) {
  const auto add = [&](CommandKind kind, uint32_t suture) {
    out.push({kind, static_cast<uint8_t>(hand), static_cast<uint16_t>(suture)});
  };
  if (pressed & kButtonCut) add(CommandKind::cut, suture_to_cut(seen, hand));
  if (pressed & kButtonNewSuture) add(CommandKind::new_suture, suture_to_replace(seen, hand));
}

}  // namespace catgut
