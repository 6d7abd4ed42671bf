// SPDX-License-Identifier: Apache-2.0
// physical/near_faces: the faces of the wall round a face, for what a pen's tip does within some millimeters. Reads the wall.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "wall/wall.h"

namespace catgut::physical {

// The face and two rings of neighbors, without repetition. Returns how many of `near` were written.
inline size_t near_faces(const wall::Model& m, uint32_t face, std::array<uint32_t, 40>& near) {
  size_t count = 0, done = 0;
  near[count++] = face;
  for (int ring = 0; ring < 2; ++ring)
    for (const size_t end = count; done < end; ++done)
      for (const uint32_t over : m.neighbor[near[done]])
        if (over != wall::kNone && count < near.size() &&
            std::find(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), over / 4) ==
                near.begin() + static_cast<std::ptrdiff_t>(count))
          near[count++] = over / 4;
  return count;
}

// Whether all of a face, at rest, is farther than `reach` from a place.
inline bool is_beyond(const wall::Model& m, uint32_t face, Vec3 place, float reach) {
  const auto& corner = m.mesh.face[face];
  const size_t n = corner[3] == wall::kNone ? 3 : 4;
  std::array<Vec3, 4> at;
  Vec3 middle{};
  for (size_t k = 0; k < n; ++k)
    at[k] = (m.mesh.outer[corner[k]] + m.mesh.inner[corner[k]]) * 0.5f, middle += at[k] / static_cast<float>(n);
  float radius2 = 0;
  for (size_t k = 0; k < n; ++k) radius2 = std::max(radius2, length2(at[k] - middle));
  const float far = 1.001f * (reach + std::sqrt(radius2));
  return length2(place - middle) > far * far;
}

}  // namespace catgut::physical
