// SPDX-License-Identifier: Apache-2.0
// device/profiles: see the header. CHAI3D: src/devices/CPhantomDevices.cpp and CDeltaDevices.cpp of that library.
#include "device/profiles.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace catgut {
namespace {

// The first one whose word is part of the name. Peak [N], continuous [N], stiffness [N/m], damping [N s/m].
constexpr std::array<ArmProfile, 12> kProfiles{{
    {"touch x", {7.9f, 1.75f, 1000, 5}, "CHAI3D (PHANTOM Desktop); continuous: data sheet, from memory"},
    {"desktop", {7.9f, 1.75f, 1000, 5}, "CHAI3D; continuous: data sheet, from memory"},
    {"premium", {8.5f, 1.4f, 800, 5}, "CHAI3D (Premium 1.5); continuous: data sheet, from memory"},
    {"touch", {3.3f, 0.88f, 400, 4}, "CHAI3D; continuous: data sheet, from memory"},
    {"omni", {3.3f, 0.88f, 400, 4}, "CHAI3D has 700 N/m; as the Touch, which is the same mechanism"},
    {"omega", {12, 12, 5000, 30}, "CHAI3D; the maker gives 12 N without a time limit"},
    {"delta", {20, 20, 5000, 30}, "CHAI3D"},
    {"sigma", {12, 12, 4000, 30}, "CHAI3D, the lower of its 4000 to 8000 N/m"},
    {"lambda", {12, 12, 4000, 30}, "CHAI3D, the lower of its 4000 to 8000 N/m"},
    {"falcon", {8, 8, 3000, 20}, "CHAI3D"},
    {"inverse3", {2, 2, 400, 4}, "Isaac Lab clips at 2 N; stiffness unpublished: a Touch's"},
    {"minverse", {2, 2, 400, 4}, "as the Inverse3; unpublished"},
}};
constexpr ArmLimits kUnknown{3.3f, 0.88f, 400, 4};

}  // namespace

std::span<const ArmProfile> arm_profiles() { return kProfiles; }

ArmLimits limits_of(const std::string& model, const ArmLimits& says) {
  std::string name = model;
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  ArmLimits out = kUnknown;
  for (const ArmProfile& p : kProfiles)
    if (name.find(p.model) != std::string::npos) {
      out = p.limits;
      break;
    }
  const auto less = [](float known, float said) { return said > 0 && std::isfinite(said) ? std::min(known, said) : known; };
  return {less(out.force, says.force), less(out.continuous, says.continuous), less(out.stiffness, says.stiffness),
          less(out.damping, says.damping)};
}

}  // namespace catgut
