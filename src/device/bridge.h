// SPDX-License-Identifier: Apache-2.0
// device: an arm that hangs on another machine, or is driven by a program in another language, over UDP. Here is the
// simulator's end; the packets and their cryptography are in device/bridge_packet, the arm's end is runtime/arm_server
// (`catgut bridge`), or whatever speaks that layout, as samples/bridge_arm.py does.
//
// The arm's end owns the millisecond: it sends a sample of each arm, and evaluates the newest ForcePatch at 1 kHz where the
// motors are. No force crosses the network, so its delay makes the tissue older, not the spring livelier. What is not renewed
// within 30 ms by the arm's clock fades there; the simulator may crash at any moment.
#pragma once
#include <string>
#include <vector>

#include "device/arm.h"
#include "device/bridge_packet.h"

namespace catgut {

// An UDP socket of "HOST[:PORT]" ("[::1]:PORT" for numbers of IPv6), bound to it or connected to it; -1, and why. local: both
// ends are on this machine's loopback.
int bridge_socket(const std::string& where, bool bind_it, std::string& why, bool* local = nullptr);

struct BridgeOptions {
  std::string where;         // "HOST[:PORT]"; empty: CATGUT_BRIDGE when it is set, else this machine
  std::string key;           // file with the key that both ends share; empty: CATGUT_BRIDGE_KEY; loopback needs none
  float patience = 0.25f;    // [s] for an answer
  float forget = 0.02f;      // [s] without a sample: the arm is lost
  float again_after = 0.1f;  // [s] between hellos while it is
};
// The simulator's end. `reported` gets a line when no one answers, or not as hoped. Its peer is asked for its arms
// again whenever they fall silent, so that it may be restarted.
ArmPort open_bridge(const BridgeOptions& options, std::vector<std::string>& messages);
BridgeCounts bridge_counts(const ArmPort& port);  // of a port that open_bridge made

}  // namespace catgut
