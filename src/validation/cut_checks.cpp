// SPDX-License-Identifier: Apache-2.0
// validation: cuts of the wall along random paths, against a flood fill that knows nothing of the cut's own bookkeeping. The
// reference lays the wall out flat, tests every pair of neighboring cells against every part of the path in double
// precision, and fills.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/hash.h"
#include "core/random.h"
#include "validation/checks.h"
#include "wall/cut.h"
#include "wall/reflect.h"

namespace catgut::validation {
namespace {

using wall::Wall;

struct Flat {
  double x = 0, y = 0;
};
Flat operator-(Flat a, Flat b) { return {a.x - b.x, a.y - b.y}; }
double cross(Flat a, Flat b) { return a.x * b.y - a.y * b.x; }

// A wall that can be laid out flat: a sheet, or a tube whose x is the arc. Faces of triangles where asked.
struct Body {
  Wall wall;
  double period = 0;         // [m] of x; 0: none
  double width, height;      // [m]
  float radius = 0, length;  // tube
  Flat flat(Vec3 p) const {
    if (period == 0) return {static_cast<double>(p.x), static_cast<double>(p.y)};
    const double turn = std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) / 6.283185307179586;
    return {(turn < 0 ? turn + 1 : turn) * period, static_cast<double>(-p.z)};
  }
  double shorter(double dx) const { return period == 0 ? dx : dx - period * std::round(dx / period); }
};

void split_faces(wall::Mesh& mesh) {
  std::vector<std::array<uint32_t, 4>> face;
  std::vector<Vec3> along;
  for (size_t f = 0; f < mesh.face.size(); ++f) {
    const auto& q = mesh.face[f];
    if (f % 2) face.push_back({q[0], q[1], q[2], wall::kNone}), face.push_back({q[0], q[2], q[3], wall::kNone});
    else face.push_back({q[0], q[1], q[3], wall::kNone}), face.push_back({q[1], q[2], q[3], wall::kNone});
    along.push_back(mesh.along[f]), along.push_back(mesh.along[f]);
  }
  mesh.face = face, mesh.along = along;
}

Body make_body(int kind) {
  Body b;
  wall::Spec spec;
  spec.layer = wall::bowel_layers(0.0025f, 6e5f, 6e5f, 0.45f);
  if (kind % 2 == 0) {
    wall::SheetShape shape;
    shape.columns = 13, shape.rows = 9, shape.width = 0.048f, shape.height = 0.032f;
    spec.mesh = wall::sheet(shape);
    for (int j = 0; j < shape.rows; ++j) spec.mesh.held[static_cast<size_t>(j * shape.columns)] = 1;
    b.width = 0.048, b.height = 0.032;
  } else {
    wall::TubeShape shape;
    shape.around = 20, shape.rings = 9, shape.length = 0.036f, shape.outer_radius = 0.014f;
    spec.mesh = wall::tube(shape);
    b.period = b.width = 6.283185307179586 * 0.01275, b.height = 0.036;
  }
  if (kind >= 2) split_faces(spec.mesh);
  b.wall = wall::build_wall(spec);
  return b;
}

// [m] flat, points a third of a millimeter apart.
std::vector<Flat> random_path(const Body& b, Random& random, int kind) {
  const auto draw = [&](double low, double high) { return low + (high - low) * static_cast<double>(random.uniform()); };
  std::vector<Flat> out;
  const auto add = [&](Flat p) {
    if (b.period == 0) p.x = std::clamp(p.x, -0.0, b.width);
    p.y = std::clamp(p.y, 0.0, b.height);
    if (out.empty()) return void(out.push_back(p));
    const Flat from = out.back();
    const double far = std::hypot(p.x - from.x, p.y - from.y);
    const int parts = std::max(1, static_cast<int>(far / 0.33e-3));
    for (int i = 1; i <= parts; ++i) out.push_back({from.x + (p.x - from.x) * i / parts, from.y + (p.y - from.y) * i / parts});
  };
  const Flat c{draw(0.3, 0.7) * b.width, draw(0.4, 0.6) * b.height};
  const double r = draw(0.15, 0.35) * b.height, turn = draw(0, 6.283);
  const auto circle = [&](double angle, double radius, double squeeze = 1) {
    return Flat{c.x + radius * std::cos(turn + angle), c.y + squeeze * radius * std::sin(turn + angle)};
  };
  switch (kind % 8) {
    case 0:  // across, from rim to rim
      add({draw(0.2, 0.8) * b.width, 0}), add({draw(0.2, 0.8) * b.width, b.height});
      break;
    case 1:  // closed, past its own start
      for (int i = 0; i <= 45; ++i) add(circle(i * 6.283185307 / 40, r));
      break;
    case 2:  // spiral
      for (int i = 0; i <= 90; ++i) add(circle(i * 6.283185307 / 30, r * (1 - 0.25 * i / 30.0)));
      break;
    case 3:  // figure of eight
      for (int i = 0; i <= 45; ++i) {
        const double a = i * 6.283185307 / 40;
        add({c.x + 1.5 * r * std::sin(a), c.y + r * std::sin(2 * a)});
      }
      break;
    case 4: {  // there and back over itself, a little beside
      const Flat to{c.x + 0.3 * b.width * std::cos(turn), c.y + 0.3 * b.height * std::sin(turn)};
      const double beside = draw(0, 0.8e-3);
      add(c), add(to), add({to.x + beside, to.y + beside}), add({c.x + beside, c.y + beside});
      break;
    }
    case 5: {  // along the rim, near it and then off it
      const double y = draw(0.2e-3, 3e-3);
      add({0.1 * b.width, 0}), add({0.15 * b.width, y}), add({0.7 * b.width, y}), add({0.8 * b.width, 0});
      break;
    }
    case 6:  // wild
      add(c);
      for (int i = 0; i < 12; ++i) add({draw(0, 1) * b.width, draw(0, 1) * b.height});
      break;
    default:  // star: many crossings in one face
      for (int i = 0; i <= 14; ++i) add(circle(i * 6.283185307 * 3 / 7, 0.8 * r));
  }
  return out;
}

wall::Point material(const Body& b, const std::vector<Vec3>& mid, Flat p) {
  // The nearest place on the wall at rest, by its flat coordinates.
  const wall::Model& m = b.wall.model;
  wall::Point best;
  double best_far = 1e9;
  for (uint32_t f = 0; f < m.mesh.face.size(); ++f) {
    const auto& face = m.mesh.face[f];
    const bool quad = face[3] != wall::kNone;
    const Flat o = b.flat(mid[face[0]]), a1 = b.flat(mid[face[1]]) - o, a2 = b.flat(mid[face[quad ? 3 : 2]]) - o, r = p - o;
    const Flat u{b.shorter(a1.x), a1.y}, v{b.shorter(a2.x), a2.y}, q{b.shorter(r.x), r.y};
    const double det = cross(u, v);
    double s = cross(q, v) / det, t = cross(u, q) / det;  // faces are parallelograms, or halves of them
    double over = std::max({0.0, -s, -t, quad ? std::max(s, t) - 1 : s + t - 1});
    if (over >= best_far) continue;
    best_far = over;
    s = std::clamp(s, 0.0, 1.0), t = std::clamp(t, 0.0, quad ? 1.0 : 1 - s);
    best = {f, static_cast<float>(quad ? 2 * s - 1 : 2 * s), static_cast<float>(quad ? 2 * t - 1 : 2 * t), 0};
  }
  return best;
}

struct Cells {
  std::vector<Flat> center;
  struct Pair {
    uint32_t a, b;  // neighbors
    Flat middle;    // of the border between them: the link between their centers goes through it
  };
  std::vector<Pair> pair;
};
Cells cells_of(const Body& b, const std::vector<Vec3>& mid) {
  const wall::Model& m = b.wall.model;
  Cells out;
  for (uint32_t f = 0; f < m.mesh.face.size(); ++f)
    for (uint32_t c = 0; c < wall::kCells; ++c) {
      const auto& face = m.mesh.face[f];
      const bool quad = face[3] != wall::kNone;
      const Flat o = b.flat(mid[face[0]]), a1 = b.flat(mid[face[1]]) - o, a2 = b.flat(mid[face[quad ? 3 : 2]]) - o;
      const wall::LatticePoint p = wall::raster(quad).center[c];
      const double s = static_cast<double>(p.u) / wall::kLattice, t = static_cast<double>(p.v) / wall::kLattice;
      out.center.push_back({o.x + s * b.shorter(a1.x) + t * b.shorter(a2.x), o.y + s * a1.y + t * a2.y});
    }
  for (uint32_t f = 0; f < m.mesh.face.size(); ++f) {
    const bool quad = m.mesh.face[f][3] != wall::kNone;
    const wall::Raster& r = wall::raster(quad);
    for (uint32_t l = 0; l < r.inner; ++l) {
      const uint32_t i = f * wall::kCells + r.link[l].a, j = f * wall::kCells + r.link[l].b;
      const Flat p = out.center[i], q = out.center[j];
      out.pair.push_back({i, j, {p.x + 0.5 * b.shorter(q.x - p.x), 0.5 * (p.y + q.y)}});
    }
    for (uint32_t e = 0; e < r.edges; ++e) {
      const uint32_t over = m.neighbor[f][e];
      if (over == wall::kNone || over / 4 < f) continue;
      const wall::Raster& o = wall::raster(m.mesh.face[over / 4][3] != wall::kNone);
      const Flat from = b.flat(mid[m.mesh.face[f][e]]), to = b.flat(mid[m.mesh.face[f][(e + 1) % r.edges]]);
      for (uint32_t k = 0; k < wall::kRaster; ++k) {
        const double at = (k + 0.5) / wall::kRaster;
        out.pair.push_back({f * wall::kCells + r.link[r.over_edge(e, k)].a,
                            over / 4 * wall::kCells + o.link[o.over_edge(over % 4, wall::kRaster - 1 - k)].a,
                            {from.x + at * b.shorter(to.x - from.x), from.y + at * (to.y - from.y)}});
      }
    }
  }
  return out;
}

// Cells: a quarter of a face. Crumbs of one and two cells stay with a neighbor, so smaller pieces may have another size.
constexpr uint32_t kPiece = 16;

// Compares two divisions of the cells. wrong: pieces of `want` that `got` has joined, or divided, or does not have at all.
// Returns the cells of pieces of `want` that are in another piece of `got`, those that `either` allows left out.
double compare(const std::vector<uint32_t>& got, const std::vector<uint32_t>& want, const std::vector<uint8_t>& either,
               int& wrong, uint32_t& pieces) {
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> shared;
  std::vector<uint32_t> got_size(got.size(), 0), want_size(want.size(), 0);
  for (size_t i = 0; i < got.size(); ++i) ++shared[{want[i], got[i]}], ++got_size[got[i]], ++want_size[want[i]];
  std::vector<uint32_t> match(want.size(), wall::kNone), back(got.size(), wall::kNone), most(want.size(), 0),
      most_back(got.size(), 0);
  for (const auto& [key, n] : shared) {
    if (n > most[key.first]) most[key.first] = n, match[key.first] = key.second;
    if (n > most_back[key.second]) most_back[key.second] = n, back[key.second] = key.first;
  }
  pieces = 0;
  for (uint32_t p = 0; p < want.size(); ++p) {
    if (want_size[p] >= kPiece) ++pieces, wrong += back[match[p]] != p;
    if (got_size[p] >= kPiece) wrong += match[back[p]] != p;
  }
  double off = 0;
  for (size_t i = 0; i < got.size(); ++i) off += want_size[want[i]] >= kPiece && got[i] != match[want[i]] && !either[i];
  return off;
}

std::vector<uint32_t> reference(const Body& b, const Cells& cells, const std::vector<Flat>& path) {
  std::vector<uint32_t> label(cells.center.size());
  std::iota(label.begin(), label.end(), 0u);
  const auto root = [&](uint32_t a) {
    while (label[a] != a) a = label[a] = label[label[a]];
    return a;
  };
  for (const auto& [a, c, middle] : cells.pair) {
    bool cut = false;
    for (const uint32_t end : {a, c}) {
      const Flat p = cells.center[end], d{b.shorter(middle.x - p.x), middle.y - p.y};
      for (size_t i = 0; i + 1 < path.size() && !cut; ++i) {
        const Flat q{b.shorter(path[i].x - p.x), path[i].y - p.y}, e = path[i + 1] - path[i];
        if (std::abs(q.x) + std::abs(q.y) > 0.004) continue;
        const double left = cross(d, q), right = cross(d, {q.x + e.x, q.y + e.y});
        const double from = cross(e, {-q.x, -q.y}), to = cross(e, {d.x - q.x, d.y - q.y});
        cut = (left >= 0) != (right >= 0) && (from >= 0) != (to >= 0);
      }
    }
    if (!cut) {
      const uint32_t x = root(a), y = root(c);
      label[std::max(x, y)] = std::min(x, y);
    }
  }
  for (uint32_t i = 0; i < label.size(); ++i) label[i] = root(i);
  return label;
}

double distance_to(const Body& b, const std::vector<Flat>& path, Flat p) {
  double near = 1;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const Flat q{b.shorter(path[i].x - p.x), path[i].y - p.y}, e = path[i + 1] - path[i];
    const double at = std::clamp(-(q.x * e.x + q.y * e.y) / (e.x * e.x + e.y * e.y + 1e-30), 0.0, 1.0);
    near = std::min(near, std::hypot(q.x + at * e.x, q.y + at * e.y));
  }
  return near;
}

