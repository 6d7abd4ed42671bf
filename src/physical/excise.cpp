// SPDX-License-Identifier: Apache-2.0
// physical/excise: see the header.
#include "physical/excise.h"

#include <algorithm>
#include <cmath>

#include "physical/near_faces.h"

namespace catgut::physical {
namespace {

constexpr float kApart = 0.25e-3f;      // [m] between points of the path
constexpr size_t kRecent = 12;          // points behind the tip that it does not fall back to
constexpr float kSmoothing = 0.25e-3f;  // [m] length over which the tip's direction is averaged, against tremor

bool is_quad(const wall::Model& m, uint32_t face) { return m.mesh.face[face][3] != wall::kNone; }

void reserve(const wall::Model& m, Excision& e) {
  if (!e.passed.empty()) return;
  e.passed.assign(m.lane_of_face.size(), {}), e.burnt.assign(m.lane_of_face.size(), {});
  e.groove.reserve(kMaxGroove), e.path.reserve(kMaxTipPath), e.bleed.reserve(kMaxBleed),
      e.heat.warm.reserve(m.lane_of_face.size());
}

void char_around(const wall::Model& m, Excision& e, uint32_t face, Vec3 tip, float width, float part) {
  std::array<uint32_t, 40> near;
  const size_t count = near_faces(m, face, near);
  for (size_t i = 0; i < count; ++i) {
    if (is_beyond(m, near[i], tip, 3 * width)) continue;
    const bool quad = is_quad(m, near[i]);
    const wall::Raster& r = wall::raster(quad);
    for (uint32_t c = 0; c < wall::kCells; ++c) {
      wall::Point p{near[i], 0, 0, 0};
      wall::to_natural(quad, r.center[c], p.xi, p.eta);
      const float d2 = length2(wall::rest_place(m, p) - tip) / (width * width);
      if (d2 > 9) continue;
      float& b = e.burnt[near[i]][c];
      b += (portable::exp(-d2) - b) * (portable::exp(-d2) > b ? part : 0.0f);
    }
  }
}

}  // namespace

Foot nearest_foot(const Model& m, const State& s, Vec3 tip, float reach) {
  const Surface& surface = surface_of(m, s);
  const wall::Topology& t = s.wall.topology;
  Foot best;
  best.gap = 1e9f;
  for (uint32_t e = 0; e + 1 < surface.first_of_face.size(); ++e) {
    if (surface.first_of_face[e] == surface.first_of_face[e + 1]) continue;
    const uint32_t lane = wall::lane_of_element(m.wall, t, e), block = lane / wall::kLanesOfBlock,
                   in = lane % wall::kLanesOfBlock;
    Vec3 center{};
    for (const auto& column : t.corners[block].column) center += wall::vec3(s.wall.motion.x[2 * column[in]]) * 0.25f;
    float far2 = 0;
    for (const auto& column : t.corners[block].column)
      far2 = std::max(far2, length2(wall::vec3(s.wall.motion.x[2 * column[in]]) - center));
    const float r = std::sqrt(far2) + m.wall.laminate.thickness + reach;
    if (length2(tip - center) > r * r) continue;
    for (uint32_t q = surface.first_of_face[e]; q < surface.first_of_face[e + 1]; ++q) {
      const Patch& patch = surface.patch[q];
      if (patch.part && patch_box(m.wall, s.wall, patch).to_box(tip) > best.gap) continue;
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, tip);
      // A tip that has sunk into its own groove is still on the face that it came from.
      const float far = distance(foot.at, tip);
      if (far < best.gap) best = foot, best.gap = far;
    }
  }
  return best;
}

