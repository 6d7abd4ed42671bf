// SPDX-License-Identifier: Apache-2.0
// tests/solver: volume, attachments and welds, nearest points, and the whole substep's independence of workers.
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>

#include "anatomy/bowel.h"
#include "core/hash.h"
#include "core/random.h"
#include "solver/substep.h"

namespace catgut {
namespace {

Vec3 random_point(Random& r, float size = 1) {
  return Vec3{r.uniform() - 0.5f, r.uniform() - 0.5f, r.uniform() - 0.5f} * (2 * size);
}

TEST(Volume, gradients_agree_with_central_differences) {
  Random r(1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Vec3> rest;
    for (int i = 0; i < 4; ++i) rest.push_back(random_point(r));
    Tet tet{0, 1, 2, 3};
    if (tet_volume(rest[0], rest[1], rest[2], rest[3]) < 0) std::swap(tet[2], tet[3]);
    VolumeModel m = make_volume_model(rest, std::vector<Tet>{tet});
    if (m.rest[0] < 0.05f) continue;
    m.rest[0] *= 0.5f;
    // With a large compliance the multiplier is -C / alpha and each point moves by w lambda times its gradient.
    for (size_t k = 0; k < 4; ++k) {
      Column<Vec4> x;
      for (const Vec3& p : rest) x.push_back(point(p));
      std::vector<float> w(4, 0.0f);
      w[k] = 1;
      float lambda = 0;
      solve_volume(m, x.data(), w.data(), 0.5f, 1, &lambda, 0, 1);
      ASSERT_NE(lambda, 0);
      const Vec3 got = (xyz(x[k]) - rest[k]) / lambda;
      Eigen::Vector3d slope;
      for (int c = 0; c < 3; ++c) {
        auto volume = [&](double by) {
          Eigen::Vector3d q[4];
          for (size_t i = 0; i < 4; ++i) q[i] = {rest[tet[i]].x, rest[tet[i]].y, rest[tet[i]].z};
          for (size_t i = 0; i < 4; ++i)
            if (tet[i] == k) q[i][c] += by;
          return (q[1] - q[0]).cross(q[2] - q[0]).dot(q[3] - q[0]) / 6;
        };
        slope[c] = (volume(1e-4) - volume(-1e-4)) / 2e-4;
      }
      EXPECT_LT((slope - Eigen::Vector3d(got.x, got.y, got.z)).norm(), 1e-4 * (1 + slope.norm()))
          << "trial " << trial << " corner " << k;
    }
  }
}

TEST(Volume, tetrahedra_of_a_color_share_no_particle) {
  const BodyRest body = make_bowel({});
  const VolumeModel m = make_volume_model(body.position, body.tet);
  ASSERT_EQ(m.tet.size(), body.tet.size());
  uint32_t start = 0;
  for (const uint32_t end : m.color_end) {
    std::vector<uint8_t> used(body.position.size(), 0);
    for (uint32_t t = start; t < end; ++t)
      for (uint32_t k : m.tet[t]) {
        ASSERT_EQ(used[k], 0) << "tetrahedron " << t;
        used[k] = 1;
      }
    start = end;
  }
  EXPECT_EQ(start, m.tet.size());
}

TEST(Closest, on_triangle_beats_every_sample) {
  Random r(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 a = random_point(r), b = random_point(r), c = random_point(r), p = random_point(r, 2);
    const ClosestOnTriangle got = closest_on_triangle(p, a, b, c);
    float sum = 0;
    Vec3 rebuilt{};
    const Vec3 corner[3] = {a, b, c};
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(got.weight[k], -1e-5f);
      sum += got.weight[k];
      rebuilt += corner[k] * got.weight[k];
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_LT(distance(rebuilt, got.point), 1e-5f);
    float best = 1e9f;
    const int n = 60;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const float u = static_cast<float>(i) / n, v = static_cast<float>(j) / n;
        best = std::min(best, distance(p, a * (1 - u - v) + b * u + c * v));
      }
    const float found = distance(p, got.point);
    EXPECT_LE(found, best + 1e-5f);
    EXPECT_GE(found, best - 0.06f);
  }
}

TEST(Closest, on_segments_beats_every_sample) {
  Random r(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3 a0 = random_point(r), b0 = random_point(r);
    Vec3 a1 = random_point(r), b1 = random_point(r);
    if (trial % 5 == 0) b1 = b0 + (a1 - a0) * 0.7f;  // parallel
    if (trial % 7 == 0) a1 = a0;                     // a point
    if (trial % 11 == 0) b1 = b0;
    const auto [s, t] = closest_on_segments(a0, a1, b0, b1);
    ASSERT_TRUE(s >= 0 && s <= 1 && t >= 0 && t <= 1);
    const float found = distance(lerp(a0, a1, s), lerp(b0, b1, t));
    float best = 1e9f;
    for (int i = 0; i <= 50; ++i)
      for (int j = 0; j <= 50; ++j)
        best = std::min(best, distance(lerp(a0, a1, static_cast<float>(i) / 50), lerp(b0, b1, static_cast<float>(j) / 50)));
    EXPECT_LE(found, best + 2e-5f) << "trial " << trial;
  }
}

TEST(Attachment, its_multiplier_is_the_load) {
  for (const float compliance : {0.0f, 1e-3f})
    for (const int sweeps : {1, 5}) {
      const float h = 1.0f / 960, mass = 0.002f;
      Column<Vec4> x;
      std::vector<float> w;
      std::vector<Vec3> v(3);
      EmbeddedPoint weighted;
      weighted.count = 3;
      for (uint32_t i = 0; i < 3; ++i) {
        x.push_back(point({0.01f * static_cast<float>(i), 0, 0}));
        w.push_back(1 / mass);
        weighted.particle[i] = i;
        weighted.weight[i] = 1.0f / 3;
      }
      Attachment a;
      a.point = weighted;
      a.target = position_of(weighted, x.data());
      a.compliance = compliance;
      std::vector<RigidBody> none;
      for (int step = 0; step < 4000; ++step) {
        Column<Vec4> prev = x;
        for (size_t i = 0; i < 3; ++i) v[i].y -= 9.81f * h, add(x[i], v[i] * h);
        a.lambda = {};
        for (int s = 0; s < sweeps; ++s) solve_attachment(a, x.data(), w.data(), {}, none, h);
        for (size_t i = 0; i < 3; ++i) v[i] = (xyz(x[i]) - xyz(prev[i])) / (h * (1 + 20 * h));
      }
      const double force = double{a.lambda.y} / (double{h} * double{h});
      EXPECT_NEAR(force, 3 * 0.002 * 9.81, 3 * 0.002 * 9.81 * 2e-3) << "compliance " << compliance << " sweeps " << sweeps;
      EXPECT_NEAR(a.target.y - position_of(weighted, x.data()).y, compliance * 3 * 0.002f * 9.81f, 2e-6f);
    }
}

TEST(Attachment, a_spread_point_follows_every_affine_motion) {
  Random r(4);
  Column<Vec4> rest;
  std::vector<uint32_t> id;
  for (uint32_t i = 0; i < 12; ++i) rest.push_back(point(random_point(r, 0.005f))), id.push_back(i);
  const Vec3 at{0.001f, -0.0005f, 0.0007f};
  const EmbeddedPoint t = spread_point(id, rest.data(), at);
  EXPECT_LT(distance(position_of(t, rest.data()), at), 1e-7f);
  auto affine = [](Vec3 p) {
    return Vec3{1.2f * p.x + 0.1f * p.y - 0.3f * p.z + 0.05f, 0.9f * p.y - 0.2f * p.x, 0.4f * p.y + 1.1f * p.z - 0.02f};
  };
  Column<Vec4> moved;
  for (const Vec4& p : rest) moved.push_back(point(affine(xyz(p))));
  EXPECT_LT(distance(position_of(t, moved.data()), affine(at)), 1e-6f);
}

TEST(Weld, a_rigid_one_carries_force_and_torque) {
  std::vector<RigidModel> model(1);
  model[0].inv_mass = 1 / 0.05f;
  model[0].inv_inertia = {2e4f, 2e4f, 4e4f};
  model[0].gravity = true;
  std::vector<RigidBody> body(1);
  Weld weld;
  weld.a = 0;
  weld.local_a.p = {0.03f, 0, 0};  // held 30 mm beside its center of mass
  weld.target = Pose{{0.03f, 0, 0}, {}};
  const float h = 1.0f / 960;
  for (int i = 0; i < 4000; ++i) {
    weld.lambda = weld.angular_lambda = {};
    predict(model[0], body[0], {0, -9.81f, 0}, h);
    for (int s = 0; s < 20; ++s) solve_weld(model, body, weld, h);
    update_velocity(model[0], body[0], h, 5);
  }
  const double weight = 0.05 * 9.81, h2 = double{h} * double{h};
  EXPECT_NEAR(double{weld.lambda.y} / h2, weight, weight * 0.01);
  EXPECT_NEAR(double{weld.angular_lambda.z} / h2, -weight * 0.03, weight * 0.03 * 0.02);
  EXPECT_LT(distance(transform(body[0].pose(), weld.local_a.p), weld.target.p), 2e-5f);
  EXPECT_LT(length(rotation_vector(body[0].q)), 2e-3f);
}

// Two particles of 20 and 50 g, each a point of tissue.
struct Pinned {
  Column<Vec4> x{point({0, 0, 0}), point({0.02f, 0, 0})}, v{2}, prev{2};
  std::vector<float> w{50, 20};
  Tether pin;
  float h = 1.0f / 960;
  Pinned(float length, float compliance) {
    pin.a = particle_point(0), pin.b = particle_point(1);
    pin.length = length, pin.compliance = compliance;
  }
  // pull: [N] on the second particle, its opposite on the first.
  void step(Vec3 pull, float damping) {
    prev = x;
    pin.lambda = 0;
    for (size_t i = 0; i < 2; ++i) {
      add(v[i], pull * ((i == 0 ? -1.0f : 1.0f) * w[i] * h));
      add(x[i], xyz(v[i]) * h);
    }
    solve_tether(pin, x.data(), w.data(), h);
    for (size_t i = 0; i < 2; ++i) set(v[i], (xyz(x[i]) - xyz(prev[i])) / (h * (1 + damping * h)));
  }
  float apart() const { return distance(xyz(x[0]), xyz(x[1])); }
};

TEST(Pin, draws_together_what_is_too_far_apart_and_carries_the_pull) {
  for (const float compliance : {0.0f, 1e-3f}) {
    Pinned p(0.01f, compliance);
    for (int i = 0; i < 3000; ++i) p.step({}, 30);
    EXPECT_LT(p.apart(), 0.01 + 1e-5) << "nearer is no fault: a rope does not push them apart";
    EXPECT_NEAR(p.x[0].x / 50 + p.x[1].x / 20, 0.02 / 20, 1e-5) << "the center of mass stays";
    for (int i = 0; i < 6000; ++i) p.step({0.5f, 0, 0}, 30);
    EXPECT_NEAR(p.pin.lambda / (p.h * p.h), -0.5, 0.005);
    EXPECT_NEAR(p.apart(), 0.01f + 0.5f * compliance, 1e-5);
  }
}

TEST(Pin, never_pushes) {
  Pinned p(0.03f, 0);
  const Column<Vec4> start = p.x;
  solve_tether(p.pin, p.x.data(), p.w.data(), p.h);
  EXPECT_EQ(p.apart(), 0.02f);
  EXPECT_EQ(p.pin.lambda, 0);
  // Pushed together from outside, they approach as far as they are pushed: both in free fall.
  for (int i = 0; i < 96; ++i) {
    p.step({-0.01f, 0, 0}, 0);
    EXPECT_EQ(p.pin.lambda, 0);
  }
  EXPECT_NEAR(p.apart(), 0.02 - 0.5 * 0.01 * 70 * 0.01, 5e-5);
  // And when pulled apart again, the tether becomes taut at its length, without a sweep that pushes.
  for (int i = 0; i < 2000; ++i) {
    p.step({0.05f, 0, 0}, 5);
    EXPECT_LE(p.pin.lambda, 0);
  }
  EXPECT_NEAR(p.apart(), 0.03, 1e-5);
  // Too many sweeps of too large steps: accumulated pull may be undone, never more.
  p.pin.lambda = -1e-9f;
  set(p.x[1], xyz(p.x[0]) + Vec3{0.01f, 0, 0});
  solve_tether(p.pin, p.x.data(), p.w.data(), p.h);
  EXPECT_EQ(p.pin.lambda, 0);
  EXPECT_NEAR(p.apart(), 0.01, 1e-6);
}

// A graph of tethers over a cloud of particles, from slack to much too short, that share particles with each other.
struct RopeWeb {
  Column<Vec4> x{60};
  std::vector<float> w{std::vector<float>(60)};
  std::vector<Tether> pin{std::vector<Tether>(30)};
  explicit RopeWeb(Random& random) {
    const auto around = [&](float size) {
      return Vec3{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f} * size;
    };
    for (Vec4& p : x) p = point(around(0.05f));
    for (float& m : w) m = random.uniform() < 0.1f ? 0 : 20 + 30 * random.uniform();
    for (Tether& p : pin) {
      for (EmbeddedPoint* end : {&p.a, &p.b}) {
        const uint32_t first = static_cast<uint32_t>(random.next() % 50);
        std::vector<uint32_t> group;
        for (uint32_t k = 0; k < 1 + random.next() % 10; ++k) group.push_back(first + k);
        *end = spread_point(group, x.data(), xyz(x[first]) + around(0.002f));
      }
      // Slack by zero to a centimeter, or taut by a millimeter at most.
      const float apart = distance(position_of(p.a, x.data()), position_of(p.b, x.data())), u = random.uniform();
      p.length =
          std::max(0.0f, apart + (u < 0.3f ? -0.001f * random.uniform() : 0.01f * std::pow(10.0f, -5 * random.uniform())));
      p.compliance = random.uniform() < 0.5f ? 0.0f : 1e-5f;
    }
  }
};

void pulled_before(std::vector<Tether>& pin) {
  for (Tether& p : pin) p.lambda = -1e-9f;
}

// Tethers coupled through the graph give the same result as tethers coupled through particles, followed by the slack ones,
// except for rounding in single precision over four sweeps of positions up to 5 cm and pulls up to 0.01 N s^2.
TEST(Pin, many_at_once_are_each_of_them_in_turn) {
  Random random(11);
  size_t pulling = 0, slack = 0, caught = 0;
  TetherGraph web;
  std::vector<TetherSpan> work;
  const float h = 1.0f / 960;
  for (int round = 0; round < 200; ++round) {
    const RopeWeb start(random);
    for (int draw = 0; draw < 2; ++draw) {  // of those that pulled before: the same tethers, another graph
      RopeWeb one = start, all = start;
      std::vector<Tether*> rope, slack_before;
      for (size_t i = 0; i < all.pin.size(); ++i) {
        const bool pulls = random.uniform() < 0.7f;
        if (pulls) all.pin[i].lambda = -1e-9f;
        (pulls ? rope : slack_before).push_back(&one.pin[i]);
      }
      build_graph(all.pin, all.w.data(), static_cast<uint32_t>(all.x.size()), web);  // the last graph is still in its memory
      for (int sweep = 0; sweep < 4; ++sweep)
        for (Tether* p : rope) solve_tether(*p, one.x.data(), one.w.data(), h);
      for (Tether* p : slack_before) {
        solve_tether(*p, one.x.data(), one.w.data(), h);
        caught += p->lambda < 0;
      }
      solve_tethers(all.pin, web, all.x.data(), h, 4, 0, work);
      for (size_t i = 0; i < one.x.size(); ++i) {
        ASSERT_LT(distance(xyz(one.x[i]), xyz(all.x[i])), 1e-6f) << "web " << round << ", particle " << i;
        ASSERT_EQ(all.x[i].w, 1) << "web " << round << ", particle " << i;
      }
      for (size_t i = 0; i < one.pin.size(); ++i) {
        ASSERT_NEAR(one.pin[i].lambda, all.pin[i].lambda, 1e-6f) << "web " << round << ", rope " << i;
        ++(all.pin[i].lambda < 0 ? pulling : slack);
      }
    }
  }
  EXPECT_GT(pulling, 2000u);
  EXPECT_GT(slack, 2000u);
  EXPECT_GT(caught, 500u);
}

// Two free particles of 10 mg on the x axis and a tether between them.
struct OneRope {
  std::vector<Vec4> x;
  std::vector<float> w{1 / 1e-5f, 1 / 1e-5f};
  std::vector<Tether> pin{1};
  TetherGraph web;
  std::vector<TetherSpan> work;
  OneRope(float apart, float length) : x{point({0, 0, 0}), point({apart, 0, 0})} {
    pin[0].a = particle_point(0), pin[0].b = particle_point(1), pin[0].length = length;
  }
  void build_graph() { catgut::build_graph(pin, w.data(), 2, web); }
  float apart() const { return x[1].x - x[0].x; }
  float substep(float pulled_to) {
    x[1].x = x[0].x + pulled_to;
    solve_tethers(pin, web, x.data(), 1.0f / 960, 4, 3e-5f, work);
    return apart();
  }
};

// A slack one that becomes taut holds in the same substep, and from the next tick on with the others; slack again, it leaves.
TEST(Pin, taut_ones_are_in_the_web) {
  OneRope r(0.002f, 0.003f);
  const auto tick = [&](float pulled_to) {
    r.build_graph();
    return r.substep(pulled_to);
  };
  EXPECT_NEAR(tick(0.002f), 0.002f, 1e-9f);
  EXPECT_EQ(r.web.active.size(), 0u);
  EXPECT_NEAR(tick(0.0031f), 0.003f, 1e-8f);
  EXPECT_EQ(r.web.active.size(), 0u);
  EXPECT_NEAR(r.substep(0.0029f), 0.0029f, 1e-9f) << "what it pulled is not given back";
  EXPECT_EQ(r.pin[0].lambda, 0);
  EXPECT_NEAR(r.substep(0.0031f), 0.003f, 1e-8f);
  EXPECT_NEAR(tick(0.0031f), 0.003f, 1e-8f);
  EXPECT_EQ(r.web.active.size(), 1u);
  EXPECT_NEAR(tick(0.0029f), 0.0029f, 1e-9f);
  EXPECT_NEAR(tick(0.0029f), 0.0029f, 1e-9f);
  EXPECT_EQ(r.web.slack.size(), 1u);
}

// With a tolerance some are skipped, and when all are skipped, each tether is within it.
TEST(Pin, a_tolerance_is_what_a_rope_may_be_too_long_by) {
  Random random(12);
  std::vector<TetherSpan> work;
  const float h = 1.0f / 960, tolerance = 1e-5f;
  size_t still = 0;
  for (int web = 0; web < 200; ++web) {
    RopeWeb r(random);
    TetherGraph known;
    pulled_before(r.pin);
    build_graph(r.pin, r.w.data(), static_cast<uint32_t>(r.x.size()), known);
    RopeWeb more = r;
    solve_tethers(r.pin, known, r.x.data(), h, 400, tolerance, work);
    solve_tethers(more.pin, known, more.x.data(), h, 401, tolerance, work);
    const auto pulls_alike = [](const Tether& a, const Tether& b) { return a.lambda == b.lambda; };
    if (!std::equal(r.pin.begin(), r.pin.end(), more.pin.begin(), pulls_alike)) continue;  // they cannot all be as short
    ++still;
    for (const Tether& p : r.pin) {
      const float l = distance(position_of(p.a, r.x.data()), position_of(p.b, r.x.data()));
      EXPECT_LE(l, p.length - p.compliance / (h * h) * p.lambda + tolerance + 1e-7f) << "web " << web;
    }
  }
  EXPECT_GT(still, 150u);
}

// A steady pull apart, far below the tolerance in a substep, is answered in each substep. A tether that waited until the
// tolerance was exceeded would jitter.
TEST(Pin, a_tolerance_makes_no_rope_twitch) {
  OneRope r(0.002f, 0.002f);
  pulled_before(r.pin);
  r.build_graph();
  for (int i = 0; i < 50; ++i) {
    EXPECT_NEAR(r.substep(r.apart() + 3e-6f), 0.002f, 1e-8f) << i;
    EXPECT_LT(r.pin[0].lambda, 0) << i;
  }
}

// A small bowel, a thread on it and a tool that presses into it; 200 substeps.
uint64_t pressed_bowel(int workers, double* deepest) {
  BowelShape shape;
  shape.particles = 900;
  shape.length = 0.05f;
  const BodyRest body = make_bowel(shape);
  const uint32_t tissue = static_cast<uint32_t>(body.position.size()), thread = 60;
  SolverModel m;
  m.tissue = tissue;
  m.count = tissue + thread;
  for (uint32_t i = 0; i < tissue; ++i) m.inv_mass.push_back(body.pinned[i] ? 0.0f : 1 / (80 * body.mass[i]));
  m.inv_mass.resize(m.count, 1 / 2e-6f);
  m.shape = make_shape_model(body.position, body.mass, body.cluster);
  m.volume = make_volume_model(body.position, body.tet);
  m.use_volume = true;
  const std::vector<float> radius(tissue, body.radius), apart(tissue, 0.008f);
  m.collision = make_tissue_collision(m.shape.rest, radius, std::vector<uint32_t>(tissue, 0), apart, body.surface);
  StrandModel& t = m.strand.emplace_back();
  t.first_slot = tissue, t.count = thread, t.spacing = 0.0016f, t.radius = 0.00015f;
  t.inv_mass = 1 / 2e-6f, t.stretch_compliance = 1e-6f, t.bend_compliance = 2e4f;
  t.gravity = m.gravity;
  m.h = 1.0f / 960;
  m.shape_stiffness = stiffness_at(0.9f, 1.0f / 480, m.h);
  m.shape_relaxation = 1.3f;
  m.damping = 4, m.thread_damping = 12;
  m.friction = {0.3f, 0.1f, 0.15f};
  m.body.resize(3);
  m.body[0].inv_mass = 1 / 0.05f;
  m.body[0].inv_inertia = {2e4f, 2e4f, 4e4f};
  m.body[0].capsule.push_back({{0, 0, 0}, {0, 0, 0.02f}, 0.002f});
  std::vector<Vec3> start = body.position;
  for (uint32_t i = 0; i < thread; ++i) start.push_back({0.0016f * (static_cast<float>(i) - 30), 0.002f, 0.021f});
  SolverState s = make_solver_state(m, start);
  s.body_collides[1] = s.body_collides[2] = 0;
  SolverScratch k;
  prepare_scratch(m, k);
  s.body[0].x = s.body[0].prev_x = {0, -0.008f, 0.026f};
  Weld hand;
  hand.a = 0;
  hand.compliance = 1.0f / 3000;
  hand.angular_compliance = 0.05f;
  s.weld.push_back(hand);
  // The other hand pulls one end of the thread up, through a point of the tissue.
  s.body[1].x = start.back();
  s.strand[0].hold.push_back({tissue + thread - 1, 1, {}});
  ThreadAnchor bite;
  bite.slot = tissue + 30;
  uint32_t nearest = 0;
  for (uint32_t i = 1; i < tissue; ++i)
    if (distance(start[i], start[bite.slot]) < distance(start[nearest], start[bite.slot])) nearest = i;
  bite.point = particle_point(nearest);
  bite.friction = 0.03f, bite.capstan_friction = 0.08f;
  s.strand[0].anchor.push_back(bite);
  Jobs jobs(workers);
  uint32_t contacts = 0;
  for (int i = 0; i < 200; ++i) {
    s.body[1].x += Vec3{0.00002f, 0, 0.00003f};
    s.weld[0].target = Pose{{0.00001f * static_cast<float>(i), -0.008f, 0.026f - 0.00005f * static_cast<float>(i)}, {}};
    if (i % 8 == 0) {
      find_boxes(m, s, k, jobs, nullptr);
      find_candidates(m, s, k, 0.008f, nullptr);
    }
    substep(m, s, k, jobs, nullptr);
    contacts = std::max(contacts, k.contacts);
  }
  EXPECT_GT(contacts, 0u) << "the tool was to touch the bowel";
  *deepest = 0;
  for (uint32_t i = 0; i < tissue; ++i) *deepest = std::max(*deepest, double{distance(xyz(s.x[i]), body.position[i])});
  for (const Vec4& p : s.x) EXPECT_TRUE(is_finite(xyz(p)));
  return hash_bytes(s.x.data(), s.x.size() * sizeof(Vec4), hash_bytes(s.v.data(), s.v.size() * sizeof(Vec4)));
}

TEST(Substep, one_and_two_workers_give_the_same_bits) {
  double deep_one = 0, deep_two = 0;
  const uint64_t one = pressed_bowel(1, &deep_one), two = pressed_bowel(2, &deep_two), again = pressed_bowel(1, &deep_one);
  EXPECT_EQ(one, again);
  EXPECT_EQ(one, two);
  EXPECT_GT(deep_one, 0.0005);
}

TEST(Substep, every_instruction_set_gives_the_same_bits) {
  double deep = 0;
  const uint64_t best = pressed_bowel(1, &deep);
  const int64_t have = hwy::SupportedTargets();
  for (int64_t target = 1; target > 0 && target <= HWY_STATIC_TARGET; target <<= 1) {
    if ((have & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    EXPECT_EQ(best, pressed_bowel(1, &deep)) << hwy::TargetName(target);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(have);
}

}  // namespace
}  // namespace catgut
