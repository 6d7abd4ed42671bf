// SPDX-License-Identifier: Apache-2.0
// One bite through the rim of a colon: a scene file, a pair of hands, and the simulator's report of the stitch.
// Shows: scenes by name, hands that read the last snapshot before they move, events in order.
#include <cstdio>
#include <vector>

#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/simulation.h"

using namespace catgut;

int main() {
  SceneSpec scene = read_scene("purse_string");
  set_value(scene, "surgeon.bites=1");
  const auto model = build_model(scene);
  const auto state = initial_state(*model);
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  Jobs jobs(1);
  Snapshot seen;
  std::vector<EventKind> happened;
  publish(*model, *state, seen);
  for (TickInput input; input.tick < 60 * 30 && happened.size() < 5; ++input.tick) {
    input.hand = hands.surgeon->operate(seen, 1 / scene.solver.tick_rate).hand;
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    for (const Event& e : seen.event) {
      if (e.kind == EventKind::particle_attached || e.kind == EventKind::particle_released) continue;
      if (e.kind < EventKind::tip_entered || e.kind > EventKind::bite_completed) continue;
      std::printf("%6.2f s  %-15s %g\n", seen.time_s, event_name(e.kind), static_cast<double>(e.value));
      happened.push_back(e.kind);
    }
  }
  if (seen.active().bite.size() != 1 || !seen.active().bite[0].complete) return 1;
  const float size = distance(seen.active().bite[0].entry, seen.active().bite[0].exit);
  std::printf("entry to exit %.1f mm, deepest %.1f mm\n", 1e3 * size, 1e3 * seen.active().bite[0].depth);
  const std::vector<EventKind> right{EventKind::tip_entered, EventKind::tip_exited, EventKind::suture_point,
                                     EventKind::suture_point, EventKind::bite_completed};
  return happened == right && seen.active().suture_point.size() == 2 && size > 0.004f && size < 0.010f ? 0 : 1;
}
