// app/window: what happened, and where the work stands, in words for a person. Pure: plain data in, text out.
#pragma once
#include <string>
#include <vector>

#include "exchange/snapshot.h"
#include "runtime/practice.h"
#include "sim/scene.h"

namespace catgut {

// Empty for what is of no interest while working. bad: something went wrong.
std::string words_for(const Event& event, bool& bad);

// Where the technique stands, a few short lines.
std::vector<std::string> technique_lines(const SceneSpec& scene, const Snapshot& seen, const Practice& practice);

struct ResultRow {
  std::string name, value;
};
std::vector<ResultRow> result_rows(const SceneSpec& scene, const Practice& practice);

// One JSON object without a line break.
std::string event_json(const Event& event);

}  // namespace catgut
