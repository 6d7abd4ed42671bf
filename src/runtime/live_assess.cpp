// SPDX-License-Identifier: Apache-2.0
// runtime: the assessment of an interactive session: facts after every tick, remarks after every stitch, the result at the end.
// All functions belong to the physics thread; see live_work.h.
#include <algorithm>

#include "assess/metrics.h"
#include "runtime/assessment.h"
#include "runtime/live_work.h"

namespace catgut {

void Live::Work::begin_assessment() { facts = assess::begin_facts(picture, assess_setup(scene)); }

// A demonstration is not the user's work: going back to the learner's state also restores the tally.
void Live::Work::assess_tick() {
  if (published.demonstrating || published.preparing) return;
  // The tick of the newest bite or throw: that of its event, not of the snapshot.
  const auto newest = [&] {
    uint64_t t = 0;
    for (const assess::Bite& b : facts.bite) t = std::max(t, b.tick);
    for (const assess::Knot& k : facts.knot) t = std::max(t, k.tick);
    return t;
  };
  const uint64_t last = newest();
  assess::note(facts, picture, now, input);
  if (!options.remarks || options.rubric.empty() || newest() == last) return;
  // A full queue drops remarks: the result has them all.
  for (const assess::Remark& r : assess::remarks_since(options.rubric[0], facts, last)) remarks.push(r);
}

void Live::Work::finish_assessment() {
  assess::Result& r = result.assessment;
  r = assess::measure(facts, picture, now);
  r.catgut_version = catgut_version();
  r.scene = scene.name, r.title = scene.title;
  r.surgeon = options.surgeon.empty() ? "user" : options.surgeon;
  r.seed = scene.seed;
  r.state_hash = hash_state(*model, *state);
  for (const assess::Rubric& rubric : options.rubric) r.score.push_back(assess::mark(rubric, r));
}

}  // namespace catgut
