// SPDX-License-Identifier: Apache-2.0
// render/filament/thread_view: see thread_view.h.
#include "render/filament/thread_view.h"

#include <algorithm>
#include <cmath>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr int kSides = 8, kPerSpan = 4, kPerTurn = 14;
constexpr uint32_t kRing = kSides + 1;
constexpr float kKnotReach = 0.006f;     // [m] maximum distance of a knot from its tissue
constexpr uint32_t kRoomForTied = 4000;  // points of the curve for knots and baked sutures; further ones are not drawn
const Vec3 kViolet = srgb(98, 62, 178), kGuide = srgb(176, 150, 238);

// Adds one more piece to the curve. It begins and ends with a point of zero width, which closes its ends and hides the link to
// the next piece.
void add_piece(ThreadView& view, std::span<const Vec3> points, float width, bool guide = false) {
  if (points.size() < 2 || view.curve.size() + points.size() + 2 > view.capacity) return;
  const auto add = [&](Vec3 p, float r) {
    view.curve.push_back(p);
    view.radius.push_back(r);
    view.guide.push_back(guide);
  };
  add(points.front(), 0);
  for (const Vec3& p : points) add(p, width);
  add(points.back(), 0);
}

void add_strand(ThreadView& view, float width, bool guide = false) {
  smooth_curve(view.through, kPerSpan, view.piece);
  add_piece(view, view.piece, width, guide);
  view.through.clear();
}

// Where a point of the thread lies: free or on a surface; in one wall; between the walls that one bite joins.
constexpr uint8_t kThroughWalls = 0, kOutside = 1, kInWall = 2;
constexpr float kTissueReach = 0.004f, kClothReach = 0.007f;  // [m] maximum depth of a thread that is lifted out

// The tissue's surface near p: position and normal. `side`: the side of the wall that the thread lies on, updated. A thread
// between the two sides of a wall belongs to the side that it was on before; one that has gone over an edge and lies on the
// other side belongs to that.
bool tissue_surface(const ThreadView& view, std::span<const TissueView> tissue, const Motions& motion, Vec3 p, int& side,
                    Vec3& at, Vec3& normal) {
  constexpr float other_side = 0.0025f;  // [m] how much farther the other side counts
  constexpr float sunk = 0.0004f;        // [m] thread above the nearest surface, or less than this below it, lies on it
  struct Near {
    float cost = 1;
    size_t body = 0;
    uint32_t vertex = 0;
  } any, same;
  const auto keep = [](Near& best, float cost, size_t body, uint32_t vertex) {
    if (cost < best.cost) best = {cost, body, vertex};
  };
  for (size_t b = 0; b < tissue.size(); ++b) {
    const std::vector<TissueLayer>& layer = tissue[b].mesh->layer;
    view.grid[b].near(p, [&](uint32_t v, float d2) {
      if (v >= layer.size()) return;  // the copy of a vertex on a texture seam
      const bool other = side >= 0 && layer[v] != TissueLayer::cut_edge && int(layer[v]) != side;
      keep(any, d2, b, v), keep(same, d2 + (other ? other_side * other_side : 0), b, v);
    });
  }
  const auto frame_of = [&](const Near& near) { return follow(tissue[near.body].vertex[near.vertex], motion.of).frame; };
  const auto height = [&](const Near& near) {
    return dot(p - tissue[near.body].drawn[near.vertex], rotate(frame_of(near), {0, 0, 1}));
  };
  const Near& near = any.cost < kTissueReach * kTissueReach && height(any) > -sunk ? any : same;
  if (near.cost >= kTissueReach * kTissueReach) {
    side = -1;
    return false;
  }
  if (const TissueLayer layer = tissue[near.body].mesh->layer[near.vertex]; layer != TissueLayer::cut_edge) side = int(layer);
  at = tissue[near.body].drawn[near.vertex], normal = rotate(frame_of(near), {0, 0, 1});
  return true;
}

struct Lift {
  std::span<const TissueView> tissue;
  const Motions* motion;
  const Snapshot* snapshot;
  size_t suture;
  float width;    // [m] half the drawn thread's
  float deepest;  // [m] what lies deeper is inside the wall
};

