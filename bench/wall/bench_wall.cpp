// SPDX-License-Identifier: Apache-2.0
// bench/wall: time per step of the wall on one core, and of its other operations: points, contact, a cut, a new factor.
// Microseconds of the thread's own processor time, median and 99th percentile; other programs' time does not count.
//   bench_wall            the wall of the purse-string's size (1216 nodes) and four times as many
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "wall/contact.h"
#include "wall/cut.h"

namespace {
using namespace catgut;
using namespace catgut::wall;

double microseconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}
void report(const char* what, int times, const std::function<void()>& work) {
  std::vector<double> us;
  for (int i = 0; i < times; ++i) {
    const double start = microseconds();
    work();
    us.push_back(microseconds() - start);
  }
  std::sort(us.begin(), us.end());
  std::printf("  %-42s median %8.1f us   p99 %8.1f us\n", what, us[us.size() / 2], us[us.size() * 99 / 100]);
}

void bench(int around, int rings) {
  Spec s;
  TubeShape shape;
  shape.around = around, shape.rings = rings;
  s.mesh = tube(shape);
  Wall w = build_wall(s);
  Jobs jobs(1);
  std::printf("%u nodes, %u entries of the factor, inertia scale %.2f\n", 2 * columns(w.state), w.model.report.entries,
              static_cast<double>(w.model.report.scale));
  const auto all = [&] {
    w.scratch.external[0].x = 0.1f;
    begin_step(w.model, w.state, w.scratch, jobs);
    finish_step(w.model, w.state, jobs);
  };
  for (int i = 0; i < 200; ++i) all();
  report("step", 1000, all);
  report("  elements", 1000, [&] {
    block_forces(w.model.block.data(), w.state.topology.corners.data(), w.state.motion.x.data(), w.state.motion.turn.data(),
                 w.scratch.block_force.data(), 0, static_cast<uint32_t>(w.model.block.size()));
  });
  report("  solve", 1000, [&] { solve(w.state.topology.factor, w.scratch.rhs.data()); });

  Coupling thread;
  std::vector<Point> hole;
  for (int k = 0; k < 12; ++k) hole.push_back({static_cast<uint32_t>(around + k * around / 12), 0, 0, 0});
  thread.set_points(w.model, w.state.topology, hole);
  thread.begin(w.model, w.state);
  report("12 points: begin, 20 x push all, end", 300, [&] {
    thread.begin(w.model, w.state);
    for (int k = 0; k < 20; ++k) {
      thread.advance(5e-5f);
      for (size_t i = 0; i < hole.size(); ++i) thread.push(i, {1e-9f, 0, 0});
    }
    thread.end(w.state, w.scratch);
  });

  ContactSolver solver;
  std::vector<Obstacle> tool(1);
  tool[0].radius = 0.003f;
  int i = 0;
  report("capsule pressed and dragged, beside the step", 1000, [&] {
    const float d = 0.004f * std::min(1.0f, static_cast<float>(i) / 400),
                z = -0.0365f - 1e-5f * static_cast<float>(std::max(0, i - 400));
    tool[0].a = {0.023f - d, -0.01f, z}, tool[0].b = {0.023f - d, 0.01f, z};
    tool[0].speed_a = tool[0].speed_b = i < 400 ? Vec3{-0.01f, 0, 0} : Vec3{0, 0, -0.01f};
    ++i;
    find_contacts(w.model, w.state, tool, solver);
    warm_start(w.model, w.scratch, solver);
    begin_step(w.model, w.state, w.scratch, jobs);
    solve_contacts(w.model, w.state, w.scratch, tool, solver);
    finish_step(w.model, w.state, jobs);
  });
  std::printf("    with %zu contacts at the end, %d sweeps\n", solver.contact.size(), solver.swept);

  std::vector<std::array<uint32_t, 2>> edge;
  for (int k = 0; k < rings / 3; ++k)
    edge.push_back({static_cast<uint32_t>(k * around), static_cast<uint32_t>((k + 1) * around)});
  Wall q = w;
  report("cut of a third of the length", 1, [&] { cut(q.model, q.state, q.scratch, edge); });
  report("new factor", 5, [&] { refactor(q.model, q.state, q.scratch); });
}

}  // namespace

int main() {
  bench(32, 19);
  bench(64, 38);
}
