// SPDX-License-Identifier: Apache-2.0
// runtime: what a person's session reports, collected from any run: `run`, `replay` and `play` write the same results. Fed with
// the Snapshot of every tick.
#pragma once
#include <string>

#include "assess/stitch_map.h"
#include "exchange/picture.h"
#include "runtime/live.h"
#include "runtime/session_metrics.h"
#include "sim/scene.h"

namespace catgut {

class SessionLog {
 public:
  void start(const SceneSpec& scene, const PictureModel& picture);
  void tick(const Snapshot& seen);  // ticks while the scene settles are left out
  LiveResult result() const;

 private:
  PictureModel picture_;
  SessionMetrics metrics_;
  StitchMap map_;
  double tick_s_ = 1.0 / 60, settle_s_ = 0;  // [s]
  uint64_t ticks_ = 0;
};

// `json` with the results of the session under "session": the object that session_json (runtime/report) writes.
std::string with_session(const std::string& json, const SceneSpec& scene, const LiveResult& result);
// The same as a table with one value per row: kind, number, time_s, name, value, unit. Kinds: result, fault, stitch, tension,
// event.
std::string session_csv(const LiveResult& result);

}  // namespace catgut
