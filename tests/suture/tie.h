// SPDX-License-Identifier: Apache-2.0
// tests/suture: a stitch of two suture points, and a tool above it with one of the two strands wound round it. Everything is
// placed directly, so that every length is known; after that hands and mechanics are the real ones.
#pragma once
#include "rig.h"

namespace catgut {

struct TieSetup {
  float turns = 1.25f;            // of thread round the tool; 0: none
  int way = 1;                    // +1: traversed away from the tissue it turns counter-clockwise as seen from the hand
  bool wrap_tail = false;         // the free end is wound round the tool, and the needle's strand led to its tip
  float above = 0.015f;           // [m] the tool above the tissue
  float depth = 0.006f;           // [m] from the tool's tip to the thread round it
  size_t older = 25, newer = 30;  // nodes of the two suture points
  size_t particles = 90;
  size_t tool = 0;
};

struct Tie : Rig {
  static constexpr float kRound = 0.0019f;  // [m] radius of the turns
  Place first, second;
  Pose frame;  // of the tool: x along the stitch, y away from the tissue, z along the rim's axis toward the hand
  TieSetup setup;

  explicit Tie(const TieSetup& s = {}, const SceneSpec& scene = weightless(90)) : Rig(fitting(scene, s)), setup(s) {
    wait(0.1f);
    sew(0.2f);
    show(s.tool, frame, 0.7f);
  }
  // Two suture points, from `angle` round the rim on, and both strands led to the tool.
  void sew(float angle) {
    first = place(angle, 0.004f);
    second = place(angle + 0.35f, 0.004f);
    lock(*this, setup.older, first.at);
    lock(*this, setup.newer, second.at);
    stand(setup.above);
    lay_stitch();
    lay_strands(setup.turns, setup.way, setup.wrap_tail);
  }
  // Places the tool for a new stitch, jaws open, without a path.
  void put_tool() {
    RigidBody& b = solver().body[setup.tool];
    b = {};
    b.x = b.prev_x = frame.p, b.q = b.prev_q = frame.q;
    state->hand[setup.tool].pose = frame;
    suture().loop[setup.tool].ignored_until_clear = 0;
    input.hand[setup.tool].pose = frame;
  }
  static SceneSpec fitting(SceneSpec scene, const TieSetup& s) {
    scene.thread.particles = static_cast<int>(s.particles);
    return scene;
  }
  Vec3 middle() { return 0.5f * (point_at(0) + point_at(1)); }
  // The tool's frame, `above` the middle of the stitch.
  void stand(float above) {
    const Vec3 up{0, 1, 0}, out = normalized(first.out + second.out), along = cross(out, up);
    frame = {middle() + out * above - up * setup.depth, from_axes(along, out, up)};
  }
  void show(size_t hand, const Pose& pose, float jaw) {
    input.hand[hand].connected = 1;
    input.hand[hand].pose = pose;
    input.hand[hand].jaw = jaw;
    tick();
  }
  void open(size_t hand, float wide = 0.7f) {
    for (float jaw : {0.3f, 0.6f, wide}) input.hand[hand].jaw = jaw, tick();
  }
  void move(size_t hand, Vec3 by, float seconds) {
    const Vec3 from = input.hand[hand].pose.p;
    const int ticks = std::max(1, static_cast<int>(std::lround(seconds / model->dt)));
    for (int i = 1; i <= ticks && !testing::Test::HasFatalFailure(); ++i) {
      input.hand[hand].pose.p = from + by * (static_cast<float>(i) / static_cast<float>(ticks));
      tick();
    }
  }

