// SPDX-License-Identifier: Apache-2.0
// tests/render: the drawn surface follows the particles like geometry/skin.
#include "render/skinned.h"

#include <gtest/gtest.h>

#include "geometry/skin.h"
#include "scene.h"

namespace catgut {
namespace {

TEST(Skinned, MovesVerticesAsSkinDoesAndTheirFramesAlong) {
  const TestField field = make_test_field(24, 12);
  const VisibleMesh& mesh = field.model.body[0];
  std::vector<Vec3> particle = field.snapshot.particle;
  std::vector<Quat> rotation = field.snapshot.rotation;
  for (size_t i = 0; i < rotation.size(); ++i) {
    const float a = 0.5f + 0.02f * float(i % 7);
    rotation[i] = axis_angle(normalized(Vec3{1, 0.3f, -0.2f}), a);
    if (i % 3 == 0) rotation[i] = {-rotation[i].x, -rotation[i].y, -rotation[i].z, -rotation[i].w};  // the same rotation
    particle[i] = particle[i] + Vec3{0.001f * float(i % 5), -0.002f, 0.0005f * float(i % 3)};
  }
  std::vector<Vec3> position(mesh.position.size()), normal(mesh.position.size());
  skin(mesh, field.model.particle_rest, particle, rotation, position, normal);
  Motions motion;
  find_motion(field.model.particle_rest, particle, rotation, motion);
  for (size_t v = 0; v < position.size(); ++v) {
    const SkinnedVertex vertex{
        mesh.skin_particle[v], mesh.skin_weight[v], mesh.position[v],
        from_axes(any_perpendicular(mesh.normal[v]), cross(mesh.normal[v], any_perpendicular(mesh.normal[v])), mesh.normal[v])};
    ASSERT_TRUE(has_moved(vertex, motion));
    const Skinned at = follow(vertex, motion.of);
    EXPECT_LT(distance(at.position, position[v]), 1e-6f);
    EXPECT_GT(dot(rotate(at.frame, {0, 0, 1}), normal[v]), 0.9995f);
  }
}

TEST(Skinned, WhatRestsIsNotMovedAgainUntilItCanBeSeen) {
  const std::vector<Vec3> rest{{0, 0, 0}, {0.01f, 0, 0}};
  std::vector<Vec3> particle = rest;
  const std::vector<Quat> rotation(2);
  Motions motion;
  find_motion(rest, particle, rotation, motion);
  find_motion(rest, particle, rotation, motion);
  EXPECT_FALSE(motion.moved[0] || motion.moved[1]);
  // Slow motion accumulates: motion that was not drawn is not lost.
  bool moved = false;
  for (int i = 0; i < 4; ++i) {
    particle[1].y += 1e-6f;
    find_motion(rest, particle, rotation, motion);
    moved = moved || motion.moved[1];
    EXPECT_FALSE(motion.moved[0]);
  }
  EXPECT_TRUE(moved);
  particle[0] = {NAN, 0, 0};
  find_motion(rest, particle, rotation, motion);
  EXPECT_TRUE(motion.moved[0]);
}

}  // namespace
}  // namespace catgut
