// runtime: the arm's end of the bridge (device/bridge): runs the arms of this machine and lends them to one simulator
// elsewhere. It owns the millisecond and does not trust the other end: what comes in passes the same limits as in a scene
// (haptic/limiter), is believed for 20 ms by this machine's clock, and when nothing comes any more the force is zero within 100
// ms of the last sample that was answered, without a step beyond the slew limit. Each arm by itself.
//
// Receiving has a thread of its own; the driver's thread takes the newest command, works out the force and sends the sample
// with one call that never waits. No lock, no allocation, no logging there.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "device/bridge.h"

namespace catgut {

struct ArmServerOptions {
  std::string listen = "127.0.0.1";  // "HOST[:PORT]"; port 0: any that is free
  uint64_t (*clock)() = nullptr;     // [ns] null: wall_ns(); tests hand in their own
  float forget = 1;                  // [s] after which a silent simulator has lost the arms to the next one that asks
};

class ArmServer {
 public:
  // Takes the port over, starts it, and lends its arms. Throws InputError when it cannot listen, or the arms do not start.
  ArmServer(ArmPort port, const ArmServerOptions& options);
  ~ArmServer();
  ArmServer(const ArmServer&) = delete;
  ArmServer& operator=(const ArmServer&) = delete;

  uint16_t port() const;            // that it listens on
  BridgeCounts counts() const;      // any thread
  std::vector<std::string> news();  // what happened since the last call, a line each; one thread
  void stop();                      // force off, no more callbacks

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut
