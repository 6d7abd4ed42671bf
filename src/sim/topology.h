// SPDX-License-Identifier: Apache-2.0
// sim/topology: effect of a cut on the tissue. A cut divides the tissue along faces of its cells (tetrahedra). Particles on
// the cut are copied, corners of cells remapped. The faces on both sides become surface. All other mesh data
// (masses, clusters, contact, rims, visible surface) is a pure function of the scene's model and of `Topology`. So only
// `Topology` is state. Molino et al. 2004 (virtual nodes, doi 10.1145/1015706.1015734) copy particles in the same way.
//
// Numbering. Tissue particles and surface triangles keep their index permanently. Copies follow the built tissue, exposed
// faces follow the built surface. In the columns of the solver, threads follow the tissue, so their slots move when
// particles are added. A Snapshot keeps their numbers and lists copies after the threads (see public_index).
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/reflect.h"
#include "exchange/event.h"
#include "exchange/picture.h"
#include "geometry/mesh.h"

namespace catgut {

struct Model;
struct State;

struct Topology {
  // A corner of a cell that refers to a copy.
  struct Corner {
    uint32_t cell = 0, corner = 0, particle = 0;
  };
  // A face of a cell that a cut exposed. Face k is opposite corner k.
  struct Face {
    uint32_t cell = 0, face = 0;
  };
  uint32_t version = 0;          // change counter; 0: as built, all lists empty
  std::vector<uint32_t> source;  // per copy: its source particle in the model
  std::vector<Corner> corner;    // sorted by cell and corner
  std::vector<Face> face;        // in the order of exposure
};
constexpr void reflect(auto& a, Like<Topology::Corner> auto& c) { a(c.cell), a(c.corner), a(c.particle); }
constexpr void reflect(auto& a, Like<Topology::Face> auto& f) { a(f.cell), a(f.face); }
constexpr void reflect(auto& a, Like<Topology> auto& t) { a(t.version), a(t.source), a(t.corner), a(t.face); }

// Particle indices of face `face`, counter-clockwise seen from outside the cell.
constexpr Triangle face_of(const Tet& cell, uint32_t face) {
  constexpr uint32_t kCorner[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  return {cell[kCorner[face][0]], cell[kCorner[face][1]], cell[kCorner[face][2]]};
}

// The model of the state's topology: the scene's own until the first division.
const Model& current_model(const Model& model, const State& state);

// Divides tissue between two ticks along inner faces of its cells. A particle is copied only where the cut separates the cells
// around it: the inner end of a slit stays whole. Embedded points keep their position and stay on their side of the cut.
// Returns the number of added particles; 0: the faces separate nothing, and the state is unchanged.
uint32_t divide(const Model& model, State& state, std::span<const Topology::Face> faces);

// Divides wall `wall` (Model::wall) along the faces nearest to a plane in the current configuration. normal: of any length.
uint32_t divide_by_plane(const Model& model, State& state, uint32_t wall, Vec3 point, Vec3 normal);

// Error of a loaded topology with respect to the scene's model; empty: none.
std::string topology_error(const Model& model, const Topology& topology);

// Call after State::topology was loaded or changed: derives the model again and clears the scratch.
void apply_topology(const Model& model, State& state);

// Derives the model of a valid topology.
std::shared_ptr<const Model> derive_model(const Model& model, const Topology& topology);

// The visible surface of a topology (sim/topology_picture). Vertices near the cut follow particles of their own side. Each
// triangle across it belongs to one side. Exposed faces are drawn as cut edge.
PictureModel divide_picture(const Model& model, const Model& derived, const Topology& topology);

// Permanent number of a particle in Snapshots: the scene's tissue, threads, copies.
uint32_t public_index(const Model& model, const Model& derived, uint32_t particle);
// Whether Event::which is the index of a particle.
bool names_particle(const Event& event);

}  // namespace catgut
