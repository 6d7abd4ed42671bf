// SPDX-License-Identifier: Apache-2.0
// tests/wall: the step, impulses, contact and cuts of a whole wall, measured from outside. Moduli and forces against closed
// forms are in `catgut validate` (modulus/, contact/, closure/).
#include "wall/wall.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "anatomy/bowel.h"
#include "core/archive.h"
#include "core/check.h"
#include "core/hash.h"
#include "wall/contact.h"
#include "wall/cut.h"
#include "wall/reflect.h"

#pragma GCC diagnostic ignored "-Wmismatched-new-delete"  // new is malloc here
namespace {
std::atomic<bool> counting{false};
std::atomic<int> allocations{0};
void* counted(size_t n, size_t align) {
  if (counting.load(std::memory_order_relaxed)) ++allocations;
  void* p = align > 16 ? std::aligned_alloc(align, (n + align - 1) / align * align) : std::malloc(n);
  if (!p) throw std::bad_alloc();
  return p;
}
}  // namespace
void* operator new(size_t n) { return counted(n, 0); }
void* operator new(size_t n, std::align_val_t a) { return counted(n, static_cast<size_t>(a)); }
void* operator new(size_t n, const std::nothrow_t&) noexcept {
  if (counting.load(std::memory_order_relaxed)) ++allocations;
  return std::malloc(n);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, size_t, std::align_val_t) noexcept { std::free(p); }

