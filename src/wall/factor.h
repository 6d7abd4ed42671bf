// SPDX-License-Identifier: Apache-2.0
// wall/factor: a sparse Cholesky factor in panels, and the solve of a step: three right-hand sides at once, in
// single precision, without allocation. The order is approximate minimum degree (Amestoy, Davis, Duff 1996, doi
// 10.1137/S0895479894278952), post-ordered, so that neighboring columns of the factor share their pattern.
#pragma once
#include <cstdint>
#include <span>

#include "wall/column.h"

namespace catgut::wall {

struct Entry {  // of a symmetric matrix; each pair once, row > column or row == column
  uint32_t row, column;
  double value;
};

struct Panel {  // up to four columns of the factor with one pattern
  uint32_t first = 0, width = 0;
  uint32_t index = 0, count = 0;  // rows below the panel: into `row`
  uint32_t value = 0;             // into `value`: the inverse of the triangle on the diagonal (16), then `width` values a row
};

struct Factor {
  uint32_t size = 0;
  std::vector<uint32_t> place;  // of a row of the matrix in the order of elimination
  std::vector<Panel> panel;
  std::vector<uint32_t> row;
  Column<float> value;
};

// The matrix must be positive definite; entries that occur twice are added.
Factor factorize(uint32_t size, std::span<const Entry> entry);

// Solves in place; x is in the order of elimination: row r of the matrix at x[place[r]]. Lanes do not mix.
void solve(const Factor& factor, Float4* x);

}  // namespace catgut::wall
