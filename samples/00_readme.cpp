#include "procedure/scene_file.h"
#include "sim/simulation.h"

int main() {
  const auto model = catgut::build_model(catgut::read_scene("purse_string"));  // constant
  const auto state = catgut::initial_state(*model);                            // all that changes
  catgut::Jobs jobs(2);                                                        // two threads; the bits do not depend on it
  catgut::Snapshot seen;
  for (catgut::TickInput input; input.tick < 600; ++input.tick) {  // ten seconds
    input.hand[0].pose.p = {0.0f, 0.05f, 0.03f};                   // your device's pose goes here [m]
    catgut::step(*model, *state, input, jobs);
    catgut::publish(*model, *state, seen);  // particles, tools, forces, events
  }
  return catgut::state_is_sane(*model, *state) ? 0 : 1;
}
