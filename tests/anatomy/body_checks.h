// SPDX-License-Identifier: Apache-2.0
// Requirements of every body, whatever made it.
#pragma once
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "anatomy/body.h"
#include "anatomy/wall.h"
#include "geometry/topology.h"

namespace catgut {

// Every directed edge once and its opposite once.
inline bool watertight(const std::vector<Triangle>& triangle) {
  std::set<std::pair<uint32_t, uint32_t>> seen;
  for (const Triangle& t : triangle) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] == t[(k + 1) % 3] || !seen.insert({t[k], t[(k + 1) % 3]}).second) return false;
    }
  }
  for (const auto& e : seen) {
    if (!seen.count({e.second, e.first})) return false;
  }
  return true;
}

inline int euler_characteristic(const std::vector<Triangle>& triangle) {
  std::set<uint32_t> vertex;
  std::set<uint64_t> edge;
  for (const Triangle& t : triangle) {
    for (int k = 0; k < 3; ++k) vertex.insert(t[k]), edge.insert(edge_key(t[k], t[(k + 1) % 3]));
  }
  return static_cast<int>(vertex.size()) - static_cast<int>(edge.size()) + static_cast<int>(triangle.size());
}

inline double total_tet_volume(const BodyRest& body) {
  double v = 0;
  for (const Tet& t : body.tet) v += tet_volume(body.position, t);
  return v;
}

inline void expect_sound(const BodyRest& body, size_t particles, bool folded = false) {
  ASSERT_EQ(body.position.size(), particles);
  ASSERT_EQ(body.mass.size(), particles);
  ASSERT_EQ(body.pinned.size(), particles);
  ASSERT_EQ(body.layer.size(), particles);
  ASSERT_EQ(body.cluster.size(), particles);
  for (const Vec3 p : body.position) ASSERT_TRUE(is_finite(p));
  for (const float m : body.mass) ASSERT_GT(m, 0);
  for (const Tet& t : body.tet) ASSERT_GT(tet_volume(body.position, t), 0);
  EXPECT_TRUE(watertight(body.surface));
  TriangleMesh hull{body.position, body.surface};
  EXPECT_NEAR(enclosed_volume(hull), total_tet_volume(body), 1e-3 * total_tet_volume(body));
  for (uint32_t c = 0; c < particles; ++c) {
    const auto& member = body.cluster[c];
    ASSERT_GE(member.size(), 5u);
    ASSERT_LE(member.size(), 16u);
    EXPECT_EQ(member[0], c);
    EXPECT_EQ(std::set<uint32_t>(member.begin(), member.end()).size(), member.size());
    for (const uint32_t m : member) ASSERT_LT(m, particles);
  }
  for (const Rim& rim : body.rim) {
    ASSERT_EQ(rim.outer.size(), rim.inner.size());
    for (size_t i = 0; i < rim.outer.size(); ++i) {
      // The outer tube of a cut prolapse; all of one that is not cut.
      const bool everted = folded || (body.walls > 1 && body.wall[rim.outer[i]] == 0);
      EXPECT_EQ(body.layer[rim.outer[i]], everted ? TissueLayer::mucosa : TissueLayer::serosa);
      EXPECT_EQ(body.layer[rim.inner[i]], everted ? TissueLayer::serosa : TissueLayer::mucosa);
      EXPECT_EQ(rim.inner[i], rim.outer[i] + 1);
    }
  }
  const VisibleMesh& mesh = body.visible;
  const size_t n = mesh.position.size();
  EXPECT_GE(n, 15000u);
  EXPECT_LE(n, 25000u);
  ASSERT_EQ(mesh.normal.size(), n);
  ASSERT_EQ(mesh.uv.size(), n);
  ASSERT_EQ(mesh.layer.size(), n);
  ASSERT_EQ(mesh.skin_particle.size(), n);
  ASSERT_EQ(mesh.skin_weight.size(), n);
  for (size_t v = 0; v < n; ++v) {
    ASSERT_NEAR(length(mesh.normal[v]), 1, 1e-4);
    float sum = 0;
    for (int k = 0; k < 4; ++k) {
      ASSERT_LT(mesh.skin_particle[v][k], particles);
      sum += mesh.skin_weight[v][k];
    }
    ASSERT_NEAR(sum, 1, 1e-5);
  }
  // Triangles agree with their normals, except for a few slivers.
  size_t against = 0;
  for (const Triangle& t : mesh.triangle) {
    const Vec3 a = mesh.position[t[0]];
    against += dot(cross(mesh.position[t[1]] - a, mesh.position[t[2]] - a),
                   mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]) <= 0;
  }
  EXPECT_LE(against, mesh.triangle.size() / 1000);
}

inline std::vector<Vec3> points(const BodyRest& body, const std::vector<uint32_t>& index) {
  std::vector<Vec3> p;
  for (uint32_t i : index) p.push_back(body.position[i]);
  return p;
}

}  // namespace catgut
