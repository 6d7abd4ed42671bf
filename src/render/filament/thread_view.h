// SPDX-License-Identifier: Apache-2.0
// render/filament/thread_view: suture threads as smooth tubes through their particles, one per piece after cuts.
// Also knots as the two strands of every throw wound about each other, baked sutures, and the visual guide from a bite's entry
// to the needle (paper 2.2). All of it is one mesh.
#pragma once
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/filament/mesh.h"
#include "render/filament/tissue_view.h"
#include "render/thread_path.h"

namespace catgut {

struct ThreadView {
  uint32_t capacity = 0;  // maximum number of points of the drawn curve
  std::vector<Vec3> through, piece, curve;
  std::vector<float> radius;
  std::vector<uint8_t> guide;      // per point of the curve: 1 where it belongs to the visual guide
  std::vector<Nearest> on_tissue;  // per knot, then per knot of baked sutures: the tissue below it
  std::vector<VertexLook> look;
  GpuMesh gpu;
  // What the thread is kept out of: the tissue of this frame, the cloth, the instruments (as PictureModel::instrument).
  std::vector<PointGrid> grid;  // per body
  std::vector<Vec3> cloth, cloth_normal;
  PointGrid cloth_grid;
  std::vector<ToolHull> hull;
  std::vector<Vec3> moved;                                     // scratch of move_thread
  std::vector<uint8_t> outside, node_outside, thread_outside;  // likewise: per point of the piece, of `through`, of the thread
};

ThreadView make_thread_view(filament::Engine& engine, filament::Scene& scene, const PictureModel& model,
                            filament::MaterialInstance* material);
void set_cloth(ThreadView& view, std::vector<Vec3> position, std::vector<Vec3> normal);
// pixel: [m] that one pixel covers at 1 m from the camera; sets the minimum width of the thread.
void move_thread(filament::Engine& engine, ThreadView& view, const PictureModel& model, const Snapshot& snapshot,
                 std::span<const TissueView> tissue, const Motions& motion, const Camera& camera, float pixel);

// Where the thread enters or leaves the wall, or did before its bite was torn out.
struct Puncture {
  Vec3 position, made;  // [m] a slit leads from `made` to `position`; not torn: the same place
  float pulled = 0;     // [N] tension of the thread in it
};

// The punctures and slits.
struct MarkView {
  std::vector<Puncture> puncture;  // of this frame
  std::vector<Nearest> on_tissue;  // per suture point
  GpuMesh gpu;
};
MarkView make_mark_view(filament::Engine& engine, filament::Scene& scene, filament::MaterialInstance* material);
void move_marks(filament::Engine& engine, MarkView& view, const Snapshot& snapshot, std::span<const TissueView> tissue,
                const Motions& motion);

}  // namespace catgut
