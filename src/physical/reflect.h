// SPDX-License-Identifier: Apache-2.0
// physical/reflect: the members of a state of wall, thread, bodies and needles, for writing, reading and hashing it
// (core/reflect.h). Of the wall's topology only the links that were cut: the rest follows from them (restore_cuts
// after a load).
#pragma once
#include "core/reflect.h"
#include "physical/physical.h"
#include "wall/reflect.h"

namespace catgut::thread {

constexpr void reflect(auto& a, Like<Columns3> auto& c) { a(c.x), a(c.y), a(c.z); }
constexpr void reflect(auto& a, Like<Crossing> auto& c) {
  a(c.s), a(c.t), a(c.normal), a(c.gap), a(c.normal_impulse), a(c.friction_impulse), a(c.drift), a(c.touch), a(c.pad);
}
constexpr void reflect(auto& a, Like<Eyelet> auto& e) {
  a(e.point), a(e.segment), a(e.friction), a(e.slip), a(e.before), a(e.angle);
}
constexpr void reflect(auto& a, Like<SoftContact> auto& c) {
  a(c.node), a(c.point), a(c.offset), a(c.patch), a(c.normal), a(c.friction), a(c.normal_impulse), a(c.friction_impulse);
  a(c.drift), a(c.gap);
}
constexpr void reflect(auto& a, Like<State> auto& s) {
  a(s.x), a(s.fine), a(s.v), a(s.warm), a(s.kept), a(s.rest), a(s.tension), a(s.broken), a(s.key), a(s.budget), a(s.crossing);
  a(s.plane_normal), a(s.plane_friction), a(s.plane_drift), a(s.eyelet), a(s.listed), a(s.travel);
  a(s.overflow), a(s.refreshes);
}

}  // namespace catgut::thread

namespace catgut::wall {
constexpr void reflect(auto& a, Like<Point> auto& p) { a(p.face), a(p.xi), a(p.eta), a(p.zeta); }
}  // namespace catgut::wall

namespace catgut::physical {

constexpr void reflect(auto& a, Like<GripPoint> auto& g) { a(g.in_tool), a(g.in_needle), a(g.tissue), a(g.impulse); }
constexpr void reflect(auto& a, Like<Grip> auto& g) {
  a.at_most(g.what, Gripped::tissue), a.at_most(g.count, uint32_t{4});
  a(g.body), a(g.node), a(g.force), a(g.size), a(g.slid), a(g.point);
}
constexpr void reflect(auto& a, Like<Body> auto& b) {
  a(b.pose), a(b.velocity), a(b.spin), a(b.opening), a(b.shown), a(b.shown_opening), a(b.target_place), a(b.target_turn);
  a(b.held), a(b.skip), a(b.grip), a(b.thread_force), a(b.thread_torque), a(b.drag), a(b.turn_drag), a(b.force), a(b.torque);
  a(b.hand_force), a(b.hand_torque);
}
constexpr void reflect(auto& a, Like<RowMemory> auto& m) { a(m.key), a(m.axis), a(m.impulse); }
constexpr void reflect(auto& a, Like<Bodies> auto& b) { a(b.body), a(b.memory), a(b.overflow); }
constexpr void reflect(auto& a, Like<Channel> auto& c) {
  a(c.point), a.at_most(c.count, uint32_t{kMaxPath}), a(c.entry_side), a(c.exit_side), a(c.entry_hole), a(c.exit_hole);
  a(c.made), a(c.torn), a(c.load);
}
constexpr void reflect(auto& a, Like<Needle> auto& n) {
  a(n.thread_node), a(n.channel), a.at_most(n.channels, uint32_t{kMaxChannels}), a(n.inside), a(n.tip), a(n.entry_peak);
  a(n.exit_peak), a(n.events), a.cache(n.tip_row), a.cache(n.exit_row), a.cache(n.tip_on), a.cache(n.exit_on);
  a.cache(n.torn), a.cache(n.torn_hole), a.cache(n.give);
}
constexpr void reflect(auto& a, Like<Hole> auto& h) {
  a(h.place), a(h.within), a(h.deepest), a(h.made), a(h.torn), a(h.out), a(h.load);
}
constexpr void reflect(auto& a, Like<Sleep::Strand> auto& k) { a(k.first), a(k.last), a(k.quiet), a(k.asleep), a(k.loop); }
constexpr void reflect(auto& a, Like<Sleep::Load> auto& l) { a(l.strand), a(l.at), a(l.impulse); }
constexpr void reflect(auto& a, Like<Sleep::Watched> auto& w) {
  a(w.strand), a(w.column), a(w.mid), a(w.director), a(w.may_move);
}
constexpr void reflect(auto& a, Like<Sleep::Held> auto& h) { a(h.strand), a(h.node), a(h.to), a(h.force); }
constexpr void reflect(auto& a, Like<Sleep::Touched> auto& t) {
  a(t.strand), a(t.tool), a(t.a), a(t.b), a(t.force_a), a(t.force_b);
}
constexpr void reflect(auto& a, Like<Sleep> auto& z) {
  a(z.strand), a(z.holes), a(z.from), a(z.tension), a(z.load), a(z.watched), a(z.held), a(z.touched);
}
constexpr void reflect(auto& a, Like<State> auto& s) {
  auto& t = s.wall.topology;
  a.cache(t.version), a.cache(t.corners), a.cache(t.source), a.cache(t.mass), a.cache(t.inv_dir), a.cache(t.slot);
  a.cache(t.share), a.cache(t.relative), a.cache(t.spread), a.cache(t.group_first), a.cache(t.group_member);
  a.cache(t.gather_first), a.cache(t.gather_from), a.cache(t.factor);
  a(t.cut), a(t.factored);
  a.cache(t.first_fragment), a.cache(t.fragment), a.cache(t.extra);
  a(s.wall.motion), a(s.thread), a(s.hole), a(s.contact), a(s.lip);
  a(s.bodies), a(s.needle), a(s.sleep);
  a.cache(s.cut_surface);
}
}  // namespace catgut::physical
