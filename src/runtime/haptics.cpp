// SPDX-License-Identifier: Apache-2.0
// runtime/haptics: see the header. Comments below state which thread may use Side's members.
#include "runtime/haptics.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <thread>

#include "core/check.h"
#include "device/drivers.h"
#include "exchange/latest.h"
#include "exchange/ring.h"
#include "runtime/live.h"

namespace catgut {
namespace {

constexpr uint64_t kRecently = 1000;  // [steps]
constexpr uint64_t kLost = 20000000;  // [ns] without a sample: the device is lost (criterion H7, docs/rooms/haptic.md)

const char* word_of(uint32_t fault) {
  switch (fault) {
    case kNotFinite:
      return "non-finite force or position";
    case kTooMuch:
      return "requested force far above the device limit; not applied";
    case kBadModel:
      return "invalid force patch";
    case kTimeBack:
      return "device clock stopped, ran backwards or jumped";
    case kTooFast:
      return "moved faster than 1 m/s; force off until it is slow";
    case kExpired:
      return "simulation stalled; force off until the hand releases";
    case kGenerated:
      return "passivity controller active";
    case kTooWarm:
      return "motors hot; force reduced";
    case kLate:
      return "servo late by more than 5 ms; close other programs, or run with real-time priority";
    case kElsewhere:
      return "contact does not match the hand position; force off until it does";
    default:
      return "";
  }
}

struct LogRow {
  uint64_t now_ns = 0;
  Pose pose;
  float jaw = -1;
  uint64_t tick = 0;
  float age = 0, stiffness = 0;
  Vec3 patch;
  ArmForce wanted, allowed, written;
  uint32_t faults = 0, engaged = 0;
  float strength = 1;
};

void write_row(std::FILE* log, size_t k, const LogRow& r) {
  const auto number = [log](float f, const char* how = ",%.5g") { std::fprintf(log, how, double{f}); };
  const auto vector = [&number](Vec3 v) { number(v.x), number(v.y), number(v.z); };
  std::fprintf(log, "%.6f,%zu", 1e-9 * static_cast<double>(r.now_ns), k);
  for (const float f : {r.pose.p.x, r.pose.p.y, r.pose.p.z}) number(f, ",%.7g");
  for (const float f : {r.pose.q.x, r.pose.q.y, r.pose.q.z, r.pose.q.w}) number(f, ",%.6g");
  std::fprintf(log, ",%llu,%.6f", static_cast<unsigned long long>(r.tick), double{r.age});
  vector(r.patch), number(r.stiffness), vector(r.wanted.force), vector(r.allowed.force), vector(r.written.force);
  std::fprintf(log, ",%u,%u", r.faults, r.engaged);
  vector(r.wanted.torque), vector(r.written.torque);
  for (const float f : {r.wanted.grip, r.written.grip, r.jaw, r.strength}) number(f);
  std::fputc('\n', log);
}

struct Hand {
  ToolInput input;
  uint64_t sampled_ns = 0;  // on the clock by which the device's patches age
  Vec3 clutch;              // [m] world, see ServoHand
  bool clutched = false;
};

struct Side {
  Latest<ForcePatch> patch;         // physics -> servo
  Latest<Hand> hand;                // servo -> physics
  std::atomic<uint32_t> faults{0};  // servo -> physics
  std::atomic<float> strength{1};   // user -> servo
  // servo -> display: written force, engagement, faults of the last second
  std::atomic<float> force{0}, peak{0};
  std::atomic<Engaged> engaged{Engaged::no};
  std::atomic<uint32_t> recent{0};
  std::unique_ptr<Ring<LogRow, 4096>> log;  // servo -> physics; null: not logged
  // Owned by the servo.
  ServoHand servo;
  ServoOptions options;  // constant during a run
  ServoTimes times;
  uint64_t last_ns = 0;
  uint32_t lately = 0;
  // Owned by the physics.
  uint32_t messages = 0, told_errors = 0;
  uint64_t taken_ns = 0;  // sample time of the pose that the physics took last
  bool was_ready = true;
};

void count(std::array<uint64_t, 512>& counts, uint64_t ns) { ++counts[std::min<uint64_t>(511, ns / 10000)]; }

}  // namespace

struct Haptics::Work {
  ArmPort port;
  std::array<Side, 2> side;
  std::array<size_t, 2> side_of{0, 1};  // hand in which each device is
  uint64_t (*clock)() = wall_ns;
  EnergyPool pool;  // of the servos

