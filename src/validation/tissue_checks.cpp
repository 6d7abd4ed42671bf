// SPDX-License-Identifier: Apache-2.0
// validation: soft tissue: stiffness independent of the solver's settings, momentum, rotation, volume.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "anatomy/bowel.h"
#include "core/random.h"
#include "validation/checks.h"

namespace catgut::validation {
namespace {

constexpr float kReference = 1.0f / 480;  // [s] the substep for which a stiffness is given
constexpr std::array<int, 3> kSubsteps{8, 16, 32};

struct Percentiles {
  double low = 1e300, high = -1e300;
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
  double relative() const { return (high - low) / std::abs(0.5 * (high + low)); }
  double middle() const { return 0.5 * (high + low); }
};

float frame_part(int substeps) { return 1.0f / (60.0f * static_cast<float>(substeps)); }

// Static stretch [m] of a particle of 1 g hung on a spring of 1 N/m.
double hung_particle(int sweeps, float h) {
  Column<Vec4> x{point({})};
  const float w = 1000, g = 9.81f;
  Vec3 v{};
  Attachment a;
  a.point = particle_point(0);
  a.compliance = 1;
  std::vector<RigidBody> none;
  for (int i = 0; i < static_cast<int>(3 / h); ++i) {
    const Vec3 prev = xyz(x[0]);
    v.y -= g * h;
    a.lambda = {};
    add(x[0], v * h);
    for (int s = 0; s < sweeps; ++s) solve_attachment(a, x.data(), &w, {}, none, h);
    v = (xyz(x[0]) - prev) / (h * (1 + 20 * h));
  }
  return -double{x[0].y};
}

// Static stretch [m] of a chain of six particles of `mass` hung from its first, each segment 2 cm long.
double hung_chain(bool direct, int sweeps, float h, float mass, float compliance) {
  std::vector<Vec3> start;
  for (int i = 0; i < 6; ++i) start.push_back({0, -0.02f * static_cast<float>(i), 0});
  ThreadRig rig(start, 0.02f, mass, false);
  rig.model.stretch_compliance = compliance;
  rig.model.direct = direct;
  rig.model.distance_sweeps = sweeps;
  rig.model.gravity = {0, -9.81f, 0};
  rig.damping = 10;
  for (int i = 0; i < static_cast<int>(4 / h); ++i) rig.step(h);
  return -double{rig.x[5].y} - 0.1;
}

// Block of 3 x 3 x 3 particles in one cluster, its top layer pinned (or, with one_free, all but one pinned). Returns the sag
// [m] of the rest under `gravity`. With `volume`, its tetrahedra resist too.
struct HungBlock {
  float stiffness = 0.5f;  // at kReference
  float gravity = 9.81f;
  float volume_compliance = -1;
  bool one_free = false;
  int sweeps = 1, side = 3;
  double seconds = 2;
  float damping = 30;
};
double hung_block(const HungBlock& s, float h, Jobs& jobs, std::vector<Vec4>* end = nullptr) {
  const Block block = make_block(s.side, 0.01f);
  std::vector<float> mass(block.position.size(), 0.001f);
  TissueWorld world(block.position, mass, block.cluster);
  SolverModel& m = world.model;
  const uint32_t free_one = block.at(s.side / 2, 0, s.side / 2);
  for (int k = 0; k < s.side; ++k)
    for (int j = 0; j < s.side; ++j)
      for (int i = 0; i < s.side; ++i) {
        const uint32_t id = block.at(i, j, k);
        if (s.one_free ? id != free_one : j == s.side - 1) m.inv_mass[id] = 0;
      }
  m.h = h;
  m.tissue_gravity = {0, -s.gravity, 0};
  m.damping = s.damping;
  m.shape_stiffness = stiffness_at(s.stiffness, kReference, h);
  m.shape_sweeps = m.volume_sweeps = s.sweeps;
  if (s.volume_compliance >= 0) {
    m.use_volume = true;
    m.volume_compliance = s.volume_compliance;
    m.volume = make_volume_model(block.position, block.tet);
  }
  world.start(block.position);
  world.run(s.seconds, jobs);
  if (end) end->assign(world.state.x.begin(), world.state.x.end());
  return double{block.position[free_one].y} - double{world.state.x[free_one].y};
}

struct Momentum {
  double mass = 0;
  std::array<double, 3> linear{}, angular{}, center{};
};
Momentum momentum_of(const TissueWorld& w) {
  Momentum m;
  const SolverState& s = w.state;
  for (uint32_t i = 0; i < w.model.tissue; ++i) {
    const double k = 1.0 / double{w.model.inv_mass[i]};
    const std::array<double, 3> v{double{s.v[i].x}, double{s.v[i].y}, double{s.v[i].z}},
        x{double{s.x[i].x}, double{s.x[i].y}, double{s.x[i].z}};
    m.mass += k;
    for (size_t c = 0; c < 3; ++c) m.linear[c] += k * v[c], m.center[c] += k * x[c];
  }
  for (double& c : m.center) c /= m.mass;
  for (uint32_t i = 0; i < w.model.tissue; ++i) {
    const double k = 1.0 / double{w.model.inv_mass[i]};
    const std::array<double, 3> v{double{s.v[i].x}, double{s.v[i].y}, double{s.v[i].z}},
        x{double{s.x[i].x} - m.center[0], double{s.x[i].y} - m.center[1], double{s.x[i].z} - m.center[2]};
    for (size_t c = 0; c < 3; ++c) m.angular[c] += k * (x[(c + 1) % 3] * v[(c + 2) % 3] - x[(c + 2) % 3] * v[(c + 1) % 3]);
  }
  return m;
}
double distance_of(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double d = 0;
  for (size_t c = 0; c < 3; ++c) d += (a[c] - b[c]) * (a[c] - b[c]);
  return std::sqrt(d);
}

struct Drift {
  double linear = 0;        // change of linear momentum over the sum of m |v|
  double angular = 0;       // change of angular momentum over itself
  double acceleration = 0;  // [m/s^2] of the center of mass
};
// Spinning and compressed by a tenth, thrown with `speed`: changes within a second without external force.
Drift drift(TissueWorld& world, std::span<const Vec3> rest, Vec3 speed) {
  world.model.h = 1.0f / 960;
  world.model.shape_stiffness = stiffness_at(0.9f, kReference, world.model.h);
  Vec3 center{};
  for (const Vec3& p : rest) center += p / static_cast<float>(rest.size());
  std::vector<Vec3> start;
  for (const Vec3& p : rest) start.push_back({p.x - center.x, (p.y - center.y) * 0.9f, p.z - center.z});
  world.start(start);
  for (uint32_t i = 0; i < world.model.tissue; ++i) set(world.state.v[i], speed + cross(Vec3{0.6f, 2.0f, 0.4f}, start[i]));
  double size = 0;
  for (uint32_t i = 0; i < world.model.tissue; ++i)
    size += double{length(xyz(world.state.v[i]))} / double{world.model.inv_mass[i]};
  Jobs jobs(1);
  const Momentum before = momentum_of(world);
  world.run(1, jobs);
  const Momentum after = momentum_of(world);
  const double linear = distance_of(before.linear, after.linear);
  return {linear / size, distance_of(before.angular, after.angular) / distance_of(before.angular, {}), linear / before.mass};
}

double angle_between(Quat a, Quat b) { return double{length(rotation_vector(a * conjugate(b)))}; }

}  // namespace

void check_stiffness(Lines& out) {
  const std::string grid = "sweeps 1, 4, 16 x substeps 8, 16, 32";
  Percentiles attachment, soft_chain, direct_chain, soft_shape, stiff_shape, volume;
  Jobs one(1);
  // Soft means compliance well above h^2 / m: one sweep then converges, and any remaining dependence is an error of the
  // multipliers.
  HungBlock soft;
  soft.stiffness = 0.05f;
  soft.gravity = 1;
  soft.one_free = true;
  HungBlock stiff = soft;
  stiff.stiffness = 0.9f;
  stiff.gravity = 100;
  stiff.seconds = 1;
  HungBlock tets;
  tets.stiffness = 0.005f;
  tets.gravity = 1;
  tets.volume_compliance = 1e-8f;
  for (const int substeps : kSubsteps)
    for (const int sweeps : {1, 4, 16}) {
      const float h = frame_part(substeps);
      attachment.add(hung_particle(sweeps, h));
      soft_chain.add(hung_chain(false, sweeps, h, 1e-3f, 0.5f));
      direct_chain.add(hung_chain(true, sweeps, h, 1e-3f, 1e-2f));
      soft.sweeps = stiff.sweeps = tets.sweeps = sweeps;
      soft_shape.add(hung_block(soft, h, one));
      if (sweeps > 1) stiff_shape.add(hung_block(stiff, h, one));
      volume.add(hung_block(tets, h, one));
    }
  const double weight = 1e-3 * 9.81;
  out.add("static stretch, attachment", weight, attachment.middle(), 0.01, "m", "m g alpha");
  out.add("  its spread", 0, attachment.relative(), 0.01, "1", grid);
  out.add("static stretch, thread, sweeps only", 15 * weight * 0.5, soft_chain.middle(), 0.01, "m",
          "sum of m g alpha; alpha 0.5 m/N");
  out.add("  its spread", 0, soft_chain.relative(), 0.01, "1", grid);
  out.add("static stretch, thread, direct", 15 * weight * 0.01, direct_chain.middle(), 0.01, "m",
          "sum of m g alpha; alpha 0.01 m/N");
  out.add("  its spread", 0, direct_chain.relative(), 0.01, "1", grid);
  // A particle of a cluster of 27 whose others are pinned: its goal moves by 1/27 of its displacement.
  auto hang = [](double s, double g) { return g * double{kReference} * double{kReference} * (1 - s) / s / (1 - 1.0 / 27); };
  out.add("static sag, shape matching, soft", hang(0.05, 1), soft_shape.middle(), 0.01, "m",
          "g h0^2 (1 - s) / s / (1 - 1/27), s = 0.05");
  out.add("  its spread", 0, soft_shape.relative(), 0.01, "1", grid);
  out.add("static sag, shape matching, stiff", hang(0.9, 100), stiff_shape.middle(), 0.01, "m", "the same with s = 0.9");
  out.add("  its spread", 0, stiff_shape.relative(), 0.01, "1",
          "sweeps 4, 16 x substeps 8, 16, 32 (one sweep has not converged)");
  out.add("static sag, volume and shape, spread", 0, volume.relative(), 0.01, "1", grid);
  // Workers: identical bits, on a block with enough particles for several jobs.
  HungBlock big = tets;
  big.side = 9;
  big.sweeps = 1;
  big.seconds = 0.25;
  Jobs two(2);
  std::vector<Vec4> a, b;
  const double with_one = hung_block(big, frame_part(16), one, &a), with_two = hung_block(big, frame_part(16), two, &b);
  const bool same = std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec4)) == 0;
  out.add("static sag, workers 1 and 2", with_one, same ? with_two : 0, 0, "m", "every bit of 729 particles the same");
}

