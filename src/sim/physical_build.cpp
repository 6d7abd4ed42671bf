// SPDX-License-Identifier: Apache-2.0
// sim/physical_build: the physical model of a scene, its first state, and the check of a loaded one. See the header.
#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "anatomy/body.h"
#include "core/check.h"
#include "sim/model.h"
#include "sim/physical.h"
#include "sim/state.h"

namespace catgut {
namespace {

constexpr float kStep = 1e-3f;  // [s] longest step of the wall: docs/wall.md was measured at it
constexpr int kThreadSubsteps = 20;
// Of gravity on thread. The simulated line mass is some 500 times the real one (docs/thread.md): this gives five times the real
// weight. With more, a tail laid on the bowel slides off it.
constexpr float kThreadGravity = 0.01f;
constexpr float kThreadDrag = 30;  // [1/s] on thread. At 0.1 m/s it is 0.15 N per meter
// [N] with which tissue holds slack thread in a hole (an estimate). Without it the thread creeps into the lumen by its weight:
// Coulomb friction needs tension.
constexpr float kHoleGrip = 0.03f;
// [N] of physical::SleepModel::slack: finished stitches of `altemeier` bear less than 0.1 (docs/physical.md, "Cost").
constexpr float kSlack = 0.15f;
constexpr float kLyingForce = 0.05f;  // [N] with which the drape holds a needle that lies on it

std::string name_of(const SceneSpec& scene) { return scene.name.empty() ? "scene" : scene.name; }

const thread::Properties& material_of(const SceneSpec& scene, const std::string& name) {
  const thread::Properties* found = thread::find_material(name);
  if (!found) {
    std::string known;
    for (const thread::Properties& p : thread::materials()) known += (known.empty() ? "" : ", ") + std::string(p.name);
    throw InputError(name_of(scene), "thread.material \"" + name + "\" is not known", "use one of " + known);
  }
  return *found;
}

wall::Spec wall_of(const SceneSpec& scene, const wall::Mesh& mesh, float step) {
  const BodySpec& first = scene.body.front();
  for (const BodySpec& b : scene.body)
    if (b.wall != first.wall || b.modulus_along != first.modulus_along || b.modulus_around != first.modulus_around ||
        b.poisson != first.poisson || b.density != first.density || b.stiff_along != first.stiff_along ||
        b.stiff_around != first.stiff_around || b.knee != first.knee)
      throw InputError(
          name_of(scene), "its bodies differ in wall or material",
          "physical mechanics have one material: give all bodies the same wall, moduli, knee, poisson and density");
  wall::Spec spec;
  spec.mesh = mesh;
  wall::Layer& layer = spec.layer.front();
  layer.thickness = first.wall;
  layer.e_along = first.modulus_along, layer.e_around = first.modulus_around, layer.poisson = first.poisson;
  layer.stiff_along = first.stiff_along, layer.stiff_around = first.stiff_around;
  layer.knee_along = layer.knee_around = first.knee;
  spec.density = first.density;
  spec.step = step;
  spec.drag = scene.solver.damping;
  spec.gravity = scene.solver.gravity;
  return spec;
}

thread::Settings thread_of(const SceneSpec& scene, float step) {
  const std::vector<SutureSpec> sutures = sutures_of(scene);
  for (const SutureSpec& u : sutures)
    if (u.thread.material != sutures.front().thread.material)
      throw InputError(name_of(scene), "its sutures have different thread.material",
                       "physical mechanics have one thread material: use the same for all");
  thread::Settings s;
  s.material = material_of(scene, sutures.front().thread.material);
  s.substeps = kThreadSubsteps;
  s.substep = step / kThreadSubsteps;
  s.gravity = scene.solver.gravity * kThreadGravity;
  s.damping = kThreadDrag, s.hole_grip = kHoleGrip;
  return s;
}

// An instrument of the table: its first capsule are the jaws, the last one the shaft.
physical::BodyModel body_of(const Model& model, const InstrumentModel& kind) {
  const Capsule &jaws = kind.body.capsule.front(), &shaft = kind.body.capsule.back();
  physical::BodyModel m;
  if (kind.can(kHoldNeedle) || kind.can(kHoldThread) || kind.can(kHoldTissue)) {
    physical::ToolShape shape;
    shape.jaw_reach = jaws.b.z, shape.tip_radius = 0.65f * jaws.radius, shape.hinge_radius = jaws.radius;
    shape.shaft_radius = shaft.radius, shape.length = shaft.b.z;
    shape.mass = 1 / kind.body.inv_mass;
    m = physical::make_tool(shape);
  } else {
    // Blades of scissors pass into the tissue that they divide: only the shaft has contact.
    const bool blades = kind.can(kCutTissue) && !kind.can(kCauterize);
    for (const Capsule& c : std::span(kind.body.capsule).subspan(blades ? 1 : 0))
      physical::add_capsule(m, c.a, c.b, c.radius, c.radius, 0, 2 * c.radius);
    m.mass = 1 / kind.body.inv_mass;
    m.inertia = m.mass * 0.02f * 0.02f;
    m.center = {0, 0, 0.06f};
  }
  m.stiffness = 1 / model.hand_compliance;
  m.damping = 2 * std::sqrt(m.stiffness * m.mass);
  m.wall_friction = model.solver.friction.tool, m.thread_friction = model.solver.friction.thread;
  return m;
}

void add_bodies(const Model& model, PhysicalModel& made) {
  physical::BodiesModel& bodies = made.world.bodies;
  if (model.solver.body.size() > physical::kMaxBodies)
    throw InputError(name_of(model.scene), fmt::format("it has more than {} instruments and needles", physical::kMaxBodies),
                     "physical mechanics have no room for more: remove some");
  bodies.gravity = model.scene.solver.gravity;
  bodies.pair_contact = false;  // not tried in scenes yet: the scripted plan does not keep instruments apart
  for (const InstrumentModel& kind : model.suture.instrument) bodies.body.push_back(body_of(model, kind));
  const std::vector<SutureSpec> sutures = sutures_of(model.scene);
  for (uint32_t k = 0; k < sutures.size(); ++k) {
    physical::NeedleShape shape;
    shape.radius = sutures[k].needle.radius, shape.arc = sutures[k].needle.arc;
    shape.wire_radius = sutures[k].needle.wire_radius;
    bodies.body.push_back(physical::make_needle_body(shape));
    // On the drape it is held by friction alone.
    bodies.body.back().max_force = kLyingForce, bodies.body.back().max_torque = kLyingForce * shape.radius;
    made.world.needles.needle.push_back(physical::make_needle(shape, model.solver.needle_body(k)));
    physical::Needle needle;
    const StrandModel& strand = model.solver.strand[k];
    needle.thread_node = strand.first_slot - model.solver.tissue + strand.count - 1;
    made.start.needle.push_back(needle);
  }
  size_t capsules = 0;
  for (const physical::BodyModel& body : bodies.body) capsules += body.thread_capsule.size();
  if (capsules > physical::kMaxThreadCapsules)
    throw InputError(name_of(model.scene), "its instruments and needles have too many parts that thread can touch",
                     "physical mechanics have no room for more: remove an instrument or a suture");
  made.start.bodies.body.resize(bodies.body.size());
  made.world.needles.thread_friction = model.scene.solver.friction_thread;
}

}  // namespace

int physical_steps(float dt) { return std::max(1, static_cast<int>(std::ceil(dt / kStep - 1e-3f))); }

float thread_radius(const SceneSpec& scene, const std::string& material) {
  return 0.5f * material_of(scene, material).diameter;
}

void add_wall(const SceneSpec& scene, const BodySpec& spec, const BodyRest& body, wall::Mesh& mesh) {
  if (body.position.size() % 2 != 0)
    throw InputError(name_of(scene), "body.particles is odd, and a wall consists of pairs of particles",
                     "give an even number for physical mechanics");
  std::vector<Vec3> outer, inner;
  for (size_t i = 0; i < body.position.size(); i += 2) outer.push_back(body.position[i]), inner.push_back(body.position[i + 1]);
  std::vector<std::array<uint32_t, 3>> face;
  for (const Triangle& t : body.surface)
    if (t[0] % 2 == 0 && t[1] % 2 == 0 && t[2] % 2 == 0) face.push_back({t[0] / 2, t[1] / 2, t[2] / 2});
  wall::Mesh part = wall::from_triangles(outer, inner, face, spec.axis, spec.name);
  for (size_t c = 0; c < outer.size(); ++c) part.held[c] = body.pinned[2 * c];
  part.foundation.assign(outer.size(), spec.foundation);
  if (mesh.outer.empty()) mesh = std::move(part);
  else wall::append(mesh, part);
}

std::shared_ptr<const PhysicalModel> make_physical(const Model& model, const wall::Mesh& mesh) {
  const SceneSpec& scene = model.scene;
  const float step = model.solver.h;
  auto made = std::make_shared<PhysicalModel>();
  const wall::Wall wall = wall::build_wall(wall_of(scene, mesh, step));
  made->world = physical::make_model(wall, thread_of(scene, step));
  made->world.surface_friction = scene.solver.friction_thread;
  made->world.lip_friction = scene.solver.friction_tissue;
  made->world.sleep.slack = kSlack;
  made->drape.offset = model.solver.ground;
  made->drape.friction = scene.solver.friction_thread;
  made->start.wall = wall.state;
  // Threads one after the other, as their particles are; nothing joins the end of one and the beginning of the next.
  const auto first = model.start.begin() + static_cast<std::ptrdiff_t>(model.solver.tissue);
  const std::vector<Vec3> path(first, model.start.end());
  made->start.thread = thread::make_state(path);
  for (const StrandModel& strand : model.solver.strand)
    if (strand.first_slot > model.solver.tissue) {
      const size_t between = strand.first_slot - model.solver.tissue - 1;
      made->start.thread.broken[between] = 1;
      made->start.thread.rest[between] = strand.spacing;  // the ends would weigh what lies between them
    }
  add_bodies(model, *made);
  return made;
}

PhysicalState start_physical(const Model& model, const SolverState& solver) {
  PhysicalState s;
  s.world = model.physical->start;
  for (size_t i = 0; i < s.world.bodies.body.size(); ++i)
    physical::place_body(model.physical->world.bodies.body[i], s.world.bodies.body[i], solver.body[i].pose(), kWideOpen);
  // A parked clamp is about to close on its tissue.
  for (const ParkedStart& p : model.parked) {
    const physical::BodyModel& m = model.physical->world.bodies.body[p.instrument];
    const float thickness = model.physical->world.wall.laminate.thickness;
    if (m.hinge_z > 0) s.world.bodies.body[p.instrument].opening = 0.5f * thickness / m.hinge_z;
  }
  s.suture.resize(model.solver.strand.size());
  s.cutting = start_cutting(model);
  for (size_t k = 0; k < s.suture.size(); ++k) s.suture[k].bed = solver.body[model.solver.needle_body(k)].pose();
  return s;
}

void restore_physical(const Model& model, PhysicalState& state) {
  const wall::Topology& t = state.world.wall.topology;
  const size_t faces = model.physical->world.wall.lane_of_face.size();
  if (t.cut.size() == faces && t.factored.size() == faces) physical::restore_cuts(model.physical->world, state.world);
}

bool physical_fits(const Model& model, const PhysicalState& state) {
  const PhysicalModel& m = *model.physical;
  const physical::State &s = state.world, &start = m.start;
  const thread::State& t = s.thread;
  const size_t nodes = start.thread.nodes(), segments = nodes - 1, columns = wall::columns(s.wall);
  const size_t faces = m.world.wall.lane_of_face.size(), capsules = physical::kMaxThreadCapsules;
  if (s.wall.motion.x.size() != 2 * columns || s.wall.motion.v.size() != 2 * columns ||
      s.wall.motion.turn.size() != s.wall.topology.corners.size() ||
      (s.wall.topology.cut.empty() ? !s.wall.topology.factored.empty()
                                   : s.wall.topology.cut.size() != faces || s.wall.topology.factored.size() != faces))
    return false;
  for (const thread::Columns3* c : {&t.x, &t.fine, &t.v, &t.plane_friction, &t.plane_drift, &t.listed})
    if (c->x.size() != nodes || c->y.size() != nodes || c->z.size() != nodes) return false;
  if (t.warm.size() != nodes || t.kept.size() != nodes || t.plane_normal.size() != nodes || t.rest.size() != segments ||
      t.tension.size() != segments || t.broken.size() != segments || t.budget.size() != t.key.size() ||
      t.crossing.size() != t.key.size())
    return false;
  for (const float rest : t.rest)
    if (!(rest > 1e-6f && rest < 1)) return false;
  for (size_t i = 0; i < t.key.size(); ++i) {
    const uint32_t partner = thread::partner_of(t.key[i]);
    if (thread::segment_of(t.key[i]) >= segments || (i > 0 && t.key[i] <= t.key[i - 1])) return false;
    if (partner < thread::kTool ? partner >= segments : partner - thread::kTool >= capsules) return false;
  }
  const auto good_point = [&](const wall::Point& p) {
    return p.face < faces && std::abs(p.xi) <= 2 && std::abs(p.eta) <= 2 && std::abs(p.zeta) <= 1;
  };
  if (t.eyelet.size() > thread::kMaxEyelets || s.hole.size() > thread::kMaxSoftPoints / 2) return false;
  for (size_t i = 0; i < t.eyelet.size(); ++i)
    if (t.eyelet[i].point >= s.hole.size() || t.eyelet[i].segment >= segments ||
        (i > 0 && t.eyelet[i].segment <= t.eyelet[i - 1].segment))
      return false;
  for (const physical::Hole& hole : s.hole)
    if (!good_point(hole.place) || !good_point(hole.made)) return false;
  const physical::Sleep& z = s.sleep;
  if ((!z.from.empty() && z.from.size() != nodes) || (!z.tension.empty() && z.tension.size() != segments) ||
      z.from.empty() != z.tension.empty() || z.strand.size() > nodes)
    return false;
  for (size_t k = 0; k < z.strand.size(); ++k)
    if (z.strand[k].first != (k > 0 ? z.strand[k - 1].last + 1 : 0) || z.strand[k].last < z.strand[k].first ||
        z.strand[k].last >= nodes)
      return false;
  const auto sleeps = [&](uint32_t strand) { return strand < z.strand.size() && z.strand[strand].asleep; };
  for (const physical::Sleep::Load& load : z.load)  // also of a strand that is about to sleep
    if (load.strand >= z.strand.size() || load.at >= 2 * columns) return false;
  for (const physical::Sleep::Watched& w : z.watched)
    if (w.strand >= z.strand.size() || w.column >= columns) return false;
  for (const physical::Sleep::Held& h : z.held)
    if (!sleeps(h.strand) || h.node >= nodes) return false;
  for (const physical::Sleep::Touched& c : z.touched)
    if (!sleeps(c.strand) || c.tool >= capsules) return false;
  if (s.contact.size() > 4 * nodes || s.lip.size() > 16 * columns) return false;
  for (size_t i = 0; i < s.contact.size(); ++i)  // up to three of a node
    if (s.contact[i].node >= nodes || (i > 0 && s.contact[i].node < s.contact[i - 1].node)) return false;
  for (size_t i = 1; i < s.lip.size(); ++i)
    if (s.lip[i].key < s.lip[i - 1].key) return false;
  if (s.bodies.body.size() != start.bodies.body.size() || s.needle.size() != start.needle.size() ||
      s.bodies.memory.size() > physical::kMaxRows)
    return false;
  for (const physical::Body& b : s.bodies.body) {
    const physical::Grip& g = b.grip;
    if (g.count > g.point.size() || g.what > physical::Gripped::tissue) return false;
    if (g.what == physical::Gripped::needle && g.body >= s.bodies.body.size()) return false;
    if (g.what == physical::Gripped::thread && (g.node >= nodes || g.count > 2 || (g.count == 2 && g.body >= nodes)))
      return false;
    for (const physical::GripPoint& p : g.point)
      if (!good_point(p.tissue)) return false;
  }
  for (const physical::Needle& n : s.needle) {
    if ((n.thread_node != wall::kNone && n.thread_node >= nodes) || n.channels > physical::kMaxChannels || !good_point(n.tip) ||
        (n.inside && n.channels == 0))
      return false;
    for (uint32_t i = 0; i < physical::kMaxChannels; ++i) {
      const physical::Channel& c = n.channel[i];
      if (c.count > physical::kMaxPath || (i < n.channels && c.count == 0) ||
          !std::all_of(c.point.begin(), c.point.end(), good_point))
        return false;
      for (const uint32_t hole : {c.entry_hole, c.exit_hole})
        if (i < n.channels && hole != wall::kNone && hole >= s.hole.size()) return false;
    }
  }
  if (!cutting_fits(model, state.cutting)) return false;
  for (const PhysicalSuture& u : state.suture)
    for (const uint32_t hole : u.hole)
      if (hole >= s.hole.size()) return false;
  return true;
}

}  // namespace catgut
