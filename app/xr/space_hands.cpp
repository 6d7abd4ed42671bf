// SPDX-License-Identifier: Apache-2.0
// app/xr: see space_hands.h.
#include "xr/space_hands.h"

#include "exchange/buttons.h"

namespace catgut::xr {
namespace {

constexpr float kReach = 0.11f;                            // [m] from the grip's center to the jaws
constexpr float kTilt = 0.6f;                              // [rad] of the shaft below the grip's -z
constexpr float kFingerReach = 0.05f;                      // [m] from the pinch to the jaws
constexpr float kPinchShut = 0.012f, kPinchOpen = 0.055f;  // [m] between the tips of thumb and index finger
constexpr float kPulled = 0.6f;                            // of the trigger: it holds

float low_pass_share(float cutoff, float dt) {
  const float tau = 1 / (2 * kPi * cutoff);
  return dt / (dt + tau);
}

Pose grip_to_tool(bool articulated, float loupe) {
  if (articulated) return {Vec3{0, 0, -kFingerReach / loupe}, {}};
  const Quat tilt = axis_angle({1, 0, 0}, -kTilt);
  return {rotate(tilt, {0, 0, -kReach / loupe}), tilt};
}

}  // namespace

void pinch(const Fingers& f, HandState& hand) {
  const Vec3 back = 0.5f * (f.index_knuckle + f.thumb_knuckle), middle = 0.5f * (f.thumb_tip + f.index_tip);
  // Across the knuckles and not between the tips: those touch when the pinch is closed.
  const Vec3 across = f.index_knuckle - f.thumb_knuckle;
  const Vec3 z = normalized(back - middle), y = normalized(cross(z, across), any_perpendicular(z));
  hand.tracked = hand.articulated = true;
  hand.grip = hand.aim = {middle, from_axes(cross(y, z), y, z)};
  hand.trigger = 1 - std::clamp((distance(f.thumb_tip, f.index_tip) - kPinchShut) / (kPinchOpen - kPinchShut), 0.0f, 1.0f);
}

Pose Steady::filter(const Pose& measured, float dt) {
  if (!started || dt <= 0) {
    started = true;
    value = measured, speed = {}, turn = {};
    return value;
  }
  constexpr float kSpeedCutoff = 4;  // [Hz]
  const float smooth = low_pass_share(kSpeedCutoff, dt);
  speed = lerp(speed, (measured.p - value.p) / dt, smooth);
  const Vec3 turned = rotation_vector(measured.q * conjugate(value.q));
  turn = lerp(turn, turned / dt, smooth);
  value.p = lerp(value.p, measured.p, low_pass_share(cutoff + per_speed * length(speed), dt));
  value.q = nlerp(value.q, measured.q, low_pass_share(cutoff + per_turn * length(turn), dt));
  return value;
}

Pose tool_in_grip(const Pose& grip, bool articulated, float loupe) { return grip * grip_to_tool(articulated, loupe); }
Pose grip_of_tool(const Pose& tool, bool articulated, float loupe) { return tool * inverse(grip_to_tool(articulated, loupe)); }

size_t tool_of(size_t side, bool left_handed) { return (side == 1) != left_handed ? 0 : 1; }

std::array<ToolInput, 2> move(SpaceHands& hands, const std::array<HandState, 2>& state, const Place& place,
                              const SpaceHandOptions& options, const Snapshot& seen, bool active, float dt, uint64_t time_ns) {
  std::array<ToolInput, 2> out;
  for (size_t side = 0; side < 2; ++side) {
    const HandState& s = state[side];
    const size_t k = tool_of(side, options.left_handed);
    SpaceHand& h = hands.hand[k];
    ToolInput in = h.sent;
    const bool ever = hands.sequence > 0 && h.sent.connected;
    in.buttons = 0;
    in.velocity = in.angular_velocity = {};
    if (!active || !s.tracked) {
      h.attached = h.clutched = false;
      h.steady.started = false;
      if (!ever) in = no_hand();
    } else {
      const Pose measured = place.to_world(s.grip);
      const Pose grip = options.steady ? h.steady.filter(measured, dt) : measured;
      const Pose natural = tool_in_grip(grip, s.articulated, place.loupe);
      const float scale = std::clamp(options.motion_scale, 0.2f, 1.0f);
      const bool holds = seen.tool[k].held != Held::nothing || seen.tool[k].loop_wraps > 0;
      if (s.clutch) {
        h.attached = false;
        h.clutched = true;
      } else if (!h.attached) {
        h.attached = true;
        // From the clutch, or back with something in the jaws: continue from where the tool is.
        h.displaced = ever && (h.clutched || holds || scale < 1);
        h.hand_from = natural;
        h.tool_from = ever ? h.sent.pose : natural;
        h.jaw_waits = ever && holds && s.trigger < kPulled;
      }
      if (h.attached) {
        // Displaced by a gap in the tracking: back to the hand once nothing is held.
        if (!h.clutched && !holds && scale >= 1) h.displaced = false;
        if (!h.displaced && scale < 1) h.displaced = true, h.hand_from = natural, h.tool_from = ever ? h.sent.pose : natural;
        in.pose = natural;
        if (h.displaced) {
          in.pose.p = h.tool_from.p + (natural.p - h.hand_from.p) * scale;
          in.pose.q = normalized(natural.q * conjugate(h.hand_from.q) * h.tool_from.q);
        }
      }
      h.jaw_waits = h.jaw_waits && s.trigger < kPulled;
      in.jaw = h.jaw_waits ? h.sent.jaw : 1 - std::clamp(s.trigger, 0.0f, 1.0f);
      in.buttons = (s.cut ? kButtonCut : 0) | (s.new_suture ? kButtonNewSuture : 0);
      in.connected = 1;
      if (ever && dt > 0) {
        in.velocity = (in.pose.p - h.sent.pose.p) / dt;
        in.angular_velocity = rotation_vector(in.pose.q * conjugate(h.sent.pose.q)) / dt;
      }
    }
    in.time_ns = time_ns;
    in.sequence = hands.sequence;
    h.sent = out[k] = in;
  }
  ++hands.sequence;
  return out;
}

void resume(SpaceHands& hands, const Snapshot& seen) {
  for (size_t k = 0; k < 2; ++k) {
    SpaceHand& h = hands.hand[k];
    h.attached = h.displaced = h.clutched = false;
    h.steady.started = false;
    if (h.sent.connected && hands.sequence > 0) h.sent.pose = seen.tool[k].hand, h.sent.jaw = seen.tool[k].jaw;
  }
}

}  // namespace catgut::xr
