// SPDX-License-Identifier: Apache-2.0
// exchange/reflect: the members of types shared between rooms, for archives (core/reflect.h).
#pragma once
#include "core/reflect.h"
#include "core/sym3.h"
#include "exchange/event.h"
#include "exchange/force_patch.h"
#include "exchange/snapshot.h"

namespace catgut {

constexpr void reflect(auto& a, Like<Sym3> auto& s) { a(s.xx), a(s.yy), a(s.zz), a(s.xy), a(s.xz), a(s.yz); }

constexpr void reflect(auto& a, Like<KnotThrow> auto& t) {
  a(t.wraps), a(t.chirality), a(t.needle_end), a(t.tension), a(t.gap);
}

constexpr void reflect(auto& a, Like<Event> auto& e) {
  const auto before = [](auto count) { return static_cast<uint32_t>(count) - 1; };
  a.at_most(e.kind, before(EventKind::count_)), a(e.who), a(e.which), a(e.value), a(e.where);
  a.at_most(e.fault, before(Fault::count_)), a.at_most(e.reason, before(LoopReason::count_)), a(e.suture), a(e.tick);
}
constexpr void reflect(auto& a, Like<EventList> auto& e) { a(e.tick), a(e.list); }

constexpr void reflect(auto& a, Like<ForcePatch> auto& p) {
  a(p.tick), a(p.epoch), a(p.discontinuity_id), a(p.time_ns), a(p.period), a(p.expiry);
  a(p.point), a(p.force), a(p.stiffness), a(p.damping), a(p.normal), a(p.gap);
  a(p.coefficient), a(p.drag), a(p.presliding), a(p.viscous), a(p.along);
  a(p.pierce), a(p.pierce_force), a(p.pierce_keep), a(p.thread_direction), a(p.thread_tension), a(p.cap);
  a.cache(p.turn), a.cache(p.lever), a.cache(p.couple), a.cache(p.couple_stiffness), a.cache(p.grip_from);
  a.cache(p.grip_stiffness);
}

constexpr void reflect(auto& a, Like<ToolView> auto& t) {
  a(t.instrument), a(t.pose), a(t.hand), a(t.jaw), a(t.held), a(t.held_at), a(t.held_slot), a(t.held_suture), a(t.held_strands);
  a(t.loop_wraps), a(t.loop_handed), a(t.loop_suture), a(t.loop_first), a(t.loop_last), a(t.force), a(t.torque);
}
constexpr void reflect(auto& a, Like<InstrumentView> auto& i) {
  a(i.pose), a(i.jaw), a(i.place), a(i.hand), a(i.held), a(i.held_slot), a(i.pull), a(i.pen), a(i.burning);
}
constexpr void reflect(auto& a, Like<NeedleView> auto& n) { a(n.pose), a(n.in_tissue), a(n.bite); }
constexpr void reflect(auto& a, Like<SuturePointView> auto& p) {
  a(p.position), a(p.bite), a(p.exit), a(p.anchored), a(p.tension_needle), a(p.tension_free), a(p.wall);
}
constexpr void reflect(auto& a, Like<KnotView> auto& k) { a(k.phase), a(k.position), a(k.way), a(k.throws), a(k.thrown); }
constexpr void reflect(auto& a, Like<SettledView> auto& s) { a(s.node), a(s.knot); }
constexpr void reflect(auto& a, Like<SeamView> auto& s) { a(s.a), a(s.b), a(s.start), a(s.progress), a(s.midpoint); }
constexpr void reflect(auto& a, Like<BiteView> auto& b) {
  a(b.entry), a(b.exit), a(b.depth), a(b.has_exit), a(b.complete), a(b.wall), a(b.entry_inside), a(b.exit_inside);
  a(b.entry_made), a(b.exit_made), a(b.torn), a(b.torn_out);
}
constexpr void reflect(auto& a, Like<SutureView> auto& s) {
  a(s.needle), a(s.thread_order), a(s.thread_tension), a(s.thread_cut), a(s.thread_rest), a(s.needle_on_thread);
  a(s.suture_point), a(s.knot), a(s.bite), a(s.seam);
}
constexpr void reflect(auto& a, Like<TopologyView> auto& t) { a(t.version), a(t.pieces), a.cache(t.picture); }
constexpr void reflect(auto& a, Like<Scar> auto& s) { a(s.burnt), a(s.depth), a(s.blood); }
constexpr void reflect(auto& a, Like<BleedingView> auto& b) { a(b.at), a(b.flow), a(b.lost); }
constexpr void reflect(auto& a, Like<WoundView> auto& w) {
  a(w.bleeding), a(w.thermal_spread), a(w.damaged), a(w.freed_mass), a(w.freed_at);
}
constexpr void reflect(auto& a, Like<Snapshot> auto& s) {
  a(s.tick), a(s.time_s), a(s.topology), a(s.particle), a(s.rotation), a(s.tool), a(s.instrument), a(s.suture),
      a(s.active_suture), a(s.settled);
  a(s.opening_area), a(s.closure), a(s.event), a(s.patch), a(s.scar), a(s.wound);
}

}  // namespace catgut
