// SPDX-License-Identifier: Apache-2.0
// device/bridge: see the header.
#include "device/bridge.h"

#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "core/check.h"
#include "device/periodic_timer.h"
#include "exchange/latest.h"

namespace catgut {

int bridge_socket(const std::string& where, bool bind_it, std::string& why, bool* local) {
  std::string host = where, port = std::to_string(kBridgePort);
  const size_t colon = where.rfind(':'), bracket = where.rfind(']');
  const bool bare_v6 = bracket == std::string::npos && where.find(':') != colon;
  if (colon != std::string::npos && !bare_v6 && (bracket == std::string::npos || colon > bracket)) {
    host = where.substr(0, colon), port = where.substr(colon + 1);
  }
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  char* end = nullptr;
  const unsigned long number = std::strtoul(port.c_str(), &end, 10);
  if (host.empty() || port.empty() || *end || number > 65535 || port[0] < '0' || port[0] > '9') {
    why = "\"" + where + "\" is not HOST:PORT";
    return -1;
  }
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = bind_it ? AI_PASSIVE : 0;
  if (const int code = getaddrinfo(host.c_str(), port.c_str(), &hints, &found)) {
    why = host + ": " + gai_strerror(code);
    return -1;
  }
  int fd = -1;
  // Of a name with both kinds of addresses, IPv4: `catgut bridge` listens on it by default.
  std::vector<const addrinfo*> order;
  for (const addrinfo* a = found; a; a = a->ai_next) order.insert(a->ai_family == AF_INET ? order.begin() : order.end(), a);
  for (const addrinfo* a : order) {
    if (fd >= 0) break;
    fd = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (fd < 0) {
      why = std::strerror(errno);
    } else if ((bind_it ? bind(fd, a->ai_addr, a->ai_addrlen) : connect(fd, a->ai_addr, a->ai_addrlen)) != 0) {
      why = std::strerror(errno);
      ::close(fd);
      fd = -1;
    }
  }
  freeaddrinfo(found);
  if (fd >= 0 && local) {  // of the address listened on, or sent to
    sockaddr_storage at{};
    socklen_t bytes = sizeof at;
    if (bind_it) getsockname(fd, reinterpret_cast<sockaddr*>(&at), &bytes);
    else getpeername(fd, reinterpret_cast<sockaddr*>(&at), &bytes);
    if (at.ss_family == AF_INET) *local = ntohl(reinterpret_cast<sockaddr_in*>(&at)->sin_addr.s_addr) >> 24 == 127;
    else *local = at.ss_family == AF_INET6 && IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<sockaddr_in6*>(&at)->sin6_addr);
  }
  return fd;
}

