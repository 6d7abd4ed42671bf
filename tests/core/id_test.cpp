// SPDX-License-Identifier: Apache-2.0
// tests/core: typed handles.
#include "core/id.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace catgut {
namespace {

TEST(Id, refers_to_nothing_until_it_is_given_a_row) {
  EXPECT_FALSE(HandId{});
  EXPECT_TRUE(HandId({0, 0}));
  EXPECT_EQ(HandId{}, HandId{});
}

TEST(Id, of_a_row_that_was_reused_no_longer_matches) {
  const SutureId before{3, 1}, now{3, 2};
  EXPECT_FALSE(before == now);
  EXPECT_EQ(now, (SutureId{3, 2}));
  EXPECT_FALSE(now == (SutureId{4, 2}));
}

TEST(Id, of_one_table_is_not_taken_for_that_of_another) {
  EXPECT_FALSE((std::is_convertible_v<HandId, InstrumentId>));
  EXPECT_FALSE((std::is_constructible_v<BodyId, SutureId>));
}

}  // namespace
}  // namespace catgut
