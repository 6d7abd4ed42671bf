// SPDX-License-Identifier: Apache-2.0
// app/window: the texts of the work screens as panels, in the order of their importance: procedure, bite, state, instrument,
// log, keys. Pure: plain data in and out; app/window/layout places them.
#pragma once
#include <optional>
#include <vector>

#include "device/bite_guide.h"
#include "procedure/procedure.h"
#include "window/layout.h"
#include "window/panels.h"

namespace catgut {

// Keys that were used already: their lines leave the list.
struct UsedKeys {
  uint32_t bits = 0;
  void note(const WindowInput& in);
};

struct WorkText {
  const WorkView* view = nullptr;
  const Procedure* procedure = nullptr;  // null: none
  bool tutorial = false;
  std::optional<BiteGuide> guide;  // planned bite, if it is shown
  UsedKeys used;
};

std::vector<Panel> work_panels(const WorkText& work, const Settings& settings);
Panel procedure_panel(const Procedure& procedure, const LiveStatus& status, const Snapshot& seen, Guidance guidance,
                      bool tutorial);

}  // namespace catgut
