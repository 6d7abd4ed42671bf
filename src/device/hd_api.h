// SPDX-License-Identifier: Apache-2.0
// device: the part of OpenHaptics' device library (libHD) that is used: own declarations of its names, types and numbers, so
// that building needs neither its headers nor its license. docs/references.md (OpenHaptics headers) states the source of
// each.
//
// Three pitfalls of other bindings, each covered by a static_assert below or by tests/device: the error record has three
// members and is returned by value (12 bytes); HDlong and the scheduler's handle are C longs; HDboolean is one byte.
#pragma once
#include <cstddef>
#include <cstdint>

#if defined(_WIN32)
#define CATGUT_HD_CALL __stdcall  // matters only on 32-bit Windows
#else
#define CATGUT_HD_CALL
#endif

namespace catgut::hd {

using Handle = unsigned int;
using Enum = unsigned int;
using Code = unsigned int;
using Boolean = unsigned char;
using Int = int;
using Long = long;
using ULong = unsigned long;
using SchedulerHandle = unsigned long;
using Double = double;
using Float = float;
using String = const char*;
using Callback = Code(CATGUT_HD_CALL*)(void*);

struct ErrorInfo {
  Enum code;
  int internal;
  Handle device;
};
static_assert(sizeof(ErrorInfo) == 12 && offsetof(ErrorInfo, internal) == 4 && offsetof(ErrorInfo, device) == 8);
static_assert(sizeof(Boolean) == 1 && sizeof(Handle) == 4 && sizeof(Enum) == 4 && sizeof(Int) == 4);
static_assert(sizeof(Long) == sizeof(long) && sizeof(SchedulerHandle) == sizeof(long));

constexpr Handle kNoDevice = 0xFFFFFFFF;
constexpr Enum kSuccess = 0x0000, kWarmMotors = 0x0200, kForceError = 0x0204, kDeviceFault = 0x0300, kAlreadyOpen = 0x0301,
               kCommError = 0x0302, kCommConfig = 0x0303, kTimerError = 0x0304, kInvalidLicense = 0x0600;
constexpr Enum kButtons = 0x2000, kPosition = 0x2050, kVelocity = 0x2051, kTransform = 0x2052;
constexpr Enum kVersion = 0x2500, kModel = 0x2501, kDriverVersion = 0x2502, kVendor = 0x2503, kSerial = 0x2504,
               kUsableWorkspace = 0x2551, kOutputDof = 0x2554;
constexpr Enum kUpdateRate = 0x2600, kMaxStiffness = 0x2602, kMaxForce = 0x2603, kMaxContinuousForce = 0x2604,
               kMotorTemperature = 0x2605, kMaxDamping = 0x2609;
constexpr Enum kCurrentForce = 0x2700, kCurrentTorque = 0x2701, kLastForce = 0x2800;
constexpr Enum kForceOutput = 0x4000, kForceClamping = 0x4001, kForceRamping = 0x4002, kForceLimit = 0x4003;
constexpr Enum kCalibrationOk = 0x5000, kCalibrationNeedsUpdate = 0x5001, kCalibrationNeedsHand = 0x5002;
constexpr Code kCallbackDone = 0, kCallbackContinue = 1;
constexpr unsigned short kPriority = 32767;

// name in the library, result, arguments
#define CATGUT_HD_FUNCTIONS(X)                                                  \
  X(hdInitDevice, Handle, (String))                                             \
  X(hdMakeCurrentDevice, void, (Handle))                                        \
  X(hdDisableDevice, void, (Handle))                                            \
  X(hdGetCurrentDevice, Handle, ())                                             \
  X(hdBeginFrame, void, (Handle))                                               \
  X(hdEndFrame, void, (Handle))                                                 \
  X(hdGetError, ErrorInfo, ())                                                  \
  X(hdGetErrorString, String, (Enum))                                           \
  X(hdEnable, void, (Enum))                                                     \
  X(hdDisable, void, (Enum))                                                    \
  X(hdIsEnabled, Boolean, (Enum))                                               \
  X(hdGetBooleanv, void, (Enum, Boolean*))                                      \
  X(hdGetIntegerv, void, (Enum, Int*))                                          \
  X(hdGetFloatv, void, (Enum, Float*))                                          \
  X(hdGetDoublev, void, (Enum, Double*))                                        \
  X(hdGetLongv, void, (Enum, Long*))                                            \
  X(hdGetString, String, (Enum))                                                \
  X(hdSetBooleanv, void, (Enum, const Boolean*))                                \
  X(hdSetIntegerv, void, (Enum, const Int*))                                    \
  X(hdSetFloatv, void, (Enum, const Float*))                                    \
  X(hdSetDoublev, void, (Enum, const Double*))                                  \
  X(hdSetLongv, void, (Enum, const Long*))                                      \
  X(hdCheckCalibration, Enum, ())                                               \
  X(hdCheckCalibrationStyle, Enum, ())                                          \
  X(hdUpdateCalibration, void, (Enum))                                          \
  X(hdStartScheduler, void, ())                                                 \
  X(hdStopScheduler, void, ())                                                  \
  X(hdSetSchedulerRate, void, (ULong))                                          \
  X(hdScheduleAsynchronous, SchedulerHandle, (Callback, void*, unsigned short)) \
  X(hdUnschedule, void, (SchedulerHandle))                                      \
  X(hdWaitForCompletion, Boolean, (SchedulerHandle, Code))                      \
  X(hdGetSchedulerTimeStamp, Double, ())

struct Library {
#define CATGUT_HD_MEMBER(name, result, arguments) result(CATGUT_HD_CALL* name) arguments = nullptr;
  CATGUT_HD_FUNCTIONS(CATGUT_HD_MEMBER)
#undef CATGUT_HD_MEMBER
};

#define CATGUT_HD_COUNT(name, result, arguments) +1
constexpr size_t kFunctions = 0 CATGUT_HD_FUNCTIONS(CATGUT_HD_COUNT);
#undef CATGUT_HD_COUNT

}  // namespace catgut::hd
