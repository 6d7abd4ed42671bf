// SPDX-License-Identifier: Apache-2.0
// Sample: a haptic device of your own. Fill an ArmPort with the functions of your backend; its caller makes the force safe.
// Here the backend is a thread whose stylus descends slowly onto the bowel's wall. A real one calls `step` from its own
// callback, 1000 times per second, with its encoders' state. It sends the result to the motors.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "procedure/scene_file.h"
#include "runtime/haptics.h"
#include "sim/simulation.h"

namespace {

using namespace catgut;

struct MyArm {
  std::atomic<bool> quit{false};
  std::atomic<uint64_t> steps{0};
  std::atomic<float> most{0};  // [N] maximum so far
  std::thread servo;
};

bool start(void* self, const ArmCallback& callback, std::string&) {
  MyArm& arm = *static_cast<MyArm*>(self);
  arm.servo = std::thread([&arm, callback] {
    for (auto next = std::chrono::steady_clock::now(); !arm.quit; next += std::chrono::milliseconds(1)) {
      ArmSample s;
      s.state = ArmState::ready;
      const float t = 0.001f * static_cast<float>(arm.steps);
      s.pose.p = {0.0037f, t < 2.5f ? 0.0f : -0.012f * (t - 2.5f), -0.010f};  // [m] waits until force is let in, then goes down
      s.pose.q = axis_angle({1, 0, 0}, -0.5f * kPi);                          // -z, its pointing direction, is down
      arm.most = std::max(arm.most.load(), length(callback.step(callback.user, 0, s).force));
      ++arm.steps;
      std::this_thread::sleep_until(next);
    }
  });
  return true;
}
// A real one first reduces the motors' force, by at most 0.5 N per millisecond, and then switches them off.
void stop(void* self) {
  MyArm& arm = *static_cast<MyArm*>(self);
  arm.quit = true;
  if (arm.servo.joinable()) arm.servo.join();
}
ArmStatus status(void* self, size_t k) { return {k == 0, 0, 0, static_cast<MyArm*>(self)->steps}; }
std::string error_text(void*, uint32_t) { return ""; }
void close(void* self) { stop(self); }

}  // namespace

int main() {
  SceneSpec scene = read_scene("purse_string");
  prepare_for_arms(scene);
  const auto model = build_model(scene);
  StatePtr state = initial_state(*model);
  Jobs jobs(1);

  MyArm arm;
  ArmPort port;
  port.kind = "mine";
  port.arm[0].present = true;
  port.self = &arm;
  port.start = start, port.stop = stop, port.status = status, port.error_text = error_text, port.close = close;
  Haptics haptics(std::move(port), picture_model(*model), {});

  TickInput input;
  input.hand[1].connected = 0;
  Snapshot seen;
  const auto dt = std::chrono::duration<float>(1 / scene.solver.tick_rate);
  auto due = std::chrono::steady_clock::now();
  for (int tick = 0; tick < static_cast<int>(6 * scene.solver.tick_rate) && arm.steps < 6000; ++tick) {
    input.tick = seen.tick;
    input.hand[0] = haptics.hand(0);
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    haptics.publish(0, seen.patch[0], 0, 1);
    due += std::chrono::duration_cast<std::chrono::steady_clock::duration>(dt);
    std::this_thread::sleep_until(due);
  }
  haptics.stop();
  std::printf("%llu samples, %.2f N at most\n", static_cast<unsigned long long>(arm.steps), static_cast<double>(arm.most));
  // The force felt in time depends on the machine; the published force does not.
  return arm.steps > 1000 && arm.most < 3.31f && length(seen.patch[0].force) > 0.02f ? 0 : 1;
}
