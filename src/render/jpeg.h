// SPDX-License-Identifier: Apache-2.0
// render/jpeg: images as JPEG, for pages that hold many of them.
#pragma once
#include <string>

#include "render/image.h"

namespace catgut {

std::string jpeg_bytes(const Image& image, int quality);  // a whole file; quality 1..100. Throws std::runtime_error

}  // namespace catgut
