// SPDX-License-Identifier: Apache-2.0
// render/filament/materials: see materials.h. The .inc files are written by matc at build time from materials/*.mat.
#include "render/filament/materials.h"

namespace catgut {
namespace {
constexpr uint8_t kTissue[] = {
#include "tissue.inc"
};
constexpr uint8_t kThread[] = {
#include "thread.inc"
};
constexpr uint8_t kMetal[] = {
#include "metal.inc"
};
constexpr uint8_t kDrape[] = {
#include "drape.inc"
};
constexpr uint8_t kTissueLow[] = {
#include "tissue_low.inc"
};
constexpr uint8_t kThreadLow[] = {
#include "thread_low.inc"
};
constexpr uint8_t kMetalLow[] = {
#include "metal_low.inc"
};
constexpr uint8_t kMarker[] = {
#include "marker.inc"
};
constexpr uint8_t kMark[] = {
#include "mark.inc"
};
constexpr uint8_t kSmoke[] = {
#include "smoke.inc"
};
constexpr uint8_t kBoard[] = {
#include "board.inc"
};
constexpr uint8_t kFade[] = {
#include "fade.inc"
};
}  // namespace

std::span<const uint8_t> tissue_material() { return kTissue; }
std::span<const uint8_t> thread_material() { return kThread; }
std::span<const uint8_t> metal_material() { return kMetal; }
std::span<const uint8_t> drape_material() { return kDrape; }
std::span<const uint8_t> tissue_low_material() { return kTissueLow; }
std::span<const uint8_t> thread_low_material() { return kThreadLow; }
std::span<const uint8_t> metal_low_material() { return kMetalLow; }
std::span<const uint8_t> marker_material() { return kMarker; }
std::span<const uint8_t> mark_material() { return kMark; }
std::span<const uint8_t> smoke_material() { return kSmoke; }
std::span<const uint8_t> board_material() { return kBoard; }
std::span<const uint8_t> fade_material() { return kFade; }

}  // namespace catgut
