// SPDX-License-Identifier: Apache-2.0
// bench/thread: what close-ups (knot_pictures) and films (knot_films) of knots share: the four kinds, the drawn thread, where
// to look from, and the line that says what thread/observe sees.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "render/capsule_picture.h"
#include "thread/observe.h"
#include "validation/knot_scenes.h"
#include "validation/tool_ties.h"

namespace catgut {

struct KnotKind {
  const char* name;
  const char* file;  // of its film, without folder and ending
  validation::Throws laid;
  validation::Tie tied;
  uint64_t seed;  // of the tie in the film, at 0.2 m/s: one that is not flagged as sliding at the end
};
std::array<KnotKind, 4> knot_kinds();

constexpr Color kFirstStrand{45, 105, 220, 255}, kSecondStrand{236, 170, 40, 255}, kTissueColor{226, 176, 166, 255};

// A smooth curve through the nodes. Node 0 to `middle` has the first color, the rest the second.
void add_thread(std::vector<DrawnCapsule>& to, const thread::State& state, uint32_t middle, float radius);

// Where strands bear on each other; radius 0: nowhere.
struct KnotPlace {
  Vec3 center;
  float radius = 0;  // [m] that holds nearly all of it
};
KnotPlace knot_place(const thread::Settings& settings, const thread::State& state);

// The direction, within 50 degrees of `front`, that shows most of the thread near the center: fewest strands lie hidden behind
// others or behind what is around.
Vec3 clearest_view(std::span<const DrawnCapsule> thread, std::span<const DrawnCapsule> around, const KnotPlace& place,
                   Vec3 front, Vec3 up);

// "square, 2 throws, 2 wraps, 100 %": the last is the confidence.
std::string seen_text(const thread::SeenKnot& seen);

}  // namespace catgut
