// SPDX-License-Identifier: Apache-2.0
// tests/validation: every line of `catgut validate` holds.
#include "validation/validation.h"

#include <gtest/gtest.h>

#include "validation/swept.h"

namespace catgut {
namespace {

TEST(Validation, every_check_holds) {
  const std::vector<ValidationLine> lines = run_validation();
  EXPECT_GT(lines.size(), 40u);
  for (const ValidationLine& l : lines)
    EXPECT_TRUE(l.ok) << l.name << ": expected " << l.expected << " " << l.unit << ", got " << l.got << ", error " << l.error
                      << " above " << l.tolerance << " (" << l.source << ")";
}

// The judge of knot/names can say no: one strand moves through another, or past its end, or touches it and turns back.
TEST(Validation, a_strand_that_passes_through_another_is_counted) {
  using validation::Place;
  std::vector<Place> before(6), after;
  const std::vector<uint8_t> broken{0, 0, 1, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    const double x = 1e-3 * (static_cast<double>(i) - 0.7);
    before[i] = {x, 0, 0}, before[3 + i] = {0, x, 0.2e-3};
  }
  after = before;
  for (size_t i = 3; i < 6; ++i) after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 1);
  EXPECT_EQ(validation::count_passes(after, before, broken), 1);
  for (size_t i = 3; i < 6; ++i) after[i].z = 0.01e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
  for (size_t i = 3; i < 6; ++i) before[i].x = after[i].x = 2e-3, after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
}

}  // namespace
}  // namespace catgut
