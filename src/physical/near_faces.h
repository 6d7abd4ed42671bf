// SPDX-License-Identifier: Apache-2.0
// physical/near_faces: the faces of the wall round a face, for what a pen's tip does within some millimeters. Reads the wall.
#pragma once
#include <algorithm>
#include <array>
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

}  // namespace catgut::physical