  void send(size_t k, const ForcePatch& patch) {
    Side& s = side[k];
    if (port.send_patch) {  // the device server does not know of clutching
      const Hand& hand = s.hand.seen();
      ForcePatch p = patch;
      p.point -= hand.clutch;
      if (hand.clutched) p.cap = 0;
      return port.send_patch(port.self, k, to_arm(s.options, p, s.strength.load(std::memory_order_relaxed)));
    }
    s.patch.draft() = patch;
    s.patch.publish();
  }
  std::FILE* log = nullptr;  // owned by the physics
  void write_log(size_t k) {
    LogRow r;
    while (side[k].log && side[k].log->pop(r)) write_row(log, k, r);
  }
  static ArmForce step(void* user, size_t arm, const ArmSample& sample) {
    Work& w = *static_cast<Work*>(user);
    Side& s = w.side[arm];
    const uint64_t now = w.clock();
    const bool fresh = s.patch.update();
    s.servo.strength_wanted = s.strength.load(std::memory_order_relaxed);
    const ServoOut out = servo_step(s.servo, s.options, sample, fresh ? &s.patch.seen() : nullptr, now, &w.pool, arm);
    s.hand.draft() = {out.hand, sample.time_ns > 0 ? sample.time_ns : now, s.servo.clutch, s.servo.clutched};
    s.hand.publish();
    s.faults.fetch_or(s.servo.limiter.faults, std::memory_order_relaxed);
    if (s.times.steps % kRecently == 0) s.lately = 0;
    s.lately |= s.servo.limiter.faults;
    s.recent.store(s.lately, std::memory_order_relaxed);
    const float size = length(out.force);
    s.force.store(size, std::memory_order_relaxed);
    s.peak.store(std::max(size, s.peak.load(std::memory_order_relaxed)), std::memory_order_relaxed);
    s.engaged.store(s.servo.limiter.engaged, std::memory_order_relaxed);
    if (s.log) {
      const ForcePatch& p = s.servo.model.now;
      s.log->push({now, sample.pose, sample.jaw, p.tick, p.time_ns < now ? 1e-9f * static_cast<float>(now - p.time_ns) : 0,
                   p.stiffness.xx + p.stiffness.yy + p.stiffness.zz, p.force, out.wanted, out.allowed, out,
                   s.servo.limiter.faults, static_cast<uint32_t>(s.servo.limiter.engaged), s.servo.strength});
    }
    s.servo.limiter.faults = 0;
    if (s.last_ns > 0) count(s.times.period, now - s.last_ns);
    s.last_ns = now;
    count(s.times.work, w.clock() - now);
    ++s.times.steps;
    return out;
  }
};

void prepare_for_arms(SceneSpec& scene) {
  scene.solver.hand_stiffness = std::min(scene.solver.hand_stiffness, kHapticStiffness);
  if (scene.solver.substeps % kHapticParts != 0) return;
  scene.solver.tick_rate *= kHapticParts;
  scene.solver.substeps /= kHapticParts;
}

double quantile_us(const std::array<uint64_t, 512>& counts, double part) {
  uint64_t all = 0, below = 0;
  for (const uint64_t c : counts) all += c;
  for (size_t k = 0; k < counts.size(); ++k) {
    below += counts[k];
    if (static_cast<double>(below) >= part * static_cast<double>(all)) return 10.0 * static_cast<double>(k + 1);
  }
  return 0;
}

std::string arm_key(const ArmInfo& arm, size_t k) {
  return !arm.serial.empty() ? arm.serial : k == 0 ? "first device" : "second device";
}

std::array<size_t, 2> sides_of(const std::array<ArmInfo, 2>& arm, const std::map<std::string, ArmPlace>& places) {
  std::array<int, 2> hand{-1, -1};
  for (size_t k = 0; k < 2; ++k)
    if (const auto found = places.find(arm_key(arm[k], k)); arm[k].present && found != places.end())
      hand[k] = found->second.hand;
  // Two devices in one hand: the file is of other pairs.
  if (hand[0] >= 0 && hand[0] == hand[1]) return {0, 1};
  const bool swapped = hand[0] == 1 || hand[1] == 0;
  return {swapped ? size_t{1} : size_t{0}, swapped ? size_t{0} : size_t{1}};
}

Workspace workspace_of(const ArmInfo& arm, size_t k, size_t side, Vec3 focus, const std::map<std::string, ArmPlace>& places) {
  ArmPlace place;
  place.middle = 0.5f * (arm.least + arm.most);
  if (const auto found = places.find(arm_key(arm, k)); found != places.end()) place = found->second;
  Workspace w;
  w.scale = place.scale;
  w.turn = place.residual >= 0 ? place.rotation : axis_angle({0, 1, 0}, place.turn * kPi / 180);
  // The hands side by side, slightly above the field.
  w.offset = focus + Vec3{side == 0 ? 0.015f : -0.015f, 0.02f, 0.01f} - rotate(w.turn, place.middle) * w.scale;
  return w;
}

Haptics::Haptics(ArmPort port, const PictureModel& picture, const HapticsOptions& options) : work_(std::make_unique<Work>()) {
  work_->port = std::move(port);
  if (!options.log.empty()) {
    work_->log = std::fopen(options.log.c_str(), "w");
    if (!work_->log)
      throw InputError("--haptics-log " + options.log, "it cannot be written", "name a file in a folder that exists");
    std::fprintf(work_->log, "%s\n", kHapticsLogHead);
    for (Side& s : work_->side) s.log = std::make_unique<Ring<LogRow, 4096>>();
  }
  if (options.clock) work_->clock = options.clock;
  work_->side_of = sides_of(work_->port.arm, options.place);
  for (size_t k = 0; k < 2; ++k) {
    ServoOptions& o = work_->side[k].options;
    const ArmInfo& arm = work_->port.arm[k];
    fit_to_arm(o, arm.limits);
    o.ratchet = options.ratchet;
    o.force = options.force;
    o.place = workspace_of(arm, k, work_->side_of[k], picture.focus, options.place);
    set_strength(work_->side_of[k], options.strength[work_->side_of[k]]);
    work_->side[k].servo.strength = work_->side[k].strength;
    work_->side[k].hand.draft().input.connected = 0;
    work_->side[k].hand.publish();
  }
  std::string why;
  if (work_->port.any() && !work_->port.start(work_->port.self, {Work::step, work_.get()}, why))
    throw InputError(work_->port.kind, why, "close other programs that use the devices, or continue with --haptics off");
}

Haptics::~Haptics() {
  stop();
  if (!work_->log) return;
  for (size_t k = 0; k < 2; ++k) work_->write_log(k);
  std::fclose(work_->log);
}

void Haptics::set_strength(size_t side, float strength) {
  const float gain = strength >= kLeastStrength ? std::min(strength, kMostStrength) : kLeastStrength;
  for (size_t k = 0; k < 2; ++k)
    if (work_->side_of[k] == side) work_->side[k].strength.store(gain, std::memory_order_relaxed);
}
size_t Haptics::side(size_t k) const { return work_->side_of[k]; }
bool Haptics::present(size_t k) const { return work_->port.arm[k].present; }
const ServoOptions& Haptics::servo(size_t k) const { return work_->side[k].options; }

void Haptics::publish(size_t k, const ForcePatch& patch, uint32_t epoch, float speed) {
  Side& s = work_->side[k];
  if (work_->log) work_->write_log(k);
  ForcePatch p = patch;
  // A patch is as old as the pose that it was computed for, not as the end of a slow tick.
  p.time_ns = s.taken_ns > 0 ? s.taken_ns : work_->clock();
  p.epoch = epoch;
  p.period = patch.period / speed;
  p.expiry = std::max(patch.expiry, 2 * p.period);
  work_->send(k, p);
}

void Haptics::rest(size_t k, uint32_t epoch) {
  if (work_->log) work_->write_log(k);
  hand(k);  // the current pose: nothing else reads it while another source moves the tool
  ForcePatch p;
  p.cap = 0;
  p.time_ns = work_->side[k].taken_ns;
  p.epoch = epoch;
  work_->send(k, p);
}

ToolInput Haptics::hand(size_t k) {
  Side& s = work_->side[k];
  s.hand.update();
  ToolInput hand = s.hand.seen().input;
  const uint64_t now = work_->clock();
  s.taken_ns = s.hand.seen().sampled_ns;
  if (!present(k) || hand.time_ns + kLost < now) hand.connected = 0;
  return hand;
}

std::vector<std::string> Haptics::news() {
  std::vector<std::string> lines;
  for (size_t k = 0; k < 2; ++k) {
    if (!present(k)) continue;
    Side& s = work_->side[k];
    const std::string who = std::string(work_->side_of[k] == 0 ? "right device: " : "left device: ");
    const ArmStatus status = work_->port.status(work_->port.self, k);
    for (const std::string& line : new_faults(s.faults.exchange(0, std::memory_order_relaxed) | status.faults, s.messages))
      lines.push_back(who + line);
    if (status.steps > 0 && status.ready != s.was_ready) {
      lines.push_back(who + (status.ready ? "reconnected"
                                          : "lost: " + work_->port.error_text(work_->port.self, status.error) +
                                                "; its tool is frozen, the other hand continues"));
      s.was_ready = status.ready;
    } else if (status.ready && status.errors > 0 && s.told_errors == 0) {
      s.told_errors = status.errors;
      lines.push_back(who + work_->port.error_text(work_->port.self, status.error));
    }
  }
  return lines;
}

ArmView Haptics::view(size_t k, const char* off) const {
  const Side& s = work_->side[k];
  ArmView v;
  v.side = work_->side_of[k];
  if (!present(k)) return v;
  const ArmStatus status = work_->port.status(work_->port.self, k);
  const bool remote = work_->port.send_patch != nullptr;
  const Engaged engaged = s.engaged;
  const uint32_t faults = remote ? status.faults : s.recent.load(std::memory_order_relaxed);
  v.here = status.ready;
  v.most = s.options.limiter.force;
  v.strength = s.strength.load(std::memory_order_relaxed);
  v.force = remote ? status.force : s.force.load(std::memory_order_relaxed);
  v.peak = std::max(v.force, s.peak.load(std::memory_order_relaxed));
  v.felt = remote ? v.here : engaged == Engaged::yes || engaged == Engaged::rising;
  if (!v.here) v.off = "lost";
  else if (*off) v.off = off;
  else if (!v.felt && faults) v.off = word_of(1u << (31 - static_cast<uint32_t>(std::countl_zero(faults))));
  else if (!v.felt) v.off = "waits until nothing is touched";
  return v;
}

ServoTimes Haptics::times(size_t k) const { return work_->side[k].times; }

void Haptics::stop() {
  if (work_->port.self) work_->port.stop(work_->port.self);
}

std::vector<std::string> new_faults(uint32_t faults, uint32_t& messages) {
  std::vector<std::string> lines;
  const uint32_t fresh = faults & ~messages;
  messages |= fresh;
  for (uint32_t bit = 1; bit != 0 && bit <= fresh; bit <<= 1)
    if (fresh & bit) lines.push_back(word_of(bit));
  return lines;
}

// Whether "HOST:PORT" has an invalid port. IPv6 addresses contain colons: "[::1]:PORT".
static bool bad_port(const std::string& where) {
  const size_t colon = where.rfind(':'), bracket = where.rfind(']');
  if (colon == std::string::npos) return false;
  if (bracket == std::string::npos ? where.find(':') != colon : colon < bracket) return false;
  const std::string port = where.substr(colon + 1);
  return port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos ||
         std::stoul(port) > 65535;
}

ArmChoice read_arm_choice(const std::string& text) {
  ArmChoice c;
  if (text.empty() || text == "off") return c;
  std::string rest = text;
  const auto next = [&rest] {
    const size_t colon = rest.find(':');
    const std::string word = rest.substr(0, colon);
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
    return word;
  };
  c.driver = next();
  if (c.driver == "paper") {
    c.as_paper = true;
    c.driver = rest.empty() ? "touch" : next();
  }
  c.where = rest;
  std::string all;
  for (const ArmDriver& d : arm_drivers()) {
    if (c.driver == d.word) {
      if (std::string_view(d.where).substr(0, 4) == "HOST" && bad_port(c.where))
        throw InputError("--haptics " + text, "\"" + c.where + "\" is not a valid " + d.where,
                         "give a port from 0 to 65535, or none");
      return c;
    }
    all += std::string(d.word) + ", ";
  }
  throw InputError("--haptics " + text, "unknown device", "use " + all + "paper or off");
}

ArmPort open_arms(const ArmChoice& choice, std::vector<std::string>& messages) {
  for (const ArmDriver& d : arm_drivers())
    if (choice.driver == d.word) return d.open(choice.where, messages);
  return {};
}

}  // namespace catgut
