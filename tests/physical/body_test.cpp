// SPDX-License-Identifier: Apache-2.0
// tests/physical: rigid tools and needles against wall and thread, from outside: balance of forces, overlap, puncture forces,
// where the holes are, what remains, and the bits of a copy.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/archive.h"
#include "physical/physical.h"
#include "physical/reflect.h"
#include "validation/knot_scenes.h"

namespace catgut::physical {
namespace {

// A sheet held at its border, its outer face at z = 1.25 mm, and a thread that lies far away.
struct Bench {
  Model model;
  State state;
  std::unique_ptr<Scratch> scratch;
  std::unique_ptr<Jobs> jobs = std::make_unique<Jobs>(1);
  std::vector<HandTarget> target;
  float width = 0, height = 0;

  explicit Bench(float w = 0.03f, float h = 0.02f, bool free_edge = false) : width(w), height(h) {
    wall::SheetShape shape;
    shape.width = w, shape.height = h;
    shape.columns = static_cast<int>(std::lround(w / 2.5e-3f)) + 1, shape.rows = static_cast<int>(std::lround(h / 2.5e-3f)) + 1;
    wall::Spec spec;
    spec.mesh = wall::sheet(shape);
    for (size_t c = 0; c < spec.mesh.held.size(); ++c) {
      const Vec3 p = spec.mesh.outer[c];
      const float across = free_edge ? std::max(0.0f, p.y - 0.5f * h) : std::abs(p.y - 0.5f * h);
      spec.mesh.held[c] = std::abs(p.x - 0.5f * w) > 0.5f * w - 1e-4f || across > 0.5f * h - 1e-4f;
    }
    const wall::Wall wall = wall::build_wall(spec);
    model = make_model(wall, validation::knot_settings(0.3f));
    model.bodies.gravity = {0, 0, -9.81f};
    state.wall = wall.state;
    std::vector<Vec3> path;
    for (int i = 0; i < 40; ++i) path.push_back({0.2f, 0.2f, 0.5e-3f * static_cast<float>(i)});
    state.thread = thread::make_state(path);
  }
  uint32_t add(const BodyModel& m, const Pose& pose, float opening = 0) {
    model.bodies.body.push_back(m);
    place_body(m, state.bodies.body.emplace_back(), pose, opening);
    target.emplace_back();
    return static_cast<uint32_t>(target.size()) - 1;
  }
  uint32_t add_needle(const NeedleShape& shape, const Pose& pose) {
    const uint32_t b = add(make_needle_body(shape), pose);
    model.needles.needle.push_back(make_needle(shape, b));
    state.needle.emplace_back();
    return b;
  }
  void start() { scratch = std::make_unique<Scratch>(model, state); }
  thread::Plane* drape = nullptr;
  std::span<const thread::Pull> pulls;
  void step() {
    Hands hands;
    hands.targets = target, hands.plane = drape, hands.pulls = pulls;
    physical::step(model, state, *scratch, hands, *jobs);
  }
  Body& body(uint32_t i) { return state.bodies.body[i]; }
  // [m] by which the body's spheres are inside the wall.
  float overlap(uint32_t b) const {
    const BodyModel& m = model.bodies.body[b];
    float deepest = 0;
    for (size_t i = 0; i < m.sphere.size(); ++i) {
      if (m.sphere[i].radius <= 0 || (i < 64 && (state.bodies.body[b].skip >> i & 1))) continue;
      const Vec3 p = transform(state.bodies.body[b].pose, local(m, m.sphere[i], state.bodies.body[b].opening));
      Foot best;
      float far = 1;
      for (uint32_t q = 0; q < model.surface.patch.size(); ++q) {
        const Foot foot = nearest_on_patch(model.wall, state.wall, model.surface, q, p);
        const float d = distance(foot.at, p);
        const bool clearer = d < far + 1e-7f && dot(p - foot.at, foot.facing) > dot(p - best.at, best.facing);
        if (d < far - 1e-7f || clearer) best = foot, far = std::min(far, d);
      }
      if (best.on_edge && best.gap < -2e-3f) continue;  // beyond a corner of the sheet, far outside
      deepest = std::max(deepest, m.sphere[i].radius - best.gap);
    }
    return deepest;
  }
};

// In place of the sheet, two of them: the second one by `up` [m] higher. held: by the place of a column's outer node.
constexpr uint32_t kFacesOfSheet = 12 * 8;
template <typename Held>
void put_two_sheets(Bench& bench, float up, Held held) {
  wall::SheetShape shape;
  shape.width = 0.03f, shape.height = 0.02f, shape.columns = 13, shape.rows = 9;
  wall::Spec spec;
  spec.mesh = wall::sheet(shape);
  wall::Mesh second = spec.mesh;
  for (std::vector<Vec3>* side : {&second.outer, &second.inner})
    for (Vec3& p : *side) p.z += up;
  wall::append(spec.mesh, second);
  for (size_t c = 0; c < spec.mesh.held.size(); ++c) spec.mesh.held[c] = held(shape, spec.mesh.outer[c]);
  const wall::Wall wall = wall::build_wall(spec);
  bench.model = make_model(wall, validation::knot_settings(0.3f));
  bench.state.wall = wall.state;
}

// The needle with its circle in the plane y = const above the sheet; its tip goes down in front as the angle grows.
Pose on_circle(const NeedleModel& n, Vec3 center, float angle) {
  const Vec3 x{std::cos(angle), 0, std::sin(angle)}, y{-std::sin(angle), 0, std::cos(angle)};
  Pose p;
  p.q = from_axes(x, y, cross(x, y));
  p.p = center - rotate(p.q, n.circle);
  return p;
}
constexpr Vec3 kCircle{0.015f, 0.0107f, 0.00575f};

TEST(Tool, what_the_hand_gives_the_wall_takes) {
  Bench bench;
  const uint32_t t = bench.add(make_tool({}), {{0.015f, 0.01f, 0.005f}, {}});
  bench.start();
  float z = 0.005f;
  for (int i = 0; i < 700; ++i) {
    z = std::max(-0.001f, z - 5e-5f);
    bench.target[t] = {{{0.015f, 0.01f, z}, {}}, true};
    bench.step();
    EXPECT_LT(bench.overlap(t), 0.3e-3f) << i;
  }
  const Body& b = bench.body(t);
  EXPECT_GT(b.force.z, 0.5f);
  EXPECT_NEAR(b.hand_force.z, -b.force.z, 0.01f * b.force.z);
  // The hand's spring carries the same force.
  EXPECT_NEAR((b.pose.p.z - z) * bench.model.bodies.body[t].stiffness, b.force.z, 0.01f * b.force.z);
  // And the elastic wall, held in this shape, answers with the same: its points at rest feel no other force.
  EXPECT_LT(length(b.velocity), 1e-3f);
}

TEST(Tool, a_hand_pushes_no_harder_than_it_can) {
  Bench bench;
  ToolShape blunt;
  blunt.tip_radius = 2.5e-3f, blunt.hinge_radius = 3e-3f;
  const uint32_t t = bench.add(make_tool(blunt), {{0.015f, 0.01f, 0.008f}, {}});
  bench.start();
  for (int i = 0; i < 700; ++i) {
    bench.target[t] = {{{0.015f, 0.01f, std::max(-0.03f, 0.008f - 1e-4f * static_cast<float>(i))}, {}}, true};
    bench.step();
    EXPECT_LT(bench.overlap(t), 0.3e-3f) << i;
  }
  EXPECT_NEAR(length(bench.body(t).force), 8, 0.3f);
}

TEST(Needle, let_go_it_lies_where_it_falls) {
  Bench bench;
  const NeedleShape shape;
  const uint32_t n = bench.add_needle(shape, {{0.015f, 0.01f, 0.015f}, normalized(Quat{0.3f, 0.2f, 0.1f, 1})});
  bench.start();
  for (int i = 0; i < 1500; ++i) {
    bench.step();
    EXPECT_LT(bench.overlap(n), 0.3e-3f) << i;
  }
  EXPECT_EQ(bench.state.needle[0].channels, 0u);
  EXPECT_LT(length(bench.body(n).velocity), 2e-3f);
  EXPECT_NEAR(bench.body(n).force.z, shape.mass * 9.81f, 0.05f * shape.mass * 9.81f);
  EXPECT_GT(bench.body(n).pose.p.z, 0.0f);
}

// From 4 cm, in several positions, onto the drape or onto its own thread that lies there in a coil. Nothing of it may come
// below the drape, and loose thread carries no more than the fall of its needle.
TEST(Needle, dropped_on_the_drape_it_lies_there_and_does_not_jerk_its_thread) {
  for (const bool coil : {false, true})
    for (int turn = 0; turn < (coil ? 4 : 2); ++turn) {
      Bench bench;
      const NeedleShape shape;
      thread::Plane drape;
      drape.normal = {0, 0, 1}, drape.offset = -0.05f;
      bench.drape = &drape;
      bench.model.thread.gravity = bench.model.bodies.gravity;
      const Quat q =
          normalized(Quat{0.9f * std::sin(static_cast<float>(turn)), 0.9f * std::cos(static_cast<float>(turn)), 0.2f, 1});
      const uint32_t n = bench.add_needle(shape, {{0.1f, 0.01f, -0.01f}, q});
      if (coil) {
        const float d = bench.model.thread.material.diameter;
        std::vector<Vec3> path;
        for (int i = 0; i < 160; ++i) {  // three turns round where it falls, then up to the swage
          const float a = 0.12f * static_cast<float>(i), r = 0.004f + 2.5e-5f * static_cast<float>(i);
          path.push_back({0.1f + r * std::cos(a), 0.01f + r * std::sin(a), drape.offset + 0.5f * d});
        }
        const Vec3 last = path.back(), swage = swage_of(bench.model.needles.needle[0], bench.body(n).pose);
        const int up = static_cast<int>(std::ceil(1.1f * distance(last, swage) / 0.5e-3f));
        for (int i = 1; i <= up; ++i) path.push_back(lerp(last, swage, static_cast<float>(i) / static_cast<float>(up)));
        bench.state.thread = thread::make_state(path);
        bench.state.needle[0].thread_node = static_cast<uint32_t>(path.size()) - 1;
      }
      bench.start();
      float tension = 0, below = 0;
      Vec3 before;
      for (int i = 0; i < 2000; ++i) {
        if (i == 1500) before = bench.body(n).pose.p;
        bench.step();
        for (size_t k = 0; k < bench.state.thread.segments(); ++k) tension = std::max(tension, bench.state.thread.tension[k]);
        for (const BodySphere& s : bench.model.bodies.body[n].sphere)
          below = std::max(below, drape.offset + std::abs(s.radius) - transform(bench.body(n).pose, s.at).z);
      }
      std::printf("%d %d: tension %.3f N, below %.3f mm, moved %.3f mm\n", coil, turn, tension, 1e3f * below,
                  1e3f * distance(bench.body(n).pose.p, before));
      EXPECT_LT(below, 0.1e-3f);
      EXPECT_LT(distance(bench.body(n).pose.p, before), 2.5e-3f) << "in half a second";
      EXPECT_LT(tension, 1.0f);
    }
}

// Thread across a needle that lies on tissue, drawn down on both sides: it presses the needle into the tissue, and stays above
// it.
TEST(Needle, thread_drawn_across_one_that_lies_on_tissue_does_not_pass_it) {
  for (const float pull : {0.5f, 2.0f, 4.0f}) {
    Bench bench;
    const NeedleShape shape;
    // On its side; its middle is the farthest from the middle of the sheet along x.
    const uint32_t n = bench.add_needle(shape, {{0.015f, 0.01f, 1.25e-3f + shape.wire_radius}, {}});
    const Vec3 top = arc_point(bench.model.needles.needle[0], bench.body(n).pose, 0.5f * shape.arc);
    const Vec3 along = normalized(arc_tangent(bench.model.needles.needle[0], bench.body(n).pose, 0.5f * shape.arc));
    const Vec3 across = cross({0, 0, 1}, along);
    const float above = shape.wire_radius + 0.6f * bench.model.thread.material.diameter;
    std::vector<Vec3> path;
    for (int i = -20; i <= 20; ++i) path.push_back(top + across * (0.25e-3f * static_cast<float>(i)) + Vec3{0, 0, above});
    bench.state.thread = thread::make_state(path);
    bench.start();
    std::array<thread::Pull, 2> pulls{{{0, {}}, {40, {}}}};
    bench.pulls = pulls;
    float least = 1;
    for (int i = 0; i < 200; ++i) {
      const Vec3 down = Vec3{0, 0, -1} * (pull * std::min(1.0f, 0.01f * static_cast<float>(i)));  // within a tenth of a second
      pulls[0].force = down - across * (0.5f * length(down)), pulls[1].force = down + across * (0.5f * length(down));
      bench.step();
      for (int a = 3; a <= 54; ++a) {  // without the point, which is a cone
        const Vec3 wire = arc_point(bench.model.needles.needle[0], bench.body(n).pose, shape.arc * static_cast<float>(a) / 60);
        for (size_t k = 15; k < 25; ++k) {
          const Vec3 from = bench.state.thread.position(k), way = bench.state.thread.position(k + 1) - from;
          least = std::min(least, distance(wire, from + way * std::clamp(dot(wire - from, way) / length2(way), 0.0f, 1.0f)));
        }
      }
    }
    std::printf("%.1f N: the thread comes as near as %.2f mm to the middle of the wire\n", pull, 1e3f * least);
    EXPECT_GT(least, shape.wire_radius + 0.5f * bench.model.thread.material.diameter - 0.3e-3f) << pull;
  }
}

// A hand that loses its way pushes closed jaws 4 mm into the drape, on a thread that lies there.
TEST(Tool, pushed_into_the_drape_it_does_not_crush_thread_there) {
  Bench bench;
  thread::Plane drape;
  drape.normal = {0, 0, 1}, drape.offset = -0.05f;
  bench.drape = &drape;
  bench.model.thread.gravity = bench.model.bodies.gravity;
  std::vector<Vec3> path;
  for (int i = 0; i < 120; ++i)
    path.push_back({0.1f + 0.5e-3f * static_cast<float>(i), 0.01f, drape.offset + 0.5f * bench.model.thread.material.diameter});
  bench.state.thread = thread::make_state(path);
  Pose pose{{0.13f, 0.0102f, -0.03f}, {}};
  const uint32_t t = bench.add(make_tool({}), pose);
  bench.start();
  float tension = 0;
  for (int i = 0; i < 400; ++i) {
    pose.p.z = std::max(-0.054f, pose.p.z - 1e-4f);
    if (i > 250) pose.p.y += 1e-4f;  // and away to the side
    bench.target[t] = {pose, true};
    bench.step();
    for (size_t k = 0; k < bench.state.thread.segments(); ++k) tension = std::max(tension, bench.state.thread.tension[k]);
  }
  std::printf("largest tension %.2f N\n", static_cast<double>(tension));
  EXPECT_LT(tension, 2);
}

TEST(Needle, enters_and_leaves_at_the_forces_of_the_law_and_the_thread_follows) {
  Bench bench;
  const NeedleShape shape;
  const uint32_t n = bench.add_needle(shape, {});
  const NeedleModel& needle = bench.model.needles.needle[0];
  float angle = -0.35f;
  place_body(bench.model.bodies.body[n], bench.body(n), on_circle(needle, kCircle, angle), 0);
  const Vec3 swage = swage_of(needle, bench.body(n).pose);
  std::vector<Vec3> path;
  for (int i = 159; i >= 0; --i) path.push_back(swage + Vec3{0.48e-3f, 0, 0.14e-3f} * static_cast<float>(i));
  bench.state.thread = thread::make_state(path);
  bench.state.needle[0].thread_node = 159;
  bench.start();
  std::vector<uint32_t> events;
  float shaft = 0,
        swage_in = 0;  // [N] of the wall on the needle, most: its shaft alone in both channels, and from its swage on
  while (angle < 6.5f) {
    angle += 1.5e-3f;
    bench.target[n] = {on_circle(needle, kCircle, angle), true};
    bench.step();
    const uint32_t e = bench.state.needle[0].events;
    if (e) events.push_back(e);
    float& force = angle < kPi ? shaft : swage_in;
    if (events.size() >= 4) force = std::max(force, length(bench.body(n).force));
    if (e & kEntered) {
      // The published 0.9 N is the component along the face's normal; the tip's friction adds to what the hand gives.
      EXPECT_NEAR(bench.state.needle[0].entry_peak, 0.9f * std::sqrt(1 + 0.25f), 0.12f);
    }
    if (e & kLeft) { EXPECT_NEAR(bench.state.needle[0].exit_peak, 0.54f, 0.01f); }
  }
  // The thread's end follows the swage in; it does not stop before the hole (1.3 to 1.5 N then).
  EXPECT_GT(shaft, 0.4f);
  EXPECT_LT(swage_in, shaft + 0.1f);
  // Down and up through the sheet, and the thread behind the needle.
  EXPECT_EQ(events, (std::vector<uint32_t>{kEntered, kLeft, kEntered, kLeft, kThreadIn, kThreadOut, kThreadIn, kThreadOut}));
  ASSERT_EQ(bench.state.hole.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(bench.state.hole[i].place.zeta, i == 0 || i == 3 ? 1.0f : -1.0f);
    EXPECT_EQ(bench.state.hole[i].within, i % 2 == 0);
  }
  ASSERT_EQ(bench.state.thread.eyelet.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(bench.state.thread.eyelet[i].point, i);
  EXPECT_EQ(bench.state.needle[0].channels, 0u);
}

// Two sheets `apart`, and above them a needle at angle 0 with 160 nodes of thread, `segment` from each other. Returns the
// center of its circle.
Vec3 needle_over_two_sheets(Bench& bench, float apart, float segment) {
  const float down = wall::SheetShape{}.thickness + apart;
  put_two_sheets(bench, -down, [](const wall::SheetShape& shape, Vec3 p) {
    return std::min({p.x, shape.width - p.x, p.y, shape.height - p.y}) < 1e-4f;
  });
  const uint32_t n = bench.add_needle({}, {});
  const NeedleModel& needle = bench.model.needles.needle[0];
  const Vec3 circle = kCircle - Vec3{0, 0, down};
  place_body(bench.model.bodies.body[n], bench.body(n), on_circle(needle, circle, 0), 0);
  const Vec3 swage = swage_of(needle, bench.body(n).pose), along = normalized(Vec3{0.48f, 0, 0.14f}) * segment;
  std::vector<Vec3> path;
  for (int i = 159; i >= 0; --i) path.push_back(swage + along * static_cast<float>(i));
  bench.state.thread = thread::make_state(path);
  bench.state.needle[0].thread_node = 159;
  bench.start();
  return circle;
}

// Two sheets one above the other, as near to each other as walls that touch. A tip that comes out of the upper one is on the
// lower one at once, and makes a channel there as well. Thread follows through both, and nothing is jerked.
TEST(Needle, makes_a_channel_in_each_of_two_walls_that_touch) {
  for (const float apart : {0.05e-3f, 0.4e-3f, 1.5e-3f}) {
    Bench bench;
    float angle = 0;
    const Vec3 circle = needle_over_two_sheets(bench, apart, 0.5e-3f);
    const uint32_t n = 0;
    const NeedleModel& needle = bench.model.needles.needle[0];
    std::vector<uint32_t> events;
    float tension = 0;  // [N] of the thread, most
    const auto drive = [&](float to, size_t until) {
      for (; angle < to && events.size() < until; angle += 1.5e-3f) {
        bench.target[n] = {on_circle(needle, circle, angle), true};
        bench.step();
        const Needle& now = bench.state.needle[0];
        for (uint32_t bit = 1; bit <= kTornOut; bit *= 2)
          if (now.events & bit) events.push_back(bit);
        if (now.events & kEntered && events.size() < 4) {
          EXPECT_NEAR(now.entry_peak, 0.9f, 0.15f) << "apart " << apart << ", wall " << now.channels;
        }
        for (size_t i = 0; i < bench.state.thread.segments(); ++i) tension = std::max(tension, bench.state.thread.tension[i]);
      }
    };
    drive(1.8f, 4);
    ASSERT_EQ(events, (std::vector<uint32_t>{kEntered, kLeft, kEntered, kLeft})) << "apart " << apart;
    for (uint32_t c = 0; c < 2; ++c) {
      const Channel& channel = bench.state.needle[0].channel[c];
      EXPECT_EQ(channel.entry_side, 1.0f);
      EXPECT_EQ(channel.exit_side, -1.0f);
      for (uint32_t p = 0; p < channel.count; ++p) EXPECT_EQ(channel.point[p].face / kFacesOfSheet, c) << "within one wall";
    }
    drive(4.8f, 100);
    const size_t in = static_cast<size_t>(std::count(events.begin(), events.end(), uint32_t{kThreadIn})),
                 out = static_cast<size_t>(std::count(events.begin(), events.end(), uint32_t{kThreadOut}));
    std::printf("apart %.2f mm: thread in %zu, out %zu, tension up to %.2f N\n", 1e3 * static_cast<double>(apart), in, out,
                static_cast<double>(tension));
    EXPECT_EQ(in, 2u);
    EXPECT_EQ(out, 2u);
    ASSERT_EQ(bench.state.thread.eyelet.size(), 4u) << "the thread runs through both walls";
    for (size_t i = 0; i < 4; ++i)
      EXPECT_EQ(bench.state.hole[bench.state.thread.eyelet[i].point].place.face / kFacesOfSheet, i / 2)
          << "upper wall, then lower";
    EXPECT_EQ(std::count(events.begin(), events.end(), uint32_t{kTornOut}), 0);
    EXPECT_LT(tension, 1.0f) << "less than the needle needs";
  }
}

// A needle through two sheets that nearly touch; then it is drawn away, with 24 mm of thread. Between two
// holes so near to each other lies a node that waits there. Where it counted as thread, one of these draws took 2.5 N.
TEST(Needle, draws_its_thread_freely_through_two_walls_that_touch) {
  float most_of_all = 0;
  for (const float apart : {0.05e-3f, 0.1e-3f})
    for (const float segment : {0.5e-3f, 0.7e-3f})
      for (const Vec3 way : {Vec3{0, 0, -1}, Vec3{0.3f, 1, -0.5f}}) {
        Bench bench;
        float angle = 0;
        const Vec3 circle = needle_over_two_sheets(bench, apart, segment);
        const uint32_t n = 0;
        const NeedleModel& needle = bench.model.needles.needle[0];
        for (; angle < 4.8f; angle += 1.5e-3f) {
          bench.target[n] = {on_circle(needle, circle, angle), true};
          bench.step();
        }
        ASSERT_EQ(bench.state.thread.eyelet.size(), 4u);
        Pose hand = on_circle(needle, circle, angle);
        float most = 0;                  // [N]
        for (int i = 0; i < 400; ++i) {  // 60 mm/s
          hand.p += normalized(way) * 60e-6f;
          bench.target[n] = {hand, true};
          bench.step();
          for (size_t k = 0; k < bench.state.thread.segments(); ++k) most = std::max(most, bench.state.thread.tension[k]);
        }
        EXPECT_LT(most, 1.0f) << apart << " m apart, " << segment << " m, toward " << way.x << " " << way.y;
        most_of_all = std::max(most_of_all, most);
      }
  std::printf("8 draws, tension up to %.2f N\n", static_cast<double>(most_of_all));
}

// As before; then the needle comes back by a few millimeters and stays. The thread is slack, and lies in dents of both sheets
// where they press on each other. They shook there with 0.12 and 0.23 m/s: a node in a groove touched one of its faces at a
// time.
TEST(Needle, leaves_two_walls_that_touch_at_rest) {
  struct Way {
    float apart;
    Vec3 way;
    float back;  // [m]
  };
  for (const Way& w : {Way{0.05e-3f, {0.3f, 1, -0.5f}, 4e-3f}, Way{0.1e-3f, {0, 0, -1}, 10e-3f}}) {
    Bench bench;
    float angle = 0;
    const Vec3 circle = needle_over_two_sheets(bench, w.apart, 0.7e-3f);
    const NeedleModel& needle = bench.model.needles.needle[0];
    for (; angle < 4.8f; angle += 1.5e-3f) {
      bench.target[0] = {on_circle(needle, circle, angle), true};
      bench.step();
    }
    Pose hand = on_circle(needle, circle, angle);
    bench.model.thread.damping = 30, bench.model.thread.hole_grip = 0.03f;  // as in scenes
    const auto move = [&](Vec3 by, int steps) {
      for (int i = 0; i < steps; ++i) {
        hand.p += by;
        bench.target[0] = {hand, true};
        bench.step();
      }
    };
    move(normalized(w.way) * 60e-6f, 400);
    move(normalized(w.way) * -60e-6f, static_cast<int>(w.back / 60e-6f));
    move({}, 1200);
    float fastest = 0;  // [m/s] of the walls
    for (int i = 0; i < 200; ++i) {
      move({}, 1);
      for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c)
        fastest = std::max(fastest, length(wall::vec3(bench.state.wall.motion.v[2 * c])));
    }
    std::printf("%.2f mm apart: walls move with %.4f m/s\n", 1e3 * static_cast<double>(w.apart), static_cast<double>(fastest));
    EXPECT_LT(fastest, 3e-3f) << w.apart << " m apart";
  }
}

TEST(Needle, withdrawn_from_a_started_channel_it_leaves_nothing) {
  Bench bench;
  const uint32_t n = bench.add_needle({}, {});
  const NeedleModel& needle = bench.model.needles.needle[0];
  float angle = 0.3f, turn = 1.5e-3f;
  place_body(bench.model.bodies.body[n], bench.body(n), on_circle(needle, kCircle, angle), 0);
  bench.start();
  bool entered = false, withdrawn = false;
  while (angle > 0.29f) {
    angle += turn;
    bench.target[n] = {on_circle(needle, kCircle, angle), true};
    bench.step();
    if (bench.state.needle[0].events & kEntered) entered = true;
    if (bench.state.needle[0].events & kWithdrawn) withdrawn = true;
    if (angle > 1.2f) turn = -1.5e-3f;
  }
  EXPECT_TRUE(entered && withdrawn);
  EXPECT_EQ(bench.state.needle[0].channels, 0u);
  EXPECT_TRUE(bench.state.hole.empty());
  for (int i = 0; i < 500; ++i) bench.step();
  for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c)
    EXPECT_NEAR(wall::outer(bench.state.wall, c).z, 1.25e-3f, 0.05e-3f);
}

// The tip leans on the sheet at a slant and is pressed into it more and more, beyond what punctures. Drawn backward at the same
// time, it scratches the sheet or drags it along, and does not enter, however slowly; drawn forward, it enters.
TEST(Needle, drawn_backward_it_does_not_enter) {
  for (const float way : {-1.0f, 1.0f})
    for (const float speed : {2e-3f, 3e-3f, 4e-3f, 10e-3f}) {
      Bench bench;
      const uint32_t n = bench.add_needle({}, {});
      const NeedleModel& needle = bench.model.needles.needle[0];
      Pose hand = on_circle(needle, {0.015f, 0.0107f, 0.02f}, 1.5f * kPi - 0.36f - needle.shape.arc);
      const Vec3 tip = tip_of(needle, hand), tangent = arc_tangent(needle, hand, needle.shape.arc);
      ASSERT_NEAR(tangent.z, -0.352f, 0.01f);
      hand.p += Vec3{0.015f, 0.0107f, 1.35e-3f} - tip;
      place_body(bench.model.bodies.body[n], bench.body(n), hand, 0);
      bench.start();
      bool entered = false;
      float most = 0;  // [N]
      for (int i = 0; i < 6000 && !entered && most < 2; ++i) {
        hand.p += Vec3{way * std::copysign(speed, tangent.x), 0, -0.5f * speed} * 1e-3f;
        bench.target[n] = {hand, true};
        bench.step();
        entered |= (bench.state.needle[0].events & kEntered) != 0;
        most = std::max(most, length(bench.body(n).force));
      }
      std::printf("%s %.0f mm/s: %s, %.2f N\n", way < 0 ? "backward" : "forward", 1e3 * static_cast<double>(speed),
                  entered ? "entered" : "stayed out", static_cast<double>(most));
      EXPECT_EQ(entered, way > 0);
      EXPECT_GT(most, 0.8f);
    }
}

// The tip is in the sheet, not through it. Then the hand turns the needle about its tip until it lies along the sheet. The tip
// has cut no further: what the tissue gives beside the needle is not a way of its tip. Its depth in the material changes as
// much as its distance from the outer face in space, which follows from the poses of needle and wall alone.
TEST(Needle, turned_about_its_tip_it_does_not_sink_into_the_wall) {
  Bench bench;
  const uint32_t n = bench.add_needle({}, {});
  const NeedleModel& needle = bench.model.needles.needle[0];
  const Needle& in = bench.state.needle[0];
  float angle = 0.3f;
  place_body(bench.model.bodies.body[n], bench.body(n), on_circle(needle, kCircle, angle), 0);
  bench.start();
  while ((!in.inside || in.tip.zeta > 0.3f) && angle < 3) {
    angle += 1.5e-3f;
    bench.target[n] = {on_circle(needle, kCircle, angle), true};
    bench.step();
  }
  ASSERT_TRUE(in.inside);
  const float thickness = bench.model.wall.laminate.thickness;
  const auto depth = [&] { return 0.5f * (1 - in.tip.zeta) * thickness; };
  const auto depth_in_space = [&] {
    const Vec3 at = tip_of(needle, bench.body(n).pose);
    float nearest = 1, z = 0;
    for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c) {
      const Vec3 face = wall::outer(bench.state.wall, c);
      if (const float far = std::hypot(face.x - at.x, face.y - at.y); far < nearest) nearest = far, z = face.z;
    }
    return z - at.z;
  };
  const float before = depth(), before_in_space = depth_in_space();
  const Pose from = on_circle(needle, kCircle, angle), onward = on_circle(needle, kCircle, angle + 0.01f);
  const Vec3 tip = tip_of(needle, from), axis = normalized(rotation_vector(onward.q * conjugate(from.q)));
  const float turn = std::asin(std::min(1.0f, std::abs(arc_tangent(needle, from, needle.shape.arc).z)));
  for (int i = 1; i <= 400; ++i) {
    const Quat by = axis_angle(axis, turn * static_cast<float>(i) / 400);
    bench.target[n] = {{tip + rotate(by, from.p - tip), by * from.q}, true};
    bench.step();
  }
  const float sunk = depth() - before, sunk_in_space = depth_in_space() - before_in_space;
  std::printf("turned by %.2f rad: %.3f mm deeper in the material, %.3f mm in space\n", static_cast<double>(turn),
              1e3 * static_cast<double>(sunk), 1e3 * static_cast<double>(sunk_in_space));
  EXPECT_GT(turn, 0.3f);
  EXPECT_TRUE(in.inside);
  EXPECT_NEAR(sunk, sunk_in_space, 0.2e-3f) << "by 1.6 mm in the material alone when the give counted as a way";
}

