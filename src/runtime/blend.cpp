// SPDX-License-Identifier: Apache-2.0
// runtime: see blend.h.
#include "runtime/blend.h"

namespace catgut {
namespace {

Pose between(const Pose& a, const Pose& b, float part) { return {lerp(a.p, b.p, part), nlerp(a.q, b.q, part)}; }

// Whether two lists have the same rows in the same order: rows are only ever appended, or the list starts again.
template <typename Row, typename Move>
void each_row(const std::vector<Row>& before, std::vector<Row>& out, Move&& move) {
  if (before.size() != out.size()) return;
  for (size_t i = 0; i < out.size(); ++i) move(before[i], out[i]);
}

}  // namespace

void blend(const Snapshot& before, const Snapshot& now, float part, Snapshot& out) {
  out = now;
  if (before.tick + 1 != now.tick || part >= 1 || before.particle.size() != now.particle.size() ||
      before.rotation.size() != now.rotation.size())
    return;
  part = std::max(part, 0.0f);
  out.time_s = before.time_s + (now.time_s - before.time_s) * static_cast<double>(part);
  for (size_t i = 0; i < out.particle.size(); ++i) out.particle[i] = lerp(before.particle[i], now.particle[i], part);
  for (size_t i = 0; i < out.rotation.size(); ++i) out.rotation[i] = nlerp(before.rotation[i], now.rotation[i], part);
  for (size_t k = 0; k < out.tool.size(); ++k) {
    const ToolView& from = before.tool[k];
    ToolView& tool = out.tool[k];
    tool.jaw = from.jaw + (tool.jaw - from.jaw) * part;
    // A hand that has just connected did not move there.
    if (distance(from.pose.p, tool.pose.p) > 0.05f) continue;
    tool.pose = between(from.pose, tool.pose, part);
    tool.hand = between(from.hand, tool.hand, part);
  }
  each_row(before.instrument, out.instrument, [&](const InstrumentView& a, InstrumentView& o) {
    o.jaw = a.jaw + (o.jaw - a.jaw) * part;
    if (distance(a.pose.p, o.pose.p) < 0.05f) o.pose = between(a.pose, o.pose, part);  // nor one that was taken
  });
  each_row(before.suture, out.suture, [&](const SutureView& from, SutureView& suture) {
    if (distance(from.needle.pose.p, suture.needle.pose.p) < 0.05f)  // nor a new needle
      suture.needle.pose = between(from.needle.pose, suture.needle.pose, part);
    each_row(from.suture_point, suture.suture_point,
             [&](auto& a, auto& o) { o.position = lerp(a.position, o.position, part); });
    each_row(from.knot, suture.knot, [&](auto& a, auto& o) { o.position = lerp(a.position, o.position, part); });
  });
  each_row(before.settled, out.settled, [&](auto& a, auto& o) {
    each_row(a.node, o.node, [&](Vec3 p, Vec3& q) { q = lerp(p, q, part); });
    each_row(a.knot, o.knot, [&](Vec3 p, Vec3& q) { q = lerp(p, q, part); });
  });
}

}  // namespace catgut
