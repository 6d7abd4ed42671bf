// SPDX-License-Identifier: Apache-2.0
// render/quality: selects one of the three quality levels for a machine, by a short measurement at its first start.
#pragma once
#include <span>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/renderer.h"

namespace catgut {

struct QualityTrial {
  Quality quality = Quality::low;
  double frame_ms = 0;  // [ms] median of several frames, until the last pixel was complete; of frames of a quarter in each
                        // direction where even those were too slow
};

// The best level whose frames took at most `budget_ms`; low if none did.
Quality best_quality(std::span<const QualityTrial> trials, double budget_ms);

// [ms] of a frame at 60 Hz available for rendering; the simulation and the panels need the rest.
constexpr double kFrameBudget = 12;

struct QualityChoice {
  Quality quality = Quality::low;
  std::vector<QualityTrial> trials;  // from low up; levels after a slow one are not measured
};

// Renders several frames of the scene, hidden, at the window's size. Takes about a second with a graphics card and a few
// without one. Call it before the window's own renderer is created, on the thread that will create it. Never throws: without a
// driver it returns low, and no trials.
QualityChoice choose_quality(const PictureModel& model, const Snapshot& snapshot, int width, int height,
                             double budget_ms = kFrameBudget);

}  // namespace catgut
