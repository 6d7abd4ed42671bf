// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_hd: functions of the simulated libHD for tests. Loaded by name, like the real ones.
#pragma once

extern "C" {

enum FakeHdFault {
  kFakeCommError = 1,   // the device is disconnected: errors, no new pose
  kFakeWarmMotors = 2,  // the library cuts the force
  kFakeStall = 3,       // the whole scheduler stops calling back
  kFakeNan = 4,         // positions that are not numbers
  kFakeFlipX = 5,       // the x motor is wired with reversed sign
  kFakeTooFast = 6,     // HD_EXCEEDED_MAX_VELOCITY: the library cuts the force
};

struct FakeHdArm {
  double position[3], velocity[3];  // [mm], [mm/s]
  double force[3];                  // [N] present force of the motors
  double energy, energy_most;       // [J] into the hand since fakeHdReset or fakeHdZero; its largest value
  double step_most, force_most;     // [N] from one millisecond to the next; longest force
  unsigned long ticks;
  int force_output;  // HD_FORCE_OUTPUT is enabled
};

// Everything as after loading; the environment is read again:
//   FAKE_HD_MANUAL=1        no thread: fakeHdStep runs the scheduler
//   FAKE_HD_MISSING=left    that arm cannot be opened (right, left, or all)
//   FAKE_HD_UNCALIBRATED=1  arms want their inkwell
//   FAKE_HD_BUSY=N          N times HD_DEVICE_ALREADY_INITIATED
//   FAKE_HD_FAULT=kind:arm:from[:to],...   kind: comm_error, warm_motors, stall, nan, flip_x, too_fast; arm: right, left; times
//   in
//                           [ms] of scheduler time
void fakeHdReset(void);
void fakeHdStep(unsigned milliseconds);
void fakeHdFault(int arm, int fault, int on);
// In the next `times` frames of arm `frame_of`: the error `code`, with arm `blamed` in its record, at the frame's begin (where
// 0), at its end (1), or when the pose is read (2).
void fakeHdRaise(int frame_of, int blamed, unsigned code, int where, unsigned long times);
// Target of the hand [mm], orientation of the stylus (x, y, z, w), pressed buttons.
void fakeHdHand(int arm, const double* position, const double* quaternion, int buttons);
// [N/mm], [N s/mm], [kg] arm and finger together, [N] dry friction.
void fakeHdGrip(int arm, double stiffness, double damping, double mass, double coulomb);
void fakeHdPlace(int arm, const double* position);  // at once, at rest
void fakeHdRead(int arm, FakeHdArm* out);
void fakeHdZero(int arm);  // its energy and its largest values
}
