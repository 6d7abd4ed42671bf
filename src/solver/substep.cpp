// SPDX-License-Identifier: Apache-2.0
// solver/substep: reads the model; moves every particle and body of the state. Section 2.1 of the paper, with its order:
// predict, shape (and volume), tissue contact, attachments and bodies, contacts of tools and thread, the thread itself,
// velocities. The thread is last, so that rendering and haptics see a thread of the correct length.
#include "solver/substep.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

// Items per block of a stage: constant, never a function of the number of workers. Per-particle work is split by groups of the
// shape, so that a worker finds its data of the previous stage in its cache.
constexpr size_t kParticleBlock = 256, kGroupBlock = 32, kClusterBlock = 32;
constexpr float kTopSpeed = 5.0f;  // [m/s] of a particle; above any tissue speed by hand

void clear_multipliers(SolverState& state, SolverScratch& scratch) {
  for (Weld& w : state.weld) w.lambda = w.angular_lambda = {};
  for (Attachment& a : state.attach) a.lambda = {};
  for (NeedleTrackConstraint& c : state.channel) c.lambda = {}, c.drag_lambda = 0;
  std::fill(scratch.volume_lambda.begin(), scratch.volume_lambda.end(), 0.0f);
  std::fill(scratch.shape.moved.begin(), scratch.shape.moved.end(), Vec4{});
  std::fill(scratch.on_body.begin(), scratch.on_body.end(), BodyContact{});
  for (ToolPair& p : scratch.candidates.tool_pair) p.done = {};
  for (ThreadScratch& t : scratch.thread) std::fill(t.lambda.begin(), t.lambda.end(), 0.0f);
}

// Reserves memory for everything a tick may find, so that no tick allocates. Uses bounds where they exist (a capsule is near at
// most all particles), otherwise several times the largest count observed. Beyond that, vectors grow. Unused pages are never
// committed.
void reserve_room(const SolverModel& m, SolverScratch& k) {
  constexpr size_t kPairsOfOne = 32, kBlocksNear = 256, kPins = 256, kPinsBeside = 32;
  const size_t tissue = m.collision.particles, thread = m.count - m.tissue;
  size_t capsules = 0;
  for (const RigidModel& b : m.body) capsules += b.capsule.size();
  Candidates& c = k.candidates;
  c.tool.reserve(tissue * capsules);
  c.thread_tool.reserve(thread * capsules);
  c.thread_tissue.reserve(thread);
  c.thread_pair.reserve(thread * std::min(thread, 2 * kPairsOfOne));
  c.near_block.reserve(tissue / kBlock + 1);
  c.middle.reserve(thread);
  c.collides.reserve(thread);
  for (std::vector<Vec3>* box : {&c.run_low, &c.run_high}) box->reserve(thread / Candidates::kRun + m.strand.size());
  c.run_first.reserve(m.strand.size() + 1);
  PairSearch& p = c.tissue;
  const size_t blocks = (tissue + kBlock - 1) / kBlock, groups = (blocks + kBlock - 1) / kBlock;
  p.pair.reserve(tissue * kPairsOfOne);
  for (Column<float>* column : {&p.at[0], &p.at[1], &p.at[2], &p.radius}) column->reserve(blocks * kBlock);
  for (BlockBoxes* boxes : {&p.boxes, &p.built, &p.swept}) boxes->block.resize(blocks), boxes->group.resize(groups);
  p.of_block.resize(blocks);
  for (std::vector<PairCandidate>& pair : p.of_block) pair.reserve(kBlock * kPairsOfOne);
  p.part.resize(groups);
  for (PairSearch::Part& part : p.part) {
    part.near.reserve(std::min(blocks, kBlocksNear));
    part.near_box.resize(std::min(blocks, kBlocksNear));
  }
  for (size_t s = 0; s < m.strand.size(); ++s) {
    ThreadScratch& t = k.thread[s];
    const size_t nodes = m.strand[s].count;
    t.constrained.reserve(nodes);
    t.slide.reserve(nodes);  // anchors, at most one per particle
    t.waiting.reserve(nodes);
    t.anchor_node.reserve(nodes);
    t.touch.reserve(nodes * capsules);
    t.contact.reserve(nodes);
    t.on_tool.reserve(m.body.size());
    t.load.reserve(m.body.size());
  }
  TetherGraph& w = k.web;
  w.row.reserve(kPins + 1);
  w.point.reserve(2 * kPins);
  w.first.reserve(kPins + 1);
  w.strand.reserve(kPins * kPinsBeside);
  for (std::vector<uint32_t>* each : {&w.active, &w.slack, &w.before}) each->reserve(kPins);
  for (std::vector<uint32_t>* part : {&w.particle, &w.on}) part->reserve(2 * EmbeddedPoint::kMaxParticles * kPins);
  for (std::vector<float>* part : {&w.share, &w.move, &w.weight}) part->reserve(2 * EmbeddedPoint::kMaxParticles * kPins);
  w.start.reserve(m.tissue + 2);
  w.listed.reserve(kPins);
  for (std::vector<float>* each : {&w.length, &w.compliance, &w.by_active}) each->reserve(kPins);
  k.pin_span.reserve(kPins);
}

