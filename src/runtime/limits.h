// SPDX-License-Identifier: Apache-2.0
// runtime: scaling with the number of sutures (paper 3.5, figures 20 to 23): time per tick while each further one is made.
// Runs the scene with the scripted surgeon in lock step. One row per suture: a bite of a running thread, which is a pair of
// suture points, or a single suture (techniques stay and lembert) with its knot.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "render/plot.h"
#include "runtime/session.h"

namespace catgut {

// The ticks from the one after the previous suture (for the first: from the connection of the hands) to the one in which this
// was completed. Sutures completed in the same tick, as in one sweep through two walls, share their ticks.
struct SutureCost {
  uint32_t suture = 0;         // from 1
  uint32_t bites = 0;          // complete in the tissue, those of baked sutures included
  uint32_t suture_points = 0;  // of the current thread
  uint32_t settled = 0;        // tied sutures that are no longer simulated
  double simulated_s = 0;
  uint64_t ticks = 0;
  Percentiles solver_ms, tick_ms;  // per tick; tick_ms: surgeon, step and publish
  uint32_t contacts = 0;           // maximum in a substep
  double fps = 0;                  // 1 / median tick, without rendering
};

// The first and the last suture re-run from the same states with the same inputs, alternating tick by tick. A processor that
// changes its clock or is shared affects both alike. So their ratio is reliable where the times of the rows are not.
// Repeated several times.
struct SutureGrowth {
  struct Pass {
    double first_ms = 0, last_ms = 0;  // solver, median tick
    double ratio() const { return first_ms > 0 ? last_ms / first_ms : 0; }
  };
  uint64_t ticks = 0;      // of each suture per pass; 0: fewer than two sutures
  std::vector<Pass> pass;  // by ratio, ascending
  Pass middle() const { return pass.empty() ? Pass{} : pass[pass.size() / 2]; }
};

struct LimitsResult {
  RunResult run;
  uint32_t wanted = 0;  // sutures
  std::vector<SutureCost> row;
  SutureGrowth growth;
  bool reached() const { return row.size() >= wanted; }
};

// Runs until `sutures` are completed, the surgeon is done or gives up, the scene's duration is over, or hooks.stop is set:
// `row` has the measurements so far. on_row: each row when complete. Throws InputError.
LimitsResult measure_limits(SceneSpec scene, int sutures, int threads, const std::function<void(const SutureCost&)>& on_row,
                            const SessionHooks& hooks = {});

std::string limits_csv_header();  // with a final newline, like each row
std::string limits_csv_row(const SutureCost& row);
// Selected rows, the number reached, and the paper's figures beside Catgut's. bodies: in the scene.
std::string limits_table(const LimitsResult& result, size_t bodies);
Image limits_plot(const LimitsResult& result, size_t bodies, double tick_rate);

}  // namespace catgut
