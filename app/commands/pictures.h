// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench pictures`.
#pragma once
#include <string>
#include <vector>

namespace catgut {

// Rate of pictures of a scene by window size, quality and the fraction of the resolution that a slow window falls back to.
// Then of both eyes of a headset. Prints a table, with the card's name. set: key=value. Throws InputError
// without a driver.
int bench_pictures(const std::string& scene, const std::vector<std::string>& set);

}  // namespace catgut
