// SPDX-License-Identifier: Apache-2.0
// geometry/remesh: resamples a surface to an exact number of evenly spaced vertices.
#include "geometry/remesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/check.h"
#include "geometry/closest.h"
#include "geometry/editable_mesh.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

// A rim of the original surface as a closed curve over its arc length.
class RimCurve {
 public:
  RimCurve(const TriangleMesh& mesh, const std::vector<uint32_t>& loop) {
    for (uint32_t v : loop) point_.push_back(mesh.position[v]);
    arc_.push_back(0);
    for (size_t i = 0; i < point_.size(); ++i)
      arc_.push_back(arc_.back() + distance(point_[i], point_[(i + 1) % point_.size()]));
  }
  double length() const { return arc_.back(); }
  double arc(size_t i) const { return arc_[i]; }
  // The distance from u to v along the curve, -length/2 .. length/2.
  double way(double u, double v) const { return std::remainder(v - u, length()); }
  double wrapped(double u) const { return u - std::floor(u / length()) * length(); }
  Vec3 at(double u) const {
    u = wrapped(u);
    const auto above = std::upper_bound(arc_.begin(), arc_.end(), u);
    const size_t i = std::clamp<size_t>(static_cast<size_t>(above - arc_.begin()), 1, point_.size()) - 1;
    const double span = arc_[i + 1] - arc_[i];
    return lerp(point_[i], point_[(i + 1) % point_.size()], span > 0 ? static_cast<float>((u - arc_[i]) / span) : 0.0f);
  }

 private:
  std::vector<Vec3> point_;
  std::vector<double> arc_;
};

class Remesher {
 public:
  Remesher(const TriangleMesh& mesh, size_t vertices, const std::string& where)
      : where_(where),
        tree_(mesh),
        edit_(mesh),
        rim_(mesh.position.size(), -1),
        at_(mesh.position.size(), 0),
        target_(vertices) {
    for (const auto& loop : boundary_loops(mesh.triangle)) {
      for (size_t i = 0; i < loop.size(); ++i) { rim_[loop[i]] = static_cast<int>(curve_.size()); }
      curve_.emplace_back(mesh, loop);
      for (size_t i = 0; i < loop.size(); ++i) at_[loop[i]] = curve_.back().arc(i);
      on_rim_.push_back(loop.size());
    }
    edge_ = static_cast<float>(std::sqrt(2 * surface_area(mesh) / (1.7320508 * static_cast<double>(vertices))));
  }

  TriangleMesh run() {
    fill_queue();
    reach_target();
    constexpr int rounds = 12;
    for (int round = 0; round < rounds; ++round) {
      if (round < rounds - 4) {
        fill_queue();
        even_out();
        reach_target();
      }
      flip_edges(round >= rounds - 3);
      for (int k = 0; k < 4; ++k) {
        slide_rims(round < rounds - 3 ? 0.5 : 1.0);
        slide_inside();
      }
    }
    flip_edges(true);
    return edit_.finish();
  }

 private:
  using Edge = std::pair<uint32_t, uint32_t>;

  void fill_queue() {
    queue_.clear();
    length_.clear();
    for (const Edge& e : edit_.edges()) enqueue(e);
  }
  void enqueue(Edge e) {
    const float l = distance(edit_.position[e.first], edit_.position[e.second]);
    length_[e] = l;
    queue_.insert({l, e});
  }
  void forget(uint32_t v) {
    for (uint32_t u : edit_.neighbors(v)) {
      const auto known = length_.find(std::minmax(u, v));
      if (known == length_.end()) continue;
      queue_.erase({known->second, known->first});
      length_.erase(known);
    }
  }
  void learn(uint32_t v) {
    for (uint32_t u : edit_.neighbors(v)) {
      if (!length_.count(std::minmax(u, v))) enqueue(std::minmax(u, v));
    }
  }