uint64_t hash_of(const wall::State& s) {
  Hasher hasher;
  Writer<Hasher> write(hasher);
  write(s.motion), write(s.topology.corners), write(s.topology.mass), write(s.topology.slot), write(s.topology.gather_from);
  write(s.topology.factor), write(s.topology.extra), write(s.topology.relative);
  return hasher.digest();
}

void step(Wall& w, Jobs& jobs) {
  wall::begin_step(w.model, w.state, w.scratch, jobs);
  wall::finish_step(w.model, w.state, jobs);
}

struct Sums {
  int paths = 0, wrong_count = 0, wrong_state = 0, wrong_load = 0, refused = 0;
  double mass = 0, moved = 0, cells = 0, off = 0;  // largest over all paths
  uint32_t most_pieces = 0, added = 0;
};

void run_path(const Body& start, uint32_t seed, Sums& sums) {
  Body b = start;
  Wall& w = b.wall;
  Random random(seed);
  std::vector<Vec3> mid;
  for (size_t c = 0; c < w.model.mesh.outer.size(); ++c) mid.push_back((w.model.mesh.outer[c] + w.model.mesh.inner[c]) * 0.5f);
  const std::vector<Flat> path = random_path(b, random, static_cast<int>(seed));
  std::vector<wall::Point> hole;
  for (int i = 0; i < 12; ++i)
    hole.push_back(material(b, mid, path[static_cast<size_t>(random.uniform() * static_cast<float>(path.size() - 1))]));
  Jobs jobs(1), many(3);
  std::vector<wall::Mark> marks;
  std::vector<Flat> taken;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    marks.clear();
    if (!wall::trace(w.model, material(b, mid, path[i]), material(b, mid, path[i + 1]), marks)) ++sums.wrong_state;
    std::vector<Vec3> before;
    for (const wall::Point& p : hole)
      before.push_back(wall::place(wall::weights(w.model, w.state.topology, p), w.state.motion));
    const wall::CutResult cut = wall::cut_links(w.model, w.state, w.scratch, marks);
    sums.refused += cut.refused, sums.added += cut.columns;
    for (size_t k = 0; k < hole.size(); ++k)
      sums.moved =
          std::max(sums.moved, static_cast<double>(distance(
                                   before[k], wall::place(wall::weights(w.model, w.state.topology, hole[k]), w.state.motion))));
    // The free end is drawn away and aside, so that the wall is strained and turned while it is cut.
    if (i % 8 == 0) {
      for (uint32_t c = 0; c < wall::columns(w.state); c += 7) w.scratch.external[2 * c] = {0.004f, 0.002f, 0.006f, 0};
      step(w, i % 16 ? jobs : many);
    }
  }
  for (int i = 0; i < 40; ++i) step(w, jobs);

  double mass = 0;
  bool sane = true;
  const wall::Topology& t = w.state.topology;
  for (uint32_t c = 0; c < wall::columns(w.state); ++c) {
    mass += static_cast<double>(t.mass[c]);
    sane = sane && t.mass[c] > 0 && is_finite(wall::outer(w.state, c)) && is_finite(wall::inner(w.state, c));
    sane = sane && t.gather_first[c] < t.gather_first[c + 1] && std::isfinite(t.relative[c]) && t.inv_dir[c] >= 0;
  }
  for (const float v : t.factor.value) sane = sane && std::isfinite(v);
  for (const wall::Fragment& f : t.fragment)
    for (const auto& column : t.corners[f.lane / 16].column) sane = sane && column[f.lane % 16] < wall::columns(w.state);
  sums.wrong_state += !sane;
  double rest = 0;
  for (const float m : start.wall.state.topology.mass) rest += static_cast<double>(m);
  sums.mass = std::max(sums.mass, std::abs(mass - rest) / rest);

  // Pieces, as cells of the columns that hang together.
  const Cells cells = cells_of(b, mid);
  const std::vector<uint32_t> piece = wall::pieces(w.state);
  std::vector<uint32_t> label;
  for (uint32_t f = 0; f < w.model.mesh.face.size(); ++f)
    for (uint32_t c = 0; c < wall::kCells; ++c) {
      const uint32_t lane = wall::lane_at(w.model, t, f, c);
      label.push_back(piece[t.corners[lane / 16].column[0][lane % 16]]);
    }
  std::vector<uint8_t> either;  // cells whose center is on the path
  for (const Flat& p : cells.center) either.push_back(distance_to(b, path, p) < 2e-6);
  uint32_t count = 0;
  int wrong = 0;
  sums.cells = std::max(sums.cells, compare(label, reference(b, cells, path), either, wrong, count));
  sums.wrong_count += wrong > 0;
  sums.most_pieces = std::max(sums.most_pieces, count);

  // How far from the path the lips are: the middle of the border between two cells that were parted.
  for (const auto& [a, c, p] : cells.pair) {
    const uint32_t fa = a / wall::kCells, fc = c / wall::kCells;
    const uint32_t la = wall::lane_at(w.model, t, fa, a % wall::kCells), lc = wall::lane_at(w.model, t, fc, c % wall::kCells);
    if (fa != fc || la == lc) continue;
    sums.off = std::max(sums.off, distance_to(b, path, p));
  }

  // Saved: the links and the motion. Loaded into another wall of the same model.
  Wall loaded = start.wall;
  loaded.state.topology.cut = t.cut, loaded.state.topology.factored = t.factored;
  loaded.state.motion = w.state.motion;
  wall::restore(loaded.model, loaded.state.topology);
  loaded.scratch = wall::make_scratch(loaded.model, loaded.state);
  bool same = hash_of(loaded.state) == hash_of(w.state);
  for (int i = 0; i < 10; ++i) step(w, jobs), step(loaded, many);
  same = same && hash_of(loaded.state) == hash_of(w.state);
  sums.wrong_load += !same;
  ++sums.paths;
}

}  // namespace