// A hand moves a needle that is through the sheet once along y, across the plane of its arc, to the sheet's border. The tissue
// is a spring between needle and channel. At the strength of a bite the needle tears a slit, which is as long as its way.
TEST(Needle, drawn_across_its_channel_it_tears_a_slit_with_the_strength_of_a_bite) {
  for (const float speed : {0.02f, 0.06f}) {
    Bench bench;
    const uint32_t n = bench.add_needle({}, {});
    const NeedleModel& needle = bench.model.needles.needle[0];
    const Needle& in = bench.state.needle[0];
    const Model& m = bench.model;
    float angle = 0.3f;
    place_body(m.bodies.body[n], bench.body(n), on_circle(needle, kCircle, angle), 0);
    bench.start();
    const auto hold = [&](Vec3 center) {
      bench.target[n] = {on_circle(needle, center, angle), true};
      bench.step();
    };
    while (!(in.events & kLeft) && angle < 3) angle += 1.5e-3f, hold(kCircle);
    for (int i = 0; i < 100; ++i) angle += 1.5e-3f, hold(kCircle);
    for (int i = 0; i < 200; ++i) hold(kCircle);
    ASSERT_EQ(in.channels, 1u);
    const auto place = [&](const wall::Point& p) {
      return wall::place(wall::weights(m.wall, bench.state.wall.topology, p), bench.state.wall.motion);
    };
    float most = 0, y = 0, slit = 0;
    int compared = 0;
    std::vector<float> while_far;  // [N] while the slit is longer than 1 mm and more than 5 mm from the border
    while (in.channels > 0 && y < 0.03f) {
      y += speed * m.wall.step;
      hold(kCircle + Vec3{0, y, 0});
      if (in.channels == 0) break;
      const Channel& c = in.channel[0];
      float across = 0;  // [m] sum over its points
      for (uint32_t p = 0; p < c.count; ++p) {
        const Vec3 at = place(c.point[p]);
        Vec3 near = arc_point(needle, bench.body(n).pose, 0);
        for (float a = 0; a < needle.shape.arc; a += 0.01f) {
          const Vec3 on = arc_point(needle, bench.body(n).pose, a);
          if (distance(on, at) < distance(near, at)) near = on;
        }
        across += near.y - at.y;
      }
      const float force = -bench.body(n).force.y;
      most = std::max(most, force);
      if (c.torn[0] == 0 && force > 1 && force < 3) {
        EXPECT_NEAR(force, m.needles.law.side_stiffness * across, 0.1f * force);
        ++compared;
      }
      const Vec3 entry = place(c.point[0]);
      // At rest, toward the border: the needle draws the wall out, and together before itself, by millimeters.
      slit = c.torn[0] > 0 ? edge_distance(m, bench.state, c.made[0]) - edge_distance(m, bench.state, c.point[0]) : 0;
      if (slit > 1e-3f && entry.y < 0.02f - 5e-3f) while_far.push_back(force);
    }
    std::sort(while_far.begin(), while_far.end());
    const float median = while_far.empty() ? 0 : while_far[while_far.size() / 2];
    std::printf("at %.0f mm/s: %zu steps, median %.2f N, at most %.2f N; slit of %.2f mm when the needle came out\n",
                1e3 * static_cast<double>(speed), while_far.size(), static_cast<double>(median), static_cast<double>(most),
                1e3 * static_cast<double>(slit));
    EXPECT_GT(compared, 5);
    EXPECT_NEAR(median, 4.62f, 1.4f) << speed;  // Gong et al. 2023, 10.1115/1.4063951: a bite of thread
    EXPECT_NEAR(slit, 0.02f - kCircle.y, 0.5e-3f) << speed;
    EXPECT_EQ(in.channels, 0u);
    EXPECT_FALSE(in.inside);
  }
}

