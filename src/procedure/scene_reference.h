// SPDX-License-Identifier: Apache-2.0
// procedure: the manual of scene files, written from the table of keys: for `catgut describe` and docs/scene_reference.md.
#pragma once
#include <string>

namespace catgut {

// key: "" for everything; a section ("solver", "expect"); a key ("solver.substeps", "body.radius", "title", or just
// "substeps"). Throws InputError naming the nearest key.
std::string describe(const std::string& key);

std::string reference_markdown();  // the whole of docs/scene_reference.md

}  // namespace catgut