namespace catgut::wall {
namespace {

Spec small_tube(float step = 0.001f) {
  Spec s;
  TubeShape shape;
  shape.around = 24, shape.rings = 10, shape.length = 0.04f;
  s.mesh = tube(shape);
  s.step = step;
  s.drag = 10;
  return s;
}
void step(Wall& w, Jobs& jobs) {
  begin_step(w.model, w.state, w.scratch, jobs);
  finish_step(w.model, w.state, jobs);
}
float farthest_from_rest(const Wall& w) {
  float far = 0;
  for (uint32_t c = 0; c < columns(w.state); ++c)
    far = std::max(far, distance(outer(w.state, c), w.model.mesh.outer[w.state.topology.source[c]]));
  return far;
}

std::vector<std::byte> saved(const State& s) {
  std::vector<std::byte> bytes;
  ByteSink sink{bytes};
  Writer<ByteSink> write(sink);
  write(s);
  return bytes;
}
uint64_t hash_of(const State& s) {
  const std::vector<std::byte> bytes = saved(s);
  return hash_bytes(bytes.data(), bytes.size());
}

TEST(Wall, has_the_same_bits_for_any_number_of_workers) {
  std::vector<uint64_t> hash;
  for (const int workers : {1, 2, 3}) {
    Wall w = build_wall(small_tube());
    Jobs jobs(workers);
    ContactSolver solver;
    std::vector<Obstacle> tool(1);
    tool[0].a = {0.021f, -0.01f, -0.012f}, tool[0].b = {0.021f, 0.01f, -0.012f}, tool[0].radius = 0.003f;
    for (int i = 0; i < 60; ++i) {
      find_contacts(w.model, w.state, tool, solver);
      warm_start(w.model, w.scratch, solver);
      w.scratch.external[0].z += 0.05f;
      begin_step(w.model, w.state, w.scratch, jobs);
      solve_contacts(w.model, w.state, w.scratch, tool, solver);
      finish_step(w.model, w.state, jobs);
    }
    EXPECT_GT(length(solver.force[0]), 0.01f);
    hash.push_back(hash_of(w.state));
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
}

TEST(Wall, goes_on_from_what_reflect_saved_to_the_bit) {
  Wall w = build_wall(small_tube());
  Jobs jobs(1);
  cut(w.model, w.state, w.scratch, std::vector<std::array<uint32_t, 2>>{{0, 24}, {24, 48}});
  for (int i = 0; i < 20; ++i) w.scratch.external[0].x = 0.1f, step(w, jobs);
  const std::vector<std::byte> bytes = saved(w.state);
  Wall other = build_wall(small_tube());
  Reader read(bytes, "test");
  read(other.state);
  EXPECT_EQ(read.at, bytes.size());
  other.scratch = make_scratch(other.model, other.state);
  for (int i = 0; i < 20; ++i) step(w, jobs), step(other, jobs);
  EXPECT_EQ(hash_of(w.state), hash_of(other.state));
}

TEST(Wall, allocates_nothing_in_a_step_with_points_and_contact) {
  Wall w = build_wall(small_tube());
  Jobs jobs(1);
  ContactSolver solver;
  Coupling thread;
  const std::vector<Point> hole{{3, 0, 0, 0}, {5, 0, 0, 0}};
  thread.set_points(w.model, w.state.topology, hole);
  std::vector<Obstacle> tool(1);
  tool[0].a = {0.021f, -0.01f, -0.012f}, tool[0].b = {0.021f, 0.01f, -0.012f}, tool[0].radius = 0.003f;
  for (int i = 0; i < 120; ++i) {
    counting = i >= 100;  // lists have their room by then
    find_contacts(w.model, w.state, tool, solver);
    warm_start(w.model, w.scratch, solver);
    begin_step(w.model, w.state, w.scratch, jobs);
    thread.begin(w.model, w.state);
    thread.advance(0.0005f), thread.push(0, {1e-5f, 0, 0});
    thread.end(w.state, w.scratch);
    solve_contacts(w.model, w.state, w.scratch, tool, solver);
    finish_step(w.model, w.state, jobs);
    counting = false;
  }
  EXPECT_GT(solver.contact.size(), 0u);
  EXPECT_EQ(allocations.load(), 0);
}

TEST(Wall, keeps_its_momentum_when_nothing_holds_it) {
  Spec s = small_tube();
  std::fill(s.mesh.held.begin(), s.mesh.held.end(), 0);
  s.drag = 0;
  Wall w = build_wall(s);
  w.model.tau = 0;  // damping of strain is not energy-conserving
  Jobs jobs(1);
  const Topology& t = w.state.topology;
  // A spin, a drift and a squeeze.
  for (uint32_t c = 0; c < columns(w.state); ++c) {
    const Vec3 p = vec3(w.state.motion.x[2 * c]), d = vec3(w.state.motion.x[2 * c + 1]);
    w.state.motion.v[2 * c] = float4(cross(Vec3{1, 2, 0.5f}, p) + Vec3{0.01f, 0, 0.02f} + Vec3{p.x * 2, 0, 0});
    w.state.motion.v[2 * c + 1] = float4(cross(Vec3{1, 2, 0.5f}, d));
  }
  // The inertia that conserves momentum is the enlarged one; applying A to the motion gives it.
  const auto momentum = [&] {
    Vec3 linear{}, angular{};
    const float scale = w.model.step * w.model.step * w.model.report.scale;
    for (uint32_t c = 0; c < columns(w.state); ++c) {
      linear += vec3(w.state.motion.v[2 * c]) * t.mass[c];
      angular += cross(vec3(w.state.motion.x[2 * c]), vec3(w.state.motion.v[2 * c])) * t.mass[c];
      angular += cross(vec3(w.state.motion.x[2 * c + 1]), vec3(w.state.motion.v[2 * c + 1])) / t.inv_dir[c];
    }
    const uint32_t edge[6][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}, {1, 3}};
    for (uint32_t lane = 0; lane < w.model.face_of_lane.size(); ++lane)
      for (int e = 0; e < 6 && w.model.face_of_lane[lane] != kNone; ++e) {
        const auto& corner = t.corners[lane / kLanesOfBlock].column;
        const uint32_t a = corner[edge[e][0]][lane % kLanesOfBlock], b = corner[edge[e][1]][lane % kLanesOfBlock];
        angular += cross(vec3(w.state.motion.x[2 * a]) - vec3(w.state.motion.x[2 * b]),
                         vec3(w.state.motion.v[2 * a]) - vec3(w.state.motion.v[2 * b])) *
                   (scale * w.model.inertia[lane].edge[e]);
      }
    return std::pair{linear, angular};
  };
  const auto before = momentum();
  for (int i = 0; i < 500; ++i) step(w, jobs);
  const auto after = momentum();
  EXPECT_LT(distance(before.first, after.first), 1e-4f * length(before.first));
  EXPECT_LT(distance(before.second, after.second), 2e-4f * length(before.second));
  EXPECT_EQ(w.state.motion.clamped, 0u);
}

TEST(Wall, falls_as_any_body_and_has_its_true_mass) {
  Spec s = small_tube();
  std::fill(s.mesh.held.begin(), s.mesh.held.end(), 0);
  s.drag = 0, s.gravity = {0, 0, -9.81f};
  Wall w = build_wall(s);
  const float volume = 3.14159265f * (0.02f * 0.02f - 0.0175f * 0.0175f) * 0.04f;
  EXPECT_NEAR(w.model.report.rest_mass / (volume * 1050), 1, 0.02);
  Jobs jobs(1);
  for (int i = 0; i < 100; ++i) step(w, jobs);
  for (uint32_t c = 0; c < columns(w.state); ++c) EXPECT_NEAR(w.state.motion.v[2 * c].z, -0.981f, 1e-4f);
}

TEST(Wall, answers_a_push_on_a_point_with_its_compliance) {
  Wall w = build_wall(small_tube());
  cut(w.model, w.state, w.scratch, std::vector<std::array<uint32_t, 2>>{{0, 24}, {24, 48}});
  const std::vector<Point> point{{0, 0.3f, -0.2f, 1}, {1, -0.5f, 0.1f, -1}, {23, 0.9f, 0.9f, 0}, {90, 0, 0, 0.5f}};
  Coupling c;
  c.set_points(w.model, w.state.topology, point);
  for (size_t i = 0; i < point.size(); ++i) {
    Wall pushed = w;
    c.begin(pushed.model, pushed.state);
    const Vec3 p{1e-6f, -2e-6f, 3e-6f};
    c.push(i, p);
    c.end(pushed.state, pushed.scratch);
    for (size_t j = 0; j < point.size(); ++j) {
      const Vec3 v = velocity(c.point[j], pushed.state.motion), want = p * c.w[i * point.size() + j];
      EXPECT_LT(distance(v, want), 1e-4f * length(want) + 1e-9f) << i << " on " << j;
    }
  }
}

TEST(Inverse, keeps_what_it_likes_without_changing_a_bit) {
  const Wall w = build_wall(small_tube());
  std::vector<Weights> point;
  for (uint32_t f = 0; f < 200; f += 3) point.push_back(weights(w.model, w.state.topology, {f, 0.2f, -0.4f, 0}));
  Inverse large(1000), little(8);
  for (size_t i = 0; i + 1 < point.size(); ++i) {
    large.need(w.state.topology, {&point[i], 2});
    little.need(w.state.topology, {&point[i], 2});
    EXPECT_EQ(large.compliance(w.state.topology, point[i], point[i + 1]),
              little.compliance(w.state.topology, point[i], point[i + 1]));
  }
  EXPECT_LE(little.kept(), 8u);
}

TEST(Wall, bears_five_newtons_and_comes_back) {
  Spec s;
  s.mesh = tube({});
  s.drag = 20;
  Wall w = build_wall(s);
  Jobs jobs(1);
  const uint32_t c = 9 * 32;
  const Vec3 in = normalized(w.model.mesh.inner[c] - w.model.mesh.outer[c]);
  for (int i = 0; i < 2500; ++i) {
    const float force = 5.0f * std::min(1.0f, static_cast<float>(i) / 1000.0f);
    add_to(w.scratch.external, at_column(c, 1), in * force);
    step(w, jobs);
  }
  const Vec3 held = outer(w.state, c);
  for (int i = 0; i < 200; ++i) add_to(w.scratch.external, at_column(c, 1), in * 5.0f), step(w, jobs);
  EXPECT_LT(distance(outer(w.state, c), held), 1e-5f);
  EXPECT_GT(distance(outer(w.state, c), w.model.mesh.outer[c]), 0.01f);
  for (int i = 0; i < 4000; ++i) step(w, jobs);
  EXPECT_LT(farthest_from_rest(w), 1e-4f);
}

TEST(Wall, comes_back_from_being_dragged_about) {
  Wall w = build_wall(small_tube());
  Jobs jobs(1);
  Hold grip;
  grip.point = {at_column(5, 1), at_column(5, -1)};
  grip.softness = 1e-4f;
  const Vec3 a = outer(w.state, 5), b = inner(w.state, 5);
  for (int i = 0; i < 600; ++i) {  // 20 mm to and fro at 0.5 m/s
    const float t = 0.001f * static_cast<float>(i), way = 0.02f * std::sin(25 * t);
    grip.target = {a + Vec3{0.5f * way, way, 0.3f * way}, b + Vec3{0.5f * way, way, 0.3f * way}};
    begin_step(w.model, w.state, w.scratch, jobs);
    apply_hold(w.model, w.state, w.scratch, grip);
    finish_step(w.model, w.state, jobs);
    ASSERT_LT(farthest_from_rest(w), 0.05f);
  }
  for (int i = 0; i < 3000; ++i) step(w, jobs);
  EXPECT_LT(farthest_from_rest(w), 1e-4f);
}

TEST(Wall, recovers_from_being_turned_inside_out_or_squeezed_to_a_point) {
  for (const int how : {0, 1}) {
    Wall w = build_wall(small_tube());
    Jobs jobs(1);
    for (uint32_t c = 0; c < columns(w.state); ++c) {
      if (w.model.mesh.held[c]) continue;
      Float4& dir = w.state.motion.x[2 * c + 1];
      if (how == 0) dir = float4(-vec3(dir));
      else w.state.motion.x[2 * c] = float4({0, 0, -0.02f}), dir = {};
    }
    for (int i = 0; i < 4000; ++i) step(w, jobs);
    for (uint32_t c = 0; c < columns(w.state); ++c) ASSERT_TRUE(is_finite(outer(w.state, c)));
    if (how == 0) { EXPECT_LT(farthest_from_rest(w), 1e-3f) << how; }
  }
}

// What the edges and the director of every corner of the faces about a column span, relative to rest; the least of them.
float least_volume(const Wall& w, const State& rest, uint32_t column) {
  const auto volume = [&](const State& s, const std::array<uint32_t, 4>& f, size_t k) {
    const auto at = [&](size_t i) { return vec3(s.motion.x[2 * f[i % 4]]); };
    return dot(cross(at(k + 1) - at(k), at(k + 3) - at(k)), vec3(s.motion.x[2 * f[k] + 1]));
  };
  float least = 1;
  for (const std::array<uint32_t, 4>& f : w.model.mesh.face) {
    if (std::find(f.begin(), f.end(), column) == f.end()) continue;
    for (size_t k = 0; k < 4; ++k) least = std::min(least, volume(w.state, f, k) / volume(rest, f, k));
  }
  return least;
}

// 100 N on one column. Elements alone give way until it is inside out, and with 34 N as well.
TEST(Wall, keeps_a_tenth_of_its_volume_under_100_newtons_on_a_column) {
  for (const bool keeps : {false, true}) {
    Wall w = build_wall(small_tube());
    const State rest = w.state;
    const uint32_t c = 24 * 4;
    const auto at_rest = [&](uint32_t column) { return vec3(rest.motion.x[2 * column]); };
    const Vec3 way = cross(at_rest(c + 1) - at_rest(c + 23), at_rest(c + 24) - at_rest(c - 24));
    const float sign = dot(way, vec3(rest.motion.x[2 * c + 1])) > 0 ? -1.0f : 1.0f;
    Jobs jobs(1);
    float least = 1;
    const auto momentum = [&] {
      Vec3 sum{};
      for (uint32_t i = 0; i < columns(w.state); ++i) sum += vec3(w.state.motion.v[2 * i]) * w.state.topology.mass[i];
      return sum;
    };
    for (int i = 0; i < 300; ++i) {
      // Against the normal of its neighbors' places, growing: what presses on both faces.
      const auto mid = [&](uint32_t column) { return vec3(w.state.motion.x[2 * column]); };
      const Vec3 normal = normalized(cross(mid(c + 1) - mid(c + 23), mid(c + 24) - mid(c - 24)));
      if (i < 100) w.scratch.external[2 * c + 1] = float4(normal * (sign * 1.0f * static_cast<float>(i)));
      begin_step(w.model, w.state, w.scratch, jobs);
      const Vec3 before = momentum();
      if (keeps) keep_volumes(w.model, w.state, w.scratch);
      EXPECT_LT(distance(momentum(), before), 1e-8f);
      finish_step(w.model, w.state, jobs);
      least = std::min(least, least_volume(w, rest, c));
    }
    if (keeps) {
      EXPECT_GT(least, 0.09f);
    } else {
      EXPECT_LT(least, 0);
    }
    for (int i = 0; i < 3000; ++i) {
      begin_step(w.model, w.state, w.scratch, jobs);
      if (keeps) keep_volumes(w.model, w.state, w.scratch);
      finish_step(w.model, w.state, jobs);
    }
    if (keeps) { EXPECT_LT(farthest_from_rest(w), 1e-4f); }
  }
}

TEST(Cut, divides_a_tube_from_rim_to_rim_and_around) {
  Wall w = build_wall(small_tube());
  const uint32_t before = columns(w.state);
  std::vector<std::array<uint32_t, 2>> edge;
  for (uint32_t j = 0; j < 24; ++j) edge.push_back({72 + j, 72 + (j + 1) % 24});
  EXPECT_EQ(cut(w.model, w.state, w.scratch, edge), 24u);
  const std::vector<uint32_t> piece = pieces(w.state);
  uint32_t count = 0;
  for (uint32_t c = 0; c < columns(w.state); ++c) count += piece[c] == c;
  EXPECT_EQ(count, 2u);
  EXPECT_EQ(columns(w.state), before + 24);
  float mass = 0;
  for (float m : w.state.topology.mass) mass += m;
  EXPECT_NEAR(mass / w.model.report.rest_mass, 1, 1e-5);
  // The old factor still moves both together; with a new one the free piece flies away and the held one stays.
  refactor(w.model, w.state, w.scratch);
  w.model.gravity = {0, 0, 9.81f};
  Jobs jobs(1);
  for (int i = 0; i < 200; ++i) step(w, jobs);
  EXPECT_GT(outer(w.state, 0).z - w.model.mesh.outer[0].z, 0.05f);
  EXPECT_LT(std::abs(outer(w.state, 180).z - w.model.mesh.outer[180].z), 0.002f);
}

TEST(Cut, moves_no_column_and_no_material_point) {
  Wall w = build_wall(small_tube());
  Jobs jobs(1);
  for (int i = 0; i < 50; ++i) w.scratch.external[0].x = 0.3f, step(w, jobs);
  const std::vector<Point> point{{0, 0.9f, 0.9f, 1}, {23, -0.9f, -0.5f, 0}, {24, 0.99f, 0, -1}};
  std::vector<Vec3> before;
  for (const Point& p : point) before.push_back(place(weights(w.model, w.state.topology, p), w.state.motion));
  cut(w.model, w.state, w.scratch, std::vector<std::array<uint32_t, 2>>{{0, 24}, {24, 48}, {24, 25}});
  for (size_t i = 0; i < point.size(); ++i)
    EXPECT_EQ(place(weights(w.model, w.state.topology, point[i]), w.state.motion), before[i]);
}

// One cell of a face hangs on the next face. Two of its element's columns are held by nothing else. With a sixty-fourth of the
// face's stiffness, a thread that pressed on such a cell in `altemeier` turned its element inside out.
TEST(Cut, leaves_slivers_that_bear_a_load) {
  Wall w = build_wall(small_tube());
  const uint32_t face = 24 * 4, cell = 32;  // in the middle of edge 3
  const Raster& r = raster(true);
  std::vector<Mark> marks;
  for (const uint32_t link : r.of_cell[cell])
    if (link != kNone) marks.push_back({face, link});
  EXPECT_TRUE(cut_links(w.model, w.state, w.scratch, marks).divided);
  refactor(w.model, w.state, w.scratch);
  EXPECT_LT(largest_eigenvalue(w.model, w.state, w.scratch, true), 1.3f);
  const Weights on_cell = weights(w.model, w.state.topology, {face, -0.875f, 0.125f, 1});
  Jobs jobs(1);
  float speed = 0, farthest = 0;
  for (int i = 0; i < 2000; ++i) {
    add_to(w.scratch.external, on_cell, Vec3{0.1f, 0.1f, 1.0f} * std::min(0.5f, 1e-3f * static_cast<float>(i)));  // [N]
    step(w, jobs);
    speed = 0;
    for (uint32_t c = 0; c < columns(w.state); ++c) {
      speed = std::max(speed, length(vec3(w.state.motion.v[2 * c])));
      farthest =
          std::max(farthest, distance(vec3(w.state.motion.x[2 * c]), vec3(w.state.motion.x[2 * w.state.topology.source[c]])));
    }
  }
  std::printf("columns that only the sliver holds: %.2f mm from the others of the face, at last %.4f m/s\n", 1e3f * farthest,
              speed);
  EXPECT_LT(farthest, 4.4e-3f) << "the edge of a face: beyond that it is turned over";
  EXPECT_LT(speed, 1e-3f);
  for (int i = 0; i < 4000; ++i) step(w, jobs);
  EXPECT_LT(farthest_from_rest(w), 1e-4f);
}

// The largest stiffness that cuts can give: a face of slivers of four cells, each with an eighth instead of a sixteenth. With
// the factor from before the cut, the step stays below its limit of 2.67.
TEST(Cut, into_slivers_keeps_the_step_stable) {
  Wall w = build_wall(small_tube());
  const Raster& r = raster(true);
  std::vector<Mark> marks;
  for (uint32_t link = 0; link < r.inner; ++link) {
    const auto block = [](uint32_t cell) { return cell / 16 * 4 + cell % 8 / 2; };
    if (block(r.link[link].a) != block(r.link[link].b)) marks.push_back({24 * 4, link});
  }
  cut_links(w.model, w.state, w.scratch, marks);
  ASSERT_EQ(w.state.topology.fragment.size(), 16u);
  const float largest = largest_eigenvalue(w.model, w.state, w.scratch, true);
  std::printf("largest eigenvalue %.2f, before any cut %.2f\n", largest, w.model.report.largest);
  EXPECT_LT(largest, 2.67f);
}

// A bed that is far stiffer than the wall, and a sheet cut in two on it, the second time with a new factor: each half sinks by
// the pressure over the bed's modulus, and no eigenvalue comes near the limit of the step.
TEST(Cut, leaves_both_halves_of_a_sheet_on_their_bed) {
  for (const bool again : {false, true}) {
    Spec s;
    SheetShape shape;
    shape.columns = shape.rows = 9;
    s.mesh = sheet(shape);
    s.mesh.foundation.assign(s.mesh.outer.size(), 1e8f);
    s.gravity = {0, 0, -9.81f};
    Wall w = build_wall(s);
    std::vector<std::array<uint32_t, 2>> edge;
    for (uint32_t i = 0; i < 8; ++i) edge.push_back({4 + 9 * i, 4 + 9 * (i + 1)});
    EXPECT_EQ(cut(w.model, w.state, w.scratch, edge), 9u);
    if (again) refactor(w.model, w.state, w.scratch);
    EXPECT_LT(largest_eigenvalue(w.model, w.state, w.scratch, true), 1.3f);
    Jobs jobs(1);
    for (int i = 0; i < 2000; ++i) step(w, jobs);
    const float depth = 9.81f * 1050 * shape.thickness / 1e8f;  // 0.26 um
    for (uint32_t c = 0; c < columns(w.state); ++c) EXPECT_NEAR(-w.state.motion.x[2 * c].z, depth, 0.02f * depth);
  }
}

TEST(Mesh, of_the_bowel_generator_becomes_quads_with_its_two_rims) {
  BowelShape shape;
  const BodyRest body = make_bowel(shape);
  std::vector<Vec3> out, in;
  for (size_t i = 0; i + 1 < body.position.size(); i += 2) out.push_back(body.position[i]), in.push_back(body.position[i + 1]);
  std::vector<std::array<uint32_t, 3>> triangle;
  for (const Triangle& t : body.surface)
    if (t[0] % 2 == 0 && t[1] % 2 == 0 && t[2] % 2 == 0) triangle.push_back({t[0] / 2, t[1] / 2, t[2] / 2});
  const Mesh mesh = from_triangles(out, in, triangle, shape.axis, "bowel");
  size_t quads = 0;
  for (const auto& f : mesh.face) quads += f[3] != kNone;
  EXPECT_EQ(2 * quads + (mesh.face.size() - quads), triangle.size());
  EXPECT_GT(quads, mesh.face.size() * 9 / 10);
  EXPECT_EQ(rims(mesh).size(), 2u);
}

TEST(Wall, that_cannot_be_built_is_refused_with_a_line) {
  Spec s = small_tube();
  s.step = 1;
  EXPECT_THROW(build_wall(s), InputError);
  s = small_tube(), s.mesh.face[3] = {0, 0, 0, 0};
  EXPECT_THROW(build_wall(s), InputError);
  s = small_tube(), s.mesh.face[3][1] = 99999;
  EXPECT_THROW(build_wall(s), InputError);
  s = small_tube(), std::swap(s.mesh.outer, s.mesh.inner);
  EXPECT_THROW(build_wall(s), InputError);
  s = small_tube(), s.layer.clear();
  EXPECT_THROW(build_wall(s), InputError);
  s = small_tube(), s.mesh.outer[2].x = std::nanf("");
  EXPECT_THROW(build_wall(s), InputError);
}

}  // namespace
}  // namespace catgut::wall