// Moves the curve's points that lie outside the wall (view.outside) out of tissue, cloth and instruments.
void lift_piece(ThreadView& view, const Lift& lift) {
  const size_t n = view.piece.size();
  view.moved = view.piece;
  const auto out_of_tissue = [&](std::vector<Vec3>& curve) {
    int side = -1;
    for (size_t i = 0; i < n; ++i) {
      if (view.outside[i] != kOutside) continue;
      Vec3 at, normal;
      if (!tissue_surface(view, lift.tissue, *lift.motion, curve[i], side, at, normal)) continue;
      const float height = dot(curve[i] - at, normal);
      if (height < lift.width && height > -lift.deepest) curve[i] += normal * (lift.width - height);
    }
  };
  out_of_tissue(view.moved);
  // Inside a bent wall the straight way from hole to hole may come out of it.
  constexpr float below = 0.0003f, above = 0.0015f;  // [m]
  for (size_t i = 0; i < n; ++i) {
    int side = -1;
    Vec3 at, normal;
    if (view.outside[i] != kInWall || !tissue_surface(view, lift.tissue, *lift.motion, view.moved[i], side, at, normal))
      continue;
    const float height = dot(view.moved[i] - at, normal);
    if (height > -below && height < above) view.moved[i] -= normal * (height + below);
  }
  // Displacements of neighbors differ where the nearest vertices do: smoothed, then once more for what the smoothing sank.
  for (int pass = 0; pass < 2; ++pass) {
    Vec3 before = n > 0 ? view.moved[0] - view.piece[0] : Vec3{};
    for (size_t i = 1; i + 1 < n; ++i) {
      const Vec3 here = view.moved[i] - view.piece[i], next = view.moved[i + 1] - view.piece[i + 1];
      if (view.outside[i] == kOutside && view.outside[i - 1] == kOutside && view.outside[i + 1] == kOutside)
        view.moved[i] = view.piece[i] + 0.25f * before + 0.5f * here + 0.25f * next;
      before = here;
    }
  }
  out_of_tissue(view.moved);
  for (size_t i = 0; i < n; ++i) {
    if (view.outside[i] != kOutside) continue;
    Vec3& p = view.moved[i];
    float least = 1;
    uint32_t nearest = 0;
    view.cloth_grid.near(p, [&](uint32_t v, float d2) {
      if (d2 < least) least = d2, nearest = v;
    });
    if (least < 1) {
      const Vec3 normal = view.cloth_normal[nearest];
      const float height = dot(p - view.cloth[nearest], normal);
      if (height < lift.width) p += normal * (lift.width - height);
    }
  }
  const auto out_of_tools = [&] {
    for (size_t i = 0; i < n; ++i) {
      if (view.outside[i] == kInWall) continue;  // in the lumen, or from it on, there are instruments too
      Vec3& p = view.moved[i];
      for (const ToolView& tool : lift.snapshot->tool) {
        if (tool.instrument < 0 || size_t(tool.instrument) >= view.hull.size()) continue;
        // What the jaws hold passes between them.
        constexpr float held = 0.0035f;
        if (tool.held != Held::nothing && tool.held != Held::tissue && tool.held_suture == lift.suture &&
            distance(p, tool.pose.p) < held)
          continue;
        p = outside_tool(view.hull[size_t(tool.instrument)], tool.pose, tool.jaw, p, lift.width);
      }
    }
  };
  out_of_tools();
  // Where a strand enters an outline it would step aside within one point: it bends there instead.
  for (int pass = 0; pass < 2; ++pass) {
    Vec3 before = n > 0 ? view.moved[0] : Vec3{};
    for (size_t i = 1; i + 1 < n; ++i) {
      const Vec3 here = view.moved[i];
      if (view.outside[i - 1] != kInWall && view.outside[i] != kInWall && view.outside[i + 1] != kInWall &&
          (distance(view.moved[i], view.piece[i]) > lift.width || distance(view.moved[i + 1], view.piece[i + 1]) > lift.width))
        view.moved[i] = 0.25f * before + 0.5f * here + 0.25f * view.moved[i + 1];
      before = here;
    }
  }
  out_of_tools();
  view.piece.swap(view.moved);
}

