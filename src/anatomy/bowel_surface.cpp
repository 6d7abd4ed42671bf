// SPDX-License-Identifier: Apache-2.0
// anatomy/bowel_surface: the smooth parametric surface of a bowel, shared by particles and visible mesh.
#include "anatomy/bowel_surface.h"

#include <algorithm>
#include <cmath>

namespace catgut {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr int kDomeSteps = 512;

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

BowelSurface::BowelSurface(const BowelShape& shape) : shape_(shape) {
  axis_ = normalized(shape.axis);
  e1_ = any_perpendicular(axis_);
  e2_ = cross(axis_, e1_);
  // A dome is half an ellipsoid: as high as the radius where space allows.
  dome_height_ = std::min<double>(shape.radius, 0.4 * shape.length);
  dome_arc_.assign(kDomeSteps + 1, 0);
  for (int i = 0; i < kDomeSteps; ++i) {
    const double a = 0.25 * kTwoPi * i / kDomeSteps, b = 0.25 * kTwoPi * (i + 1) / kDomeSteps;
    const double dr = shape.radius * (portable::sin(b) - portable::sin(a)),
                 dz = dome_height_ * (portable::cos(b) - portable::cos(a));
    dome_arc_[i + 1] = dome_arc_[i] + std::sqrt(dr * dr + dz * dz);
  }
  if (shape.folded) {
    lumen_ = static_cast<double>(shape.inner_radius) - static_cast<double>(shape.wall);
    turn_ = 0.5 * (static_cast<double>(shape.radius) - lumen_);
    straight_ = static_cast<double>(shape.length) - turn_;
    total_ = 2 * straight_ + 0.5 * kTwoPi * turn_;
    return;
  }
  if (shape.closed_end) near_dome_ = dome_arc_.back();
  if (shape.closed_start) far_dome_ = dome_arc_.back();
  const double straight =
      shape.length - dome_height_ * (static_cast<int>(shape.closed_end) + static_cast<int>(shape.closed_start));
  total_ = near_dome_ + straight + far_dome_;
}

// Profile curve rotated about the axis: z along the axis (0 at the near end, negative inward), r from it, its unit normal.
void BowelSurface::profile(double s, double& z, double& r, double& nz, double& nr) const {
  const auto dome = [&](double arc) {
    const auto at = std::upper_bound(dome_arc_.begin(), dome_arc_.end(), arc);
    const size_t i = std::clamp<size_t>(static_cast<size_t>(at - dome_arc_.begin()), 1, kDomeSteps) - 1;
    const double t = (arc - dome_arc_[i]) / (dome_arc_[i + 1] - dome_arc_[i]);
    const double angle = 0.25 * kTwoPi * (static_cast<double>(i) + t) / kDomeSteps;
    r = shape_.radius * portable::sin(angle);
    z = -dome_height_ * (1 - portable::cos(angle));
    nr = dome_height_ * portable::sin(angle), nz = shape_.radius * portable::cos(angle);
    const double l = std::sqrt(nr * nr + nz * nz);
    nr /= l, nz /= l;
  };
  if (shape_.folded) {  // up the colon, over the tip, down the rectum
    const double over = s - straight_, half_turn = 0.5 * kTwoPi * turn_;
    if (over <= 0) {
      z = -turn_ + over, r = lumen_, nz = 0, nr = -1;
    } else if (over < half_turn) {
      const double a = over / turn_;
      nr = -portable::cos(a), nz = portable::sin(a);
      r = lumen_ + turn_ * (1 + nr), z = turn_ * (nz - 1);
    } else {
      z = -turn_ - (over - half_turn), r = shape_.radius, nz = 0, nr = 1;
    }
    return;
  }
  if (s < near_dome_) return dome(std::max(s, 0.0));
  if (s > total_ - far_dome_) {
    dome(std::max(total_ - s, 0.0));
    z = -shape_.length - z;
    nz = -nz;
    return;
  }
  z = -(near_dome_ > 0 ? dome_height_ : 0.0) - (s - near_dome_);
  r = shape_.radius, nz = 0, nr = 1;
}

double BowelSurface::ring_radius(double s) const {
  double z, r, nz, nr;
  profile(s, z, r, nz, nr);
  return r;
}

double BowelSurface::depth(double s) const {
  double z, r, nz, nr;
  profile(s, z, r, nz, nr);
  return -z;
}

// Folds cross the tube about every 22 mm, bands run along it; elsewhere the wall bulges to the full radius.
double BowelSurface::relief(double s, double angle) const {
  const double fade_over = std::min(0.015, 0.3 * total_);
  const double fade = smooth_step(s / fade_over) * smooth_step((total_ - s) / fade_over);
  if (fade <= 0 || shape_.haustra <= 0) return 0;
  const double folds = std::max(1.0, std::round(total_ / 0.022));
  const double wave = 0.5 + 0.5 * portable::cos(kTwoPi * folds * s / total_);
  const double fold = wave * wave;
  double band = 0;
  if (shape_.taeniae > 0) {
    const double t = 0.5 + 0.5 * portable::cos(shape_.taeniae * angle);
    band = t * t * t * t;
  }
  return -shape_.haustra * fade * (1 - (1 - fold) * (1 - 0.8 * band));
}

BowelSurface::P3 BowelSurface::local(double s, double angle) const {
  double z, r, nz, nr;
  profile(s, z, r, nz, nr);
  const double h = relief(s, angle);
  const double rr = r + h * nr;
  return {rr * portable::cos(angle), rr * portable::sin(angle), z + h * nz};
}

Vec3 BowelSurface::to_world(P3 p) const {
  const auto along = [&](int k) {
    return static_cast<float>(p.x * e1_[k] + p.y * e2_[k] + p.z * axis_[k] + shape_.position[k]);
  };
  return {along(0), along(1), along(2)};
}

Vec3 BowelSurface::point(double s, double angle) const { return to_world(local(s, angle)); }

Vec3 BowelSurface::normal(double s, double angle) const {
  constexpr double h = 1e-5;
  if (near_dome_ > 0 && s < 10 * h) return axis_;
  if (far_dome_ > 0 && s > total_ - 10 * h) return -axis_;
  const double s0 = std::max(s - h, 0.0), s1 = std::min(s + h, total_);
  const P3 a = local(s0, angle), b = local(s1, angle), c = local(s, angle - 1e-3), d = local(s, angle + 1e-3);
  const P3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{d.x - c.x, d.y - c.y, d.z - c.z};
  P3 n{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  const double l = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  const auto along = [&](int k) { return static_cast<float>((n.x * e1_[k] + n.y * e2_[k] + n.z * axis_[k]) / l); };
  return normalized(Vec3{along(0), along(1), along(2)});
}

namespace {

struct Grid {
  VisibleMesh& mesh;
  int columns;  // quads per row; a row has one vertex more, so that the texture can close

  void vertex(Vec3 p, Vec3 n, float u, float v, TissueLayer layer) {
    mesh.position.push_back(p);
    mesh.normal.push_back(n);
    mesh.uv.push_back({u, v});
    mesh.layer.push_back(layer);
  }
  // Quads between `rows` rows from vertex `first`; rows run away from the near end, angles counter-clockwise about the axis.
  void quads(uint32_t first, int rows, bool reversed) {
    const uint32_t width = static_cast<uint32_t>(columns) + 1;
    for (int i = 0; i + 1 < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        const uint32_t a = first + static_cast<uint32_t>(i) * width + static_cast<uint32_t>(j), b = a + width;
        triangle(a, b, b + 1, reversed);
        triangle(a, b + 1, a + 1, reversed);
      }
    }
  }
  // At the top of a dome a quad is a triangle: its other half has zero area and is omitted.
  void triangle(uint32_t a, uint32_t b, uint32_t c, bool reversed) {
    const Vec3 n = cross(mesh.position[b] - mesh.position[a], mesh.position[c] - mesh.position[a]);
    if (length(n) < 1e-12f) return;
    if (reversed) std::swap(b, c);
    mesh.triangle.push_back({a, b, c});
  }
};

}  // namespace

VisibleMesh bowel_picture(const BowelShape& shape, const BowelSurface& surface, int vertices, bool everted) {
  const double along = surface.profile_length(), round = kTwoPi * shape.radius;
  const double step = std::sqrt(2 * along * round / vertices);  // two sides share them
  const int columns = std::max(12, static_cast<int>(std::lround(round / step)));
  const int rows = std::max(4, static_cast<int>(std::lround(along / step)) + 1);
  const auto s_of = [&](int i) { return along * i / (rows - 1); };
  const auto angle_of = [&](int j) { return kTwoPi * (j % columns) / columns; };
  // A whole number of texture tiles round the organ, so that there is no visible seam.
  const double tiles = std::max(1.0, std::round(round / 0.01));
  const auto v_of = [&](int j) { return static_cast<float>(tiles * j / columns); };

  VisibleMesh mesh;
  Grid grid{mesh, columns};
  for (const bool inside : {false, true}) {
    const uint32_t first = static_cast<uint32_t>(mesh.position.size());
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j <= columns; ++j) {
        const Vec3 n = surface.normal(s_of(i), angle_of(j));
        const Vec3 p = surface.point(s_of(i), angle_of(j)) - n * (inside ? shape.wall : 0.0f);
        grid.vertex(p, inside ? -n : n, static_cast<float>(s_of(i) / 0.01), v_of(j),
                    inside == everted ? TissueLayer::serosa : TissueLayer::mucosa);
      }
    }
    grid.quads(first, rows, inside);
  }
  // A rim edge bulges slightly from the wall's two corners, as cut bowel does.
  constexpr int steps = 6;
  const Vec3 axis = normalized(shape.axis);
  for (const bool far : {false, true}) {
    if (far ? shape.closed_start : shape.closed_end) continue;
    const double s = far ? along : 0;
    const Vec3 out = far || shape.folded ? -axis : axis;
    const float half = 0.5f * shape.wall, swell = 0.35f * shape.wall;
    const uint32_t first = static_cast<uint32_t>(mesh.position.size());
    for (int i = 0; i <= steps; ++i) {
      const float t = kPi * static_cast<float>(i) / steps;
      for (int j = 0; j <= columns; ++j) {
        const Vec3 n = surface.normal(s, angle_of(j));
        const Vec3 middle = surface.point(s, angle_of(j)) - n * half;
        const Vec3 p = middle - n * (half * portable::cos(t)) + out * (swell * portable::sin(t));
        const Vec3 normal = normalized(out * (half * portable::sin(t)) - n * (swell * portable::cos(t)));
        grid.vertex(p, normal, static_cast<float>((s - (far ? -1 : 1) * shape.wall * (1 - i / double(steps))) / 0.01), v_of(j),
                    TissueLayer::cut_edge);
      }
    }
    grid.quads(first, steps + 1, far);
  }
  return mesh;
}

}  // namespace catgut
