// SPDX-License-Identifier: Apache-2.0
// tests/render: tissue that was divided is drawn as two pieces. Needs an EGL driver, else skips.
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <string>

#include "geometry/skin.h"
#include "procedure/scene_file.h"
#include "render/renderer.h"
#include "sim/model.h"
#include "sim/state.h"
#include "sim/topology.h"

namespace catgut {
namespace {

constexpr float kLift = 0.02f;  // [m]

// The colon of the purse-string scene, cut across below its rim; the upper piece is lifted.
struct Lifted {
  std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model);
  Snapshot whole, divided;
  float plane = 0;  // [m] height of the cut

  Lifted() {
    publish(*model, *state, whole);
    plane = model->scene.body[0].position.y - 0.015f;
    EXPECT_GT(divide_by_plane(*model, *state, 0, {0, plane, 0}, {0, 1, 0}), 0u);
    const Model& now = current_model(*model, *state);
    const uint32_t rim = now.piece[now.rim[0].outer[0]];
    for (uint32_t i = 0; i < now.solver.tissue; ++i)
      if (now.piece[i] == rim) state->solver.x[i].y += kLift;
    publish(*model, *state, divided);
  }
};

TEST(Division, no_visible_triangle_is_stretched_and_the_surface_stays_closed) {
  const Lifted l;
  const PictureModel& picture = *l.divided.topology.picture;
  const PictureModel before = picture_model(*l.model);
  ASSERT_EQ(picture.particle_rest.size(), l.divided.particle.size());
  ASSERT_EQ(l.divided.rotation.size(), l.divided.particle.size());
  size_t cut_faces = 0;
  for (size_t b = 0; b < picture.body.size(); ++b) {
    const VisibleMesh& mesh = picture.body[b];
    EXPECT_GE(mesh.triangle.size(), before.body[b].triangle.size()) << "nothing is left out";
    std::vector<Vec3> position(mesh.position.size()), normal(mesh.position.size());
    skin(mesh, picture.particle_rest, l.divided.particle, l.divided.rotation, position, normal);
    for (const auto& t : mesh.triangle) {
      cut_faces += t[0] >= before.body[b].position.size() && mesh.layer[t[0]] == TissueLayer::cut_edge;
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t i = t[k], j = t[(k + 1) % 3];
        const float rest = distance(mesh.position[i], mesh.position[j]);
        EXPECT_LT(distance(position[i], position[j]), 1.2f * rest + 2e-4f);
      }
    }
  }
  EXPECT_GE(cut_faces, l.state->topology.face.size());
}

TEST(Division, the_gap_between_the_pieces_shows_what_is_behind) {
  if (!renderer_available()) GTEST_SKIP() << "no EGL driver here, or a build without pictures (CATGUT_RENDER=OFF)";
  const Lifted l;
  const PictureModel picture = picture_model(*l.model);
  constexpr int kWidth = 480, kHeight = 360;
  const auto renderer = make_renderer(picture, kWidth, kHeight, Quality::low);
  Camera camera;
  camera.target = {0, l.plane + 0.5f * kLift, 0};
  camera.eye = camera.target + Vec3{0.02f, 0.01f, 0.26f};
  const Image whole = renderer->render(l.whole, camera), cut = renderer->render(l.divided, camera);
  // Across the middle of the picture, where the tissue was and the gap is now.
  const auto is_tissue = [](Color c) { return c[0] > c[1] + 8 && c[0] > c[2]; };
  const float pixels = 0.5f * kHeight / std::tan(0.5f * camera.fov_deg * kPi / 180) / 0.26f;  // [1/m]
  const auto tissue_at = [&](const Image& image, float height) {
    const int row = static_cast<int>(0.5f * kHeight - pixels * (height - camera.target.y));
    int n = 0;
    for (int x = kWidth / 2 - 30; x < kWidth / 2 + 30; ++x) n += is_tissue(pixel(image, x, row));
    return n;
  };
  if (const char* folder = std::getenv("CATGUT_PICTURES"))
    write_png(whole, std::string(folder) + "/whole.png"), write_png(cut, std::string(folder) + "/divided.png");
  EXPECT_GT(tissue_at(whole, l.plane + 0.5f * kLift), 50);
  EXPECT_EQ(tissue_at(cut, l.plane + 0.5f * kLift), 0) << "the gap";
  EXPECT_GT(tissue_at(cut, l.plane - 0.012f), 50) << "lower piece";
  EXPECT_GT(tissue_at(cut, l.plane + kLift + 0.006f), 50) << "upper piece";
  // Back again: a state from before the cut.
  const Image again = renderer->render(l.whole, camera);
  int changed = 0;
  for (size_t i = 0; i < again.rgba.size(); ++i) changed += std::abs(again.rgba[i] - whole.rgba[i]) > 12;
  EXPECT_LT(changed, 200);
}

}  // namespace
}  // namespace catgut
