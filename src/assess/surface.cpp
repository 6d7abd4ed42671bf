// SPDX-License-Identifier: Apache-2.0
// assess: see surface.h.
#include "assess/surface.h"

namespace catgut::assess {

RestSurface::RestSurface(const PictureModel& picture) {
  auto serosa = std::make_shared<Parts>(picture.rim.size()), whole = std::make_shared<Parts>(picture.rim.size());
  for (const VisibleMesh& body : picture.body)
    for (const auto& t : body.triangle) {
      const uint32_t particle = body.skin_particle[t[0]][0];
      const size_t wall = particle < picture.wall.size() ? picture.wall[particle] : 0;
      if (wall >= whole->size()) continue;
      const auto add = [&](Part& part) {
        const auto first = static_cast<uint32_t>(part.mesh.position.size());
        for (const uint32_t v : t) part.mesh.position.push_back(body.position[v]), part.normal.push_back(body.normal[v]);
        part.mesh.triangle.push_back({first, first + 1, first + 2});
      };
      add((*whole)[wall]);
      if (body.layer[t[0]] == TissueLayer::serosa && body.layer[t[1]] == TissueLayer::serosa &&
          body.layer[t[2]] == TissueLayer::serosa)
        add((*serosa)[wall]);
    }
  for (Parts* parts : {serosa.get(), whole.get()})
    for (Part& part : *parts)
      if (!part.mesh.triangle.empty()) part.tree = std::make_unique<SurfaceTree>(part.mesh);
  serosa_ = std::move(serosa), whole_ = std::move(whole);
}

SurfacePoint RestSurface::find(const Parts& parts, uint32_t wall, Vec3 p) {
  if (wall >= parts.size() || !parts[wall].tree) return {};
  const Part& part = parts[wall];
  const SurfaceTree::Hit hit = part.tree->nearest(p);
  const auto& t = part.mesh.triangle[hit.triangle];
  const ClosestOnTriangle c =
      closest_on_triangle(p, part.mesh.position[t[0]], part.mesh.position[t[1]], part.mesh.position[t[2]]);
  const Vec3 n = normalized(part.normal[t[0]] * c.weight[0] + part.normal[t[1]] * c.weight[1] + part.normal[t[2]] * c.weight[2],
                            {0, 1, 0});
  return {c.point, n, dot(c.point - p, n), true};
}

SurfacePoint RestSurface::serosa(uint32_t wall, Vec3 p) const { return find(*serosa_, wall, p); }
SurfacePoint RestSurface::nearest(uint32_t wall, Vec3 p) const { return find(*whole_, wall, p); }

}  // namespace catgut::assess
