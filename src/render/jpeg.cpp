// SPDX-License-Identifier: Apache-2.0
// render: see jpeg.h.
#include "render/jpeg.h"

#include <stb/stb_image_write.h>

#include <stdexcept>

namespace catgut {

std::string jpeg_bytes(const Image& image, int quality) {
  std::string bytes;
  const auto append = [](void* to, void* data, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<size_t>(size));
  };
  if (!stbi_write_jpg_to_func(append, &bytes, image.width, image.height, 4, image.rgba.data(), quality))
    throw std::runtime_error("the image cannot be encoded as JPEG");
  return bytes;
}

}  // namespace catgut