void check_momentum(Lines& out) {
  const Block block = make_block(5, 0.01f);
  std::vector<float> mass;
  Random random(7);
  for (size_t i = 0; i < block.position.size(); ++i) mass.push_back(0.001f * (0.7f + 0.6f * random.uniform()));
  BowelShape shape;
  shape.particles = 600;
  shape.pinned_length = 0;
  const BodyRest body = make_bowel(shape);
  for (const bool bowel : {false, true}) {
    auto make = [&] {
      return bowel ? TissueWorld(body.position, body.mass, body.cluster) : TissueWorld(block.position, mass, block.cluster);
    };
    const std::span<const Vec3> rest = bowel ? std::span<const Vec3>(body.position) : std::span<const Vec3>(block.position);
    const std::string what = bowel ? "free bowel" : "free block";
    const std::string cluster =
        bowel ? "no outer force; 600 overlapping clusters" : "no outer force; one cluster, unequal masses";
    TissueWorld spinning = make(), thrown = make();
    const Drift d = drift(spinning, rest, {});
    // A particle moves by the mean over its clusters, and particles near a rim are in fewer. Action and reaction then differ
    // slightly, as for the angular momentum below.
    out.add(what + ", linear momentum lost in 1 s", 0, d.linear, bowel ? 5e-3 : 1e-3, "1", cluster);
    out.add(what + ", angular momentum lost in 1 s", 0, d.angular, bowel ? 0.05 : 0.01, "1",
            bowel ? "no outer moment; averaging over clusters keeps it only nearly" : "no outer moment");
    // Float32 rounds a position 0.1 m from the origin by 4e-9 m, which appears as h^-2 times that in acceleration.
    out.add(what + ", thrown: acceleration from nothing", 0, drift(thrown, rest, {0.1f, 0.05f, -0.08f}).acceleration / 9.81,
            1e-3, "g", "no outer force; float32 positions up to 0.15 m from the origin");
  }
}

void check_rotation(Lines& out) {
  // Unequal sides, so that no rotation is special; the rotation axis is not an axis of the block.
  Block block = make_block(3, 0.01f);
  for (Vec3& p : block.position) p = {p.x, p.y * 1.4f, p.z * 0.6f};
  const std::vector<float> mass(block.position.size(), 0.001f);
  const Vec3 axis = normalized(Vec3{0.3f, 0.8f, -0.5f}), away{0.05f, -0.02f, 0.1f};
  auto settle = [&](TissueWorld& w, int sweeps) {
    make_shape_rows(w.model.shape, w.state.x.data(), w.scratch.shape, 0, w.model.shape.groups);
    for (int i = 0; i < sweeps; ++i) solve_shape_clusters(w.model.shape, w.state.rotation, w.scratch.shape, 0, 1);
  };
  auto found = [](const TissueWorld& w) {
    const ClusterRotations& r = w.state.rotation;
    return Quat{r.x[0], r.y[0], r.z[0], r.w[0]};
  };
  for (const double degrees : {0.0, 45.0, 90.0, 135.0, 180.0}) {
    TissueWorld w(block.position, mass, block.cluster);
    const Quat q = axis_angle(axis, static_cast<float>(degrees) * kPi / 180);
    std::vector<Vec3> turned;
    for (const Vec3& p : block.position) turned.push_back(away + rotate(q, p));
    w.start(turned);
    settle(w, 40);
    char name[64];
    std::snprintf(name, sizeof name, "rotation found after %.0f degrees", degrees);
    out.add(name, 0, angle_between(found(w), q), 1e-4, "rad", "known rotation; from no rotation, 40 steps");
    // A dent in one particle disappears: positions return to the rotated shape.
    add(w.state.x[0], {0.002f, 0.001f, -0.001f});
    w.state.v.assign(w.state.v.size(), {});
    w.model.shape_stiffness = 0.9f;
    w.model.damping = 200;
    Jobs jobs(1);
    w.run(1, jobs);
    double worst = 0;
    // The dent's mean displacement is kept; compare shapes, not positions.
    Vec3 mean{};
    for (const Vec4& p : w.state.x) mean += xyz(p) / static_cast<float>(turned.size());
    const Quat end = found(w);
    for (size_t i = 0; i < turned.size(); ++i)
      worst = std::max(worst, double{distance(xyz(w.state.x[i]) - mean, rotate(end, block.position[i]))});
    std::snprintf(name, sizeof name, "  shape restored, dent of 2.4 mm");
    out.add(name, 0, worst * 1000, 1e-3, "mm", "rest shape in the found rotation");
  }
  // Spinning at 20 turns a second, a step of 7.5 degrees per substep of 1/960 s: one warm step a substep keeps up.
  TissueWorld w(block.position, mass, block.cluster);
  w.start(block.position);
  double worst = 0;
  for (int i = 1; i <= 960; ++i) {
    const Quat q = axis_angle(axis, static_cast<float>(std::fmod(i * 7.5, 360.0)) * kPi / 180);
    for (size_t k = 0; k < block.position.size(); ++k) w.state.x[k] = point(away + rotate(q, block.position[k]));
    settle(w, 1);
    worst = std::max(worst, angle_between(found(w), q));
  }
  out.add("rotation followed, one warm step, 20 turns/s", 0, worst, 1e-3, "rad", "known rotation, 7.5 degrees a step");
}

