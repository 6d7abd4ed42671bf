// SPDX-License-Identifier: Apache-2.0
// tests/validation: every line of `catgut validate` holds.
#include "validation/validation.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

TEST(Validation, every_check_holds) {
  const std::vector<ValidationLine> lines = run_validation();
  EXPECT_GT(lines.size(), 40u);
  for (const ValidationLine& l : lines)
    EXPECT_TRUE(l.ok) << l.name << ": expected " << l.expected << " " << l.unit << ", got " << l.got << ", error " << l.error
                      << " above " << l.tolerance << " (" << l.source << ")";
}

}  // namespace
}  // namespace catgut
