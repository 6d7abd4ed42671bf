// SPDX-License-Identifier: Apache-2.0
// device/profiles: see the header. CHAI3D: src/devices/CPhantomDevices.cpp and CDeltaDevices.cpp of that library.
#include "device/profiles.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace catgut {
namespace {

// The first one whose word is part of the name. Peak [N], continuous [N], stiffness [N/m], damping [N s/m]; torque [N m],
// stiffness [N m/rad] and damping [N m s/rad] of rotation; peak [N] and stiffness [N/m] of the gripper.
constexpr std::array<ArmProfile, 15> kProfiles{{
    {"touch x", {7.9f, 1.75f, 1000, 5}, "CHAI3D (PHANTOM Desktop); continuous: data sheet, from memory"},
    {"desktop", {7.9f, 1.75f, 1000, 5}, "CHAI3D; continuous: data sheet, from memory"},
    {"premium", {8.5f, 1.4f, 800, 5, 0.188f, 0.3f, 0.004f}, "CHAI3D (Premium 1.5 6DOF); continuous: data sheet, from memory"},
    {"touch", {3.3f, 0.88f, 400, 4}, "CHAI3D; continuous: data sheet, from memory"},
    {"omni", {3.3f, 0.88f, 400, 4}, "CHAI3D has 700 N/m; as the Touch, which is the same mechanism"},
    {"omega.7", {12, 12, 5000, 30, 0, 0, 0, 8, 2000}, "CHAI3D; the maker gives 12 N without a time limit"},
    {"omega", {12, 12, 5000, 30}, "CHAI3D; the maker gives 12 N without a time limit"},
    {"delta.6", {20, 20, 5000, 30, 0.2f, 1, 0.07f}, "CHAI3D; damping of rotation: as the sigma"},
    {"delta", {20, 20, 5000, 30}, "CHAI3D"},
    {"sigma.6", {12, 12, 4000, 30, 0.2f, 1, 0.07f}, "CHAI3D"},
    {"sigma", {12, 12, 4000, 30, 0.2f, 1, 0.07f, 8, 2000}, "CHAI3D"},
    {"lambda", {12, 12, 4000, 30, 0.2f, 1, 0.07f, 8, 2000}, "as the sigma.7, whose values CHAI3D has"},
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
  out.force = less(out.force, says.force), out.continuous = less(out.continuous, says.continuous);
  out.stiffness = less(out.stiffness, says.stiffness), out.damping = less(out.damping, says.damping);
  return out;
}

}  // namespace catgut
