// SPDX-License-Identifier: Apache-2.0
// render/filament/materials: the compiled materials, embedded so that no files are needed at run time.
#pragma once
#include <cstdint>
#include <span>

namespace catgut {

std::span<const uint8_t> tissue_material();
std::span<const uint8_t> thread_material();
std::span<const uint8_t> metal_material();
std::span<const uint8_t> drape_material();
std::span<const uint8_t> tissue_low_material();
std::span<const uint8_t> thread_low_material();
std::span<const uint8_t> metal_low_material();
std::span<const uint8_t> marker_material();
std::span<const uint8_t> mark_material();
std::span<const uint8_t> smoke_material();
std::span<const uint8_t> board_material();
std::span<const uint8_t> fade_material();

}  // namespace catgut
