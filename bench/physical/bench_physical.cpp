// SPDX-License-Identifier: Apache-2.0
// bench/physical: processor time of a millisecond of wall and thread together, on one core: median and 99th percentile of 300.
//   bench_physical             a stitch that is drawn, the same tied, a purse-string that is drawn
//   bench_physical purse       the purse-string alone
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "validation/suture_scenes.h"

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
}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || std::string_view(argv[1]) != "purse") {
    Sewn stitch = interrupted({});
    Tying t;
    t.center = {0.0203f, 0, 0}, t.tension = 3;
    tie_throw(stitch, t, {3, 1});
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
