// SPDX-License-Identifier: Apache-2.0
// A thread hangs from a hook. The tension that the solver reports in each pair is the weight of the thread below it.
// Shows: one kernel of the solver used alone, without a scene; a multiplier is a force in newtons.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "solver/thread.h"

using namespace catgut;

int main() {
  constexpr uint32_t kCount = 60;
  constexpr float kSpacing = 0.002f, kMass = 2e-6f, kG = 9.81f,
                  kH = 1.0f / 960;  // [m], [kg], [m/s^2], [s]
  StrandModel model;
  model.count = kCount;
  model.spacing = kSpacing;
  model.inv_mass = 1 / kMass;
  model.stretch_compliance = 1e-6f;
  model.bend_compliance = 2e4f;
  model.gravity = {0, -kG, 0};
  Strand thread;
  Column<Vec4> x, v(kCount), before;
  const std::vector<float> inv_mass(kCount, 1 / kMass);
  for (uint32_t i = 0; i < kCount; ++i) x.push_back(point({kSpacing * static_cast<float>(i), 0, 0}));  // horizontal: it falls
  reset(model, thread);
  thread.hold.push_back({0, 0, {}});  // node 0 on body 0, the fixed hook
  const std::vector<RigidModel> hook_model(1);
  std::vector<RigidBody> hook(1);
  ThreadScratch scratch;
  scratch.resize(kCount);
  for (int step = 0; step < 960 * 5; ++step) {  // five seconds, with air drag
    std::fill(scratch.lambda.begin(), scratch.lambda.end(), 0.0f);
    before = x;
    for (uint32_t i = 1; i < kCount; ++i) add(x[i], (xyz(v[i]) + model.gravity * kH) * kH);
    solve_thread(model, thread, scratch, x.data(), before.data(), inv_mass.data(), hook_model, hook, kH);
    for (uint32_t i = 0; i < kCount; ++i) set(v[i], (xyz(x[i]) - xyz(before[i])) / (kH * (1 + 4 * kH)));
  }
  double worst = 0;
  for (uint32_t i = 0; i + 1 < kCount; ++i) {
    const double below = double{kG} * double{kMass} * (kCount - 1 - i);
    worst = std::max(worst, std::abs(thread.tension[i] / below - 1));
  }
  const float length = thread_length(thread, x.data(), hook);
  std::printf("tension at the hook %.4f mN, weight %.4f mN; worst pair off by %.2g %%; length %.2f mm\n",
              1e3 * thread.tension[0], 1e3 * kG * kMass * (kCount - 1), 100 * worst, 1e3 * length);
  return worst < 0.02 && std::abs(length / (kSpacing * (kCount - 1)) - 1) < 0.01 ? 0 : 1;
}
