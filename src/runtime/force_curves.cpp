// SPDX-License-Identifier: Apache-2.0
// runtime/force_curves: see the header.
#include "runtime/force_curves.h"

#include <algorithm>
#include <cmath>

#include "haptic/servo.h"
#include "runtime/hands.h"
#include "runtime/haptics.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

Vec3 tip_of(const Snapshot& seen, const PictureModel& picture) {
  const SuturePicture& needle = picture.suture[seen.active_suture];
  const float r = needle.needle_radius, a = needle.needle_arc;
  return transform(seen.active().needle.pose, Vec3{r * std::cos(a), r * std::sin(a), 0});
}

// [m] extension of the thread; 0 when it is slack.
float stretch_of(const Snapshot& seen) {
  float length = 0;
  for (size_t i = 0; i + 1 < seen.active().thread_order.size(); ++i)
    if (!seen.active().thread_cut[i])
      length += distance(seen.particle[seen.active().thread_order[i]], seen.particle[seen.active().thread_order[i + 1]]);
  return std::max(0.0f, length - seen.active().thread_rest);
}

}  // namespace

void follow(PaperSpring& spring, const Snapshot& seen, const PictureModel& picture) {
  for (const Event& e : seen.event) {
    if (e.kind == EventKind::particle_attached) spring.attached = true, spring.from = tip_of(seen, picture);
    if (e.kind == EventKind::particle_released || e.kind == EventKind::tip_exited || e.kind == EventKind::bite_withdrawn ||
        e.kind == EventKind::suture_loaded)
      spring.attached = false;
  }
}

ForcePatch paper_patch(const PaperSpring& spring, const Snapshot& seen, const PictureModel& picture, size_t k) {
  ForcePatch p;
  const ForcePatch& now = seen.patch[k];
  p.tick = now.tick, p.discontinuity_id = now.discontinuity_id, p.period = now.period, p.expiry = now.expiry,
  p.point = now.point;
  if (spring.attached && seen.tool[k].held == Held::needle) p.force += (spring.from - tip_of(seen, picture)) * kPaperStiffness;
  if (seen.tool[k].held == Held::thread) p.force += now.thread_direction * (kPaperStiffness * stretch_of(seen));
  const float most = length(p.force);
  if (most > kPaperMost) p.force *= kPaperMost / most;
  p.cap = kPaperMost;
  return p;
}

FeltCurves feel_a_stitch(SceneSpec scene, bool knot, const std::atomic<bool>& stop) {
  prepare_for_arms(scene);
  const auto model = build_model(scene);
  const PictureModel picture = picture_model(*model);
  StatePtr state = initial_state(*model);
  Jobs jobs(1);
  Hands hands = make_hands("scripted", scene, picture);
  TickInput input;
  for (ToolInput& h : input.hand) h.connected = 0;
  Snapshot seen;
  const float dt = 1 / scene.solver.tick_rate;
  const int settle = static_cast<int>(scene.settle * scene.solver.tick_rate),
            last = static_cast<int>(scene.duration * scene.solver.tick_rate);
  FeltCurves out;
  std::array<ForceModel, 2> felt;
  std::array<Vec3, 2> at;
  PaperSpring paper;
  Vec3 tip, pulled_from;
  double travel = 0;
  bool in_bite = false, bitten = false, in_knot = false;
  size_t puller = 0;
  for (int i = 0; i < last && !stop.load(std::memory_order_relaxed); ++i) {
    const std::array<ForcePatch, kMaxHands> heard = seen.patch;  // one tick late, as in a run with devices
    if (i >= settle) input = hands.surgeon->operate(seen, dt);
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    follow(paper, seen, picture);
    std::array<float, 2> force{}, most{};
    constexpr int kParts = 4;  // milliseconds per tick
    for (size_t k = 0; k < 2; ++k) {
      ForcePatch patch = heard[k];
      if (!make_safe(patch, {10, 10, 400, 4})) patch = {};
      receive(felt[k], patch);
      const Vec3 to = input.hand[k].pose.p, v = (to - at[k]) / dt;
      for (int part = 1; part <= kParts; ++part) {
        force[k] = length(evaluate(felt[k], lerp(at[k], to, static_cast<float>(part) / kParts), v, dt / kParts));
        most[k] = std::max(most[k], force[k]);
      }
      at[k] = to;
    }
    const Vec3 tip_now = tip_of(seen, picture);
    for (const Event& e : seen.event) {
      if (e.kind == EventKind::tip_entered && !bitten) in_bite = bitten = true, travel = 0, tip = tip_now;
      if (e.kind == EventKind::tip_exited && in_bite && out.exit_mm == 0) out.exit_mm = travel;
      if (e.kind == EventKind::throw_started && !in_knot && out.knot.empty())
        in_knot = true, puller = e.who, pulled_from = at[e.who];
      if (e.kind == EventKind::throw_locked && in_knot) return out;
      if (e.kind == EventKind::throw_undone) in_knot = false, out.knot.clear();
    }
    const bool drives = seen.tool[0].held == Held::needle;
    if (in_bite && drives) {
      travel += 1e3 * double{distance(tip, tip_now)};
      out.bite.push_back({travel, double{most[0]}, double{length(paper_patch(paper, seen, picture, 0).force)}});
    }
    tip = tip_now;
    if (!seen.active().needle.in_tissue || !drives) in_bite = in_bite && drives && seen.active().needle.in_tissue;
    if (in_knot)
      out.knot.push_back({1e3 * double{distance(at[puller], pulled_from)}, double{most[puller]},
                          double{length(paper_patch(paper, seen, picture, puller).force)}});
    if (hands.surgeon->done() || (!knot && bitten && !in_bite)) break;
  }
  return out;
}

}  // namespace catgut
