// SPDX-License-Identifier: Apache-2.0
// core/id: typed handles to rows of a table. A row that is reused gets the next generation, so that an old handle no longer
// matches.
#pragma once
#include <cstdint>
#include <type_traits>

namespace catgut {

// Four bytes without padding: an id is saved, hashed and sent as its bytes. A default constructed id is empty.
template <typename Tag>
struct Id {
  static constexpr uint16_t kNone = 0xffff;
  uint16_t index = kNone;
  uint16_t generation = 0;

  constexpr explicit operator bool() const { return index != kNone; }
  friend constexpr bool operator==(Id a, Id b) { return a.index == b.index && a.generation == b.generation; }
};

using HandId = Id<struct HandTag>;              // of TickInput::hand
using InstrumentId = Id<struct InstrumentTag>;  // of the scene's instruments
using SutureId = Id<struct SutureTag>;          // needle and strand
using BodyId = Id<struct BodyTag>;              // soft body of the scene

static_assert(sizeof(HandId) == 4 && std::is_trivially_copyable_v<HandId>);

}  // namespace catgut