namespace {

constexpr uint64_t kHandshakeTime = 1000000000;  // [ns]
constexpr uint64_t kAskEvery = 50000000;         // [ns] an ask reports that the simulator is alive, whatever its physics does
enum PortError : uint32_t { kSilent = 1, kTheirs = 2, kRefused = 3 };

uint64_t now_ns() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

struct End {
  Latest<ForcePatch> patch;  // physics -> thread
  // Owned by the thread.
  uint64_t heard_ns = 0, stepped_ns = 0;
  uint32_t count = 0;  // of samples passed to the callback
  bool fresh = false;
  ArmSample sample;
  // Readable from any thread.
  std::atomic<bool> ready{false};
  std::atomic<uint32_t> error{0}, errors{0}, faults{0};
  std::atomic<float> force{0};  // [N] last written by the device server
  std::atomic<uint64_t> steps{0};
};

struct Bridge {
  BridgeOptions options;
  int fd = -1;
  std::array<bool, 2> present{};
  std::array<End, 2> end;
  ArmCallback callback;
  std::thread thread;
  std::atomic<bool> stopping{false};
  // Owned by the thread; while opening, by the opener.
  BridgeCaller caller;
  BridgeKey in{}, out{};
  bool opened = false, has_cookie = false;
  std::array<std::array<uint64_t, 2>, kBridgeKinds> last{};  // counters of this session
  uint64_t sent = 0, called_ns = 0, begun_ns = 0, opened_ns = 0, said_ns = 0;
  std::array<ArmInfo, 2> info;
  std::array<bool, 2> known{};
  uint32_t refused = 0;
  uint16_t their_version = 0;
  BridgeCounts count;
  // Readable from any thread: the above, copied once per round.
  std::atomic<uint64_t> accepted{0}, garbage{0}, version{0}, forged{0}, invalid{0}, unknown_peer{0}, old{0};
};

// The server's watchdog handles lost packets: nothing blocks here, only the handshake is repeated.
void post(const Bridge& b, const BridgeBytes& packet) {
  [[maybe_unused]] const ssize_t n = ::send(b.fd, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}
void send_sealed(Bridge& b, BridgeKind kind, size_t arm, const BridgePayload& payload) {
  if (!b.opened) return;
  BridgeBytes packet;
  seal(b.out, {kind, static_cast<uint8_t>(arm), kBridgeVersion, ++b.sent}, payload, packet);
  post(b, packet);
  b.said_ns = now_ns();
}
// The next step of the handshake, or the first of a new one.
void call(Bridge& b, bool anew) {
  if (anew) begin_call(b.caller), b.opened = b.has_cookie = false, b.begun_ns = now_ns();
  post(b, b.has_cookie ? open_packet(b.caller) : hello_packet(b.caller));
  b.called_ns = now_ns();
}

void take_one(Bridge& b, const uint8_t* data, size_t size) {
  BridgeHead h;
  const BridgeFault fault = read_head(data, size, h);
  if (fault == BridgeFault::garbage) {
    ++b.count.garbage;
    return;
  }
  if (fault == BridgeFault::version) {
    ++b.count.version, b.their_version = h.version;
    return;
  }
  if (fault == BridgeFault::invalid) {
    ++b.count.invalid;
    return;
  }
  if (is_handshake(h.kind)) {
    if (!mac_is_right(b.caller.shared, data)) {
      ++b.count.forged;
      return;
    }
    if (h.kind == BridgeKind::refused) {
      b.refused = refused_why(data);
    } else if (h.kind == BridgeKind::cookie && !b.opened && take_cookie(b.caller, data)) {
      if (!b.has_cookie) b.has_cookie = true, call(b, false);
    } else if (h.kind == BridgeKind::opened && !b.opened && b.has_cookie && take_opened(b.caller, data, b.in, b.out)) {
      b.opened = true, b.refused = 0, b.opened_ns = now_ns();
      b.last = {};
      b.sent = 0;
      send_sealed(b, BridgeKind::ask, 0, {});
    } else {
      ++b.count.unknown_peer;
      return;
    }
    ++b.count.accepted;
    return;
  }
  BridgePayload payload;
  if (!b.opened || !unseal(b.in, data, payload)) {
    ++b.count.forged;
    return;
  }
  uint64_t& last = b.last[static_cast<size_t>(h.kind)][h.arm];
  if (h.counter <= last) {
    ++b.count.old;
    return;
  }
  last = h.counter;
  bool fine = false;
  if (h.kind == BridgeKind::bye) {
    for (End& e : b.end) e.heard_ns = 0;
    b.opened = false;
    fine = true;
  } else if (h.kind == BridgeKind::info) {
    fine = read_info(payload, b.info[h.arm]);
    b.known[h.arm] |= fine;
  } else if (h.kind == BridgeKind::sample) {
    End& e = b.end[h.arm];
    ArmSample s;
    ArmForce felt;
    uint32_t faults = 0;
    fine = read_sample(payload, s, felt, faults);
    if (fine) {
      e.sample = s;
      e.heard_ns = now_ns();
      e.fresh = true;
      e.force.store(length(felt.force), std::memory_order_relaxed);
      e.faults.store(faults, std::memory_order_relaxed);
    }
  }
  ++(fine ? b.count.accepted : b.count.invalid);
}

void take(Bridge& b) {
  uint8_t data[kBridgeBytes + 1];  // one byte more, to detect oversized packets
  for (int k = 0; k < 64; ++k) {   // a flood must not delay the hands
    const ssize_t n = recv(b.fd, data, sizeof data, MSG_DONTWAIT);
    if (n < 0 && errno != ECONNREFUSED) return;  // no packet; an error from the system counts as silence
    if (n >= 0) take_one(b, data, static_cast<size_t>(n));
  }
}

void fail(End& e, uint32_t error) {
  if (e.error.exchange(error, std::memory_order_relaxed) != error || e.ready) e.errors.fetch_add(1, std::memory_order_relaxed);
  e.ready.store(false, std::memory_order_relaxed);
}

bool silent(const Bridge& b, const End& e, uint64_t now) {
  return e.heard_ns == 0 || now > e.heard_ns + static_cast<uint64_t>(1e9 * double{b.options.forget});
}

void serve(Bridge& b, size_t k, uint64_t now) {
  End& e = b.end[k];
  // Without samples the servo still runs every millisecond, and receives an absent device.
  if (e.fresh || (silent(b, e, now) && now >= e.stepped_ns + 1000000)) {
    if (!e.fresh) e.sample = {};
    e.sample.sequence = ++e.count;
    b.callback.step(b.callback.user, k, e.sample);  // the device server computes the force
    if (e.fresh && e.sample.state == ArmState::ready) e.ready.store(true, std::memory_order_relaxed);
    else fail(e, e.fresh ? kTheirs : kSilent);
    e.fresh = false;
    e.stepped_ns = now;
    e.steps.fetch_add(1, std::memory_order_relaxed);
  }
  if (!e.patch.update()) return;
  BridgePayload payload;
  write_patch(e.patch.seen(), payload);
  send_sealed(b, BridgeKind::patch, k, payload);
}

void run(Bridge& b) {
  go_first();
  while (!b.stopping) {
    pollfd wait{b.fd, POLLIN, 0};
    poll(&wait, 1, 1);
    take(b);
    const uint64_t now = now_ns();
    bool all_silent = true;
    for (size_t k = 0; k < 2; ++k) {
      if (!b.present[k]) continue;
      serve(b, k, now);
      if (b.refused) fail(b.end[k], kRefused);
      all_silent &= silent(b, b.end[k], now);
    }
    b.accepted = b.count.accepted, b.garbage = b.count.garbage, b.version = b.count.version, b.forged = b.count.forged;
    b.invalid = b.count.invalid, b.unknown_peer = b.count.unknown_peer, b.old = b.count.old;
    if (b.opened && now > b.said_ns + kAskEvery) send_sealed(b, BridgeKind::ask, 0, {});
    if (!all_silent || now < b.called_ns + static_cast<uint64_t>(1e9 * double{b.options.again_after})) continue;
    // A handshake takes two round trips: it is repeated only after that time.
    if (b.opened && now < b.opened_ns + kHandshakeTime) send_sealed(b, BridgeKind::ask, 0, {}), b.called_ns = now;
    else call(b, b.opened || now > b.begun_ns + kHandshakeTime);
  }
}

bool start_bridge(void* self, const ArmCallback& callback, std::string&) {
  Bridge& b = *static_cast<Bridge*>(self);
  b.callback = callback;
  b.stopping = false;
  b.called_ns = now_ns();
  b.thread = std::thread([&b] { run(b); });
  return true;
}

// The device server reduces the force through its own slew after bye, or after silence.
void stop_bridge(void* self) {
  Bridge& b = *static_cast<Bridge*>(self);
  if (b.thread.joinable()) {
    b.stopping = true;
    b.thread.join();
  }
  send_sealed(b, BridgeKind::bye, 0, {});
  b.opened = false;
}

void patch_bridge(void* self, size_t arm, const ForcePatch& patch) {
  End& e = static_cast<Bridge*>(self)->end[arm];
  e.patch.draft() = patch;
  e.patch.publish();
}

ArmStatus status_of_bridge(void* self, size_t k) {
  const End& e = static_cast<Bridge*>(self)->end[k];
  ArmStatus s{e.ready.load(std::memory_order_relaxed), e.error.load(std::memory_order_relaxed),
              e.errors.load(std::memory_order_relaxed), e.steps.load(std::memory_order_relaxed)};
  s.faults = e.faults.load(std::memory_order_relaxed);
  s.force = e.force.load(std::memory_order_relaxed);
  return s;
}

std::string bridge_error(void* self, uint32_t error) {
  const std::string& where = static_cast<Bridge*>(self)->options.where;
  switch (error) {
    case kSilent:
      return "no samples from the bridge at " + where;
    case kTheirs:
      return "the bridge at " + where + " lost the device";
    case kRefused:
      return "the bridge at " + where + " serves another simulator";
    default:
      return "";
  }
}

void close_bridge(void* self) {
  Bridge* b = static_cast<Bridge*>(self);
  stop_bridge(self);
  ::close(b->fd);
  delete b;
}

}  // namespace

ArmPort open_bridge(const BridgeOptions& options, std::vector<std::string>& messages) {
  ArmPort port;
  port.kind = "bridge";
  auto b = std::make_unique<Bridge>();
  b->options = options;
  const auto or_environment = [](std::string& value, const char* name) {
    if (const char* set = std::getenv(name); value.empty() && set) value = set;
  };
  or_environment(b->options.where, "CATGUT_BRIDGE");
  or_environment(b->options.key, "CATGUT_BRIDGE_KEY");
  if (b->options.where.empty()) b->options.where = "127.0.0.1";
  const std::string who = "bridge: ";
  std::string why;
  bool local = false;
  b->fd = bridge_socket(b->options.where, false, why, &local);
  if (b->fd < 0) {
    messages.push_back(who + why + "; write --haptics bridge:HOST:PORT, or set CATGUT_BRIDGE");
    return port;
  }
  try {
    if (!b->options.key.empty()) b->caller.shared = read_bridge_key(b->options.key);
    else if (!local)
      why = b->options.where + " is another machine and needs a key; set CATGUT_BRIDGE_KEY to the file of its key";
  } catch (const InputError& error) { why = error.what(); }
  if (!why.empty()) {
    messages.push_back(who + why);
    ::close(b->fd);
    return port;
  }
  const uint64_t until = now_ns() + static_cast<uint64_t>(1e9 * double{options.patience});
  const uint64_t again = static_cast<uint64_t>(0.25e9 * double{options.patience});
  call(*b, true);
  while (now_ns() < until && !(b->known[0] && b->known[1]) && !b->refused && !b->their_version) {
    pollfd wait{b->fd, POLLIN, 0};
    poll(&wait, 1, 10);
    take(*b);
    if (now_ns() < b->called_ns + again) continue;
    if (b->opened) send_sealed(*b, BridgeKind::ask, 0, {}), b->called_ns = now_ns();
    else call(*b, false);
  }
  const bool all = b->known[0] && b->known[1];
  port.arm = b->info;
  if (b->their_version || b->refused == kOtherVersion)
    messages.push_back(who + b->options.where + " uses protocol version " + std::to_string(b->their_version) +
                       ", this program version " + std::to_string(kBridgeVersion) +
                       "; install the same Catgut on both machines");
  else if (b->refused)
    messages.push_back(who + "another simulator uses the devices at " + b->options.where + "; close it there");
  else if (!all && b->count.forged > 0)
    messages.push_back(who + b->options.where + " answers with another key; copy the same key file to both machines");
  else if (!all)
    messages.push_back(who + "no answer from " + b->options.where +
                       (b->options.key.empty()
                            ? "; start `catgut bridge` on the device's computer, or use --haptics bridge:HOST:PORT"
                            : "; start `catgut bridge` on the device's computer, with the same key"));
  else if (!port.arm[0].present && !port.arm[1].present) messages.push_back(who + b->options.where + " has no device");
  for (size_t k = 0; k < 2; ++k) b->present[k] = port.arm[k].present = port.arm[k].present && all;
  if (!b->present[0] && !b->present[1]) {
    send_sealed(*b, BridgeKind::bye, 0, {});
    ::close(b->fd);
    return port;
  }
  port.self = b.release();
  port.start = start_bridge, port.stop = stop_bridge, port.status = status_of_bridge, port.error_text = bridge_error;
  port.close = close_bridge, port.send_patch = patch_bridge;
  return port;
}

BridgeCounts bridge_counts(const ArmPort& port) {
  const Bridge& b = *static_cast<const Bridge*>(port.self);
  return {b.accepted, b.garbage, b.version, b.forged, b.invalid, b.unknown_peer, b.old};
}

}  // namespace catgut
