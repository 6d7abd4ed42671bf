// SPDX-License-Identifier: Apache-2.0
// solver/collide: reads positions, writes candidate lists. See the header for why they are reused.
#include "solver/collide.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

bool boxes_meet(Vec3 l0, Vec3 u0, Vec3 l1, Vec3 u1) {
  return l0.x <= u1.x && l1.x <= u0.x && l0.y <= u1.y && l1.y <= u0.y && l0.z <= u1.z && l1.z <= u0.z;
}
Vec3 least(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3 most(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
Vec3 all(float s) { return {s, s, s}; }

}  // namespace

int nearest_particle(const TissueCollision& tissue, const Candidates& c, const Vec4* x, Vec3 p, float reach) {
  constexpr float kOld = 0.002f;  // [m] boxes date from the start of the tick: more than tissue moves in one tick
  float best = reach * reach;
  int found = -1;
  for_blocks_near(c.tissue.boxes, p - all(reach + kOld), p + all(reach + kOld), [&](uint32_t b) {
    const uint32_t end = std::min(tissue.particles, (b + 1) * kBlock);
    for (uint32_t i = b * kBlock; i < end; ++i) {
      const float d = length2(xyz(x[i]) - p);
      if (d < best) best = d, found = static_cast<int>(i);
    }
  });
  return found;
}

std::pair<float, float> closest_on_segments(Vec3 a0, Vec3 a1, Vec3 b0, Vec3 b1) {
  // Ericson 5.1.9, with degenerate segments treated as points.
  const Vec3 d1 = a1 - a0, d2 = b1 - b0, r = a0 - b0;
  const float a = length2(d1), e = length2(d2), f = dot(d2, r);
  if (a < 1e-16f && e < 1e-16f) return {0.0f, 0.0f};
  if (a < 1e-16f) return {0.0f, std::clamp(f / e, 0.0f, 1.0f)};
  const float c = dot(d1, r);
  if (e < 1e-16f) return {std::clamp(-c / a, 0.0f, 1.0f), 0.0f};
  const float b = dot(d1, d2), denominator = a * e - b * b;
  float s = denominator > 1e-12f * a * e ? std::clamp((b * f - c * e) / denominator, 0.0f, 1.0f) : 0.0f;
  float t = (b * s + f) / e;
  if (t < 0) t = 0, s = std::clamp(-c / a, 0.0f, 1.0f);
  else if (t > 1) t = 1, s = std::clamp((b - c) / a, 0.0f, 1.0f);
  return {s, t};
}

namespace {

size_t segments_of(const Strand& s) { return s.order.size() < 2 ? 0 : s.order.size() - 1; }
uint32_t first_slot(const CollideView& v) { return v.strand_model.empty() ? 0 : v.strand_model[0].first_slot; }

// Collision flags of all strands, and the boxes of their runs.
void box_runs(const CollideView& v, Candidates& c) {
  c.run_low.clear(), c.run_high.clear(), c.run_first.clear();
  size_t slots = 0;
  for (const StrandModel& m : v.strand_model) slots += m.count;
  c.collides.resize(slots);
  for (size_t k = 0; k < v.strand.size(); ++k) {
    const Strand& strand = v.strand[k];
    const StrandModel& m = v.strand_model[k];
    collision_flags(m, strand, std::span(c.collides).subspan(m.first_slot - first_slot(v), m.count));
    c.run_first.push_back(static_cast<uint32_t>(c.run_low.size()));
    const size_t segments = segments_of(strand);
    for (size_t from = 0; from < segments; from += Candidates::kRun) {
      Vec3 low = xyz(v.x[strand.order[from]]), high = low;
      for (size_t i = from; i <= std::min(segments, from + Candidates::kRun); ++i) {
        const Vec3 p = xyz(v.x[strand.order[i]]);
        low = least(low, p), high = most(high, p);
      }
      c.run_low.push_back(low), c.run_high.push_back(high);
    }
  }
  c.run_first.push_back(static_cast<uint32_t>(c.run_low.size()));
}

bool collides(const CollideView& v, const Candidates& c, uint32_t slot) { return c.collides[slot - first_slot(v)] != 0; }
// Whether the segment after a node is there and collides.
bool segment_collides(const CollideView& v, const Candidates& c, const Strand& s, size_t node) {
  return !s.cut[node] && collides(v, c, s.order[node]) && collides(v, c, s.order[node + 1]);
}
// Calls do_it(node) for the segments of a strand's run.
template <typename F>
void for_run(const Candidates& c, const Strand& s, size_t strand, size_t run, const F& do_it) {
  const size_t from = (run - c.run_first[strand]) * Candidates::kRun, end = std::min(segments_of(s), from + Candidates::kRun);
  for (size_t i = from; i < end; ++i) do_it(i);
}

// A capsule p-q against the tissue's particles.
void find_tissue_near(const CollideView& v, uint32_t body, uint32_t capsule, Vec3 p, Vec3 q, float reach, Candidates& c) {
  for_blocks_near(c.tissue.boxes, least(p, q) - all(reach), most(p, q) + all(reach), [&](uint32_t block) {
    const uint32_t end = std::min(v.tissue.particles, (block + 1) * kBlock);
    for (uint32_t i = block * kBlock; i < end; ++i) {
      const Vec3 at = xyz(v.x[i]);
      if (length2(at - (p + (q - p) * closest_on_segment(at, p, q))) < reach * reach) c.tool.push_back({body, capsule, i});
    }
  });
}

// The same against the segments of all strands. `from`, `to`: a bounding box of all candidates.
void find_thread_near(const CollideView& v, uint32_t body, uint32_t capsule, Vec3 p, Vec3 q, Vec3 from, Vec3 to, float margin,
                      Candidates& c) {
  for (uint32_t k = 0; k < v.strand.size(); ++k) {
    const Strand& strand = v.strand[k];
    const float reach = v.model[body].capsule[capsule].radius + v.strand_model[k].radius + margin;
    for (uint32_t run = c.run_first[k]; run < c.run_first[k + 1]; ++run) {
      if (!boxes_meet(c.run_low[run], c.run_high[run], from, to)) continue;
      for_run(c, strand, k, run, [&](size_t i) {
        if (!segment_collides(v, c, strand, i)) return;
        const Vec3 a0 = xyz(v.x[strand.order[i]]), a1 = xyz(v.x[strand.order[i + 1]]);
        if (!boxes_meet(least(a0, a1), most(a0, a1), from, to)) return;
        const auto [s, t] = closest_on_segments(a0, a1, p, q);
        if (length2(lerp(a0, a1, s) - lerp(p, q, t)) < reach * reach)
          c.thread_tool.push_back({body, capsule, k, strand.order[i]});
      });
    }
  }
}

// Thread on tissue: one triangle each, the nearest of those around the nearest particle. Substeps use its plane.
void find_thread_on_tissue(const CollideView& v, float margin, Candidates& c) {
  const TissueCollision& tissue = v.tissue;
  const Vec4* x = v.x;
  const float reach = 0.004f + margin;
  for (uint32_t k = 0; k < v.strand.size(); ++k) {
    const Strand& strand = v.strand[k];
    uint32_t guess = tissue.particles;  // the nearest of the previous node: most boxes are then rejected at once
    for (uint32_t run = c.run_first[k]; run < c.run_first[k + 1]; ++run) {
      c.near_block.clear();
      for_blocks_near(c.tissue.boxes, c.run_low[run] - all(reach), c.run_high[run] + all(reach),
                      [&](uint32_t b) { c.near_block.push_back(b); });
      if (c.near_block.empty()) continue;
      for_run(c, strand, k, run, [&](size_t node) {
        const uint32_t slot = strand.order[node];
        if (!collides(v, c, slot)) return;
        const Vec3 p = xyz(x[slot]);
        float closest = reach * reach;
        uint32_t near = tissue.particles;
        if (guess < tissue.particles && length2(xyz(x[guess]) - p) < closest)
          closest = length2(xyz(x[guess]) - p), near = guess;
        for (uint32_t b : c.near_block) {
          if (distance_to_block2(c.tissue.boxes, b, p) > closest) continue;
          const uint32_t end = std::min(tissue.particles, (b + 1) * kBlock);
          for (uint32_t i = b * kBlock; i < end; ++i) {
            const float d = length2(xyz(x[i]) - p);
            if (d < closest) closest = d, near = i;
          }
        }
        guess = near;
        if (near == tissue.particles) return;
        float best = 1e30f;
        uint32_t found = 0;
        for (uint32_t f = tissue.ring_first[near]; f < tissue.ring_first[near + 1]; ++f) {
          const Triangle& t = tissue.surface[tissue.ring[f]];
          const float d = length2(closest_on_triangle(p, xyz(x[t[0]]), xyz(x[t[1]]), xyz(x[t[2]])).point - p);
          if (d < best) best = d, found = tissue.ring[f];
        }
        if (best < margin * margin) c.thread_tissue.push_back({k, slot, found});
      });
    }
  }
}

// Segments of strands a and b (a <= b), which may be the same.
void find_thread_on_thread(const CollideView& v, uint32_t a, uint32_t b, Candidates& c) {
  const Strand &sa = v.strand[a], &sb = v.strand[b];
  const StrandModel &ma = v.strand_model[a], &mb = v.strand_model[b];
  const float grow = ma.radius + mb.radius + 0.002f;
  // Distance of two segments >= that of their midpoints - half of both; a segment may be stretched to twice its spacing.
  const float far = grow + (ma.spacing + mb.spacing);
  const Vec3* const middle_a = c.middle.data() + (ma.first_slot - first_slot(v));
  const Vec3* const middle_b = c.middle.data() + (mb.first_slot - first_slot(v));
  for (uint32_t ra = c.run_first[a]; ra < c.run_first[a + 1]; ++ra)
    for (uint32_t rb = a == b ? ra : c.run_first[b]; rb < c.run_first[b + 1]; ++rb) {
      if (!boxes_meet(c.run_low[ra] - all(grow), c.run_high[ra] + all(grow), c.run_low[rb], c.run_high[rb])) continue;
      for_run(c, sa, a, ra, [&](size_t i) {
        const size_t from = (rb - c.run_first[b]) * Candidates::kRun;
        for (size_t j = a == b ? std::max(from, i + 4) : from; j < std::min(segments_of(sb), from + Candidates::kRun); ++j) {
          if (length2(middle_a[i] - middle_b[j]) > 4 * far * far) continue;
          if (!segment_collides(v, c, sa, i) || !segment_collides(v, c, sb, j)) continue;
          const Vec3 i0 = xyz(v.x[sa.order[i]]), i1 = xyz(v.x[sa.order[i + 1]]);
          const Vec3 j0 = xyz(v.x[sb.order[j]]), j1 = xyz(v.x[sb.order[j + 1]]);
          const auto [s, t] = closest_on_segments(i0, i1, j0, j1);
          if (length2(lerp(i0, i1, s) - lerp(j0, j1, t)) < grow * grow)
            c.thread_pair.push_back({a, sa.order[i], b, sb.order[j]});
        }
      });
    }
}

}  // namespace

void find_tool_candidates(const CollideView& v, float margin, Candidates& c) {
  c.tool.clear();
  for (uint32_t b = 0; b < v.body.size(); ++b)
    for (uint32_t k = 0; v.body_collides[b] && k < v.model[b].capsule.size(); ++k) {
      const Capsule& capsule = v.model[b].capsule[k];
      const Vec3 p = transform(v.body[b].pose(), capsule.a), q = transform(v.body[b].pose(), capsule.b);
      find_tissue_near(v, b, k, p, q, capsule.radius + v.tissue.tool_radius + margin, c);
    }
}

void find_tool_and_thread_candidates(const CollideView& v, float margin, Candidates& c) {
  find_tool_candidates(v, margin, c);
  c.thread_tool.clear();
  c.thread_tissue.clear();
  c.thread_pair.clear();
  box_runs(v, c);
  for (uint32_t b = 0; b < v.body.size(); ++b) {
    if (!v.body_collides[b]) continue;
    for (uint32_t k = 0; k < v.model[b].capsule.size(); ++k) {
      const Capsule& capsule = v.model[b].capsule[k];
      const Vec3 p = transform(v.body[b].pose(), capsule.a), q = transform(v.body[b].pose(), capsule.b);
      const float reach = capsule.radius + v.tissue.tool_radius + margin;
      find_thread_near(v, b, k, p, q, least(p, q) - all(reach), most(p, q) + all(reach), margin, c);
    }
  }
  find_thread_on_tissue(v, margin, c);
  c.middle.resize(c.collides.size());
  for (size_t k = 0; k < v.strand.size(); ++k) {
    const std::vector<uint32_t>& order = v.strand[k].order;
    Vec3* const middle = c.middle.data() + (v.strand_model[k].first_slot - first_slot(v));
    for (size_t i = 0; i + 1 < order.size(); ++i) middle[i] = xyz(v.x[order[i]]) + xyz(v.x[order[i + 1]]);  // twice
  }
  for (uint32_t a = 0; a < v.strand.size(); ++a)
    for (uint32_t b = a; b < v.strand.size(); ++b) find_thread_on_thread(v, a, b, c);
}

void find_tool_pairs(const std::vector<RigidModel>& model, const std::vector<RigidBody>& body,
                     std::span<const uint8_t> body_collides, std::vector<ToolPair>& pair) {
  // [m] two hands approaching each other at 1.5 m/s each, over a 60 Hz tick. At most four pairs exist, so a wide margin is
  // cheap, and hands are the fastest objects.
  constexpr float kMargin = 0.05f;
  pair.clear();
  for (uint32_t a = 0; a < body.size(); ++a)
    for (uint32_t b = a + 1; b < body.size(); ++b) {
      if (!body_collides[a] || !body_collides[b] || model[a].gravity || model[b].gravity) continue;
      const Pose pa = body[a].pose(), pb = body[b].pose();
      for (uint32_t i = 0; i < model[a].capsule.size(); ++i)
        for (uint32_t k = 0; k < model[b].capsule.size(); ++k) {
          const Capsule &ca = model[a].capsule[i], &cb = model[b].capsule[k];
          const Vec3 a0 = transform(pa, ca.a), a1 = transform(pa, ca.b), b0 = transform(pb, cb.a), b1 = transform(pb, cb.b);
          const auto [s, t] = closest_on_segments(a0, a1, b0, b1);
          const float reach = ca.radius + cb.radius + kMargin;
          if (length2(lerp(b0, b1, t) - lerp(a0, a1, s)) < reach * reach) pair.push_back({a, b, i, k, {}});
        }
    }
}

}  // namespace catgut
