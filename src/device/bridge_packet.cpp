// SPDX-License-Identifier: Apache-2.0
// device/bridge_packet: see the header.
#include "device/bridge_packet.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "core/check.h"

namespace catgut {
namespace {

constexpr uint32_t kMagic = 0x42474143;
constexpr size_t kHead = 16, kTagAt = 240, kTag = 16, kText = 40;
constexpr uint64_t kCookieTime = 2000000000;  // [ns] a cookie is good for one to two of these
static_assert(kHead + kBridgePayload == kTagAt && kTagAt + kTag == kBridgeBytes);
static_assert(crypto_aead_xchacha20poly1305_ietf_ABYTES == kTag && crypto_scalarmult_BYTES == sizeof(BridgeKey));

[[maybe_unused]] const int kSodium = sodium_init();

// Byte by byte: little endian on every machine.
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
void put_sym(uint8_t* at, const Sym3& s) {
  const float f[6] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz};
  for (size_t k = 0; k < 6; ++k) put_float(at + 4 * k, f[k]);
}
Sym3 get_sym(const uint8_t* at) {
  Sym3 s;
  s.xx = get_float(at), s.yy = get_float(at + 4), s.zz = get_float(at + 8);
  s.xy = get_float(at + 12), s.xz = get_float(at + 16), s.yz = get_float(at + 20);
  return s;
}
void put_text(uint8_t* at, const std::string& s) { std::memcpy(at, s.data(), std::min(s.size(), kText - 1)); }
// A name from the network is printed on terminals: no control characters.
std::string get_text(const uint8_t* at) {
  std::string s;
  for (size_t k = 0; k < kText - 1 && at[k]; ++k) s += at[k] >= 0x20 && at[k] < 0x7f ? static_cast<char>(at[k]) : '?';
  return s;
}

// Finite, and within a range that squares without overflow.
bool floats_are_sane(const BridgePayload& p, size_t from, size_t count) {
  for (size_t k = 0; k < count; ++k)
    if (!(std::abs(get_float(&p[from + 4 * k])) <= 1e6f)) return false;
  return true;
}

void write_head(BridgeBytes& out, const BridgeHead& h) {
  put(&out[0], kMagic), put(&out[4], h.version);
  out[6] = static_cast<uint8_t>(h.kind), out[7] = h.arm;
  put(&out[8], h.counter);
}

void sign(const BridgeKey& shared, BridgeBytes& packet) {
  crypto_generichash(&packet[kTagAt], kTag, packet.data(), kTagAt, shared.data(), shared.size());
}
BridgeBytes handshake(const BridgeKey& shared, BridgeKind kind, const uint8_t* first, const uint8_t* second) {
  BridgeBytes out{};
  write_head(out, {kind, 0, kBridgeVersion, 0});
  if (first) std::memcpy(&out[16], first, sizeof(BridgeKey));
  if (second) std::memcpy(&out[48], second, sizeof(BridgeKey));
  sign(shared, out);
  return out;
}

bool session_keys(const BridgeKey& shared, const BridgeKey& secret, const uint8_t* theirs, const uint8_t* caller,
                  const uint8_t* arm, const uint8_t* cookie, BridgeKey& to_arm, BridgeKey& to_caller) {
  uint8_t text[4 * 32 + 1];
  if (crypto_scalarmult(text, secret.data(), theirs) != 0) return false;  // a key of small order
  std::memcpy(text + 32, caller, 32), std::memcpy(text + 64, arm, 32), std::memcpy(text + 96, cookie, 32);
  text[128] = 1;
  crypto_generichash(to_arm.data(), to_arm.size(), text, sizeof text, shared.data(), shared.size());
  text[128] = 2;
  crypto_generichash(to_caller.data(), to_caller.size(), text, sizeof text, shared.data(), shared.size());
  sodium_memzero(text, sizeof text);
  return true;
}

BridgeKey cookie_of(const BridgeDoor& d, const uint8_t* caller, const void* address, size_t bytes, uint64_t bucket) {
  BridgeKey out;
  crypto_generichash_state state;
  crypto_generichash_init(&state, d.secret.data(), d.secret.size(), out.size());
  crypto_generichash_update(&state, caller, 32);
  crypto_generichash_update(&state, static_cast<const uint8_t*>(address), bytes);
  uint8_t time[8];
  put(time, bucket);
  crypto_generichash_update(&state, time, sizeof time);
  crypto_generichash_final(&state, out.data(), out.size());
  return out;
}

void nonce_of(uint64_t counter, uint8_t* nonce) {
  std::memset(nonce, 0, crypto_aead_xchacha20poly1305_ietf_NPUBBYTES);
  put(nonce + 16, counter);
}

}  // namespace

