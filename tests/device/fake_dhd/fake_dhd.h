// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_dhd: additions of the simulated libdhd.so for tests. SI units, its maker's axes (x toward
// the user, y right, z up). Environment, read by fakeDhdReset and at loading: FAKE_DHD_COUNT (2), FAKE_DHD_MANUAL (1: an arm's
// millisecond passes on the test's command), FAKE_DHD_UNCALIBRATED, FAKE_DHD_LOCKED (1: opening fails), FAKE_DHD_SWAPPED
// (1: the right hand's device is the first), FAKE_DHD_NAME (with "sigma": motors for rotation; with ".7": of a gripper).
#pragma once
struct UnkindDevice;

enum FakeDhdFault { kDhdUnplugged = 1, kDhdNan = 2, kDhdHang = 3 };

struct FakeDhdArm {
  double position[3], force[3];   // force at the motors: 0 while the firmware has cut it
  double asked[3];                // [N] last written
  double torque[3], grip;         // [N m], [N] at the motors
  double torque_step, grip_step;  // from one call to the next
  double to_hand_most;            // [J] to the hand since fakeDhdZero, beyond what the device's damping takes
  double force_most;
  double max_force, max_torque, max_gripper;  // the library's own clamps
  double step_most;                           // [N] from one millisecond to the next, of what the driver asked for
  int open, output, cause, watchdog;
  unsigned long writes;
};

extern "C" {
void fakeDhdReset(void);
// Milliseconds for both devices; waits until the backend's thread has served them. False: not within five seconds.
bool fakeDhdStep(int milliseconds);
void fakeDhdRun(void);  // from now on time runs on its own
void fakeDhdFault(int arm, int fault, int on);
void fakeDhdHand(int arm, const double* position, const double* rotation_rows, int button, double gap);
void fakeDhdFast(int arm);  // the firmware cuts the force: too fast
void fakeDhdRead(int arm, struct FakeDhdArm* out);
void fakeDhdZero(int arm);
void fakeDhdUnkind(const struct UnkindDevice* unkind);
void fakeDhdGrip(int arm, double stiffness, double damping, double mass);  // [N/m], [N s/m], [kg]
unsigned long fakeDhdErrors(void);                                         // raised by UnkindDevice::storm
unsigned long fakeDhdNow(int arm);  // [ns] on that device's clock, which begins at one second
}
