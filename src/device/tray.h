// SPDX-License-Identifier: Apache-2.0
// device/tray: the command of a single key, from the Snapshot. Pure; the host pushes the command for the next tick.
#pragma once
#include "exchange/command.h"
#include "exchange/snapshot.h"

namespace catgut {

// The next instrument on the tray, in the scene's order: swapped with the hand's, or taken by an empty hand. kind none:
// the tray is empty.
Command next_from_tray(const Snapshot& seen, size_t hand);
// A hand whose instrument holds something parks it, one with an instrument lays it down, an empty one takes the nearest one
// that is parked, or that an assistant holds on tissue. kind none: there is none.
Command park_or_take_up(const Snapshot& seen, size_t hand);

}  // namespace catgut
