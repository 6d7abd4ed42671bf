// runtime/arm_server: see the header. Below, comments say which thread may touch what.
#include "runtime/arm_server.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
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

constexpr float kExpiry = 0.02f;  // [s] a force is never believed for longer, whatever the command says

struct Peer {
  sockaddr_storage address{};
  socklen_t bytes = 0;  // 0: nobody
  uint64_t session = 0;
};
struct Order {
  BridgeCommand command;
  uint64_t session = 0;
};

struct Side {
  Latest<Order> order;  // receiver -> driver
  Latest<Peer> peer;    // receiver -> driver
  // The driver's.
  ServoOptions options;  // constant once it runs
  Limiter limiter;
  Passivity net;
  uint64_t last_ns = 0, session = 0;
  bool ordered = false;
  // The receiver's.
  uint64_t sequence = 0;
  // For any thread.
  std::atomic<uint32_t> faults{0};
  // Of whoever asks for news.
  uint32_t told = 0;
  bool was_ready = true;
};

bool same(const sockaddr_storage& a, const sockaddr_storage& b, socklen_t bytes) { return std::memcmp(&a, &b, bytes) == 0; }

std::string name_of(const Peer& p) {
  char host[NI_MAXHOST] = "", port[NI_MAXSERV] = "";
  getnameinfo(reinterpret_cast<const sockaddr*>(&p.address), p.bytes, host, sizeof host, port, sizeof port,
              NI_NUMERICHOST | NI_NUMERICSERV);
  return std::string(host) + " port " + port;
}

}  // namespace

struct ArmServer::Work {
  ArmPort port;
  ArmServerOptions options;
  int fd = -1;
  uint16_t listens = 0;
  std::array<Side, 2> side;
  std::atomic<uint64_t> sequence{0};  // of all that is sent
  std::thread receiver;
  std::atomic<bool> quit{false};
  std::atomic<uint64_t> accepted{0}, garbage{0}, version{0}, nonsense{0}, stranger{0}, old{0}, heard_ns{0};
  // The receiver's.
  Peer peer;
  // Between the receiver, which rarely changes hands, and whoever asks for news; never the driver's.
  std::mutex lock;
  std::vector<std::string> news;
  bool was_silent = true;
  uint64_t told_dropped = 0;

  void say(std::string line) {
    const std::lock_guard<std::mutex> hold(lock);
    if (news.size() < 100) news.push_back(std::move(line));  // whoever floods us does not fill the memory
  }
  BridgeHead head(BridgeKind kind, size_t arm, uint64_t session) {
    return {kind,
            static_cast<uint8_t>(arm),
            kBridgeVersion,
            session,
            sequence.fetch_add(1, std::memory_order_relaxed) + 1,
            options.clock()};
  }
  void post(const Peer& to, const BridgeBytes& packet) const {
    [[maybe_unused]] const ssize_t n = sendto(fd, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                              reinterpret_cast<const sockaddr*>(&to.address), to.bytes);
  }
  void answer(const Peer& to, uint64_t session) {
    BridgeBytes packet;
    for (size_t k = 0; k < 2; ++k) {
      write_info(packet, head(BridgeKind::info, k, session), port.arm[k]);
      post(to, packet);
    }
  }
  void refuse(const Peer& to, uint64_t session, BridgeRefusal why) {
    BridgeBytes packet;
    write_plain(packet, head(BridgeKind::refused, 0, session), why);
    post(to, packet);
  }
  void lend(const Peer& to) {
    peer = to;
    for (Side& s : side) {
      s.sequence = 0;
      s.peer.draft() = to;
      s.peer.publish();
    }
  }

  static Vec3 step(void* user, size_t arm, const ArmSample& sample);
  void take(const uint8_t* data, size_t size, const Peer& from);
  void receive();
  void stop();
};