void predict_particles(const SolverModel& m, SolverState& s, SolverScratch& k, Vec3 gravity, size_t first, size_t last) {
  const Four gh = load({gravity.x * m.h, gravity.y * m.h, gravity.z * m.h, 0});
  for (size_t i = first; i < last; ++i) {
    k.prev[i] = s.x[i];
    if (m.inv_mass[i] == 0) continue;
    Four v = load(s.v[i]) + gh;
    const Four v2 = v * v;
    const float speed2 = v2[0] + v2[1] + v2[2];
    if (speed2 > kTopSpeed * kTopSpeed) v *= kTopSpeed / std::sqrt(speed2);
    store(s.x[i], load(s.x[i]) + v * m.h);
  }
}

void update_velocities(const SolverModel& m, SolverState& s, const SolverScratch& k, float damping, size_t first, size_t last) {
  const float keep = 1.0f / m.h / (1 + damping * m.h);
  for (size_t i = first; i < last; ++i) store(s.v[i], (load(s.x[i]) - load(k.prev[i])) * keep);
}

// Maximum displacement of tissue since its pairs were found, for the particles of groups [first, last).
void note_moves(const SolverModel& m, const SolverState& s, SolverScratch& k, size_t first, size_t last) {
  PairSearch& search = k.candidates.tissue;
  const uint32_t from = m.shape.group_first[first], to = m.shape.group_first[last];
  search.moved[first / kGroupBlock] = furthest_move(&s.x[from], &s.pair_origin[from], to - from);
}

}  // namespace

float stiffness_at(float stiffness, float h_reference, float h) {
  if (stiffness >= 1) return 1;
  if (stiffness <= 0) return 0;
  const float alpha_over_w = (1 - stiffness) / stiffness * h_reference * h_reference;
  return 1.0f / (1.0f + alpha_over_w / (h * h));
}

SolverState make_solver_state(const SolverModel& model, std::span<const Vec3> position) {
  SolverState s;
  s.x.resize(model.count);
  s.v.resize(model.count);
  for (uint32_t i = 0; i < model.count; ++i) s.x[i] = point(position[i]);
  s.pair_origin.assign(s.x.begin(), s.x.begin() + model.tissue);
  s.rotation.reset(model.shape.clusters);
  s.body.resize(model.body.size());
  s.body_collides.assign(model.body.size(), 1);
  s.body_force.assign(model.body.size(), {});
  s.strand.resize(model.strand.size());
  for (size_t k = 0; k < s.strand.size(); ++k) reset(model.strand[k], s.strand[k]);
  return s;
}

void prepare_scratch(const SolverModel& model, SolverScratch& k) {
  k.prev.assign(model.count, Vec4{});
  k.shape.resize(model.shape);
  k.volume_lambda.assign(model.volume.tet.size(), 0.0f);
  k.thread.resize(model.strand.size());
  for (size_t s = 0; s < k.thread.size(); ++s) k.thread[s].resize(model.strand[s].count);
  k.candidates = {};
  k.candidates.tissue.moved.assign((model.shape.groups + kGroupBlock - 1) / kGroupBlock, 0.0f);
  k.candidates.tool_pair.reserve(16);  // no allocation when two tools approach
  k.on_body.assign(model.body.size(), {});
  k.node_of_slot.assign(model.count - model.tissue, -1);
  k.locked.assign(model.count - model.tissue, 0);
  reserve_room(model, k);
}

void find_boxes(const SolverModel& m, const SolverState& s, SolverScratch& k, Jobs& jobs, StageTimes* times) {
  StageTimer timer(times, Stage::broadphase);
  make_boxes(m.collision, s.x.data(), k.candidates.tissue.boxes, jobs);
}