// A needle that lies flat on the sheet is pressed on it with all that a hand can. The wall gives beside its elements (4 N/mm of
// a contact), and still nothing passes.
TEST(Needle, pressed_flat_on_the_wall_it_dents_it_and_does_not_pass) {
  Bench bench;
  const NeedleShape shape;
  const Pose above{{0.015f, 0.01f, 1.25e-3f + shape.wire_radius + 0.2e-3f}, {}};
  const uint32_t n = bench.add_needle(shape, above);
  bench.start();
  float gentle = 0, most = 0, force = 0;
  for (const float down : {0.5e-3f, 20e-3f}) {
    for (int i = 0; i < 600; ++i) {
      Pose to = above;
      to.p.z -= down;
      bench.target[n] = {to, true};
      bench.step();
      if (i < 300) continue;
      float& overlap = down < 1e-3f ? gentle : most;
      overlap = std::max(overlap, bench.overlap(n));
      force = length(bench.body(n).force);
    }
  }
  std::printf("overlap %.3f mm, at %.1f N %.3f mm\n", 1e3 * static_cast<double>(gentle), static_cast<double>(force),
              1e3 * static_cast<double>(most));
  EXPECT_LT(gentle, 0.1e-3f);
  EXPECT_NEAR(force, 8, 0.3f);
  EXPECT_LT(most, 0.3e-3f);
}

