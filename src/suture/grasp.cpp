// SPDX-License-Identifier: Apache-2.0
// suture/grasp: jaws that hold needle, thread or tissue. Reads jaws and poses; adds and removes welds, thread holds and
// attachments of tissue.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

// The needle nearest to the jaws, within reach.
bool take_needle(SutureContext& c, uint32_t who) {
  InstrumentState& hand = c.state.instrument[who];
  const RigidBody& tool = c.solver.body[who];
  float best = c.suture.grasp_reach;
  int64_t found = -1;
  for (size_t k = 0; k < c.state.suture.size(); ++k) {
    const NeedleArc& arc = c.model.needle_arc[k];
    const RigidBody& needle = c.solver.body[c.model.needle_body(k)];
    const float d = distance(needle_point(arc, needle, arc.nearest(to_local(needle.pose(), tool.x))), tool.x);
    if (d <= best) best = d, found = static_cast<int64_t>(k);
  }
  if (found < 0) return false;
  const OneSuture s(c, static_cast<size_t>(found));
  Weld w;
  w.a = static_cast<int>(s.needle);
  w.b = static_cast<int>(who);
  // Held at the grasped position and angle: the same world frame in both bodies' coordinates.
  w.local_a = inverse(s.body().pose()) * tool.pose();
  w.compliance = c.suture.grasp_compliance;
  w.angular_compliance = c.suture.grasp_angular_compliance;
  c.solver.weld.push_back(w);
  hand.held = Held::needle;
  hand.suture = c.state.active = s.index;
  hand.at = s.arc.nearest(to_local(s.body().pose(), tool.x)) / s.arc.arc;
  c.report_tool(s.index, EventKind::needle_grasped, who, 0, hand.at, tool.x);
  return true;
}

// The thread particle nearest to the jaws, of any suture, within reach and not held.
bool take_thread(SutureContext& c, uint32_t who) {
  InstrumentState& hand = c.state.instrument[who];
  const RigidBody& tool = c.solver.body[who];
  const ToolLoop& loop = c.state.loop[who];
  float best = c.suture.grasp_reach;
  int64_t found = -1;
  for (size_t k = 0; k < c.solver.strand.size(); ++k) {
    const Strand& strand = c.solver.strand[k];
    for (uint32_t slot : strand.order) {
      const float d = distance(xyz(c.solver.x[slot]), tool.x);
      if (d >= best || is_locked(strand, slot) || (loop.suture == k && beside_loop(strand, loop, slot))) continue;
      best = d, found = slot;
      hand.suture = static_cast<uint32_t>(k);
    }
  }
  if (found < 0) return false;
  hand.held = Held::thread;
  hand.slot = static_cast<uint32_t>(found);
  const Vec3 local = to_local(tool.pose(), xyz(c.solver.x[hand.slot]));
  c.solver.strand[hand.suture].hold.push_back({hand.slot, static_cast<int>(who), local, HoldKind::jaw});
  hold_other_strands(c, who);
  c.report_tool(hand.suture, EventKind::thread_grasped, who, hand.slot, 0, tool.x);
  return true;
}

// The jaws close on the wall: its nearest point, embedded in its neighborhood, is held where it is.
void take_tissue(SutureContext& c, uint32_t who) {
  InstrumentState& hand = c.state.instrument[who];
  const RigidBody& tool = c.solver.body[who];
  SurfaceHit hit;
  if (!nearest_surface(c.model, c.scratch.candidates, c.solver.x.data(), tool.x, c.suture.grasp_reach, hit)) return;
  if (std::abs(hit.distance) > c.suture.tissue_reach) return;
  spread(c.model, hit.end);
  const Triangle& corner = c.model.collision.surface[hit.end.triangle];
  const size_t nearest =
      static_cast<size_t>(std::max_element(hit.end.weight.begin(), hit.end.weight.end()) - hit.end.weight.begin());
  Attachment a;
  a.point = hit.end.point;
  a.body = static_cast<int>(who);
  a.target = to_local(tool.pose(), hit.point);
  a.compliance = c.suture.tissue_compliance;
  c.solver.attach.push_back(a);
  hand.held = Held::tissue;
  hand.slot = corner[nearest];
  c.report_tool(0, EventKind::tissue_grasped, who, hand.slot, 0, hit.point);
}

}  // namespace

void release(SutureContext& c, uint32_t who, float force) {
  InstrumentState& hand = c.state.instrument[who];
  const int body = static_cast<int>(who);
  const Vec3 at = c.solver.body[who].x;
  if (hand.held == Held::needle) {
    const int needle = static_cast<int>(c.model.needle_body(hand.suture));
    std::erase_if(c.solver.weld, [&](const Weld& w) { return w.a == needle && w.b == body; });
    c.report_tool(hand.suture, EventKind::needle_released, who, 0, force, at);
  } else if (hand.held == Held::thread) {
    for (Strand& strand : c.solver.strand) release_holds(strand, body, HoldKind::jaw);
    c.report_tool(hand.suture, EventKind::thread_released, who, hand.slot, force, at);
  } else if (hand.held == Held::tissue) {
    std::erase_if(c.solver.attach, [&](const Attachment& a) { return a.body == body; });
    c.report_tool(0, EventKind::tissue_released, who, hand.slot, force, at);
  }
  hand.held = Held::nothing;
}

void grasp(SutureContext& c, const HandInputs& input) {
  for (uint32_t who = 0; who < c.state.instrument.size(); ++who) {
    InstrumentState& hand = c.state.instrument[who];
    const InstrumentModel& kind = c.suture.instrument[who];
    if (hand.place != InstrumentPlace::hand) continue;
    const float jaw = input[hand.hand].connected ? follow_jaw(hand, kind, input[hand.hand].jaw) : hand.jaw;
    const bool closing = hand.jaw > kind.jaw.closed && jaw <= kind.jaw.closed;
    hand.jaw = jaw;
    if (hand.held != Held::nothing) {
      if (jaw >= kind.jaw.open) release(c, who, 0);
    } else if (closing) {
      if (kind.can(kHoldNeedle) && take_needle(c, who)) continue;
      if (kind.can(kHoldThread) && take_thread(c, who)) continue;
      if (kind.can(kHoldTissue)) take_tissue(c, who);
    }
  }
}

void slip(SutureContext& c) {
  for (uint32_t who = 0; who < c.state.instrument.size(); ++who) {
    const InstrumentState& hand = c.state.instrument[who];
    const InstrumentModel& kind = c.suture.instrument[who];
    const int body = static_cast<int>(who);
    float force = 0, most = 1;
    if (hand.held == Held::needle) {
      most = kind.needle_grip;
      const int needle = static_cast<int>(c.model.needle_body(hand.suture));
      for (const Weld& w : c.solver.weld)
        if (w.a == needle && w.b == body) force = length(w.lambda) / (c.model.h * c.model.h);
    } else if (hand.held == Held::thread) {
      most = kind.thread_grip;
      const Strand& strand = c.solver.strand[hand.suture];
      force = tension_at(strand, node_of(strand, hand.slot));
    } else if (hand.held == Held::tissue) {
      most = kind.tissue_grip;
      for (const Attachment& a : c.solver.attach)
        if (a.body == body) force = length(a.lambda) / (c.model.h * c.model.h);
    }
    if (force > most) release(c, who, force);
  }
}

}  // namespace catgut
