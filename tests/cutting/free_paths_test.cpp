// SPDX-License-Identifier: Apache-2.0
// tests/cutting: a pen on random paths over generated and imported organs: spirals, back over itself, along the rim, crossings,
// through a suture. Whatever it divides is drawn closed, with its mass, in as many pieces as a flood fill of the drawn surface
// finds; a state saved halfway continues to the same bits. CATGUT_LONG: 210 paths on seven bodies; otherwise one on each.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/random.h"
#include "field.h"

namespace catgut {
namespace {

// A bent tube, or a pouch that is closed at its far end, as an OBJ file.
std::string write_organ(const std::string& name, bool pouch) {
  const auto folder = std::filesystem::path(CATGUT_BINARY_DIR) / "test_meshes";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / name).string();
  std::ofstream out(path);
  constexpr int along = 24, round = 32;
  for (int i = 0; i < along; ++i) {
    const double t = i / double(along - 1), r = (0.02 + 0.003 * t) * (pouch ? std::sqrt(std::min(1.0, (1.01 - t) * 4)) : 1);
    for (int j = 0; j < round; ++j) {
      const double a = 2 * 3.14159265358979 * j / round;
      out << "v " << r * std::cos(a) + 0.03 * t * t << " " << 0.09 * t << " " << r * std::sin(a) << "\n";
    }
  }
  for (int i = 0; i + 1 < along; ++i)
    for (int j = 0; j < round; ++j) {
      const int a = 1 + i * round + j, b = 1 + i * round + (j + 1) % round;
      out << "f " << a << " " << b << " " << b + round << " " << a + round << "\n";
    }
  if (!pouch) return path;
  out << "v 0.03 0.0915 0\n";
  const int base = 1 + (along - 1) * round;
  for (int j = 0; j < round; ++j) out << "f " << along * round + 1 << " " << base + j << " " << base + (j + 1) % round << "\n";
  return path;
}

struct Organ {
  const char* name;
  void (*change)(BodySpec&);
};
const Organ kOrgans[] = {
    {"tube", [](BodySpec&) {}},
    {"wide tube with haustra",
     [](BodySpec& b) { b.particles = 800, b.radius = 0.020f, b.length = 0.050f, b.wall = 0.0025f, b.haustra = 0.0012f; }},
    {"pouch", [](BodySpec& b) { b.particles = 600, b.radius = 0.016f, b.length = 0.035f, b.closed_start = true; }},
    {"finer tube", [](BodySpec& b) { b.particles = 1200; }},
    {"imported bent tube",
     [](BodySpec& b) { b.mesh = write_organ("cut_bent.obj", false), b.particles = 800, b.wall = 0.0025f; }},
    {"imported pouch", [](BodySpec& b) { b.mesh = write_organ("cut_pouch.obj", true), b.particles = 800, b.wall = 0.0025f; }},
    {"imported fine pouch",
     [](BodySpec& b) { b.mesh = write_organ("cut_pouch.obj", true), b.particles = 1400, b.wall = 0.0025f; }},
};

using Path = std::vector<wall::Point>;  // on the outer face

// Kinds: 0 spiral, 1 back over itself, 2 along a rim and beyond it, 3 figure of eight, 4 back and forth, 5 straight.
Path random_path(const Model& model, Random& random, int kind) {
  const wall::Model& m = model.physical->world.wall;
  const wall::State& start = model.physical->start.wall;
  const auto draw = [&](float low, float high) { return low + (high - low) * random.uniform(); };
  const auto on = [&](Vec3 p) { return wall::nearest_point(m, start, p, 1); };
  const auto at = [&](wall::Point p, float zeta) {
    p.zeta = zeta;
    return wall::place(wall::weights(m, start.topology, p), start.motion);
  };
  Path path;
  const auto rims = wall::rims(m.mesh);
  if (kind == 2 && !rims.empty()) {
    const auto& rim = rims.front();
    Vec3 middle{};
    for (const uint32_t c : rim) middle += m.mesh.outer[c] / static_cast<float>(rim.size());
    Vec3 inward{};
    for (const Vec3 p : m.mesh.outer) inward += (p - middle) / static_cast<float>(m.mesh.outer.size());
    inward = normalized(inward);
    const size_t first = static_cast<size_t>(random.uniform() * static_cast<float>(rim.size() - 1));
    for (float t = 0; t < 6; t += 0.04f) {
      const size_t k = first + static_cast<size_t>(t);
      const Vec3 a = m.mesh.outer[rim[k % rim.size()]], b = m.mesh.outer[rim[(k + 1) % rim.size()]];
      path.push_back(on(lerp(a, b, t - std::floor(t)) + inward * (0.3e-3f + 0.8e-3f * portable::sin(2 * t))));
    }
    return path;
  }
  // A plane that touches the organ somewhere between its held part and its rim.
  wall::Point base;
  for (int tries = 0; tries < 1000; ++tries) {
    base = {static_cast<uint32_t>(random.uniform() * static_cast<float>(m.mesh.face.size() - 1)), 0.3f, 0.3f, 1};
    bool free = true;
    for (const uint32_t c : m.mesh.face[base.face]) free = free && (c == wall::kNone || !m.mesh.held[c]);
    if (free) break;
  }
  const Vec3 origin = at(base, 1), normal = normalized(origin - at(base, -1)), u = any_perpendicular(normal),
             v = cross(normal, u);
  const auto add = [&](float x, float y) { path.push_back(on(origin + u * x + v * y)); };
  const float turn = draw(0, 2 * kPi), c = portable::cos(turn), s = portable::sin(turn);
  const auto turned = [&](float x, float y) { add(c * x - s * y, s * x + c * y); };
  switch (kind) {
    case 0:
      for (float t = 0; t < 14; t += 0.05f) add(0.25e-3f * t * portable::cos(t), 0.25e-3f * t * portable::sin(t));
      break;
    case 1: {
      const float far = draw(3e-3f, 8e-3f), aside = draw(-2e-3f, 2e-3f);
      for (float t = 0; t < 2; t += 0.02f) turned(far * std::min(t, 2 - t), aside * std::min(t, 2 - t));
      break;
    }
    case 3:
      for (float t = 0; t < 6.6f; t += 0.03f) turned(4e-3f * portable::sin(t), 2.5e-3f * portable::sin(2 * t));
      break;
    case 4: {
      float x = 0, y = 0;
      for (int i = 0; i < 6; ++i) {
        const float dx = draw(-5e-3f, 5e-3f) - x, dy = draw(-5e-3f, 5e-3f) - y;
        for (float t = 0; t < 1; t += 0.04f) turned(x + t * dx, y + t * dy);
        x += dx, y += dy;
      }
      break;
    }
    default:
      for (float t = -5e-3f; t < 5e-3f; t += 0.1e-3f) turned(t, 0);
  }
  return path;
}

TEST(FreePaths, are_drawn_closed_with_their_mass_and_pieces_on_generated_and_imported_organs) {
  const int rounds = std::getenv("CATGUT_LONG") ? 30 : 1;
  uint32_t paths = 0, divided = 0, freed = 0, faults = 0;
  for (size_t o = 0; o < std::size(kOrgans); ++o) {
    SceneSpec scene = Field::scene_of(400);
    kOrgans[o].change(scene.body[0]);
    Field f(scene);
    const physical::Model& m = f.model->physical->world;
    double worst_mass = 0, worst_opening = 0, whole = 0;
    for (int round = 0; round < rounds; ++round, ++paths) {
      SCOPED_TRACE(std::string(kOrgans[o].name) + ", path " + std::to_string(round));
      Random random(1000 * o + static_cast<uint64_t>(round) + 1);
      const int kind = rounds == 1 ? static_cast<int>(o) % 6 : round % 6;
      const Path path = random_path(*f.model, random, kind);
      const float speed = random.uniform() < 0.3f ? 0.012f : 0.005f;  // [m/s] some are only scored
      StatePtr state = initial_state(*f.model), other;
      if (kind == 5) {  // a suture in the middle of the path
        physical::Hole hole;
        hole.place = path[path.size() / 2];
        state->physical.world.hole.push_back(hole);
        state->physical.world.thread.eyelet.push_back({});
      }
      const auto mouth_of = [&](const State& s) { return physical::mouth(m, s.physical.world, s.physical.world.hole[0]); };
      const Vec3 mouth = kind == 5 ? mouth_of(*state) : Vec3{};
      state->physical.cutting.mode[0] = PenMode::cut;
      state->event.start(0);
      // Leads the tip along a part of the path.
      const auto lead = [&](State& to, size_t from, size_t end) {
        physical::Scratch scratch(m, to.physical.world);
        const wall::State& start = f.model->physical->start.wall;
        const auto at = [&](wall::Point p) { return wall::place(wall::weights(m.wall, start.topology, p), start.motion); };
        for (size_t i = from; i + 1 < end; ++i) {
          const Vec3 a = at(path[i]), b = at(path[i + 1]);
          const float along = distance(a, b);
          const int steps = std::max(1, static_cast<int>(along / (speed * 0.008f)));
          for (int k = 0; k < steps; ++k) {
            to.physical.world.bodies.body[0].pose.p = lerp(a, b, static_cast<float>(k) / static_cast<float>(steps));
            use_pens(*f.model, to, scratch, along / speed / static_cast<float>(steps));
          }
          if (whole == 0 && !to.physical.cutting.excision.passed.empty() && to.physical.world.wall.topology.fragment.empty()) {
            renew_cut_picture(*f.model, to), publish(*f.model, to, f.seen);
            whole = measure_cut(f.scene, f.seen).mass;
          }
        }
      };
      lead(*state, 0, path.size() / 2);
      const bool twice = rounds == 1 ? o % 2 == 0 : round % 5 == 3;
      if (twice) {
        other = initial_state(*f.model);
        load_state(*f.model, *other, save_state(*f.model, *state));
      }
      lead(*state, path.size() / 2 - 1, path.size());
      renew_cut_picture(*f.model, *state), publish(*f.model, *state, f.seen);
      const CutMeasures drawn = measure_cut(f.scene, f.seen);
      const uint32_t pieces = wall::count_pieces(state->physical.world.wall);
      EXPECT_EQ(drawn.pieces, pieces);
      EXPECT_TRUE(state_is_valid(*f.model, *state));
      worst_mass = std::max(worst_mass, std::abs(drawn.mass / whole - 1));
      worst_opening = std::max(worst_opening, opening_of(*f.seen.topology.picture));
      divided += !state->physical.world.wall.topology.fragment.empty(), freed += pieces > 1;
      if (kind == 5) {
        EXPECT_LT(distance(mouth_of(*state), mouth), 1e-6f) << "the suture stays in its hole";
        for (const Event& e : state->event) faults += e.fault == Fault::cut_at_suture;
      }
      if (!twice) continue;
      lead(*other, path.size() / 2 - 1, path.size());
      EXPECT_EQ(hash_state(*f.model, *other), hash_state(*f.model, *state)) << "saved halfway";
      Snapshot loaded;
      renew_cut_picture(*f.model, *other), publish(*f.model, *other, loaded);
      EXPECT_EQ(loaded.topology.picture->body[0].triangle, f.seen.topology.picture->body[0].triangle);
    }
    std::printf("%s: mass differs by %.1e at most, opening %.1e\n", kOrgans[o].name, worst_mass, worst_opening);
    EXPECT_LT(worst_mass, 1e-6);
    EXPECT_LT(worst_opening, 1e-6);
  }
  std::printf("%u paths: %u divide the wall, %u free a piece, %u cut at a suture\n", paths, divided, freed, faults);
  EXPECT_GT(divided, 0u);
  EXPECT_GT(freed, 0u);
}

}  // namespace
}  // namespace catgut