TEST(Needle, jaws_hold_it_by_friction) {
  for (const float grip : {20.0f, 1.0f}) {
    Bench bench;
    const uint32_t n = bench.add_needle({}, {});
    const NeedleModel& needle = bench.model.needles.needle[0];
    const Pose pose = on_circle(needle, {0.015f, 0.01f, 0.03f}, 0);
    place_body(bench.model.bodies.body[n], bench.body(n), pose, 0);
    const Vec3 at = arc_point(needle, pose, 1), out = normalized(at - Vec3{0.015f, 0.01f, 0.03f});
    const Vec3 across = cross(arc_tangent(needle, pose, 1), out);
    Pose jaws{at, from_axes(across, cross(out, across), out)};
    const uint32_t t = bench.add(make_tool({}), jaws, 0.06f);
    // A thread pulls at the swage along the arc's tangent in the jaws, with 2 N.
    bench.start();
    for (int i = 0; i < 100; ++i) bench.target[t] = {jaws, true, 0, grip}, bench.step();
    ASSERT_EQ(bench.body(t).grip.what, Gripped::needle);
    const Vec3 before = to_local(bench.body(t).pose, bench.body(n).pose.p);
    const Vec3 pull = arc_tangent(needle, pose, 1) * 2.0f;
    for (int i = 0; i < 60; ++i) {
      bench.target[t] = {jaws, true, 0, grip};
      bench.target[n].load = pull;  // at the needle's center
      bench.step();
    }
    const float moved = distance(to_local(bench.body(t).pose, bench.body(n).pose.p), before);
    // Two jaws of friction 0.35 at 20 N bear 14 N, at 1 N 0.7 N.
    if (grip > 10) {
      EXPECT_LT(moved, 0.3e-3f);
    } else {
      EXPECT_GT(moved, 1e-3f);
    }
  }
}

