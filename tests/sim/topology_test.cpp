// SPDX-License-Identifier: Apache-2.0
// tests/sim: tissue that is divided between two ticks. The pieces are bodies of their own (closed surface, true mass, nothing
// holds them together). Bites keep their place, and the run continues: further bites, saved, loaded, replayed to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numeric>
#include <string>

#include "core/archive.h"
#include "core/random.h"
#include "exchange/reflect.h"
#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/cell_graph.h"
#include "sim/model.h"
#include "sim/state.h"
#include "sim/topology.h"

namespace catgut {
namespace {

template <typename T>
std::vector<std::byte> bytes_of(const T& value) {
  std::vector<std::byte> out;
  ByteSink sink{out};
  Writer write(sink);
  write(value);
  return out;
}

struct Cut {
  const char* scene;
  uint32_t wall;
  Vec3 point, normal;  // point: [m] from the middle of the wall's particles
  const char* name;
};

Vec3 middle(const Model& model, const State& state, uint32_t wall) {
  Vec3 sum;
  float n = 0;
  for (uint32_t i = 0; i < model.solver.tissue; ++i)
    if (model.wall[i] == wall) sum += xyz(state.solver.x[i]), n += 1;
  return sum / n;
}

uint32_t divide(const Model& model, State& state, const Cut& cut) {
  return divide_by_plane(model, state, cut.wall, middle(model, state, cut.wall) + cut.point, cut.normal);
}

// A run of a scene by the scripted surgeon.
struct Sewing {
  SceneSpec scene;
  std::shared_ptr<const Model> model;
  StatePtr state;
  Hands hands;
  Jobs jobs;
  Snapshot seen;
  TickInput input;
  std::vector<Event> events;

