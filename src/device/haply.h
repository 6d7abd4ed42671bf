// SPDX-License-Identifier: Apache-2.0
// device: Haply's Inverse3 and Minverse with a VerseGrip, through the maker's local service (JSON over a WebSocket). One line
// to the service serves both arms: every message carries both forces and is answered by the state of both. The service applies
// a force once and returns the arm to idle when messages stop, so a program that dies leaves none behind.
//
// A force answers the state of the millisecond before. Unlike the other drivers this one allocates (text in, text out); the
// callback, unchanged, does not. The grip's first button is button 0; an arm without a grip points forward and down.
#pragma once
#include "device/arm.h"

namespace catgut {

struct HaplyOptions {
  std::string where;      // "HOST[:PORT]"; empty: CATGUT_HAPLY when it is set, else 127.0.0.1:10001
  float patience = 0.5f;  // [s] for the line and for the first message
  float forget = 0.02f;   // [s] without an answer: the arms are lost
  bool paced = true;      // false: as fast as the service answers, for doubles
};

// The first two arms of the service, by the handedness it says. `reported` gets a line for whatever is missing. Both forms of
// the command are known, that of services 3.1 to 3.4 ("values") and that of 3.5 ("vector"); the first message reports which it
// is.
ArmPort open_haply(const HaplyOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
