// render/filament/thread_view: the suture thread as a smooth tube through its particles, in as many pieces as it was cut into;
// knots as the turns of their throws; settled stitches. All of it is one mesh.
#pragma once
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/filament/mesh.h"

namespace catgut {

struct ThreadView {
  uint32_t capacity = 0;  // points of the drawn curve at most
  std::vector<Vec3> through, piece, curve;
  std::vector<float> radius;
  Shape tube;
  GpuMesh gpu;
};

ThreadView make_thread_view(filament::Engine& engine, filament::Scene& scene, const PictureModel& model,
                            filament::MaterialInstance* material);
// pixel: [m] that one pixel covers at 1 m from the camera; the thread is drawn wide enough to be seen.
void move_thread(filament::Engine& engine, ThreadView& view, const PictureModel& model, const Snapshot& snapshot,
                 const Camera& camera, float pixel);

}  // namespace catgut