  explicit Sewing(const std::string& name, int workers = 1)
      : scene(read_scene(name)), model(build_model(scene)), state(initial_state(*model)), jobs(workers) {
    hands = make_hands("scripted", scene, picture_model(*model));
    publish(*model, *state, seen);
  }
  const Model& now() const { return current_model(*model, *state); }
  const TickInput& next_input() {
    input.tick = state->tick;
    if (static_cast<float>(state->tick) * model->dt < scene.settle) {
      for (ToolInput& h : input.hand) h.connected = 0;
    } else {
      input = hands.surgeon->operate(seen, model->dt);
      input.tick = state->tick;
    }
    return input;
  }
  void tick() {
    step(*model, *state, next_input(), jobs);
    publish(*model, *state, seen);
    events.insert(events.end(), state->event.begin(), state->event.end());
  }
  size_t bites() const {
    size_t n = 0;
    for (const SutureView& u : seen.suture)
      n += static_cast<size_t>(std::count_if(u.bite.begin(), u.bite.end(), [](const BiteView& b) { return b.complete; }));
    return n;
  }
  void sew(size_t wanted, float seconds) {
    for (int i = static_cast<int>(seconds / model->dt); i > 0 && bites() < wanted; --i) {
      tick();
      ASSERT_TRUE(state_is_valid(*model, *state)) << "tick " << state->tick;
    }
    ASSERT_GE(bites(), wanted) << "after " << seconds << " s: " << hands.surgeon->doing();
  }
};

// --- what a piece is, found from outside
// ---------------------------------------------------------------------------------------

// Per tissue particle: its piece, by flood fill over the clusters, through which alone tissue holds together.
std::vector<uint32_t> pieces_by_clusters(const SolverModel& m) {
  std::vector<uint32_t> parent(m.tissue);
  std::iota(parent.begin(), parent.end(), 0u);
  const std::function<uint32_t(uint32_t)> root = [&](uint32_t i) { return parent[i] == i ? i : parent[i] = root(parent[i]); };
  for (uint32_t c = 0; c < m.shape.clusters; ++c) {
    const uint32_t* member = m.shape.member.data() + size_t{c} * m.shape.cluster_stride;
    for (uint32_t k = 1; k < m.shape.cluster_stride && member[k] < m.tissue; ++k) {
      const uint32_t a = root(member[0]), b = root(member[k]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  for (uint32_t i = 0; i < m.tissue; ++i) parent[i] = root(i);
  return parent;
}
size_t count(std::vector<uint32_t> piece) {
  std::sort(piece.begin(), piece.end());
  return static_cast<size_t>(std::unique(piece.begin(), piece.end()) - piece.begin());
}

double mass(const Model& m) {
  double sum = 0;
  for (uint32_t i = 0; i < m.solver.tissue; ++i)
    if (m.solver.inv_mass[i] > 0) sum += 1.0 / double{m.solver.inv_mass[i]};
  return sum;
}

class Division : public testing::TestWithParam<Cut> {};

TEST_P(Division, makes_two_bodies_with_closed_surfaces_and_true_masses) {
  const Cut& cut = GetParam();
  const SceneSpec scene = read_scene(cut.scene);
  const std::shared_ptr<const Model> model = build_model(scene);
  StatePtr state = initial_state(*model);
  const size_t before = count(pieces_by_clusters(model->solver));
  ASSERT_EQ(before, model->pieces);
  const uint32_t copies = divide(*model, *state, cut);
  ASSERT_GT(copies, 0u);
  const Model& now = current_model(*model, *state);
  EXPECT_EQ(now.solver.tissue, model->solver.tissue + copies);
  EXPECT_EQ(state->topology.version, 1u);

  const std::vector<uint32_t> piece = pieces_by_clusters(now.solver);
  EXPECT_EQ(count(piece), before + 1);
  EXPECT_EQ(now.pieces, before + 1);
  EXPECT_EQ(piece, now.piece);
  EXPECT_NEAR(mass(now) / mass(*model), 1, 1e-6);

  // Every edge of the surface has one triangle on each side; the surface of a piece encloses the volume of its cells, and the
  // piece has that volume's mass.
  std::map<std::pair<uint32_t, uint32_t>, int> edge;
  std::map<uint32_t, double> enclosed, filled, weight;
  for (const Triangle& t : now.solver.collision.surface) {
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(piece[t[k]], piece[t[0]]);
      ++edge[{t[k], t[(k + 1) % 3]}];
    }
    const auto at = [&](size_t k) { return xyz(now.solver.shape.rest[t[k]]); };
    enclosed[piece[t[0]]] += tet_volume({}, at(0), at(1), at(2));
  }
  for (const auto& [e, n] : edge) {
    ASSERT_EQ(n, 1) << e.first << " - " << e.second;
    ASSERT_TRUE(edge.count({e.second, e.first})) << "open at " << e.first << " - " << e.second;
  }
  for (const Tet& t : now.cell) {
    const auto at = [&](size_t k) { return xyz(now.solver.shape.rest[t[k]]); };
    filled[piece[t[0]]] += tet_volume(at(0), at(1), at(2), at(3));
    for (uint32_t i : t) ASSERT_EQ(piece[i], piece[t[0]]);
  }
  // Pinned particles have no inverse mass: relative masses are those of the shape.
  double all_weight = 0, all_filled = 0;
  for (uint32_t i = 0; i < now.solver.tissue; ++i) {
    weight[piece[i]] += double{now.solver.shape.relative_mass[i]}, all_weight += double{now.solver.shape.relative_mass[i]};
  }
  for (const auto& [p, v] : filled) all_filled += v;
  for (const auto& [p, v] : filled) {
    EXPECT_NEAR(enclosed[p] / v, 1, 1e-4) << "piece " << p;
    // The odd particle in mid-wall belongs to no cell: 1 in 1000 of the mass.
    EXPECT_NEAR(weight[p] / all_weight, v / all_filled, 2e-3) << "piece " << p;
    EXPECT_GT(v / all_filled, 0.05) << "piece " << p << " is a crumb";
  }
  // No contact pair pushes the two sides apart, whatever they overlap by: at rest nothing moves them.
  Jobs jobs(1);
  TickInput nobody;
  for (ToolInput& h : nobody.hand) h.connected = 0;
  const Column<Vec4> x = state->solver.x;
  step(*model, *state, nobody, jobs);
  for (uint32_t i = 0; i < now.solver.tissue; ++i) ASSERT_LT(distance(xyz(x[i]), xyz(state->solver.x[i])), 2e-4f);
}

INSTANTIATE_TEST_SUITE_P(Planes, Division,
                         testing::Values(Cut{"purse_string", 0, {}, {0, 1, 0}, "colon_across"},
                                         Cut{"purse_string", 0, {}, {1, 0, 0.1f}, "colon_lengthwise"},
                                         Cut{"purse_string", 0, {0, 0.01f, 0}, {0.7f, 1, 0.2f}, "colon_oblique"},
                                         Cut{"stay", 1, {}, {1, 0, 0}, "right_end_across"},
                                         Cut{"stay", 0, {}, {0, 1, 0}, "left_end_lengthwise"},
                                         Cut{"lembert", 0, {}, {0, 1, 0.3f}, "outer_tube"},
                                         Cut{"lembert", 1, {}, {0.3f, 1, 0}, "inner_tube"}),
                         [](const auto& cut) { return std::string(cut.param.name); });

// The same pull, with and without a cut: forceps lift the rim by 25 mm.
TEST(Topology, a_piece_that_was_cut_off_can_be_lifted_away) {
  float opened[2] = {};
  for (const bool cut : {false, true}) {
    const std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
    StatePtr state = initial_state(*model);
    Jobs jobs(1);
    TickInput input;
    input.hand[0].connected = 0;
    const uint32_t rim = model->technique.purse_string.rim_outer[0];
    const Cut below{"", 0, {0, 0.022f, 0}, {0, 1, 0}, ""};
    // The two columns of particles nearest to the plane, on its two sides, below the grip.
    uint32_t above = 0, under = 0;
    const Vec3 grip = xyz(state->solver.x[rim]);
    const float plane = middle(*model, *state, 0).y + 0.022f;
    float high = 1, low = 1;
    for (uint32_t i = 0; i < model->solver.tissue; i += 2) {
      const Vec3 p = xyz(state->solver.x[i]);
      const float aside = distance(p, {grip.x, p.y, grip.z});
      if (p.y > plane + 0.003f && p.y - plane + aside < high) high = p.y - plane + aside, above = i;
      if (p.y < plane - 0.003f && plane - p.y + aside < low) low = plane - p.y + aside, under = i;
    }
    const auto gap = [&] { return distance(xyz(state->solver.x[above]), xyz(state->solver.x[under])); };
    const float start = gap();
    ToolInput& forceps = input.hand[1];
    forceps.pose = {grip + Vec3{0, 0.001f, 0}, axis_angle({1, 0, 0}, -0.5f * kPi)};
    const auto tick = [&] {
      input.tick = state->tick;
      step(*model, *state, input, jobs);
    };
    for (int i = 0; i < 20; ++i) tick();
    forceps.jaw = 0;
    for (int i = 0; i < 5; ++i) tick();
    ASSERT_EQ(state->suture.instrument[1].held, Held::tissue);
    if (cut) { ASSERT_GT(divide(*model, *state, below), 0u); }
    for (int i = 0; i < 100; ++i) {
      forceps.pose.p.y += 0.00025f;
      tick();
      opened[cut] = std::max(opened[cut], gap() - start);
    }
    ASSERT_TRUE(state_is_valid(*model, *state));
    std::printf("%s: the places beside the plane come %.1f mm further apart\n", cut ? "cut" : "whole",
                1e3 * double{opened[cut]});
  }
  EXPECT_LT(opened[0], 0.006f);
  EXPECT_GT(opened[1], 0.015f);
}

// --- sutured tissue
// ------------------------------------------------------------------------------------------------------------

struct Place {
  std::string what;
  Vec3 at;
};
std::vector<Place> places(const Snapshot& seen) {
  std::vector<Place> all;
  for (const SutureView& u : seen.suture) {
    for (const BiteView& b : u.bite) {
      all.push_back({"entry", b.entry});
      if (b.has_exit) all.push_back({"exit", b.exit});
    }
    for (const SuturePointView& p : u.suture_point) all.push_back({"suture point", p.position});
    for (const KnotView& k : u.knot) all.push_back({"knot", k.position});
    for (const SeamView& s : u.seam) all.push_back({"pair", s.a}), all.push_back({"pair", s.b});
    for (uint32_t slot : u.thread_order) all.push_back({"thread", seen.particle[slot]});
  }
  for (const SettledView& b : seen.settled)
    for (Vec3 p : b.node) all.push_back({"baked thread", p});
  return all;
}

// Saves, loads elsewhere with another number of workers, and steps both.
void step_both(Sewing& run, Jobs& other_jobs, StatePtr& other) {
  load_state(*run.model, *other, save_state(*run.model, *run.state));
  Snapshot loaded;
  publish(*run.model, *other, loaded);
  ASSERT_EQ(bytes_of(run.seen), bytes_of(loaded)) << "loaded, before tick " << run.state->tick;
  const TickInput input = run.next_input();
  step(*run.model, *run.state, input, run.jobs);
  step(*run.model, *other, input, other_jobs);
  publish(*run.model, *run.state, run.seen);
  publish(*run.model, *other, loaded);
  ASSERT_EQ(hash_state(*run.model, *run.state), hash_state(*run.model, *other)) << "tick " << input.tick;
  ASSERT_EQ(bytes_of(run.seen), bytes_of(loaded)) << "tick " << input.tick;
}

// Where a sutured wall is divided: along its axis, and through a bite.
enum class Through { middle, entry, bite };
struct Sutured {
  const char* scene;
  uint32_t wall;
  Vec3 axis;  // of the tube
  Through through;
  size_t first, then;  // bites before and after
  const char* name;
};
class SuturedTissue : public testing::TestWithParam<Sutured> {};
constexpr float kPatience = 40;  // [s] for the bites before the cut, and after it

Cut plan_cut(const Sutured& p, const Sewing& run) {
  Cut cut{p.scene, p.wall, {}, normalized(cross(p.axis, {0.1f, 0.2f, 1}), {0, 1, 0}), p.name};
  if (p.through == Through::middle) return cut;
  // The plane through the tube's middle line and the entry of the first bite, or between its entry and its exit.
  const BiteView& bite = run.seen.suture[0].bite[0];
  const Vec3 m = middle(*run.model, *run.state, p.wall);
  const Vec3 to = p.through == Through::entry ? bite.entry : 0.5f * (bite.entry + bite.exit);
  cut.normal = normalized(cross(p.axis, to - m));
  return cut;
}

TEST_P(SuturedTissue, is_divided_saved_loaded_and_sutured_further) {
  const Sutured& p = GetParam();
  Sewing run(p.scene);
  ASSERT_NO_FATAL_FAILURE(run.sew(p.first, kPatience));
  const Cut cut = plan_cut(p, run);
  const std::vector<Place> before = places(run.seen);
  const size_t numbers = run.seen.particle.size();
  const Snapshot was = run.seen;
  ASSERT_GT(divide(*run.model, *run.state, cut), 0u);
  publish(*run.model, *run.state, run.seen);

  // Nothing jumps, and particles keep their numbers.
  const std::vector<Place> after = places(run.seen);
  ASSERT_EQ(before.size(), after.size());
  float furthest = 0;
  for (size_t i = 0; i < before.size(); ++i) {
    furthest = std::max(furthest, distance(before[i].at, after[i].at));
    EXPECT_LT(distance(before[i].at, after[i].at), 1e-6f) << before[i].what << ", place " << i;
  }
  ASSERT_GT(run.seen.particle.size(), numbers);
  for (size_t i = 0; i < numbers; ++i) ASSERT_EQ(bytes_of(was.particle[i]), bytes_of(run.seen.particle[i])) << i;
  for (size_t i = 0; i < was.rotation.size(); ++i) ASSERT_EQ(bytes_of(was.rotation[i]), bytes_of(run.seen.rotation[i])) << i;

  // What is embedded hangs on one piece only, unless it lies midway between two bodies.
  const Model& now = run.now();
  size_t moved = 0;
  for (const Suture& u : run.state->suture.suture)
    for (const Bite& b : u.bite)
      for (const BiteEnd* end : {&b.entry, &b.exit}) {
        if (end == &b.exit && !b.has_exit) continue;
        const uint32_t side = now.piece[now.solver.collision.surface[end->triangle][0]];
        float sum = 0;
        for (uint32_t k = 0; k < end->point.count; ++k) {
          EXPECT_EQ(now.piece[end->point.particle[k]], side);
          moved += end->point.particle[k] >= run.model->solver.tissue;
          sum += end->point.weight[k];
        }
        EXPECT_NEAR(sum, 1, 1e-5);
      }
  std::printf("%s: %zu places, moved by at most %.1e m; %zu bite particles are copies\n", p.name, before.size(),
              double{furthest}, moved);

  // The surgeon continues; saved and loaded at every seventh tick.
  Jobs other_jobs(3);
  StatePtr other = initial_state(*run.model);
  size_t compared = 0;
  for (int i = static_cast<int>(kPatience / run.model->dt); i > 0 && run.bites() < p.then; --i) {
    if (i % 7 == 0) {
      ASSERT_NO_FATAL_FAILURE(step_both(run, other_jobs, other));
      ++compared;
    } else {
      run.tick();
    }
    ASSERT_TRUE(state_is_valid(*run.model, *run.state)) << "tick " << run.state->tick;
  }
  EXPECT_GE(run.bites(), p.then) << run.hands.surgeon->doing();
  EXPECT_GT(compared, 10u);
  EXPECT_EQ(count(pieces_by_clusters(run.now().solver)), run.seen.topology.pieces);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SuturedTissue,
                         testing::Values(Sutured{"purse_string", 0, {0, 1, 0}, Through::middle, 1, 2, "colon"},
                                         Sutured{"purse_string", 0, {0, 1, 0}, Through::entry, 2, 3, "colon_through_a_hole"},
                                         Sutured{"purse_string", 0, {0, 1, 0}, Through::bite, 2, 3, "colon_through_a_bite"},
                                         Sutured{"stay", 1, {1, 0, 0}, Through::middle, 1, 2, "right_end"},
                                         Sutured{"stay", 0, {1, 0, 0}, Through::entry, 1, 2, "left_end_through_a_hole"}),
                         [](const auto& p) { return std::string(p.param.name); });

const Cut kLengthwise{"purse_string", 0, {}, {1, 0, 0.1f}, "lengthwise"};

TEST(Topology, a_run_with_a_division_is_the_same_again_with_any_number_of_workers) {
  std::vector<uint64_t> first;
  for (const int workers : {1, 1, 2, 4}) {
    Sewing run("purse_string", workers);
    ASSERT_NO_FATAL_FAILURE(run.sew(1, 20));
    ASSERT_GT(divide(*run.model, *run.state, kLengthwise), 0u);
    std::vector<uint64_t> hash{hash_state(*run.model, *run.state)};
    for (int i = 0; i < 120; ++i) run.tick(), hash.push_back(hash_state(*run.model, *run.state));
    if (first.empty()) first = hash;
    ASSERT_EQ(first, hash) << workers << " workers";
  }
}

// A second cut crosses the first one; then a third. Each adds a piece, or as many as it separates.
TEST(Topology, pieces_are_divided_again) {
  Sewing run("purse_string");
  ASSERT_NO_FATAL_FAILURE(run.sew(1, 20));
  const double whole = mass(*run.model);
  size_t pieces = 1;
  for (const Cut& cut :
       {Cut{"", 0, {}, {1, 0, 0.1f}, ""}, Cut{"", 0, {}, {0.1f, 1, 0}, ""}, Cut{"", 0, {}, {0, 0.2f, 1}, ""}}) {
    const std::vector<Place> before = places(run.seen);
    ASSERT_GT(divide(*run.model, *run.state, cut), 0u);
    publish(*run.model, *run.state, run.seen);
    const std::vector<Place> after = places(run.seen);
    for (size_t i = 0; i < before.size(); ++i) EXPECT_LT(distance(before[i].at, after[i].at), 1e-6f) << before[i].what;
    pieces *= 2;
    EXPECT_EQ(run.seen.topology.pieces, pieces);
    EXPECT_EQ(count(pieces_by_clusters(run.now().solver)), pieces);
    EXPECT_NEAR(mass(run.now()) / whole, 1, 1e-6);
    EXPECT_EQ(topology_error(*run.model, run.state->topology), "");
    for (int i = 0; i < 30; ++i) run.tick();
    ASSERT_TRUE(state_is_valid(*run.model, *run.state));
  }
  StatePtr other = initial_state(*run.model);
  Jobs three(3);
  ASSERT_NO_FATAL_FAILURE(step_both(run, three, other));
  EXPECT_EQ(divide_by_plane(*run.model, *run.state, 0, {0, 1, 0}, {0, 1, 0}), 0u) << "a plane that meets nothing";
  EXPECT_EQ(run.state->topology.version, 3u);
}

// A slit is not through: the particles at its inner end stay whole, and so does the body.
TEST(Topology, a_slit_leaves_one_piece) {
  const std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model);
  // Faces of the lengthwise plane, in the upper 20 mm of one side.
  StatePtr plan = initial_state(*model);
  ASSERT_GT(divide_by_plane(*model, *plan, 0, middle(*model, *plan, 0), {1, 0, 0}), 0u);
  const Vec4* x = state->solver.x.data();
  std::vector<Topology::Face> face;
  float rim = -1;
  for (uint32_t i = 0; i < model->solver.tissue; ++i) rim = std::max(rim, x[i].y);
  for (const Topology::Face& f : plan->topology.face) {
    Vec3 at;
    for (uint32_t i : face_of(model->cell[f.cell], f.face)) at += xyz(x[i]) / 3.0f;
    if (at.z > 0 && at.y > rim - 0.02f) face.push_back(f);
  }
  const uint32_t copies = divide(*model, *state, face);
  EXPECT_GT(copies, 6u);
  EXPECT_LT(copies, state->topology.face.size());
  const Model& now = current_model(*model, *state);
  EXPECT_EQ(now.pieces, 1u);
  EXPECT_EQ(count(pieces_by_clusters(now.solver)), 1u);
  EXPECT_NEAR(mass(now) / mass(*model), 1, 1e-6);
  // The rim has one gap: as many particles round it, and both ends of the slit.
  EXPECT_EQ(now.rim[0].outer.size(), model->rim[0].outer.size() + 1);
  StatePtr other = initial_state(*model);
  load_state(*model, *other, save_state(*model, *state));
  Jobs jobs(1);
  TickInput nobody;
  for (ToolInput& h : nobody.hand) h.connected = 0;
  for (int i = 0; i < 60; ++i) step(*model, *state, nobody, jobs), step(*model, *other, nobody, jobs);
  EXPECT_TRUE(state_is_valid(*model, *state));
  EXPECT_EQ(hash_state(*model, *state), hash_state(*model, *other));
}

// At any moment of a procedure: needle in the wall, forceps on it, thread on its way through.
TEST(Topology, tissue_is_divided_at_any_moment) {
  Sewing run("purse_string");
  Random random(7);
  StatePtr other = initial_state(*run.model), again = initial_state(*run.model);
  Jobs one(1), two(2);
  size_t divided = 0, in_tissue = 0;
  float furthest = 0;
  for (int i = 0; i < 1200; ++i) {
    run.tick();
    if (i % 61 != 60) continue;
    load_state(*run.model, *other, save_state(*run.model, *run.state));
    // Through a place near the rim, in any direction.
    const std::vector<uint32_t>& rim = run.model->rim[0].outer;
    const Vec3 at = run.seen.particle[rim[random.next() % rim.size()]] - Vec3{0, 0.01f * random.uniform(), 0};
    const Vec3 normal{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f};
    const std::vector<Place> before = places(run.seen);
    const uint32_t copies = divide_by_plane(*run.model, *other, 0, at, normal);
    Snapshot seen;
    publish(*run.model, *other, seen);
    const std::vector<Place> after = places(seen);
    ASSERT_EQ(before.size(), after.size());
    for (size_t k = 0; k < before.size(); ++k) {
      furthest = std::max(furthest, distance(before[k].at, after[k].at));
      EXPECT_LT(distance(before[k].at, after[k].at), 1e-6f) << before[k].what << ", tick " << run.state->tick;
    }
    divided += copies > 0, in_tissue += run.seen.active().needle.in_tissue;
    load_state(*run.model, *again, save_state(*run.model, *other));
    TickInput input = run.input;
    for (int k = 0; k < 30; ++k) {
      input.tick = other->tick;
      step(*run.model, *other, input, one), step(*run.model, *again, input, two);
      ASSERT_TRUE(state_is_valid(*run.model, *other)) << "divided at tick " << run.state->tick << ", " << k << " ticks later";
    }
    ASSERT_EQ(hash_state(*run.model, *other), hash_state(*run.model, *again)) << "divided at tick " << run.state->tick;
  }
  std::printf("%zu divisions, %zu of them with the needle in the tissue; places moved by at most %.1e m\n", divided, in_tissue,
              double{furthest});
  EXPECT_GT(divided, 12u);
  EXPECT_GT(in_tissue, 3u);
}

// Cuts that begin and end anywhere and cross each other. Nothing is lost, and every state can be saved and continued.
TEST(Topology, slits_that_cross_each_other_leave_a_sound_body) {
  const std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model), other = initial_state(*model);
  Random random(11);
  Jobs one(1), two(2);
  TickInput nobody;
  for (ToolInput& h : nobody.hand) h.connected = 0;
  size_t slits = 0;
  for (int i = 0; i < 25; ++i) {
    const Model& now = current_model(*model, *state);
    // The faces of a plane within a distance of a point of the wall.
    const uint32_t center = random.next() % now.solver.tissue;
    const Vec3 at = xyz(state->solver.x[center]);
    const Vec3 normal = normalized(Vec3{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f});
    const float reach = 0.005f + 0.02f * random.uniform();
    std::vector<Topology::Face> face;
    const CellGraph graph(now);
    const auto place = [&](uint32_t prism) {
      Vec3 sum;
      for (uint32_t c = 3 * prism; c < 3 * prism + 3; ++c)
        for (uint32_t k : now.cell[c]) sum += xyz(state->solver.x[k]) / 12.0f;
      return sum;
    };
    for (uint32_t c = 0; c < now.cell.size(); ++c)
      for (uint32_t f = 0; f < 4; ++f) {
        const uint32_t beyond = graph.across(c, f);
        if (beyond == kNoCell || beyond / 3 == c / 3 || distance(place(c / 3), at) > reach) continue;
        if (dot(place(c / 3) - at, normal) <= 0 && dot(place(beyond / 3) - at, normal) > 0) face.push_back({c, f});
      }
    slits += divide(*model, *state, face) > 0;
    const Model& then = current_model(*model, *state);
    ASSERT_EQ(topology_error(*model, state->topology), "") << "slit " << i;
    ASSERT_NEAR(mass(then) / mass(*model), 1, 1e-6);
    ASSERT_EQ(count(pieces_by_clusters(then.solver)), then.pieces);
    load_state(*model, *other, save_state(*model, *state));
    for (int k = 0; k < 10; ++k) step(*model, *state, nobody, one), step(*model, *other, nobody, two);
    ASSERT_TRUE(state_is_valid(*model, *state)) << "slit " << i;
    ASSERT_EQ(hash_state(*model, *state), hash_state(*model, *other)) << "slit " << i;
  }
  const Model& now = current_model(*model, *state);
  std::printf("%zu slits: %zu copies, %u pieces\n", slits, now.source.size(), now.pieces);
  EXPECT_GT(slits, 15u);
}

// --- states that were damaged
// --------------------------------------------------------------------------------------------------

TEST(Topology, a_state_whose_topology_is_impossible_is_refused_in_one_line) {
  const std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr sound = initial_state(*model);
  ASSERT_GT(divide(*model, *sound, kLengthwise), 0u);
  const Topology good = sound->topology;
  const std::vector<std::function<void(Topology&)>> damage = {
      [](Topology& t) { t.version = 0; },
      [](Topology& t) { t.source[0] = 0xffffffffu; },
      [](Topology& t) { t.source[0] ^= 1; },
      [](Topology& t) { t.source.pop_back(); },
      [](Topology& t) { t.source.push_back(t.source[0]); },
      [](Topology& t) { t.source.clear(); },
      [](Topology& t) { t.corner[0].cell = 0xffffffffu; },
      [](Topology& t) { t.corner[0].corner = 4; },
      [](Topology& t) { t.corner[3].particle = 0; },
      [](Topology& t) { t.corner[3].particle = 0xffffffffu; },
      [](Topology& t) { t.corner.pop_back(); },
      [](Topology& t) { std::swap(t.corner[0], t.corner[1]); },
      [](Topology& t) { t.corner.clear(); },
      [](Topology& t) { t.face[0].cell = 0xffffffffu; },
      [](Topology& t) { t.face[0].face = 4; },
      [](Topology& t) { t.face[1] = t.face[0]; },
      [](Topology& t) { t.face.pop_back(); },
      [](Topology& t) { t = {}; },
  };
  StatePtr state = initial_state(*model);
  for (size_t i = 0; i < damage.size(); ++i) {
    sound->topology = good;
    damage[i](sound->topology);
    const std::vector<std::byte> bytes = save_state(*model, *sound);
    try {
      load_state(*model, *state, bytes);
      ADD_FAILURE() << "damage " << i << " was not noticed";
    } catch (const InputError& e) {
      const std::string line = e.what();
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_NE(line.find("saved state"), std::string::npos) << line;
    }
  }
  sound->topology = good;
  load_state(*model, *state, save_state(*model, *sound));
  EXPECT_EQ(hash_state(*model, *state), hash_state(*model, *sound));
}

}  // namespace
}  // namespace catgut
