// SPDX-License-Identifier: Apache-2.0
// runtime/arm_server: see the header. Comments below state which thread may use which members.
#include "runtime/arm_server.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <thread>

#include "core/check.h"
#include "exchange/latest.h"
#include "haptic/servo.h"
#include "runtime/haptics.h"
#include "runtime/live.h"

namespace catgut {
namespace {

constexpr float kExpiry = 0.03f;         // [s] of silence after which a patch expires, whatever its own expiry
constexpr uint64_t kOldest = 150000000;  // [ns] maximum age of the sample that a patch was computed for
constexpr uint64_t kFaultsFor = 256;     // [steps] for which a fault is sent to the simulator: packets get lost

struct Peer {
  sockaddr_storage address{};
  socklen_t bytes = 0;   // 0: none
  uint64_t session = 0;  // counts them
  BridgeKey caller{}, in{}, out{};
};
struct ForceCommand {
  ForcePatch patch;
  uint64_t session = 0;
};

struct Side {
  Latest<ForceCommand> force_command;  // receiver -> device thread
  Latest<Peer> peer;                   // receiver -> device thread
  // Owned by the device thread.
  ServoOptions options;  // constant during a run
  ServoHand servo;
  uint64_t session = 0;
  uint32_t recent = 0;  // faults
  // Readable from any thread.
  std::atomic<uint32_t> faults{0};
  // Owned by the thread that polls for news.
  uint32_t messages = 0;
  bool was_ready = true;
};

bool same(const sockaddr_storage& a, const sockaddr_storage& b, socklen_t bytes) { return std::memcmp(&a, &b, bytes) == 0; }

std::string name_of(const Peer& p) {
  char host[NI_MAXHOST] = "", port[NI_MAXSERV] = "";
  getnameinfo(reinterpret_cast<const sockaddr*>(&p.address), p.bytes, host, sizeof host, port, sizeof port,
              NI_NUMERICHOST | NI_NUMERICSERV);
  return std::string(host) + " port " + port;
}

uint64_t ns_of(float seconds) { return static_cast<uint64_t>(1e9 * double{seconds}); }

}  // namespace

bool accept_patch(ForcePatch& p, uint64_t now_ns) {
  if (p.time_ns > now_ns || now_ns - p.time_ns > kOldest) return false;
  p.period += 1e-9f * static_cast<float>(now_ns - p.time_ns);
  p.expiry = std::min(p.expiry, kExpiry);
  p.time_ns = now_ns;
  return true;
}

struct ArmServer::Work {
  ArmPort port;
  ArmServerOptions options;
  int fd = -1;
  uint16_t listens = 0;
  std::array<Side, 2> side;
  std::atomic<uint64_t> counter{0};  // of all sealed packets, of any session
  EnergyPool pool;                   // of the servos
  std::thread receiver;
  std::atomic<bool> quit{false};
  std::atomic<uint64_t> accepted{0}, garbage{0}, version{0}, forged{0}, invalid{0}, unknown_peer{0}, old{0};
  std::atomic<uint64_t> heard_ns{0}, bytes_out{0};
  // Owned by the receiver.
  BridgeDoor door;
  Peer peer;
  uint64_t sessions = 0;
  std::array<std::array<uint64_t, 2>, kBridgeKinds> last{};  // counters of this session
  std::array<BridgeKey, 64> used{};  // keys of callers that had a session: replayed handshakes are refused
  size_t openings = 0;
  BridgeBytes opened{};  // the answer that started this session
  // Between the receiver, which rarely changes clients, and the thread that polls for news; never the device thread.
  std::mutex lock;
  std::vector<std::string> news;
  bool was_silent = true;
  uint64_t told_dropped = 0;

  void say(std::string line) {
    const std::lock_guard<std::mutex> hold(lock);
    if (news.size() < 100) news.push_back(std::move(line));  // bounded memory under a flood
  }
  void post(const Peer& to, const BridgeBytes& packet) {
    const ssize_t n = sendto(fd, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&to.address), to.bytes);
    if (n > 0) bytes_out.fetch_add(static_cast<uint64_t>(n), std::memory_order_relaxed);
  }
  void send_sealed(const Peer& to, BridgeKind kind, size_t arm, const BridgePayload& payload) {
    BridgeBytes packet;
    const uint64_t n = counter.fetch_add(1, std::memory_order_relaxed) + 1;
    seal(to.out, {kind, static_cast<uint8_t>(arm), kBridgeVersion, n}, payload, packet);
    post(to, packet);
  }
  void assign_client(const Peer& to) {
    peer = to;
    peer.session = ++sessions;
    last = {};
    for (Side& s : side) {
      s.peer.draft() = peer;
      s.peer.publish();
    }
  }

  static ArmForce step(void* user, size_t arm, const ArmSample& sample);
  std::atomic<uint64_t>* handle_packet(const uint8_t* data, size_t size, const Peer& from);
  std::atomic<uint64_t>* shake_hands(const uint8_t* data, const BridgeHead& head, const Peer& from);
  void receive();
  void stop();
};

