// SPDX-License-Identifier: Apache-2.0
// Sample: a technique of your own, in one file, without a change to Catgut. Plication: every finished bite gathers the wall,
// its two ends come together to half their distance. Shows: a TechniqueRow, its constants and its memory, register_technique,
// and the same bite without a technique beside it.
#include <cstdio>
#include <memory>

#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/simulation.h"
#include "technique/common.h"
#include "technique/technique.h"

using namespace catgut;

namespace {

struct Plication {
  float compliance = 0;  // [m/N] of the closing constraint
};

void begin(const TechniqueSetup& setup, TechniqueModel& model) {
  model.own = std::make_shared<const Plication>(Plication{setup.compliance});
}

// One row of the plan per finished bite. The memory is the number of each row's bite.
void tick(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan, EventList&) {
  plan.compliance = static_cast<const Plication*>(model.own.get())->compliance;
  std::vector<uint32_t>& bite_of_row = state.own.index;
  for (uint32_t b = bite_of_row.empty() ? 0 : bite_of_row.back() + 1; b < view.bite.size(); ++b) {
    const Bite& bite = view.bite[b];
    if (!bite.complete) continue;
    const float apart = distance(position_of(bite.entry.point, view.x), position_of(bite.exit.point, view.x));
    plan.pair.push_back({bite.entry.point, bite.exit.point, apart, 0.5f * apart, 0, 1});
    bite_of_row.push_back(b);
  }
  for (ClosurePlan::Pair& pair : plan.pair) advance(pair.progress, 1, 1, view.dt);  // closed after one second
}

bool fits(const TechniqueState& state, size_t rows, size_t) { return state.own.index.size() == rows; }

constexpr TechniqueRow kPlication{
    .name = "plication",
    .title = "plication",
    .description = "every bite gathers the wall",
    .hint = "bite along the wall",
    .plan = "purse_string",  // of the scripted surgeon, who then bites round the rim
    .walls = 1,
    .missing = "a plication needs a rim and no body has one",
    .remedy = "leave one end of the body open",
    .interrupted = false,
    .closes_opening = false,
    .begin = begin,
    .tick = tick,
    .fits = fits,
};

// [m] between the ends of the first bite, two seconds after it was finished; negative: something went wrong.
float length_of_bite(const char* technique) {
  SceneSpec scene = read_scene("purse_string");
  set_value(scene, std::string("technique.name=") + technique);
  set_value(scene, "surgeon.plan=purse_string");
  set_value(scene, "surgeon.bites=1");
  const auto model = build_model(scene);
  const auto state = initial_state(*model), loaded = initial_state(*model);
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  Jobs jobs(1);
  Snapshot seen;
  publish(*model, *state, seen);
  int after = 0;
  for (uint64_t t = 0; t < 60 * 40 && after < 120; ++t) {
    TickInput input = hands.surgeon->operate(seen, 1 / scene.solver.tick_rate);
    input.tick = t;
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    after += !seen.active().bite.empty() && seen.active().bite[0].complete;
  }
  // The memory of a technique is saved with the rest.
  load_state(*model, *loaded, save_state(*model, *state));
  if (after < 120 || hash_state(*model, *loaded) != hash_state(*model, *state)) return -1;
  return distance(seen.active().bite[0].entry, seen.active().bite[0].exit);
}

}  // namespace

int main() {
  register_technique(kPlication);
  const float plain = length_of_bite("none"), gathered = length_of_bite("plication");
  std::printf("entry to exit: %.1f mm without a technique, %.1f mm gathered\n", 1e3 * plain, 1e3 * gathered);
  return plain > 0.004f && gathered > 0 && gathered < 0.7f * plain ? 0 : 1;
}
