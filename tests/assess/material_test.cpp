// SPDX-License-Identifier: Apache-2.0
// tests/assess: positions of bites in a simulated session against the material points that the simulation itself keeps. The
// tissue is bent and pulled while the needle passes; the measure sees only the Snapshot.
#include <gtest/gtest.h>

#include "assess/stitch_map.h"
#include "procedure/scene_file.h"
#include "runtime/session.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

struct Errors {
  std::vector<float> entry, exit;  // [m]
};

Errors errors_of(const char* scene_name, double seconds) {
  const SceneSpec scene = read_scene(scene_name);
  SessionOptions options;
  options.seconds = seconds;
  SessionHooks hooks;
  PictureModel picture;
  const Snapshot* seen = nullptr;
  Errors out;
  hooks.on_start = [&](const PictureModel& p) { picture = p; };
  hooks.on_tick = [&](const Snapshot& s, const std::string&) { seen = &s; };
  hooks.on_step = [&](const Model& model, const State& state, const TickInput&) {
    for (const Event& e : seen->event) {
      if (e.kind != EventKind::bite_completed) continue;
      const Bite& bite = state.suture.suture[e.suture].bite[e.which];
      const BiteView& view = seen->suture[e.suture].bite[e.which];
      const auto error = [&](const BiteEnd& end, Vec3 now) {
        const Triangle& t = model.solver.collision.surface[end.triangle];
        Vec3 rest{};
        for (size_t c = 0; c < 3; ++c) rest += end.weight[c] * picture.particle_rest[t[c]];
        return distance(rest, at_rest(picture, *seen, view.wall, now));
      };
      out.entry.push_back(error(bite.entry, view.entry));
      out.exit.push_back(error(bite.exit, view.exit));
    }
  };
  run_session(scene, options, hooks);
  return out;
}

TEST(Material, bites_of_a_simulated_session_are_where_the_tissue_has_them) {
  const Errors e = errors_of("stay", 25);
  ASSERT_GE(e.entry.size(), 2u);
  for (size_t i = 0; i < e.entry.size(); ++i) {
    EXPECT_LT(e.entry[i], 0.1e-3f) << "bite " << i;
    EXPECT_LT(e.exit[i], 0.1e-3f) << "bite " << i;
  }
}

}  // namespace
}  // namespace catgut