  // Places the nodes from `node` on, in direction `step`, along the curve, each pair at its rest length.
  void lay_along(size_t node, int step, const std::vector<Vec3>& curve, size_t last) {
    size_t at = 0;
    Vec3 here = curve[0];
    float s = 0;
    for (size_t i = node;; i = step > 0 ? i + 1 : i - 1) {
      const size_t slot = thread().order[i];
      const float rest = thread().rest[step > 0 ? i - 1 : i];
      // The first point on the curve at distance `rest`.
      const Vec3 from = here;
      while (at + 1 < curve.size()) {
        const Vec3 p = lerp(curve[at], curve[at + 1], s);
        if (distance(p, from) >= rest) break;
        s += 0.02f;
        if (s >= 1) s = 0, ++at;
      }
      const Vec3 p = at + 1 < curve.size() ? lerp(curve[at], curve[at + 1], s) : curve.back();
      here = from + normalized(p - from, {0, 1, 0}) * rest;
      set(solver().x[slot], here);
      solver().v[slot] = {};
      if (i == last) break;
    }
  }
  static void line(std::vector<Vec3>& c, Vec3 a, Vec3 b) {
    const int n = std::max(1, static_cast<int>(distance(a, b) / 0.0005f));
    for (int i = 0; i <= n; ++i) c.push_back(lerp(a, b, static_cast<float>(i) / static_cast<float>(n)));
  }
  // The thread between the two suture points: a flat arch outside.
  void lay_stitch() {
    const Vec3 a = point_at(0), b = point_at(1), out = normalized(first.out + second.out);
    const size_t from = setup.older, to = setup.newer;
    float length = 0;
    for (size_t i = from; i < to; ++i) length += thread().rest[i];
    const float chord = distance(a, b), height = 0.5f * std::sqrt(std::max(0.0f, length * length - chord * chord));
    for (size_t i = from + 1; i < to; ++i) {
      const float s = static_cast<float>(i - from) / static_cast<float>(to - from);
      set(solver().x[thread().order[i]], lerp(a, b, s) + out * (height * (1 - std::abs(2 * s - 1))));
    }
  }
  // From a suture point to the tool, round it, and away to one side.
  std::vector<Vec3> round_the_tool(Vec3 from, float turns, int way) {
    std::vector<Vec3> c;
    const float side = static_cast<float>(way);
    const float z = to_local(frame, from).z;
    const auto at = [&](float phi, float r, float depth) {
      return transform(frame, Vec3{side * r * std::cos(phi), r * std::sin(phi), depth});
    };
    line(c, from, at(0, kRound, z));
    for (int i = 1; i <= 200; ++i) {
      const float phi = turns * 2 * kPi * static_cast<float>(i) / 200;
      c.push_back(at(phi, kRound + 0.00005f * phi, z + 0.00007f * phi));
    }
    const Vec3 out = normalized(c.back() - c[c.size() - 2]);
    line(c, c.back(), c.back() + out * 0.3f);
    return c;
  }
  // From a suture point to the tool's tip, past it within reach of the jaws, and on.
  std::vector<Vec3> past_the_tip(Vec3 from) {
    std::vector<Vec3> c;
    const Vec3 tip = transform(frame, Vec3{0, 0, -0.0018f});
    line(c, from, from + normalized(tip - from) * 0.3f);
    return c;
  }
  // The nodes from which the two strands come: those of the last locked knot, or of the outermost suture points.
  std::array<size_t, 2> roots() {
    if (!sewn().knot.empty() && sewn().knot.back().slots == 2)
      return {node_of(sewn().knot.back().slot[0]), node_of(sewn().knot.back().slot[1])};
    size_t a = thread().order.size(), b = 0;
    for (size_t k = 0; k < sewn().point.size(); ++k) a = std::min(a, node_of_point(k)), b = std::max(b, node_of_point(k));
    return {a, b};
  }
  Vec3 at_node(size_t i) { return thread_position(thread(), i, x(), solver().body); }
  void lay_strands(float turns, int way, bool wrap_tail) {
    const auto [a, b] = roots();
    const auto strand = [&](Vec3 from, bool wrapped) {
      return wrapped && turns > 0 ? round_the_tool(from, turns, way) : past_the_tip(from);
    };
    lay_along(a - 1, -1, strand(at_node(a), wrap_tail), 0);
    lay_along(b + 1, 1, strand(at_node(b), !wrap_tail), thread().order.size() - 1);
    if (ghost >= 0) let_go();
    put_needle(*this, xyz(solver().x[thread().order.back()]));
  }
  // The tool releases, returns over the stitch, and thread is wound round it again.
  void wrap(int way, float turns = 1.25f) {
    open(setup.tool);
    stand(setup.above);
    put_tool();
    setup.way = way;
    lay_strands(turns, way, setup.wrap_tail);
    tick();
  }
  // Moves the tool away until the current throw has locked, and waits until the stitch is tight.
  void pull_tight(float most = 0.024f) {
    constexpr float kStep = 0.001f;
    const auto set = [&] {
      return std::all_of(sewn().knot.begin(), sewn().knot.end(), [](const Knot& k) { return k.phase == KnotPhase::locked; });
    };
    for (float gone = 0; gone < most && !set(); gone += kStep)
      move(setup.tool, rotate(frame.q, Vec3{0, 0.7f, 0.7f}) * kStep, kStep / 0.06f);
    wait(0.4f);
  }
  // Lays the strand that is not wrapped past the tip of the tool and closes the jaws on it before it can move. Thread is
  // light and stiff: otherwise it springs away within a tick.
  void take(size_t hand = 0) {
    frame = solver().body[setup.tool].pose();
    if (setup.wrap_tail) {
      lay_along(roots()[1] + 1, 1, past_the_tip(at_node(roots()[1])), thread().order.size() - 1);
      if (ghost >= 0) let_go();
      put_needle(*this, xyz(solver().x[thread().order.back()]));
    } else {
      lay_along(roots()[0] - 1, -1, past_the_tip(at_node(roots()[0])), 0);
    }
    input.hand[hand].jaw = 0.3f;
    tick();
  }
  const ToolLoop& loop(size_t hand = 0) { return suture().loop[hand]; }
  size_t holds(HoldKind kind) {
    return static_cast<size_t>(
        std::count_if(thread().hold.begin(), thread().hold.end(), [&](const ThreadHold& h) { return h.kind == kind; }));
  }
};

}  // namespace catgut