// Jaws that hold the needle at its tip lead it and its thread through the air. Needle and thread weigh about the same there: an
// exchange of forces that counts a deviation twice makes them tremble against each other.
TEST(Needle, leads_its_thread_without_a_tremor) {
  Bench bench;
  bench.model.bodies.gravity = {};
  const uint32_t n = bench.add_needle({}, {});
  const NeedleModel& needle = bench.model.needles.needle[0];
  const Pose pose = on_circle(needle, {0.015f, 0.01f, 0.15f}, 0);
  place_body(bench.model.bodies.body[n], bench.body(n), pose, 0);
  const Vec3 swage = swage_of(needle, pose), back = arc_tangent(needle, pose, 0) * -1.0f;
  std::vector<Vec3> path;
  for (int i = 120; i >= 0; --i) {  // in an arc
    constexpr float kRadius = 0.02f;
    const float angle = 0.7e-3f / kRadius * static_cast<float>(i);
    path.push_back(swage + back * (kRadius * std::sin(angle)) + Vec3{0, kRadius * (1 - std::cos(angle)), 0});
  }
  bench.state.thread = thread::make_state(path);
  bench.state.needle[0].thread_node = 120;
  const Vec3 at = arc_point(needle, pose, 2.6f), out = normalized(at - Vec3{0.015f, 0.01f, 0.15f});
  const Vec3 across = cross(arc_tangent(needle, pose, 2.6f), out);
  Pose jaws{at, from_axes(across, cross(out, across), out)};
  const uint32_t t = bench.add(make_tool({}), jaws, 0.06f);
  bench.start();
  for (int i = 0; i < 100; ++i) bench.target[t] = {jaws, true, 0, 20}, bench.step();
  ASSERT_EQ(bench.body(t).grip.what, Gripped::needle);
  const Vec3 forward = arc_tangent(needle, pose, 0);
  double trembles = 0;
  float before = 0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    jaws.p += forward * (40e-3f * bench.model.wall.step * std::min(1.0f, static_cast<float>(i) / 200));
    bench.target[t] = {jaws, true, 0, 20};
    bench.step();
    const float now = bench.state.thread.tension[119];
    if (i > 0) trembles += static_cast<double>(std::abs(now - before)) / (kSteps - 1);
    before = now;
  }
  std::printf("tension changed by %.5f N in a step\n", trembles);
  EXPECT_LT(trembles, 1e-3);  // with a mass of 5 g and the whole way in each step: 17e-3
  EXPECT_LT(distance(swage_of(needle, bench.body(n).pose), bench.state.thread.position(120)), 0.02e-3f) << "the thread follows";
}

// A straight thread along x at height z over the middle of the sheet.
void lay_thread(Bench& bench, float z) {
  std::vector<Vec3> path;
  for (int i = 0; i < 121; ++i) path.push_back({-0.015f + 0.5e-3f * static_cast<float>(i), 0.01f, z});
  bench.state.thread = thread::make_state(path);
}

TEST(Tool, a_thread_over_its_shaft_pulls_with_both_ends) {
  Bench bench;
  lay_thread(bench, 0.03f);
  // The shaft lies above the thread's middle, along y.
  const Pose pose{{0.015f, -0.04f, 0.0335f}, Quat{-0.70710678f, 0, 0, 0.70710678f}};
  const uint32_t t = bench.add(make_tool({}), pose);
  bench.start();
  const float pull = 0.5f, c = 0.6f, s = 0.8f;  // both ends upward
  const thread::Pull ends[2] = {{0, Vec3{-c, 0, s} * pull}, {120, Vec3{c, 0, s} * pull}};
  Vec3 mean{}, hand{};
  for (int i = 0; i < 500; ++i) {
    bench.target[t] = {pose, true};
    Hands hands;
    hands.targets = bench.target, hands.pulls = ends;
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
    if (i >= 400) mean += bench.body(t).force * 0.01f, hand += bench.body(t).hand_force * 0.01f;
  }
  EXPECT_NEAR(mean.z, 2 * s * pull, 0.02f);
  EXPECT_NEAR(hand.z, -mean.z, 0.02f);
}

// A hand of 5 N drives the shaft with 1 m/s into a thread whose ends are held: it swings about 5 N. The thread's load makes the
// tool heavier for the solver (feel_thread). What was added moved on with the tool, and the thread took 60 N.
TEST(Tool, a_thread_is_pressed_no_harder_than_the_hand_can) {
  Bench bench;
  lay_thread(bench, 0.03f);
  Pose pose{{0.015f, -0.04f, 0.036f}, Quat{-0.70710678f, 0, 0, 0.70710678f}};
  const uint32_t t = bench.add(make_tool({}), pose);
  bench.model.bodies.body[t].max_force = 5;
  bench.start();
  thread::Hold ends[2];
  for (int k = 0; k < 2; ++k) {
    ends[k].node = k == 0 ? 0 : 120;
    ends[k].from = ends[k].to = bench.state.thread.position(ends[k].node);
    ends[k].stiffness = 2000, ends[k].limit = 50;
  }
  float most = 0, mean = 0;  // [N] on the tool; the mean from 0.1 to 0.3 s, two swings
  for (int i = 0; i < 300; ++i) {
    pose.p.z -= 1e-3f;
    bench.target[t] = {pose, true};
    Hands hands;
    hands.targets = bench.target, hands.holds = ends;
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
    most = std::max(most, bench.body(t).force.z);
    if (i >= 100) mean += bench.body(t).force.z / 200;
  }
  EXPECT_LT(most, 15);
  EXPECT_NEAR(mean, 5, 0.5f);
}

TEST(Tool, jaws_hold_a_thread_up_to_twice_friction_times_force) {
  // Two jaws of friction 0.35 at 4 N: 2.8 N.
  for (const float pull : {2.0f, 3.6f}) {
    Bench bench;
    lay_thread(bench, 0.03f);
    const Pose pose{{0.015f, 0.01f, 0.03f}, axis_angle({0, 0, 1}, 0.5f * kPi)};  // jaws open along y
    const uint32_t t = bench.add(make_tool({}), pose, 0.06f);
    bench.start();
    for (int i = 0; i < 60; ++i) bench.target[t] = {pose, true, 0, 4}, bench.step();
    ASSERT_EQ(bench.body(t).grip.what, Gripped::thread);
    Vec3 felt{};
    for (int i = 0; i < 400; ++i) {
      const thread::Pull end{120, {pull * std::min(1.0f, static_cast<float>(i) / 200), 0, 0}};
      Hands hands;
      hands.targets = bench.target, hands.pulls = {&end, 1};
      physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
      if (i >= 300) felt += bench.body(t).force * 0.01f;
    }
    if (pull < 2.8f) {
      EXPECT_EQ(bench.body(t).grip.what, Gripped::thread);
      EXPECT_LT(bench.body(t).grip.slid, 0.3e-3f);
      EXPECT_NEAR(felt.x, pull, 0.1f);
    } else {
      EXPECT_TRUE(bench.body(t).grip.what == Gripped::nothing || bench.body(t).grip.slid > 3e-3f);
    }
  }
}

// A zigzag of thread, 4 mm behind the tips, where the jaws shut without holding it. It gives way: otherwise they would stretch
// it with up to 16 N.
TEST(Tool, jaws_that_shut_on_a_kink_of_thread_do_not_stretch_it) {
  float most = 0;
  for (const int folds : {1, 2, 3}) {
    Bench bench;
    const float l = 0.5e-3f;
    std::vector<Vec3> path;
    for (int i = 0; i < 40; ++i) path.push_back({0.015f - l * static_cast<float>(40 - i), 0.01f, 0.03f});
    const auto add = [&](Vec3 way) { path.push_back(path.back() + way * l); };
    for (int i = 0; i < 4 * folds; ++i) add(normalized(Vec3{0.1f, i / 2 % 2 ? -0.7f : 0.7f, 0.7f}));
    for (int i = 0; i < 40; ++i) add({1, 0, 0});
    bench.state.thread = thread::make_state(path);
    const Pose pose{{0.015f, 0.01f, 0.026f}, axis_angle({0, 0, 1}, 0.5f * kPi)};  // jaws open along y
    const uint32_t t = bench.add(make_tool({}), pose, 0.06f);
    const uint32_t last = static_cast<uint32_t>(path.size()) - 1;
    const thread::Pull ends[] = {{0, {-0.2f, 0, 0}}, {last, {0.2f, 0, 0}}};
    bench.pulls = ends;
    bench.start();
    for (int i = 0; i < 400; ++i) {
      bench.target[t] = {pose, true, 0, 4}, bench.step();
      if (bench.body(t).opening < 0.01f)
        for (const float tension : bench.state.thread.tension) most = std::max(most, tension);
    }
    EXPECT_LT(bench.body(t).opening, 0.01f) << "they have shut";
  }
  EXPECT_LT(most, 6);
  EXPECT_GT(most, 1) << "there was something between them";
}

