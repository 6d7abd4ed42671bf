// SPDX-License-Identifier: Apache-2.0
// validation/skin: see the header.
#include "validation/skin.h"

#include <algorithm>
#include <cmath>

namespace catgut::validation {
namespace {

// Radii of a piece, beyond which it counts as a point with an area (within 2 % of its solid angle), and as two triangles.
constexpr float kFar = 3, kBeside = 1.5f;
constexpr float kFlat = 0.02e-3f;  // [m] by which triangles may lie beside a warped piece, for what is near it

// [sr] of a triangle, seen from the origin (Van Oosterom and Strackee 1983, 10.1109/TBME.1983.325207).
float solid_angle(Vec3 a, Vec3 b, Vec3 c) {
  const float la = length(a), lb = length(b), lc = length(c);
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

}  // namespace

Skin::Skin(const physical::Model& model, const wall::State& rest) : piece_(model.surface.patch.size()) {
  follow(model, rest);
  for (uint32_t q = 0; q < piece_.size(); ++q) {
    Piece& piece = piece_[q];
    piece.turned = dot(piece.area, nearest_on_patch(model.wall, rest, model.surface, q, piece.center).facing) < 0;
  }
  follow(model, rest);
}

void Skin::follow(const physical::Model& model, const wall::State& state) {
  for (uint32_t q = 0; q < piece_.size(); ++q) {
    const physical::Patch& patch = model.surface.patch[q];
    Piece& piece = piece_[q];
    if (patch.side == 0) {
      const physical::StripEnds low = strip_ends(model.wall, state, model.surface, q, -1),
                                high = strip_ends(model.wall, state, model.surface, q, 1);
      piece.count = 4, piece.corner = {low.from, low.to, high.to, high.from};
    } else {
      const uint32_t lane = model.wall.lane_of_face[patch.face];
      const auto& corners = state.topology.corners[lane / wall::kLanesOfBlock];
      piece.count = model.wall.mesh.face[patch.face][3] == wall::kNone ? 3 : 4;
      for (size_t k = 0; k < piece.count; ++k)
        piece.corner[k] = wall::place(
            wall::at_column(corners.column[k][lane % wall::kLanesOfBlock], static_cast<float>(patch.side)), state.motion);
    }
    const auto& c = piece.corner;
    piece.center = {};
    for (size_t k = 0; k < piece.count; ++k) piece.center += c[k] / static_cast<float>(piece.count);
    piece.area = 0.5f * cross(c[1] - c[0], c[2] - c[0]);
    if (piece.count == 4) piece.area += 0.5f * cross(c[2] - c[0], c[3] - c[0]);
    if (piece.turned) piece.area = -piece.area;
    piece.warp = piece.count == 4 ? length(c[0] - c[1] + c[2] - c[3]) : 0.0f;
    piece.radius = 0;
    for (size_t k = 0; k < piece.count; ++k) piece.radius = std::max(piece.radius, distance(piece.center, c[k]));
  }
}

float Skin::winding(Vec3 p) const {
  float sum = 0;
  for (const Piece& piece : piece_) {
    const Vec3 to = piece.center - p;
    const float far2 = length2(to);
    if (far2 > kFar * kFar * piece.radius * piece.radius) {
      sum += dot(piece.area, to) / (far2 * std::sqrt(far2));
      continue;
    }
    const auto& c = piece.corner;
    // A warped quadrilateral is a bilinear patch: two triangles are up to a quarter of the warp beside it.
    const bool near = piece.count == 4 && far2 < kBeside * kBeside * piece.radius * piece.radius;
    const int parts = near ? static_cast<int>(std::ceil(std::sqrt(0.25f * piece.warp / kFlat + 1e-6f))) : 1;
    const auto at = [&](int i, int j) {
      const float s = static_cast<float>(i) / static_cast<float>(parts), t = static_cast<float>(j) / static_cast<float>(parts);
      return lerp(lerp(c[0], c[1], s), lerp(c[3], c[2], s), t) - p;
    };
    float angle = 0;
    if (piece.count == 3) angle = solid_angle(c[0] - p, c[1] - p, c[2] - p);
    else
      for (int i = 0; i < parts; ++i)
        for (int j = 0; j < parts; ++j)
          angle +=
              solid_angle(at(i, j), at(i + 1, j), at(i + 1, j + 1)) + solid_angle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    sum += piece.turned ? -angle : angle;
  }
  return sum / (4 * kPi);
}

}  // namespace catgut::validation
