// SPDX-License-Identifier: Apache-2.0
// suture/reflect: the members of the sutures' state, for archives (core/reflect.h).
#pragma once
#include "exchange/reflect.h"
#include "solver/reflect.h"
#include "suture/suture.h"

namespace catgut {

constexpr void reflect(auto& a, Like<BiteEnd> auto& e) { a.index(e.triangle, IndexOf::triangle), a(e.weight), a(e.point); }

constexpr void reflect(auto& a, Like<Bite> auto& b) {
  a(b.entry), a(b.exit), a(b.depth), a(b.has_exit), a(b.complete), a(b.canceled), a(b.entry_made), a(b.exit_made), a(b.torn),
      a(b.torn_out), a.index(b.nearest, IndexOf::tissue);
}

constexpr void reflect(auto& a, Like<OpenBite> auto& o) {
  a.index(o.bite, IndexOf::bite), a.at_most(o.phase, NeedlePhase::back_in), a(o.drawn), a(o.reported);
}

constexpr void reflect(auto& a, Like<SuturePoint> auto& p) { a.index(p.bite, IndexOf::bite), a(p.exit), a(p.anchor); }

constexpr void reflect(auto& a, Like<InstrumentState> auto& i) {
  a.at_most(i.held, Held::tissue);
  if (i.held == Held::thread) a.index(i.slot, IndexOf::slot);
  else if (i.held == Held::tissue) a.index(i.slot, IndexOf::tissue);
  else a(i.slot);
  a(i.at), a(i.jaw), a.at_most(i.place, InstrumentPlace::parked), a(i.hand), a(i.latched), a(i.parked_at);
  a.index(i.suture, IndexOf::strand);
}

constexpr void reflect(auto& a, Like<ToolLoop> auto& l) {
  a(l.wraps), a(l.chirality);
  if (l.wraps > 0) a.index(l.first, IndexOf::slot), a.index(l.last, IndexOf::slot);
  else a(l.first), a(l.last);
  a.at_most(l.reported, LoopReason::too_deep), a(l.ignored_until_clear), a(l.jaw), a.index(l.suture, IndexOf::strand);
}

constexpr void reflect(auto& a, Like<Knot> auto& k) {
  a.at_most(k.phase, KnotPhase::locked), a.index(k.hand, IndexOf::instrument), a(k.begun), a(k.target), a(k.from), a(k.left),
      a(k.hand_from);
  a.index(k.strand, IndexOf::slot), a(k.end), a(k.slot), a.at_most(k.slots, 2u), a(k.slack_removed);
  a.at_most(k.throws, KnotView::kMaxThrows), a(k.reported), a(k.thrown);
}

constexpr void reflect(auto& a, Like<BakedNode> auto& n) { a.index(n.particle, IndexOf::tissue), a(n.offset); }
constexpr void reflect(auto& a, Like<BakedSuture> auto& s) { a(s.node), a(s.knot); }

constexpr void reflect(auto& a, Like<Suture> auto& s) {
  a.domain(IndexOf::bite, s.bite.size());
  a(s.bite), a(s.point), a(s.open), a(s.tip_inside), a(s.attached), a(s.attached_from), a(s.knot), a(s.suture_index);
}
constexpr void reflect(auto& a, Like<SutureState> auto& s) {
  a.column(s.suture, IndexOf::strand), a.column(s.instrument, IndexOf::instrument), a.column(s.loop, IndexOf::instrument);
  a(s.settled), a.index(s.active, IndexOf::strand);
}

constexpr void reflect(auto& a, Like<ClosurePlan::Pull> auto& p) { a(p.point), a(p.from), a(p.to); }
constexpr void reflect(auto& a, Like<ClosurePlan::Pair> auto& p) {
  a(p.a), a(p.b), a(p.start), a(p.end), a(p.progress), a(p.midpoint);
}
constexpr void reflect(auto& a, Like<ClosurePlan> auto& p) { a(p.pull), a(p.progress), a(p.compliance), a(p.pair); }

}  // namespace catgut