// Two strands between the same jaws, such as the crossing of a throw: each carries half of the friction. The thread turns back
// 6 mm behind the jaws.
TEST(Tool, jaws_pinch_both_strands_that_lie_between_them) {
  Bench bench;
  std::vector<Vec3> path;
  const auto add = [&](Vec3 to) {
    while (distance(path.back(), to) > 0.75e-3f) path.push_back(path.back() + normalized(to - path.back()) * 0.5e-3f);
  };
  path.push_back({0, 0.01f + 0.18e-3f, 0.03f});
  add({0.02f, 0.01f + 0.18e-3f, 0.03f}), add({0.024f, 0.012f, 0.03f}), add({0.026f, 0.010f, 0.03f});
  add({0.024f, 0.008f, 0.03f}), add({0.02f, 0.01f - 0.18e-3f, 0.03f}), add({0, 0.01f - 0.18e-3f, 0.03f});
  bench.state.thread = thread::make_state(path);
  const Pose pose{{0.015f, 0.01f, 0.03f}, axis_angle({0, 0, 1}, 0.5f * kPi)};  // jaws open along y
  const uint32_t t = bench.add(make_tool({}), pose, 0.06f);
  bench.start();
  for (int i = 0; i < 60; ++i) bench.target[t] = {pose, true, 0, 8}, bench.step();
  ASSERT_EQ(bench.body(t).grip.what, Gripped::thread);
  ASSERT_EQ(bench.body(t).grip.count, 2u);
  Vec3 felt{};
  const uint32_t last = static_cast<uint32_t>(path.size()) - 1;
  for (int i = 0; i < 1000; ++i) {
    const float pull = 2 * std::min(1.0f, static_cast<float>(i) / 800);
    const thread::Pull ends[] = {{0, {-pull, 0, 0}}, {last, {-pull, 0, 0}}};
    Hands hands;
    hands.targets = bench.target, hands.pulls = ends;
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
    if (i >= 900) felt += bench.body(t).force * 0.01f;
  }
  EXPECT_EQ(bench.body(t).grip.count, 2u);
  EXPECT_NEAR(felt.x, -4, 0.15f) << "one strand alone slides out at 2.8 N";
}

// Five turns of thread lie round the shaft, which weighs about what they do near its tip. They do not rock it ever harder: with
// the force of the last step alone they came to 34 N.
TEST(Tool, turns_round_its_shaft_come_to_rest) {
  Bench bench;
  ToolShape shape;
  shape.shaft_radius = 2.5e-3f;
  const Pose pose{{0.015f, 0.01f, 0.03f}, axis_angle({1, 0, 0}, -0.5f * kPi)};  // the shaft leads along +y
  const uint32_t t = bench.add(make_tool(shape), pose);
  const float d = bench.model.thread.material.diameter, round = shape.shaft_radius + 0.6f * d, turns = 5;
  const auto at = [&](float s) {  // s 0..1 along the turns
    const float angle = 2 * kPi * turns * s;
    return transform(pose, {round * std::sin(angle), -round * std::cos(angle), 18e-3f + 15e-3f * s});
  };
  std::vector<Vec3> fine;
  const Vec3 along = rotate(pose.q, {1, 0, 0});
  for (int i = 0; i <= 200; ++i) fine.push_back(at(0) - along * (20e-3f * (1 - static_cast<float>(i) / 200)));
  for (int i = 1; i <= 1000; ++i) fine.push_back(at(static_cast<float>(i) / 1000));
  for (int i = 1; i <= 200; ++i) fine.push_back(at(1) + along * (20e-3f * static_cast<float>(i) / 200));
  bench.state.thread = thread::make_state(validation::resample(fine, 2 * d));
  bench.start();
  const uint32_t last = static_cast<uint32_t>(bench.state.thread.nodes()) - 1;
  const thread::Pull ends[2] = {{0, along * -0.1f}, {last, along * 0.1f}};
  float most = 0;
  for (int i = 0; i < 600; ++i) {
    Pose now = pose;
    now.p.x += 1e-3f * std::min(1.0f, static_cast<float>(i) / 20);  // the hand twitches
    bench.target[t] = {now, true};
    Hands hands;
    hands.targets = bench.target, hands.pulls = ends;
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
    if (i > 100)
      for (const float tension : bench.state.thread.tension) most = std::max(most, tension);
  }
  std::printf("largest tension %.2f N\n", static_cast<double>(most));
  EXPECT_LT(most, 0.2f) << "both ends are pulled with 0.1 N";
}

// A strand of 3 mm between jaws and a fixed place is stiffer than the grip: the jaws stay still on it.
TEST(Tool, jaws_on_a_short_taut_strand_are_still) {
  Bench bench;
  lay_thread(bench, 0.03f);
  Pose pose{{0.015f, 0.01f, 0.03f}, axis_angle({0, 0, 1}, 0.5f * kPi)};
  const uint32_t t = bench.add(make_tool({}), pose, 0.06f);
  bench.start();
  for (int i = 0; i < 60; ++i) bench.target[t] = {pose, true, 0, 8}, bench.step();
  ASSERT_EQ(bench.body(t).grip.what, Gripped::thread);
  thread::Hold fixed;
  fixed.node = bench.body(t).grip.node + 6;
  fixed.from = fixed.to = bench.state.thread.position(fixed.node);
  float least = 1e9f, most = 0;
  for (int i = 0; i < 600; ++i) {
    Pose at = pose;
    at.p.x -= 2e-3f * std::min(1.0f, static_cast<float>(i) / 300);
    bench.target[t] = {at, true, 0, 8};
    Hands hands;
    hands.targets = bench.target, hands.holds = {&fixed, 1};
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
    if (i >= 500) least = std::min(least, bench.body(t).force.x), most = std::max(most, bench.body(t).force.x);
  }
  EXPECT_GT(least, 0.5f);
  EXPECT_LT(most - least, 0.02f * most);
  EXPECT_LT(bench.body(t).grip.slid, 0.1e-3f);
}

// A tool high above the sheet whose jaws open along y, round which a thread along x is wound `turns` times. The thread's first
// part lies between the jaws. Both ends are pulled, then fixed.
struct WoundJaws {
  Bench bench;
  std::vector<Vec3> path;
  uint32_t tool = 0;
  thread::Hold fixed[2];
  const Pose pose{{0.015f, 0.01f, 0.03f}, axis_angle({0, 0, 1}, 0.5f * kPi)};
  void add(Vec3 to) {
    while (distance(path.back(), to) > 0.75e-3f) path.push_back(path.back() + normalized(to - path.back()) * 0.5e-3f);
  }
  WoundJaws(float turns, float pull) {
    path.push_back({-0.02f, 0.01f, 0.03f}), add({0.018f, 0.01f, 0.03f});
    for (float a = 0; a < 2 * kPi * turns; a += 0.1f)
      add({0.015f + 2.3e-3f * std::cos(a), 0.01f + 2.6e-3f * std::sin(a), 0.031f + 0.6e-3f * a / (2 * kPi)});
    add({0.018f, 0.01f, path.back().z}), add({0.04f, 0.01f, path.back().z});
    bench.state.thread = thread::make_state(path);
    tool = bench.add(make_tool({}), pose, 0.03f);
    bench.start();
    const uint32_t last = static_cast<uint32_t>(path.size()) - 1;
    for (int i = 0; i < 400; ++i) {
      const float now = pull * std::min(1.0f, static_cast<float>(i) / 200);
      const thread::Pull ends[] = {{0, {-now, 0, 0}}, {last, {now, 0, 0}}};
      step(0, 8, {}, ends);
    }
    fixed[0].node = 0, fixed[1].node = last;
    for (thread::Hold& f : fixed) f.from = f.to = bench.state.thread.position(f.node);
  }
  void step(float opening, float grip, std::span<thread::Hold> holds, std::span<const thread::Pull> pulls) {
    bench.target[tool] = {pose, true, opening, grip};
    Hands hands;
    hands.targets = bench.target, hands.holds = holds, hands.pulls = pulls;
    physical::step(bench.model, bench.state, *bench.scratch, hands, *bench.jobs);
  }
  float largest() const { return *std::max_element(bench.state.thread.tension.begin(), bench.state.thread.tension.end()); }
};

