// SPDX-License-Identifier: Apache-2.0
// solver/reflect: the members of the solver's state, for archives (core/reflect.h), and the domains of its indices.
#pragma once
#include "core/reflect.h"
#include "solver/substep.h"

namespace catgut {

// The domain of an index in the state.
enum class IndexOf : uint8_t {
  particle,  // all columns: tissue, then thread
  tissue,    // particles of soft bodies
  slot,      // particles of all strands; the first is not 0
  cluster,   // of shape matching, padded as its columns are
  body,      // rigid: instruments, then needles
  instrument,
  triangle,  // of the tissue's surface
  strand,    // a suture's; so is its needle
  bite,      // belongs to a suture
  count_
};

constexpr void reflect(auto& a, Like<Vec4> auto& v) { a(v.x), a(v.y), a(v.z), a(v.w); }

constexpr void reflect(auto& a, Like<EmbeddedPoint> auto& t) {
  a.at_most(t.count, EmbeddedPoint::kMaxParticles);
  // Rows beyond count are unused and zero.
  for (uint32_t k = 0; k < EmbeddedPoint::kMaxParticles; ++k) a.index(t.particle[k], IndexOf::tissue);
  a(t.weight);
}

constexpr void reflect(auto& a, Like<RigidBody> auto& b) { a(b.x), a(b.q), a(b.v), a(b.omega), a(b.prev_x), a(b.prev_q); }

constexpr void reflect(auto& a, Like<Weld> auto& w) {
  a.index(w.a, IndexOf::body), a.index_or_none(w.b, IndexOf::body);
  a(w.local_a), a(w.local_b), a(w.target), a(w.compliance), a(w.angular_compliance), a(w.lambda), a(w.angular_lambda);
}

constexpr void reflect(auto& a, Like<Attachment> auto& t) {
  a(t.point), a.index_or_none(t.body, IndexOf::body), a(t.target), a(t.compliance);
  a.index(t.suture, IndexOf::strand), a(t.lambda);
}

constexpr void reflect(auto& a, Like<NeedleTrackConstraint> auto& c) {
  a(c.point), a(c.compliance), a(c.drag), a(c.at), a.index(c.suture, IndexOf::strand), a(c.hole), a(c.lambda), a(c.drag_lambda);
}

constexpr void reflect(auto& a, Like<Tether> auto& p) {
  a(p.a), a(p.b), a(p.length), a(p.compliance), a(p.lambda), a.at_most(p.owner, TetherOwner::passage);
  a.index(p.suture, IndexOf::strand);
}

constexpr void reflect(auto& a, Like<ThreadAnchor> auto& t) {
  a.index(t.slot, IndexOf::slot), a(t.point), a(t.offset), a(t.knotted), a(t.friction), a(t.capstan_friction), a(t.slipping);
  a(t.blocked_needle), a(t.blocked_free), a(t.tension_needle), a(t.tension_free);
}

constexpr void reflect(auto& a, Like<ThreadHold> auto& h) {
  a.index(h.slot, IndexOf::slot), a.index(h.body, IndexOf::body), a(h.local), a.at_most(h.kind, HoldKind::loop);
}

// load_state checks that a strand has its own slots, each once.
constexpr void reflect(auto& a, Like<Strand> auto& t) { a(t.order), a(t.rest), a(t.cut), a(t.anchor), a(t.hold), a(t.tension); }

constexpr void reflect(auto& a, Like<ClusterRotations> auto& r) {
  for (auto* each : {&r.x, &r.y, &r.z, &r.w}) a.column(*each, IndexOf::cluster);
}

constexpr void reflect(auto& a, Like<SolverState> auto& s) {
  a.column(s.x, IndexOf::particle), a.column(s.v, IndexOf::particle);
  a.column(s.pair_origin, IndexOf::tissue);
  a(s.rotation);
  a.column(s.body, IndexOf::body);
  a.column(s.strand, IndexOf::strand);
  a(s.weld), a(s.attach), a(s.pin), a(s.channel);
  a.column(s.body_collides, IndexOf::body), a.column(s.body_force, IndexOf::body);
}

}  // namespace catgut
