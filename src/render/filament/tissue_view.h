// SPDX-License-Identifier: Apache-2.0
// render/filament/tissue_view: one soft body's visible surface, moved by geometry/skin.
// Reads the model's VisibleMesh once and a snapshot per frame; writes its own buffers.
#pragma once
#include <span>
#include <unordered_map>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/filament/mesh.h"
#include "render/pucker.h"
#include "render/skinned.h"

namespace catgut {

// A vertex whitened by tension, and its degree.
struct Reached {
  uint32_t vertex;
  float weight;
};

struct TissueView {
  const VisibleMesh* mesh = nullptr;  // the model's
  std::vector<SkinnedVertex> vertex;  // as drawn; vertices on a texture seam are drawn twice
  std::vector<uint8_t> mirrored;      // whether the texture runs clockwise there
  std::vector<Vec3> position;         // skinned, of the last frame
  std::vector<Vec3> drawn;            // the same with the folds of a gathered opening
  RoundOrgan round;                   // of the first vertices: those of the mesh
  std::vector<uint32_t> source;       // per vertex: that of the mesh
  std::vector<Gather> gather;
  std::vector<PackedFrame> frame;
  std::vector<VertexLive> live;
  std::vector<float> press;       // per vertex, of this frame
  std::vector<uint32_t> scarred;  // vertices with a place in Snapshot::scar
  std::vector<uint8_t> stained;   // per scarred vertex: its blood in the last frame
  // Where thread passes through the wall, found on first use: by suture and number of the suture point.
  std::vector<std::vector<std::vector<Reached>>> reached;  // per suture
  std::vector<uint32_t> pressed;                           // vertices with a nonzero `press`
  bool shown = false;                                      // in a previous frame
  GpuMesh gpu;
};

// Ambient visibility by position and normal. A cut renews the surface many times a second, and leaves most of it as it was.
using SkyCache = std::unordered_map<uint64_t, float>;
TissueView make_tissue_view(filament::Engine& engine, filament::Scene& scene, const VisibleMesh& mesh,
                            filament::MaterialInstance* material, SkyCache& known);
void move_tissue(filament::Engine& engine, TissueView& view, const Motions& motion, const Snapshot& snapshot);

// The drawn vertex nearest to a point, among all bodies; -1: none within `reach` [m].
struct Nearest {
  int body = -1;
  uint32_t vertex = 0;
};
Nearest nearest_vertex(std::span<const TissueView> tissue, Vec3 point, float reach);

}  // namespace catgut
