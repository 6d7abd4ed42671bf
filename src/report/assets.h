// SPDX-License-Identifier: Apache-2.0
// report: the files of web/ and D3, inside the program.
#pragma once
#include <string_view>

namespace catgut::assets {

std::string_view style();
std::string_view
d3();  // D3, Copyright 2010-2022 Mike Bostock, BSD-3-Clause (packaging/copyright); from Debian's package node-d3
std::string_view charts();
std::string_view report();
std::string_view educator();
std::string_view survey();

}  // namespace catgut::assets
