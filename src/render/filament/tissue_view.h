// render/filament/tissue_view: one soft body's visible surface, moved by geometry/skin.
// Reads the model's VisibleMesh once and a snapshot per picture; writes its own buffers.
#pragma once
#include <span>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/filament/mesh.h"

namespace catgut {

struct TissueView {
  const VisibleMesh* mesh = nullptr;   // the model's
  std::vector<uint32_t> source;        // drawn vertex -> mesh vertex; vertices on a texture seam are drawn twice
  std::vector<uint32_t> along;         // drawn vertex -> mesh vertex next to it in the texture's u direction
  std::vector<uint8_t> against;        // whether `along` lies toward smaller u
  std::vector<uint8_t> mirrored;       // whether the texture runs clockwise there
  std::vector<Vec3> position, normal;  // of the mesh, from skin
  std::vector<Vec3> drawn_position, drawn_normal, drawn_tangent;
  GpuMesh gpu;
};

TissueView make_tissue_view(filament::Engine& engine, filament::Scene& scene, const VisibleMesh& mesh,
                            filament::MaterialInstance* material);
void move_tissue(filament::Engine& engine, TissueView& view, const PictureModel& model, const Snapshot& snapshot);

}  // namespace catgut
