// SPDX-License-Identifier: Apache-2.0
// runtime: force of a bite and of a knot on the hand, as curves. Catgut's beside the paper's spring, which `catgut play
// --haptics paper` renders too. `catgut bench haptics --out DIR` draws them.
#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "sim/scene.h"

namespace catgut {

// The paper's rendering (2.2, 4): while the tip is attached to a particle, 1100 N/m times its depth; on held thread as
// much times its extension. A pure force, held until the next tick, at most 3.3 N. No friction, no drop at puncture.
constexpr float kPaperStiffness = 1100, kPaperMost = 3.3f;  // [N/m], [N]
struct PaperSpring {
  bool attached = false;
  Vec3 from;  // [m] entry of the tip
};
// Once per tick, before paper_patch.
void follow(PaperSpring& spring, const Snapshot& seen, const PictureModel& picture);
ForcePatch paper_patch(const PaperSpring& spring, const Snapshot& seen, const PictureModel& picture, size_t hand);

struct FeltPoint {
  double mm = 0;               // of the tip since entry; of the pulling hand since the start of the throw
  double ours = 0, paper = 0;  // [N] at the motors, before the soft map
};
struct FeltCurves {
  std::vector<FeltPoint> bite, knot;
  double exit_mm = 0;  // exit of the tip; 0: none
};
// The scripted surgeon's first bite and, on request, first throw in the scene (as with devices), each rendered at 1 kHz
// through the force model.
FeltCurves feel_a_stitch(SceneSpec scene, bool knot, const std::atomic<bool>& stop);

}  // namespace catgut