// One device, one millisecond, in the device thread.
ArmForce ArmServer::Work::step(void* user, size_t arm, const ArmSample& sample) {
  Work& w = *static_cast<Work*>(user);
  Side& s = w.side[arm];
  const uint64_t now = w.options.clock();
  s.peer.update();
  const bool fresh = s.force_command.update();
  const Peer& peer = s.peer.seen();
  const ForceCommand& force_command = s.force_command.seen();
  if (peer.session != s.session) {  // the state of the previous session is void
    s.session = peer.session;
    s.servo.has_patch = false;
    disengage(s.servo.limiter);
  }
  const bool ordered = fresh && peer.bytes > 0 && force_command.session == peer.session;
  const ArmForce force = servo_step(s.servo, s.options, sample, ordered ? &force_command.patch : nullptr, now, &w.pool, arm);
  s.faults.fetch_or(s.servo.limiter.faults, std::memory_order_relaxed);
  if (s.servo.steps % kFaultsFor == 0) s.recent = 0;
  s.recent |= s.servo.limiter.faults;
  s.servo.limiter.faults = 0;

  if (peer.bytes > 0 && now < w.heard_ns.load(std::memory_order_relaxed) + ns_of(w.options.stream)) {
    ArmSample out = sample;
    out.time_ns = now;
    BridgePayload payload;
    write_sample(out, force, s.recent, payload);
    w.send_sealed(peer, BridgeKind::sample, arm, payload);
  }
  return force;
}

// Hello and open: stateless until the sender has proved that it has the key and receives at its address.
std::atomic<uint64_t>* ArmServer::Work::shake_hands(const uint8_t* data, const BridgeHead& h, const Peer& from) {
  if (h.kind != BridgeKind::hello && h.kind != BridgeKind::open) return &invalid;
  if (!mac_is_right(door.shared, data)) return &forged;
  const uint64_t now = options.clock();
  const bool known = peer.bytes == from.bytes && same(peer.address, from.address, from.bytes);
  const bool gone = peer.bytes == 0 || now > heard_ns + ns_of(options.forget);
  if (h.kind == BridgeKind::hello) {
    if (!known && !gone) {
      post(from, refused_packet(door.shared, kArmsTaken));
      return &unknown_peer;
    }
    post(from, cookie_packet(door, data, &from.address, from.bytes, now));
    return &accepted;
  }
  const BridgeKey caller = caller_key(data);
  if (!cookie_is_right(door, data, &from.address, from.bytes, now)) return &forged;
  if (known && caller == peer.caller) {  // the answer was lost
    post(from, opened);
    return &accepted;
  }
  if (std::find(used.begin(), used.end(), caller) != used.end()) return &old;
  if (!known && !gone) {
    post(from, refused_packet(door.shared, kArmsTaken));
    return &unknown_peer;
  }
  used[openings++ % used.size()] = caller;
  Peer next = from;
  next.caller = caller;
  opened = opened_packet(door, data, next.in, next.out);
  assign_client(next);
  post(from, opened);
  heard_ns = 0;  // samples start with the first packet that is sealed with this session's key
  if (!known) say("connected to the simulator at " + name_of(from));
  return &accepted;
}

// Returns the counter that the packet belongs to.
std::atomic<uint64_t>* ArmServer::Work::handle_packet(const uint8_t* data, size_t size, const Peer& from) {
  BridgeHead h;
  const BridgeFault fault = read_head(data, size, h);
  if (fault == BridgeFault::garbage) return &garbage;
  if (fault == BridgeFault::version) {
    post(from, refused_packet(door.shared, kOtherVersion));  // its head states the supported version
    return &version;
  }
  if (fault == BridgeFault::invalid) return &invalid;
  if (is_handshake(h.kind)) return shake_hands(data, h, from);
  if (peer.bytes != from.bytes || !same(peer.address, from.address, from.bytes)) return &unknown_peer;
  BridgePayload payload;
  if (!unseal(peer.in, data, payload)) return &forged;
  uint64_t& newest = last[static_cast<size_t>(h.kind)][h.arm];
  if (h.counter <= newest) return &old;
  newest = h.counter;
  const uint64_t now = options.clock();
  if (h.kind == BridgeKind::bye) {
    say("released by the simulator at " + name_of(peer));
    assign_client({});
  } else if (h.kind == BridgeKind::ask) {
    heard_ns = now;  // before the answer: a caller that has it may rely on samples
    for (size_t k = 0; k < 2; ++k) {
      write_info(port.arm[k], payload);
      send_sealed(peer, BridgeKind::info, k, payload);
    }
  } else if (h.kind == BridgeKind::patch) {
    ForceCommand& force_command = side[h.arm].force_command.draft();
    if (!read_patch(payload, force_command.patch)) return &invalid;
    heard_ns = now;
    if (!accept_patch(force_command.patch, now)) return &old;
    force_command.session = peer.session;
    side[h.arm].force_command.publish();
  } else {
    return &invalid;
  }
  return &accepted;
}

