// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_hd: the test's side of the simulated libHD: its extra functions, found in the library that the driver
// loaded.
#pragma once
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <string>

#include "core/math.h"
#include "fake_hd.h"

namespace catgut {

struct FakeHd {
  void* library = nullptr;
  decltype(&fakeHdReset) reset = nullptr;
  decltype(&fakeHdStep) step = nullptr;
  decltype(&fakeHdFault) fault = nullptr;
  decltype(&fakeHdRaise) raise = nullptr;
  decltype(&fakeHdUnkind) unkind = nullptr;
  decltype(&fakeHdBlock) block = nullptr;
  decltype(&fakeHdStorm) storm = nullptr;
  decltype(&fakeHdNow) now = nullptr;
  decltype(&fakeHdHand) hand = nullptr;
  decltype(&fakeHdGrip) grip = nullptr;
  decltype(&fakeHdPlace) place = nullptr;
  decltype(&fakeHdRead) read = nullptr;
  decltype(&fakeHdZero) zero = nullptr;

  // manual: the test runs the scheduler by step(); else it has a thread of its own.
  explicit FakeHd(bool manual) {
    for (const char* name : {"FAKE_HD_MISSING", "FAKE_HD_UNCALIBRATED", "FAKE_HD_BUSY", "FAKE_HD_FAULT", "FAKE_HD_SWAPPED"})
      unsetenv(name);
    setenv("FAKE_HD_MANUAL", manual ? "1" : "0", 1);
    setenv("CATGUT_LIBHD", CATGUT_FAKE_LIBHD, 1);
    library = dlopen(CATGUT_FAKE_LIBHD, RTLD_NOW | RTLD_LOCAL);
    if (!library) ADD_FAILURE() << dlerror();
    find(reset, "fakeHdReset"), find(step, "fakeHdStep"), find(fault, "fakeHdFault"), find(raise, "fakeHdRaise"),
        find(hand, "fakeHdHand");
    find(unkind, "fakeHdUnkind"), find(block, "fakeHdBlock"), find(storm, "fakeHdStorm"), find(now, "fakeHdNow");
    find(grip, "fakeHdGrip"), find(place, "fakeHdPlace"), find(read, "fakeHdRead"), find(zero, "fakeHdZero");
    reset();
  }
  template <typename F>
  void find(F& f, const char* name) {
    f = reinterpret_cast<F>(dlsym(library, name));
    if (!f) ADD_FAILURE() << name;
  }
  FakeHdArm at(int arm) const {
    FakeHdArm a{};
    read(arm, &a);
    return a;
  }
  Vec3 force(int arm) const {
    const FakeHdArm a = at(arm);
    return {static_cast<float>(a.force[0]), static_cast<float>(a.force[1]), static_cast<float>(a.force[2])};
  }
  Vec3 asked(int arm) const {
    const FakeHdArm a = at(arm);
    return {static_cast<float>(a.asked[0]), static_cast<float>(a.asked[1]), static_cast<float>(a.asked[2])};
  }
  // [m]
  Vec3 position(int arm) const {
    const FakeHdArm a = at(arm);
    return Vec3{static_cast<float>(a.position[0]), static_cast<float>(a.position[1]), static_cast<float>(a.position[2])} *
           1e-3f;
  }
  void wish(int arm, Vec3 p, Quat q = {}, int buttons = 0) const {
    const std::array<double, 3> mm{1e3 * double{p.x}, 1e3 * double{p.y}, 1e3 * double{p.z}};
    const std::array<double, 4> turn{double{q.x}, double{q.y}, double{q.z}, double{q.w}};
    hand(arm, mm.data(), turn.data(), buttons);
  }
  void put(int arm, Vec3 p) const {
    const std::array<double, 3> mm{1e3 * double{p.x}, 1e3 * double{p.y}, 1e3 * double{p.z}};
    place(arm, mm.data());
  }
};

}  // namespace catgut
