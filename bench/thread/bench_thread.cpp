// SPDX-License-Identifier: Apache-2.0
// bench/thread: time per millisecond of the physical thread: 300 segments with a 2-1-1 knot, pulled tight and under 3 N.
//   bench_thread             milliseconds per simulated millisecond, one core: median and best of 200
//   bench_thread count       ten steps between callgrind's marks, for tools/count_instructions.sh
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string_view>
#include <vector>

#include "validation/knot_scenes.h"
#ifdef CATGUT_CALLGRIND
#include <valgrind/callgrind.h>
#endif

int main(int argc, char** argv) {
  using namespace catgut;
  const bool count = argc > 1 && std::string_view(argv[1]) == "count";
  const thread::Settings settings = validation::knot_settings(0.3f);
  validation::Tightened t(
      validation::lay_knot(validation::surgeons_211(), settings.material.diameter, 0.5e-3f, 40e-3f, 20.8e-3f));
  thread::State& state = t.knot.state;
  validation::tighten(settings, t, 2, validation::Drawing::flat, 0.2f);
  const thread::Pull pull[2] = {{t.knot.load_a, {-3, 0, 0}}, {t.knot.load_b, {3, 0, 0}}};
  thread::Surroundings around;
  around.pulls = pull;
  for (int i = 0; i < 50; ++i) t.stepper.step(settings, state, around);
  size_t near = 0, loaded = 0;
  for (const thread::Crossing& c : state.crossing) {
    near += c.gap < 0.15f * settings.material.diameter;
    loaded += c.normal_impulse > 0;
  }
  if (count) {
    constexpr int kSteps = 10;
#ifdef CATGUT_CALLGRIND
    CALLGRIND_ZERO_STATS;
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_TOGGLE_COLLECT;
#endif
    for (int i = 0; i < kSteps; ++i) t.stepper.step(settings, state, around);
#ifdef CATGUT_CALLGRIND
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_STOP_INSTRUMENTATION;
    CALLGRIND_DUMP_STATS;
#endif
    std::printf("thread knot %d\n", kSteps);
    return 0;
  }
  std::vector<double> ms;
  for (int i = 0; i < 200; ++i) {
    const auto start = std::chrono::steady_clock::now();
    t.stepper.step(settings, state, around);
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(ms.begin(), ms.end());
  std::printf("%zu segments, 2-1-1 knot: %zu pairs, %zu near, %zu loaded; %.3f ms per simulated ms (median), %.3f best\n",
              state.segments(), state.key.size(), near, loaded, ms[100], ms[0]);
}
