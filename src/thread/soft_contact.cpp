// SPDX-License-Identifier: Apache-2.0
// thread/soft_contact: nodes against the surface of something soft. The caller reports once per step where a node's
// nearest point and plane are; in every substep the node stays on its side of that plane, which moves with the point, and the
// soft thing takes the opposite impulse. Friction, warm start and drift as in thread/contact.
#include <algorithm>
#include <cmath>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

constexpr float kPushOut = 0.2f;   // [m/s]
constexpr float kDeep = 0.15e-3f;  // [m] inside, where a node comes that was in no contact
constexpr float kDeepPress = 2;    // [N] then, at most
constexpr float kSlid = 0.15e-3f;  // [m] past its plane's foot, beyond which a node gets another plane: half a thread

Four motion(const Scratch& s, const Scratch::SoftActive& c) {
  return Four{s.u.x[c.node], s.u.y[c.node], s.u.z[c.node], 0} - four(s.soft_moved.at(c.point) - s.soft_before.at(c.point));
}
void apply(Scratch& s, SoftPoints& soft, const Scratch::SoftActive& c, Four impulse, float substep) {
  s.u.add(c.node, three(impulse) * s.w[c.node]);
  push_soft(s, soft, c.point, three(impulse) * -1.0f, substep);
}

}  // namespace

void begin_soft_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  s.soft_active.clear();
  if (!around.soft) return;
  const SoftPoints& soft = *around.soft;
  const size_t n = s.soft_points;
  for (uint32_t k = 0; k < around.soft_contacts.size(); ++k) {
    SoftContact& c = around.soft_contacts[k];
    const Vec3 place =
        (state.x.at(c.node) - soft.at[c.point]) + state.fine.at(c.node) + (s.u.at(c.node) - s.soft_moved.at(c.point));
    if (around.soft_surface.find && length2(place - s.soft_seen[k]) > kSlid * kSlid) {
      around.soft_surface.find(around.soft_surface.context, around.soft_contacts, k, soft.at[c.point] + place);
      s.soft_seen[k] = place;
    }
    const Vec3 from = ((state.x.at(c.node) - soft.at[c.point]) - c.offset + state.fine.at(c.node)) +
                      (s.u.at(c.node) - s.soft_moved.at(c.point));
    const float gap = dot(c.normal, from) - 0.5f * settings.material.diameter;
    if (gap > kReady * settings.material.diameter || c.normal == Vec3{}) {
      c.normal_impulse = 0, c.friction_impulse = {}, c.drift = {}, c.gap = gap;
      continue;
    }
    Scratch::SoftActive a;
    float w = soft.w[size_t{c.point} * n + c.point];
    for (uint32_t t = soft.tilt_first[c.point]; t < soft.tilt_first[c.point + 1]; ++t)
      if (soft.tilt[t].other == c.point) w += soft.tilt[t].value;
    a.inverse = 1 / (s.w[c.node] + s.soft_answer * w);
    a.normal = four(c.normal), a.mu = c.friction, a.node = c.node, a.point = c.point, a.contact = k;
    a.pull_back = four(settings.anchor * c.drift);
    // A node that was inside before the substep comes out at a limited speed.
    const float before = gap - dot(a.normal, motion(s, a)), target = std::min(0.0f, before + kPushOut * settings.substep);
    a.level = before - target, a.before = before;
    // Thread in a bite that tore out lies within the wall, and both faces would push it out.
    const float gentle = kDeepPress * settings.substep * settings.substep;
    if (before < -kDeep && c.normal_impulse <= gentle) a.most = gentle;
    a.ln = c.normal_impulse, a.lt = four(tangential(c.friction_impulse, c.normal));
    s.soft_active.push_back(a);
  }
  for (const Scratch::SoftActive& a : s.soft_active) apply(s, *around.soft, a, a.normal * a.ln + a.lt, settings.substep);
}

void see_soft_contacts(const State& state, Scratch& s, const Surroundings& around) {
  if (!around.soft) return;
  s.soft_seen.resize(around.soft_contacts.size());
  for (size_t k = 0; k < s.soft_seen.size(); ++k) {
    const SoftContact& c = around.soft_contacts[k];
    s.soft_seen[k] = (state.x.at(c.node) - around.soft->at[c.point]) + state.fine.at(c.node);
  }
}

void begin_carrying(const Settings& settings, Scratch& s, const Surroundings& around, float limit) {
  s.carried.clear();
  const auto carry = [&](uint32_t node, Vec3 by) {
    if (length2(s.u.at(node)) <= limit * limit) return;
    for (const Scratch::Carried& c : s.carried)
      if (c.node == node) return;
    s.carried.push_back({node, by});
    s.u.add(node, -by);
  };
  // What the thread itself does to the wall within the step does not count: between a tool and the wall they would throw each
  // other.
  for (const Scratch::SoftActive& a : s.soft_active)
    if (a.ln > 0) carry(a.node, around.soft->speed[a.point] * settings.substep);
  for (const Active& a : s.active())
    if (a.ln > 0 && a.i == a.j) carry(a.i, three(a.partner)), carry(a.i + 1, three(a.partner));
}

void end_carrying(Scratch& s) {
  for (const Scratch::Carried& c : s.carried) s.u.add(c.node, c.by), s.move[c.node] = length(s.u.at(c.node));
}

void sweep_soft_contacts(Scratch& s, SoftPoints& soft, float substep, bool backward) {
  const size_t count = s.soft_active.size();
  for (size_t k = 0; k < count; ++k) {
    Scratch::SoftActive& c = s.soft_active[backward ? count - 1 - k : k];
    const Four change = correct(c, motion(s, c));
    if (change[0] == 0 && change[1] == 0 && change[2] == 0) continue;
    apply(s, soft, c, change, substep);
  }
}

void end_soft_contacts(const Settings& settings, State&, Scratch& s, Surroundings& around) {
  for (const Scratch::SoftActive& a : s.soft_active) {
    SoftContact& c = around.soft_contacts[a.contact];
    const Vec3 went = three(motion(s, a)), moved = tangential(went, c.normal);
    if (a.ln > 0) s.touched[a.node] |= kOnOther;
    c.gap = dot(c.normal, went) + a.before;
    c.normal_impulse = a.ln, c.friction_impulse = three(a.lt);
    c.drift = new_drift(settings, a, c.drift, moved);
  }
}

}  // namespace catgut::thread
