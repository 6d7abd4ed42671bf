// SPDX-License-Identifier: Apache-2.0
// validation: the electrosurgical pen: depth against its energy balance, passes that add up, a circle that frees a piece, a cut
// through a suture hole, and lips that open.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "core/archive.h"
#include "physical/cut_mesh.h"
#include "physical/excise.h"
#include "physical/reflect.h"
#include "validation/checks.h"
#include "validation/suture_scenes.h"

namespace catgut::validation {
namespace {

double wide(float x) { return static_cast<double>(x); }

struct Work {
  physical::Model model;
  physical::State state;
  std::unique_ptr<physical::Scratch> scratch;
  physical::ExciseModel law;
  physical::Excision excision;
  // The tip goes straight along the outer face with `speed` [m/s].
  void draw(Vec3 from, Vec3 to, float power, float speed, bool coagulate = false) {
    const int steps = std::max(1, static_cast<int>(std::lround(distance(from, to) / speed / 0.001f)));
    for (int i = 0; i <= steps; ++i) {
      physical::Pen pen;
      pen.tip = lerp(from, to, static_cast<float>(i) / static_cast<float>(steps)), pen.power = power, pen.coagulate = coagulate;
      use_pen(law, model, state, *scratch, excision, pen, 0.001f);
    }
    lift();
  }
  void lift() { use_pen(law, model, state, *scratch, excision, {}, 0.001f); }
  uint32_t pieces() const { return wall::count_pieces(state.wall); }
  void step(Jobs& jobs) {
    wall::begin_step(model.wall, state.wall, scratch->wall, jobs);
    wall::finish_step(model.wall, state.wall, jobs);
  }
};

Work work_on(const wall::Spec& spec) {
  const wall::Wall w = wall::build_wall(spec);
  Work out;
  out.model = physical::make_model(w, knot_settings(0.2f));
  out.state.wall = w.state;
  out.scratch = std::make_unique<physical::Scratch>(out.model, out.state);
  return out;
}
Work work_on_sheet(int columns, int rows) {
  wall::Spec spec;
  wall::SheetShape shape;
  shape.columns = columns, shape.rows = rows, shape.width = 0.04f, shape.height = 0.024f;
  spec.mesh = wall::sheet(shape);
  for (int j = 0; j < rows; ++j) spec.mesh.held[static_cast<size_t>(j * columns)] = 1;
  spec.layer = wall::bowel_layers(0.0025f, 6e5f, 6e5f, 0.45f);
  return work_on(spec);
}

// Mean depth along the middle of a straight pass.
float depth_of_pass(int columns, int rows, float power, float speed) {
  Work w = work_on_sheet(columns, rows);
  w.draw({0.0203f, 0.002f, 0.00125f}, {0.0211f, 0.022f, 0.00125f}, power, speed);
  float sum = 0;
  int count = 0;
  for (const physical::Groove& g : w.excision.groove)
    if (g.at.y > 0.006f && g.at.y < 0.018f) sum += g.outer, ++count;
  return count > 0 ? sum / static_cast<float>(count) : 0;
}

Vec3 on_tube(float radius, float angle, float z) { return {radius * std::cos(angle), radius * std::sin(angle), z}; }

// Edges of the drawn parts of divided faces that belong to another number of triangles than two, those on the faces' own edges
// left out.
double open_edges(const physical::Model& m, const physical::State& s) {
  const physical::CutMesh mesh = make_cut_mesh(m, s);
  std::map<std::pair<uint32_t, uint32_t>, int> uses;
  const auto on_border = [&](uint32_t v) {
    const auto& w = mesh.vertex[v].at.weight;
    return std::min({w[0], w[1], w[2], w[3]}) < 1e-6f;  // of a quad
  };
  for (const physical::CutMesh::Face& f : mesh.face)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = f.vertex[k], b = f.vertex[(k + 1) % 3];
      if (!on_border(a) || !on_border(b)) ++uses[std::minmax(a, b)];
    }
  double open = mesh.face.empty() ? 1000 : 0;
  for (const auto& [edge, n] : uses) open += n != 2;
  return open;
}

// Jaws about a wall, and a thread that lies far away.
struct Scene {
  physical::Model model;
  physical::State state;
  std::unique_ptr<physical::Scratch> scratch;
  Jobs jobs{1};
  physical::HandTarget target;
  Scene(const wall::Wall& w, Vec3 gravity, Vec3 at) : model(physical::make_model(w, knot_settings(0.3f))) {
    model.bodies.gravity = gravity;
    state.wall = w.state;
    std::vector<Vec3> path;
    for (int i = 0; i < 40; ++i) path.push_back({0.2f, 0.2f, 0.5e-3f * static_cast<float>(i)});
    state.thread = thread::make_state(path);
    model.bodies.body.push_back(physical::make_tool({}));
    place_body(model.bodies.body[0], state.bodies.body.emplace_back(), {at, {}}, 0.09f);
  }
  void step(Vec3 at) {
    target.pose = {at, {}}, target.connected = true, target.opening = 0, target.grip = 20;
    physical::Hands hands;
    hands.targets = {&target, 1};
    physical::step(model, state, *scratch, hands, jobs);
  }
};

// Jaws hold the middle of a sheet; a blade goes round them; the jaws lift what has come free. Saved and loaded on the way.
void check_specimen(Lines& out) {
  wall::SheetShape shape;
  shape.width = 0.03f, shape.height = 0.02f, shape.columns = 13, shape.rows = 9;
  wall::Spec spec;
  spec.mesh = wall::sheet(shape);
  for (size_t c = 0; c < spec.mesh.held.size(); ++c) {
    const Vec3 p = spec.mesh.outer[c];
    spec.mesh.held[c] = std::abs(p.x - 0.015f) > 0.0149f || std::abs(p.y - 0.01f) > 0.0099f;
  }
  spec.gravity = {0, 0, -9.81f};
  const wall::Wall w = wall::build_wall(spec);
  const Vec3 center{0.0158f, 0.0107f, 0.0022f};
  Scene a(w, spec.gravity, center);
  a.scratch = std::make_unique<physical::Scratch>(a.model, a.state);
  for (int i = 0; i < 150; ++i) a.step(center);
  // The blade: a circle of 5.5 mm, through the whole wall, a millimeter in two steps.
  wall::Point last;
  const auto place = [&](int i) {
    const float angle = 6.2831853f * static_cast<float>(i) / 70;
    Vec3 p = center + Vec3{0.0055f * portable::cos(angle), 0.0055f * portable::sin(angle), 0};
    const float x = std::clamp(p.x / 0.0025f, 0.0f, 11.999f), y = std::clamp(p.y / 0.0025f, 0.0f, 7.999f);
    const uint32_t i0 = static_cast<uint32_t>(x), j0 = static_cast<uint32_t>(y);
    return wall::Point{j0 * 12 + i0, 2 * (x - static_cast<float>(i0)) - 1, 2 * (y - static_cast<float>(j0)) - 1, 0};
  };
  for (int i = 0; i <= 70; ++i) {
    const wall::Point now = place(i % 70);
    std::vector<wall::Mark> marks;
    if (i > 0) wall::trace(a.model.wall, last, now, marks);
    physical::cut(a.model, a.state, *a.scratch, marks);
    last = now;
    a.step(center), a.step(center);
  }
  out.add("cut/pen/specimen/circle of 5.5 mm round jaws that hold a sheet: pieces", 2, wall::count_pieces(a.state.wall), 0, "",
          "");
  out.add("cut/pen/specimen/edges of its drawn surface that are open", 0, open_edges(a.model, a.state), 0, "", "no hole");
  Vec3 at = center;
  for (int i = 0; i < 300; ++i) at.z += 5e-5f, a.step(at);
  // Saved and loaded.
  std::vector<std::byte> bytes;
  ByteSink sink{bytes};
  Writer<ByteSink> write(sink);
  write(a.state);
  Scene b(w, spec.gravity, center);
  Reader read(bytes, "check");
  read(b.state);
  physical::restore_cuts(b.model, b.state);
  b.scratch = std::make_unique<physical::Scratch>(b.model, b.state);
  for (Scene* s : {&a, &b}) {
    Vec3 to = at;
    for (int i = 0; i < 300; ++i) to.z += 5e-5f, s->step(to);
  }
  out.add("cut/pen/specimen/saved and loaded while it is lifted: states that differ", 0,
          hash_state(a.state) == hash_state(b.state) ? 0 : 1, 0, "", "to the bit");
  const wall::State& ws = a.state.wall;
  const std::vector<uint32_t> piece = wall::pieces(ws);
  const uint32_t free = piece[wall::weights(a.model.wall, ws.topology, a.state.bodies.body[0].grip.point[0].tissue).column[0]];
  double up = 0, mass = 0, low = 1;
  float rest = 0;
  for (uint32_t c = 0; c < wall::columns(ws); ++c) {
    if (piece[c] != free) rest = std::max(rest, std::abs(wall::vec3(ws.motion.x[2 * c]).z));
    else up += wide(ws.topology.mass[c] * wall::vec3(ws.motion.x[2 * c]).z), mass += wide(ws.topology.mass[c]);
    if (piece[c] == free) low = std::min(low, wide(wall::vec3(ws.motion.x[2 * c]).z));
  }
  out.add("cut/pen/specimen/jaws that held it before the cut still hold it, 1 for yes", 1,
          a.state.bodies.body[0].grip.what == physical::Gripped::tissue ? 1 : 0, 0, "", "never lost");
  out.add("cut/pen/specimen/lifted 30 mm: height of its center", 0.03, up / mass, 0.1, "m", "it follows the jaws");
  out.add("cut/pen/specimen/the sheet it was cut from: largest distance from its plane", 0, wide(rest), 2e-3, "m", "it stays");
  out.add("cut/pen/specimen/mass of the specimen, share of the circle", 3.14159265 * 0.0055 * 0.0055 * 0.0025 * 1050, mass,
          0.03, "kg", "area times thickness times density");
}

}  // namespace

