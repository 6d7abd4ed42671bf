// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: see workload.h.
#include "workload.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "procedure/scene_file.h"

namespace catgut {

Workload make_workload(const std::string& scene, int times) {
  Workload work;
  work.name = times == 1 ? scene : scene + " x" + std::to_string(times);
  SceneSpec spec = read_scene(scene);
  apply_preset(spec.solver, "paper");
  // More of the same wall, with the same particle spacing: twice the length and width has four times as many.
  const float larger = std::sqrt(static_cast<float>(times));
  for (BodySpec& b : spec.body) {
    b.particles *= times;
    for (float* length : {&b.radius, &b.length, &b.pinned_length, &b.inner_radius}) *length *= larger;
  }
  spec.thread.particles *= times;
  work.model = build_model(spec);

  // Catgut has no edges of its own: uses those of the wall's tetrahedra (which only the volume constraints need) and of its
  // surface. The odd particle of an odd count is part of neither, and is linked to its cluster.
  spec.solver.volume = true;
  const auto with_volume = build_model(spec);
  const SolverModel& m = work.model->solver;
  std::vector<uint8_t> tied(m.tissue, 0);
  const auto tie = [&](uint32_t a, uint32_t b) {
    if (a == b) return;
    tied[a] = tied[b] = 1;
    work.edge.push_back({std::min(a, b), std::max(a, b)});
  };
  for (const Tet& t : with_volume->solver.volume.tet)
    for (size_t i = 0; i < 4; ++i)
      for (size_t k = i + 1; k < 4; ++k) tie(t[i], t[k]);
  for (const Triangle& t : m.collision.surface)
    for (size_t i = 0; i < 3; ++i) tie(t[i], t[(i + 1) % 3]);
  for (uint32_t i = 0; i < m.tissue; ++i) {
    const uint32_t* member = &m.shape.member[size_t{m.shape.cluster_of[i]} * m.shape.cluster_stride];
    for (uint32_t k = 0; !tied[i] && k < m.shape.cluster_stride; ++k)
      if (member[k] < m.tissue && member[k] != i) work.edge.push_back({std::min(i, member[k]), std::max(i, member[k])});
  }
  std::sort(work.edge.begin(), work.edge.end());
  work.edge.erase(std::unique(work.edge.begin(), work.edge.end()), work.edge.end());

  std::vector<uint32_t> root(m.tissue);
  std::iota(root.begin(), root.end(), 0u);
  const auto root_of = [&](uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const auto& [a, b] : work.edge) root[std::max(root_of(a), root_of(b))] = std::min(root_of(a), root_of(b));
  std::vector<uint32_t> number(m.tissue, 0);
  for (uint32_t i = 0; i < m.tissue; ++i) {
    if (root_of(i) == i) {
      number[i] = static_cast<uint32_t>(work.body.size());
      work.body.emplace_back();
    }
    work.body[number[root_of(i)]].push_back(i);
  }

  // The outermost point toward +z, 5 to 10 mm from an edge at which the procedure works.
  work.pressed.z = -1e9f;
  for (uint32_t i = 0; i < m.tissue; ++i) {
    const Vec3 p = work.model->start[i];
    if (m.inv_mass[i] == 0 || p.z <= work.pressed.z) continue;
    float nearest = 1e9f;
    for (const auto& rim : work.model->picture.rim)
      for (uint32_t k : rim) nearest = std::min(nearest, distance(p, work.model->start[k]));
    if (nearest > 0.005f && nearest < 0.010f) work.pressed = p;
  }
  return work;
}

Pose tool_pose(const Workload& work, float time) {
  // From 3 mm outside the wall to 5 mm inside it. The tool points along -z.
  const float in = 0.008f * 0.5f * (1 - std::cos(2 * kPi * time));
  return {work.pressed + Vec3{0, 0, 0.003f - in}, {}};
}

}  // namespace catgut