  void split(Edge e) {
    const auto [a, b] = e;
    const bool rim = edit_.rim_edge(a, b);
    Vec3 p = (edit_.position[a] + edit_.position[b]) * 0.5f;
    int curve = -1;
    double at = 0;
    if (rim) {
      curve = rim_[a];
      at = curve_[curve].wrapped(at_[a] + 0.5 * curve_[curve].way(at_[a], at_[b]));
      p = curve_[curve].at(at);
      ++on_rim_[curve];
    } else {
      p = tree_.nearest(p).point;
    }
    forget(a);
    const uint32_t m = edit_.split(a, b, p);
    rim_.push_back(curve);
    at_.push_back(at);
    learn(a);
    learn(m);
  }

  bool collapse(Edge e) {
    auto [a, b] = e;
    if (edit_.on_rim(b) && !edit_.on_rim(a)) std::swap(a, b);
    Vec3 p = edit_.position[a];  // on a fixed rim
    double at = at_[a];
    size_t left = 0;
    if (edit_.on_rim(a) && edit_.on_rim(b)) {
      const RimCurve& c = curve_[rim_[a]];
      at = c.wrapped(at_[a] + 0.5 * c.way(at_[a], at_[b]));
      p = c.at(at);
      left = on_rim_[rim_[a]];
    } else if (!edit_.on_rim(a)) {
      p = tree_.nearest((edit_.position[a] + edit_.position[b]) * 0.5f).point;
    }
    const bool both_rim = edit_.on_rim(a) && edit_.on_rim(b);
    forget(a);
    forget(b);
    if (!edit_.collapse(a, b, p, left)) {
      learn(a);
      learn(b);
      return false;
    }
    at_[a] = at;
    if (both_rim) --on_rim_[rim_[a]];
    learn(a);
    return true;
  }

  // Collapses the shortest possible edge, or splits the longest, until the count is right.
  void reach_target() {
    while (edit_.vertices() < target_) split(queue_.rbegin()->second);
    while (edit_.vertices() > target_) {
      if (!collapse_shortest(3e38f)) {
        throw InputError(
            where_, fmt::format("{} vertices cannot carry this surface ({} is as few as it gets)", target_, edit_.vertices()),
            "ask for more particles or simplify the surface");
      }
    }
  }

  bool collapse_shortest(float below) {
    bool done = false;
    // Edges that refuse are skipped; they may succeed later when their surroundings have changed.
    for (auto it = queue_.begin(); !done && it != queue_.end() && it->first < below;) {
      const auto entry = *it;
      done = collapse(entry.second);
      if (!done) it = std::next(queue_.find(entry));
    }
    return done;
  }

  void even_out() {
    // At most a tenth of the vertices per round: the smoothing between rounds shows which edges are really too long.
    const size_t most = target_ / 10 + 1;
    for (size_t i = 0; i < most && !queue_.empty() && queue_.rbegin()->first > 1.4f * edge_; ++i)
      split(queue_.rbegin()->second);
    for (size_t i = 0; i < most; ++i) {
      if (!collapse_shortest(0.7f * edge_)) break;
    }
  }

  void flip_edges(bool delaunay) {
    for (int pass = 0; pass < 3; ++pass) {
      bool any = false;
      for (const auto& [a, b] : edit_.edges()) {
        uint32_t c[2];
        if (edit_.opposite(a, b, c) != 2) continue;  // on a rim, or removed by an earlier flip
        if (delaunay ? cot_sum(a, b, c) >= -1e-4 : !fewer_odd(a, b, c)) continue;
        any = edit_.flip(a, b) || any;
      }
      if (!any) break;
    }
  }
  int off(uint32_t v, int change) const {
    const int d = static_cast<int>(edit_.neighbors(v).size()) + change - (edit_.on_rim(v) ? 4 : 6);
    return d * d;
  }
  bool fewer_odd(uint32_t a, uint32_t b, const uint32_t c[2]) const {
    return off(a, -1) + off(b, -1) + off(c[0], 1) + off(c[1], 1) < off(a, 0) + off(b, 0) + off(c[0], 0) + off(c[1], 0);
  }
  // Sum of the cotangents of the angles opposite the edge; negative when they add to more than a straight angle.
  double cot_sum(uint32_t a, uint32_t b, const uint32_t c[2]) const {
    double sum = 0;
    for (int k = 0; k < 2; ++k) {
      const Vec3 u = edit_.position[a] - edit_.position[c[k]], v = edit_.position[b] - edit_.position[c[k]];
      sum += dot(u, v) / std::max(length(cross(u, v)), 1e-20f);
    }
    return sum;
  }