// A strand through view.through; view.node_outside states which of its nodes lie outside the wall.
void add_lifted_strand(ThreadView& view, const Lift& lift) {
  smooth_curve(view.through, kPerSpan, view.piece);
  view.outside.assign(view.piece.size(), kThroughWalls);
  for (size_t i = 0; i < view.piece.size(); ++i) {
    const size_t a = i / kPerSpan, b = std::min(a + (i % kPerSpan ? 1 : 0), view.through.size() - 1);
    if (view.node_outside[a] == view.node_outside[b]) view.outside[i] = view.node_outside[a];
  }
  lift_piece(view, lift);
  add_piece(view, view.piece, lift.width);
  view.through.clear(), view.node_outside.clear();
}

// Per node of the suture's thread: where it lies. Between entry and exit of a bite it is inside the wall. From a hole in the
// mucosa on it is in the lumen, where it is drawn as physics has it: near the wall's inner side it would else be taken for a
// thread that sank into the outer one.
void find_outside(const SutureView& suture, std::vector<uint8_t>& outside) {
  const size_t n = suture.thread_order.size();
  outside.assign(n, kOutside);
  struct Hole {
    size_t node;
    uint32_t bite, wall;
    bool exit, mucosa;
  };
  std::vector<Hole> hole;
  for (const SuturePointView& point : suture.suture_point) {
    const auto at = std::find(suture.thread_order.begin(), suture.thread_order.end(), point.anchored);
    if (at == suture.thread_order.end()) continue;
    const bool known = point.bite < suture.bite.size();
    const bool mucosa = known && (point.exit ? suture.bite[point.bite].exit_inside : suture.bite[point.bite].entry_inside);
    hole.push_back({size_t(at - suture.thread_order.begin()), point.bite, point.wall, point.exit, mucosa});
  }
  std::stable_sort(hole.begin(), hole.end(), [](const Hole& a, const Hole& b) { return a.node < b.node; });
  if (hole.empty()) return;
  const auto fill = [&](size_t from, size_t to, uint8_t where) {
    std::fill(outside.begin() + long(from), outside.begin() + long(to), where);
  };
  if (hole.front().mucosa) fill(0, hole.front().node + 1, kThroughWalls);
  for (size_t i = 0; i < hole.size(); ++i) {
    const Hole& a = hole[i];
    if (i + 1 == hole.size()) {
      // After the last hole; a bite under way has no exit yet and is inside as far as the needle.
      if (a.mucosa || !a.exit) fill(a.node + 1, n, kThroughWalls);
      if (a.mucosa) outside[a.node] = kThroughWalls;
      break;
    }
    const Hole& b = hole[i + 1];
    if (a.bite == b.bite) {
      const uint8_t where = a.wall == b.wall ? kInWall : kThroughWalls;
      if (b.node > a.node + 1) fill(a.node + 1, b.node, where);
      else outside[a.node] = outside[b.node] = where;  // neighbors: the span between them is inside although both ends are not
    } else if (a.mucosa || b.mucosa) {
      fill(a.node, b.node + 1, kThroughWalls);
    }
  }
}

Vec3 normal_at(Nearest at, std::span<const TissueView> tissue, const Motions& motion) {
  if (at.body < 0) return {0, 1, 0};
  return rotate(follow(tissue[size_t(at.body)].vertex[at.vertex], motion.of).frame, {0, 0, 1});
}

// Searches for the nearest tissue only when the last result is no longer near: it visits every vertex.
Nearest tissue_at(std::vector<Nearest>& known, size_t i, Vec3 point, float reach, std::span<const TissueView> tissue) {
  if (known.size() <= i) known.resize(i + 1);
  Nearest& n = known[i];
  if (n.body < 0 || distance(tissue[size_t(n.body)].position[n.vertex], point) > reach)
    n = nearest_vertex(tissue, point, reach);
  return n;
}

// One throw: its two strands are wound about each other along the stitch, one wrap more than they cross. They dip toward the
// tissue at both ends. `above`: distance of the throw from the knot's position along `out`.
void add_throw(ThreadView& view, Vec3 at, Vec3 way, Vec3 out, float above, uint32_t wraps, int chirality, float width) {
  way = normalized(way - out * dot(way, out), any_perpendicular(out));
  const Vec3 side = cross(way, out);
  const float turns = 0.5f * (static_cast<float>(std::min(wraps, 6u)) + 1), along = 4.2f * width * turns;
  const int points = static_cast<int>(turns * kPerTurn);
  for (const float start : {0.0f, kPi}) {
    view.piece.clear();
    for (int i = -2; i <= points + 2; ++i) {
      const float part = static_cast<float>(i) / static_cast<float>(points),
                  a = start + static_cast<float>(chirality) * 2 * kPi * turns * part;
      const float bow = 2 * part - 1, sag = width * (0.9f * bow * bow);
      view.piece.push_back(at + out * (above - sag + 1.02f * width * std::cos(a)) + side * (1.02f * width * std::sin(a)) +
                           way * (along * (part - 0.5f)));
    }
    add_piece(view, view.piece, width);
  }
}

