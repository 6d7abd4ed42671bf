// SPDX-License-Identifier: Apache-2.0
// bench/thread: see knot_drawing.h.
#include "knot_drawing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace catgut {

std::array<KnotKind, 4> knot_kinds() {
  return {{{"single throw", "knot_single", validation::single_throw(), {{1}}, 15},
           {"granny", "knot_granny", validation::granny(), {{1}, {1, false}}, 17},
           {"square", "knot_square", validation::square(), {{1}, {1}}, 14},
           {"surgeon's 2-1-1", "knot_surgeons", validation::surgeons_211(), {{2}, {1}, {1}}, 14}}};
}

void add_thread(std::vector<DrawnCapsule>& to, const thread::State& s, uint32_t middle, float radius) {
  constexpr int kPieces = 4;
  const size_t last = s.nodes() - 1;
  for (size_t i = 0; i < last; ++i) {
    if (s.broken[i]) continue;
    const Vec3 b = s.position(i), c = s.position(i + 1);
    const Vec3 at_b = (c - (i > 0 ? s.position(i - 1) : b)) * 0.5f, at_c = ((i + 2 <= last ? s.position(i + 2) : c) - b) * 0.5f;
    Vec3 before = b;
    for (int k = 1; k <= kPieces; ++k) {  // cubic Hermite (Catmull-Rom tangents)
      const float t = static_cast<float>(k) / kPieces, t2 = t * t, t3 = t2 * t;
      const Vec3 p = b * (2 * t3 - 3 * t2 + 1) + at_b * (t3 - 2 * t2 + t) + c * (3 * t2 - 2 * t3) + at_c * (t3 - t2);
      to.push_back({before, p, radius, i < middle ? kFirstStrand : kSecondStrand});
      before = p;
    }
  }
}

KnotPlace knot_place(const thread::Settings& settings, const thread::State& s) {
  std::vector<Vec3> at;
  for (size_t k = 0; k < s.key.size(); ++k) {
    const uint32_t i = thread::segment_of(s.key[k]), j = thread::partner_of(s.key[k]);
    if (j >= thread::kTool || s.crossing[k].gap > 0.5f * settings.material.diameter) continue;
    // Not the neighbors of a bend.
    const Vec3 p = normalized(s.position(i + 1) - s.position(i)), q = normalized(s.position(j + 1) - s.position(j));
    if (std::abs(dot(cross(p, q), s.crossing[k].normal)) < 0.3f) continue;
    at.push_back((s.position(i) + s.position(i + 1) + s.position(j) + s.position(j + 1)) * 0.25f);
  }
  if (at.empty()) return {};
  KnotPlace place;
  for (const Vec3& p : at) place.center += p / static_cast<float>(at.size());
  std::vector<float> far;
  for (const Vec3& p : at) far.push_back(distance(p, place.center));
  std::sort(far.begin(), far.end());
  place.radius = far[(far.size() - 1) * 9 / 10] + settings.material.diameter;
  return place;
}

Vec3 clearest_view(std::span<const DrawnCapsule> thread, std::span<const DrawnCapsule> around, const KnotPlace& place,
                   Vec3 front, Vec3 up) {
  std::vector<DrawnCapsule> near;
  for (const DrawnCapsule& c : thread)
    if (distance(0.5f * (c.a + c.b), place.center) < 1.3f * place.radius) near.push_back(c);
  for (DrawnCapsule c : around) c.color = {0, 0, 0, 255}, near.push_back(c);
  const Vec3 w = normalized(front), u = normalized(cross(up, w), {1, 0, 0}), v = cross(w, u);
  Vec3 best = w;
  float most = 0;
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j) {
      const float a = 0.26f * static_cast<float>(i), b = 0.26f * static_cast<float>(j);
      if (a * a + b * b > 0.75f) continue;
      CapsuleView view;
      view.center = place.center, view.up = up, view.width = 4 * place.radius;
      view.toward = normalized((w * std::cos(a) + u * std::sin(a)) * std::cos(b) + v * std::sin(b));
      const Image image = draw_capsules(near, view, 120, 90);
      float shown = 0;
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const Color c = pixel(image, x, y);
          shown += c != kPictureGround && std::max({c[0], c[1], c[2]}) > 40;
        }
      shown *= 1 - 0.05f * (a * a + b * b);  // of views alike, the one from the front
      if (shown > most) most = shown, best = view.toward;
    }
  return best;
}

std::string seen_text(const thread::SeenKnot& seen) {
  char text[160];
  if (seen.throws == 0) std::snprintf(text, sizeof text, "%s", std::string(thread::name_of(seen.name)).c_str());
  else
    std::snprintf(text, sizeof text, "%s, %u throw%s, %u wrap%s, %.0f %%%s", std::string(thread::name_of(seen.name)).c_str(),
                  seen.throws, seen.throws == 1 ? "" : "s", seen.wraps, seen.wraps == 1 ? "" : "s",
                  100 * double{seen.confidence}, seen.sliding ? ", sliding" : "");
  return text;
}

}  // namespace catgut
