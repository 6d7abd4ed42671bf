// SPDX-License-Identifier: Apache-2.0
// runtime: see planned_line.h.
#include "runtime/planned_line.h"

namespace catgut {
namespace {

constexpr uint32_t kBurnt = 100;  // of Scar::burnt, mean of a triangle

// As the renderer moves it.
Vec3 moved(const PictureModel& picture, const Snapshot& seen, uint32_t vertex) {
  const VisibleMesh& mesh = picture.body[0];
  Vec3 at{};
  for (size_t k = 0; k < 4; ++k) {
    const uint32_t i = mesh.skin_particle[vertex][k];
    const Quat turn = i < seen.rotation.size() ? seen.rotation[i] : Quat{};
    at += (seen.particle[i] + rotate(turn, mesh.position[vertex] - picture.particle_rest[i])) * mesh.skin_weight[vertex][k];
  }
  return at;
}

}  // namespace

PlannedLine::PlannedLine(const SceneSpec& scene, const PictureModel& picture) : line_(cut_line(scene)) {
  if (line_ && !picture.body.empty()) find(picture);
}

void PlannedLine::find(const PictureModel& picture) {
  crossing_.clear();
  const VisibleMesh& mesh = picture.body[0];
  const auto beyond = [&](uint32_t v) { return dot(line_->rim - mesh.position[v], line_->axis) - line_->from_rim; };
  for (uint32_t i = 0; i < mesh.triangle.size(); ++i) {
    const auto& t = mesh.triangle[i];
    if (mesh.layer[t[0]] == TissueLayer::cut_edge) continue;
    const Vec3 a = mesh.position[t[0]], from = a - line_->rim;
    if (dot(cross(mesh.position[t[1]] - a, mesh.position[t[2]] - a), from - line_->axis * dot(from, line_->axis)) <= 0)
      continue;
    Crossing c;
    c.triangle = i;
    size_t n = 0;
    for (size_t k = 0; k < 3 && n < 2; ++k) {
      const uint32_t v = t[k], w = t[(k + 1) % 3];
      const float d = beyond(v), e = beyond(w);
      if ((d < 0) == (e < 0)) continue;
      c.edge[n] = {v, w}, c.part[n] = d / (d - e), ++n;
    }
    if (n == 2) crossing_.push_back(c);
  }
}

const std::vector<LinePiece>& PlannedLine::on(const PictureModel& picture, const Snapshot& seen) {
  piece_.clear();
  if (!line_) return piece_;
  const PictureModel& now = seen.topology.picture ? *seen.topology.picture : picture;
  if (!(seen.topology.picture == found_on_)) found_on_ = seen.topology.picture, find(now);
  const VisibleMesh& mesh = now.body[0];
  for (const Crossing& c : crossing_) {
    const auto& t = mesh.triangle[c.triangle];
    uint32_t burnt = 0;
    for (const uint32_t v : t)
      if (!mesh.scar.empty() && mesh.scar[v] < seen.scar.size()) burnt += seen.scar[mesh.scar[v]].burnt;
    if (burnt > 3 * kBurnt) continue;
    const std::array<Vec3, 3> corner{moved(now, seen, t[0]), moved(now, seen, t[1]), moved(now, seen, t[2])};
    const auto end = [&](size_t k) {
      const auto of = [&](uint32_t v) { return v == t[0] ? corner[0] : v == t[1] ? corner[1] : corner[2]; };
      return lerp(of(c.edge[k][0]), of(c.edge[k][1]), c.part[k]);
    };
    piece_.push_back({end(0), end(1), normalized(cross(corner[1] - corner[0], corner[2] - corner[0]))});
  }
  return piece_;
}

}  // namespace catgut
