// SPDX-License-Identifier: Apache-2.0
// validation: see contact_scenes.h.
#include "validation/contact_scenes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>

#include "sim/model.h"
#include "sim/scene.h"
#include "validation/swept.h"

namespace catgut::validation {

using physical::BodyModel;

const char* name_of(ContactBody body) {
  constexpr const char* kNames[kContactBodies] = {"a bowel end",          "two bowel ends",       "two pads of skin",
                                                  "a tube within a tube", "a bowel with haustra", "an imported pouch"};
  return kNames[static_cast<size_t>(body)];
}

const char* name_of(ContactPair pair) {
  constexpr const char* kNames[kContactPairs] = {"tool and wall",   "needle and wall", "thread and wall",
                                                 "tool and needle", "tool and thread", "needle and thread"};
  return kNames[pair];
}

namespace {

// A bent pouch, open at one end, as a mesh file of any program.
class PouchFile {
 public:
  PouchFile()
      : path_(std::filesystem::temp_directory_path() / ("catgut_pouch_" + std::to_string(std::random_device()()) + ".obj")) {
    std::ofstream out(path_);
    constexpr int along = 24, round = 32;
    for (int i = 0; i < along; ++i) {
      const double t = i / double(along - 1), r = (0.02 + 0.003 * t) * std::sqrt(std::min(1.0, (1.01 - t) * 4));
      for (int j = 0; j < round; ++j) {
        const double a = 2 * double{kPi} * j / round;
        out << "v " << r * std::cos(a) + 0.03 * t * t << " " << 0.09 * t << " " << r * std::sin(a) << "\n";
      }
    }
    for (int i = 0; i + 1 < along; ++i)
      for (int j = 0; j < round; ++j) {
        const int a = 1 + i * round + j, b = 1 + i * round + (j + 1) % round;
        out << "f " << a << " " << b << " " << b + round << " " << a + round << "\n";
      }
    out << "v 0.03 0.0915 0\n";
    const int base = 1 + (along - 1) * round;
    for (int j = 0; j < round; ++j)
      out << "f " << along * round + 1 << " " << base + j << " " << base + (j + 1) % round << "\n";
  }
  ~PouchFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  PouchFile(const PouchFile&) = delete;
  PouchFile& operator=(const PouchFile&) = delete;
  std::string name() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

// The bodies of the scenes with physical mechanics, turned so that an opening faces z or x and the thread can lie across them.
wall::Wall wall_of(ContactBody body) {
  if (body == ContactBody::tube) {
    wall::TubeShape shape;
    shape.length = 0.05f, shape.rings = 14, shape.held_rings = 2;
    wall::Spec spec;
    spec.mesh = wall::tube(shape);
    spec.drag = 20;
    return wall::build_wall(spec);
  }
  SceneSpec scene;
  scene.name = "contact";
  scene.mechanics.kind = "physical";
  BodySpec b;
  b.particles = 600, b.radius = 0.0125f, b.length = 0.040f, b.wall = 0.0020f, b.haustra = 0, b.pinned_length = 0.020f;
  std::optional<PouchFile> file;
  switch (body) {
    case ContactBody::ends:
      b.position = {-0.0015f, 0, 0}, b.axis = {1, 0, 0};
      scene.body.push_back(b);
      b.position = {0.0015f, 0, 0}, b.axis = {-1, 0, 0}, b.name = "right bowel";
      break;
    case ContactBody::pads:
      b.kind = "pad", b.radius = 0.02f, b.length = 0.016f, b.wall = 0.003f, b.pinned_length = 0.006f;
      b.position = {-0.001f, 0, 0}, b.axis = {1, 0, 0};
      scene.body.push_back(b);
      b.position = {0.001f, 0, 0}, b.axis = {-1, 0, 0}, b.name = "right lip";
      break;
    case ContactBody::tubes:
      b.axis = {0, 0, 1}, b.radius = 0.0145f, b.inner_radius = 0.011f, b.particles = 1000;
      break;
    case ContactBody::bowel:
      b.axis = {0, 0, 1}, b.radius = 0.02f, b.length = 0.06f, b.wall = 0.0025f, b.particles = 800, b.haustra = 0.0012f;
      break;
    default:
      file.emplace();
      b.axis = {0, 0, 1}, b.mesh = file->name(), b.particles = 800, b.wall = 0.0025f;
  }
  scene.body.push_back(b);
  const auto model = build_model(scene);
  return {model->physical->world.wall, model->physical->start.wall,
          wall::make_scratch(model->physical->world.wall, model->physical->start.wall)};
}

// Nearest points of two segments, as fractions.
void nearest_fractions(Vec3 a, Vec3 b, Vec3 c, Vec3 d, float& s, float& t) {
  const Vec3 u = b - a, v = d - c, r = a - c;
  const float uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), det = uu * vv - uv * uv;
  s = det > 1e-6f * uu * vv ? std::clamp((uv * dot(v, r) - vv * dot(u, r)) / det, 0.0f, 1.0f) : 0.5f;
  t = (uv * s + dot(v, r)) / std::max(vv, 1e-16f);
  if (t >= 0 && t <= 1) return;
  t = std::clamp(t, 0.0f, 1.0f);
  s = std::clamp((uv * t - dot(u, r)) / std::max(uu, 1e-16f), 0.0f, 1.0f);
}

// A cone about a segment.
struct Rod {
  Vec3 a, b;
  float ra, rb;
};
float overlap_of(const Rod& p, const Rod& q) {
  const float reach = p.ra + p.rb + q.ra + q.rb + 0.5f * (distance(p.a, p.b) + distance(q.a, q.b));
  if (length2((p.a + p.b - q.a - q.b) * 0.5f) > reach * reach) return 0;
  float s = 0, t = 0;
  nearest_fractions(p.a, p.b, q.a, q.b, s, t);
  return p.ra + (p.rb - p.ra) * s + q.ra + (q.rb - q.ra) * t - distance(lerp(p.a, p.b, s), lerp(q.a, q.b, t));
}
constexpr float kNear = 4e-3f;     // [m] more than half of any wall, and than the thickest instrument
constexpr float kThrough = 0.75f;  // of the thinner one's thickness and the other's radius: its axis is through the other's

std::vector<Rod> rods_of(const BodyModel& m, const physical::Body& body) {
  std::vector<Rod> rods;
  for (const physical::BodyCapsule& c : m.capsule) {
    const physical::BodySphere &a = m.sphere[c.a], &b = m.sphere[c.b];
    rods.push_back({transform(body.pose, local(m, a, body.opening)), transform(body.pose, local(m, b, body.opening)),
                    std::abs(a.radius), std::abs(b.radius)});
  }
  return rods;
}

// Where the segment p q crosses the triangle a b c, as a fraction of it; -1: it does not.
float crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 d = q - p, e = b - a, f = c - a, h = cross(d, f);
  const float det = dot(e, h);
  if (std::abs(det) < 1e-16f) return -1;
  const Vec3 r = p - a;
  const float u = dot(r, h) / det;
  const Vec3 g = cross(r, e);
  const float v = dot(d, g) / det, t = dot(f, g) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1 ? t : -1;
}

struct Face {
  std::array<Vec3, 4> corner;
  uint32_t count = 4;
};
Face face_of(const wall::Model& wm, const wall::State& ws, uint32_t f) {
  const uint32_t lane = wm.lane_of_face[f];
  const auto& corners = ws.topology.corners[lane / wall::kLanesOfBlock];
  Face face;
  face.count = wm.mesh.face[f][3] == wall::kNone ? 3 : 4;
  for (size_t k = 0; k < face.count; ++k)
    face.corner[k] = wall::vec3(ws.motion.x[2 * corners.column[k][lane % wall::kLanesOfBlock]]);
  return face;
}

// The same of a face. A quadrilateral is a bilinear patch: where it is warped, two triangles are up to a quarter of the warp
// beside it.
float crosses_face(Vec3 p, Vec3 q, const Face& face) {
  const auto& c = face.corner;
  if (face.count == 3) return crosses(p, q, c[0], c[1], c[2]);
  constexpr float kFlat = 0.1e-3f;  // [m]
  const int parts = length2(c[0] - c[1] + c[2] - c[3]) < kFlat * kFlat ? 1 : 6;
  const auto at = [&](int i, int j) {
    const float s = static_cast<float>(i) / static_cast<float>(parts), t = static_cast<float>(j) / static_cast<float>(parts);
    return lerp(lerp(c[0], c[1], s), lerp(c[3], c[2], s), t);
  };
  for (int i = 0; i < parts; ++i)
    for (int j = 0; j < parts; ++j)
      for (const bool upper : {false, true})
        if (const float t =
                crosses(p, q, at(i, j), upper ? at(i + 1, j + 1) : at(i + 1, j), upper ? at(i, j + 1) : at(i + 1, j + 1));
            t >= 0)
          return t;
  return -1;
}

Vec3 place_at(const wall::Model& wm, const wall::State& ws, wall::Point p, float zeta) {
  p.zeta = zeta;
  return wall::place(wall::weights(wm, ws.topology, p), ws.motion);
}

}  // namespace

