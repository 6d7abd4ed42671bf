// SPDX-License-Identifier: Apache-2.0
// render/shapes: the building blocks; see shapes.h. Tools and needle are in instruments.cpp, drape and gauze in cloth.cpp.
#include "render/shapes.h"

namespace catgut {
namespace {

// Fills normals of vertices from `first` on with the area-weighted mean of their triangles from `first_triangle` on.
void smooth_normals(Shape& shape, size_t first, size_t first_triangle) {
  for (size_t v = first; v < shape.position.size(); ++v) shape.normal[v] = {};
  for (size_t t = first_triangle; t < shape.triangle.size(); ++t) {
    const auto [a, b, c] = shape.triangle[t];
    const Vec3 n = cross(shape.position[b] - shape.position[a], shape.position[c] - shape.position[a]);
    shape.normal[a] += n;
    shape.normal[b] += n;
    shape.normal[c] += n;
  }
  for (size_t v = first; v < shape.position.size(); ++v) shape.normal[v] = normalized(shape.normal[v], {0, 1, 0});
}

void add_vertex(Shape& shape, Vec3 p, Vec3 n, Vec3 t, float u, float v, Vec3 color) {
  shape.position.push_back(p);
  shape.normal.push_back(n);
  shape.tangent.push_back(t);
  shape.uv.push_back({u, v});
  shape.color.push_back(color);
}

// Two triangles per step between the rings of `sides` corners that start at a and b (b further along the axis).
void join_rings(Shape& shape, uint32_t a, uint32_t b, int sides, int stride) {
  for (int k = 0; k < sides; ++k) {
    const uint32_t i = uint32_t(k), j = uint32_t(stride == sides ? (k + 1) % sides : k + 1);
    shape.triangle.push_back({a + i, a + j, b + i});
    shape.triangle.push_back({a + j, b + j, b + i});
  }
}

}  // namespace

Vec3 srgb(int r, int g, int b) {
  const auto linear = [](int v) {
    const float c = float(v) / 255;
    return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
  };
  return {linear(r), linear(g), linear(b)};
}

void add_tube(Shape& shape, std::span<const Vec3> center, std::span<const float> radius, int sides, Vec3 color) {
  if (center.size() < 2) return;
  const uint32_t first = uint32_t(shape.position.size());
  Vec3 along = normalized(center[1] - center[0], {0, 0, 1});
  Vec3 side = any_perpendicular(along);
  float u = 0;
  for (size_t i = 0; i < center.size(); ++i) {
    const Vec3 next = i + 1 < center.size() ? center[i + 1] : center[i], last = i > 0 ? center[i - 1] : center[i];
    along = normalized(next - last, along);
    side = normalized(side - along * dot(side, along), any_perpendicular(along));
    const Vec3 up = cross(along, side);
    if (i > 0) u += distance(center[i], center[i - 1]);
    for (int k = 0; k <= sides; ++k) {
      const float a = 2 * kPi * float(k) / float(sides);
      const Vec3 n = side * std::cos(a) + up * std::sin(a);
      add_vertex(shape, center[i] + radius[i] * n, n, along, u, float(k) / float(sides), color);
    }
  }
  const uint32_t ring = uint32_t(sides + 1);
  for (uint32_t i = 0; i + 1 < uint32_t(center.size()); ++i)
    join_rings(shape, first + i * ring, first + (i + 1) * ring, sides, sides + 1);
  for (const bool end : {false, true}) {
    const size_t i = end ? center.size() - 1 : 0;
    const Vec3 out = end ? normalized(center[i] - center[i - 1]) : normalized(center[0] - center[1]);
    const uint32_t from = first + uint32_t(i) * ring, middle = uint32_t(shape.position.size());
    add_vertex(shape, center[i], out, any_perpendicular(out), end ? u : 0, 0, color);
    for (uint32_t k = 0; k < uint32_t(sides); ++k) {
      if (end) shape.triangle.push_back({from + k, from + k + 1, middle});
      else shape.triangle.push_back({from + k + 1, from + k, middle});
    }
  }
}

void add_loft(Shape& shape, std::span<const Section> sections, Vec3 color, float squareness) {
  constexpr int sides = 20;
  const uint32_t first = uint32_t(shape.position.size());
  const size_t first_triangle = shape.triangle.size();
  // Sections may be in either order along z; the corners' order follows so that the faces look outward.
  const float turn = sections.back().center.z > sections.front().center.z ? 1.0f : -1.0f;
  const auto ring = [&](const Section& s, float u) {
    for (int k = 0; k < sides; ++k) {
      const float a = turn * 2 * kPi * float(k) / sides, c = std::cos(a), d = std::sin(a), e = 2 / squareness;
      const float x = std::copysign(std::pow(std::abs(c), e), c), y = std::copysign(std::pow(std::abs(d), e), d);
      add_vertex(shape, s.center + Vec3{s.half_x * x, s.half_y * y, 0}, {}, {0, 0, 1}, u, float(k) / sides, color);
    }
  };
  float u = 0;
  for (size_t i = 0; i < sections.size(); ++i) {
    if (i > 0) u += distance(sections[i].center, sections[i - 1].center);
    ring(sections[i], u);
    if (i > 0) {
      const uint32_t b = first + uint32_t(i) * sides;
      join_rings(shape, b - sides, b, sides, sides);
    }
  }
  smooth_normals(shape, first, first_triangle);
  // The ends have separate corners: shared ones would round the shading over the edge.
  for (const bool end : {false, true}) {
    const Section& s = end ? sections.back() : sections.front();
    const uint32_t from = uint32_t(shape.position.size());
    ring(s, end ? u : 0);
    const Vec3 out{0, 0, end ? turn : -turn};
    for (uint32_t k = from; k < from + sides; ++k) shape.normal[k] = out, shape.tangent[k] = {1, 0, 0};
    for (uint32_t k = 1; k + 1 < sides; ++k) {
      if (end) shape.triangle.push_back({from, from + k, from + k + 1});
      else shape.triangle.push_back({from, from + k + 1, from + k});
    }
  }
}

void add_ball(Shape& shape, Vec3 center, float radius, Vec3 color) {
  constexpr int around = 12, up = 8;
  const uint32_t first = uint32_t(shape.position.size());
  for (int i = 0; i <= up; ++i)
    for (int k = 0; k <= around; ++k) {
      const float p = kPi * float(i) / up, a = 2 * kPi * float(k) / around;
      const Vec3 n{std::sin(p) * std::cos(a), -std::cos(p), -std::sin(p) * std::sin(a)};
      add_vertex(shape, center + radius * n, n, {-std::sin(a), 0, -std::cos(a)}, float(k) / around, float(i) / up, color);
    }
  for (uint32_t i = 0; i < up; ++i)
    join_rings(shape, first + i * (around + 1), first + (i + 1) * (around + 1), around, around + 1);
}

void add_shape(Shape& to, const Shape& from) {
  const uint32_t first = uint32_t(to.position.size());
  to.position.insert(to.position.end(), from.position.begin(), from.position.end());
  to.normal.insert(to.normal.end(), from.normal.begin(), from.normal.end());
  to.tangent.insert(to.tangent.end(), from.tangent.begin(), from.tangent.end());
  to.uv.insert(to.uv.end(), from.uv.begin(), from.uv.end());
  to.color.insert(to.color.end(), from.color.begin(), from.color.end());
  to.hatched.resize(first, 0);
  to.hatched.insert(to.hatched.end(), from.hatched.begin(), from.hatched.end());
  for (const auto [a, b, c] : from.triangle) to.triangle.push_back({a + first, b + first, c + first});
}

Shape moved(Shape shape, const Pose& pose) {
  for (Vec3& p : shape.position) p = transform(pose, p);
  for (Vec3& n : shape.normal) n = rotate(pose.q, n);
  for (Vec3& t : shape.tangent) t = rotate(pose.q, t);
  return shape;
}

Shape mirrored_x(Shape shape) {
  for (Vec3& p : shape.position) p.x = -p.x;
  for (Vec3& n : shape.normal) n.x = -n.x;
  for (Vec3& t : shape.tangent) t.x = -t.x;
  for (auto& t : shape.triangle) std::swap(t[1], t[2]);
  return shape;
}

void smooth_curve(std::span<const Vec3> through, int per_span, std::vector<Vec3>& out) {
  out.clear();
  const size_t n = through.size();
  for (size_t i = 0; i + 1 < n; ++i) {
    const Vec3 b = through[i], c = through[i + 1];
    // Mirrored neighbors at the ends keep the curve straight there.
    const Vec3 a = i > 0 ? through[i - 1] : 2.0f * b - c, d = i + 2 < n ? through[i + 2] : 2.0f * c - b;
    for (int k = 0; k < per_span; ++k) {
      const float t = float(k) / float(per_span), t2 = t * t, t3 = t2 * t;
      out.push_back(0.5f *
                    (2.0f * b + (c - a) * t + (2.0f * a - 5.0f * b + 4.0f * c - d) * t2 + (3.0f * b - a - 3.0f * c + d) * t3));
    }
  }
  if (n > 0) out.push_back(through[n - 1]);
}

}  // namespace catgut