BridgeFault read_head(const uint8_t* data, size_t size, BridgeHead& h) {
  if (size != kBridgeBytes || get<uint32_t>(data) != kMagic) return BridgeFault::garbage;
  h.version = get<uint16_t>(data + 4);
  h.kind = static_cast<BridgeKind>(data[6]);
  h.arm = data[7];
  h.counter = get<uint64_t>(data + 8);
  if (h.version != kBridgeVersion) return BridgeFault::version;
  const bool fine = data[6] >= 1 && data[6] < kBridgeKinds && h.arm < 2;
  return fine ? BridgeFault::none : BridgeFault::invalid;
}

void seal(const BridgeKey& key, const BridgeHead& head, const BridgePayload& payload, BridgeBytes& out) {
  write_head(out, head);
  uint8_t nonce[crypto_aead_xchacha20poly1305_ietf_NPUBBYTES];
  nonce_of(head.counter, nonce);
  unsigned long long size = 0;
  crypto_aead_xchacha20poly1305_ietf_encrypt(&out[kHead], &size, payload.data(), payload.size(), out.data(), kHead, nullptr,
                                             nonce, key.data());
}

bool unseal(const BridgeKey& key, const uint8_t* packet, BridgePayload& payload) {
  uint8_t nonce[crypto_aead_xchacha20poly1305_ietf_NPUBBYTES];
  nonce_of(get<uint64_t>(packet + 8), nonce);
  unsigned long long size = 0;
  return crypto_aead_xchacha20poly1305_ietf_decrypt(payload.data(), &size, nullptr, packet + kHead, kBridgeBytes - kHead,
                                                    packet, kHead, nonce, key.data()) == 0;
}

BridgeKey random_key() {
  BridgeKey k;
  randombytes_buf(k.data(), k.size());
  return k;
}

bool mac_is_right(const BridgeKey& shared, const uint8_t* packet) {
  uint8_t tag[kTag];
  crypto_generichash(tag, kTag, packet, kTagAt, shared.data(), shared.size());
  return sodium_memcmp(tag, packet + kTagAt, kTag) == 0;
}

BridgeBytes refused_packet(const BridgeKey& shared, BridgeRefusal why) {
  BridgeKey word{};
  put(word.data(), static_cast<uint32_t>(why));
  return handshake(shared, BridgeKind::refused, word.data(), nullptr);
}
uint32_t refused_why(const uint8_t* packet) { return get<uint32_t>(packet + 16); }

void begin_call(BridgeCaller& c) {
  c.secret = random_key();
  crypto_scalarmult_base(c.own.data(), c.secret.data());
  c.cookie = {};
}
BridgeBytes hello_packet(const BridgeCaller& c) { return handshake(c.shared, BridgeKind::hello, c.own.data(), nullptr); }
bool take_cookie(BridgeCaller& c, const uint8_t* p) {
  if (!mac_is_right(c.shared, p) || std::memcmp(p + 16, c.own.data(), 32) != 0) return false;
  std::memcpy(c.cookie.data(), p + 48, 32);
  return true;
}
BridgeBytes open_packet(const BridgeCaller& c) { return handshake(c.shared, BridgeKind::open, c.own.data(), c.cookie.data()); }
bool take_opened(const BridgeCaller& c, const uint8_t* p, BridgeKey& in, BridgeKey& out) {
  if (!mac_is_right(c.shared, p) || std::memcmp(p + 16, c.own.data(), 32) != 0) return false;
  return session_keys(c.shared, c.secret, p + 48, c.own.data(), p + 48, c.cookie.data(), out, in);
}

BridgeKey caller_key(const uint8_t* packet) {
  BridgeKey k;
  std::memcpy(k.data(), packet + 16, k.size());
  return k;
}
BridgeBytes cookie_packet(const BridgeDoor& d, const uint8_t* hello, const void* address, size_t bytes, uint64_t now_ns) {
  const BridgeKey cookie = cookie_of(d, hello + 16, address, bytes, now_ns / kCookieTime);
  return handshake(d.shared, BridgeKind::cookie, hello + 16, cookie.data());
}
bool cookie_is_right(const BridgeDoor& d, const uint8_t* open, const void* address, size_t bytes, uint64_t now_ns) {
  const uint64_t bucket = now_ns / kCookieTime;
  for (uint64_t age = 0; age < 2 && age <= bucket; ++age) {
    const BridgeKey cookie = cookie_of(d, open + 16, address, bytes, bucket - age);
    if (sodium_memcmp(cookie.data(), open + 48, cookie.size()) == 0) return true;
  }
  return false;
}
BridgeBytes opened_packet(const BridgeDoor& d, const uint8_t* open, BridgeKey& in, BridgeKey& out) {
  const BridgeKey secret = random_key();
  BridgeKey own;
  crypto_scalarmult_base(own.data(), secret.data());
  if (!session_keys(d.shared, secret, open + 16, open + 16, own.data(), open + 48, in, out))
    in = random_key(), out = random_key();  // unknown to everyone: such a session stays silent
  return handshake(d.shared, BridgeKind::opened, open + 16, own.data());
}

