// SPDX-License-Identifier: Apache-2.0
// runtime: the arm's end of the bridge (device/bridge): runs the arms of this machine and serves them to one simulator
// elsewhere. It owns the millisecond and does not trust the other end: patches pass the same servo and limits as in a scene
// (haptic/servo). When they stop, the force is zero within 100 ms by this machine's clock, without a step beyond the slew
// limit. Each arm on its own.
//
// Who has not proved that he has the key gets at most as many bytes as he sent. Samples go out while valid packets come in, and
// for 200 ms after. Anything but the loopback needs a key.
//
// Receiving has a thread of its own; the driver's thread takes the newest patch, computes the force and sends the sample with
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
  std::string key;                   // file with the shared key; empty: none, on the loopback alone
  uint64_t (*clock)() = nullptr;     // [ns] null: wall_ns(); tests hand in their own
  float forget = 1;                  // [s] after which a silent simulator has lost the arms to the next one that asks
  float stream = 0.2f;               // [s] after the last valid packet for which samples are still sent
};

// What a patch that came over a network is worth at `now_ns`: its age counts from its arrival (the arm's clock; a simulator
// that falls silent is seen at once), and its period from the sample it was computed for, since that is how far the hand may
// have moved meanwhile. False: too old to be believed at all.
bool accept_patch(ForcePatch& patch, uint64_t now_ns);

class ArmServer {
 public:
  // Takes the port over, starts it, and serves its arms. Throws InputError when it cannot listen, has no key where one is
  // needed, or the arms do not start.
  ArmServer(ArmPort port, const ArmServerOptions& options);
  ~ArmServer();
  ArmServer(const ArmServer&) = delete;
  ArmServer& operator=(const ArmServer&) = delete;

  uint16_t port() const;            // that it listens on
  BridgeCounts counts() const;      // any thread
  uint64_t sent_bytes() const;      // any thread
  std::vector<std::string> news();  // what happened since the last call, a line each; one thread
  void stop();                      // force off, no more callbacks

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut
