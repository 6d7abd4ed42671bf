// SPDX-License-Identifier: Apache-2.0
// device/tray: which command a single key means, from what is seen. Pure; a host pushes the command for the next tick.
#pragma once
#include "exchange/command.h"
#include "exchange/snapshot.h"

namespace catgut {

// The next instrument on the tray, in the scene's order: swapped for what the hand has, or taken by an empty hand. kind none:
// the tray is empty.
Command next_from_tray(const Snapshot& seen, size_t hand);
// A hand that has an instrument parks it; an empty one takes up the parked instrument nearest to it. kind none: there is none.
Command park_or_take_up(const Snapshot& seen, size_t hand);

}  // namespace catgut
