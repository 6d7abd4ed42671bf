// SPDX-License-Identifier: Apache-2.0
// core/profile: time per stage of a tick. Fixed stages, one accumulator each; times never affect the state, only reports.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace catgut {

enum class Stage : uint8_t {
  predict,
  shape,
  volume,
  thread,
  attach,
  rigid,
  broadphase,
  self_contact,
  tool_contact,
  thread_contact,
  velocity,  // solver
  loop,
  puncture,
  pull,
  closure,
  publish,
  count_
};
const char* stage_name(Stage stage);
constexpr Stage kLastSolverStage = Stage::velocity;

struct StageTimes {
  std::array<double, static_cast<size_t>(Stage::count_)> ms{};  // accumulated wall time
  uint32_t contacts = 0;                                        // largest number of active contacts in a substep
  double solver_ms() const {
    double s = 0;
    for (size_t i = 0; i <= static_cast<size_t>(kLastSolverStage); ++i) s += ms[i];
    return s;
  }
};

// Adds the time from construction to destruction to one stage; does nothing for a null table.
class StageTimer {
 public:
  StageTimer(StageTimes* times, Stage stage) : times_(times), stage_(stage) {
    if (times_) start_ = std::chrono::steady_clock::now();
  }
  ~StageTimer() {
    if (times_) {
      const std::chrono::duration<double, std::milli> d = std::chrono::steady_clock::now() - start_;
      times_->ms[static_cast<size_t>(stage_)] += d.count();
    }
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageTimes* times_;
  Stage stage_;
  std::chrono::steady_clock::time_point start_{};
};

}  // namespace catgut
