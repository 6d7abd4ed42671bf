// SPDX-License-Identifier: Apache-2.0
// sim/cell_graph: see the header.
#include "sim/cell_graph.h"

#include <algorithm>

#include "sim/state.h"

namespace catgut {
namespace {

bool has_corner(const Tet& cell, uint32_t particle) { return std::find(cell.begin(), cell.end(), particle) != cell.end(); }

bool has_corners(const Tet& cell, const Triangle& face) {
  return std::all_of(face.begin(), face.end(), [&](uint32_t i) { return has_corner(cell, i); });
}

// The smallest barycentric coordinate of p in a tetrahedron: below 0 outside.
double inside(Vec3 a, Vec3 b, Vec3 c, Vec3 d, Vec3 p) {
  const double whole = tet_volume(a, b, c, d);
  if (!(whole > 0)) return -1e30;
  const double least =
      std::min({tet_volume(p, b, c, d), tet_volume(a, p, c, d), tet_volume(a, b, p, d), tet_volume(a, b, c, p)});
  return least / whole;
}

}  // namespace

CellGraph::CellGraph(const Model& model) : model_(model), first_(model.solver.tissue + 1, 0) {
  for (const Tet& cell : model.cell)
    for (uint32_t i : cell) ++first_[i + 1];
  for (const LooseParticle& l : model.loose) ++first_[l.particle + 1];
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  cell_.resize(first_.back());
  std::vector<uint32_t> fill(first_.begin(), first_.end() - 1);
  for (uint32_t c = 0; c < model.cell.size(); ++c)
    for (uint32_t i : model.cell[c]) cell_[fill[i]++] = c;
  for (const LooseParticle& l : model.loose) cell_[fill[l.particle]++] = l.cell;
  region_.assign(model.solver.tissue - model.source.size(), 0);
  seen_.assign(model.solver.tissue, 0);
  seen_cell_.assign(model.cell.size(), 0);
}

uint32_t CellGraph::across(uint32_t cell, uint32_t face) const {
  const Triangle t = face_of(model_.cell[cell], face);
  for (uint32_t other : cells_around(t[0]))
    if (other != cell && has_corners(model_.cell[other], t)) return other;
  return kNoCell;
}

uint32_t CellGraph::owner(const Triangle& triangle) const {
  for (uint32_t cell : cells_around(triangle[0]))
    if (has_corners(model_.cell[cell], triangle)) return cell;
  // The strip along a rim divides the faces of its prisms by the other diagonal.
  for (uint32_t cell : cells_around(triangle[0])) {
    const std::span<const Tet> prism(&model_.cell[cell / 3 * 3], 3);
    const auto has = [&](uint32_t i) {
      return std::any_of(prism.begin(), prism.end(), [&](const Tet& t) { return has_corner(t, i); });
    };
    if (has(triangle[1]) && has(triangle[2])) return cell;
  }
  return kNoCell;
}

uint32_t CellGraph::locate(std::span<const uint32_t> particle, Vec3 rest) const {
  const Vec4* x = model_.solver.shape.rest.data();
  uint32_t found = kNoCell;
  double best = -1e30;
  for (uint32_t i : particle)
    for (uint32_t c : cells_around(i)) {
      const Tet& t = model_.cell[c];
      const double in = inside(xyz(x[t[0]]), xyz(x[t[1]]), xyz(x[t[2]]), xyz(x[t[3]]), rest);
      if (in > best || (in == best && c < found)) best = in, found = c;
    }
  return found;
}

const std::vector<uint32_t>& CellGraph::connected(std::span<const uint32_t> start, std::span<const uint32_t> region) {
  ++stamp_;
  for (uint32_t source : region) region_[source] = stamp_;
  found_.clear();
  const auto visit = [&](uint32_t i) {
    if (seen_[i] == stamp_ || region_[source_of(model_, i)] != stamp_) return;
    seen_[i] = stamp_;
    found_.push_back(i);
  };
  for (uint32_t i : start) visit(i);
  for (size_t head = 0; head < found_.size(); ++head)
    for (uint32_t c : cells_around(found_[head])) {
      if (seen_cell_[c] == stamp_) continue;
      seen_cell_[c] = stamp_;
      for (uint32_t i : model_.cell[c]) visit(i);
      for (const LooseParticle& l : model_.loose)
        if (l.cell == c) visit(l.particle);
    }
  std::sort(found_.begin(), found_.end());
  return found_;
}

std::span<const uint32_t> cluster_members(const SolverModel& model, uint32_t particle) {
  const ShapeModel& shape = model.shape;
  const uint32_t* member = shape.member.data() + size_t{shape.cluster_of[particle]} * shape.cluster_stride;
  uint32_t count = 0;
  while (count < shape.cluster_stride && member[count] < model.tissue) ++count;  // padding names no particle
  return {member, count};
}

std::vector<LooseParticle> find_loose(const Model& model) {
  std::vector<uint8_t> in_cell(model.solver.tissue, 0);
  for (const Tet& cell : model.cell)
    for (uint32_t i : cell) in_cell[i] = 1;
  std::vector<LooseParticle> loose;
  for (uint32_t i = 0; i < model.solver.tissue; ++i) {
    if (in_cell[i]) continue;
    const std::span<const uint32_t> near = cluster_members(model.solver, i);
    const auto host = std::find_if(model.cell.begin(), model.cell.end(), [&](const Tet& cell) {
      return std::all_of(cell.begin(), cell.end(),
                         [&](uint32_t k) { return std::find(near.begin(), near.end(), k) != near.end(); });
    });
    if (host != model.cell.end()) loose.push_back({i, static_cast<uint32_t>(host - model.cell.begin())});
  }
  return loose;
}

void find_pieces(Model& model) {
  std::vector<uint32_t>& piece = model.piece;
  std::vector<uint32_t> open;
  piece.assign(model.solver.tissue, kNoCell);
  model.pieces = 0;
  const CellGraph graph(model);
  for (uint32_t i = 0; i < piece.size(); ++i) {
    if (piece[i] != kNoCell) continue;
    piece[i] = i;
    ++model.pieces;
    open.assign(1, i);
    const auto visit = [&](uint32_t k) {
      if (piece[k] == kNoCell) piece[k] = i, open.push_back(k);
    };
    while (!open.empty()) {
      const uint32_t at = open.back();
      open.pop_back();
      for (uint32_t c : graph.cells_around(at)) {
        for (uint32_t k : model.cell[c]) visit(k);
        for (const LooseParticle& l : model.loose)
          if (l.cell == c) visit(l.particle);
      }
    }
  }
}

}  // namespace catgut
