// SPDX-License-Identifier: Apache-2.0
// surgeon/hands: see the header.
#include "surgeon/hands.h"

#include <cmath>

namespace catgut {

bool move_toward(ScriptedHand& hand, const Pose& goal, float speed, float dt) {
  constexpr float kTurnRate = 4.0f;  // [rad/s]
  const Vec3 way = goal.p - hand.pose.p;
  const Vec3 turn = rotation_vector(goal.q * conjugate(hand.pose.q));
  const float far = length(way), angle = length(turn);
  // Accelerates and decelerates like a hand: at most 1.5 m/s^2, and never faster than it can stop in time.
  constexpr float kAcceleration = 1.5f;
  const float allowed =
      std::min({speed, std::sqrt(2 * kAcceleration * far) + 0.002f, length(hand.velocity) + kAcceleration * dt});
  const float step = std::min(far, allowed * dt);
  const Vec3 moved = far > 0 ? way * (step / far) : Vec3{};
  hand.velocity = moved / dt;
  hand.pose.p += moved;
  // The rotation is spread over the whole path, so that tool and needle arrive aligned.
  const float share = far > 1e-6f ? std::max(step / far, std::min(1.0f, kTurnRate * dt / std::max(angle, 1e-6f)) * 0.5f) : 1.0f;
  const float most = std::min(1.0f, kTurnRate * dt / std::max(angle, 1e-6f));
  hand.pose.q = nlerp(hand.pose.q, goal.q, std::min(share, most));
  return far - step < 0.0003f && angle < 0.02f;
}

bool move_jaw(ScriptedHand& hand, float goal, float dt) {
  const float step = 5 * dt;
  hand.jaw += std::clamp(goal - hand.jaw, -step, step);
  return std::abs(goal - hand.jaw) < 1e-4f;
}

void tremble(ScriptedHand& hand, float deviation, Random& random, float dt) {
  // Ornstein-Uhlenbeck: its variance is independent of the tick rate.
  const float keep = portable::exp(-2 * kPi * 8 * dt), kick = deviation * std::sqrt(1 - keep * keep);
  hand.tremor = hand.tremor * keep + Vec3{random.normal(), random.normal(), random.normal()} * kick;
}

ToolInput as_input(ScriptedHand& hand, const Pose& before, float dt, uint32_t sequence) {
  ToolInput in;
  in.pose = {hand.pose.p + hand.tremor, hand.pose.q};
  in.velocity = (hand.pose.p - before.p) / dt;
  in.angular_velocity = rotation_vector(hand.pose.q * conjugate(before.q)) / dt;
  in.jaw = hand.jaw;
  in.sequence = sequence;
  return in;
}

}  // namespace catgut
