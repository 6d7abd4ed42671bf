// SPDX-License-Identifier: Apache-2.0
// runtime: how many sutures a scene bears (paper 3.5, figures 20 to 23): what a tick costs while each further one is sutured.
// Runs the scene with the scripted surgeon in lock step; one row per suture: a bite of a running thread, which is a pair of
// suture points, or a single suture (techniques stay and lembert) with its knot.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "render/plot.h"
#include "runtime/session.h"

namespace catgut {

// The ticks from the one after the suture before (for the first: from when the hands were let in) to the one in which this was
// completed. Sutures completed in the same tick, as one sweep through two walls may do, have the same ticks.
struct SutureCost {
  uint32_t suture = 0;         // from 1
  uint32_t bites = 0;          // that lie complete in the tissue, those of settled stitches included
  uint32_t suture_points = 0;  // of the thread in hand
  uint32_t settled = 0;        // stitches that are tied and no longer simulated
  double simulated_s = 0;
  uint64_t ticks = 0;
  Percentiles solver_ms, tick_ms;  // per tick; tick_ms: surgeon, step and publish
  uint32_t contacts = 0;           // the most in a substep
  double fps = 0;                  // that the median tick would allow, with nothing drawn
};

// The first and the last suture re-run, by the same hands from the same states, in turns: a tick of the one, a tick of the
// other. A processor that changes its clock or is shared does it to both alike, so that their ratio can be trusted where the
// rows' times cannot; and as it is not quite the same slow or fast, all of that several times.
struct SutureGrowth {
  struct Pass {
    double first_ms = 0, last_ms = 0;  // solver, median tick
    double ratio() const { return first_ms > 0 ? last_ms / first_ms : 0; }
  };
  uint64_t ticks = 0;      // of each suture in a pass; 0: fewer than two sutures
  std::vector<Pass> pass;  // by ratio, the smallest first
  Pass middle() const { return pass.empty() ? Pass{} : pass[pass.size() / 2]; }
};

struct LimitsResult {
  RunResult run;
  uint32_t wanted = 0;  // sutures
  std::vector<SutureCost> row;
  SutureGrowth growth;
  bool reached() const { return row.size() >= wanted; }
};

// Until `sutures` are completed, the surgeon is done or gives up, the scene's duration is over, or hooks.stop is set: `row` has
// what was measured by then. on_row: each as it is completed. Throws InputError.
LimitsResult measure_limits(SceneSpec scene, int sutures, int threads, const std::function<void(const SutureCost&)>& on_row,
                            const SessionHooks& hooks = {});

std::string limits_csv_header();  // with a final newline, as each row
std::string limits_csv_row(const SutureCost& row);
// A few of the rows, how far it came, and the paper's figures beside ours. bodies: in the scene.
std::string limits_table(const LimitsResult& result, size_t bodies);
Image limits_plot(const LimitsResult& result, size_t bodies, double tick_rate);

}  // namespace catgut