PenStep use_pen(const ExciseModel& law, const Model& m, State& s, Scratch& k, Excision& e, const Pen& pen, float h) {
  PenStep out;
  if (!(pen.power > 0)) return e.touching = false, out;
  const Foot foot = nearest_foot(m, s, pen.tip, law.reach);
  if (foot.gap > law.reach) return e.touching = false, out;
  reserve(m.wall, e);
  const bool outer = foot.point.zeta >= 0;
  wall::Point now = foot.point;
  now.zeta = outer ? 1.0f : -1.0f;
  const Vec3 place = wall::rest_place(m.wall, now), heading = e.touching ? place - e.trail : Vec3{};
  Vec3 tip = place;

  // An older groove takes the tip.
  const size_t recent = e.touching ? std::min(e.path.size(), kRecent) : 0;
  float near2 = law.snap * law.snap;
  for (size_t i = 0; i + recent < e.path.size(); ++i) {
    const Vec3 at = wall::rest_place(m.wall, e.path[i]);
    const float far2 = length2(at - tip);
    if (far2 < near2) near2 = far2, now = e.path[i];
  }
  now.zeta = outer ? 1.0f : -1.0f;
  tip = wall::rest_place(m.wall, now);
  const bool on_path = near2 < law.snap * law.snap;
  if (!on_path && e.path.size() < kMaxTipPath &&
      (!e.touching || e.path.empty() || length2(wall::rest_place(m.wall, e.path.back()) - tip) > kApart * kApart))
    e.path.push_back(now);

  std::vector<wall::Mark>& marks = k.marks;
  marks.clear();
  if (e.touching) {
    wall::trace(m.wall, e.last, now, marks);
    for (const wall::Mark& mark : marks) {
      if (e.passed[mark.face].has(mark.link)) continue;
      if (e.groove.size() == kMaxGroove) {
        ++e.overflow;
        continue;
      }
      e.passed[mark.face].set(mark.link);
      e.groove.push_back({mark.face, mark.link, tip});
    }
  }
  e.trail = e.touching ? place - heading * std::min(1.0f, kSmoothing / std::max(length(heading), 1e-9f)) : place;
  e.touching = true, e.last = now;

  const float thickness = m.wall.laminate.thickness, share = pen.coagulate ? 0.1f * law.efficiency : law.efficiency;
  const float deeper = share * pen.power * h / (law.energy * law.kerf * law.window);
  const float width = pen.coagulate ? law.char_coagulate : law.char_cut;
  char_around(m.wall, e, now.face, tip, width, 1 - portable::exp(-h / law.char_time));
  marks.clear();
  for (Groove& g : e.groove) {
    // Behind the tip: what it has just passed, once.
    if (g.through || length2(g.at - place) > law.window * law.window || dot(g.at - place, heading) > 0) continue;
    (outer ? g.outer : g.inner) += deeper;
    out.deepest = std::max(out.deepest, std::min(g.outer + g.inner, thickness));
    if (g.outer + g.inner < thickness) continue;
    g.through = true;
    marks.push_back({g.face, g.link});
    const wall::Raster& r = wall::raster(is_quad(m.wall, g.face));
    wall::Point at{g.face, 0, 0, now.zeta};
    wall::to_natural(is_quad(m.wall, g.face), r.center[r.link[g.link].a], at.xi, at.eta);
    ++out.through, out.at = at;
    if (!pen.coagulate) open_vessel(law.bleed, m.wall, marks.back(), true, e.bleed);
  }
  if (pen.coagulate) coagulate(law.bleed, m.wall, tip, h, e.bleed);
  heat_at(law.heat, m.wall, now, pen.power, pen.coagulate, h, e.heat);
  if (!marks.empty()) out.cut = cut(m, s, k, marks);
  return out;
}

SnipStep snip(const ExciseModel& law, const Model& m, State& s, Scratch& k, Excision& e, std::span<const wall::Point> path) {
  SnipStep out;
  reserve(m.wall, e);
  std::vector<wall::Mark> marks;
  for (size_t i = 0; i + 1 < path.size(); ++i) wall::trace(m.wall, path[i], path[i + 1], marks);
  if (marks.empty()) return out;
  const std::vector<wall::FaceCut> before = s.wall.topology.cut;
  out.cut = cut(m, s, k, marks);
  const std::vector<wall::FaceCut>& after = s.wall.topology.cut;
  for (const wall::Mark& mark : marks) {
    const bool was = !before.empty() && before[mark.face].has(mark.link);
    if (was || after.empty() || !after[mark.face].has(mark.link)) continue;
    open_vessel(law.bleed, m.wall, mark, false, e.bleed);
  }
  for (size_t i = 0; i + 1 < path.size(); ++i)
    out.length += distance(wall::rest_place(m.wall, path[i]), wall::rest_place(m.wall, path[i + 1]));
  out.at = path.back();
  return out;
}

float burnt_at(const Model& m, const Excision& e, const wall::Point& p) {
  return e.burnt.empty() ? 0 : e.burnt[p.face][wall::cell_at(is_quad(m.wall, p.face), p.xi, p.eta)];
}

}  // namespace catgut::physical
