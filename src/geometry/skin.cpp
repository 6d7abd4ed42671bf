// SPDX-License-Identifier: Apache-2.0
// geometry/skin: linear skinning of the visible mesh (paper 2.1). Reads particles, writes vertices.
#include "geometry/skin.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/check.h"

namespace catgut {

namespace {

// Points sorted into cubic cells, for the nearest-particle search at binding time.
class PointGrid {
 public:
  PointGrid(std::span<const Vec3> point, float cell) : point_(point) {
    low_ = high_ = point[0];
    for (Vec3 p : point) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y), std::max(high_.z, p.z)};
    }
    const Vec3 size = high_ - low_;
    // At most about a hundred cells per side: a stray particle far away must not use much memory.
    cell_ = std::max({cell, size.x / 100, size.y / 100, size.z / 100, 1e-9f});
    for (int k = 0; k < 3; ++k) cells_[k] = static_cast<int>(size[k] / cell_) + 1;
    start_.assign(static_cast<size_t>(cells_[0]) * cells_[1] * cells_[2] + 1, 0);
    for (Vec3 p : point) ++start_[index(p) + 1];
    for (size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
    order_.resize(point.size());
    std::vector<uint32_t> fill(start_.begin(), start_.end() - 1);
    for (uint32_t i = 0; i < point.size(); ++i) order_[fill[index(point[i])]++] = i;
  }

  // The up to five nearest points, by ascending (squared distance, index). Searches growing shells of cells.
  int nearest(Vec3 p, std::pair<float, uint32_t> found[5]) const {
    const int home[3] = {along(p.x, 0), along(p.y, 1), along(p.z, 2)};
    int count = 0;
    // Clamping into the box moves p at most by `outside`; a shell further than that plus the fifth distance cannot matter.
    const float outside =
        distance(p, {std::clamp(p.x, low_.x, high_.x), std::clamp(p.y, low_.y, high_.y), std::clamp(p.z, low_.z, high_.z)});
    const int last = std::max({cells_[0], cells_[1], cells_[2]});
    for (int shell = 0; shell <= last; ++shell) {
      const float reach = (shell - 1) * cell_ - outside;
      if (count == 5 && reach > 0 && found[4].first < reach * reach) break;
      for (int z = std::max(0, home[2] - shell); z <= std::min(cells_[2] - 1, home[2] + shell); ++z) {
        for (int y = std::max(0, home[1] - shell); y <= std::min(cells_[1] - 1, home[1] + shell); ++y) {
          const bool face = std::abs(z - home[2]) == shell || std::abs(y - home[1]) == shell;
          const int step = face || shell == 0 ? 1 : 2 * shell;
          for (int x = home[0] - shell; x <= home[0] + shell; x += step) {
            if (x < 0 || x >= cells_[0]) continue;
            const size_t c = (static_cast<size_t>(z) * cells_[1] + y) * cells_[0] + x;
            for (uint32_t i = start_[c]; i < start_[c + 1]; ++i)
              insert({length2(point_[order_[i]] - p), order_[i]}, found, count);
          }
        }
      }
    }
    return count;
  }

 private:
  static void insert(std::pair<float, uint32_t> candidate, std::pair<float, uint32_t> found[5], int& count) {
    if (count == 5 && !(candidate < found[4])) return;
    int at = count < 5 ? count++ : 4;
    for (; at > 0 && candidate < found[at - 1]; --at) found[at] = found[at - 1];
    found[at] = candidate;
  }
  int along(float x, int k) const {
    const float t = (x - low_[k]) / cell_;
    return t < 0 ? 0 : t >= static_cast<float>(cells_[k]) ? cells_[k] - 1 : static_cast<int>(t);
  }
  size_t index(Vec3 p) const {
    return (static_cast<size_t>(along(p.z, 2)) * cells_[1] + along(p.y, 1)) * cells_[0] + along(p.x, 0);
  }

  std::span<const Vec3> point_;
  Vec3 low_, high_;
  float cell_;
  int cells_[3];
  std::vector<uint32_t> start_, order_;
};

}  // namespace

void bind_skin(VisibleMesh& mesh, std::span<const Vec3> particle_rest, float influence, float falloff) {
  CATGUT_CHECK(!particle_rest.empty() && influence > 0 && falloff >= 0);
  const size_t n = mesh.position.size();
  mesh.skin_particle.assign(n, {0, 0, 0, 0});
  mesh.skin_weight.assign(n, {1, 0, 0, 0});
  const PointGrid grid(particle_rest, 0.5f * influence);
  for (size_t v = 0; v < n; ++v) {
    std::pair<float, uint32_t> found[5];
    const int count = grid.nearest(mesh.position[v], found);
    float reach = influence;
    if (count == 5) reach = std::min(reach, std::sqrt(found[4].first));
    float sum = 0;
    std::array<float, 4> weight{};
    for (int k = 0; k < std::min(count, 4); ++k) {
      const float d = std::sqrt(found[k].first);
      weight[k] = d < reach ? portable::pow(1 - d / reach, falloff) : 0.0f;
      sum += weight[k];
    }
    auto& slot = mesh.skin_particle[v];
    slot.fill(found[0].second);
    if (!(sum > 1e-6f)) continue;  // none in reach: the nearest only
    for (int k = 0; k < std::min(count, 4); ++k) {
      mesh.skin_weight[v][k] = weight[k] / sum;
      if (weight[k] > 0) slot[k] = found[k].second;
    }
  }
}

void skin(const VisibleMesh& mesh, std::span<const Vec3> particle_rest, std::span<const Vec3> particle,
          std::span<const Quat> rotation, std::span<Vec3> position, std::span<Vec3> normal) {
  CATGUT_CHECK(position.size() == mesh.position.size() && normal.size() == mesh.position.size());
  CATGUT_CHECK(particle.size() >= particle_rest.size() && rotation.size() >= particle_rest.size());
  // Each particle's motion as an affine map (matrix columns and translation), so that a vertex blends only twelve numbers.
  struct Motion {
    float m[12];
  };
  thread_local std::vector<Motion> motion;  // kept between frames: no allocation during a run
  motion.resize(particle_rest.size());
  for (size_t i = 0; i < particle_rest.size(); ++i) {
    const Quat q = rotation[i];
    const Vec3 x = rotate(q, {1, 0, 0}), y = rotate(q, {0, 1, 0}), z = rotate(q, {0, 0, 1});
    const Vec3 shift = particle[i] - rotate(q, particle_rest[i]);
    motion[i] = {{x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, shift.x, shift.y, shift.z}};
  }
  for (size_t v = 0; v < position.size(); ++v) {
    const auto& slot = mesh.skin_particle[v];
    const auto& weight = mesh.skin_weight[v];
    float b[12] = {};
    for (int k = 0; k < 4; ++k) {
      const float* m = motion[slot[k]].m;
      for (int j = 0; j < 12; ++j) b[j] += weight[k] * m[j];
    }
    const Vec3 p = mesh.position[v], n = mesh.normal[v];
    const Vec3 x{b[0], b[1], b[2]}, y{b[3], b[4], b[5]}, z{b[6], b[7], b[8]};
    position[v] = Vec3{b[9], b[10], b[11]} + x * p.x + y * p.y + z * p.z;
    normal[v] = normalized(x * n.x + y * n.y + z * n.z, n);
  }
}

}  // namespace catgut
