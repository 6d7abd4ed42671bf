// SPDX-License-Identifier: Apache-2.0
// wall/reflect: the members of a wall's state, for writing, reading and hashing it (core/reflect.h). Motion changes in every
// step, Topology only with a cut or a new factor. A hash of each tick needs the first and the topology's version alone.
#pragma once
#include "core/reflect.h"
#include "wall/contact.h"
#include "wall/wall.h"

namespace catgut::wall {

constexpr void reflect(auto& a, Like<Float4> auto& v) { a(v.x), a(v.y), a(v.z), a(v.w); }
constexpr void reflect(auto& a, Like<Panel> auto& p) { a(p.first), a(p.width), a(p.index), a(p.count), a(p.value); }
constexpr void reflect(auto& a, Like<Factor> auto& f) { a(f.size), a(f.place), a(f.panel), a(f.row), a(f.value); }
constexpr void reflect(auto& a, Like<BlockCorners> auto& c) { a(c.column), a(c.quads), a(c.unused); }
constexpr void reflect(auto& a, Like<BlockTurn> auto& t) { a(t.x), a(t.y), a(t.z), a(t.w); }
constexpr void reflect(auto& a, Like<FaceCut> auto& c) { a(c.bit); }
constexpr void reflect(auto& a, Like<Fragment> auto& f) { a(f.cells), a(f.face), a(f.lane); }
constexpr void reflect(auto& a, Like<ElementBlock> auto& b) { a(b.constant); }
constexpr void reflect(auto& a, Like<Motion> auto& m) { a(m.x), a(m.v), a(m.turn), a(m.clamped); }
constexpr void reflect(auto& a, Like<Topology> auto& t) {
  a(t.version), a(t.corners), a(t.source), a(t.mass), a(t.inv_dir), a(t.slot), a(t.share), a(t.relative), a(t.spread);
  a(t.group_first), a(t.group_member), a(t.gather_first), a(t.gather_from), a(t.factor);
  a(t.cut), a(t.factored), a(t.first_fragment), a(t.fragment), a(t.extra);
}
constexpr void reflect(auto& a, Like<State> auto& s) { a(s.topology), a(s.motion); }

// Contacts persist between steps: their impulses start the next solve.
constexpr void reflect(auto& a, Like<Weights> auto& w) { a(w.column), a(w.weight), a(w.zeta); }
constexpr void reflect(auto& a, Like<Contact> auto& c) {
  a(c.key), a(c.point), a(c.other), a(c.self), a(c.obstacle), a(c.along), a(c.normal), a(c.gap), a(c.speed), a(c.friction);
  a(c.impulse);
}
constexpr void reflect(auto& a, Like<ContactSolver> auto& s) { a(s.contact); }

}  // namespace catgut::wall