// The ring of vertices round each point of the curve. Its frame is transported along the curve without twist, so that
// the braid does not twist; each corner's own frame is rotated about the curve.
void write_tube(ThreadView& view, const Surface& surface) {
  struct Corner {
    float c, s;
    Quat turn;
  };
  std::array<Corner, kRing> corner;
  for (uint32_t k = 0; k < kRing; ++k) {
    const float a = 2 * kPi * float(k) / kSides;
    corner[k] = {std::cos(a), std::sin(a), axis_angle({1, 0, 0}, a)};
  }
  const size_t n = view.curve.size();
  Vec3 along{0, 0, 1}, side{1, 0, 0};
  float u = 0;
  for (size_t i = 0; i < n; ++i) {
    const Vec3 p = view.curve[i];
    along = normalized(view.curve[i + 1 < n ? i + 1 : i] - view.curve[i > 0 ? i - 1 : i], along);
    side = normalized(side - along * dot(side, along), any_perpendicular(along));
    const Vec3 up = cross(along, side);
    const Quat frame = from_axes(along, -up, side);
    if (i > 0) u += distance(p, view.curve[i - 1]);
    const Vec3 c = view.guide[i] ? kGuide : kViolet;
    for (uint32_t k = 0; k < kRing; ++k) {
      const size_t v = i * kRing + k;
      surface.position[v] = p + view.radius[i] * (side * corner[k].c + up * corner[k].s);
      surface.frame[v] = pack_frame(frame * corner[k].turn);
      view.look[v] = {{c.x, c.y, c.z, view.guide[i] ? 1.0f : 0.0f}, {u, float(k) / kSides}, {1, 0}};
    }
  }
}

// A suture's thread in its pieces, and the guide to its needle.
void add_suture(ThreadView& view, const SuturePicture& model, const SutureView& suture, std::span<const Vec3> particle,
                const Lift& lift, bool guide) {
  const float width = lift.width;
  find_outside(suture, view.thread_outside);
  for (size_t i = 0; i < suture.thread_order.size(); ++i) {
    const uint32_t slot = suture.thread_order[i];
    if (slot < particle.size() && is_finite(particle[slot]))
      view.through.push_back(particle[slot]), view.node_outside.push_back(view.thread_outside[i]);
    if (i < suture.thread_cut.size() && suture.thread_cut[i]) add_lifted_strand(view, lift);
  }
  add_lifted_strand(view, lift);
  const Pose& needle = suture.needle.pose;
  if (!guide || !suture.needle.in_tissue || suture.needle.bite >= suture.bite.size() || !is_finite(needle.p)) return;
  // It follows the needle's own arc as far as the needle extends, which is the path that the thread will take.
  const Vec3 entry = suture.bite[suture.needle.bite].entry, swage = transform(needle, {model.needle_radius, 0, 0});
  const Vec3 middle = 0.5f * (entry + swage), bow = normalized(middle - needle.p, {0, 1, 0});
  view.through = {entry, middle + bow * (0.12f * distance(entry, swage)), swage};
  if (is_finite(entry)) add_strand(view, 0.8f * width, true);
  view.through.clear();
}

}  // namespace

