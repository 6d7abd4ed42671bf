// SPDX-License-Identifier: Apache-2.0
// device: a device on another machine, or driven by a program in another language, over UDP. This is the simulator's
// side. The packets and their cryptography are in device/bridge_packet, the device server is runtime/arm_server
// (`catgut bridge`), or any program with that packet layout, such as samples/bridge_arm.py.
//
// The device server runs the 1 kHz loop: it sends a sample of each device, and evaluates the newest ForcePatch next to the
// motors. No force crosses the network, so delay makes the tissue older, not the spring unstable. A patch that is not renewed
// within 30 ms by the server's clock fades there; the simulator may crash at any moment.
#pragma once
#include <string>
#include <vector>

#include "device/arm.h"
#include "device/bridge_packet.h"

namespace catgut {

// A UDP socket for "HOST[:PORT]" ("[::1]:PORT" for IPv6 addresses), bound or connected to it; -1, and the reason. local: both
// ends are on this machine's loopback.
int bridge_socket(const std::string& where, bool bind_it, std::string& why, bool* local = nullptr);

struct BridgeOptions {
  std::string where;         // "HOST[:PORT]"; empty: CATGUT_BRIDGE when it is set, else this machine
  std::string key;           // file with the shared key; empty: CATGUT_BRIDGE_KEY; loopback needs none
  float patience = 0.25f;    // [s] for an answer
  float forget = 0.02f;      // [s] without a sample: the device is lost
  float again_after = 0.1f;  // [s] between hellos while it is lost
};
// The simulator's side. `reported` receives a line when there is no answer, or an unexpected one. It requests the peer's
// devices again whenever it falls silent, so that it may be restarted.
ArmPort open_bridge(const BridgeOptions& options, std::vector<std::string>& messages);
BridgeCounts bridge_counts(const ArmPort& port);  // of a port that open_bridge made

}  // namespace catgut
