// SPDX-License-Identifier: Apache-2.0
// render/quality: see quality.h.
#include "render/quality.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

namespace catgut {
namespace {

constexpr int kFrames = 7;

// The first frame compiles the materials for the level and is not counted.
double median_frame(Renderer& renderer, const Snapshot& snapshot, const Camera& camera, double budget_ms) {
  std::vector<double> took;
  renderer.draw(snapshot, camera);
  for (int i = 0; i < kFrames; ++i) {
    const auto start = std::chrono::steady_clock::now();
    renderer.draw(snapshot, camera);
    took.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    // Clear enough: the user is waiting.
    if (*std::min_element(took.begin(), took.end()) > 2 * budget_ms) break;
  }
  std::sort(took.begin(), took.end());
  return took[took.size() / 2];
}

}  // namespace

Quality best_quality(std::span<const QualityTrial> trials, double budget_ms) {
  Quality best = Quality::low;
  for (const QualityTrial& t : trials)
    if (t.frame_ms <= budget_ms && t.quality > best) best = t.quality;
  return best;
}

QualityChoice choose_quality(const PictureModel& model, const Snapshot& snapshot, int width, int height, double budget_ms) {
  QualityChoice choice;
  const Camera camera = overview(model);
  width = std::clamp(width, 16, 8192), height = std::clamp(height, 16, 8192);
  try {
    // Without a graphics card a full image takes a second: a small one is sufficient.
    {
      const auto small = make_renderer(model, std::max(16, width / 4), std::max(16, height / 4), Quality::low);
      const double least = median_frame(*small, snapshot, camera, budget_ms);
      if (least > budget_ms) return {Quality::low, {{Quality::low, least}}};
    }
    for (const Quality quality : {Quality::low, Quality::medium, Quality::high}) {
      const auto renderer = make_renderer(model, width, height, quality);
      choice.trials.push_back({quality, median_frame(*renderer, snapshot, camera, budget_ms)});
      if (choice.trials.back().frame_ms > budget_ms) break;
    }
  } catch (const std::runtime_error&) {}  // the window's renderer reports the same error to its caller
  choice.quality = best_quality(choice.trials, budget_ms);
  return choice;
}

}  // namespace catgut