void ArmServer::Work::receive() {
  uint8_t data[kBridgeBytes + 1];  // one byte more, to detect oversized packets
  while (!quit) {
    pollfd wait{fd, POLLIN, 0};
    if (poll(&wait, 1, 20) <= 0) continue;
    for (int k = 0; k < 64; ++k) {
      Peer from;
      from.bytes = sizeof from.address;
      const ssize_t n = recvfrom(fd, data, sizeof data, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from.address), &from.bytes);
      if (n < 0) break;
      handle_packet(data, static_cast<size_t>(n), from)->fetch_add(1, std::memory_order_relaxed);
    }
  }
}

void ArmServer::Work::stop() {
  if (fd < 0) return;
  if (port.self) port.stop(port.self);
  quit = true;
  if (receiver.joinable()) receiver.join();
  if (peer.bytes > 0) send_sealed(peer, BridgeKind::bye, 0, {});
  ::close(fd);
  fd = -1;
}

namespace {

int listening_socket(const std::string& listen, const std::string& key) {
  std::string why;
  bool local = false;
  const int fd = bridge_socket(listen, true, why, &local);
  if (fd < 0) throw InputError("--listen " + listen, why, "use a local address and a free port");
  if (local || !key.empty()) return fd;
  ::close(fd);
  throw InputError("--listen " + listen, "anyone who reaches this address could apply forces",
                   "create a key with --new-key FILE, copy it to the simulator's machine, and listen with --key FILE");
}

}  // namespace

void check_listen(const std::string& listen, const std::string& key) {
  if (!key.empty()) read_bridge_key(key);
  ::close(listening_socket(listen, key));
}

ArmServer::ArmServer(ArmPort port, const ArmServerOptions& options) : work_(std::make_unique<Work>()) {
  Work& w = *work_;
  w.port = std::move(port);
  w.options = options;
  if (!w.options.clock) w.options.clock = wall_ns;
  if (!options.key.empty()) w.door.shared = read_bridge_key(options.key);
  for (size_t k = 0; k < 2; ++k) {
    fit_to_arm(w.side[k].options, w.port.arm[k].limits);
    w.side[k].options.clutch = false;  // the simulator's side does that
    w.side[k].options.gain = 1;        // patches arrive in the device's own frame, with the gain applied
  }
  w.fd = listening_socket(options.listen, options.key);
  sockaddr_storage own{};
  socklen_t bytes = sizeof own;
  getsockname(w.fd, reinterpret_cast<sockaddr*>(&own), &bytes);
  w.listens = ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(&own)->sin6_port
                                              : reinterpret_cast<sockaddr_in*>(&own)->sin_port);
  std::string why;
  if (!w.port.start(w.port.self, {Work::step, &w}, why)) {
    ::close(w.fd);
    w.fd = -1;
    throw InputError(w.port.kind, why, "close other programs that use the devices");
  }
  w.receiver = std::thread([&w] { w.receive(); });
}

ArmServer::~ArmServer() { stop(); }
void ArmServer::stop() { work_->stop(); }
uint16_t ArmServer::port() const { return work_->listens; }
uint64_t ArmServer::sent_bytes() const { return work_->bytes_out; }

BridgeCounts ArmServer::counts() const {
  const Work& w = *work_;
  return {w.accepted, w.garbage, w.version, w.forged, w.invalid, w.unknown_peer, w.old};
}

std::vector<std::string> ArmServer::news() {
  Work& w = *work_;
  std::vector<std::string> lines;
  {
    const std::lock_guard<std::mutex> hold(w.lock);
    lines.swap(w.news);
  }
  const uint64_t heard = w.heard_ns, now = w.options.clock();
  const bool silent = heard == 0 || now > heard + 100000000;
  if (silent != w.was_silent) lines.push_back(silent ? "simulator silent; force off" : "simulator connected");
  w.was_silent = silent;
  for (size_t k = 0; k < 2; ++k) {
    if (!w.port.arm[k].present) continue;
    Side& s = w.side[k];
    const std::string who = k == 0 ? "right device: " : "left device: ";
    for (const std::string& line : new_faults(s.faults.exchange(0, std::memory_order_relaxed), s.messages))
      lines.push_back(who + line);
    const ArmStatus status = w.port.status(w.port.self, k);
    if (status.steps > 0 && status.ready != s.was_ready) {
      lines.push_back(who + (status.ready ? "reconnected" : "lost: " + w.port.error_text(w.port.self, status.error)));
      s.was_ready = status.ready;
    }
  }
  const uint64_t dropped = counts().dropped();
  if (dropped > 2 * w.told_dropped + 9) {  // each time it has doubled: a flood is reported, not repeated
    lines.push_back(std::to_string(dropped) + " invalid packets discarded");
    w.told_dropped = dropped;
  }
  return lines;
}

}  // namespace catgut
