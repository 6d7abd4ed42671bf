// SPDX-License-Identifier: Apache-2.0
// tests/cutting: the scene "excision", a right hand that leads its pen, and measures of the drawn surface.
#pragma once
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "procedure/scene_file.h"
#include "runtime/cut_measures.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {

constexpr float kLine = 0.006f;  // [m] from the rim

// The scene, and a right hand that draws lines with the pen.
struct Field {
  static SceneSpec scene_of(int particles) {
    SceneSpec s = read_scene("excision");
    s.body[0].particles = particles;
    return s;
  }
  SceneSpec scene;
  std::shared_ptr<const Model> model = build_model(scene);
  StatePtr state = initial_state(*model);
  Jobs jobs{1};
  TickInput input;
  Snapshot seen;
  std::vector<Event> events;  // of all ticks
  float line = kLine;         // [m] from the rim
  std::function<void()> after_tick;

  explicit Field(int particles = 400) : Field(scene_of(particles)) {}
  explicit Field(const SceneSpec& with) : scene(with) {
    for (ToolInput& h : input.hand) h.connected = 0;
    publish(*model, *state, seen);
  }
  void tick() {
    input.tick = state->tick;
    step(*model, *state, input, jobs);
    input.commands.clear();
    publish(*model, *state, seen);
    events.insert(events.end(), seen.event.begin(), seen.event.end());
    if (after_tick) after_tick();
  }
  std::vector<Event> of(EventKind kind, Fault fault = Fault::none) const {
    std::vector<Event> out;
    for (const Event& e : events)
      if (e.kind == kind && e.fault == fault) out.push_back(e);
    return out;
  }
  std::vector<Event> of(Fault fault) const { return of(EventKind::technique_fault, fault); }
  // The tip on the outer side at an angle about the axis, the shaft outward.
  void hold(float angle, float above = 0) {
    const Vec3 out{portable::cos(angle), 0, portable::sin(angle)};
    const Vec3 x = normalized(cross({0, 1, 0}, out));
    input.hand[0].connected = 1;
    input.hand[0].pose = {out * (scene.body[0].radius + above) - Vec3{0, line, 0}, from_axes(x, cross(out, x), out)};
  }
  void switch_pen() { input.commands.push({CommandKind::cut, 0, 0}); }
  // Along the line, at `speed` [m/s]; false: stopped after `ticks`.
  void draw(float from, float to, float speed) {
    const float step = speed * model->dt / scene.body[0].radius;
    const int ticks = static_cast<int>(std::lround(std::abs(to - from) / step));
    for (int i = 0; i <= ticks; ++i) hold(from + (to - from) * static_cast<float>(i) / static_cast<float>(ticks)), tick();
  }
  void cut(float from, float to, float speed) {
    hold(from, 0.004f), tick(), tick();
    hold(from), tick(), tick();
    switch_pen();
    draw(from, to, speed);
    switch_pen();
    hold(to), tick();
    hold(to, 0.004f), tick(), tick();
  }
  const physical::Excision& excision() const { return state->physical.cutting.excision; }
  double mass() const {
    double sum = 0;
    for (const float m : state->physical.world.wall.topology.mass) sum += static_cast<double>(m);
    return sum;
  }
};

// Area vector of the drawn surface at rest over its area: 0 where it is closed.
inline double opening_of(const PictureModel& picture) {
  Vec3 sum{};
  float area = 0;
  for (const VisibleMesh& mesh : picture.body)
    for (const auto& t : mesh.triangle) {
      const Vec3 n = cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
      sum += n, area += length(n);
    }
  return static_cast<double>(length(sum) / area);
}

}  // namespace catgut
