// device/bridge: see the header.
#include "device/bridge.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <thread>

namespace catgut {
namespace {

constexpr uint32_t kMagic = 0x42474143;
constexpr size_t kText = 40, kCrcAt = 252;

constexpr std::array<uint32_t, 256> crc_table() {
  std::array<uint32_t, 256> table{};
  for (uint32_t n = 0; n < 256; ++n) {
    uint32_t c = n;
    for (int k = 0; k < 8; ++k) c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
    table[n] = c;
  }
  return table;
}
uint32_t crc32(const uint8_t* data, size_t bytes) {
  static constexpr std::array<uint32_t, 256> kTable = crc_table();
  uint32_t c = 0xFFFFFFFFu;
  for (size_t k = 0; k < bytes; ++k) c = kTable[(c ^ data[k]) & 0xFF] ^ (c >> 8);
  return c ^ 0xFFFFFFFFu;
}

// Byte by byte, so that it is little endian wherever this runs.
template <typename T>
void put(uint8_t* at, T value) {
  for (size_t k = 0; k < sizeof(T); ++k) at[k] = static_cast<uint8_t>(value >> (8 * k));
}
template <typename T>
T get(const uint8_t* at) {
  T value = 0;
  for (size_t k = 0; k < sizeof(T); ++k) value = static_cast<T>(value | static_cast<T>(static_cast<T>(at[k]) << (8 * k)));
  return value;
}
void put_float(uint8_t* at, float f) { put(at, std::bit_cast<uint32_t>(f)); }
float get_float(const uint8_t* at) { return std::bit_cast<float>(get<uint32_t>(at)); }
void put_vec(uint8_t* at, Vec3 v) { put_float(at, v.x), put_float(at + 4, v.y), put_float(at + 8, v.z); }
Vec3 get_vec(const uint8_t* at) { return {get_float(at), get_float(at + 4), get_float(at + 8)}; }
void put_text(uint8_t* at, const std::string& s) { std::memcpy(at, s.data(), std::min(s.size(), kText - 1)); }
// What a stranger calls himself is shown to people: nothing in it may steer a terminal.
std::string get_text(const uint8_t* at) {
  std::string s;
  for (size_t k = 0; k < kText - 1 && at[k]; ++k) s += at[k] >= 0x20 && at[k] < 0x7f ? static_cast<char>(at[k]) : '?';
  return s;
}

// Numbers, and none that no arm has: what is squared later must not overflow.
bool floats_are_sane(const uint8_t* packet, size_t from, size_t count) {
  for (size_t k = 0; k < count; ++k)
    if (!(std::abs(get_float(packet + from + 4 * k)) <= 1e6f)) return false;
  return true;
}

void begin(BridgeBytes& out, const BridgeHead& h) {
  out.fill(0);
  put(&out[0], kMagic), put(&out[4], h.version);
  out[6] = static_cast<uint8_t>(h.kind), out[7] = h.arm;
  put(&out[8], h.session), put(&out[16], h.sequence), put(&out[24], h.time_ns);
}
void seal(BridgeBytes& out) { put(&out[kCrcAt], crc32(out.data(), kCrcAt)); }

}  // namespace

BridgeFault read_bridge(const uint8_t* data, size_t size, BridgeHead& h) {
  if (size != kBridgeBytes || get<uint32_t>(data) != kMagic) return BridgeFault::garbage;
  if (get<uint32_t>(data + kCrcAt) != crc32(data, kCrcAt)) return BridgeFault::garbage;
  h.version = get<uint16_t>(data + 4);
  h.kind = static_cast<BridgeKind>(data[6]);
  h.arm = data[7];
  h.session = get<uint64_t>(data + 8), h.sequence = get<uint64_t>(data + 16), h.time_ns = get<uint64_t>(data + 24);
  if (h.version != kBridgeVersion) return BridgeFault::version;
  bool fine = h.arm < 2;
  switch (h.kind) {
    case BridgeKind::hello:
    case BridgeKind::refused:
    case BridgeKind::bye:
      break;
    case BridgeKind::info:
      fine = fine && floats_are_sane(data, 36, 10);
      break;
    case BridgeKind::sample:
      fine = fine && floats_are_sane(data, 40, 14);
      break;
    case BridgeKind::command:
      fine = fine && floats_are_sane(data, 32, 4);
      break;
    default:
      fine = false;
  }
  return fine ? BridgeFault::none : BridgeFault::nonsense;
}

void count_fault(BridgeCounts& c, BridgeFault fault) {
  if (fault == BridgeFault::garbage) ++c.garbage;
  if (fault == BridgeFault::version) ++c.version;
  if (fault == BridgeFault::nonsense) ++c.nonsense;
}

void write_plain(BridgeBytes& out, const BridgeHead& head, uint32_t word) {
  begin(out, head);
  put(&out[32], word);
  seal(out);
}

void write_info(BridgeBytes& out, const BridgeHead& head, const ArmInfo& a) {
  begin(out, head);
  put(&out[32], uint32_t{a.present});
  put_float(&out[36], a.limits.force), put_float(&out[40], a.limits.continuous);
  put_float(&out[44], a.limits.stiffness), put_float(&out[48], a.limits.damping);
  put_vec(&out[52], a.least), put_vec(&out[64], a.most);
  put_text(&out[76], a.name), put_text(&out[116], a.model), put_text(&out[156], a.serial), put_text(&out[196], a.driver);
  seal(out);
}

void write_sample(BridgeBytes& out, const BridgeHead& head, const ArmSample& s, Vec3 force) {
  begin(out, head);
  // A sample that is no number goes as what it is worth: an arm that is not there.
  const bool ready = s.state == ArmState::ready && is_finite(s.pose.p) && is_finite(s.velocity) && std::isfinite(s.warmth) &&
                     std::isfinite(s.pose.q.x + s.pose.q.y + s.pose.q.z + s.pose.q.w);
  put(&out[32], uint32_t{ready} | (s.forced_off ? 2u : 0u));
  if (ready) {
    put(&out[36], s.buttons);
    put_vec(&out[40], s.pose.p);
    put_float(&out[52], s.pose.q.x), put_float(&out[56], s.pose.q.y);
    put_float(&out[60], s.pose.q.z), put_float(&out[64], s.pose.q.w);
    put_vec(&out[68], s.velocity);
    put_float(&out[80], s.warmth);
  }
  if (is_finite(force)) put_vec(&out[84], force);
  seal(out);
}

void write_command(BridgeBytes& out, const BridgeHead& head, const BridgeCommand& c) {
  begin(out, head);
  if (is_finite(c.force)) put_vec(&out[32], c.force);
  put_float(&out[44], c.expiry);
  put(&out[48], c.answers_ns);
  seal(out);
}

uint32_t read_word(const uint8_t* packet) { return get<uint32_t>(packet + 32); }

ArmInfo read_info(const uint8_t* p) {
  ArmInfo a;
  a.present = get<uint32_t>(p + 32) != 0;
  a.limits = {get_float(p + 36), get_float(p + 40), get_float(p + 44), get_float(p + 48)};
  a.least = get_vec(p + 52), a.most = get_vec(p + 64);
  a.name = get_text(p + 76), a.model = get_text(p + 116), a.serial = get_text(p + 156), a.driver = get_text(p + 196);
  return a;
}

ArmSample read_sample(const uint8_t* p, Vec3& force) {
  ArmSample s;
  const uint32_t flags = get<uint32_t>(p + 32);
  s.state = flags & 1 ? ArmState::ready : ArmState::absent;
  s.forced_off = (flags & 2) != 0;
  s.buttons = get<uint32_t>(p + 36);
  s.pose.p = get_vec(p + 40);
  s.pose.q = normalized(Quat{get_float(p + 52), get_float(p + 56), get_float(p + 60), get_float(p + 64)});
  s.velocity = get_vec(p + 68);
  s.warmth = get_float(p + 80);
  force = get_vec(p + 84);
  return s;
}

BridgeCommand read_command(const uint8_t* p) { return {get_vec(p + 32), get_float(p + 44), get<uint64_t>(p + 48)}; }

int bridge_socket(const std::string& where, bool bind_it, std::string& why) {
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
    why = "\"" + where + "\" is no HOST:PORT";
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
  // Of a name that has addresses of both kinds the older one: on it `catgut bridge` listens unless it is told otherwise.
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
  return fd;
}

namespace {

constexpr float kStopStep = 0.5f;  // [N] per millisecond on the way down, as of the other drivers
constexpr int kMostStops = 50;     // answers after which a stop is not waited for any longer
enum PortError : uint32_t { kSilent = 1, kTheirs = 2, kRefused = 3 };

uint64_t now_ns() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

struct End {
  // The thread's.
  uint64_t heard_ns = 0, stepped_ns = 0, answers_ns = 0, sequence = 0;
  uint32_t count = 0;  // of samples given to the callback
  bool fresh = false, lost = true;
  ArmSample sample;
  Vec3 force;
  // For any thread.
  std::atomic<bool> ready{false}, at_rest{true};
  std::atomic<uint32_t> error{0}, errors{0};
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
  // The thread's, and while opening the opener's.
  uint64_t session = 0, sent = 0, hello_ns = 0;
  std::minstd_rand draw;
  BridgeCounts count;
  // For any thread: the above, copied once per round.
  std::atomic<uint64_t> accepted{0}, garbage{0}, version{0}, nonsense{0}, stranger{0}, old{0};
};

BridgeHead head_of(Bridge& b, BridgeKind kind, size_t arm = 0) {
  return {kind, static_cast<uint8_t>(arm), kBridgeVersion, b.session, ++b.sent, now_ns()};
}
// Lost packets are the other end's watchdog's business: nothing is waited for, nothing is sent twice.
void post(const Bridge& b, const BridgeBytes& packet) {
  [[maybe_unused]] const ssize_t n = send(b.fd, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}
void say_hello(Bridge& b) {
  // A new session: what is still on its way belongs to the old one, and the other end begins with force off.
  b.session = (uint64_t{b.draw()} << 32) ^ (uint64_t{b.draw()} << 8) ^ b.draw();
  for (End& e : b.end) e.sequence = 0;
  BridgeBytes packet;
  write_plain(packet, head_of(b, BridgeKind::hello));
  post(b, packet);
  b.hello_ns = now_ns();
}

// Takes what has come. info: gets what the other end says of its arms (null: nobody asks). refused: the reason, or 0.
void take(Bridge& b, std::array<ArmInfo, 2>* info, std::array<bool, 2>& known, uint32_t& refused, uint16_t& their_version) {
  uint8_t data[kBridgeBytes + 1];
  for (int k = 0; k < 64; ++k) {  // a flood must not keep the hands from their millisecond
    const ssize_t n = recv(b.fd, data, sizeof data, MSG_DONTWAIT);
    if (n < 0 && errno != ECONNREFUSED) return;  // nothing more; a refusal by the system is only silence
    if (n < 0) continue;
    BridgeHead h;
    const BridgeFault fault = read_bridge(data, static_cast<size_t>(n), h);
    if (fault == BridgeFault::version) their_version = h.version;
    if (fault != BridgeFault::none) {
      count_fault(b.count, fault);
      continue;
    }
    if (h.session != b.session) {
      ++b.count.stranger;
      continue;
    }
    if (h.kind == BridgeKind::refused) refused = read_word(data);
    if (h.kind == BridgeKind::bye) {
      for (End& e : b.end) e.heard_ns = 0;
    }
    if (h.kind == BridgeKind::info && info) (*info)[h.arm] = read_info(data), known[h.arm] = true;
    if (h.kind == BridgeKind::sample) {
      End& e = b.end[h.arm];
      if (h.sequence <= e.sequence) {
        ++b.count.old;
        continue;
      }
      e.sequence = h.sequence;
      Vec3 felt;
      e.sample = read_sample(data, felt);
      e.answers_ns = h.time_ns;
      e.heard_ns = now_ns();
      e.fresh = true;
    }
    ++b.count.accepted;
  }
}

void fail(End& e, uint32_t error) {
  if (e.error.exchange(error, std::memory_order_relaxed) != error || e.ready) e.errors.fetch_add(1, std::memory_order_relaxed);
  e.ready.store(false, std::memory_order_relaxed);
}

void serve(Bridge& b, size_t k, uint64_t now) {
  End& e = b.end[k];
  const bool silent = e.heard_ns == 0 || now > e.heard_ns + static_cast<uint64_t>(1e9 * double{b.options.forget});
  // While it is silent the servo still gets its millisecond, and learns that there is no arm.
  if (!e.fresh && (!silent || now < e.stepped_ns + 1000000)) return;
  if (!e.fresh) e.sample = {};
  e.sample.sequence = ++e.count;
  Vec3 force = b.callback.step(b.callback.user, k, e.sample);
  if (b.stopping.load(std::memory_order_relaxed)) {
    const float l = length(e.force);
    force = l > kStopStep ? e.force * ((l - kStopStep) / l) : Vec3{};
  }
  const bool ready = e.fresh && e.sample.state == ArmState::ready;
  if (!is_finite(force) || !ready) force = {};
  if (e.fresh) {
    BridgeBytes packet;
    BridgeCommand c;
    c.force = force, c.answers_ns = e.answers_ns;
    write_command(packet, head_of(b, BridgeKind::command, k), c);
    post(b, packet);
  }
  if (ready) e.ready.store(true, std::memory_order_relaxed);
  else fail(e, e.fresh ? kTheirs : kSilent);
  e.fresh = false;
  e.force = force;
  e.at_rest.store(length2(force) == 0, std::memory_order_relaxed);
  e.stepped_ns = now;
  e.steps.fetch_add(1, std::memory_order_relaxed);
}

void run(Bridge& b) {
  int stops = 0;
  while (!b.stopping || (!(b.end[0].at_rest && b.end[1].at_rest) && ++stops < kMostStops)) {
    pollfd wait{b.fd, POLLIN, 0};
    poll(&wait, 1, 1);
    std::array<bool, 2> known{};
    uint32_t refused = 0;
    uint16_t theirs = 0;
    take(b, nullptr, known, refused, theirs);
    const uint64_t now = now_ns();
    bool all_silent = true;
    for (size_t k = 0; k < 2; ++k) {
      if (!b.present[k]) continue;
      serve(b, k, now);
      if (refused) fail(b.end[k], kRefused);
      all_silent &= b.end[k].heard_ns == 0 || now > b.end[k].heard_ns + static_cast<uint64_t>(1e9 * double{b.options.forget});
    }
    if (all_silent && now > b.hello_ns + static_cast<uint64_t>(1e9 * double{b.options.again_after})) say_hello(b);
    b.accepted = b.count.accepted, b.garbage = b.count.garbage, b.version = b.count.version;
    b.nonsense = b.count.nonsense, b.stranger = b.count.stranger, b.old = b.count.old;
  }
}

bool start_bridge(void* self, const ArmCallback& callback, std::string&) {
  Bridge& b = *static_cast<Bridge*>(self);
  b.callback = callback;
  b.stopping = false;
  say_hello(b);
  b.thread = std::thread([&b] { run(b); });
  return true;
}

void stop_bridge(void* self) {
  Bridge& b = *static_cast<Bridge*>(self);
  if (b.thread.joinable()) {
    // The force comes down answer by answer. Where no samples come, silence does it at the other end.
    b.stopping = true;
    b.thread.join();
  }
  BridgeBytes packet;
  write_plain(packet, head_of(b, BridgeKind::bye));
  post(b, packet);
}

ArmStatus status_of_bridge(void* self, size_t k) {
  const End& e = static_cast<Bridge*>(self)->end[k];
  return {e.ready.load(std::memory_order_relaxed), e.error.load(std::memory_order_relaxed),
          e.errors.load(std::memory_order_relaxed), e.steps.load(std::memory_order_relaxed)};
}

std::string bridge_error(void* self, uint32_t error) {
  const std::string& where = static_cast<Bridge*>(self)->options.where;
  switch (error) {
    case kSilent:
      return "no samples from the bridge at " + where;
    case kTheirs:
      return "the bridge at " + where + " has lost it";
    case kRefused:
      return "the bridge at " + where + " gave it to another simulator";
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

ArmPort open_bridge(const BridgeOptions& options, std::vector<std::string>& told) {
  ArmPort port;
  port.kind = "bridge";
  auto b = std::make_unique<Bridge>();
  b->options = options;
  if (const char* set = std::getenv("CATGUT_BRIDGE"); b->options.where.empty() && set) b->options.where = set;
  if (b->options.where.empty()) b->options.where = "127.0.0.1";
  const std::string who = "bridge: ";
  std::string why;
  b->fd = bridge_socket(b->options.where, false, why);
  if (b->fd < 0) {
    told.push_back(who + why + "; write --haptics bridge:HOST:PORT, or set CATGUT_BRIDGE");
    return port;
  }
  b->draw.seed(std::random_device{}());
  std::array<bool, 2> known{};
  uint32_t refused = 0;
  uint16_t theirs = 0;
  const uint64_t until = now_ns() + static_cast<uint64_t>(1e9 * double{options.patience});
  while (now_ns() < until && !(known[0] && known[1]) && !refused && !theirs) {
    if (now_ns() > b->hello_ns + static_cast<uint64_t>(0.25e9 * double{options.patience})) say_hello(*b);
    pollfd wait{b->fd, POLLIN, 0};
    poll(&wait, 1, 10);
    take(*b, &port.arm, known, refused, theirs);
  }
  if (theirs || refused == kOtherVersion)
    told.push_back(who + b->options.where + " speaks version " + std::to_string(theirs) +
                   " of the bridge, this program version " + std::to_string(kBridgeVersion) +
                   "; install the same Catgut on both machines");
  else if (refused) told.push_back(who + "another simulator has the arms at " + b->options.where + "; close it there");
  else if (!known[0] || !known[1])
    told.push_back(who + "nobody answers at " + b->options.where +
                   "; start `catgut bridge` where the arm is, or write --haptics bridge:HOST:PORT");
  else if (!port.arm[0].present && !port.arm[1].present) told.push_back(who + b->options.where + " has no arm");
  for (size_t k = 0; k < 2; ++k) b->present[k] = port.arm[k].present = port.arm[k].present && known[0] && known[1];
  if (!b->present[0] && !b->present[1]) {
    ::close(b->fd);
    return port;
  }
  port.self = b.release();
  port.start = start_bridge, port.stop = stop_bridge, port.status = status_of_bridge, port.error_text = bridge_error;
  port.close = close_bridge;
  return port;
}

BridgeCounts bridge_counts(const ArmPort& port) {
  const Bridge& b = *static_cast<const Bridge*>(port.self);
  return {b.accepted, b.garbage, b.version, b.nonsense, b.stranger, b.old};
}

}  // namespace catgut
