// SPDX-License-Identifier: Apache-2.0
// app/window: texts of events, progress and results. Pure: plain data in, text out.
#pragma once
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "runtime/session_metrics.h"
#include "sim/scene.h"

namespace catgut {

// "1:07.5": minutes, seconds, tenths; the only time format of the screens.
std::string clock_text(double seconds);

// One line for the event log; empty: the event is not shown. bad: an error.
std::string words_for(const Event& event, bool& bad);

// Whether event i is another exit of a tip that has not entered since: moving tissue covered it for a moment. Not shown.
bool repeated_exit(const std::vector<Event>& events, size_t i);

// Progress of the technique, a few short lines.
std::vector<std::string> technique_lines(const SceneSpec& scene, const Snapshot& seen, const SessionMetrics& metrics);

// What lies on the tray, and what the keys I and K do for this hand.
// Two fixed ends of bowel that an assistant can bring together and draw apart by their clamps.
bool joins_clamped_ends(const SceneSpec& scene);
std::vector<std::string> tray_lines(const Snapshot& seen, const PictureModel& picture, size_t hand);

struct ResultRow {
  std::string name, value;
};
std::vector<ResultRow> result_rows(const SceneSpec& scene, const SessionMetrics& metrics);

// One JSON object on one line.
std::string event_json(const Event& event);

}  // namespace catgut
