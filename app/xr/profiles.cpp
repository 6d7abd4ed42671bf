// SPDX-License-Identifier: Apache-2.0
// app/xr: suggested bindings. docs/headset.md has them as a table.
#include "xr/actions.h"

namespace catgut::xr {
namespace {

#define BOTH(action, path) \
  {action, "/user/hand/left/" path}, { action, "/user/hand/right/" path }
#define LEFT(action, path) \
  { action, "/user/hand/left/" path }
#define RIGHT(action, path) \
  { action, "/user/hand/right/" path }
#define COMMON BOTH("grip", "input/grip/pose"), BOTH("aim", "input/aim/pose"), BOTH("vibration", "output/haptic")

constexpr Binding kSimple[] = {COMMON, BOTH("jaw", "input/select/click"), LEFT("menu", "input/menu/click"),
                               RIGHT("swap", "input/menu/click")};

constexpr Binding kTouch[] = {COMMON,
                              BOTH("jaw", "input/trigger/value"),
                              BOTH("clutch", "input/squeeze/value"),
                              BOTH("stick", "input/thumbstick"),
                              BOTH("swap", "input/thumbstick/click"),
                              LEFT("cut", "input/x/click"),
                              RIGHT("cut", "input/a/click"),
                              LEFT("new_suture", "input/y/click"),
                              RIGHT("new_suture", "input/b/click"),
                              LEFT("menu", "input/menu/click")};

// The system button belongs to the runtime: a firm press of the trackpad opens the menu.
constexpr Binding kIndex[] = {COMMON,
                              BOTH("jaw", "input/trigger/value"),
                              BOTH("clutch", "input/squeeze/value"),
                              BOTH("stick", "input/thumbstick"),
                              BOTH("swap", "input/thumbstick/click"),
                              BOTH("cut", "input/a/click"),
                              BOTH("new_suture", "input/b/click"),
                              BOTH("menu", "input/trackpad/force")};

constexpr Binding kVive[] = {COMMON,
                             BOTH("jaw", "input/trigger/value"),
                             BOTH("clutch", "input/squeeze/click"),
                             BOTH("stick", "input/trackpad"),
                             LEFT("swap", "input/trackpad/click"),
                             RIGHT("cut", "input/trackpad/click"),
                             RIGHT("new_suture", "input/menu/click"),
                             LEFT("menu", "input/menu/click")};

constexpr Binding kWindows[] = {COMMON,
                                BOTH("jaw", "input/trigger/value"),
                                BOTH("clutch", "input/squeeze/click"),
                                BOTH("stick", "input/thumbstick"),
                                BOTH("swap", "input/thumbstick/click"),
                                BOTH("cut", "input/trackpad/click"),
                                RIGHT("new_suture", "input/menu/click"),
                                LEFT("menu", "input/menu/click")};

#undef BOTH
#undef LEFT
#undef RIGHT
#undef COMMON

constexpr Profile kProfiles[] = {
    {"/interaction_profiles/khr/simple_controller", "simple controller", kSimple},
    {"/interaction_profiles/oculus/touch_controller", "Touch", kTouch},
    {"/interaction_profiles/valve/index_controller", "Index", kIndex},
    {"/interaction_profiles/htc/vive_controller", "Vive", kVive},
    {"/interaction_profiles/microsoft/motion_controller", "Windows Mixed Reality", kWindows},
};

}  // namespace

std::span<const Profile> profiles() { return kProfiles; }

}  // namespace catgut::xr