ThreadView make_thread_view(filament::Engine& engine, filament::Scene& scene, const PictureModel& model,
                            filament::MaterialInstance* material) {
  ThreadView view;
  for (const SuturePicture& suture : model.suture)
    if (suture.thread_count > 1) view.capacity += (suture.thread_count - 1) * kPerSpan + 1;
  if (view.capacity == 0) return view;
  view.capacity += kRoomForTied;
  view.look.resize(size_t(view.capacity) * kRing);
  std::vector<std::array<uint32_t, 3>> triangle;
  for (uint32_t i = 0; i + 1 < view.capacity; ++i)
    for (uint32_t k = 0; k < uint32_t(kSides); ++k) {
      const uint32_t a = i * kRing + k, b = a + kRing;
      triangle.push_back({a, a + 1, b});
      triangle.push_back({a + 1, b + 1, b});
    }
  for (auto* v : {&view.through, &view.piece, &view.curve, &view.moved}) v->reserve(view.capacity);
  view.radius.reserve(view.capacity);
  view.guide.reserve(view.capacity);
  view.gpu = make_mesh(engine, scene, view.look, triangle, material, true);
  set_drawn(engine, view.gpu, 0);
  return view;
}

void move_thread(filament::Engine& engine, ThreadView& view, const PictureModel& model, const Snapshot& snapshot,
                 std::span<const TissueView> tissue, const Motions& motion, const Camera& camera, float pixel) {
  if (view.capacity == 0) return;
  view.curve.clear(), view.radius.clear(), view.guide.clear(), view.through.clear();
  const Vec3 ahead = normalized(camera.target - camera.eye);
  const float seen = 0.75f * pixel * std::max(0.0f, dot(camera.target - camera.eye, ahead));  // [m] minimum visible width
  view.grid.resize(tissue.size());
  for (size_t b = 0; b < tissue.size(); ++b) view.grid[b].build(tissue[b].drawn, kTissueReach);
  size_t tied = 0;
  for (size_t i = 0; i < std::min(model.suture.size(), snapshot.suture.size()); ++i) {
    const float width = std::max(model.suture[i].thread_radius, seen);
    add_suture(view, model.suture[i], snapshot.suture[i], snapshot.particle,
               {tissue, &motion, &snapshot, i, width, kTissueReach}, model.visual_guide);
    for (const KnotView& knot : snapshot.suture[i].knot) {
      const Vec3 out = normal_at(tissue_at(view.on_tissue, tied++, knot.position, kKnotReach, tissue), tissue, motion);
      for (uint32_t k = 0; k < std::min<uint32_t>(knot.throws, KnotView::kMaxThrows); ++k)
        add_throw(view, knot.position, knot.way, out, (0.8f + 2.7f * static_cast<float>(k)) * width, knot.thrown[k].wraps,
                  knot.thrown[k].chirality, width);
    }
  }
  const float width = std::max(model.suture.front().thread_radius, seen);
  for (const SettledView& stitch : snapshot.settled) {
    view.through.assign(stitch.node.begin(), stitch.node.end());
    view.node_outside.assign(view.through.size(), kOutside);
    const Vec3 way = stitch.node.size() > 1 ? normalized(stitch.node.back() - stitch.node.front(), {1, 0, 0}) : Vec3{1, 0, 0};
    // It does not say which parts are inside the wall: those that are deeper than a strand on the surface can sink.
    add_lifted_strand(view, {tissue, &motion, &snapshot, SIZE_MAX, width, 0.0009f});
    for (const Vec3& at : stitch.knot) {
      const Vec3 out = normal_at(tissue_at(view.on_tissue, tied++, at, kKnotReach, tissue), tissue, motion);
      add_throw(view, at, way, out, 0.8f * width, 2, 1, width);
      add_throw(view, at, way, out, 3.5f * width, 1, -1, width);
    }
  }
  const uint32_t used = uint32_t(view.curve.size());
  if (used < 2) {
    set_drawn(engine, view.gpu, 0);
    return;
  }
  const Surface surface = new_surface(used * kRing);
  write_tube(view, surface);
  upload_surface(engine, view.gpu, surface, bounds(surface.position));
  set_look(engine, view.gpu, std::span(view.look).first(size_t(used) * kRing));
  set_drawn(engine, view.gpu, (used - 1) * kSides * 2);
}

void set_cloth(ThreadView& view, std::vector<Vec3> position, std::vector<Vec3> normal) {
  view.cloth = std::move(position), view.cloth_normal = std::move(normal);
  view.cloth_grid.build(view.cloth, kClothReach);
}

namespace {

constexpr uint32_t kMostMarks = 96, kMarkSides = 10, kMarkCorners = 1 + 2 * kMarkSides;

}  // namespace

