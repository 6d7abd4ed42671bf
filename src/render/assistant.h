// SPDX-License-Identifier: Apache-2.0
// render: the assistant's scissors. Where no instrument of the scene cuts thread, a pair of scissors appears at each cut,
// closes and withdraws. Drawn only: nothing touches it. Reads Snapshots in the order in which they are shown; writes its
// memory.
#pragma once
#include <optional>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

struct CutWatch {
  // Per suture: SutureView::thread_cut of the last snapshot, and last whether the thread was off its needle.
  std::vector<std::vector<uint8_t>> cut;
  uint64_t tick = 0;  // of the last snapshot
  double time_s = 0;
  bool started = false;
  double since_s = -1;  // simulated time of the last cut that was seen; below 0: none
  Pose pose;            // of the scissors at that cut
};

// The scissors in this snapshot; none: no cut within the last second. Its pose is that of instruments: tip at the origin,
// handle along +z. A cut before the first snapshot is not shown.
std::optional<InstrumentView> assistants_scissors(CutWatch& watch, const PictureModel& model, const Snapshot& seen);

}  // namespace catgut