BridgeKey read_bridge_key(const std::string& file) {
  const auto fail = [&file](const std::string& why, const std::string& next) { throw InputError("key " + file, why, next); };
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail(std::strerror(errno), "make one with catgut bridge --new-key FILE and copy it to both machines");
  struct stat status {};
  fstat(fd, &status);
  uint8_t data[80];
  const ssize_t n = ::read(fd, data, sizeof data);
  ::close(fd);
  if ((status.st_mode & 077) != 0) fail("others may read it", "chmod 600 " + file);
  BridgeKey key{};
  size_t size = n > 0 ? static_cast<size_t>(n) : 0;
  if (size == key.size()) {
    std::memcpy(key.data(), data, size);
    return key;
  }
  while (size > 0 && (data[size - 1] == '\n' || data[size - 1] == '\r' || data[size - 1] == ' ')) --size;
  size_t read = 0;
  if (size != 64 ||
      sodium_hex2bin(key.data(), key.size(), reinterpret_cast<const char*>(data), size, nullptr, &read, nullptr) ||
      read != key.size())
    fail("it has neither 32 bytes nor 64 hexadecimal digits", "make one with catgut bridge --new-key FILE");
  return key;
}

void write_bridge_key(const std::string& file) {
  const BridgeKey key = random_key();
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const bool done = fd >= 0 && ::write(fd, key.data(), key.size()) == static_cast<ssize_t>(key.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!done) throw InputError("key " + file, std::strerror(error), "name a file that does not exist yet");
}

void write_info(const ArmInfo& a, BridgePayload& p) {
  p.fill(0);
  put(&p[0], uint32_t{a.present});
  put_float(&p[4], a.limits.force), put_float(&p[8], a.limits.continuous);
  put_float(&p[12], a.limits.stiffness), put_float(&p[16], a.limits.damping);
  put_vec(&p[20], a.least), put_vec(&p[32], a.most);
  put_text(&p[44], a.name), put_text(&p[84], a.model), put_text(&p[124], a.serial), put_text(&p[164], a.driver);
  put_float(&p[204], a.limits.torque), put_float(&p[208], a.limits.turn_stiffness), put_float(&p[212], a.limits.turn_damping);
  put_float(&p[216], a.limits.grip), put_float(&p[220], a.limits.grip_stiffness);
}
bool read_info(const BridgePayload& p, ArmInfo& a) {
  if (!floats_are_sane(p, 4, 10) || !floats_are_sane(p, 204, 5)) return false;
  a.present = get<uint32_t>(&p[0]) != 0;
  a.limits.force = get_float(&p[4]), a.limits.continuous = get_float(&p[8]);
  a.limits.stiffness = get_float(&p[12]), a.limits.damping = get_float(&p[16]);
  a.least = get_vec(&p[20]), a.most = get_vec(&p[32]);
  a.name = get_text(&p[44]), a.model = get_text(&p[84]), a.serial = get_text(&p[124]), a.driver = get_text(&p[164]);
  a.limits.torque = get_float(&p[204]), a.limits.turn_stiffness = get_float(&p[208]);
  a.limits.turn_damping = get_float(&p[212]);
  a.limits.grip = get_float(&p[216]), a.limits.grip_stiffness = get_float(&p[220]);
  return true;
}