ContactBench::ContactBench(uint64_t s, ContactBody body) : seed(s) {
  const wall::Wall w = wall_of(body);
  model = physical::make_model(w, knot_settings(0.3f));
  model.thread.gravity = model.bodies.gravity = {0, -9.81f, 0};
  model.thread.breaks = false;
  physical::ToolShape blunt;
  blunt.tip_radius = 1.6e-3f, blunt.hinge_radius = 2.4e-3f;
  model.bodies.body = {physical::make_tool(blunt), physical::make_needle_body({})};
  model.needles.needle = {physical::make_needle({}, 1)};
  model.needles.law.puncture = 1e3f;  // nothing may cross
  rest.wall = w.state;
  rest.bodies.body.resize(2), rest.needle.resize(1);
  low = {1e9f, 1e9f, 1e9f}, high = -low;
  for (uint32_t f = 0; f < w.model.mesh.face.size(); ++f) {
    bool held = false;
    for (const uint32_t c : w.model.mesh.face[f]) held = held || (c != wall::kNone && w.model.mesh.held[c]);
    if (held) continue;
    free.push_back(f);
    const Face face = face_of(w.model, w.state, f);
    for (size_t k = 0; k < face.count; ++k) {
      const Vec3 p = face.corner[k];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  middle = (low + high) * 0.5f;
  skin = std::make_unique<Skin>(model, rest.wall);
  // Across the body, its ends drawn down beside it.
  std::vector<Vec3> path;
  const float top = high.y + 0.5f * w.model.laminate.thickness + 0.5e-3f;
  for (int i = 0; i < 160; ++i) path.push_back({middle.x + 0.5e-3f * (static_cast<float>(i) - 79.5f), top, middle.z});
  rest.thread = thread::make_state(path);
  scratch = std::make_unique<physical::Scratch>(model, rest);
  for (uint32_t b = 0; b < 2; ++b)
    physical::move_body(model, rest, b, {{middle.x, high.y + 0.1f + 0.2f * static_cast<float>(b), middle.z}, {}}, 0);
  state = rest;
  target.assign(2, {});
  for (const uint32_t end : {0u, 159u}) pull.push_back({end, {0, -0.3f, 0}});
  const Pose away = rest.bodies.body[1].pose;
  for (int i = 0; i < 300; ++i) step();
  rest.wall = state.wall, rest.thread = state.thread, rest.contact = state.contact, rest.lip = state.lip;
  physical::move_body(model, rest, 1, away, 0);
  state = rest;
}

Vec3 ContactBench::direction() {
  for (;;) {
    const Vec3 v{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1};
    if (length2(v) < 1 && length2(v) > 0.01f) return normalized(v);
  }
}

void ContactBench::step() {
  physical::Hands hands;
  hands.targets = target, hands.pulls = pull, hands.holds = hold;
  physical::step(model, state, *scratch, hands, jobs);
  if (watch) watch();
}

void ContactBench::forget() {
  std::fill(std::begin(passed), std::end(passed), 0);
  std::fill(std::begin(deepest), std::end(deepest), 0.0f);
}

void ContactBench::bound(const wall::State& ws, Bounds& bounds) const {
  const uint32_t faces = static_cast<uint32_t>(model.wall.lane_of_face.size());
  bounds.center.resize(faces), bounds.radius.resize(faces);
  for (uint32_t f = 0; f < faces; ++f) {
    const Face face = face_of(model.wall, ws, f);
    Vec3 center{};
    for (size_t k = 0; k < face.count; ++k) center += face.corner[k] / static_cast<float>(face.count);
    bounds.center[f] = center, bounds.radius[f] = 0;
    for (size_t k = 0; k < face.count; ++k) bounds.radius[f] = std::max(bounds.radius[f], distance(center, face.corner[k]));
  }
}

bool ContactBench::passes_wall(const wall::State& ws, const Bounds& bounds, Vec3 p, Vec3 q) const {
  const Vec3 between = (p + q) * 0.5f;
  const float half = 0.5f * distance(p, q);
  for (uint32_t f = 0; f < bounds.center.size(); ++f) {
    if (length2(bounds.center[f] - between) > (bounds.radius[f] + half) * (bounds.radius[f] + half)) continue;
    const float t = crosses_face(p, q, face_of(model.wall, ws, f));
    // The middle of the wall ends at its rim: a thread that lies in that as deep as it may is not through it. The middle of a
    // face that is folded upon itself may lie outside its skin.
    const Vec3 at = lerp(p, q, t);
    if (t >= 0 && skin_distance(ws, bounds, at) > kMostOverlap - 0.5f * model.thread.material.diameter && skin->inside(at))
      return true;
  }
  return false;
}

void ContactBench::see_wall() {
  bound(state.wall, now);
  skin->follow(model, state.wall);
}

float ContactBench::skin_distance(const wall::State& ws, const Bounds& bounds, Vec3 p) const {
  float far = kNear;
  for (uint32_t f = 0; f < bounds.center.size(); ++f) {
    const float reach = bounds.radius[f] + kNear;
    if (length2(bounds.center[f] - p) > reach * reach) continue;
    for (uint32_t q = model.surface.first_of_face[f]; q < model.surface.first_of_face[f + 1]; ++q)
      far = std::min(far, distance(nearest_on_patch(model.wall, ws, model.surface, q, p).at, p));
  }
  return far;
}

float ContactBench::wall_overlap(const wall::State& ws, const Bounds& bounds, Vec3 p, float r) const {
  const float far = skin_distance(ws, bounds, p);
  if (far >= kNear) return 0;
  return skin->inside(p) ? r + far : r - far;
}

void ContactBench::look() {
  const wall::State& ws = state.wall;
  see_wall();
  const auto deepen = [&](ContactPair pair, float overlap) { deepest[pair] = std::max(deepest[pair], overlap); };
  std::vector<Rod> rods[2];
  for (uint32_t b = 0; b < 2; ++b) {
    const BodyModel& m = model.bodies.body[b];
    const physical::Body& body = state.bodies.body[b];
    const ContactPair pair = b == 0 ? tool_wall : needle_wall;
    for (const physical::BodySphere& s : m.sphere)
      if (s.radius > 0) deepen(pair, wall_overlap(ws, now, transform(body.pose, local(m, s, body.opening)), s.radius));
    rods[b] = rods_of(m, body);
    for (const Rod& r : rods[b]) passed[pair] += passes_wall(ws, now, r.a, r.b);
    fastest = std::max(fastest, length(body.velocity)), strongest = std::max(strongest, length(body.force));
  }
  const auto meet = [&](ContactPair pair, const Rod& p, const Rod& q) {
    const float overlap = overlap_of(p, q), thick = std::max(p.ra, q.ra);
    deepen(pair, overlap);
    passed[pair] += overlap > kThrough * (thick + std::min(p.ra, q.ra));
  };
  for (const Rod& p : rods[0])
    for (const Rod& q : rods[1]) meet(tool_needle, p, q);
  const float r = 0.5f * model.thread.material.diameter;
  for (uint32_t i = 0; i < state.thread.nodes(); ++i) {
    const Vec3 p = state.thread.position(i);
    deepen(thread_wall, wall_overlap(ws, now, p, r));
    if (i == 0) continue;
    const Rod segment{state.thread.position(i - 1), p, r, r};
    passed[thread_wall] += passes_wall(ws, now, segment.a, segment.b);
    for (uint32_t b = 0; b < 2; ++b)
      for (const Rod& q : rods[b]) meet(b == 0 ? tool_thread : needle_thread, segment, q);
    tightest = std::max(tightest, state.thread.tension[i - 1]);
  }
}

bool ContactBench::clear(const Pose& tool, float opening) {
  constexpr float kClear = 0.5e-3f;  // [m]
  physical::Body body;
  body.pose = tool, body.opening = opening;
  std::vector<Rod> rods = rods_of(model.bodies.body[0], body);
  for (Rod& rod : rods) {
    rod.ra += kClear, rod.rb += kClear;
    if (passes_wall(state.wall, now, rod.a, rod.b) || wall_overlap(state.wall, now, rod.a, rod.ra) > 0 ||
        wall_overlap(state.wall, now, rod.b, rod.rb) > 0)
      return false;
  }
  const float r = 0.5f * model.thread.material.diameter;
  for (uint32_t i = 1; i < state.thread.nodes(); ++i)
    for (const Rod& rod : rods)
      if (overlap_of(rod, {state.thread.position(i - 1), state.thread.position(i), r, r}) > 0) return false;
  for (const Rod& q : rods_of(model.bodies.body[1], state.bodies.body[1]))
    for (const Rod& rod : rods)
      if (overlap_of(rod, q) > 0) return false;
  return true;
}

void ContactBench::event(float max_force, float max_speed) {
  // Each group of five starts from rest with its own numbers, so that it can be repeated alone.
  if (events % 5 == 0) state = rest, random = Random(seed * 1000003 + static_cast<uint64_t>(events));
  ++events;
  pull.clear(), hold.clear(), target.assign(2, {});
  BodyModel& tool = model.bodies.body[0];
  tool.max_force = max_force * (0.25f + 0.75f * random.uniform());
  const float opening = random.uniform() < 0.5f ? 0.0f : 0.2f * random.uniform();
  see_wall();
  // The needle falls on the body, or is thrown at it.
  if (events % 5 == 1 || random.uniform() < 0.3f) {
    const Vec3 d = direction();
    const Vec3 at{middle.x + 0.5f * (high.x - low.x) * d.x, high.y + 0.014f, middle.z + 0.5f * (high.z - low.z) * d.z};
    physical::move_body(model, state, 1, {at, normalized(Quat{d.x, d.y, d.z, random.uniform()})}, 0);
    state.bodies.body[1].velocity = Vec3{0, -max_speed * random.uniform(), 0};
    state.bodies.body[1].spin = direction() * (20 * random.uniform());
  }
  // The tool starts clear of everything, before a random place of either face; a quarter of them within an opening.
  Vec3 mark, aim;
  Pose pose;
  for (int tries = 1;; ++tries) {
    if (tries % 400 == 0) {  // what an earlier event has left is in the way everywhere
      state = rest;
      see_wall();
    }
    const bool within = random.uniform() < 0.25f;
    const uint32_t face = free[static_cast<size_t>(random.uniform() * static_cast<float>(free.size())) % free.size()];
    wall::Point at{face, 0.9f * (2 * random.uniform() - 1), 0.9f * (2 * random.uniform() - 1), 0};
    if (model.wall.mesh.face[face][3] == wall::kNone) at.xi = 0.6f * random.uniform(), at.eta = 0.6f * random.uniform();
    const float side = within ? -1.0f : 1.0f;
    mark = place_at(model.wall, state.wall, at, side);
    const Vec3 out = normalized(mark - place_at(model.wall, state.wall, at, 0));
    // From within, the shaft has to lie in the opening: most directions are refused below.
    aim = normalized(direction() * (within ? 1.5f : 0.4f) - out);
    const Vec3 x = any_perpendicular(aim);
    pose = {mark - aim * 0.012f, from_axes(x, cross(-aim, x), -aim)};
    if (dot(aim, out) < -0.1f && clear(pose, opening)) break;
  }
  physical::move_body(model, state, 0, pose, opening);
  forget();
  look();
  if (deepest[needle_wall] > 0 || deepest[tool_needle] > 0 || deepest[needle_thread] > 0)
    physical::move_body(model, state, 1, {{middle.x, high.y + 0.3f, middle.z}, {}}, 0);
  forget();
  const float speed = max_speed * (0.02f + 0.98f * random.uniform() * random.uniform());
  const Vec3 drag = normalized(cross(aim, direction())) * (random.uniform() < 0.5f ? speed : 0.0f);
  const uint32_t last = static_cast<uint32_t>(state.thread.nodes()) - 1;
  // Hands draw the thread's ends where they have a free way: thread cannot be pushed into tissue.
  const auto free_way = [&](uint32_t node, Vec3 way) {
    const Vec3 at = state.thread.position(node);
    return !passes_wall(state.wall, now, at, at + way * 0.08f);
  };
  const Vec3 away = normalized(direction() * 0.8f + Vec3{1, -1, 0});
  if (random.uniform() < 0.4f && free_way(last, away)) {  // one end is held, the other drawn hard across the body
    thread::Hold end;
    end.node = 0, end.from = end.to = state.thread.position(0), end.stiffness = 2000, end.limit = max_force;
    hold.push_back(end);
    pull.push_back({last, away * (max_force * random.uniform())});
  } else {
    for (const uint32_t end : {0u, last}) {
      const Vec3 gentle = direction() * (0.5f * random.uniform()) + Vec3{0, -0.3f, 0};
      if (free_way(end, normalized(gentle, {0, -1, 0}))) pull.push_back({end, gentle});
    }
  }
  const float way = 0.012f, depth = way + 0.012f;
  float gone = 0;
  for (int i = 0; i < 80; ++i) {
    const float move = std::min(speed * 1e-3f, depth - gone);
    gone += move;
    pose.p += aim * move;
    if (gone > way) pose.p += drag * 1e-3f;
    target[0] = {pose, true, opening, 0};
    step();
    if (i % 2 == 1) look();
  }
}

int pull_hooked_bights(uint64_t seed, float max_force, float max_speed, float& nearest) {
  Random random(seed);
  thread::Settings settings = knot_settings(0.1f + 0.3f * random.uniform());
  settings.breaks = false;
  const float d = settings.material.diameter, l = 1.43f * d;
  // Each bight: a half circle with two legs. One in the plane xy, opening toward -x, the other in xz, opening toward +x.
  const auto bight = [&](Vec3 side, float way, float radius) {
    std::vector<Vec3> fine;
    const float leg = 0.015f;
    for (int i = 0; i < 500; ++i) fine.push_back(side * -radius + Vec3{way * leg * (1 - static_cast<float>(i) / 500), 0, 0});
    for (int i = 0; i < 500; ++i) {
      const float a = kPi * (static_cast<float>(i) / 500 - 0.5f);
      fine.push_back(side * (radius * std::sin(a)) + Vec3{-way * radius * std::cos(a), 0, 0});
    }
    for (int i = 0; i < 500; ++i) fine.push_back(side * radius + Vec3{way * leg * static_cast<float>(i) / 500, 0, 0});
    return resample(fine, l);
  };
  const float ra = d * (1.5f + 6 * random.uniform()), rb = d * (1.5f + 6 * random.uniform());
  std::vector<Vec3> path = bight({0, 1, 0}, -1, ra);
  const uint32_t first = static_cast<uint32_t>(path.size());
  // Their insides overlap: each goes through the other.
  for (const Vec3 p : bight({0, 0, 1}, 1, rb)) path.push_back(p + Vec3{ra + rb - 2.2f * d - std::max(ra, rb) + d, 0, 0});
  thread::State state = thread::make_state(path);
  state.broken[first - 1] = 1, state.rest[first - 1] = l;
  thread::Stepper stepper(path.size());
  settings.substeps = 1;
  const uint32_t ends[4] = {0, first - 1, first, static_cast<uint32_t>(path.size()) - 1};
  std::vector<thread::Hold> hold(4);
  for (size_t k = 0; k < 4; ++k) {
    hold[k].node = ends[k], hold[k].from = hold[k].to = path[ends[k]];
    hold[k].stiffness = 3000, hold[k].limit = max_force * (0.2f + 0.8f * random.uniform());
  }
  const auto any = [&] {
    return normalized(Vec3{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1}, {0, 1, 0});
  };
  Vec3 way[4];
  for (size_t k = 0; k < 4; ++k)
    way[k] = normalized(Vec3{k < 2 ? -1.0f : 1.0f, 0, 0} + any() * 0.8f) * (max_speed * (0.05f + 0.95f * random.uniform()));
  std::vector<Place> before = places(state);
  int passed = 0;
  constexpr int kSubsteps = 2400;
  for (int i = 0; i < kSubsteps; ++i) {
    for (size_t k = 0; k < 4; ++k) {
      hold[k].from = hold[k].to;
      hold[k].to += way[k] * settings.substep;
    }
    thread::Surroundings around;
    around.holds = hold;
    stepper.step(settings, state, around);
    std::vector<Place> after = places(state);
    passed += count_passes(before, after, state.broken);
    before = std::move(after);
    if (i % 20 != 0) continue;
    for (uint32_t a = 0; a + 1 < first; ++a)
      for (uint32_t b = first; b + 1 < path.size(); ++b) {
        float s = 0, t = 0;
        const Vec3 p = state.position(a), q = state.position(a + 1), u = state.position(b), v = state.position(b + 1);
        nearest_fractions(p, q, u, v, s, t);
        nearest = std::min(nearest, distance(lerp(p, q, s), lerp(u, v, t)) / d);
      }
  }
  return passed;
}

}  // namespace catgut::validation
