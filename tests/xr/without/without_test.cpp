// SPDX-License-Identifier: Apache-2.0
// tests/xr: the headset of a build with CATGUT_XR=OFF, in a program of its own: no_headset.cpp takes the place of headset.cpp
// in the same library. A function that only one of the two defines does not link.
#include <gtest/gtest.h>

#include "xr/wearer.h"

namespace catgut::xr {
namespace {

TEST(WithoutOpenXR, one_line_says_so_and_the_window_keeps_the_hands) {
  std::vector<std::string> line;
  WearerOptions options;
  options.report = [&](const std::string& l) { line.push_back(l); };
  Wearer wearer(options);
  ASSERT_EQ(line.size(), 1u);
  EXPECT_NE(line[0].find("CATGUT_XR=OFF); the session continues in the window"), std::string::npos) << line[0];
  EXPECT_FALSE(headset_offered());
  EXPECT_TRUE(wearer.failed());
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(wearer.begin());
    EXPECT_EQ(wearer.state(), HeadsetState::off);
    EXPECT_FALSE(wearer.hands(Snapshot(), {}, {}).has_value());
    wearer.draw({});
  }
  EXPECT_FALSE(wearer.mirror().has_value());
  wearer.leave();
  EXPECT_EQ(line.size(), 1u);
}

}  // namespace
}  // namespace catgut::xr
