// SPDX-License-Identifier: Apache-2.0
// tests/render: a small operating field made up for the tests: an open bowel end, thread, needle and two tools.
#pragma once
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

struct TestField {
  PictureModel model;
  Snapshot snapshot;
};

// A tube 20 mm in radius with walls of `wall` [m], rim up at y = 0, 70 mm long. Each vertex follows the particle at its own
// ring and side. `around` x `rows` sets how fine it is.
inline TestField make_test_field(int around = 96, int rows = 40, float wall = 0.003f) {
  TestField field;
  PictureModel& model = field.model;
  model.title = "test field";
  const float outer = 0.020f, length = 0.07f;
  constexpr int rings = 8, sides = 16;
  const auto on_tube = [](float r, float y, float a) { return Vec3{r * std::cos(a), y, -r * std::sin(a)}; };
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < sides; ++k)
      model.particle_rest.push_back(on_tube(outer - 0.5f * wall, -length * float(i) / (rings - 1), 2 * kPi * float(k) / sides));

  VisibleMesh mesh;
  // The profile of the wall from the bottom outside over the rim to the bottom inside.
  struct Point {
    float r, y;
    Vec3 normal;
    TissueLayer layer;
    float s;
  };
  std::vector<Point> profile;
  const int edge = 6;
  for (int i = 0; i <= rows; ++i) {
    const float y = -length + (length - 0.0015f) * float(i) / float(rows);
    profile.push_back({outer, y, {1, 0, 0}, TissueLayer::serosa, y + length});
  }
  for (int i = 1; i < edge; ++i) {
    const float a = kPi * float(i) / edge;
    profile.push_back({outer - 0.5f * wall + 0.5f * wall * std::cos(a),
                       -0.0015f + 0.5f * wall * std::sin(a),
                       {std::cos(a), std::sin(a), 0},
                       TissueLayer::cut_edge,
                       length + 0.0015f * a});
  }
  for (int i = 0; i <= rows; ++i) {
    const float y = -0.0015f - (length - 0.0015f) * float(i) / float(rows);
    profile.push_back({outer - wall, y, {-1, 0, 0}, TissueLayer::mucosa, length + 0.005f - y});
  }
  for (size_t i = 0; i < profile.size(); ++i)
    for (int k = 0; k < around; ++k) {
      const Point& p = profile[i];
      const float a = 2 * kPi * float(k) / float(around);
      mesh.position.push_back(on_tube(p.r, p.y, a));
      mesh.normal.push_back(on_tube(p.normal.x, p.normal.y, a));
      mesh.uv.push_back({p.s / 0.01f, outer * a / 0.01f});
      mesh.layer.push_back(p.layer);
      // Linear blend of the four particles round the vertex.
      const float fi = std::clamp(-p.y / length * (rings - 1), 0.0f, float(rings - 1) - 1e-3f), fk = a / (2 * kPi) * sides;
      const uint32_t i0 = uint32_t(fi), k0 = uint32_t(fk) % sides, k1 = (k0 + 1) % sides;
      const float ti = fi - float(i0), tk = fk - std::floor(fk);
      mesh.skin_particle.push_back({i0 * sides + k0, i0 * sides + k1, (i0 + 1) * sides + k0, (i0 + 1) * sides + k1});
      mesh.skin_weight.push_back({(1 - ti) * (1 - tk), (1 - ti) * tk, ti * (1 - tk), ti * tk});
    }
  for (uint32_t i = 0; i + 1 < uint32_t(profile.size()); ++i)
    for (uint32_t k = 0; k < uint32_t(around); ++k) {
      const uint32_t n = uint32_t(around), a = i * n + k, b = i * n + (k + 1) % n;
      mesh.triangle.push_back({a, b, a + n});
      mesh.triangle.push_back({b, b + n, a + n});
    }
  model.body.push_back(std::move(mesh));
  model.focus = {0, 0, 0};
  model.field = 0.08f;
  model.suture[0].thread_first = uint32_t(model.particle_rest.size());

  Snapshot& s = field.snapshot;
  s.particle = model.particle_rest;
  s.rotation.resize(model.particle_rest.size());
  // The thread: three passes over the rim on the near side, then an arc to the needle.
  std::vector<Vec3> thread;
  for (int i = 0; i < 90; ++i) {
    const float t = float(i) / 89, a = -1.9f + 1.0f * t, turn = 2 * kPi * 3 * t;
    thread.push_back(on_tube(0.0185f + 0.0024f * std::cos(turn), -0.0028f + 0.0036f * std::sin(turn), a));
  }
  const Vec3 last = thread.back(), swage{0.016f, 0.017f, 0.030f};
  for (int i = 1; i <= 40; ++i) {
    const float t = float(i) / 40;
    thread.push_back(lerp(last, swage, t) +
                     Vec3{0.004f * std::sin(5 * t), 0.012f * std::sin(kPi * t), 0.006f * std::sin(kPi * t)});
  }
  model.suture[0].thread_count = uint32_t(thread.size());
  for (const Vec3 p : thread) {
    s.active().thread_order.push_back(uint32_t(s.particle.size()));
    s.particle.push_back(p);
  }
  // The needle stands upright on the near rim with its swage up, held a third of the way along.
  const Vec3 nx = normalized(Vec3{0.25f, 0.35f, 0.9f}), nz = normalized(cross(nx, {0.2f, 1, 0})), ny = cross(nz, nx);
  s.active().needle.pose.q = from_axes(nx, ny, nz);
  s.active().needle.pose.p = swage - rotate(s.active().needle.pose.q, {model.suture[0].needle_radius, 0, 0});
  const Vec3 grip = transform(s.active().needle.pose, {model.suture[0].needle_radius * std::cos(0.9f),
                                                       model.suture[0].needle_radius * std::sin(0.9f), 0});
  const Vec3 back = normalized(Vec3{0.55f, 0.55f, 0.65f}), open = normalized(cross(Vec3{0, 1, 0}, back));
  s.tool[0].pose = {grip, from_axes(open, cross(back, open), back)};
  s.tool[0].jaw = 0.12f;
  s.tool[0].held = Held::needle;
  s.tool[0].instrument = 0, s.tool[1].instrument = 1;
  const Vec3 back2 = normalized(Vec3{-0.75f, 0.5f, 0.45f}), open2 = normalized(cross(Vec3{0, 0, 1}, back2));
  s.tool[1].pose = {on_tube(0.0185f, 0.0f, 3.5f), from_axes(open2, cross(back2, open2), back2)};
  s.tool[1].jaw = 0.5f;
  for (size_t k = 0; k < 2; ++k) {
    InstrumentPicture picture;
    picture.kind = k == 0 ? "needle_holder" : "forceps";
    model.instrument.push_back(picture);
    InstrumentView view;
    view.pose = s.tool[k].pose, view.jaw = s.tool[k].jaw, view.place = InstrumentPlace::hand;
    s.instrument.push_back(view);
  }
  for (int i = 0; i < 3; ++i)
    for (const bool exit : {false, true}) {
      SuturePointView point;
      point.position = on_tube(exit ? 0.017f : 0.0205f, -0.004f, -1.8f + 0.33f * float(i));
      point.exit = exit;
      s.active().suture_point.push_back(point);
    }
  return field;
}

}  // namespace catgut
