// SPDX-License-Identifier: Apache-2.0
// wall/force: the element formula on sixteen elements at once.
#pragma once
#include <array>
#include <cstdint>

#include "wall/column.h"
#include "wall/element.h"

namespace catgut::wall {

constexpr uint32_t kLanesOfBlock = 16;

// Sixteen elements of one kind; lanes beyond the last element have no stiffness.
struct alignas(64) ElementBlock {
  std::array<std::array<float, kLanesOfBlock>, kConstants> constant{};
};
struct alignas(64) BlockCorners {
  std::array<std::array<uint32_t, kLanesOfBlock>, 4> column{};
  uint32_t quads = 1;                 // 0: triangles
  std::array<uint32_t, 15> unused{};  // no padding: archives copy it as it lies in memory
};
struct alignas(64) BlockTurn {
  std::array<float, kLanesOfBlock> x{}, y{}, z{}, w{};
};
// Forces on the columns at the corners of each element.
struct alignas(64) BlockForce {
  Float4 mid[4][kLanesOfBlock], dir[4][kLanesOfBlock];
  bool flat = false;  // a corner of one of them has nearly no volume left
};

// Forces of blocks [first, last) at y (mid-surface point and director of each column in turn); turns the frames by one step.
// Multiplications and additions are kept apart, and lanes do not mix: every instruction set gives the same bits.
void block_forces(const ElementBlock* block, const BlockCorners* corners, const Float4* y, BlockTurn* turn, BlockForce* force,
                  uint32_t first, uint32_t last);

}  // namespace catgut::wall
