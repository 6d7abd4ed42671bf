// SPDX-License-Identifier: Apache-2.0
// Catgut, a simulator of open-surgery suturing: its C++ interface. This header is the manual; it includes the rest.
//
//   #include <catgut/catgut.h>
//
//   #include <cstdio>
//
//   int main() {
//     const catgut::SceneSpec scene = catgut::read_scene("stay");  // a name or the path of a .toml file
//     const auto model = catgut::build_model(scene);               // constant
//     const auto state = catgut::initial_state(*model);            // all that changes
//     const auto surgeon = catgut::scripted_surgeon(scene, catgut::picture_model(*model));
//     catgut::Jobs jobs(2);   // two threads; the bits do not depend on their number
//     catgut::Snapshot seen;  // particles, instruments, forces, events
//     catgut::publish(*model, *state, seen);
//     for (uint64_t tick = 0; tick < 1200; ++tick) {
//       catgut::TickInput input = surgeon->operate(seen, 1 / scene.solver.tick_rate);  // or your own devices
//       input.tick = tick;
//       catgut::step(*model, *state, input, jobs);
//       catgut::publish(*model, *state, seen);
//     }
//     std::printf("%.1f s: %s\n", seen.time_s, surgeon->doing().c_str());
//     return catgut::state_is_valid(*model, *state) ? 0 : 1;
//   }
//
// Build it, with an installed Catgut (samples/embed is this program with its CMakeLists.txt):
//   find_package(catgut REQUIRED)
//   target_link_libraries(my_program PRIVATE catgut::catgut)
// or: c++ -std=c++20 my_program.cpp $(pkg-config --cflags --libs catgut)
//
// The target carries compiler flags (-ffp-contract=off among them). Inline functions of these headers are compiled in your
// program too, and its bits equal those of other programs only with the same flags.
//
// Units and frames. SI: meters, kilograms, seconds, newtons, radians. Right-handed: x to the right, y up, z toward the surgeon.
// A pose is a position and a unit quaternion (x, y, z, w). Instrument frame: see exchange/tool_input.h.
//
// Time. One call of `step` is one tick of 1 / scene.solver.tick_rate seconds. Nothing here reads a clock. The same scene and
// the same inputs give the same bits, for any number of threads and for every compiler and processor that tests/determinism
// covers.
//
// Threads. A Model is constant and may be shared. A State belongs to one caller at a time. Different states may be stepped by
// different threads, each with its own Jobs.
//
// Errors. InputError (core/check.h) for errors in a file or a scene: one line with place, error and remedy.
// A broken invariant of the library itself prints its place and aborts.
//
// Files. Scenes are found by name in the data folder, see core/data.h; CATGUT_DATA_DIR in the environment names another.
//
// Stability. Before 1.0 a minor version may change this interface; CHANGES.md lists how.
#pragma once

#define CATGUT_VERSION_MAJOR 0
#define CATGUT_VERSION_MINOR 1
#define CATGUT_VERSION_PATCH 0

#include "core/check.h"                  // InputError
#include "core/data.h"                   // where scenes are found
#include "core/jobs.h"                   // Jobs: the threads of a tick
#include "core/math.h"                   // Vec3, Quat, Pose
#include "exchange/event.h"              // what happened in a tick
#include "exchange/force_patch.h"        // a local model of the forces on a hand, for a 1 kHz loop
#include "exchange/picture.h"            // constant data: surfaces, skinning, rest positions
#include "exchange/snapshot.h"           // changing data: positions, instruments, sutures, knots, events
#include "exchange/tool_input.h"         // the only input of a tick
#include "procedure/scene_file.h"        // scenes from TOML and back
#include "procedure/scripted_surgeon.h"  // a scripted pair of hands
#include "sim/recording.h"               // recordings: inputs and a hash per tick
#include "sim/scene.h"                   // SceneSpec: a scene in code
#include "sim/simulation.h"              // build, step, publish, save, load, hash
