// solver/collide: reads positions, writes candidate lists. See the header for why they are reused.
#include "solver/collide.h"

#include <algorithm>
#include <array>
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
  constexpr float kOld = 0.002f;  // [m] boxes are of the start of the tick: more than tissue moves in one
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

void find_tool_and_thread_candidates(const TissueCollision& tissue, const Vec4* x, const ThreadModel& thread_model,
                                     const Thread& thread, std::span<const uint8_t> thread_collides,
                                     const std::vector<RigidModel>& model, const std::vector<RigidBody>& body,
                                     std::span<const uint8_t> body_collides, float margin, Candidates& c) {
  c.tool.clear();
  c.thread_tool.clear();
  c.thread_tissue.clear();
  c.thread_pair.clear();
  const size_t segments = thread.order.size() < 2 ? 0 : thread.order.size() - 1;
  auto collides = [&](uint32_t slot) { return thread_collides[slot - thread_model.first_slot] != 0; };

  // Runs of eight segments in boxes: most of a thread is far from everything.
  constexpr size_t kRun = 8, kMostRuns = 1024;
  const size_t runs = std::min(kMostRuns, (segments + kRun - 1) / kRun);
  std::array<Vec3, kMostRuns> lo, hi;
  for (size_t r = 0; r < runs; ++r) {
    lo[r] = hi[r] = xyz(x[thread.order[r * kRun]]);
    for (size_t i = r * kRun; i <= std::min(segments, (r + 1) * kRun); ++i)
      lo[r] = least(lo[r], xyz(x[thread.order[i]])), hi[r] = most(hi[r], xyz(x[thread.order[i]]));
  }

  for (uint32_t b = 0; b < body.size(); ++b) {
    if (!body_collides[b]) continue;
    for (uint32_t k = 0; k < model[b].capsule.size(); ++k) {
      const Capsule& capsule = model[b].capsule[k];
      const Vec3 p = transform(body[b].pose(), capsule.a), q = transform(body[b].pose(), capsule.b);
      const float reach = capsule.radius + tissue.tool_radius + margin;
      const Vec3 from = least(p, q) - all(reach), to = most(p, q) + all(reach);
      for_blocks_near(c.tissue.boxes, from, to, [&](uint32_t blk) {
        const uint32_t end = std::min(tissue.particles, (blk + 1) * kBlock);
        for (uint32_t i = blk * kBlock; i < end; ++i) {
          const Vec3 at = xyz(x[i]), d = q - p;
          const float t = std::clamp(dot(at - p, d) / std::max(length2(d), 1e-16f), 0.0f, 1.0f);
          if (length2(at - (p + d * t)) < reach * reach) c.tool.push_back({b, k, i});
        }
      });
      const float thread_reach = capsule.radius + thread_model.radius + margin;
      for (size_t r = 0; r < runs; ++r) {
        if (!boxes_meet(lo[r], hi[r], from, to)) continue;
        for (size_t i = r * kRun; i < std::min(segments, (r + 1) * kRun); ++i) {
          const uint32_t s0 = thread.order[i], s1 = thread.order[i + 1];
          if (thread.cut[i] || !collides(s0) || !collides(s1)) continue;
          const Vec3 a0 = xyz(x[s0]), a1 = xyz(x[s1]);
          if (!boxes_meet(least(a0, a1), most(a0, a1), from, to)) continue;
          const auto [s, t] = closest_on_segments(a0, a1, p, q);
          if (length2(lerp(a0, a1, s) - lerp(p, q, t)) < thread_reach * thread_reach) c.thread_tool.push_back({b, k, s0});
        }
      }
    }
  }

  // Thread on tissue: one triangle each, the nearest of those around the nearest particle; the substeps use its plane.
  const float reach = 0.004f + margin;
  uint32_t guess = tissue.particles;  // the nearest of the node before: with it most boxes are too far at once
  for (size_t r = 0; r < runs; ++r) {
    c.near_block.clear();
    for_blocks_near(c.tissue.boxes, lo[r] - all(reach), hi[r] + all(reach), [&](uint32_t b) { c.near_block.push_back(b); });
    if (c.near_block.empty()) continue;
    for (size_t k = r * kRun; k < std::min(segments, (r + 1) * kRun); ++k) {
      const uint32_t slot = thread.order[k];
      if (!collides(slot)) continue;
      const Vec3 p = xyz(x[slot]);
      float closest = reach * reach;
      uint32_t near = tissue.particles;
      if (guess < tissue.particles && length2(xyz(x[guess]) - p) < closest) closest = length2(xyz(x[guess]) - p), near = guess;
      for (uint32_t b : c.near_block) {
        if (distance_to_block2(c.tissue.boxes, b, p) > closest) continue;
        const uint32_t end = std::min(tissue.particles, (b + 1) * kBlock);
        for (uint32_t i = b * kBlock; i < end; ++i) {
          const float d = length2(xyz(x[i]) - p);
          if (d < closest) closest = d, near = i;
        }
      }
      guess = near;
      if (near == tissue.particles) continue;
      float best = 1e30f;
      uint32_t found = 0;
      for (uint32_t f = tissue.ring_first[near]; f < tissue.ring_first[near + 1]; ++f) {
        const Triangle& t = tissue.surface[tissue.ring[f]];
        const float d = length2(closest_on_triangle(p, xyz(x[t[0]]), xyz(x[t[1]]), xyz(x[t[2]])).point - p);
        if (d < best) best = d, found = tissue.ring[f];
      }
      if (best < margin * margin) c.thread_tissue.push_back({slot, found});
    }
  }

  const float grow = 2 * thread_model.radius + 0.002f;
  // Two segments cannot be nearer than their middles less half of both; a segment may be stretched to twice its spacing.
  const float far = grow + 2 * thread_model.spacing;
  c.middle.resize(segments);
  for (size_t i = 0; i < segments; ++i) c.middle[i] = xyz(x[thread.order[i]]) + xyz(x[thread.order[i + 1]]);  // twice
  for (size_t ra = 0; ra < runs; ++ra)
    for (size_t rb = ra; rb < runs; ++rb) {
      if (!boxes_meet(lo[ra] - all(grow), hi[ra] + all(grow), lo[rb], hi[rb])) continue;
      for (size_t i = ra * kRun; i < std::min(segments, (ra + 1) * kRun); ++i)
        for (size_t j = std::max(rb * kRun, i + 4); j < std::min(segments, (rb + 1) * kRun); ++j) {
          if (length2(c.middle[i] - c.middle[j]) > 4 * far * far) continue;
          const uint32_t i0 = thread.order[i], i1 = thread.order[i + 1], j0 = thread.order[j], j1 = thread.order[j + 1];
          if (thread.cut[i] || thread.cut[j] || !collides(i0) || !collides(i1) || !collides(j0) || !collides(j1)) continue;
          const auto [s, t] = closest_on_segments(xyz(x[i0]), xyz(x[i1]), xyz(x[j0]), xyz(x[j1]));
          if (length2(lerp(xyz(x[i0]), xyz(x[i1]), s) - lerp(xyz(x[j0]), xyz(x[j1]), t)) < grow * grow)
            c.thread_pair.push_back({i0, j0});
        }
    }
}

void find_tool_pairs(const std::vector<RigidModel>& model, const std::vector<RigidBody>& body,
                     std::span<const uint8_t> body_collides, std::vector<ToolPair>& pair) {
  // [m] two hands that rush at each other with 1.5 m/s each, for a tick of 60 Hz. There are four pairs at most: a wide margin
  // is cheap, and hands are the fastest things there are.
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
