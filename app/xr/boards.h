// SPDX-License-Identifier: Apache-2.0
// app/xr: where panels stand in the room of a headset's wearer. Pure. A board holds all panels; a caption repeats the part of
// it that belongs to the present step beside the work. Neither lies between the eyes and the field, at any table height.
#pragma once
#include "render/eyes.h"
#include "xr/place.h"

namespace catgut::xr {

// [m] room: the eyes of a wearer who stands where the place was set.
Vec3 eyes_at(const Place& place);

// stand: where the wearer stands; its pose is in the room, its board in the world of `place`.
// working: instruments are in use, and the board is right of the field; else it is above it.
Board board_at(const Place& stand, const Place& place, bool working);

// The stand that a board belongs to while the wearer walks around the field: the board then stands on the far side of it, so
// that it is never seen from behind and never lies between the eyes and the field. It follows in quarter turns. turn:
// [quarters] kept by the caller, 0 at first. head: [m] room.
Place walked_stand(const Place& stand, int& turn, Vec3 head);

// part: of the board's picture [pixels], shown behind the field and above it.
Board caption_at(const Place& stand, const Place& place, const std::array<float, 4>& part);

// [degrees] of a line of text on a board, seen from the eyes at rest.
float text_degrees(const Board& board, const Place& stand, const Place& place);
// [degrees] between the field's center and the nearest point of a board, seen from the eyes at rest.
float degrees_from_field(const Board& board, const Place& stand, const Place& place);

}  // namespace catgut::xr
