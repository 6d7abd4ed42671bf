// SPDX-License-Identifier: Apache-2.0
// render/quality: which of the three levels of quality a machine bears, by a short measurement at its first start.
#pragma once
#include <span>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/renderer.h"

namespace catgut {

struct QualityTrial {
  Quality quality = Quality::low;
  double frame_ms = 0;  // [ms] the median of some frames, until the last pixel was there; of frames a quarter of the size each
                        // way where even those were too slow
};

// The best level whose frames took at most `budget_ms`; draft when none did.
Quality best_quality(std::span<const QualityTrial> trials, double budget_ms);

// [ms] of a frame at 60 Hz that the picture may take, when the simulation and the panels want their share.
constexpr double kFrameBudget = 12;

struct QualityChoice {
  Quality quality = Quality::low;
  std::vector<QualityTrial> trials;  // from draft up; what comes after one that is too slow is not tried
};

// Draws some frames of the scene, unseen, at the window's size. Takes a second or so with a graphics card and a few without
// one. Call it before the window's own renderer is made, on the thread that will make it. Never throws: without a driver it
// answers draft, and no trials.
QualityChoice choose_quality(const PictureModel& model, const Snapshot& snapshot, int width, int height,
                             double budget_ms = kFrameBudget);

}  // namespace catgut
