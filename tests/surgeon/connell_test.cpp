// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: one loop of a Connell suture, as far as its bites. The second one is made backhand: the needle comes back
// toward the viewer, and both hands stay on their sides.
#include <gtest/gtest.h>

#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

TEST(Connell, goes_along_one_edge_and_backhand_along_the_other) {
  const SceneSpec scene = read_scene("connell_thread");
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  const std::unique_ptr<Surgeon> surgeon = scripted_surgeon(scene, picture_model(*model));
  Snapshot seen;
  publish(*model, *state, seen);
  Jobs jobs(2);
  TickInput no_hands;
  for (ToolInput& hand : no_hands.hand) hand.connected = 0;
  float holder_from_right = 1, forceps_from_left = 1;  // least cosine of a shaft to its side, while that hand has the needle
  for (uint64_t t = 0; t < 60 * 60 && seen.active().suture_point.size() < 8 && !surgeon->done(); ++t) {
    TickInput input = t < 30 ? no_hands : surgeon->operate(seen, model->dt);
    input.tick = t;
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    if (!seen.active().needle.in_tissue) continue;
    const Vec3 holder = rotate(seen.tool[0].pose.q, {0, 0, 1}), forceps = rotate(seen.tool[1].pose.q, {0, 0, 1});
    if (seen.tool[0].held == Held::needle) holder_from_right = std::min(holder_from_right, holder.x);
    if (seen.tool[1].held == Held::needle) forceps_from_left = std::min(forceps_from_left, -forceps.x);
  }
  const auto& point = seen.active().suture_point;
  ASSERT_EQ(point.size(), 8u) << surgeon->doing();
  for (size_t i = 0; i < 8; ++i) EXPECT_EQ(point[i].wall, i < 4 ? 0u : 1u) << i;
  EXPECT_GT(point[0].position.z - point[3].position.z, 8e-3f) << "away from the viewer";
  EXPECT_GT(point[7].position.z - point[4].position.z, 8e-3f) << "and back";
  EXPECT_LT(std::abs(point[3].position.z - point[4].position.z), 5e-3f) << "straight across";
  EXPECT_LT(std::abs(point[0].position.z - point[7].position.z), 3e-3f) << "the ends face each other";
  for (size_t i = 0; i < 8; i += 2) {  // from the outer face into the lumen and back: the inner holes of a passage are lower
    const float from = point[i].position.y, to = point[i + 1].position.y;
    EXPECT_GT(i % 4 == 0 ? from - to : to - from, 0.5e-3f) << i;
  }
  EXPECT_GT(holder_from_right, 0.3f);
  EXPECT_GT(forceps_from_left, -0.3f);
}

}  // namespace
}  // namespace catgut
