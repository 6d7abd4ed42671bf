// render/filament/thread_view: see thread_view.h.
#include "render/filament/thread_view.h"

namespace catgut {
namespace {

constexpr int kSides = 8, kPerSpan = 4;
const Vec3 kViolet = srgb(88, 58, 190);

}  // namespace

ThreadView make_thread_view(filament::Engine& engine, filament::Scene& scene, const PictureModel& model,
                            filament::MaterialInstance* material) {
  ThreadView view;
  if (model.thread_count < 2) return view;
  view.capacity = (model.thread_count - 1) * kPerSpan + 1;
  view.curve.assign(view.capacity, {});
  view.radius.assign(view.capacity, 0);
  add_tube(view.tube, view.curve, view.radius, kSides, kViolet);
  view.gpu = make_mesh(engine, scene, view.tube, material, true);
  return view;
}

void move_thread(filament::Engine& engine, ThreadView& view, const PictureModel& model, const Snapshot& snapshot,
                 const Camera& camera, float pixel) {
  if (view.capacity == 0) return;
  view.through.clear();
  for (const uint32_t slot : snapshot.thread_order)
    if (slot < snapshot.particle.size() && is_finite(snapshot.particle[slot])) view.through.push_back(snapshot.particle[slot]);
  smooth_curve(view.through, kPerSpan, view.curve);
  if (view.curve.size() > view.capacity) view.curve.resize(view.capacity);
  if (view.curve.size() < 2) {
    set_drawn(engine, view.gpu, 0);
    return;
  }
  const Vec3 ahead = normalized(camera.target - camera.eye);
  view.radius.resize(view.curve.size());
  for (size_t i = 0; i < view.curve.size(); ++i)
    view.radius[i] = std::max(model.thread_radius, 0.75f * pixel * std::max(0.0f, dot(view.curve[i] - camera.eye, ahead)));
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
