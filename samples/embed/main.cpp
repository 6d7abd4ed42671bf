// SPDX-License-Identifier: Apache-2.0
#include <catgut/catgut.h>

#include <cstdio>

int main() {
  const catgut::SceneSpec scene = catgut::read_scene("stay");  // a name or the path of a .toml file
  const auto model = catgut::build_model(scene);               // constant
  const auto state = catgut::initial_state(*model);            // all that changes
  const auto surgeon = catgut::scripted_surgeon(scene, catgut::picture_model(*model));
  catgut::Jobs jobs(2);   // two threads; the bits do not depend on their number
  catgut::Snapshot seen;  // particles, instruments, forces, events
  catgut::publish(*model, *state, seen);
  for (uint64_t tick = 0; tick < 1200; ++tick) {
    catgut::TickInput input = surgeon->operate(seen, 1 / scene.solver.tick_rate);  // or your own devices
    input.tick = tick;
    catgut::step(*model, *state, input, jobs);
    catgut::publish(*model, *state, seen);
  }
  std::printf("%.1f s: %s\n", seen.time_s, surgeon->doing().c_str());
  return catgut::state_is_valid(*model, *state) ? 0 : 1;
}
