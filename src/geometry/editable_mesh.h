// SPDX-License-Identifier: Apache-2.0
// geometry/editable_mesh: a manifold surface whose edges can be split, collapsed and flipped one at a time. Used by remesh.
// Vertices and triangles keep their numbers permanently; dead ones remain as gaps until `finish`.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/mesh.h"

namespace catgut {

class EditableMesh {
 public:
  explicit EditableMesh(const TriangleMesh& mesh);

  std::vector<Vec3> position;
  size_t vertices() const { return alive_; }
  size_t slots() const { return position.size(); }
  bool alive(uint32_t v) const { return !around_[v].empty(); }
  bool on_rim(uint32_t v) const { return rim_[v]; }
  std::vector<uint32_t> neighbors(uint32_t v) const;  // ascending
  Vec3 normal(uint32_t v) const;                      // area weighted; {0,0,0} without area
  // The vertices opposite the edge, one per triangle on it (0, 1 or 2). first is the one of the triangle that runs a to b.
  int opposite(uint32_t a, uint32_t b, uint32_t out[2]) const;
  bool rim_edge(uint32_t a, uint32_t b) const;
  std::vector<std::pair<uint32_t, uint32_t>> edges() const;  // a < b, ascending

  // Puts a new vertex at p on the edge and returns its number.
  uint32_t split(uint32_t a, uint32_t b, Vec3 p);
  // Merges b into a, moved to p. False, without a change, if that would change the topology or flip a triangle, or
  // leave a rim with fewer than five vertices (rim_left: vertices on the rim of the edge).
  bool collapse(uint32_t a, uint32_t b, Vec3 p, size_t rim_left);
  // Flips the edge to join its opposite vertices; false, without a change, where that is invalid or not flat enough.
  bool flip(uint32_t a, uint32_t b);
  // Whether moving v to p flips no triangle.
  bool can_move(uint32_t v, Vec3 p) const;

  // Vertices and triangles without gaps; number[v] is the new index of slot v.
  TriangleMesh finish(std::vector<uint32_t>* number = nullptr) const;

 private:
  Vec3 area_vector(const Triangle& t) const;
  void remove(uint32_t t);
  std::vector<Triangle> triangle_;
  std::vector<std::vector<uint32_t>> around_;  // live triangles at each vertex
  std::vector<uint8_t> rim_;
  size_t alive_ = 0;
};

}  // namespace catgut