// A hand opens jaws at once, with 2 N at their tips. Each turn, 1.3 mm behind the tips' middle, pulls each jaw inward with at
// least one strand, its lever to the hinge being 10.7 mm of 12: it can bear no more than 1.12 N, half of that in two turns.
TEST(Tool, jaws_that_open_within_a_throw_load_its_thread_gently) {
  for (const float turns : {0.0f, 1.0f, 2.0f}) {
    WoundJaws wound(turns, 0.3f);
    const Body& body = wound.bench.body(wound.tool);
    ASSERT_EQ(body.grip.what, Gripped::thread);
    float most = 0;
    for (int i = 0; i < 500; ++i) wound.step(0.07f, 0, wound.fixed, {}), most = std::max(most, wound.largest());
    EXPECT_EQ(body.grip.what, Gripped::nothing);
    EXPECT_LT(most, turns > 0 ? 1.1f * 1.12f / turns : 0.6f) << turns << " turns";
    if (turns == 0) { EXPECT_NEAR(body.opening, 0.07f, 1e-3f); }
  }
}

TEST(Tool, jaws_lift_the_wall_and_slide_off_above_their_friction) {
  for (const float grip : {20.0f, 2.0f}) {  // 14 N, 1.4 N
    Bench bench;
    const uint32_t t = bench.add(make_tool({}), {{0.0158f, 0.0107f, 0.0022f}, {}}, 0.09f);
    bench.start();
    float z = 0.0022f;
    for (int i = 0; i < 150; ++i) bench.target[t] = {{{0.0158f, 0.0107f, z}, {}}, true, 0, grip}, bench.step();
    ASSERT_EQ(bench.body(t).grip.what, Gripped::tissue);
    float most = 0;
    for (int i = 0; i < 400; ++i) {
      z = std::min(0.0072f, z + 2e-5f);
      bench.target[t] = {{{0.0158f, 0.0107f, z}, {}}, true, 0, grip};
      bench.step();
      most = std::max(most, -bench.body(t).force.z);
    }
    float top = 0;
    for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c) top = std::max(top, wall::outer(bench.state.wall, c).z);
    if (grip > 10) {
      EXPECT_EQ(bench.body(t).grip.what, Gripped::tissue);
      EXPECT_GT(top, 4e-3f);
      EXPECT_GT(most, 1.5f);
      EXPECT_NEAR(bench.body(t).hand_force.z, -bench.body(t).force.z, 0.05f);
    } else {
      EXPECT_LT(most, 1.5f);
    }
  }
}

// Jaws hold the sheet's free edge thinner than it is, turn it, and let go of it slowly: what they store in it is small, so no
// part of it flies off.
TEST(Tool, jaws_that_let_go_of_an_edge_do_not_throw_it) {
  for (const float turn : {0.0f, 0.3f, 0.6f}) {
    Bench bench(0.03f, 0.02f, true);
    const Vec3 at{0.015f, 0.0025f, 0.6e-3f};
    const auto pose = [&](float angle) {
      const Vec3 x{std::sin(angle), 0, std::cos(angle)}, z{0, -1, 0};
      return Pose{at, from_axes(x, cross(z, x), z)};
    };
    const uint32_t t = bench.add(make_tool({}), pose(0), 0.15f);
    bench.start();
    for (int i = 0; i < 400; ++i) {
      const float angle = turn * std::clamp(static_cast<float>(i - 150) / 200, 0.0f, 1.0f);
      bench.target[t] = {pose(angle), true, 0, 20};
      bench.step();
    }
    ASSERT_EQ(bench.body(t).grip.what, Gripped::tissue);
    float fastest = 0;
    for (int i = 0; i < 150; ++i) {
      bench.target[t] = {pose(turn), true, std::min(0.2f, 0.04f + 2e-3f * static_cast<float>(i)), 0};
      bench.step();
      for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c)
        for (const float side : {-1.0f, 1.0f})
          fastest = std::max(fastest, length(wall::velocity(wall::at_column(c, side), bench.state.wall.motion)));
    }
    EXPECT_EQ(bench.body(t).grip.what, Gripped::nothing);
    EXPECT_EQ(bench.body(t).skip, 0u) << "parted";
    EXPECT_LT(fastest, 1.0f) << turn;
  }
}

// Jaws that close to take a thread, with the sheet's edge between them, stop at it: they squeeze it with a limited force.
TEST(Tool, jaws_that_close_for_thread_do_not_crush_an_edge) {
  for (const float turn : {0.0f, 0.3f, 0.6f}) {
    Bench bench(0.03f, 0.02f, true);
    const Vec3 at{0.015f, 0.0025f, 0.6e-3f}, x{std::sin(turn), 0, std::cos(turn)}, z{0, -1, 0};
    const Pose pose{at, from_axes(x, cross(z, x), z)};
    const uint32_t t = bench.add(make_tool({}), pose, 0.25f);
    bench.start();
    float fastest = 0, squeezed = 0;  // [m/s]; [N] by one jaw
    for (int i = 0; i < 300; ++i) {
      bench.target[t] = {pose, true, 0, 20, 2};
      bench.step();
      float now = 0;
      for (const RowMemory& m : bench.state.bodies.memory) now += std::max(0.0f, dot(m.impulse, x)) / bench.model.wall.step;
      squeezed = std::max(squeezed, now);
      for (uint32_t c = 0; c < wall::columns(bench.state.wall); ++c)
        for (const float side : {-1.0f, 1.0f})
          fastest = std::max(fastest, length(wall::velocity(wall::at_column(c, side), bench.state.wall.motion)));
    }
    EXPECT_EQ(bench.body(t).grip.what, Gripped::nothing);
    EXPECT_LT(fastest, 0.5f) << turn;
    EXPECT_LT(bench.overlap(t), 0.3e-3f) << turn;
    EXPECT_LT(squeezed, 10) << turn;
  }
}

// Two sheets face to face, 2 mm apart, their free edges between the jaws: closed, the jaws bring the edges together; drawn
// back, they carry both along; opened, they let go of both.
TEST(Tool, jaws_hold_both_of_two_edges_between_them) {
  Bench bench(0.03f, 0.02f, true);
  constexpr float kApart = 2e-3f;  // [m]
  constexpr float kThickness = wall::SheetShape{}.thickness;
  put_two_sheets(bench, kThickness + kApart,
                 [](const wall::SheetShape& shape, Vec3 p) { return p.y > 0.5f * shape.height - 1e-4f; });
  const size_t columns = wall::columns(bench.state.wall) / 2;
  const float middle = 0.5f * (kThickness + kApart);
  const auto pose = [&](float back) {
    const Vec3 x{0, 0, 1}, z{0, -1, 0};
    return Pose{Vec3{0.015f, 0.0025f - back, middle}, from_axes(x, cross(z, x), z)};
  };
  const uint32_t t = bench.add(make_tool({}), pose(0), 0.4f);
  bench.start();
  const auto at = [&](size_t sheet, size_t row) {  // [m] in the middle of the sheet's width; row 0 is the edge
    return wall::place(wall::at_column(static_cast<uint32_t>(sheet * columns + 13 * row + 6), 0), bench.state.wall.motion);
  };
  const auto at_edge = [&](size_t sheet) { return at(sheet, 0); };
  const std::array<Vec3, 2> before{at_edge(0), at_edge(1)};
  float back = 0;  // [m] of the tool
  const auto run = [&](int steps, float to, float opening, float grip) {
    for (int i = 0; i < steps; ++i) {
      back += std::clamp(to - back, -5e-6f, 5e-6f);
      bench.target[t] = {pose(back), true, opening, grip};
      bench.step();
    }
  };
  run(800, 0, 0, 6);
  ASSERT_EQ(bench.body(t).grip.what, Gripped::tissue);
  const float gap = at_edge(1).z - at_edge(0).z - kThickness;
  EXPECT_LT(gap, 0.2e-3f) << "closed";
  EXPECT_GT(gap, -0.1e-3f) << "neither edge is in the other";
  const std::array<Vec3, 3> held{at(0, 1), at(1, 1), bench.body(t).pose.p};
  run(900, 1.5e-3f, 0, 6);
  const float drawn = held[2].y - bench.body(t).pose.p.y;
  EXPECT_GT(drawn, 0.5e-3f);
  for (const size_t sheet : {size_t{0}, size_t{1}})
    EXPECT_GT(held[sheet].y - at(sheet, 1).y, 0.8f * drawn) << "drawn along: sheet " << sheet;
  run(1500, 1.5e-3f, 0.4f, 0);
  EXPECT_EQ(bench.body(t).grip.what, Gripped::nothing);
  for (const size_t sheet : {size_t{0}, size_t{1}})
    EXPECT_LT(distance(before[sheet], at_edge(sheet)), 0.1e-3f) << "let go, neither is hooked into the other: sheet " << sheet;
}

