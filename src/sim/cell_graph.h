// SPDX-License-Identifier: Apache-2.0
// sim/cell_graph: connectivity of tissue particles through cells. Reads a model's cells. For building and cutting; ticks do
// not use it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sim/model.h"

namespace catgut {

constexpr uint32_t kNoCell = ~0u;

class CellGraph {
 public:
  explicit CellGraph(const Model& model);

  // Cells with that corner, ascending. For a loose particle: its host cell.
  std::span<const uint32_t> cells_around(uint32_t particle) const {
    return {cell_.data() + first_[particle], first_[particle + 1] - first_[particle]};
  }
  // The cell on the other side of a face; kNoCell: a surface face.
  uint32_t across(uint32_t cell, uint32_t face) const;
  // The cell of a surface triangle, or a cell of its prism; kNoCell: none.
  uint32_t owner(const Triangle& triangle) const;
  // Among the cells around `particle`s: the cell that contains `rest` [m] at rest, or the nearest; kNoCell: none.
  uint32_t locate(std::span<const uint32_t> particle, Vec3 rest) const;

  // All particles connected to `start` by cells, on paths over particles whose source (source_of) is in `region`. This set is
  // the visible neighborhood of a point. The result is ascending and valid until the next call.
  const std::vector<uint32_t>& connected(std::span<const uint32_t> start, std::span<const uint32_t> region);
  bool was_connected(uint32_t particle) const { return seen_[particle] == stamp_; }

 private:
  const Model& model_;
  std::vector<uint32_t> first_, cell_;
  std::vector<uint32_t> region_, seen_, seen_cell_, found_;  // per source, particle, cell: stamp of the last search
  uint32_t stamp_ = 0;
};

// The particle of the scene's model: the particle itself, or the source of a copy.
inline uint32_t source_of(const Model& model, uint32_t particle) {
  const uint32_t built = model.solver.tissue - static_cast<uint32_t>(model.source.size());
  return particle < built ? particle : model.source[particle - built];
}
// Members of the cluster centered on a tissue particle.
std::span<const uint32_t> cluster_members(const SolverModel& model, uint32_t particle);

// Particles in no cell, each with the first cell whose corners are in its cluster. The particle stays with that cell.
std::vector<LooseParticle> find_loose(const Model& model);

// Computes Model::piece and pieces by flood fill.
void find_pieces(Model& model);

}  // namespace catgut
