// SPDX-License-Identifier: Apache-2.0
// haptic/servo: see the header.
#include "haptic/servo.h"

namespace catgut {

Pose to_world(const Workspace& w, const Pose& arm) {
  return {w.offset + rotate(w.turn, arm.p) * w.scale, normalized(w.turn * arm.q * w.stylus)};
}
Pose to_arm(const Workspace& w, const Pose& world) {
  return {rotate(conjugate(w.turn), world.p - w.offset) / w.scale,
          normalized(conjugate(w.turn) * world.q * conjugate(w.stylus))};
}

namespace {

// Newtons at the motors per newton in the field.
float gain_of(const ServoOptions& o, float strength) { return (o.gain > 0 ? o.gain : o.place.scale) * strength; }

}  // namespace

ForcePatch to_arm(const ServoOptions& o, const ForcePatch& world, float strength) {
  const Workspace& w = o.place;
  const float gain = gain_of(o, strength);
  const Quat turn = conjugate(w.turn);
  const auto way = [&turn](Vec3 v) { return rotate(turn, v); };
  // S -> R S R^T, column by column.
  const auto tensor = [&](const Sym3& s, float factor) {
    const Vec3 x = way(s * rotate(w.turn, {1, 0, 0})), y = way(s * rotate(w.turn, {0, 1, 0})),
               z = way(s * rotate(w.turn, {0, 0, 1}));
    Sym3 out;
    out.xx = x.x * factor, out.yy = y.y * factor, out.zz = z.z * factor;
    out.xy = x.y * factor, out.xz = x.z * factor, out.yz = y.z * factor;
    return out;
  };
  ForcePatch p = world;
  p.point = way(world.point - w.offset) / w.scale;
  p.force = way(world.force) * gain;
  p.stiffness = tensor(world.stiffness, gain * w.scale);
  p.damping = tensor(world.damping, gain * w.scale);
  p.normal = way(world.normal), p.along = way(world.along), p.pierce = way(world.pierce);
  p.thread_direction = way(world.thread_direction);
  p.gap = world.gap / w.scale, p.presliding = world.presliding / w.scale;
  p.drag = world.drag * gain, p.viscous = world.viscous * gain * w.scale;
  p.pierce_force = world.pierce_force * gain, p.thread_tension = world.thread_tension * gain;
  p.cap = world.cap * gain;
  p.turn = to_arm(w, {{}, world.turn}).q;
  p.lever = way(world.lever) / w.scale;
  p.couple = way(world.couple) * (gain / w.scale), p.couple_stiffness = world.couple_stiffness * (gain / w.scale);
  p.grip_stiffness = world.grip_stiffness * (gain / w.scale);
  return p;
}

namespace {

constexpr float kFastTime = 0.05f;    // [s] over which ServoHand::fast fades
constexpr float kFarthest = 10;       // [m] beyond the range of any device: such a position is invalid
constexpr float kStrengthRate = 1;    // [1/s]
constexpr float kLeastTwist = 0.02f;  // [N m/rad] as PassivityOptions::least_stiffness, of a couple

// [m] position of the hand that presses as much as this pose does.
Vec3 felt_at(const ForceModel& m, const Pose& hand) { return hand.p + (lever_of(m) - m.now.lever); }

// Distance of the hand from the point of the patch [m]. Outside a surface the force is zero and any distance is valid.
float off_patch(const ForcePatch& p, Vec3 x) {
  Vec3 d = x - p.point;
  if (length2(p.normal) > 0) d -= p.normal * std::max(0.0f, dot(d, p.normal));
  return length(d);
}

}  // namespace

void fit_to_arm(ServoOptions& o, const ArmLimits& limits) {
  const auto known = [](float says, float careful) { return says > 0 && std::isfinite(says) ? says : careful; };
  o.limits.force = known(limits.force, o.limits.force);
  o.limits.continuous = known(limits.continuous, o.limits.continuous);
  o.limits.stiffness = known(limits.stiffness, o.limits.stiffness);
  o.limits.damping = known(limits.damping, o.limits.damping);
  o.limits.torque = known(limits.torque, 0), o.limits.grip = known(limits.grip, 0);
  o.limits.turn_stiffness = known(limits.turn_stiffness, 0), o.limits.turn_damping = known(limits.turn_damping, 0);
  o.limits.grip_stiffness = known(limits.grip_stiffness, 0);
  // The soft map starts at the same fraction of the peak for every device.
  o.limiter.knee *= o.limits.force / o.limiter.force;
  o.limiter.force = o.limits.force;
  o.limiter.continuous = std::min(o.limits.continuous, o.limits.force);
  o.limiter.torque = o.passivity.torque = o.limits.torque;
  o.limiter.grip = o.passivity.grip = o.limits.grip;
  o.passivity.damping = std::min(o.passivity.damping, o.limits.damping);
  o.passivity.turn_damping = o.limits.turn_damping;
  o.passivity.grip_damping = o.limits.grip_stiffness * o.model.damping_time;
}

ServoOut servo_step(ServoHand& h, const ServoOptions& o, const ArmSample& sample, const ForcePatch* fresh, uint64_t now_ns,
                    EnergyPool* pool, size_t k) {
  ServoOut out;
  const bool ready = sample.state == ArmState::ready && length2(sample.pose.p) < kFarthest * kFarthest &&
                     std::isfinite(sample.pose.q.x + sample.pose.q.y + sample.pose.q.z + sample.pose.q.w);
  if (sample.state == ArmState::ready && !ready) h.limiter.faults |= kNotFinite;
  float dt = 0.001f;
  if (h.steps++ > 0)
    dt = safe_dt(h.limiter, now_ns >= h.last_ns ? 1e-9f * static_cast<float>(now_ns - h.last_ns) : -1.0f, o.limiter);
  h.last_ns = now_ns;
  h.strength += std::clamp(h.strength_wanted - h.strength, -kStrengthRate * dt, kStrengthRate * dt);
  const float gain = gain_of(o, h.strength), turn_gain = gain / std::max(1e-6f, o.place.scale);

  // Position of the hand. A lost device keeps the last position; a reconnected one starts at rest.
  PassivityInput net;
  if (ready) {
    const float jaw = sample.jaw >= 0 ? std::min(1.0f, sample.jaw) : 1.0f;
    if (!h.any) h.at = sample.pose.p, h.velocity = {}, h.turned = sample.pose.q, h.spin = {}, h.jaw = jaw, h.jaw_rate = 0;
    const float keep = std::exp(-2 * kPi * o.velocity_filter * dt);
    h.velocity = h.velocity * keep + (sample.pose.p - h.at) * ((1 - keep) / dt);
    h.at = sample.pose.p;
    if (o.limits.torque > 0) net.turned = rotation_vector(sample.pose.q * conjugate(h.turned));
    h.spin = h.spin * keep + net.turned * ((1 - keep) / dt);
    h.turned = sample.pose.q;
    h.jaw_rate = h.jaw_rate * keep + (jaw - h.jaw) * ((1 - keep) / dt);
    h.jaw = jaw;
  } else {
    h.velocity = h.spin = {};
    h.jaw_rate = 0;
  }
  h.any = ready;

  const uint32_t down = ready ? sample.buttons & ~h.buttons : 0;
  if (ready) h.buttons = sample.buttons;
  Pose world = to_world(o.place, {h.at, sample.pose.q});
  world.p += h.clutch;
  Vec3 velocity = rotate(o.place.turn, h.velocity) * o.place.scale;
  if (down & 2) {
    h.cuts = h.second_ns > 0 && now_ns < h.second_ns + static_cast<uint64_t>(1e9 * double{o.twice});
    h.second_ns = h.cuts ? 0 : now_ns;
    h.clutched = o.clutch && !h.cuts;
    h.held_at = world.p;
  }
  if (!(h.buttons & 2)) h.cuts = false;
  if (h.clutched) {
    h.clutch += h.held_at - world.p;
    world.p = h.held_at;
    velocity = {};
    if (ready && !(h.buttons & 2)) h.clutched = false;
  }
  h.fast = std::max(h.fast * std::exp(-dt / kFastTime), length(velocity) + length(h.spin) * length(lever_of(h.model)));
  // The rendered stiffness is gain * scale times the stiffness in the field.
  const float most = 1 / std::max(1e-6f, gain * o.place.scale);
  ForceModelOptions model = o.model;
  model.stiffness = o.limits.stiffness * most;
  model.damping = o.limits.damping * most;
  const float turn_most = 1 / std::max(1e-6f, turn_gain);
  model.turn_damping = o.limits.turn_damping * turn_most;
  if (fresh) {
    ForcePatch patch = *fresh;
    ArmLimits field = o.limits;
    field.force /= std::max(1e-6f, gain);
    field.stiffness *= most, field.damping *= most;
    field.torque *= turn_most, field.turn_stiffness *= turn_most, field.turn_damping *= turn_most;
    field.grip *= turn_most, field.grip_stiffness *= turn_most;
    if (!make_safe(patch, field)) h.limiter.faults |= kBadModel;
    if (h.has_patch && patch.epoch != h.epoch) disengage(h.limiter);
    h.epoch = patch.epoch;
    h.has_patch = true;
    receive(h.model, patch, model);
  }
  LimiterInput in;
  if (h.has_patch) {
    const FeltMotion motion{world.p, velocity, world.q, rotate(o.place.turn, h.spin), h.jaw, h.jaw_rate};
    const ArmForce felt = evaluate(h.model, motion, dt, model);
    const ForcePatch& at = h.model.now;
    const Vec3 f = felt.force;
    const Quat turn = conjugate(o.place.turn);
    net.rubbed = rotate(turn, h.model.rubbed) * gain;
    net.rubbed_torque = rotate(turn, cross(lever_of(h.model), h.model.rubbed)) * turn_gain;
    net.stiffness = (length2(f) > 0 ? dot(f, at.stiffness * f) / length2(f) : 0) + h.model.rub;
    net.stored += length2(h.model.couple) * turn_gain / std::max(kLeastTwist, at.couple_stiffness);
    if (at.grip_stiffness > 0) net.stored += felt.grip * felt.grip * turn_gain * kGripTravel / at.grip_stiffness;
    in.wanted = {rotate(turn, f) * gain, rotate(turn, felt.torque) * turn_gain, felt.grip * turn_gain};
    in.cap = h.model.now.cap * gain;
    in.expiry = h.model.now.expiry;
    const uint64_t made = h.model.now.time_ns;
    if (made > now_ns + 5000000) h.limiter.faults |= kTimeBack;
    in.age = made < now_ns ? 1e-9f * static_cast<float>(now_ns - made) : 0;
    // No force to render (cap 0: something else moves the tool), or the patch belongs to another position.
    if (h.model.now.cap <= 0) disengage(h.limiter);
    const ForcePatch& p = h.model.now;
    if (p.cap > 0 && ready && off_patch(p, felt_at(h.model, world)) > o.reach + h.fast * (in.age + p.period)) {
      if (h.limiter.engaged == Engaged::rising || h.limiter.engaged == Engaged::yes) h.limiter.faults |= kElsewhere;
      in.wanted = {};
      disengage(h.limiter);
    }
  } else {
    in.age = -1;
  }
  in.speed = length(h.velocity);
  in.warmth = sample.warmth;
  in.ready = ready && !sample.forced_off && o.force && !h.clutched;
  const ArmForce allowed = limit(h.limiter, in, dt, o.limiter);
  out.wanted = in.wanted, out.allowed = allowed;
  PassivityOptions brake = o.passivity;
  if (h.limiter.engaged == Engaged::no || h.limiter.engaged == Engaged::waiting) brake.damping = 0;  // off stays off
  // When softened, capped or ramped, the rendered spring is softer than the patch's by the same factor.
  const float wanted = length(in.wanted.force), part = wanted > 0 ? std::min(1.0f, length(allowed.force) / wanted) : 1;
  net.x = h.at, net.v = h.velocity, net.dt = dt;
  net.force = allowed.force, net.rubbed *= part, net.rubbed_torque *= part, net.most = o.limiter.force;
  net.stiffness *= part / most;
  net.lent = pool ? lent_to(*pool, k) : 0;
  net.torque = allowed.torque, net.spin = h.spin;
  net.grip = allowed.grip, net.gap = h.jaw * kGripTravel, net.gap_rate = h.jaw_rate * kGripTravel;
  static_cast<ArmForce&>(out) = keep_passive(h.passivity, net, brake);
  if (pool) settle(*pool, k, h.passivity, dt);
  if (h.passivity.braking) h.limiter.faults |= kGenerated;

  if (o.ratchet) h.closed ^= (down & 1) != 0;
  else if (ready) h.closed = (sample.buttons & 1) != 0;
  out.hand.pose = world;
  out.hand.velocity = velocity;
  // A gripper's jaw follows the fingers; a button closes and opens it.
  out.hand.jaw = sample.jaw >= 0 ? std::min(1.0f, sample.jaw) : h.closed ? 0.0f : 1.0f;
  out.hand.buttons = h.cuts ? kButtonCut : 0;
  out.hand.time_ns = now_ns;
  out.hand.sequence = ++h.sequence;
  out.hand.connected = ready;
  return out;
}

}  // namespace catgut
