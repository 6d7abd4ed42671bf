// SPDX-License-Identifier: Apache-2.0
// The numbers of docs/one_tick.md. Runs the purse-string like `catgut run purse_string --seed 1` until the tip of the first
// bite enters. Prints input and output of that tick. tools/update_docs.sh copies the
// printed blocks into the page. Reads the State itself (sim/state.h), which other programs do not need.
#include <cmath>
#include <cstdio>

#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/model.h"
#include "sim/state.h"

using namespace catgut;

namespace {

void print(const char* what, Vec3 p) { std::printf("%-32s (%8.3f, %8.3f, %8.3f) mm\n", what, 1e3 * p.x, 1e3 * p.y, 1e3 * p.z); }
void print_force(const char* what, Vec3 f) { std::printf("%-32s (%8.4f, %8.4f, %8.4f) N\n", what, f.x, f.y, f.z); }
Vec3 tip_of(const Model& m, const State& s) {
  return needle_tip(m.solver.needle_arc[0], s.solver.body[m.solver.needle_body(0)]);
}

}  // namespace

int main() {
  SceneSpec scene = read_scene("purse_string");
  set_value(scene, "seed=1");
  const auto model = build_model(scene);
  const auto state = initial_state(*model);
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  const Model& m = *model;
  State& s = *state;
  Jobs jobs(1);
  Snapshot seen;
  TickInput input;
  const auto one_tick = [&] {
    step(m, s, input, jobs);
    publish(m, s, seen);
    ++input.tick;
  };
  input.hand[0].connected = input.hand[1].connected = 0;
  while (input.tick < static_cast<uint64_t>(std::lround(scene.settle * scene.solver.tick_rate))) one_tick();

  std::array<HandState, kMaxHands> hand_before;
  Vec3 tip_before, tool_before;
  std::vector<std::byte> before;
  const auto entered = [&] { return !s.suture.suture[0].bite.empty(); };
  while (!entered() && input.tick < 60 * 60) {
    input.hand = hands.surgeon->operate(seen, 1 / scene.solver.tick_rate).hand;
    before = save_state(m, s);
    hand_before = s.hand;
    tip_before = tip_of(m, s), tool_before = s.solver.body[0].x;
    one_tick();
  }
  if (!entered()) return 1;
  const Bite& bite = s.suture.suture[0].bite[0];
  const Vec3 tip = tip_of(m, s);

  std::printf("[hands]\n");
  std::printf("tick %llu, %.2f s: \"%s\"\n", static_cast<unsigned long long>(input.tick - 1),
              static_cast<double>(input.tick - 1) / scene.solver.tick_rate, hands.surgeon->doing().c_str());
  print("right hand", input.hand[0].pose.p);
  print("  one tick before", hand_before[0].pose.p);
  std::printf("%-32s %8.1f mm/s\n", "  speed, without tremor", 1e3 * length(input.hand[0].velocity));
  std::printf("%-32s %8.2f closed 0 .. 1 open\n", "  jaw", input.hand[0].jaw);
  print("left hand, waiting", input.hand[1].pose.p);

  std::printf("[step]\n");
  std::printf("%d substeps of %.4f ms; %u tissue particles in %u clusters, %u thread particles, %zu rigid bodies\n", m.substeps,
              1e3 * m.solver.h, m.solver.tissue, m.solver.shape.clusters, m.solver.strand[0].count, s.solver.body.size());
  print("tool in the right hand", s.solver.body[0].x);
  std::printf("%-32s %8.3f mm behind its hand, moved %.3f mm\n", "", 1e3 * distance(s.solver.body[0].x, input.hand[0].pose.p),
              1e3 * distance(s.solver.body[0].x, tool_before));
  print("needle tip before", tip_before);
  print("needle tip after", tip);
  std::printf("%-32s %8.3f mm\n", "  displacement", 1e3 * distance(tip, tip_before));

  std::printf("[puncture]\n");
  for (const Event& e : seen.event)
    std::printf("event %-18s which %4u  value %.6f\n", event_name(e.kind), e.which, static_cast<double>(e.value));
  const Vec3 entry = position_of(bite.entry.point, s.solver.x.data());
  print("entry", entry);
  std::printf("%-32s triangle %u, weights %.3f %.3f %.3f; spread over %u particles\n", "", bite.entry.triangle,
              bite.entry.weight[0], bite.entry.weight[1], bite.entry.weight[2], bite.entry.point.count);
  std::printf("%-32s %8.3f mm, below the surface %.3f mm\n", "tip from the entry", 1e3 * distance(tip, entry),
              1e3 * bite.depth);
  if (s.suture.suture[0].attached) {
    const Attachment& a = s.solver.attach[0];
    std::printf("%-32s %u, displaced by %.3f mm, released at %.1f mm\n", "attached particle", bite.nearest,
                1e3 * distance(xyz(s.solver.x[bite.nearest]), s.suture.suture[0].attached_from),
                1e3 * m.suture.release_distance);
    std::printf("%-32s %8.4f N\n", "  force of its spring", length(a.lambda) / (m.solver.h * m.solver.h));
  }
  std::printf("%-32s %zu; suture points: %zu\n", "needle-track constraints", s.solver.channel.size(),
              s.suture.suture[0].point.size());

  std::printf("[forces]\n");
  print_force("on the right hand", seen.tool[0].force);
  print_force("on the left hand", seen.tool[1].force);
  float most = 0;
  for (float t : s.solver.strand[0].tension) most = std::max(most, t);
  std::printf("%-32s %8.5f N at the needle, %.5f N maximum\n", "thread tension", s.solver.strand[0].tension.back(), most);
  for (const NeedleTrackConstraint& c : s.solver.channel)
    std::printf("%-32s %8.4f N lateral, %.4f N along\n", "needle track at the entry",
                length(c.lambda) / (m.solver.h * m.solver.h), c.drag_lambda / (m.solver.h * m.solver.h));

  std::printf("[publish]\n");
  std::printf("snapshot of tick %llu: %zu particles, %zu bites, needle in tissue: %s, opening %.1f mm^2\n",
              static_cast<unsigned long long>(seen.tick), seen.particle.size(), seen.active().bite.size(),
              seen.active().needle.in_tissue ? "yes" : "no", 1e6 * seen.opening_area);

  // Claims of the page that are independent of the numbers: the tip entered here, and the same input from the same state gives
  // the same bits.
  const uint64_t hash = hash_state(m, s);
  const bool first_event = !seen.event.empty() && seen.event[0].kind == EventKind::tip_entered;
  const bool inside = bite.depth >= 0 && phase_of(s.suture.suture[0]) == NeedlePhase::tip_in && s.solver.channel.size() == 1;
  const uint64_t tick = input.tick;
  load_state(m, s, before);
  input.tick = tick - 1;
  Jobs two(2);
  step(m, s, input, two);
  std::printf("[again]\n%s\n",
              hash_state(m, s) == hash ? "the same tick again, with two workers: the same hash" : "it differs");
  return first_event && inside && hash_state(m, s) == hash ? 0 : 1;
}