void check_pen(Lines& out) {
  const std::string balance = "efficiency P / (2.0 GJ/m3 kerf speed)";
  out.add("cut/pen/groove of 10 W at 10 mm/s, elements of 4 mm: depth", 0.5e-3, wide(depth_of_pass(11, 7, 10, 0.01f)), 0.1, "m",
          balance);
  out.add("cut/pen/the groove, elements of 2 mm", 0.5e-3, wide(depth_of_pass(21, 13, 10, 0.01f)), 0.1, "m", balance);

  const Vec3 from{0.0203f, -0.0002f, 0.00125f}, to{0.0211f, 0.0242f, 0.00125f}, beside{0.0003f, 0, 0};
  Work slow = work_on_sheet(11, 7), fast = work_on_sheet(11, 7);
  slow.draw(from, to, 20, 0.0033f);
  out.add("cut/pen/20 W at 3.3 mm/s (4 mm/s go through 2.5 mm): pieces", 2, slow.pieces(), 0, "", balance);
  fast.draw(from, to, 20, 0.005f);
  out.add("cut/pen/20 W at 5 mm/s: pieces", 1, fast.pieces(), 0, "", "scored only");
  fast.draw(to + beside, from + beside, 20, 0.005f);
  out.add("cut/pen/a second pass 0.3 mm beside it: pieces", 2, fast.pieces(), 0, "", "depths add up in one groove, no ribbon");

  // A tube cut all round: the end comes free and falls.
  wall::Spec spec;
  wall::TubeShape shape;
  shape.around = 20, shape.rings = 9, shape.length = 0.036f, shape.outer_radius = 0.014f;
  spec.mesh = wall::tube(shape);
  spec.layer = wall::bowel_layers(0.0025f, 6e5f, 6e5f, 0.45f);
  Work tube = work_on(spec);
  const double mass = [&] {
    double sum = 0;
    for (const float v : tube.state.wall.topology.mass) sum += wide(v);
    return sum;
  }();
  const int parts = 3000;
  for (int i = 0; i <= parts; ++i) {
    const float angle = 6.4f * static_cast<float>(i) / parts;
    physical::Pen pen;
    pen.tip = on_tube(0.0139f, angle, -0.0141f - 0.001f * std::sin(3 * angle)), pen.power = 200;
    use_pen(tube.law, tube.model, tube.state, *tube.scratch, tube.excision, pen, 0.001f);
  }
  tube.lift();
  out.add("cut/pen/tube cut all round: pieces", 2, tube.pieces(), 0, "", "the specimen is free");
  tube.model.wall.gravity = {0, 0, 9.81f}, tube.model.wall.drag = 0;
  Jobs jobs(1);
  for (int i = 0; i < 100; ++i) tube.step(jobs);
  double fallen = 0, left = 0, after = 0;
  const std::vector<uint32_t> piece = wall::pieces(tube.state.wall);
  for (uint32_t c = 0; c < wall::columns(tube.state.wall); ++c) {
    const double m = wide(tube.state.wall.topology.mass[c]);
    after += m;
    if (piece[c] == piece[0]) fallen += m * wide(tube.state.wall.motion.v[2 * c].z), left += m;
  }
  out.add("cut/pen/the specimen, let fall for 0.1 s: speed", 0.981, fallen / left, 1e-3, "m/s", "g t");
  out.add("cut/pen/mass of both pieces, relative to the whole", 0, (after - mass) / mass, 1e-6, "", "nothing is lost");

  // Saved in the middle of a cut and loaded.
  Work again = work_on_sheet(11, 7);
  again.draw(from, lerp(from, to, 0.6f), 20, 0.003f);
  Work loaded = work_on_sheet(11, 7);
  loaded.state.wall.topology.cut = again.state.wall.topology.cut,
  loaded.state.wall.topology.factored = again.state.wall.topology.factored;
  loaded.state.wall.motion = again.state.wall.motion;
  std::vector<std::byte> bytes;
  ByteSink sink{bytes};
  Writer<ByteSink> write(sink);
  write(again.excision);
  Reader read(bytes, "check");
  read(loaded.excision);
  physical::restore_cuts(loaded.model, loaded.state);
  loaded.scratch = std::make_unique<physical::Scratch>(loaded.model, loaded.state);
  for (Work* w : {&again, &loaded}) {
    w->draw(lerp(from, to, 0.6f), to, 20, 0.003f);
    for (int i = 0; i < 20; ++i) w->step(jobs);
  }
  out.add("cut/pen/saved half way and loaded: states that differ", 0,
          hash_state(again.state) == hash_state(loaded.state) && again.pieces() == 2 ? 0 : 1, 0, "", "to the bit");

  // Lips open: a slit across a sheet that is drawn at its free end.
  Work slit = work_on_sheet(11, 7);
  slit.draw({0.0203f, 0.0063f, 0.00125f}, {0.0203f, 0.0177f, 0.00125f}, 20, 0.003f);
  for (int i = 0; i < 1500; ++i) {
    for (uint32_t c = 0; c < wall::columns(slit.state.wall); ++c)
      if (c % 11 == 10 && c < 77) slit.scratch->wall.external[2 * c] = {0.2f, 0, 0, 0};
    slit.step(jobs);
  }
  float gap = 0;
  const wall::Topology& t = slit.state.wall.topology;
  const auto at = [&](uint32_t f, uint32_t cell) {
    wall::Point p{f, 0, 0, 0};
    wall::to_natural(true, wall::raster(true).center[cell], p.xi, p.eta);
    return wall::place(wall::weights(slit.model.wall, t, p), slit.state.wall.motion);
  };
  for (uint32_t f = 0; f < slit.model.wall.mesh.face.size(); ++f)
    for (const wall::Raster::Link& link : wall::raster(true).link)
      if (link.b != wall::kNone && wall::lane_at(slit.model.wall, t, f, link.a) != wall::lane_at(slit.model.wall, t, f, link.b))
        gap = std::max(gap, distance(at(f, link.a), at(f, link.b)) - 0.5e-3f);
  out.add("cut/pen/slit of 11 mm in a sheet drawn with 1.4 N: the lips are apart by more than 0.5 mm, 1 for yes", 1,
          gap > 0.5e-3f ? 1 : 0, 0, "", "cut edges carry nothing");

  check_specimen(out);

  // Through a suture hole.
  Sewn s = interrupted({});
  s.run(0.02f);
  const physical::Hole hole = s.state.hole[0];
  const Vec3 before = mouth(s.model, s.state, hole);
  const size_t eyelets = s.state.thread.eyelet.size();
  std::vector<wall::Mark> marks;
  for (const float side : {-1.0f, 1.0f}) {
    wall::Point end = hole.place;
    end.xi = side * 0.99f, end.eta = hole.place.eta + side * 0.1f;
    wall::trace(s.model.wall, hole.place, end, marks);
  }
  const wall::CutResult cut = physical::cut(s.model, s.state, *s.scratch, marks);
  out.add("cut/pen/a blade through a suture hole: fragments of its face", 2,
          wall::fragments(s.state.wall.topology, hole.place.face), 0, "", "from edge to edge");
  out.add("cut/pen/the same hole: jump of its mouth", 0, wide(distance(before, mouth(s.model, s.state, hole))), 1e-7, "m", "");
  s.run(0.05f);
  bool finite = !cut.refused;
  for (uint32_t c = 0; c < wall::columns(s.state.wall); ++c) finite = finite && is_finite(wall::outer(s.state.wall, c));
  out.add("cut/pen/the same hole, 0.05 s later: holes and passages of the thread lost", 0,
          static_cast<double>(eyelets - s.state.thread.eyelet.size()) + (finite ? 0 : 100), 0, "", "never lost");
}

}  // namespace catgut::validation
