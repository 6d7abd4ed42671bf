// SPDX-License-Identifier: Apache-2.0
// technique/reflect: the members of the techniques' state, for archives (core/reflect.h). Their rows correspond to the plan's:
// load_state checks that.
#pragma once
#include "suture/reflect.h"
#include "technique/technique.h"

namespace catgut {

constexpr void reflect(auto& a, Like<PurseStringState> auto& p) {
  a(p.ring_complete), a(p.closing), a(p.finished), a(p.path_start), a(p.path_end), a(p.checked), a(p.area_start);
  a.cache(p.where);
}

constexpr void reflect(auto& a, Like<SeamRow> auto& r) {
  a(r.leader), a(r.point), a(r.from), a.at_most(r.hold, SeamHold::nothing), a(r.reported);
}
constexpr void reflect(auto& a, Like<SeamState> auto& s) {
  a(s.row), a.at_most(s.first_row, s.row.size()), a(s.suture_index), a(s.points), a(s.passes), a(s.throws), a(s.reported);
  a.cache(s.pass);
}

constexpr void reflect(auto& a, Like<LembertStitch> auto& s) { a(s.row), a(s.suture), a(s.holds); }
constexpr void reflect(auto& a, Like<LembertRow> auto& r) {
  a(r.one), a(r.other), a.index(r.other_suture, IndexOf::strand), a(r.reported);
}
constexpr void reflect(auto& a, Like<LembertState> auto& l) {
  a(l.stitch), a(l.row), a(l.suture_index), a(l.throws), a(l.knot), a.at_most(l.tied, 1u), a(l.reported);
}

constexpr void reflect(auto& a, Like<OwnTechniqueState> auto& o) { a(o.index), a(o.value); }

constexpr void reflect(auto& a, Like<TechniqueState> auto& t) { a(t.purse_string), a(t.seam), a(t.lembert), a(t.own); }

}  // namespace catgut
