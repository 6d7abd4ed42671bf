// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_dhd: additions of the simulated libdhd.so for tests. SI units, its maker's axes (x toward
// the user, y right, z up). Environment, read by fakeDhdReset and at loading: FAKE_DHD_COUNT (2), FAKE_DHD_MANUAL (1: an arm's
// millisecond passes on the test's command), FAKE_DHD_UNCALIBRATED, FAKE_DHD_LOCKED (1: opening fails).
#pragma once

enum FakeDhdFault { kDhdUnplugged = 1, kDhdNan = 2, kDhdHang = 3 };

struct FakeDhdArm {
  double position[3], force[3];  // force at the motors: 0 while the firmware has cut it
  double step_most;              // [N] from one millisecond to the next, of what the driver asked for
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
}
