// SPDX-License-Identifier: Apache-2.0
// bench/physical: processor time of a millisecond of wall and thread together, on one core: median and 99th percentile of 300.
//   bench_physical             a stitch that is drawn, the same tied, a purse-string that is drawn
//   bench_physical purse       the purse-string alone
//   bench_physical count       ten steps of the drawn stitch between callgrind's marks, for tools/count_instructions.sh
//   bench_physical sutures     1 to 16 stitches side by side: all asleep, one of them drawn, all awake; each against the first
//   bench_physical waiting     a stitch that is drawn while 0 to 49 other strands wait: asleep, awake; each against none
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <vector>

#include "validation/suture_scenes.h"
#ifdef CATGUT_CALLGRIND
#include <valgrind/callgrind.h>
#endif

namespace {
using namespace catgut;
using namespace catgut::validation;

double milliseconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}
void report(const char* what, Sewn& s) {
  std::vector<double> ms;
  for (int i = 0; i < 300; ++i) {
    const double start = milliseconds();
    s.run(0.001f);
    ms.push_back(milliseconds() - start);
  }
  std::sort(ms.begin(), ms.end());
  std::printf(
      "%-28s %4u wall nodes, %3zu thread nodes, %2zu holes, %3zu surface contacts, %2zu lips: %.3f ms (median), %.3f (p99)\n",
      what, 2 * wall::columns(s.state.wall), s.state.thread.nodes(), s.state.hole.size(), s.state.contact.size(),
      s.state.lip.size(), ms[150], ms[297]);
}
double median_step(Sewn& s) {
  std::vector<double> ms;
  for (int i = 0; i < 200; ++i) {
    const double start = milliseconds();
    s.run(0.001f);
    ms.push_back(milliseconds() - start);
  }
  std::sort(ms.begin(), ms.end());
  return ms[100];
}
void compare_sutures() {
  std::array<double, 3> first{};
  for (const int count : {1, 2, 4, 8, 16}) {
    Sewn s = ring_of_stitches({}, count);
    s.run(1.5f);
    std::array<double, 3> ms{};
    ms[0] = median_step(s);
    const bool asleep = s.state.sleep.all();
    thread::Hold end;
    end.stiffness = 200, end.limit = 0.1f, end.from = end.to = s.state.thread.position(0) + Vec3{0.01f, 0, 0};
    s.hold = {end};
    s.run(0.01f);
    ms[1] = median_step(s);
    s.model.sleep.on = false;
    ms[2] = median_step(s);
    if (count == 1) first = ms;
    std::printf(
        "%2d stitches, %4zu nodes, %2zu surface contacts: %s %.3f ms (x %.2f), one drawn %.3f (x %.2f), awake %.3f (x %.2f)\n",
        count, s.state.thread.nodes(), s.state.contact.size(), asleep ? "asleep" : "NOT ASLEEP", ms[0], ms[0] / first[0], ms[1],
        ms[1] / first[1], ms[2], ms[2] / first[2]);
  }
}
// A stitch with both ends held, and strands of 60 nodes beside the tubes that nothing touches.
Sewn with_waiting(int count) {
  Sewn s = interrupted({});
  const thread::State& stitch = s.state.thread;
  std::vector<Vec3> path;
  std::vector<int32_t> hole;
  size_t eyelet = 0;
  for (uint32_t i = 0; i < stitch.nodes(); ++i) {
    path.push_back(stitch.position(i)), hole.push_back(-1);
    if (eyelet == stitch.eyelet.size() || stitch.eyelet[eyelet].segment != i) continue;
    hole.push_back(static_cast<int32_t>(stitch.eyelet[eyelet].point));
    path.push_back(mouth(s.model, s.state, s.state.hole[stitch.eyelet[eyelet++].point]));
  }
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < 60; ++i)
      path.push_back({0.1f + 0.01f * static_cast<float>(k), 0.5e-3f * static_cast<float>(i), 0}), hole.push_back(-1);
  const size_t first = stitch.nodes();
  s.state.thread = thread::make_laced_state(path, hole, Stitch{}.hole_friction);
  for (size_t k = 0; k < static_cast<size_t>(count); ++k) {
    s.state.thread.broken[first - 1 + 60 * k] = 1;
    s.state.thread.rest[first - 1 + 60 * k] = 0.5e-3f;
  }
  const std::vector<thread::Hold> hold = s.hold;
  s.start();
  s.hold = hold;
  return s;
}
void compare_waiting() {
  std::array<double, 2> first{};
  for (const int count : {0, 4, 9, 24, 49}) {
    std::array<double, 2> ms{};
    size_t asleep = 0;
    for (const bool sleep : {true, false}) {
      Sewn s = with_waiting(count);
      s.model.sleep.on = sleep;
      s.run(0.6f);
      std::vector<double> each;
      for (int i = 0; i < 200; ++i) {
        s.hold[0].from = s.hold[0].to, s.hold[0].to.x += 1e-5f;
        const double start = milliseconds();
        s.run(0.001f);
        each.push_back(milliseconds() - start);
      }
      std::sort(each.begin(), each.end());
      ms[sleep ? 0 : 1] = each[100];
      for (const physical::Sleep::Strand& k : s.state.sleep.strand) asleep += k.asleep;
    }
    if (count == 0) first = ms;
    std::printf("%2d strands wait, %2zu asleep: %.3f ms (x %.2f), none asleep %.3f (x %.2f)\n", count, asleep, ms[0],
                ms[0] / first[0], ms[1], ms[1] / first[1]);
  }
}
void count(Sewn& s) {
  constexpr int kSteps = 10;
#ifdef CATGUT_CALLGRIND
  CALLGRIND_ZERO_STATS;
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_TOGGLE_COLLECT;
#endif
  for (int i = 0; i < kSteps; ++i) s.run(0.001f);
#ifdef CATGUT_CALLGRIND
  CALLGRIND_TOGGLE_COLLECT;
  CALLGRIND_STOP_INSTRUMENTATION;
  CALLGRIND_DUMP_STATS;
#endif
  std::printf("stitch throw %d\n", kSteps);
}
}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "sutures") return compare_sutures(), 0;
  if (argc == 2 && std::string_view(argv[1]) == "waiting") return compare_waiting(), 0;
  if (argc < 2 || std::string_view(argv[1]) != "purse") {
    Sewn stitch = interrupted({});
    Tying t;
    t.center = {0.0203f, 0, 0}, t.tension = 2.5f;  // with 3 N the bites may tear
    tie_throw(stitch, t, {3, 1});
    if (argc == 2 && std::string_view(argv[1]) == "count") return count(stitch), 0;
    report("stitch, one throw drawn", stitch);
    tie_throw(stitch, t, {3, -1});
    let_go(stitch);
    stitch.run(0.5f);
    report("stitch, tied, hands away", stitch);
  }
  Stitch q;
  q.hole_friction = 0.1f, q.tail = 0.12f;
  Sewn purse = purse_string(q, 10);
  draw_purse(purse, 1.5f, 1);
  report("purse-string, drawn", purse);
}
