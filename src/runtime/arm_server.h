// SPDX-License-Identifier: Apache-2.0
// runtime: the device server of the bridge (device/bridge): runs the devices of this machine and serves them to one remote
// simulator. It runs the 1 kHz loop and does not trust the client: patches pass the same servo and limits as in a scene
// (haptic/servo). When they stop, the force is zero within 100 ms by this machine's clock, without a step beyond the slew
// limit. Each device independently.
//
// An unauthenticated sender gets at most as many bytes as it sent. Samples are sent while valid packets arrive, and
// for 200 ms after. Any address but loopback requires a key.
//
// Receiving has its own thread; the device thread reads the newest patch, computes the force and sends the sample with
// one call that never waits. No lock, no allocation, no logging there.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "device/bridge.h"

namespace catgut {

struct ArmServerOptions {
  std::string listen = "127.0.0.1";  // "HOST[:PORT]"; port 0: any that is free
  std::string key;                   // file with the shared key; empty: none, only on loopback
  uint64_t (*clock)() = nullptr;     // [ns] null: wall_ns(); tests pass their own
  float forget = 1;                  // [s] after which a silent simulator loses the devices to the next one that asks
  float stream = 0.2f;               // [s] after the last valid packet for which samples are still sent
};

// Validity of a patch received over a network at `now_ns`. Its age counts from its arrival (server clock; this detects a
// silent simulator at once). Its period, in which the hand may have moved, counts from the sample it was computed for.
// False: expired.
bool accept_patch(ForcePatch& patch, uint64_t now_ns);

// Checks address and key file of ArmServerOptions before any device is opened. Throws InputError.
void check_listen(const std::string& listen, const std::string& key);

class ArmServer {
 public:
  // Takes ownership of the port, starts it, and serves its devices. Throws InputError if it cannot listen, lacks a required
  // key, or the devices do not start.
  ArmServer(ArmPort port, const ArmServerOptions& options);
  ~ArmServer();
  ArmServer(const ArmServer&) = delete;
  ArmServer& operator=(const ArmServer&) = delete;

  uint16_t port() const;            // listening port
  BridgeCounts counts() const;      // callable from any thread
  uint64_t sent_bytes() const;      // callable from any thread
  std::vector<std::string> news();  // events since the last call, a line each; one thread
  void stop();                      // force off, no more callbacks

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut
