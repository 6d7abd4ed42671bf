// SPDX-License-Identifier: Apache-2.0
// solver/volume: reads tetrahedra, moves particles. Equations: Mueller et al. 2014 (strain based dynamics), paper 2.1.
#include "solver/volume.h"

#include <algorithm>
#include <numeric>

namespace catgut {

float tet_volume(Vec3 a, Vec3 b, Vec3 c, Vec3 d) { return dot(cross(b - a, c - a), d - a) / 6.0f; }

VolumeModel make_volume_model(std::span<const Vec3> rest, std::span<const Tet> tet) {
  // Greedy coloring in order: the smallest color not yet used by any of the four particles.
  std::vector<uint64_t> used(rest.size(), 0);
  std::vector<uint32_t> color(tet.size()), order(tet.size());
  for (size_t t = 0; t < tet.size(); ++t) {
    uint64_t busy = 0;
    for (uint32_t k : tet[t]) busy |= used[k];
    uint32_t c = 0;
    while (c < 63 && (busy >> c & 1)) ++c;
    for (uint32_t k : tet[t]) used[k] |= uint64_t{1} << c;
    color[t] = c;
  }
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return color[a] < color[b]; });
  VolumeModel m;
  for (size_t i = 0; i < order.size(); ++i) {
    const Tet& t = tet[order[i]];
    m.tet.push_back(t);
    m.rest.push_back(tet_volume(rest[t[0]], rest[t[1]], rest[t[2]], rest[t[3]]));
    if (i + 1 == order.size() || color[order[i + 1]] != color[order[i]]) m.color_end.push_back(static_cast<uint32_t>(i + 1));
  }
  return m;
}

void solve_volume(const VolumeModel& model, Vec4* x, const float* inv_mass, float compliance, float h, float* lambda,
                  uint32_t first, uint32_t last) {
  const float alpha = compliance / (h * h);
  for (uint32_t t = first; t < last; ++t) {
    const Tet& id = model.tet[t];
    const Vec3 a = xyz(x[id[0]]), b = xyz(x[id[1]]), c = xyz(x[id[2]]), d = xyz(x[id[3]]);
    const Vec3 gb = cross(c - a, d - a) / 6.0f, gc = cross(d - a, b - a) / 6.0f, gd = cross(b - a, c - a) / 6.0f;
    const Vec3 ga = -(gb + gc + gd);
    const float wa = inv_mass[id[0]], wb = inv_mass[id[1]], wc = inv_mass[id[2]], wd = inv_mass[id[3]];
    const float w = wa * length2(ga) + wb * length2(gb) + wc * length2(gc) + wd * length2(gd);
    if (w + alpha <= 0) continue;
    const float violation = tet_volume(a, b, c, d) - model.rest[t];
    const float dl = -(violation + alpha * lambda[t]) / (w + alpha);
    lambda[t] += dl;
    add(x[id[0]], ga * (wa * dl));
    add(x[id[1]], gb * (wb * dl));
    add(x[id[2]], gc * (wc * dl));
    add(x[id[3]], gd * (wd * dl));
  }
}

}  // namespace catgut
