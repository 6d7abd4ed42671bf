// SPDX-License-Identifier: Apache-2.0
// bench/physical: pictures of sutures as the mechanics leave them: a stitch between two tubes, a purse-string. Walls are drawn
// as fine rods, outer face light, inner face dark, rims yellow.
//   seam_pictures FILE.png
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "render/capsule_picture.h"
#include "validation/suture_scenes.h"

namespace {
using namespace catgut;
using namespace catgut::validation;

std::vector<SheetCell> cells;

void picture(const Sewn& s, const std::string& name, const CapsuleView& view) {
  std::vector<DrawnCapsule> rods;
  const thread::State& t = s.state.thread;
  const float r = 0.5f * s.model.thread.material.diameter;
  for (uint32_t i = 0; i < t.segments(); ++i) {
    if (t.broken[i]) continue;
    const Color color = i < t.segments() / 2 ? Color{70, 120, 215, 255} : Color{214, 160, 60, 255};
    const Vec3 a = t.position(i), b = t.position(i + 1);
    Vec3 corner = a;
    for (const thread::Eyelet& e : t.eyelet)
      if (e.segment == i) corner = mouth(s.model, s.state, s.state.hole[e.point]);
    rods.push_back({a, corner, r, color}), rods.push_back({corner, b, r, color});
  }
  const auto place = [&](const wall::Point& p) {
    return wall::place(wall::weights(s.model.wall, s.state.wall.topology, p), s.state.wall.motion);
  };
  for (const physical::Patch& p : s.model.surface.patch) {
    if (distance(place({p.face, 0, 0, 0}), view.center) > 0.9f * view.width) continue;
    constexpr int kRods = 14;
    for (int k = 0; k <= kRods; ++k) {
      const float v = -1 + 2.0f * static_cast<float>(k) / kRods;
      if (p.side != 0) {
        const Color color = p.side > 0 ? Color{215, 140, 125, 255} : Color{190, 80, 80, 255};
        const float side = static_cast<float>(p.side);
        for (float u = -1; u < 0.9f; u += 0.5f)
          rods.push_back({place({p.face, u, v, side}), place({p.face, u + 0.5f, v, side}), 0.12e-3f, color});
      } else {
        const float from[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}, to[4][2] = {{1, -1}, {1, 1}, {-1, 1}, {-1, -1}};
        rods.push_back({place({p.face, from[p.edge][0], from[p.edge][1], v}),
                        place({p.face, to[p.edge][0], to[p.edge][1], v}),
                        0.12e-3f,
                        {235, 200, 150, 255}});
      }
    }
  }
  cells.push_back({draw_capsules(rods, view, 560, 420), name});
  std::printf("%s\n", name.c_str());
}
}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "seam_pictures: no file named; write: seam_pictures FILE.png\n");
    return 2;
  }
  const CapsuleView outside{{0.0215f, 0, 0}, {1, -0.45f, 0.35f}, {0, 0, 1}, 0.02f};
  const CapsuleView along{{0.0205f, 0, 0}, {0.1f, -1, 0}, {1, 0, 0}, 0.02f};
  Stitch stitch;
  stitch.friction = 0.25f;
  Sewn s = interrupted(stitch);
  Tying t;
  t.center = {0.0203f, 0, 0}, t.tension = 2.5f;
  const Throws throws = three_throws();
  tie_throw(s, t, throws[0]);
  picture(s, "first throw, 3 N", outside), picture(s, "the same, along the wound", along);
  for (size_t k = 1; k < throws.size(); ++k) tie_throw(s, t, throws[k]);
  let_go(s);
  s.run(3.9f);
  picture(s, "tied, hands away for 4 s", outside), picture(s, "the same, along the wound", along);
  Stitch q;
  q.hole_friction = 0.1f, q.tail = 0.12f;
  Sewn purse = purse_string(q, 10);
  const CapsuleView front{{0, 0, -0.003f}, {0.25f, 0.2f, 1}, {0, 1, 0}, 0.055f};
  picture(purse, "purse-string, laid", front);
  draw_purse(purse, 3, 2);
  picture(purse, "purse-string, drawn with 3 N", front);
  write_png(contact_sheet(cells, 2), argv[1]);
  return 0;
}