void check_cuts(Lines& out, bool nightly) {
  Sums sums;
  const int bodies = 4, each = nightly ? 50 : 2;
  for (int kind = 0; kind < bodies; ++kind) {
    const Body body = make_body(kind);
    for (int i = 0; i < each; ++i) run_path(body, static_cast<uint32_t>(nightly ? i : kind * each + i), sums);
  }
  const std::string paths = std::to_string(sums.paths) + " random paths on 4 walls";
  out.add("cut/paths/" + paths + ": with pieces that are not those of the flood fill", 0, sums.wrong_count, 0, "paths",
          "flood fill of the flat layout; pieces of 16 cells and more");
  out.add("cut/paths/the same: cells in another piece than by the flood fill", 0, sums.cells, 2, "cells",
          "those with their center on the path left out");
  out.add("cut/paths/the same: pieces of the wall with most of them, at least 5 of 5", 5, std::min(5u, sums.most_pieces), 0, "",
          "the paths do divide");
  out.add("cut/paths/the same: mass, relative", 0, sums.mass, 1e-6, "", "nothing is lost");
  out.add("cut/paths/the same: jump of material points on the path", 0, sums.moved, 1e-7, "m", "a cut moves nothing");
  out.add("cut/paths/the same: walls with a state that is not sane", 0, sums.wrong_state, 0, "",
          "finite, positive, all corners there");
  out.add("cut/paths/the same: walls that differ after saving and loading", 0, sums.wrong_load, 0, "", "to the bit");
  out.add("cut/paths/the same: cuts refused for want of room", 0, sums.refused, 0, "", "capacity");
  out.add("cut/paths/the same: distance of the lips from the path", 0, sums.off, 0.4e-3, "m", "cells of 0.5 mm");
}

}  // namespace catgut::validation
