// SPDX-License-Identifier: Apache-2.0
// device: Haply's Inverse3 and Minverse with a VerseGrip, through the maker's local service (JSON over a WebSocket). One
// connection serves both devices: every message has both forces, and its answer the state of both. The service applies a force
// once and idles the device when messages stop, so a crashed program leaves no force behind.
//
// A force responds to the state of the previous millisecond. Unlike the other backends this one allocates (text in, text out);
// the callback does not. The grip's first button is button 0; a device without a grip points forward and down.
#pragma once
#include "device/arm.h"

namespace catgut {

struct HaplyOptions {
  std::string where;      // "HOST[:PORT]"; empty: CATGUT_HAPLY if set, else 127.0.0.1:10001
  float patience = 0.5f;  // [s] for the connection and for the first message
  float forget = 0.02f;   // [s] without an answer: the devices are lost
  bool paced = true;      // false: as fast as the service answers, for test doubles
};

// The first two devices of the service, by their reported handedness. `reported` receives a line per problem. Both forms of
// the command are supported, that of services 3.1 to 3.4 ("values") and that of 3.5 ("vector"); the first message determines
// which one.
ArmPort open_haply(const HaplyOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
