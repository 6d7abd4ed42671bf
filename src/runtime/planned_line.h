// SPDX-License-Identifier: Apache-2.0
// runtime: the line of the planned cut as it lies on the drawn tissue, for display: the circle from which the deviation of a
// cut is measured (sim/cutting), carried by the tissue.
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "sim/cutting.h"
#include "sim/scene.h"

namespace catgut {

struct LinePiece {
  Vec3 a, b, out;  // [m], [m], unit: away from the tissue
};

class PlannedLine {
 public:
  PlannedLine() = default;  // none
  PlannedLine(const SceneSpec& scene, const PictureModel& picture);
  // On the outer face, in no order, without the places that the pen has burnt. picture: as in the constructor.
  const std::vector<LinePiece>& on(const PictureModel& picture, const Snapshot& seen);

 private:
  // Where a triangle crosses the line: on two of its edges.
  struct Crossing {
    uint32_t triangle = 0;
    std::array<std::array<uint32_t, 2>, 2> edge{};  // vertices
    std::array<float, 2> part{};                    // of the way from the first to the second
  };
  void find(const PictureModel& picture);

  std::optional<CutLine> line_;
  DividedPicture found_on_;  // false: as built
  std::vector<Crossing> crossing_;
  std::vector<LinePiece> piece_;
};

}  // namespace catgut
