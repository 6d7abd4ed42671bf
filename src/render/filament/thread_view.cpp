// render/filament/thread_view: see thread_view.h.
#include "render/filament/thread_view.h"

#include <cmath>

namespace catgut {
namespace {

constexpr int kSides = 8, kPerSpan = 4, kPerTurn = 12;
constexpr uint32_t kRoomForTied = 4000;  // points of the curve for knots and settled stitches; what is beyond is not drawn
const Vec3 kViolet = srgb(88, 58, 190);

// Adds one more piece to the curve. Pieces are joined by points of no width, which cannot be seen.
void add_piece(ThreadView& view, std::span<const Vec3> points, float width) {
  if (points.size() < 2 || view.curve.size() + points.size() + 2 > view.capacity) return;
  if (!view.curve.empty()) {
    view.curve.push_back(view.curve.back());
    view.radius.push_back(0);
    view.curve.push_back(points.front());
    view.radius.push_back(0);
  }
  for (const Vec3& p : points) view.curve.push_back(p), view.radius.push_back(width);
}

void add_strand(ThreadView& view, float width) {
  smooth_curve(view.through, kPerSpan, view.piece);
  add_piece(view, view.piece, width);
  view.through.clear();
}

// One throw: its turns lie round the stitch's two strands, which run along `way`.
void add_throw(ThreadView& view, Vec3 at, Vec3 way, uint32_t wraps, int handed, float width) {
  const Vec3 side = any_perpendicular(way), up = cross(way, side);
  const float turns = static_cast<float>(wraps) + 0.5f, across = 2.6f * width, along = 2.1f * width * turns;
  const int points = static_cast<int>(turns * kPerTurn);
  view.piece.clear();
  for (int i = 0; i <= points; ++i) {
    const float part = static_cast<float>(i) / static_cast<float>(points),
                a = static_cast<float>(handed) * 2 * kPi * turns * part;
    view.piece.push_back(at + side * (across * std::cos(a)) + up * (across * std::sin(a)) + way * (along * (part - 0.5f)));
  }
  add_piece(view, view.piece, 1.15f * width);
}

}  // namespace

ThreadView make_thread_view(filament::Engine& engine, filament::Scene& scene, const PictureModel& model,
                            filament::MaterialInstance* material) {
  ThreadView view;
  if (model.thread_count < 2) return view;
  view.capacity = (model.thread_count - 1) * kPerSpan + 1 + kRoomForTied;
  view.curve.assign(view.capacity, {});
  view.radius.assign(view.capacity, 0);
  add_tube(view.tube, view.curve, view.radius, kSides, kViolet);
  view.gpu = make_mesh(engine, scene, view.tube, material, true);
  return view;
}

void move_thread(filament::Engine& engine, ThreadView& view, const PictureModel& model, const Snapshot& snapshot,
                 const Camera& camera, float pixel) {
  if (view.capacity == 0) return;
  view.curve.clear(), view.radius.clear(), view.through.clear();
  const Vec3 ahead = normalized(camera.target - camera.eye);
  const float width = std::max(model.thread_radius, 0.75f * pixel * std::max(0.0f, dot(camera.target - camera.eye, ahead)));
  for (size_t i = 0; i < snapshot.thread_order.size(); ++i) {
    const uint32_t slot = snapshot.thread_order[i];
    if (slot < snapshot.particle.size() && is_finite(snapshot.particle[slot])) view.through.push_back(snapshot.particle[slot]);
    if (i < snapshot.thread_cut.size() && snapshot.thread_cut[i]) add_strand(view, width);
  }
  add_strand(view, width);
  for (const KnotView& knot : snapshot.knot)
    for (uint32_t k = 0; k < knot.throws; ++k) {
      const Vec3 at = knot.position + Vec3{0, (0.5f + 3.2f * static_cast<float>(k)) * width, 0};
      add_throw(view, at, knot.way, knot.thrown[k].wraps, knot.thrown[k].handed, width);
    }
  for (const SettledView& stitch : snapshot.settled) {
    view.through = stitch.node;
    const Vec3 way = stitch.node.size() > 1 ? normalized(stitch.node.back() - stitch.node.front(), {1, 0, 0}) : Vec3{1, 0, 0};
    add_strand(view, width);
    for (const Vec3& at : stitch.knot) {
      add_throw(view, at + Vec3{0, 0.5f * width, 0}, way, 2, 1, width);
      add_throw(view, at + Vec3{0, 3.7f * width, 0}, way, 1, -1, width);
    }
  }
  if (view.curve.size() < 2) {
    set_drawn(engine, view.gpu, 0);
    return;
  }
  // Unused points stand at the end with no width, so that the mesh keeps its size.
  const size_t used = view.curve.size();
  view.curve.resize(view.capacity, view.curve.back());
  view.radius.resize(view.capacity, 0);
  view.tube.position.clear(), view.tube.normal.clear(), view.tube.tangent.clear(), view.tube.uv.clear();
  view.tube.colour.clear(), view.tube.triangle.clear();
  add_tube(view.tube, view.curve, view.radius, kSides, kViolet);
  set_surface(engine, view.gpu, view.tube.position, view.tube.normal, view.tube.tangent);
  std::vector<VertexLook> look(view.tube.position.size());
  for (size_t i = 0; i < look.size(); ++i)
    look[i] = {{kViolet.x, kViolet.y, kViolet.z, 1}, {view.tube.uv[i][0], view.tube.uv[i][1]}, {1, 0}};
  set_look(engine, view.gpu, look);
  // The triangles lie span after span, the caps last: a shorter thread is drawn without its far cap, which nobody sees.
  set_drawn(engine, view.gpu, uint32_t(used - 1) * kSides * 2);
}

}  // namespace catgut
