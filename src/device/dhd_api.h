// SPDX-License-Identifier: Apache-2.0
// device: the part of Force Dimension's library (libdhd) that is used: own declarations of its names, types and numbers, so
// that building needs neither its headers nor its license. docs/references.md (DHD) states the source of each.
//
// Pitfalls: ids are a plain `char`, and boolean results are one byte, whose upper three are undefined in a register.
// The status array grew from 13 to more than 16 entries over the versions, and the library fills as many as it knows. A result
// of 1 (time guard) is not an error; a rotation is [row][column]. A positive grip force opens the fingers, and the library
// clamps it at 1 N unless dhdSetMaxGripperForce says otherwise. Its base frame is x toward the user, y right, z up.
#pragma once
#include <array>
#include <cstddef>

#if defined(_WIN32)
#define CATGUT_DHD_CALL __stdcall
#else
#define CATGUT_DHD_CALL
#endif

namespace catgut::dhd {

using Id = char;
using Flag = unsigned char;
static_assert(sizeof(bool) == 1 && sizeof(Id) == 1 && sizeof(Flag) == 1 && sizeof(int) == 4 && sizeof(unsigned short) == 2);

constexpr int kOn = 1, kOff = 0, kError = -1;
constexpr size_t kStatusRoom = 64;  // more than any version fills
constexpr size_t kStatusReset = 3, kStatusForce = 5, kStatusForceOffCause = 14;
constexpr int kCauseVelocity = 2, kCauseWatchdog = 3;
constexpr Flag kWatchdogMost = 255;  // in units of 125 us: 31.9 ms
constexpr int kTypeDelta3 = 63, kTypeOldDelta3 = 31, kTypeFalcon = 60;

// name in the library, result, arguments
#define CATGUT_DHD_FUNCTIONS(X)                                                                             \
  X(dhdGetDeviceCount, int, ())                                                                             \
  X(dhdOpenID, int, (Id))                                                                                   \
  X(dhdClose, int, (Id))                                                                                    \
  X(dhdGetSystemType, int, (Id))                                                                            \
  X(dhdGetSystemName, const char*, (Id))                                                                    \
  X(dhdGetSerialNumber, int, (unsigned short*, Id))                                                         \
  X(dhdGetSDKVersion, void, (int*, int*, int*, int*))                                                       \
  X(dhdIsLeftHanded, bool, (Id))                                                                            \
  X(dhdHasGripper, bool, (Id))                                                                              \
  X(dhdHasActiveGripper, bool, (Id))                                                                        \
  X(dhdHasActiveWrist, bool, (Id))                                                                          \
  X(dhdSetMaxForce, int, (double, Id))                                                                      \
  X(dhdSetMaxTorque, int, (double, Id))                                                                     \
  X(dhdSetMaxGripperForce, int, (double, Id))                                                               \
  X(dhdGetStatus, int, (int*, Id))                                                                          \
  X(dhdEnableForce, int, (Flag, Id))                                                                        \
  X(dhdSetGravityCompensation, int, (int, Id))                                                              \
  X(dhdEnableExpertMode, int, ())                                                                           \
  X(dhdDisableExpertMode, int, ())                                                                          \
  X(dhdSetWatchdog, int, (Flag, Id))                                                                        \
  X(dhdGetPosition, int, (double*, double*, double*, Id))                                                   \
  X(dhdGetOrientationFrame, int, (double(*)[3], Id))                                                        \
  X(dhdGetLinearVelocity, int, (double*, double*, double*, Id))                                             \
  X(dhdGetButton, int, (int, Id))                                                                           \
  X(dhdGetGripperGap, int, (double*, Id))                                                                   \
  X(dhdSetForceAndTorqueAndGripperForce, int, (double, double, double, double, double, double, double, Id)) \
  X(dhdErrorGetLast, int, ())                                                                               \
  X(dhdErrorGetStr, const char*, (int))

struct Library {
#define CATGUT_DHD_MEMBER(name, result, arguments) result(CATGUT_DHD_CALL* name) arguments = nullptr;
  CATGUT_DHD_FUNCTIONS(CATGUT_DHD_MEMBER)
#undef CATGUT_DHD_MEMBER
};

}  // namespace catgut::dhd