  void slide_inside() {
    for (uint32_t v = 0; v < edit_.slots(); ++v) {
      if (!edit_.alive(v) || edit_.on_rim(v)) continue;
      const auto next = edit_.neighbors(v);
      Vec3 middle;
      for (uint32_t u : next) middle += edit_.position[u] / static_cast<float>(next.size());
      const Vec3 n = edit_.normal(v), step = middle - edit_.position[v];
      const Vec3 p = tree_.nearest(edit_.position[v] + (step - n * dot(n, step)) * 0.7f).point;
      if (edit_.can_move(v, p)) edit_.position[v] = p;
    }
  }

  void slide_rims(double part) {
    if (curve_.empty()) return;
    std::vector<uint32_t> number, slot(edit_.vertices());
    const TriangleMesh now = edit_.finish(&number);
    for (uint32_t v = 0; v < number.size(); ++v) {
      if (number[v] != ~0u) slot[number[v]] = v;
    }
    for (const auto& loop : boundary_loops(now.triangle)) {
      const RimCurve& c = curve_[rim_[slot[loop[0]]]];
      const double step = c.length() / static_cast<double>(loop.size()), start = at_[slot[loop[0]]];
      double shift = 0;
      for (size_t i = 0; i < loop.size(); ++i) {
        shift += c.way(start + step * static_cast<double>(i), at_[slot[loop[i]]]) / static_cast<double>(loop.size());
      }
      for (size_t i = 0; i < loop.size(); ++i) {
        const uint32_t v = slot[loop[i]];
        const double want = start + shift + step * static_cast<double>(i);
        const double u = c.wrapped(at_[v] + part * c.way(at_[v], want));
        if (!edit_.can_move(v, c.at(u))) continue;
        at_[v] = u;
        edit_.position[v] = c.at(u);
      }
    }
  }

  std::string where_;
  SurfaceTree tree_;
  EditableMesh edit_;
  std::vector<RimCurve> curve_;
  std::vector<size_t> on_rim_;  // live vertices on each curve
  std::vector<int> rim_;        // curve of each vertex slot, -1 inside
  std::vector<double> at_;      // [m] its place on the curve
  size_t target_;
  float edge_ = 0;  // [m] of equilateral triangles
  std::set<std::pair<float, Edge>> queue_;
  std::map<Edge, float> length_;
};

}  // namespace

TriangleMesh remesh(const TriangleMesh& mesh, size_t vertices, const std::string& where) {
  CATGUT_CHECK(!mesh.triangle.empty());
  return Remesher(mesh, vertices, where).run();
}

MeshQuality mesh_quality(const TriangleMesh& mesh) {
  MeshQuality q{180, 0, 3e38f, 0, 0};
  double angles = 0, lengths = 0;
  for (const Triangle& t : mesh.triangle) {
    float least = kPi;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = mesh.position[t[k]];
      const Vec3 u = mesh.position[t[(k + 1) % 3]] - p, v = mesh.position[t[(k + 2) % 3]] - p;
      least = std::min(least, portable::acos(std::clamp(dot(normalized(u), normalized(v)), -1.0f, 1.0f)));
      const float l = length(u);
      q.shortest = std::min(q.shortest, l);
      q.longest = std::max(q.longest, l);
      lengths += l;
    }
    q.least_angle = std::min(q.least_angle, least * 180 / kPi);
    angles += least * 180 / kPi;
  }
  q.mean_least_angle = static_cast<float>(angles / static_cast<double>(mesh.triangle.size()));
  q.mean = static_cast<float>(lengths / static_cast<double>(3 * mesh.triangle.size()));
  return q;
}

}  // namespace catgut
