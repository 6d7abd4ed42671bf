// SPDX-License-Identifier: Apache-2.0
// device: the packets of the bridge, version 2, and the cryptography around them (libsodium). No socket, no clock, no state
// except the arguments. The layout is a contract with programs in other languages; samples/bridge_arm.py is one.
//
// Every packet has 256 bytes, little endian, unused bytes zero:
//     0 u32 magic 0x42474143 ("CAGB")   4 u16 version 2   6 u8 kind   7 u8 arm: 0 right, 1 left   8 u64 counter
//     16 payload, 224 bytes             240 tag, 16 bytes
//
// Both ends share a key of 32 bytes (32 zero bytes on the loopback, where none is needed). Handshake packets travel in clear;
// their tag is BLAKE2b-128, keyed with the shared key, of the 240 bytes before it:
//   hello (1), simulator: 16 its X25519 public key of this session, S
//   cookie (2), arm: 16 S; 48 cookie, 32 bytes, valid only for the sender's address; the server stores nothing
//   open (3), simulator: 16 S; 48 the cookie
//   opened (4), arm: 16 S; 48 the arm's X25519 public key A
//   refused (5), arm: 16 u32 1 the server uses another version (see the head), 2 another simulator has the devices
// Until here no end sends more bytes than it has received. Keys of the session: BLAKE2b-256, keyed with the shared key, of
// X25519(S, A) || S || A || cookie || direction (1 to the arm, 2 to the simulator).
//
// All others are sealed: XChaCha20-Poly1305 with the direction's key, the nonce is 16 zero bytes and the counter, the head is
// authenticated with the payload. A sender's counter grows with every packet; a receiver accepts a packet of a kind and device
// only if its counter is larger than that of the last one. Repeated or overtaken packets are dropped.
//   ask (6), simulator: answered by an info for each device; also reports that the simulator is alive
//   info (7), arm: 0 u32 present; f32: 4 force, 8 continuous, 12 stiffness, 16 damping, 20 least x3, 32 most x3 [m];
//       char x40, ending in zero: 44 name, 84 model, 124 serial, 164 driver; f32, 0 where there are no such motors: 204 torque
//       [N m], 208 stiffness [N m/rad] and 212 damping [N m s/rad] of rotation, 216 force [N] and 220 stiffness [N/m] of a
//       gripper
//   sample (8), arm: 0 u64 time [ns] on the arm's clock; 8 u32 1 ready + 2 forced off; 12 u32 buttons; f32: 16 position x3 [m],
//       28 quaternion xyzw, 44 velocity x3 [m/s], 56 warmth, 60 force on the motors x3 [N]; 72 u32 faults (haptic/limiter); 76
//       f32 jaw of a gripper, 0 closed to 1 open, -1 none; 80 torque on the motors x3 [N m], 92 grip [N]
//   patch (9), simulator: ForcePatch in the arm's frame: 0 u64 time of the sample that it was computed for, 8 u64 tick,
//       16 u32 epoch, 20 u32 topology; f32: 24 period, 28 expiry, 32 point x3, 44 force x3, 56 stiffness and 80 damping (xx yy
//       zz xy xz yz), 104 normal x3, 116 gap, 120 coefficient, 124 drag, 128 presliding, 132 viscous, 136 along x3, 148 pierce
//       x3, 160 pierce_force, 164 pierce_keep, 168 cap, 172 turn xyzw, 188 lever x3, 200 couple x3, 212 couple_stiffness,
//       216 grip_from, 220 grip_stiffness
//   bye (10), either end: force off, the devices are free
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "device/arm.h"
#include "exchange/force_patch.h"

