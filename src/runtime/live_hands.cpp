// SPDX-License-Identifier: Apache-2.0
// runtime: motion of a hand toward its newest message, and the clocks of the window; see live.h.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "runtime/live.h"

namespace catgut {

float hand_share(float every) { return 1 - std::exp(-2 / std::clamp(every, 0.3f, 8.0f)); }

ToolInput hand_toward(const ToolInput& from, const ToolInput& to, float speed, float turn, float dt, float share) {
  if (!from.connected || !to.connected) return to;
  ToolInput out = to;
  const Vec3 way = to.pose.p - from.pose.p, about = rotation_vector(to.pose.q * conjugate(from.pose.q));
  const float far = length(way), angle = length(about);
  if (far * share > speed * dt) share = std::min(share, speed * dt / far);
  float turned = share;
  if (angle * turned > turn * dt) turned = turn * dt / angle;
  if (share < 1) out.pose.p = from.pose.p + way * share;
  if (turned < 1) out.pose.q = nlerp(from.pose.q, to.pose.q, turned);
  out.jaw = from.jaw + std::clamp(to.jaw - from.jaw, -10 * dt, 10 * dt);
  out.velocity = (out.pose.p - from.pose.p) / dt;
  out.angular_velocity = rotation_vector(out.pose.q * conjugate(from.pose.q)) / dt;
  return out;
}

double wall_seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
uint64_t wall_ns() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

}  // namespace catgut
