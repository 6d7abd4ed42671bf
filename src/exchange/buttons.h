// SPDX-License-Identifier: Apache-2.0
// exchange/buttons: from the buttons of a device to commands. The physics reads commands only; a host that gets buttons calls
// this once per tick, with the Snapshot that the user sees. It decides which suture is meant, so that a replay needs no
// decision.
#pragma once
#include <cstddef>
#include <cstdint>

#include "exchange/command.h"
#include "exchange/snapshot.h"

namespace catgut {

// pressed: bits of ToolInput::buttons that went down since the last call.
void add_commands(CommandList& out, size_t hand, uint32_t pressed, const Snapshot& seen);

// The suture that a cut by this hand means: that of the needle in its jaws, else of the thread nearest to them.
uint32_t suture_to_cut(const Snapshot& seen, size_t hand);
// The suture that a new one replaces: that of the needle or thread in the hand's jaws, else the active one.
uint32_t suture_to_replace(const Snapshot& seen, size_t hand);

}  // namespace catgut
