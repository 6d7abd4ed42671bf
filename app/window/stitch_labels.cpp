// SPDX-License-Identifier: Apache-2.0
// app/window: see stitch_labels.h.
#include "window/stitch_labels.h"

#include <fmt/format.h>

#include <algorithm>

#include "exchange/strand.h"
#include "window/language.h"

namespace catgut {
namespace {

constexpr float kSame = 0.002f;  // [m] between a bite's end and its suture point

// A point of the tissue at rest, carried by the nearest particle of its wall.
Vec3 carried(const RestTissue& rest, const Snapshot& seen, uint32_t wall, Vec3 point) {
  const std::vector<Vec3>& particle = seen.topology.picture ? seen.topology.picture->particle_rest : rest.particle;
  const std::vector<uint8_t>& walls = seen.topology.picture ? seen.topology.picture->wall : rest.wall;
  size_t best = particle.size();
  float least = 1e30f;
  for (size_t i = 0; i < std::min({particle.size(), seen.particle.size(), seen.rotation.size()}); ++i) {
    if (i < walls.size() && walls[i] != wall) continue;
    if (const float d = length2(particle[i] - point); d < least) least = d, best = i;
  }
  return best < particle.size() ? seen.particle[best] + rotate(seen.rotation[best], point - particle[best]) : point;
}

std::string millimeters(float m) { return m < 0 ? "-" : fmt::format("{:.1f}", 1000 * m); }

}  // namespace

RestTissue rest_tissue(const PictureModel& picture) { return {picture.particle_rest, picture.wall}; }

std::vector<xr::StitchMark> stitch_marks(const StitchMap& map, const RestTissue& rest, const Snapshot& seen, BiteColor by) {
  std::vector<xr::StitchMark> out;
  for (size_t k = 0; k < map.bite.size(); ++k) {
    const StitchBite& b = map.bite[k];
    if (b.tick > seen.tick) break;
    xr::StitchMark mark;
    mark.at = {carried(rest, seen, b.wall, b.entry), carried(rest, seen, b.wall, b.exit)};
    float tension = -1;
    for (size_t end = 0; end < 2; ++end) {
      const SuturePointView* nearest = nullptr;
      for (size_t i = 0; i < suture_point_count(seen); ++i) {
        const SuturePointView& p = suture_point_at(seen, i);
        if (p.exit != (end == 1) || distance(p.position, mark.at[end]) > kSame) continue;
        if (!nearest || distance(p.position, mark.at[end]) < distance(nearest->position, mark.at[end])) nearest = &p;
      }
      if (!nearest) continue;
      mark.at[end] = nearest->position;
      tension = std::max({tension, nearest->tension_needle, nearest->tension_free});
    }
    mark.text[0] = fmt::format("{}: {} {}|{} mm", k + 1, tr("edge"), millimeters(b.entry_edge), millimeters(b.exit_edge));
    mark.text[1] = fmt::format("{} {}", tr("depth"), millimeters(b.depth));
    if (tension >= 0) mark.text[1] += fmt::format("  {:.2f} N", tension);
    bool known = false;
    const float part = bite_part(b, by, known);
    mark.color = known ? scale_color(part) : ImGui::GetColorU32(ImVec4{0.93f, 0.95f, 0.95f, 1});
    out.push_back(std::move(mark));
  }
  return out;
}

}  // namespace catgut