void check_volume(Lines& out) {
  const Block block = make_block(5, 0.005f);
  const std::vector<float> mass(block.position.size(), 0.0002f);
  TissueWorld w(block.position, mass, block.cluster);
  w.model.h = 1.0f / 960;
  w.model.use_volume = true;
  w.model.volume = make_volume_model(block.position, block.tet);
  w.model.volume_sweeps = 2;
  w.model.shape_stiffness = stiffness_at(0.05f, kReference, w.model.h);
  w.model.damping = 20;
  w.start(block.position);
  for (int k = 0; k < block.n; ++k)
    for (int i = 0; i < block.n; ++i)
      for (const int j : {0, block.n - 1}) {
        Attachment a;
        a.point = particle_point(block.at(i, j, k));
        a.target = block.position[block.at(i, j, k)];
        w.state.attach.push_back(a);
      }
  auto volume = [&] {
    double v = 0;
    for (const Tet& t : block.tet)
      v += double{tet_volume(xyz(w.state.x[t[0]]), xyz(w.state.x[t[1]]), xyz(w.state.x[t[2]]), xyz(w.state.x[t[3]]))};
    return v;
  };
  const double rest = volume();
  Jobs jobs(1);
  double worst = 0;
  for (int frame = 1; frame <= 120; ++frame) {
    // The plates come together by a fifth in one second and stay.
    const float squeeze = 1 - 0.2f * std::min(1.0f, static_cast<float>(frame) / 60);
    for (Attachment& a : w.state.attach) a.target.y = block.position[a.point.particle[0]].y * squeeze;
    w.run(1.0 / 60, jobs);
    worst = std::max(worst, std::abs(volume() / rest - 1));
  }
  const double height = double{w.state.x[block.at(2, 4, 2)].y} - double{w.state.x[block.at(2, 0, 2)].y};
  double widest = 0;
  for (const Vec4& p : w.state.x) widest = std::max(widest, double{p.x});
  out.add("squeezed block, height", 0.8 * 0.02, height, 0.01, "m", "what the plates ask");
  out.add("squeezed block, volume", rest * 1e6, volume() * 1e6, 0.01, "ml", "incompressible: C = V - V0");
  out.add("squeezed block, worst volume error on the way", 0, worst, 0.01, "1", "incompressible");
}

}  // namespace catgut::validation