namespace catgut {

constexpr uint16_t kBridgePort = 26720, kBridgeVersion = 2;
constexpr size_t kBridgeBytes = 256, kBridgePayload = 224;
using BridgeBytes = std::array<uint8_t, kBridgeBytes>;
using BridgePayload = std::array<uint8_t, kBridgePayload>;
using BridgeKey = std::array<uint8_t, 32>;

enum class BridgeKind : uint8_t { hello = 1, cookie, open, opened, refused, ask, info, sample, patch, bye };
constexpr size_t kBridgeKinds = 11;
enum BridgeRefusal : uint32_t { kOtherVersion = 1, kArmsTaken = 2 };

struct BridgeHead {
  BridgeKind kind = BridgeKind::hello;
  uint8_t arm = 0;
  uint16_t version = kBridgeVersion;
  uint64_t counter = 0;
};

// Received packets since the start, by result.
struct BridgeCounts {
  uint64_t accepted = 0;
  uint64_t garbage = 0;       // wrong size or magic
  uint64_t version = 0;       // another version's
  uint64_t forged = 0;        // the tag is not that of the key
  uint64_t invalid = 0;       // authentic, but with an invalid number, or of a kind that this side does not accept
  uint64_t unknown_peer = 0;  // another sender's
  uint64_t old = 0;           // repeated, overtaken, or expired
  uint64_t dropped() const { return garbage + version + forged + invalid + unknown_peer + old; }
};

enum class BridgeFault : uint8_t { none, garbage, version, invalid };
// Whether `size` bytes have the form of a packet; `head` is filled when the fault is none or version. Accepts any bytes.
BridgeFault read_head(const uint8_t* data, size_t size, BridgeHead& head);
inline bool is_handshake(BridgeKind k) { return k <= BridgeKind::refused; }

// --- sealed packets: no allocation; callable from any thread ---
void seal(const BridgeKey& key, const BridgeHead& head, const BridgePayload& payload, BridgeBytes& out);
bool unseal(const BridgeKey& key, const uint8_t* packet, BridgePayload& payload);  // false: forged

// --- the handshake ---
BridgeKey random_key();
bool mac_is_right(const BridgeKey& shared, const uint8_t* packet);
BridgeBytes refused_packet(const BridgeKey& shared, BridgeRefusal why);
uint32_t refused_why(const uint8_t* packet);

// The simulator's side. Each returns false for a packet that does not belong to this handshake.
struct BridgeCaller {
  BridgeKey shared{}, secret{}, own{}, cookie{};
};
void begin_call(BridgeCaller& c);  // a new key pair
BridgeBytes hello_packet(const BridgeCaller& c);
bool take_cookie(BridgeCaller& c, const uint8_t* packet);
BridgeBytes open_packet(const BridgeCaller& c);
bool take_opened(const BridgeCaller& c, const uint8_t* packet, BridgeKey& in, BridgeKey& out);

// The arm's side. `address`: whatever bytes identify the sender; now_ns: any clock of this process.
struct BridgeDoor {
  BridgeKey shared{}, secret = random_key();  // the secret makes cookies
};
BridgeBytes cookie_packet(const BridgeDoor& d, const uint8_t* hello, const void* address, size_t bytes, uint64_t now_ns);
bool cookie_is_right(const BridgeDoor& d, const uint8_t* open, const void* address, size_t bytes, uint64_t now_ns);
BridgeKey caller_key(const uint8_t* packet);  // S
BridgeBytes opened_packet(const BridgeDoor& d, const uint8_t* open, BridgeKey& in, BridgeKey& out);

// The key of a file: 32 bytes, or 64 hexadecimal digits; readable by its owner only. Throws InputError.
BridgeKey read_bridge_key(const std::string& file);
void write_bridge_key(const std::string& file);  // a new one, mode 600; never overwrites

// --- payloads; `false`: an invalid number ---
void write_info(const ArmInfo& info, BridgePayload& out);
bool read_info(const BridgePayload& in, ArmInfo& info);
void write_sample(const ArmSample& sample, const ArmForce& force, uint32_t faults, BridgePayload& out);
bool read_sample(const BridgePayload& in, ArmSample& sample, ArmForce& force, uint32_t& faults);
void write_patch(const ForcePatch& patch, BridgePayload& out);
bool read_patch(const BridgePayload& in, ForcePatch& patch);

}  // namespace catgut