// One arm, one millisecond, in the driver's thread.
Vec3 ArmServer::Work::step(void* user, size_t arm, const ArmSample& sample) {
  Work& w = *static_cast<Work*>(user);
  Side& s = w.side[arm];
  const uint64_t now = w.options.clock();
  const float dt = s.last_ns > 0 && now >= s.last_ns ? 1e-9f * static_cast<float>(now - s.last_ns) : 0.001f;
  s.last_ns = now;
  s.peer.update();
  s.order.update();
  const Peer& peer = s.peer.seen();
  const Order& order = s.order.seen();
  if (peer.session != s.session) disengage(s.limiter), s.session = peer.session;

  const bool ready = sample.state == ArmState::ready && is_finite(sample.pose.p) && is_finite(sample.velocity);
  const bool ordered = peer.bytes > 0 && order.session == peer.session && order.command.answers_ns <= now;
  LimiterInput in;
  in.wanted = ordered ? order.command.force : Vec3{};
  in.age = ordered ? 1e-9f * static_cast<float>(now - order.command.answers_ns) : -1.0f;
  in.expiry = std::clamp(order.command.expiry, 0.001f, kExpiry);
  in.cap = s.options.limits.force;
  in.speed = ready ? length(sample.velocity) : 0;
  in.warmth = sample.warmth;
  in.ready = ready && !sample.forced_off;
  const Vec3 allowed = limit(s.limiter, in, dt, s.options.limiter);
  PassivityOptions net = s.options.passivity;
  // Off is off, and the simulator that has taken its force off is not braked for: it may have lost its physics.
  if (length2(allowed) == 0) net.damping = 0;
  Vec3 force = allowed;
  if (ready) force = keep_passive(s.net, sample.pose.p, sample.velocity, allowed, s.options.limiter.force, dt, net);
  else s.net = {};
  if (s.net.braking) s.limiter.faults |= kGenerated;
  s.faults.fetch_or(s.limiter.faults, std::memory_order_relaxed);
  s.limiter.faults = 0;

  if (peer.bytes > 0) {
    BridgeBytes packet;
    BridgeHead head = w.head(BridgeKind::sample, arm, peer.session);
    head.time_ns = now;
    write_sample(packet, head, sample, force);
    w.post(peer, packet);
  }
  return force;
}

void ArmServer::Work::take(const uint8_t* data, size_t size, const Peer& from) {
  BridgeHead h;
  const BridgeFault fault = read_bridge(data, size, h);
  const auto drop = [](std::atomic<uint64_t>& count) { count.fetch_add(1, std::memory_order_relaxed); };
  if (fault == BridgeFault::garbage) return drop(garbage);
  if (fault == BridgeFault::nonsense) return drop(nonsense);
  if (fault == BridgeFault::version) {
    drop(version);
    if (h.kind == BridgeKind::hello) refuse(from, h.session, kOtherVersion);  // the header says which one is spoken here
    return;
  }
  const bool known = peer.bytes == from.bytes && same(peer.address, from.address, from.bytes);
  const uint64_t now = options.clock();
  if (h.kind == BridgeKind::hello) {
    const bool gone = peer.bytes == 0 || now > heard_ns + static_cast<uint64_t>(1e9 * double{options.forget});
    if (!known && !gone) {
      drop(stranger);
      return refuse(from, h.session, kArmsTaken);
    }
    if (!known || peer.session != h.session) {
      Peer next = from;
      next.session = h.session;
      lend(next);
    }
    if (!known) say("lent to the simulator at " + name_of(from));
    heard_ns = now;
    answer(from, h.session);
  } else if (!known || h.session != peer.session) {
    return drop(stranger);
  } else if (h.kind == BridgeKind::bye) {
    lend({});
    say("given back by the simulator at " + name_of(from));
  } else if (h.kind == BridgeKind::command) {
    Side& s = side[h.arm];
    if (h.sequence <= s.sequence) return drop(old);
    s.sequence = h.sequence;
    s.order.draft() = {read_command(data), h.session};
    s.order.publish();
    heard_ns = now;
  } else {
    return drop(nonsense);
  }
  accepted.fetch_add(1, std::memory_order_relaxed);
}

