// SPDX-License-Identifier: Apache-2.0
// render/filament/environment: the light of the operating theatre, computed here so that no image file is needed.
#pragma once
#include <filament/Engine.h>
#include <filament/IndirectLight.h>
#include <filament/Texture.h>

namespace catgut {

struct Environment {
  filament::Texture* reflections = nullptr;
  filament::IndirectLight* light = nullptr;
};
Environment make_environment(filament::Engine& engine, float intensity);

// Tileable patterns for tissue. pattern: r mottling, g vessels, b blood in the wall, a: which
// vessels are veins. bumps: rg serosa's slope, ba mucosa's.
struct TissueTextures {
  filament::Texture* pattern = nullptr;
  filament::Texture* bumps = nullptr;
};
TissueTextures make_tissue_textures(filament::Engine& engine);

}  // namespace catgut
