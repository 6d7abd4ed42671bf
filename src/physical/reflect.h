// SPDX-License-Identifier: Apache-2.0
// physical/reflect: the members of the state of bodies and needles (core/reflect.h), for saving, loading and hashing.
#pragma once
#include "core/reflect.h"
#include "physical/body.h"
#include "physical/needle.h"

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
  a(b.held), a(b.skip), a(b.grip), a(b.thread_force), a(b.thread_torque), a(b.force), a(b.torque), a(b.hand_force);
  a(b.hand_torque);
}
constexpr void reflect(auto& a, Like<RowMemory> auto& m) { a(m.key), a(m.axis), a(m.impulse); }
constexpr void reflect(auto& a, Like<Bodies> auto& b) { a(b.body), a(b.memory), a(b.overflow); }
constexpr void reflect(auto& a, Like<Channel> auto& c) {
  a(c.point), a.at_most(c.count, uint32_t{kMaxPath}), a(c.entry_side), a(c.exit_side), a(c.entry_hole), a(c.exit_hole);
}
constexpr void reflect(auto& a, Like<Needle> auto& n) {
  a(n.thread_node), a(n.channel), a.at_most(n.channels, uint32_t{kMaxChannels}), a(n.inside), a(n.tip), a(n.entry_peak);
  a(n.exit_peak), a(n.events), a.cache(n.tip_row), a.cache(n.exit_row), a.cache(n.tip_on), a.cache(n.exit_on);
}

}  // namespace catgut::physical