void ArmServer::Work::receive() {
  uint8_t data[kBridgeBytes + 1];  // one more: what is too long is seen to be
  while (!quit) {
    pollfd wait{fd, POLLIN, 0};
    if (poll(&wait, 1, 20) <= 0) continue;
    for (int k = 0; k < 64; ++k) {
      Peer from;
      from.bytes = sizeof from.address;
      const ssize_t n = recvfrom(fd, data, sizeof data, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from.address), &from.bytes);
      if (n < 0) break;
      take(data, static_cast<size_t>(n), from);
    }
  }
}

void ArmServer::Work::stop() {
  if (fd < 0) return;
  if (port.self) port.stop(port.self);
  quit = true;
  if (receiver.joinable()) receiver.join();
  if (peer.bytes > 0) {
    BridgeBytes packet;
    write_plain(packet, head(BridgeKind::bye, 0, peer.session));
    post(peer, packet);
  }
  ::close(fd);
  fd = -1;
}

ArmServer::ArmServer(ArmPort port, const ArmServerOptions& options) : work_(std::make_unique<Work>()) {
  Work& w = *work_;
  w.port = std::move(port);
  w.options = options;
  if (!w.options.clock) w.options.clock = wall_ns;
  for (size_t k = 0; k < 2; ++k) {
    ServoOptions& o = w.side[k].options;
    fit_to_arm(o, w.port.arm[k].limits);
    o.limiter.knee = o.limiter.force;  // the simulator has mapped large forces already; twice would make them too small
    o.limiter.above = 0;
  }
  std::string why;
  w.fd = bridge_socket(options.listen, true, why);
  if (w.fd < 0) throw InputError("--listen " + options.listen, why, "name an address of this machine and a port that is free");
  sockaddr_storage own{};
  socklen_t bytes = sizeof own;
  getsockname(w.fd, reinterpret_cast<sockaddr*>(&own), &bytes);
  w.listens = ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(&own)->sin6_port
                                              : reinterpret_cast<sockaddr_in*>(&own)->sin_port);
  if (!w.port.start(w.port.self, {Work::step, &w}, why)) {
    ::close(w.fd);
    w.fd = -1;
    throw InputError(w.port.kind, why, "close other programs that use the arms");
  }
  w.receiver = std::thread([&w] { w.receive(); });
}

ArmServer::~ArmServer() { stop(); }
void ArmServer::stop() { work_->stop(); }
uint16_t ArmServer::port() const { return work_->listens; }

BridgeCounts ArmServer::counts() const {
  const Work& w = *work_;
  return {w.accepted, w.garbage, w.version, w.nonsense, w.stranger, w.old};
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
  if (silent != w.was_silent) lines.push_back(silent ? "the simulator is silent; force is off" : "the simulator answers");
  w.was_silent = silent;
  for (size_t k = 0; k < 2; ++k) {
    if (!w.port.arm[k].present) continue;
    Side& s = w.side[k];
    const std::string who = k == 0 ? "right arm: " : "left arm: ";
    for (const std::string& line : new_faults(s.faults.exchange(0, std::memory_order_relaxed), s.told))
      lines.push_back(who + line);
    const ArmStatus status = w.port.status(w.port.self, k);
    if (status.steps > 0 && status.ready != s.was_ready) {
      lines.push_back(who + (status.ready ? "it is back" : "lost: " + w.port.error_text(w.port.self, status.error)));
      s.was_ready = status.ready;
    }
  }
  const uint64_t dropped = counts().dropped();
  if (dropped > 2 * w.told_dropped + 9) {  // each time it has doubled: a flood is told, not repeated
    lines.push_back(std::to_string(dropped) + " packets were no good and dropped");
    w.told_dropped = dropped;
  }
  return lines;
}

}  // namespace catgut
