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
  double force[3];                  // [N] that the motors hold now
  double asked[3];                  // [N] that the driver wrote last, whatever the library made of it
  double energy, energy_most;       // [J] into the hand since fakeHdReset or fakeHdZero; its largest value
  double to_hand_most;              // [J] the same less what the arm's own damping takes
  double step_most, force_most;     // [N] from one millisecond to the next; longest force
  double hottest;                   // motor of a joint, 1: the driver cuts the force
  unsigned cuts;                    // how often it did
  unsigned long ticks;
  int force_output;  // HD_FORCE_OUTPUT is enabled
};

// What a real arm does and an ideal one does not; all zero: ideal.
struct FakeHdUnkind {
  double encoder_mm;     // step of the position (Touch: 0.055)
  double transport_ms;   // from the frame's end to the motors
  double jitter_ms;      // standard deviation of the period
  double late, lost;     // chance of a callback that comes 2 to 8 ms late; of one that never comes
  double weakest_joint;  // a motor for each axis heats with its force; the one of y bears this part of 0.88 N; 0: none heats
  unsigned seed;
};

// Everything as after loading. The environment is read again:
//   FAKE_HD_MANUAL=1        no thread: fakeHdStep runs the scheduler
//   FAKE_HD_MISSING=left    that arm cannot be opened (right, left, or all)
//   FAKE_HD_SWAPPED=1       the right arm is the second in the library's list
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
void fakeHdUnkind(const struct FakeHdUnkind* unkind);
void fakeHdBlock(int arm, unsigned milliseconds);  // the arm's next frame waits that long for it, and both arms with it
void fakeHdStorm(double chance);                   // of an error at any call: any code, any arm in its record, or none
unsigned long fakeHdNow(void);                     // [ns] on the scheduler's own clock; begins at one second
// Where the hand means to be [mm], how it holds the stylus (x, y, z, w), which buttons it presses.
void fakeHdHand(int arm, const double* position, const double* quaternion, int buttons);
// [N/mm], [N s/mm], [kg] arm and finger together, [N] dry friction.
void fakeHdGrip(int arm, double stiffness, double damping, double mass, double coulomb);
void fakeHdPlace(int arm, const double* position);  // at once, at rest
void fakeHdRead(int arm, FakeHdArm* out);
void fakeHdZero(int arm);  // its energy and its largest values
}