MarkView make_mark_view(filament::Engine& engine, filament::Scene& scene, filament::MaterialInstance* material) {
  MarkView view;
  std::vector<VertexLook> look;
  std::vector<std::array<uint32_t, 3>> triangle;
  const Vec3 hole = srgb(52, 6, 8), bruise = srgb(120, 14, 20);
  for (uint32_t m = 0; m < kMostMarks; ++m) {
    const uint32_t first = m * kMarkCorners;
    for (uint32_t i = 0; i < kMarkCorners; ++i) {
      const Vec3 c = i <= kMarkSides ? hole : bruise;
      look.push_back({{c.x, c.y, c.z, i <= kMarkSides ? 0.82f : 0.0f}, {0, 0}, {1, 0}});
    }
    for (uint32_t k = 0; k < kMarkSides; ++k) {
      const uint32_t a = first + 1 + k, b = first + 1 + (k + 1) % kMarkSides;
      triangle.push_back({first, a, b});
      triangle.push_back({a, a + kMarkSides, b});
      triangle.push_back({b, a + kMarkSides, b + kMarkSides});
    }
  }
  view.gpu = make_mesh(engine, scene, look, triangle, material, false);
  set_drawn(engine, view.gpu, 0);
  return view;
}

namespace {

// What suture points show, then the slits of bites that are torn out. At most kMostMarks; the first ones are kept.
void find_punctures(const Snapshot& snapshot, std::vector<Puncture>& out) {
  out.clear();
  const auto add = [&](const Puncture& p) {
    if (out.size() < kMostMarks && is_finite(p.position) && is_finite(p.made)) out.push_back(p);
  };
  for (const SutureView& suture : snapshot.suture)
    for (const SuturePointView& p : suture.suture_point) {
      const BiteView* bite = p.bite < suture.bite.size() ? &suture.bite[p.bite] : nullptr;
      const bool torn = bite && bite->torn > 0;
      add({p.position,
           !torn    ? p.position
           : p.exit ? bite->exit_made
                    : bite->entry_made,
           std::max(p.tension_needle, p.tension_free)});
    }
  for (const SutureView& suture : snapshot.suture)
    for (const BiteView& bite : suture.bite)
      if (bite.torn_out) add({bite.entry, bite.entry_made, 0}), add({bite.exit, bite.exit_made, 0});
}

}  // namespace

void move_marks(filament::Engine& engine, MarkView& view, const Snapshot& snapshot, std::span<const TissueView> tissue,
                const Motions& motion) {
  find_punctures(snapshot, view.puncture);
  const uint32_t count = uint32_t(view.puncture.size());
  set_drawn(engine, view.gpu, count * kMarkSides * 3);
  if (count == 0) return;
  const Surface surface = new_surface(count * kMarkCorners);
  for (uint32_t m = 0; m < count; ++m) {
    const Puncture& point = view.puncture[m];
    const Nearest at = tissue_at(view.on_tissue, m, point.position, 0.003f, tissue);
    const Vec3 out = normal_at(at, tissue, motion);
    Vec3 center = point.position;
    // On the drawn surface, which may differ slightly from the particles'.
    if (at.body >= 0) center -= out * dot(center - tissue[size_t(at.body)].position[at.vertex], out);
    center += out * 0.00012f;
    // A slit: the far half of the disc lies where the needle went in.
    const Vec3 slit = point.made - point.position, along = slit - out * dot(slit, out);
    const Vec3 x = normalized(along, any_perpendicular(out)), y = cross(out, x);
    // Tension pulls the puncture open.
    const float inner = 0.00017f + 0.00010f * std::min(2.0f, point.pulled);
    for (uint32_t i = 0; i < kMarkCorners; ++i) {
      const float a = 2 * kPi * float((i + kMarkSides - 1) % kMarkSides) / kMarkSides;
      const float r = i == 0 ? 0 : i <= kMarkSides ? inner : 0.00062f;
      const float far = i == 0 ? 0.5f : std::cos(a) > 0 ? 1.0f : 0.0f;
      surface.position[m * kMarkCorners + i] = center + far * along + r * (x * std::cos(a) + y * std::sin(a));
      surface.frame[m * kMarkCorners + i] = pack_frame(Quat{});
    }
  }
  upload_surface(engine, view.gpu, surface, bounds(surface.position));
}

}  // namespace catgut