void find_candidates(const SolverModel& m, const SolverState& s, SolverScratch& k, float margin, StageTimes* times) {
  {
    StageTimer timer(times, Stage::attach);
    build_graph(s.pin, m.inv_mass.data(), m.tissue, k.web);
  }
  StageTimer timer(times, Stage::broadphase);
  find_tool_and_thread_candidates({m.collision, s.x.data(), m.strand, s.strand, m.body, s.body, s.body_collides}, margin,
                                  k.candidates);
  find_tool_pairs(m.body, s.body, s.body_collides, k.candidates.tool_pair);
}

void find_tool_candidates(const SolverModel& m, const SolverState& s, SolverScratch& k, float margin, StageTimes* times) {
  StageTimer timer(times, Stage::broadphase);
  find_tool_candidates({m.collision, s.x.data(), m.strand, s.strand, m.body, s.body, s.body_collides}, margin, k.candidates);
  find_tool_pairs(m.body, s.body, s.body_collides, k.candidates.tool_pair);
}

void substep(const SolverModel& m, SolverState& s, SolverScratch& k, Jobs& jobs, StageTimes* times) {
  Vec4* x = s.x.data();
  const float* w = m.inv_mass.data();
  const float h = m.h;

  clear_multipliers(s, k);
  {
    StageTimer timer(times, Stage::predict);
    predict_particles(m, s, k, m.gravity, m.tissue, m.count);
    jobs.each(m.shape.groups, kGroupBlock, [&](size_t first, size_t last) {
      predict_particles(m, s, k, m.tissue_gravity, m.shape.group_first[first], m.shape.group_first[last]);
      make_shape_rows(m.shape, x, k.shape, static_cast<uint32_t>(first), static_cast<uint32_t>(last));
    });
    for (size_t b = 0; b < s.body.size(); ++b) {
      if (length2(s.body_force[b]) > 0) s.body[b].v += s.body_force[b] * (m.body[b].inv_mass * h);
      predict(m.body[b], s.body[b], m.gravity, h);
    }
  }
  {
    StageTimer timer(times, Stage::shape);
    for (int sweep = 0; sweep < m.shape_sweeps; ++sweep) {
      jobs.each(m.shape.clusters, kClusterBlock, [&](size_t first, size_t last) {
        solve_shape_clusters(m.shape, s.rotation, k.shape, static_cast<uint32_t>(first), static_cast<uint32_t>(last));
      });
      jobs.each(m.shape.groups, kGroupBlock, [&](size_t first, size_t last) {
        solve_shape_particles(m.shape, x, w, m.shape_stiffness, m.shape_relaxation, k.shape, static_cast<uint32_t>(first),
                              static_cast<uint32_t>(last), sweep + 1 < m.shape_sweeps);
        if (sweep + 1 == m.shape_sweeps && !m.use_volume) note_moves(m, s, k, first, last);
      });
    }
  }
  if (m.use_volume) {
    StageTimer timer(times, Stage::volume);
    for (int sweep = 0; sweep < m.volume_sweeps; ++sweep) {
      uint32_t start = 0;
      for (const uint32_t end : m.volume.color_end) {
        jobs.each(end - start, kParticleBlock, [&](size_t first, size_t last) {
          solve_volume(m.volume, x, w, m.volume_compliance, h, k.volume_lambda.data(), start + static_cast<uint32_t>(first),
                       start + static_cast<uint32_t>(last));
        });
        start = end;
      }
    }
    jobs.each(m.shape.groups, kGroupBlock, [&](size_t first, size_t last) { note_moves(m, s, k, first, last); });
  }
  const ContactView view{
      x, k.prev.data(), w, &m.body, &s.body, &k.on_body, m.tissue, s.strand, m.strand, k.node_of_slot.data(), k.locked.data()};
  uint32_t touching = 0;
  {
    StageTimer timer(times, Stage::broadphase);
    PairSearch& search = k.candidates.tissue;
    if (!search.filled) list_tissue_pairs(m.collision, s.pair_origin, search, jobs);
    if (pairs_are_stale(m.collision, search)) find_tissue_pairs(m.collision, x, s.pair_origin, search, jobs);
  }
  {
    StageTimer timer(times, Stage::self_contact);
    for (int sweep = 0; sweep < m.self_sweeps; ++sweep) {
      const uint32_t n = solve_tissue_pairs(view, m.collision, k.candidates.tissue.pair, m.friction.tissue);
      if (sweep == 0) touching += n;
      if (n == 0) break;
    }
  }
  {
    StageTimer timer(times, Stage::attach);
    for (Attachment& a : s.attach) solve_attachment(a, x, w, m.body, s.body, h);
    solve_tethers(s.pin, k.web, x, h, m.pin_sweeps, m.pin_tolerance, k.pin_span);
  }
  {
    // Few, stiff and opposed to each other (hand, grasp, track, tool against tool): they get sweeps of their own.
    StageTimer timer(times, Stage::rigid);
    for (NeedleTrackConstraint& c : s.channel) {
      const RigidBody& needle = s.body[m.needle_body(c.suture)];
      const Vec3 at = position_of(c.point, k.prev.data()) - needle.prev_x;
      c.at = m.needle_arc[c.suture].nearest(rotate(conjugate(needle.prev_q), at));
    }
    int sweeps = s.channel.empty() ? 1 : m.rigid_sweeps;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (NeedleTrackConstraint& c : s.channel) {
        const uint32_t needle = m.needle_body(c.suture);
        solve_needle_track(c, m.needle_arc[c.suture], x, w, m.body[needle], s.body[needle], h);
      }
      for (Weld& weld : s.weld) solve_weld(m.body, s.body, weld, h);
      const uint32_t n = solve_tools_on_tools(view, k.candidates.tool_pair, m.friction.tool, m.tool_force * h * h);
      if (n > 0) sweeps = m.rigid_sweeps;
      if (sweep == 0) touching += n;
    }
  }
  {
    StageTimer timer(times, Stage::thread_contact);
    std::fill(k.node_of_slot.begin(), k.node_of_slot.end(), -1);
    std::fill(k.locked.begin(), k.locked.end(), uint8_t{0});
    for (const Strand& strand : s.strand) {
      for (size_t i = 0; i < strand.order.size(); ++i) k.node_of_slot[strand.order[i] - m.tissue] = static_cast<int32_t>(i);
      for (const ThreadAnchor& a : strand.anchor) k.locked[a.slot - m.tissue] = 1;
      for (const ThreadHold& a : strand.hold) k.locked[a.slot - m.tissue] = 1;
    }
  }
  for (int sweep = 0; sweep < m.contact_sweeps; ++sweep) {
    uint32_t n = 0;
    {
      StageTimer timer(times, Stage::tool_contact);
      n += solve_tools_on_tissue(view, m.collision, k.candidates.tool, m.friction.tool);
    }
    {
      StageTimer timer(times, Stage::thread_contact);
      n += solve_thread_on_tools(view, k.candidates.thread_tool, m.friction.thread, m.ground);
      n += solve_thread_on_tissue(view, m.collision, k.candidates.thread_tissue, m.friction.thread);
      n += solve_thread_on_thread(view, k.candidates.thread_pair, m.friction.thread);
      n += solve_ground(view, s.body_force, m.ground, m.friction.tissue);
    }
    if (sweep == 0) touching += n;
    if (n == 0) break;
  }
  {
    StageTimer timer(times, Stage::thread_contact);
    for (ThreadScratch& t : k.thread) t.touch.clear(), t.touch_friction = m.friction.thread;
    find_thread_touch(view, k.candidates.thread_tool, m.ground, k.thread);
  }
  {
    StageTimer timer(times, Stage::thread);
    for (size_t i = 0; i < s.strand.size(); ++i) {
      ThreadScratch& t = k.thread[i];
      solve_thread(m.strand[i], s.strand[i], t, x, k.prev.data(), w, m.body, s.body, h);
      for (const NodeContact& c : t.contact) touching += c.active;
      for (size_t b = 0; b < t.on_tool.size(); ++b) {
        k.on_body[b].linear += t.on_tool[b].linear;
        k.on_body[b].angular += t.on_tool[b].angular;
      }
    }
  }
  {
    StageTimer timer(times, Stage::velocity);
    update_velocities(m, s, k, m.thread_damping, m.tissue, m.count);
    jobs.each(m.shape.groups, kGroupBlock, [&](size_t first, size_t last) {
      update_velocities(m, s, k, m.damping, m.shape.group_first[first], m.shape.group_first[last]);
    });
    for (size_t b = 0; b < s.body.size(); ++b) update_velocity(m.body[b], s.body[b], h, m.body_damping);
  }
  k.contacts = touching;
  if (times) times->contacts = std::max(times->contacts, touching);
}

}  // namespace catgut
