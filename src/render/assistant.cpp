// SPDX-License-Identifier: Apache-2.0
// render: see assistant.h.
#include "render/assistant.h"

#include <algorithm>
#include <utility>

namespace catgut {
namespace {

constexpr double kClosing = 0.15, kStays = 0.4, kGone = 1.0;  // [s] after the cut
constexpr double kGap = 0.6;                                  // [s] between pictures
constexpr float kWithdrawn = 0.12f;                           // [m] in that time

// From above and from outside of the field; the thread passes between the blades.
Pose beside(const PictureModel& model, Vec3 a, Vec3 b) {
  const Vec3 middle = 0.5f * (a + b), off{middle.x - model.focus.x, 0, middle.z - model.focus.z};
  const Vec3 back = normalized(normalized(off, {0.4f, 0, 0.9f}) * 0.6f + Vec3{0, 0.8f, 0});
  Vec3 hinge = b - a - back * dot(b - a, back);
  hinge = normalized(hinge, cross(back, {0, 1, 0}));
  return {middle, from_axes(cross(hinge, back), hinge, back)};
}

}  // namespace

std::optional<InstrumentView> assistants_scissors(CutWatch& watch, const PictureModel& model, const Snapshot& seen) {
  for (const InstrumentPicture& i : model.instrument)
    if (i.kind == "scissors") return {};
  // After a gap the time of a cut is unknown, unless it was in this tick.
  const bool known = watch.started && seen.tick >= watch.tick && seen.time_s - watch.time_s < kGap;
  if (!known) watch.since_s = -1;
  watch.started = true, watch.tick = seen.tick, watch.time_s = seen.time_s;
  watch.cut.resize(seen.suture.size());
  for (size_t s = 0; s < seen.suture.size(); ++s) {
    const SutureView& suture = seen.suture[s];
    const size_t nodes = suture.thread_order.size();
    std::vector<uint8_t> cut(suture.thread_cut.begin(),
                             suture.thread_cut.begin() + long(std::min(suture.thread_cut.size(), nodes - (nodes > 0))));
    cut.push_back(!suture.needle_on_thread);
    for (size_t i = 0; i < cut.size() && nodes > 1; ++i) {
      const size_t at = std::min(i, nodes - 2);
      const uint32_t a = suture.thread_order[at], b = suture.thread_order[at + 1];
      if (!cut[i] || std::max(a, b) >= seen.particle.size()) continue;
      const bool now = std::any_of(seen.event.begin(), seen.event.end(), [&](const Event& e) {
        return e.kind == EventKind::thread_cut && e.suture == s && (e.which == a || e.which == b);
      });
      if (!now && (!known || cut.size() != watch.cut[s].size() || watch.cut[s][i])) continue;
      if (!is_finite(seen.particle[a]) || !is_finite(seen.particle[b])) continue;
      watch.since_s = seen.time_s, watch.pose = beside(model, seen.particle[a], seen.particle[b]);
    }
    watch.cut[s] = std::move(cut);
  }
  const double t = seen.time_s - watch.since_s;
  if (watch.since_s < 0 || t < 0 || t > kGone) return {};
  InstrumentView out;
  out.pose = watch.pose;
  const auto away = static_cast<float>(std::max(0.0, (t - kStays) / (kGone - kStays)));
  out.pose.p += rotate(out.pose.q, {0, 0, kWithdrawn * away * away});
  out.jaw = static_cast<float>(0.6 * std::max(0.0, 1 - t / kClosing));
  return out;
}

}  // namespace catgut
