// SPDX-License-Identifier: Apache-2.0
// sim/build: turns a scene's description into a Model and its first State. Reads SceneSpec; calls anatomy. Throws InputError
// for errors in the scene. Nothing here runs during a tick.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "anatomy/bowel.h"
#include "anatomy/organ.h"
#include "anatomy/pad.h"
#include "anatomy/perineum.h"
#include "core/check.h"
#include "geometry/closest.h"
#include "sim/cell_graph.h"
#include "sim/hands.h"
#include "sim/model.h"
#include "sim/state.h"
#include "sim/topology.h"
#include "suture/needle.h"

namespace catgut {
namespace {

constexpr float kPaperSubstep = 1.0f / 480;    // [s] substep for which the paper's deformation resistance is defined
constexpr float kDrapeBelowRim = 0.035f;       // [m] below the rim, where a body stands up through the drape
constexpr float kDrapeBelowBody = 0.010f;      // [m] below the body, where it lies on the drape, or on a bed
constexpr float kDrapeBelowPad = 0.001f;       // [m] below a pad of skin: thread in its slit stays within reach
constexpr float kRow = 0.07f, kTurn = 0.005f;  // [m] of a thread on the drape: length of a row, radius of its turns

std::string name_of(const SceneSpec& scene) { return scene.name.empty() ? "scene" : scene.name; }

BodyRest make_body(const BodySpec& spec) {
  if (!spec.mesh.empty()) {
    OrganImport o;
    o.name = spec.name;
    o.mesh = spec.mesh;
    o.particles = spec.particles;
    o.wall = spec.wall;
    o.position = spec.position;
    o.axis = spec.axis;
    o.density = spec.density;
    o.pinned_length = spec.pinned_length;
    return import_organ(o);
  }
  if (spec.kind == "pad") {
    PadShape p;
    p.name = spec.name;
    p.particles = spec.particles;
    p.length = spec.length;
    p.width = 2 * spec.radius;
    p.thickness = spec.wall;
    p.position = spec.position;
    p.axis = spec.axis;
    p.density = spec.density;
    p.pinned_length = spec.pinned_length;
    return make_pad(p);
  }
  BowelShape s;
  s.name = spec.name;
  s.particles = spec.particles;
  s.radius = spec.radius;
  s.length = spec.length;
  s.wall = spec.wall;
  s.closed_start = spec.closed_start;
  s.closed_end = spec.closed_end;
  s.haustra = spec.haustra;
  s.taeniae = spec.taeniae;
  s.position = spec.position;
  s.axis = spec.axis;
  s.density = spec.density;
  s.pinned_length = spec.pinned_length;
  s.inner_radius = spec.inner_radius;
  s.folded = spec.folded;
  return make_bowel(s);
}

bool is_physical(const SceneSpec& scene) { return scene.mechanics.kind == "physical"; }

// A bowel end whose axis is closer to horizontal than to vertical.
bool lies(const BodySpec& body) { return std::abs(body.axis.y) < 0.7f * length(body.axis); }

// The thread lies on the drape in parallel rows. It begins at `start` and leads away along +x.
std::vector<Vec3> lay_thread(const ThreadSpec& spec, Vec3 start) {
  const float turn = kPi * kTurn;
  std::vector<Vec3> p;
  for (int i = 0; i < spec.particles; ++i) {
    const float along = static_cast<float>(i) * spec.spacing;
    const float period = kRow + turn;
    const int row = static_cast<int>(along / period);
    const float in_row = along - static_cast<float>(row) * period, way = row % 2 == 0 ? 1.0f : -1.0f;
    const float x0 = 2 * kTurn * static_cast<float>(row), z0 = row % 2 == 0 ? 0.0f : kRow;
    Vec3 q;
    if (in_row < kRow) {
      q = {x0, 0, z0 + way * in_row};
    } else {
      const float a = (in_row - kRow) / kTurn;
      q = {x0 + kTurn * (1 - portable::cos(a)), 0, z0 + way * (kRow + kTurn * portable::sin(a))};
    }
    p.push_back(start + q);
  }
  return p;
}

}  // namespace

TechniqueModel make_technique(const SceneSpec& scene, std::span<const Rim> rim) {
  const std::string where = name_of(scene);
  TechniqueModel t;
  const TechniqueSpec& spec = scene.technique;
  t.row = find_technique(spec.name);
  if (!t.row && spec.name != kNoTechnique)
    throw InputError(where, "technique.name \"" + spec.name + "\" is not known", "use " + technique_choices());
  if (!t.row) return t;
  for (size_t w = 0; w < t.row->walls; ++w)
    if (w >= rim.size() || rim[w].outer.empty()) throw InputError(where, t.row->missing, t.row->remedy);
  TechniqueSetup setup;
  setup.rim = rim;
  setup.wall = scene.body[0].wall;
  setup.anvil = spec.anvil;
  setup.anvil_radius = spec.anvil_radius;
  setup.compliance = spec.closure_compliance;
  setup.gap = spec.closed_gap;
  setup.step = spec.step;
  setup.min_bites = spec.min_bites;
  setup.throws = spec.throws;
  t.row->begin(setup, t);
  return t;
}

namespace {

// Reserves memory for what a procedure adds to the state, so that event ticks do not allocate either: four times a long
// procedure. Only baking a suture allocates, for its node list.
void reserve_room(const Model& model, State& s) {
  constexpr size_t kMany = 256;
  s.event.list.reserve(kMany);
  s.stitch.reserve(kMany);
  s.stitch_span.reserve(kMany);
  for (size_t k = 0; k < s.solver.strand.size(); ++k) {
    s.solver.strand[k].anchor.reserve(model.solver.strand[k].count);
    s.solver.strand[k].hold.reserve(model.solver.strand[k].count);
  }
  s.suture_event.list.reserve(kMany);
  s.solver.weld.reserve(kMany);
  s.solver.attach.reserve(kMany);
  s.solver.pin.reserve(kMany);
  s.solver.channel.reserve(kMany);
  s.suture.settled.reserve(kMany);
  for (Suture& u : s.suture.suture) {
    u.bite.reserve(kMany);
    u.point.reserve(kMany);
    u.open.reserve(kMany);
    u.knot.reserve(kMany);
  }
  for (TechniqueState& t : s.technique) {
    t.purse_string.where.reserve(kMany);
    t.seam.row.reserve(kMany);
    t.seam.pass.reserve(kMany);
    t.lembert.stitch.reserve(kMany);
    t.lembert.row.reserve(kMany);
  }
  for (ClosurePlan& p : s.plan) {
    p.pull.reserve(kMany);
    p.pair.reserve(kMany);
  }
}

StrandModel make_strand(const SceneSpec& scene, const ThreadSpec& spec, uint32_t first_slot, Vec3 gravity) {
  StrandModel t;
  t.first_slot = first_slot;
  t.count = static_cast<uint32_t>(spec.particles);
  t.spacing = spec.spacing;
  t.radius = is_physical(scene) ? thread_radius(scene, spec.material) : spec.radius;
  t.inv_mass = 1.0f / spec.mass;
  t.stretch_compliance = spec.stretch_compliance;
  t.bend_compliance = scene.solver.bend_compliance;
  t.bend_sweeps = scene.solver.bend_sweeps;
  t.distance_sweeps = scene.solver.distance_sweeps;
  t.direct = scene.solver.thread_direct;
  t.collision_off = scene.mechanics.collision_off;
  t.gravity = gravity;
  return t;
}

constexpr size_t kInRow = 4;       // sutures on the drape
constexpr float kNextRow = 0.12f;  // [m] a thread leads kRow away from its needle

// [m] along x that a suture takes on the drape, with room for a hand's jaws beside the needle.
float room_for(const SutureSpec& suture) {
  const float length = static_cast<float>(suture.thread.particles) * suture.thread.spacing;
  return 2 * kTurn * std::ceil(length / (kRow + kPi * kTurn)) + 3 * suture.needle.radius;
}

// Needles and threads lie on the drape side by side, to the right of the organ. Each needle's circle lies flat and its thread
// leads away from its swage; four in a row, each row in front of the last. Two bowel ends lie along x, with all needles in
// front of them, from right to left.
void lay_out_sutures(Model& m, const std::vector<SutureSpec>& sutures, Vec3 rim, bool two, float tube) {
  const Pose flat{{}, axis_angle({1, 0, 0}, -0.5f * kPi)};  // body z up: the circle lies in the plane of the drape
  Vec3 beside = two ? Vec3{0.02f, 0, tube + 0.03f} : Vec3{tube + 0.03f, 0, 0.01f};
  for (size_t k = 0; k < sutures.size(); ++k) {
    const NeedleSpec& needle = sutures[k].needle;
    if (k > 0) beside.x += two ? -room_for(sutures[k]) : room_for(sutures[k - 1]);
    if (!two && k > 0 && k % kInRow == 0) beside.x = tube + 0.03f, beside.z += kNextRow;
    const float wire = m.solver.ground + needle.wire_radius + 0.0002f;
    const Pose start{Vec3{rim.x + beside.x, wire, rim.z + beside.z}, flat.q};
    m.needle_start.push_back(start);
    const std::vector<Vec3> thread = lay_thread(sutures[k].thread, transform(start, m.solver.needle_arc[k].point(0)));
    for (size_t i = thread.size(); i-- > 0;) m.start.push_back(thread[i]);  // free end first
  }
}

// Default instruments of a scene that lists none, as in the paper.
std::vector<InstrumentSpec> instruments_of(const SceneSpec& scene) {
  if (!scene.instrument.empty()) return scene.instrument;
  InstrumentSpec driver, forceps;
  driver.kind = "needle_holder", driver.where = "right";
  forceps.kind = "forceps", forceps.where = "left";
  return {driver, forceps};
}

std::string known_instruments(std::span<const InstrumentModel> own) {
  std::string names = "known: ";
  for (const InstrumentModel& m : own) names += m.name + ", ";
  for (const InstrumentModel& m : instrument_table()) names += m.name + (&m == &instrument_table().back() ? "" : ", ");
  return names;
}

// The point of the tissue surface nearest to `at`, embedded in its neighborhood.
ParkedStart park_on(const Model& model, size_t instrument, Vec3 at, Vec3 pull, const std::string& where) {
  const TissueCollision& tissue = model.solver.collision;
  const auto corner = [&](const Triangle& t, size_t k) { return model.start[t[k]]; };
  BiteEnd end;
  ParkedStart p;
  Vec3 point, normal;
  float best = 1e30f;
  for (uint32_t f = 0; f < tissue.surface.size(); ++f) {
    const Triangle& t = tissue.surface[f];
    const ClosestOnTriangle near = closest_on_triangle(at, corner(t, 0), corner(t, 1), corner(t, 2));
    const float d = distance(near.point, at);
    if (d >= best) continue;
    best = d, point = near.point, end.triangle = f;
    normal = normalized(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
    for (size_t k = 0; k < 3; ++k) end.weight[k] = near.weight[k];
  }
  constexpr float kFar = 0.02f;  // [m] from the tissue: beyond this the coordinate is an error
  if (best > kFar)
    throw InputError(where, "instrument.at of a parked instrument is more than 20 mm from any tissue",
                     "give a place on a body");
  spread(model.solver, end);
  p.instrument = instrument;
  p.point = end.point;
  const Triangle& t = tissue.surface[end.triangle];
  p.particle = t[static_cast<size_t>(std::max_element(end.weight.begin(), end.weight.end()) - end.weight.begin())];
  // The shaft leaves the tissue along the pull if there is one, otherwise along the surface normal.
  const Vec3 z = normalized(pull, normalized(normal, {0, 1, 0})), x = any_perpendicular(z);
  p.pose = {point, from_axes(x, cross(z, x), z)};
  return p;
}

// `rim`: center of the field; positions are relative to it.
void add_instruments(Model& m, const SceneSpec& scene, Vec3 rim, const std::string& where) {
  static const char* const kHandName[kMaxHands] = {"right", "left", "assistant_right", "assistant_left"};
  const std::vector<InstrumentSpec> specs = instruments_of(scene);
  m.hand_instrument.fill(-1);
  for (size_t k = 0; k < kMaxHands; ++k)
    m.hand_start[k] = {rim + Vec3{k % 2 == 0 ? 0.12f : -0.12f, 0.10f, k < 2 ? 0.05f : -0.08f}, {}};
  for (size_t i = 0; i < specs.size(); ++i) {
    const InstrumentSpec& spec = specs[i];
    const InstrumentModel& kind = m.suture.instrument[i];
    m.cord.push_back({spec.pull, spec.stretch});
    // The tray: a row on the drape to the right, shafts toward the surgeon.
    m.tray.push_back({Vec3{rim.x + 0.16f + 0.03f * static_cast<float>(i), m.solver.ground + 0.006f, rim.z}, {}});
    InstrumentPicture picture;
    picture.name = spec.name.empty() ? spec.kind : spec.name;
    picture.kind = kind.name;
    picture.title = kind.title;
    picture.capabilities = kind.capabilities;
    for (const Capsule& c : kind.body.capsule) picture.outline.push_back({c.a, c.b, c.radius});
    for (const InstrumentPicture& other : m.picture.instrument)
      if (other.name == picture.name && !spec.name.empty())
        throw InputError(where, "two instruments have the name \"" + picture.name + "\"", "give each a name of its own");
    m.picture.instrument.push_back(picture);
    const auto hand = std::find(std::begin(kHandName), std::end(kHandName), spec.where);
    if (hand != std::end(kHandName)) {
      int& holds = m.hand_instrument[static_cast<size_t>(hand - std::begin(kHandName))];
      if (holds >= 0) throw InputError(where, "two instruments are in hand \"" + spec.where + "\"", "put one on the tray");
      holds = static_cast<int>(i);
    } else if (spec.where == "parked") {
      if (!kind.can(kClamp) || !kind.can(kHoldTissue))
        throw InputError(where, "instrument \"" + picture.name + "\" is parked, but cannot clamp tissue",
                         "use allis, or put it on the tray");
      m.parked.push_back(park_on(m, i, spec.at, spec.pull, where));
    } else if (spec.where != "tray") {
      throw InputError(where, "instrument.where \"" + spec.where + "\" is not known",
                       "use right, left, assistant_right, assistant_left, tray or parked");
    }
  }
}

}  // namespace

std::vector<SutureSpec> sutures_of(const SceneSpec& scene) {
  return scene.suture.empty() ? std::vector{SutureSpec{scene.thread, scene.needle}} : scene.suture;
}

bool apply_preset(SolverSpec& s, const std::string& preset) {
  const SolverSpec standard;
  if (preset == "default") {
    s = standard;
    return true;
  }
  if (preset != "paper") return false;
  s = standard;
  s.preset = "paper";
  s.substeps = 8;
  s.shape_sweeps = 2;
  s.shape_stiffness = 0.65f;
  s.shape_relaxation = 1;
  s.distance_sweeps = 3;
  s.bend_sweeps = 3;
  // The paper gives 0.02 without a unit, presumably for unit mass. What matters is the ratio of compliance to inverse mass:
  // for this thread's 2 mg particles, 0.02 corresponds to 0.02 / 2e-6 = 1e4 per joule.
  s.bend_compliance = 1e4f;
  // A shape match at given stiffness pulls with a force that goes with mass over the square of the substep. Half as many
  // substeps take four times the mass for the same newtons per meter as the default preset (tests/sim, Presets).
  s.mass_scale *= 4;
  s.self_contact_sweeps = 10;
  s.contact_sweeps = 5;
  return true;
}

namespace {

// All bodies one after the other, as the solver's columns hold them.
struct Tissue {
  std::vector<Vec3> rest;
  std::vector<float> mass, radius, apart;
  std::vector<uint32_t> body;
  std::vector<std::vector<uint32_t>> cluster;
  std::vector<Triangle> surface;
  float drape = std::numeric_limits<float>::max();  // [m] height
  wall::Mesh wall;                                  // physical mechanics: the same particles as columns
};

void add_body(Model& m, const BodySpec& spec, Tissue& all) {
  BodyRest r = make_body(spec);
  if (is_physical(m.scene)) add_wall(m.scene, spec, r, all.wall);
  const uint32_t first = static_cast<uint32_t>(all.rest.size());
  float bottom = spec.position.y - kDrapeBelowRim;
  if (spec.kind == "pad") {
    bottom = spec.position.y - spec.wall - (spec.foundation > 0 ? kDrapeBelowBody : kDrapeBelowPad);
  } else if (lies(spec)) {
    for (const Vec3& p : r.position) bottom = std::min(bottom, p.y - kDrapeBelowBody);
  }
  // Of bodies that stand up through the drape the first one decides: another may stand inside it, and end lower.
  if (lies(spec) || all.rest.empty()) all.drape = std::min(all.drape, bottom);
  double spacing = 0;
  size_t edges = 0;
  for (const Triangle& t : r.surface)
    for (size_t k = 0; k < 3; ++k) spacing += distance(r.position[t[k]], r.position[t[(k + 1) % 3]]), ++edges;
  spacing /= static_cast<double>(edges);
  for (size_t i = 0; i < r.position.size(); ++i) {
    all.rest.push_back(r.position[i]);
    all.mass.push_back(r.mass[i]);
    m.solver.inv_mass.push_back(r.pinned[i] ? 0.0f : 1.0f / (r.mass[i] * m.scene.solver.mass_scale));
    all.radius.push_back(r.radius);
    // Shape matching keeps neighbors in the wall apart, contact does not, at any particle size.
    all.apart.push_back(static_cast<float>(std::max(2.2 * spacing, 2 * r.radius + spacing)));
    const size_t wall_here = m.rim.size() + (r.wall.empty() ? 0 : r.wall[i]);
    all.body.push_back(static_cast<uint32_t>(wall_here));  // two layers of one body collide like two bodies
    m.wall.push_back(static_cast<uint8_t>(wall_here));
    m.layer.push_back(static_cast<uint8_t>(r.layer[i]));
  }
  for (auto& c : r.cluster) {
    for (uint32_t& i : c) i += first;
    all.cluster.push_back(std::move(c));
  }
  for (Tet t : r.tet) m.cell.push_back({t[0] + first, t[1] + first, t[2] + first, t[3] + first});
  for (Triangle t : r.surface) all.surface.push_back({t[0] + first, t[1] + first, t[2] + first});
  for (size_t w = 0; w < static_cast<size_t>(r.walls); ++w) {
    Rim rim = w < r.rim.size() ? r.rim[w] : Rim{};
    for (uint32_t& i : rim.outer) i += first;
    for (uint32_t& i : rim.inner) i += first;
    m.picture.rim.push_back(rim.outer);
    m.rim.push_back(std::move(rim));
  }
  for (auto& k : r.visible.skin_particle)
    for (uint32_t& i : k) i += first;
  m.picture.body.push_back(std::move(r.visible));
}

void set_solver_parameters(Model& m) {
  const SceneSpec& scene = m.scene;
  SolverModel& s = m.solver;
  s.h = m.dt / static_cast<float>(m.substeps);
  s.gravity = scene.solver.gravity;
  s.tissue_gravity = scene.solver.gravity / scene.solver.mass_scale;
  s.shape_sweeps = scene.solver.shape_sweeps;
  s.shape_stiffness = stiffness_at(scene.solver.shape_stiffness, kPaperSubstep, s.h);
  s.shape_relaxation = scene.solver.shape_relaxation;
  s.self_sweeps = scene.solver.self_contact_sweeps;
  s.contact_sweeps = scene.solver.contact_sweeps;
  s.damping = scene.solver.damping;
  s.thread_damping = scene.solver.thread_damping;
  m.hand_compliance = 1 / scene.solver.hand_stiffness;
  s.tool_force = scene.solver.tool_force;
  s.friction = {scene.solver.friction_tissue, scene.solver.friction_tool, scene.solver.friction_thread};
}

void add_instruments_and_needles(Model& m, const std::vector<SutureSpec>& sutures, std::span<const InstrumentModel> own,
                                 const std::string& where) {
  const SceneSpec& scene = m.scene;
  SolverModel& s = m.solver;
  for (const InstrumentSpec& spec : instruments_of(scene)) {
    const InstrumentModel* kind = find_instrument(spec.kind, own);
    if (!kind) throw InputError(where, "instrument.kind \"" + spec.kind + "\" is not known", known_instruments(own));
    m.suture.instrument.push_back(*kind);
    s.body.push_back(kind->body);
  }
  for (const SutureSpec& u : sutures) {
    const NeedleShape needle{u.needle.radius, u.needle.arc, u.needle.wire_radius, u.needle.mass};
    s.needle_arc.push_back(needle_arc(needle));
    s.body.push_back(needle_body(needle));
  }
}

void set_mechanics(SutureModel& u, const SceneSpec& scene) {
  u.attach_threshold = scene.mechanics.attach_threshold;
  u.release_distance = scene.mechanics.release_distance;
  u.attach_compliance = scene.mechanics.attach_compliance;
  u.track_compliance = scene.mechanics.track_compliance;
  u.pass_tension = scene.mechanics.pass_tension;
  u.capstan_friction = scene.mechanics.capstan_friction;
  u.grasp_reach = scene.mechanics.grasp_reach;
  u.min_throws = scene.technique.throws;
}

// focus: the center of the field; tube: [m] radius of the first body.
void describe_picture(Model& m, const std::vector<SutureSpec>& sutures, Vec3 focus, float tube) {
  PictureModel& p = m.picture;
  p.title = m.scene.title;
  p.particle_rest.assign(m.start.begin(), m.start.begin() + static_cast<std::ptrdiff_t>(m.solver.tissue));
  p.wall = m.wall;
  p.visual_guide = m.scene.solver.preset == "paper";
  p.suture.clear();
  for (size_t k = 0; k < sutures.size(); ++k) {
    const NeedleSpec& needle = sutures[k].needle;
    const StrandModel& t = m.solver.strand[k];
    p.suture.push_back({t.first_slot, t.count, t.radius, t.spacing, needle.radius, needle.arc, needle.wire_radius});
  }
  p.focus = focus;
  p.field = 3 * tube;
  p.drape = m.solver.ground;
  if (m.scene.surroundings == "perineum") {
    // The verge lies where the bowel is fixed, so that what is drawn round its base stays on it.
    constexpr float fixed_above = 0.010f;  // [m] of fixed bowel beyond the verge: the dentate line is there
    const BodySpec& body = m.scene.body[0];
    PerineumShape around;
    around.out = normalized(body.axis, {0, 1, 0});
    around.verge = body.position - around.out * (body.length - body.pinned_length + fixed_above);
    around.radius = body.radius;
    p.scenery = make_perineum(around);
  }
}

}  // namespace

std::shared_ptr<const Model> build_model(const SceneSpec& scene, std::span<const InstrumentModel> own) {
  auto model = std::make_shared<Model>();
  Model& m = *model;
  m.scene = scene;
  const std::string where = name_of(scene);
  if (scene.body.empty()) throw InputError(where, "it has no [[body]]", "add at least one soft body");
  const std::vector<SutureSpec> sutures = sutures_of(scene);
  for (const SutureSpec& u : sutures)
    if (u.thread.particles < 8) throw InputError(where, "thread.particles is below 8", "a thread needs at least 8 particles");
  m.dt = 1.0f / scene.solver.tick_rate;
  m.substeps = is_physical(scene) ? physical_steps(m.dt) : scene.solver.substeps;

  // Soft bodies one after the other in the columns, followed by the thread.
  SolverModel& s = m.solver;
  Tissue tissue;
  for (const BodySpec& body : scene.body) add_body(m, body, tissue);
  s.tissue = static_cast<uint32_t>(tissue.rest.size());
  s.count = s.tissue;
  for (const SutureSpec& u : sutures) {
    s.strand.push_back(make_strand(scene, u.thread, s.count, scene.solver.gravity));
    s.count += s.strand.back().count;
    s.inv_mass.resize(s.count, s.strand.back().inv_mass);
  }
  s.shape = make_shape_model(tissue.rest, tissue.mass, tissue.cluster);
  s.use_volume = scene.solver.volume;
  s.volume_compliance = scene.solver.volume_compliance;
  if (s.use_volume) s.volume = make_volume_model(tissue.rest, m.cell);
  s.collision = make_tissue_collision(s.shape.rest, tissue.radius, tissue.body, tissue.apart, tissue.surface);
  s.ground = tissue.drape;
  set_solver_parameters(m);
  add_instruments_and_needles(m, sutures, own, where);
  set_mechanics(m.suture, scene);
  m.technique = make_technique(scene, m.rim);
  m.loose = find_loose(m);
  find_pieces(m);

  m.start = tissue.rest;
  const bool two = scene.body.size() > 1 && lies(scene.body[0]);
  const float tube = scene.body[0].radius;
  const Vec3 rim = two ? 0.5f * (scene.body[0].position + scene.body[1].position) : scene.body[0].position;
  lay_out_sutures(m, sutures, rim, two, tube);
  add_instruments(m, scene, rim, where);
  // Two ends are joined on top, where their rims face each other.
  describe_picture(m, sutures, two ? rim + Vec3{0, tube, 0} : rim, tube);
  if (is_physical(scene)) m.physical = make_physical(m, tissue.wall), m.picture.columns = m.solver.tissue / 2;
  return model;
}

const SceneSpec& scene_of(const Model& model) { return model.scene; }
size_t particle_count(const Model& model) { return model.solver.count; }
void StateDeleter::operator()(State* s) const { delete s; }

StatePtr initial_state(const Model& model) {
  StatePtr state(new State);
  State& s = *state;
  s.solver = make_solver_state(model.solver, model.start);
  prepare_scratch(model.solver, s.scratch);
  const size_t sutures = model.solver.strand.size();
  s.suture.suture.resize(sutures);
  s.technique.resize(sutures);
  s.plan.resize(sutures);
  reserve_room(model, s);
  lay_out_instruments(model, s);
  for (size_t k = 0; k < model.solver.strand.size(); ++k)
    fresh_suture(model.solver, s.solver, k, model.start, model.needle_start[k]);
  if (model.physical) s.physical = start_physical(model, s.solver);
  return state;
}

}  // namespace catgut
