// device: an arm that hangs on another machine, or is driven by a program in another language, over UDP. Here are the packets
// and the simulator's end; the arm's end is runtime/arm_server (`catgut bridge`), or whatever speaks the layout below, as
// samples/bridge_arm.py does.
//
// The arm's end owns the millisecond: it sends a sample of each arm, the simulator answers each with a force, and a force that
// answers a sample older than its expiry is taken off there, by the arm's own clock. The simulator may crash at any moment.
// Nothing is encrypted: for a network of your own.
//
// Every packet has 256 bytes, little endian, unused bytes zero:
//     0 u32 magic 0x42474143 ("CAGB")       16 u64 sequence: grows with every packet of its sender, whatever the kind
//     4 u16 version 1                       24 u64 time [ns] on the sender's clock
//     6 u8  kind    7 u8 arm: 0 right, 1 left     252 u32 CRC-32 (zlib's) of the bytes before it
//     8 u64 session: a number that the simulator draws, in every packet that belongs to it
// hello (1), simulator: "I want the arms"; answered by an info for each arm, or by refused.
// info (2): 32 u32 present; f32: 36 force, 40 continuous, 44 stiffness, 48 damping, 52 least x3, 64 most x3 [m];
//     char x40, ending in zero: 76 name, 116 model, 156 serial, 196 driver
// sample (3): 32 u32 1 ready + 2 forced off; 36 u32 buttons; f32: 40 position x3 [m], 52 quaternion xyzw, 68 velocity x3 [m/s],
//     80 warmth, 84 force on the motors x3 [N]
// command (4): f32: 32 force x3 [N], 44 expiry [s]; 48 u64 time of the sample it answers
// refused (5): 32 u32 1 this version is not spoken here (the header says which is), 2 another simulator has the arms
// bye (6), either end: force off, the arms are free.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "device/arm.h"

namespace catgut {

constexpr uint16_t kBridgePort = 26720, kBridgeVersion = 1;
constexpr size_t kBridgeBytes = 256;
using BridgeBytes = std::array<uint8_t, kBridgeBytes>;

enum class BridgeKind : uint8_t { hello = 1, info, sample, command, refused, bye };
enum BridgeRefusal : uint32_t { kOtherVersion = 1, kArmsTaken = 2 };

struct BridgeHead {
  BridgeKind kind = BridgeKind::hello;
  uint8_t arm = 0;
  uint16_t version = kBridgeVersion;
  uint64_t session = 0, sequence = 0, time_ns = 0;
};
struct BridgeCommand {
  Vec3 force;            // [N] arm frame
  float expiry = 0.02f;  // [s] of age of the sample that is answered
  uint64_t answers_ns = 0;
};

// What came in since the beginning, by what was done with it.
struct BridgeCounts {
  uint64_t accepted = 0;
  uint64_t garbage = 0;   // wrong size, magic or checksum
  uint64_t version = 0;   // another version's
  uint64_t nonsense = 0;  // well packed, but an unknown kind, an arm beyond two, a number that is none
  uint64_t stranger = 0;  // another sender's, or of another session
  uint64_t old = 0;       // a sequence number that was there already
  uint64_t dropped() const { return garbage + version + nonsense + stranger + old; }
};

enum class BridgeFault : uint8_t { none, garbage, version, nonsense };

// Whether `size` bytes are a packet; `head` is filled when the fault is none or version. Any bytes may be handed in.
BridgeFault read_bridge(const uint8_t* data, size_t size, BridgeHead& head);
void count_fault(BridgeCounts& counts, BridgeFault fault);

// Packets, ready to send. None of these allocates but read_info.
void write_plain(BridgeBytes& out, const BridgeHead& head, uint32_t word = 0);  // hello, refused (with why), bye
void write_info(BridgeBytes& out, const BridgeHead& head, const ArmInfo& info);
void write_sample(BridgeBytes& out, const BridgeHead& head, const ArmSample& sample, Vec3 force);
void write_command(BridgeBytes& out, const BridgeHead& head, const BridgeCommand& command);
// Of a packet that read_bridge found good and of that kind.
uint32_t read_word(const uint8_t* packet);
ArmInfo read_info(const uint8_t* packet);
ArmSample read_sample(const uint8_t* packet, Vec3& force);
BridgeCommand read_command(const uint8_t* packet);

// An UDP socket of "HOST[:PORT]" ("[::1]:PORT" for numbers of IPv6), bound to it or connected to it; -1, and why.
int bridge_socket(const std::string& where, bool bind_it, std::string& why);

struct BridgeOptions {
  std::string where;         // "HOST[:PORT]"; empty: CATGUT_BRIDGE when it is set, else this machine
  float patience = 0.25f;    // [s] for an answer
  float forget = 0.02f;      // [s] without a sample: the arm is lost
  float again_after = 0.1f;  // [s] between hellos while it is
};
// The simulator's end. `told` gets a line when nobody answers, or not as hoped. Whoever answers is asked for its arms again
// whenever they fall silent, so that it may be restarted.
ArmPort open_bridge(const BridgeOptions& options, std::vector<std::string>& told);
BridgeCounts bridge_counts(const ArmPort& port);  // of a port that open_bridge made

}  // namespace catgut
