// SPDX-License-Identifier: Apache-2.0
// render/frame_cost: processor time of a frame before rasterization. It moves the meshes, submits them and
// records the draws for every eye, on Filament's backend that renders nothing. The remainder of a headset's 11 ms is
// available to the graphics card and the simulation.
#pragma once
#include <memory>
#include <span>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/renderer.h"

namespace catgut {

class FrameCost {
 public:
  struct Times {
    double caller_ms = 0;  // [ms] of processor time on the calling thread
    double all_ms = 0;     // [ms] of processor time of the whole program in that time, the driver's thread included
  };
  virtual ~FrameCost() = default;
  virtual Times frame(const Snapshot& snapshot, std::span<const Camera> eyes) = 0;
};

// Throws std::runtime_error in a build without pictures. Needs no graphics driver.
std::unique_ptr<FrameCost> make_frame_cost(const PictureModel& model, int width, int height, Quality quality, int eyes);

}  // namespace catgut