// Two edges that lie on each other are squeezed to less than one and a half of a wall before the jaws hold anything.
TEST(Tool, jaws_hold_both_of_two_edges_that_are_squeezed) {
  Bench bench(0.03f, 0.02f, true);
  constexpr float kThickness = wall::SheetShape{}.thickness;
  put_two_sheets(bench, kThickness + 0.1e-3f,
                 [](const wall::SheetShape& shape, Vec3 p) { return p.y > 0.5f * shape.height - 1e-4f; });
  const Vec3 x{0, 0, 1}, z{0, -1, 0};
  const Pose pose{Vec3{0.015f, 0.0025f, 0.5f * kThickness}, from_axes(x, cross(z, x), z)};
  const uint32_t t = bench.add(make_tool({}), pose, 0.4f);
  bench.start();
  Body& tool = bench.body(t);
  const auto close = [&](int steps, uint32_t may_hold) {
    for (int i = 0; i < steps; ++i) {
      bench.target[t] = {pose, true, 0, 6, may_hold};
      bench.step();
    }
  };
  close(400, 3);  // not tissue
  EXPECT_EQ(tool.grip.what, Gripped::nothing);
  const auto jaw = [&](float side) {
    return transform(tool.pose, Vec3{side * tool.opening * bench.model.bodies.body[t].hinge_z, 0, 0});
  };
  EXPECT_LT(distance(jaw(-1), jaw(1)), 1.5f * kThickness);
  close(200, 7);
  ASSERT_EQ(tool.grip.what, Gripped::tissue);
  std::array<int, 2> points{};
  for (uint32_t i = 0; i < tool.grip.count; ++i) ++points[tool.grip.point[i].tissue.face < kFacesOfSheet ? 0 : 1];
  EXPECT_EQ(points[0], 2);
  EXPECT_EQ(points[1], 2);
}

// Two hands push their instruments into each other, a strand between them. They pass through each other in scenes, so that the
// strand is inside both: it gives way and does not break.
TEST(Tool, thread_between_two_instruments_does_not_break) {
  for (const float shift : {0.0f, 0.8e-3f, 1.6e-3f}) {
    Bench bench;
    bench.model.bodies.pair_contact = false;
    std::vector<Vec3> path;
    for (int i = 0; i < 60; ++i) path.push_back({1e-3f * static_cast<float>(i) - 0.015f, 0.01f, 0.02f});
    bench.state.thread = thread::make_state(path);
    const auto pose = [&](float side, float way) {
      return Pose{{0.015f + 0.5f * side * shift, 0.01f + side * way, 0.02f}, {}};
    };
    const uint32_t a = bench.add(make_tool({}), pose(1, 4e-3f)), b = bench.add(make_tool({}), pose(-1, 4e-3f));
    bench.start();
    float most = 0;
    for (int i = 0; i < 300; ++i) {
      const float way = std::max(0.0f, 4e-3f - 5e-5f * static_cast<float>(i));
      bench.target[a] = {pose(1, way), true, 0.1f}, bench.target[b] = {pose(-1, way), true, 0.1f};
      bench.step();
      for (const float t : bench.state.thread.tension) most = std::max(most, t);
    }
    EXPECT_EQ(std::count(bench.state.thread.broken.begin(), bench.state.thread.broken.end(), 1), 0);
    EXPECT_LT(most, 12) << shift;
  }
}

// Surface to surface [m], of the drawn cones, sampled densely; negative: overlap.
float distance_of(const Bench& bench, uint32_t a, uint32_t b) {
  struct Ball {
    Vec3 at;
    float r;
  };
  const auto balls = [&](uint32_t i) {
    const BodyModel& m = bench.model.bodies.body[i];
    const Body& body = bench.state.bodies.body[i];
    std::vector<Ball> all;
    for (const BodyCapsule& c : m.capsule)
      for (float t = 0; t <= 1; t += 0.25f)
        all.push_back(
            {transform(body.pose, lerp(local(m, m.sphere[c.a], body.opening), local(m, m.sphere[c.b], body.opening), t)),
             std::abs(m.sphere[c.a].radius) * (1 - t) + std::abs(m.sphere[c.b].radius) * t});
    return all;
  };
  float least = 1;
  const std::vector<Ball> second = balls(b);
  for (const Ball& p : balls(a))
    for (const Ball& q : second) least = std::min(least, distance(p.at, q.at) - p.r - q.r);
  return least;
}

// Two needle holders high above the sheet, pushed against each other by hands of 5 N: shafts crossing at their middles and away
// from them, at an angle, along each other, and a jaw on a shaft; slowly and at 0.8 m/s each.
TEST(Tool, two_of_them_pushed_against_each_other_stop_and_both_hands_feel_it) {
  struct Case {
    Vec3 axis;    // of the second shaft
    float along;  // [m] of the second tool along its shaft, from where both middles meet
    float off;    // [m] of the first tool along its own
  };
  const Case cases[] = {{{1, 0, 0}, 0, 0},
                        {{1, 0, 0}, 0.03f, 0.02f},
                        {{0.6f, 0, 0.8f}, 0.01f, 0},
                        {{0, 0, 1}, 0, 0.01f},
                        {{1, 0, 0}, 0, 0.0575f}};
  for (const Case& c : cases)
    for (const float speed : {0.05f, 0.8f}) {
      Bench bench;
      BodyModel holder = make_tool({});
      holder.max_force = 5;
      const auto pose_of = [&](Vec3 axis, Vec3 middle) {
        const Vec3 y = normalized(cross(axis, Vec3{0.1f, -1, 0.3f}));
        const Quat q = from_axes(cross(y, axis), y, axis);
        return Pose{middle - rotate(q, holder.center), q};
      };
      const Vec3 middle{0, 0, 0.2f}, axis = normalized(c.axis);
      float y = 0.02f;
      const auto poses = [&](uint32_t i) {
        return i == 0 ? pose_of({0, 0, 1}, middle + Vec3{0, -y, c.off})
                      : pose_of(axis, middle + Vec3{0, y, 0} + axis * c.along);
      };
      const uint32_t a = bench.add(holder, poses(0)), b = bench.add(holder, poses(1));
      bench.start();
      float overlap = 0;
      for (int i = 0; i < 700; ++i) {
        y = std::max(-0.004f, y - speed * 1e-3f);
        bench.target[a] = {poses(0), true}, bench.target[b] = {poses(1), true};
        bench.step();
        if (i % 8 == 0) overlap = std::max(overlap, -distance_of(bench, a, b));
      }
      const Body &first = bench.body(a), &second = bench.body(b);
      EXPECT_LT(overlap, 0.3e-3f) << c.along << " " << speed;
      EXPECT_GT(second.pose.p.y + rotate(second.pose.q, holder.center).y, first.pose.p.y) << "passed through";
      EXPECT_LT(first.force.y, -1) << c.along << " " << c.off;
      EXPECT_LE(length(first.force), 5.1f);
      EXPECT_LT(length(first.force + second.force), 1e-3f);
      // Actio and reactio at one place: about any point the torques cancel, too.
      EXPECT_LT(length(torque_about(holder, first, middle) + torque_about(holder, second, middle)), 2e-3f);
      EXPECT_LT(length(first.hand_force + first.force), 0.1f);
      EXPECT_LT(length(second.hand_force + second.force), 0.1f);
      if (c.along == 0 && c.off == 0) { EXPECT_NEAR(length(first.force), 5, 0.1f); }
    }
}

// A needle let go over a shaft rests on it or falls beside it; a shaft swept through it takes it along.
TEST(Needle, does_not_pass_through_a_tool) {
  for (const float speed : {0.0f, 0.3f, 1.0f}) {
    Bench bench;
    const Vec3 axis{1, 0, 0};
    const Quat q = from_axes({0, 1, 0}, {0, 0, 1}, axis);
    Pose pose{{-0.05f, 0.01f, 0.2f}, q};
    const uint32_t t = bench.add(make_tool({}), pose);
    const NeedleModel shape = make_needle({}, 0);
    const uint32_t n = bench.add_needle({}, on_circle(shape, {0.01f, 0.01f, speed > 0 ? 0.206f : 0.22f}, 0.4f));
    if (speed > 0) pose.p.y -= 0.02f, bench.model.bodies.gravity = {};
    place_body(bench.model.bodies.body[t], bench.body(t), pose, 0);
    bench.start();
    for (int i = 0; i < 250; ++i) {
      pose.p.y += speed * 1e-3f;
      bench.target[t] = {pose, true};
      bench.step();
      EXPECT_GT(distance_of(bench, t, n), -0.3e-3f) << speed << " at " << i;
    }
    if (speed > 0) {
      EXPECT_GT(bench.body(n).pose.p.y, 0.012f);  // struck, it has flown on
    }
  }
}

TEST(Bodies, a_copy_and_a_saved_state_continue_to_the_bit) {
  Bench a;
  const uint32_t n = a.add_needle({}, {});
  const NeedleModel needle = a.model.needles.needle[0];
  place_body(a.model.bodies.body[n], a.body(n), on_circle(needle, kCircle, 0.4f), 0);
  a.start();
  float angle = 0.4f;
  const auto run = [&](Bench& b, float from) {
    for (int i = 0; i < 300; ++i) {
      from += 2e-3f;
      b.target[n] = {on_circle(needle, kCircle, from), true};
      b.step();
    }
    return from;
  };
  angle = run(a, angle);
  Bench b;
  b.model = a.model, b.state = a.state, b.target = a.target, b.jobs = std::make_unique<Jobs>(3);
  std::vector<std::byte> bytes;
  ByteSink sink{bytes};
  Writer<ByteSink> write(sink);
  write(a.state.bodies), write(a.state.needle);
  b.state.bodies = {}, b.state.needle.clear();
  Reader read(bytes, "bodies");
  read(b.state.bodies), read(b.state.needle);
  b.start();
  run(a, angle), run(b, angle);
  EXPECT_GT(a.state.needle[0].channels, 0u);
  EXPECT_EQ(hash_state(a.state), hash_state(b.state));
}

}  // namespace
}  // namespace catgut::physical
