// SPDX-License-Identifier: Apache-2.0
#include "geometry/skin.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "core/random.h"

namespace catgut {
namespace {

struct Patch {
  std::vector<Vec3> particle;
  VisibleMesh mesh;
};

// A bent double sheet of particles at 4 mm and a fine visible sheet through it.
Patch make_patch(int fine) {
  Patch p;
  const auto place = [](float u, float v, float w) {
    const float r = 0.02f - w;
    return Vec3{r * std::cos(v / 0.02f), u, r * std::sin(v / 0.02f)};
  };
  for (int i = 0; i < 18; ++i) {
    for (int j = 0; j < 20; ++j) {
      for (const float w : {0.0f, 0.0025f})
        p.particle.push_back(
            place(0.004f * static_cast<float>(i), 0.004f * (static_cast<float>(j) + 0.5f * static_cast<float>(i % 2)), w));
    }
  }
  for (int i = 0; i < fine; ++i) {
    for (int j = 0; j < fine; ++j) {
      const float u = 0.068f * static_cast<float>(i) / static_cast<float>(fine),
                  v = 0.076f * static_cast<float>(j) / static_cast<float>(fine);
      p.mesh.position.push_back(place(u, v, 0));
      p.mesh.normal.push_back(normalized(Vec3{p.mesh.position.back().x, 0, p.mesh.position.back().z}));
    }
  }
  bind_skin(p.mesh, p.particle, 0.008f, 2);
  return p;
}

TEST(Skin, WeightsSumToOne) {
  const Patch p = make_patch(60);
  for (const auto& w : p.mesh.skin_weight) {
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3], 1, 1e-5);
    for (float x : w) EXPECT_GE(x, 0);
  }
}

TEST(Skin, NearestParticlesAreFound) {
  const Patch p = make_patch(20);
  for (size_t v = 0; v < p.mesh.position.size(); ++v) {
    float best = 1;
    for (const Vec3 x : p.particle) best = std::min(best, distance(x, p.mesh.position[v]));
    EXPECT_EQ(distance(p.particle[p.mesh.skin_particle[v][0]], p.mesh.position[v]), best);
  }
}

TEST(Skin, OutOfReachFollowsItsNearestAlone) {
  VisibleMesh mesh;
  mesh.position = {{5, 0, 0}, {0, 0, 0.001f}};
  mesh.normal = {{1, 0, 0}, {0, 0, 1}};
  const std::vector<Vec3> particle{{0, 0, 0}, {0.1f, 0, 0}};
  bind_skin(mesh, particle, 0.01f, 1);
  EXPECT_EQ(mesh.skin_particle[0], (std::array<uint32_t, 4>{1, 1, 1, 1}));
  EXPECT_EQ(mesh.skin_weight[0], (std::array<float, 4>{1, 0, 0, 0}));
  EXPECT_EQ(mesh.skin_particle[1][0], 0u);
}

TEST(Skin, RigidMotionStaysRigid) {
  const Patch p = make_patch(60);
  const Pose move{{0.1f, -0.05f, 0.2f}, axis_angle(normalized(Vec3{1, 2, 3}), 1.1f)};
  std::vector<Vec3> particle, position(p.mesh.position.size()), normal(position.size());
  for (const Vec3 x : p.particle) particle.push_back(transform(move, x));
  skin(p.mesh, p.particle, particle, std::vector<Quat>(particle.size(), move.q), position, normal);
  for (size_t v = 0; v < position.size(); ++v) {
    EXPECT_LT(distance(position[v], transform(move, p.mesh.position[v])), 1e-6f);
    EXPECT_LT(distance(normal[v], rotate(move.q, p.mesh.normal[v])), 1e-5f);
  }
}

// A stretch by 20 % along and a shear, rotations left at rest: the mesh must follow within a fraction of the particle
// spacing and without steps between neighboring vertices.
TEST(Skin, StretchIsFollowedSmoothly) {
  const int fine = 140;
  const Patch p = make_patch(fine);
  const auto stretch = [](Vec3 x) { return Vec3{x.x, 1.2f * x.y, x.z + 0.1f * x.y}; };
  std::vector<Vec3> particle, position(p.mesh.position.size()), normal(position.size());
  for (const Vec3 x : p.particle) particle.push_back(stretch(x));
  skin(p.mesh, p.particle, particle, std::vector<Quat>(particle.size()), position, normal);
  float worst = 0, step = 0;
  const auto error = [&](size_t v) { return position[v] - stretch(p.mesh.position[v]); };
  for (int i = 8; i < fine - 8; ++i) {
    for (int j = 8; j < fine - 9; ++j) {
      const size_t v = static_cast<size_t>(i * fine + j);
      worst = std::max(worst, length(error(v)));
      step = std::max(step, distance(error(v), error(v + 1)));
    }
  }
  std::printf("affine: largest error %.3f mm, largest step between vertices %.4f mm\n", 1e3 * worst, 1e3 * step);
  EXPECT_LT(worst, 0.0004f);
  EXPECT_LT(step, 0.0002f);
}

TEST(Skin, IsFastEnoughForAFrame) {
  const Patch p = make_patch(141);
  std::vector<Vec3> position(p.mesh.position.size()), normal(position.size());
  const std::vector<Quat> rotation(p.particle.size());
  double best = 1e9;
  for (int k = 0; k < 20; ++k) {
    const auto start = std::chrono::steady_clock::now();
    skin(p.mesh, p.particle, p.particle, rotation, position, normal);
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::printf("skin of %zu vertices: %.2f ms\n", position.size(), best);
  EXPECT_LT(best, 20);  // wide, for sanitizers and busy machines; about 0.5 ms on an idle core
}

}  // namespace
}  // namespace catgut
