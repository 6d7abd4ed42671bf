// SPDX-License-Identifier: Apache-2.0
// exchange: constant data for rendering a scene. Built once from the model; after that only
// Snapshots go to the renderer.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"
#include "exchange/instrument.h"

namespace catgut {

enum class TissueLayer : uint8_t { serosa = 0, mucosa = 1, cut_edge = 2 };

// The visible surface of one soft body, bound to its particles by linear skinning (paper 2.1): vertex v at rest position
// position[v] follows up to four particles with weights that sum to 1. The moved vertex is
//   sum_k weight_k * (particle_k + R_k (position[v] - rest_k)),  R_k = rotation of the particle's cluster.
struct VisibleMesh {
  std::vector<Vec3> position;                          // [m] at rest
  std::vector<Vec3> normal;                            // unit, at rest, outward
  std::vector<std::array<float, 2>> uv;                // meters along and around the organ / 0.01, for textures
  std::vector<TissueLayer> layer;                      // per vertex
  std::vector<std::array<uint32_t, 3>> triangle;       // counter-clockwise seen from outside
  std::vector<std::array<uint32_t, 4>> skin_particle;  // indices into Snapshot::particle
  std::vector<std::array<float, 4>> skin_weight;       // sum 1
  // Of a wall that a pen has touched, else empty:
  std::vector<uint32_t> scar;  // per vertex: index in Snapshot::scar; kNoScar: none
  std::vector<float> through;  // per vertex: 0 at the outer face of the wall .. 1 at the inner one
};
constexpr uint32_t kNoScar = ~uint32_t{0};

// What surrounds the organ: a surface that does not move and that nothing touches.
enum class SceneryKind : uint8_t { skin, anoderm, drape, steel, elastic };
struct Scenery {
  SceneryKind kind = SceneryKind::skin;
  std::vector<Vec3> position, normal, color;      // [m], unit, linear
  std::vector<std::array<float, 2>> uv;           // skin, drape: centimeters; steel, elastic: meters along, 0..1 round
  std::vector<std::array<uint32_t, 3>> triangle;  // counter-clockwise seen from outside
};

// A needle and its thread, for rendering and grasping.
struct SuturePicture {
  uint32_t thread_first = 0;  // slot of the first thread particle in Snapshot::particle
  uint32_t thread_count = 0;
  float thread_radius = 0.00015f;       // [m]
  float thread_spacing = 0.0016f;       // [m] rest distance of neighbors at the start
  float needle_radius = 0.00828f;       // [m] of the needle's circle
  float needle_arc = kPi;               // [rad]
  float needle_wire_radius = 0.00033f;  // [m]
};

struct PictureModel {
  std::string title;
  std::vector<VisibleMesh> body;
  // [m] rest position of every tissue particle. Of a tissue that was divided (TopologyView): of every particle, those of
  // threads being zero.
  std::vector<Vec3> particle_rest;
  std::vector<SuturePicture> suture = std::vector<SuturePicture>(1);  // as Snapshot::suture
  // Draws a strand from the entry of an open bite to the needle (paper 2.2), where the paper has no thread. Preset "paper"
  // only.
  bool visual_guide = false;
  std::vector<Scenery> scenery;               // empty: drape, wound and gauze of a bowel on a table
  std::vector<InstrumentPicture> instrument;  // as Snapshot::instrument
  Vec3 focus;                                 // [m] center of the operating field
  float field = 0.1f;                         // [m] its radius
  float drape = -0.035f;                      // [m] height of the sterile drape (horizontal), through which the organ protrudes
  // One per wall that the procedure works on: tissue particles round its near opening, in order, on its outer side. Walls are
  // numbered: one per bowel end, and two (outer, inner) for a bowel folded into itself.
  std::vector<std::vector<uint32_t>> rim;
  std::vector<uint8_t> wall;  // as particle_rest
  // Physical mechanics: places of the wall. Particles 2i and 2i + 1 are the outer and the inner face of place i.
  uint32_t columns = 0;
};

}  // namespace catgut