void write_sample(const ArmSample& s, const ArmForce& force, uint32_t faults, BridgePayload& p) {
  p.fill(0);
  put(&p[0], s.time_ns);
  // A sample with an invalid number is sent as an absent device.
  const bool ready = s.state == ArmState::ready && is_finite(s.pose.p) && is_finite(s.velocity) && std::isfinite(s.warmth) &&
                     std::isfinite(s.pose.q.x + s.pose.q.y + s.pose.q.z + s.pose.q.w);
  put(&p[8], uint32_t{ready} | (s.forced_off ? 2u : 0u));
  if (ready) {
    put(&p[12], s.buttons);
    put_vec(&p[16], s.pose.p);
    put_float(&p[28], s.pose.q.x), put_float(&p[32], s.pose.q.y), put_float(&p[36], s.pose.q.z), put_float(&p[40], s.pose.q.w);
    put_vec(&p[44], s.velocity);
    put_float(&p[56], s.warmth);
  }
  if (is_finite(force)) put_vec(&p[60], force.force), put_vec(&p[80], force.torque), put_float(&p[92], force.grip);
  put(&p[72], faults);
  put_float(&p[76], ready && s.jaw >= 0 && s.jaw <= 1 ? s.jaw : -1.0f);
}
bool read_sample(const BridgePayload& p, ArmSample& s, ArmForce& force, uint32_t& faults) {
  if (!floats_are_sane(p, 16, 14) || !floats_are_sane(p, 76, 5)) return false;
  const uint32_t flags = get<uint32_t>(&p[8]);
  s = {};
  s.time_ns = get<uint64_t>(&p[0]);
  s.state = flags & 1 ? ArmState::ready : ArmState::absent;
  s.forced_off = (flags & 2) != 0;
  s.buttons = get<uint32_t>(&p[12]);
  s.pose.p = get_vec(&p[16]);
  s.pose.q = normalized(Quat{get_float(&p[28]), get_float(&p[32]), get_float(&p[36]), get_float(&p[40])});
  s.velocity = get_vec(&p[44]);
  s.warmth = get_float(&p[56]);
  force = {get_vec(&p[60]), get_vec(&p[80]), get_float(&p[92])};
  faults = get<uint32_t>(&p[72]);
  s.jaw = get_float(&p[76]);
  return true;
}

void write_patch(const ForcePatch& f, BridgePayload& p) {
  p.fill(0);
  put(&p[0], f.time_ns), put(&p[8], f.tick), put(&p[16], f.epoch), put(&p[20], f.discontinuity_id);
  put_float(&p[24], f.period), put_float(&p[28], f.expiry);
  put_vec(&p[32], f.point), put_vec(&p[44], f.force), put_sym(&p[56], f.stiffness), put_sym(&p[80], f.damping);
  put_vec(&p[104], f.normal), put_float(&p[116], f.gap);
  put_float(&p[120], f.coefficient), put_float(&p[124], f.drag), put_float(&p[128], f.presliding),
      put_float(&p[132], f.viscous);
  put_vec(&p[136], f.along), put_vec(&p[148], f.pierce), put_float(&p[160], f.pierce_force), put_float(&p[164], f.pierce_keep);
  put_float(&p[168], f.cap);
  put_float(&p[172], f.turn.x), put_float(&p[176], f.turn.y), put_float(&p[180], f.turn.z), put_float(&p[184], f.turn.w);
  put_vec(&p[188], f.lever), put_vec(&p[200], f.couple), put_float(&p[212], f.couple_stiffness);
  put_float(&p[216], f.grip_from), put_float(&p[220], f.grip_stiffness);
}
bool read_patch(const BridgePayload& p, ForcePatch& f) {
  if (!floats_are_sane(p, 24, 50)) return false;
  f = {};
  f.time_ns = get<uint64_t>(&p[0]), f.tick = get<uint64_t>(&p[8]);
  f.epoch = get<uint32_t>(&p[16]), f.discontinuity_id = get<uint32_t>(&p[20]);
  f.period = get_float(&p[24]), f.expiry = get_float(&p[28]);
  f.point = get_vec(&p[32]), f.force = get_vec(&p[44]), f.stiffness = get_sym(&p[56]), f.damping = get_sym(&p[80]);
  f.normal = get_vec(&p[104]), f.gap = get_float(&p[116]);
  f.coefficient = get_float(&p[120]), f.drag = get_float(&p[124]);
  f.presliding = get_float(&p[128]), f.viscous = get_float(&p[132]);
  f.along = get_vec(&p[136]), f.pierce = get_vec(&p[148]);
  f.pierce_force = get_float(&p[160]), f.pierce_keep = get_float(&p[164]);
  f.cap = get_float(&p[168]);
  f.turn = normalized(Quat{get_float(&p[172]), get_float(&p[176]), get_float(&p[180]), get_float(&p[184])});
  f.lever = get_vec(&p[188]), f.couple = get_vec(&p[200]), f.couple_stiffness = get_float(&p[212]);
  f.grip_from = get_float(&p[216]), f.grip_stiffness = get_float(&p[220]);
  return true;
}

}  // namespace catgut
