// runtime: see practice.h.
#include "runtime/practice.h"

namespace catgut {

void note(Practice& p, const Snapshot& seen, float dt) {
  if (!p.begun) p.opening_start = seen.opening_area;
  for (size_t k = 0; k < 2; ++k) {
    const float way = distance(seen.tool[k].pose.p, p.tip[k]);
    if (p.begun && way < 0.05f) p.path[k] += way;  // a hand that appears somewhere has not gone there
    p.tip[k] = seen.tool[k].pose.p;
    p.most_force[k] = std::max(p.most_force[k], length(seen.tool[k].force));
  }
  p.begun = true;
  p.time_s += static_cast<double>(dt);
  p.opening = seen.opening_area;
  p.closure = seen.closure;
  for (const Event& e : seen.event) {
    switch (e.kind) {
      case EventKind::bite_completed:
        ++p.bites;
        break;
      case EventKind::bite_cancelled:
        ++p.bites_cancelled;
        break;
      case EventKind::knot_locked:
        ++p.throws;
        p.knots += e.which < seen.knot.size() && seen.knot[e.which].throws == 1;
        break;
      case EventKind::thread_cut:
        ++p.cuts;
        break;
      case EventKind::stitch_settled:
        ++p.stitches_settled;
        break;
      case EventKind::needle_released:
        p.needle_slips += e.value > 0;
        break;
      case EventKind::technique_fault: {
        const size_t fault = static_cast<size_t>(e.value);
        if (fault < p.faults.size()) ++p.faults[fault], ++p.faults_in_all;
        break;
      }
      default:
        break;
    }
  }
}

}  // namespace catgut
