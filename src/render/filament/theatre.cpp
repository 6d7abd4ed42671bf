// SPDX-License-Identifier: Apache-2.0
// render/filament: the contents of an image, for any output. See theatre.h.
#include "render/filament/theatre.h"

#include <algorithm>
#include <utility>

#include <filament/LightManager.h>
#include <filament/RenderableManager.h>
#include <filament/TextureSampler.h>
#include <filament/Viewport.h>
#include <utils/EntityManager.h>

#include "exchange/strand.h"
#include "render/filament/materials.h"
#include "render/room_shape.h"

namespace catgut {
namespace {

// From the main lamp, over the surgeon's right shoulder.
constexpr Vec3 kLampDirection{-0.30f, -1.0f, -0.50f};

// How much of the lamp reaches p past points of tissue, 0..1.
float lit_past(Vec3 p, Vec3 toward_lamp, std::span<const Vec3> tissue) {
  constexpr float dark = 0.002f, bright = 0.007f, beside = 0.003f;  // [m] from the ray; p itself touches what is this near
  float least = bright * bright;
  for (const Vec3 t : tissue) {
    const float along = dot(t - p, toward_lamp);
    if (along > beside) least = std::min(least, length2(t - p) - along * along);
  }
  return std::clamp((std::sqrt(std::max(0.0f, least)) - dark) / (bright - dark), 0.0f, 1.0f);
}

}  // namespace

Theatre::Theatre(filament::Engine& engine, const PictureModel& model, Quality quality, int eyes)
    : plain_(quality == Quality::low && eyes == 1), model_(model), engine_(engine) {
  scene_ = engine_.createScene();
  grading_ = filament::ColorGrading::Builder()
                 .toneMapping(filament::ColorGrading::ToneMapping::ACES)
                 .quality(filament::ColorGrading::QualityLevel::MEDIUM)
                 .build(engine_);
  for (int i = 0; i < eyes; ++i) eye_.push_back(make_eye(quality));
  set_light(quality);
  make_materials();
  make_stage();
  if (eyes > 1) make_room();
  thread_ = make_thread_view(engine_, *scene_, model_, thread_material_);
  set_cloth(thread_, std::move(cloth_position_), std::move(cloth_normal_));
  for (const ToolView3d& tool : tool_) thread_.hull.push_back(tool_hull(tool.shape));
  mark_ = make_mark_view(engine_, *scene_, mark_material_);
  make_smoke();
}

Theatre::~Theatre() {
  for (TissueView& t : tissue_) destroy_mesh(engine_, *scene_, t.gpu);
  for (ToolView3d& t : tool_)
    for (GpuMesh& m : t.part) destroy_mesh(engine_, *scene_, m);
  if (!scissors_.shape.half.position.empty())
    for (GpuMesh& m : scissors_.part) destroy_mesh(engine_, *scene_, m);
  for (GpuMesh& m : scenery_) destroy_mesh(engine_, *scene_, m);
  for (GpuMesh& m : needle_) destroy_mesh(engine_, *scene_, m);
  for (GpuMesh* m : {&bed_, &thread_.gpu, &mark_.gpu, &smoke_}) destroy_mesh(engine_, *scene_, *m);
  for (GpuMesh& m : cloth_) destroy_mesh(engine_, *scene_, m);
  for (GpuMesh& m : marker_) destroy_mesh(engine_, *scene_, m);
  engine_.destroy(tissue_material_);
  engine_.destroy(thread_material_);
  engine_.destroy(needle_material_);
  engine_.destroy(tool_material_);
  engine_.destroy(drape_material_);
  engine_.destroy(marker_material_);
  engine_.destroy(mark_material_);
  engine_.destroy(smoke_material_);
  for (filament::Material* m : material_) engine_.destroy(m);
  engine_.destroy(textures_.pattern);
  engine_.destroy(textures_.bumps);
  engine_.destroy(environment_.light);
  engine_.destroy(environment_.reflections);
  engine_.destroy(skybox_);
  engine_.destroy(grading_);
  engine_.destroy(lamp_);
  utils::EntityManager::get().destroy(lamp_);
  if (inset_.view) eye_.push_back(inset_);
  for (const Eye& eye : eye_) {
    engine_.destroyCameraComponent(eye.entity);
    utils::EntityManager::get().destroy(eye.entity);
    engine_.destroy(eye.view);
  }
  engine_.destroy(scene_);
}

void Theatre::show(const Snapshot& snapshot, std::span<const Camera> cameras, int width, int height, bool suture_points) {
  for (size_t i = 0; i < eye_.size(); ++i) {
    const Camera& camera = cameras[std::min(i, cameras.size() - 1)];
    eye_[i].view->setViewport({0, 0, uint32_t(width), uint32_t(height)});
    const float distance_to_work = std::max(0.01f, distance(camera.eye, camera.target));
    const double near_plane = double(0.1f * distance_to_work);
    if (const Frustum& f = camera.frustum; f.right > f.left) {
      const double far_plane = 12;
      eye_[i].camera->setCustomProjection(
          filament::math::mat4::frustum(near_plane * double(f.left), near_plane * double(f.right), near_plane * double(f.down),
                                        near_plane * double(f.up), near_plane, far_plane),
          near_plane, far_plane);
    } else {
      eye_[i].camera->setProjection(double(camera.fov_deg), double(width) / height, near_plane, 3.0,
                                    filament::Camera::Fov::VERTICAL);
    }
    eye_[i].camera->lookAt({camera.eye.x, camera.eye.y, camera.eye.z}, {camera.target.x, camera.target.y, camera.target.z},
                           {camera.up.x, camera.up.y, camera.up.z});
  }
  // Shadows only a little beyond the work: the map's resolution is used where it is visible.
  filament::LightManager& lights = engine_.getLightManager();
  shadow_.shadowFar = 3.2f * std::max(0.05f, distance(cameras[0].eye, cameras[0].target));
  lights.setShadowOptions(lights.getInstance(lamp_), shadow_);
  const Frustum& seen = cameras[0].frustum;
  const float tall = seen.right > seen.left ? seen.up - seen.down : 2 * std::tan(0.5f * cameras[0].fov_deg * kPi / 180);
  const float pixel = tall / (coarse_ * float(height));

  follow_topology(snapshot.topology);
  find_motion((divided_ ? *divided_ : model_).particle_rest, snapshot.particle, snapshot.rotation, motion_);
  for (TissueView& t : tissue_) move_tissue(engine_, t, motion_, snapshot);
  move_thread(engine_, thread_, model_, snapshot, tissue_, motion_, cameras[0], pixel);
  move_marks(engine_, mark_, snapshot, tissue_, motion_);
  const Vec3 ahead = normalized(cameras[0].target - cameras[0].eye, {0, 0, -1});
  for (size_t i = 0; i < std::min(needle_.size(), snapshot.suture.size()); ++i) {
    const Pose& pose = snapshot.suture[i].needle.pose;
    catgut::set_pose(engine_, needle_[i], pose);
    if (is_finite(pose.p)) widen_needle(i, 0.9f * pixel * std::max(0.0f, dot(pose.p - cameras[0].eye, ahead)));
  }
  for (size_t i = 0; i < std::min(tool_.size(), snapshot.instrument.size()); ++i) move_tool(tool_[i], snapshot.instrument[i]);
  show_scissors(snapshot);
  show_markers(snapshot, suture_points);
  show_smoke(snapshot, cameras[0]);
}

void Theatre::add_tissue(const VisibleMesh& mesh) {
  tissue_.push_back(make_tissue_view(engine_, *scene_, mesh, tissue_material_, sky_known_));
  filament::RenderableManager& manager = engine_.getRenderableManager();
  // Two thirds of the shadow map's cost. Its shadow on cloth is computed once instead, see add_cloth.
  if (plain_) manager.setCastShadows(manager.getInstance(tissue_.back().gpu.entity), false);
}

void Theatre::follow_topology(const TopologyView& topology) {
  if (topology.picture == divided_) return;
  divided_ = topology.picture;
  for (TissueView& t : tissue_) destroy_mesh(engine_, *scene_, t.gpu);
  tissue_.clear();
  for (const VisibleMesh& mesh : (divided_ ? *divided_ : model_).body) add_tissue(mesh);
  // They refer to vertices of the old surface.
  thread_.on_tissue.clear();
  mark_.on_tissue.clear();
  motion_ = {};
}

void Theatre::set_resolution_scale(float part) {
  coarse_ = part;
  filament::View::DynamicResolutionOptions coarse;
  coarse.enabled = part < 1;
  coarse.homogeneousScaling = true;
  coarse.minScale = coarse.maxScale = {part, part};
  coarse.quality = filament::View::QualityLevel::LOW;
  for (const Eye& eye : eye_) eye.view->setDynamicResolutionOptions(coarse);
  if (plain_) set_tones();
}

void Theatre::set_inset(const std::optional<Inset>& inset, int height) {
  const bool shown = inset.has_value() && inset->side > 0;
  if (shown) {
    if (!inset_.view) {
      inset_ = make_eye(Quality::low);
      inset_.view->setSampleCount(4);
      inset_.view->setShadowingEnabled(false);  // each view with shadows draws its own shadow map
    }
    const int low = height - inset->y - inset->side;
    inset_.view->setViewport({inset->x, low, uint32_t(inset->side), uint32_t(inset->side)});
    const Camera& c = inset->camera;
    inset_.camera->setProjection(double(c.fov_deg), 1.0, double(0.1f * std::max(0.01f, distance(c.eye, c.target))), 3.0,
                                 filament::Camera::Fov::VERTICAL);
    inset_.camera->lookAt({c.eye.x, c.eye.y, c.eye.z}, {c.target.x, c.target.y, c.target.z}, {c.up.x, c.up.y, c.up.z});
  }
  if (std::exchange(inset_shown_, shown) != shown && plain_) set_tones();
}

// Scaling needs post-processing, which converts tones as well. So does a second view: without, its beginning clears the first.
void Theatre::set_tones() {
  const bool whole = coarse_ >= 1 && !inset_shown_;
  eye_[0].view->setPostProcessingEnabled(!whole);
  for (filament::MaterialInstance* m : {tissue_material_, thread_material_, needle_material_, tool_material_, drape_material_,
                                        marker_material_, mark_material_, smoke_material_})
    m->setParameter("tones", whole ? 1.0f : 0.0f);
}

Theatre::Eye Theatre::make_eye(Quality quality) {
  Eye eye{engine_.createView(), nullptr, utils::EntityManager::get().create()};
  eye.camera = engine_.createCamera(eye.entity);
  eye.view->setScene(scene_);
  eye.view->setCamera(eye.camera);
  set_quality(*eye.view, quality);
  return eye;
}

void Theatre::set_quality(filament::View& view, Quality quality) {
  const bool good = quality == Quality::high;
  view.setSampleCount(quality == Quality::low ? 1 : 4);
  view.setAntiAliasing(plain_ ? filament::View::AntiAliasing::NONE : filament::View::AntiAliasing::FXAA);
  view.setDithering(filament::View::Dithering::NONE);
  filament::View::AmbientOcclusionOptions ao;
  ao.enabled = good;
  ao.radius = 0.006f;
  ao.bias = 0.0002f;
  ao.intensity = 0.8f;
  ao.power = 1.2f;
  ao.quality = filament::View::QualityLevel::MEDIUM;
  view.setAmbientOcclusionOptions(ao);
  filament::View::BloomOptions bloom;
  // Never off: without it Filament does color grading inside the main pass by framebuffer fetch, which Mesa's software
  // rasterizer gets wrong (the image turns into colored tiles). A tiny one takes no measurable time.
  bloom.enabled = true;
  bloom.strength = good ? 0.06f : 0.02f;
  bloom.resolution = good ? 360 : 16;
  bloom.levels = good ? 4 : 3;
  view.setBloomOptions(bloom);
  view.setColorGrading(grading_);
}

void Theatre::set_light(Quality quality) {
  environment_ = make_environment(engine_, 44000);
  scene_->setIndirectLight(environment_.light);
  skybox_ = filament::Skybox::Builder().color({0.012f, 0.03f, 0.028f, 1}).build(engine_);
  scene_->setSkybox(skybox_);
  // Shadows at the scale of a thread: the library's default bias of a millimeter would suppress thread and needle shadows.
  filament::LightManager::ShadowOptions& shadow = shadow_;
  shadow.mapSize = quality == Quality::low ? 1024 : quality == Quality::medium ? 2048 : 4096;
  shadow.constantBias = 0.0002f;
  shadow.normalBias = 0.8f;
  lamp_ = utils::EntityManager::get().create();
  filament::LightManager::Builder(filament::LightManager::Type::DIRECTIONAL)
      .color({1.0f, 0.965f, 0.91f})
      .intensity(64000)
      .direction({kLampDirection.x, kLampDirection.y, kLampDirection.z})
      .castShadows(true)
      .shadowOptions(shadow)
      .build(engine_, lamp_);
  scene_->addEntity(lamp_);
}

filament::MaterialInstance* Theatre::instance_of(std::span<const uint8_t> package) {
  material_.push_back(filament::Material::Builder().package(package.data(), package.size()).build(engine_));
  return material_.back()->createInstance();
}

void Theatre::make_materials() {
  textures_ = make_tissue_textures(engine_);
  filament::TextureSampler repeat(plain_ ? filament::TextureSampler::MinFilter::LINEAR_MIPMAP_NEAREST
                                         : filament::TextureSampler::MinFilter::LINEAR_MIPMAP_LINEAR,
                                  filament::TextureSampler::MagFilter::LINEAR, filament::TextureSampler::WrapMode::REPEAT);
  tissue_material_ = instance_of(plain_ ? tissue_low_material() : tissue_material());
  tissue_material_->setParameter("pattern", textures_.pattern, repeat);
  tissue_material_->setParameter("bumps", textures_.bumps, repeat);
  const Vec3 lamp = normalized(-kLampDirection);
  tissue_material_->setParameter("lamp", filament::math::float3{lamp.x, lamp.y, lamp.z});
  thread_material_ = instance_of(plain_ ? thread_low_material() : thread_material());
  needle_material_ = instance_of(plain_ ? metal_low_material() : metal_material());
  needle_material_->setParameter("roughness", 0.22f);
  tool_material_ = material_.back()->createInstance();
  tool_material_->setParameter("roughness", 0.34f);
  drape_material_ = instance_of(drape_material());
  marker_material_ = instance_of(marker_material());
  mark_material_ = instance_of(mark_material());
  smoke_material_ = instance_of(smoke_material());
  if (!plain_) return;
  for (filament::MaterialInstance* m : {thread_material_, needle_material_, tool_material_})
    m->setParameter("lamp", filament::math::float3{lamp.x, lamp.y, lamp.z});
  set_tones();
}

void Theatre::make_stage() {
  std::vector<Vec3> all;
  for (const VisibleMesh& mesh : model_.body) {
    add_tissue(mesh);
    all.insert(all.end(), mesh.position.begin(), mesh.position.end());
  }
  if (!model_.scenery.empty()) {
    make_scenery(all);
    make_needles_and_tools();
    return;
  }
  // The drape's height is the model's. An organ that protrudes has a hole with a clearance of a centimeter; one that lies on it
  // is held by gauze at its far end.
  Vec3 ground{model_.focus.x, model_.drape, model_.focus.z};
  std::vector<Vec3> through, sample;
  for (const Vec3 p : all)
    if (std::abs(p.y - ground.y) < 0.005f) through.push_back(p);
  for (size_t i = 0; i < all.size(); i += 12) sample.push_back(all[i]);
  float hole = 0;
  if (!through.empty()) {
    const Box3 box = bounds(through);
    ground.x = 0.5f * (box.low.x + box.high.x);
    ground.z = 0.5f * (box.low.z + box.high.z);
    for (const Vec3 p : through) hole = std::max(hole, std::hypot(p.x - ground.x, p.z - ground.z));
    hole += 0.01f;
    bed_ = make_mesh(engine_, *scene_, wound_bed_shape(ground - Vec3{0, 0.0035f, 0}, hole), tissue_material_, false, true);
  }
  add_cloth(drape_shape(ground, hole, 0.7f), 22, sample, false);
  for (const VisibleMesh& mesh : model_.body) {
    if (!through.empty() || mesh.position.empty()) continue;
    const Box3 box = bounds(mesh.position);
    const Vec3 middle = 0.5f * (box.low + box.high), way = middle - model_.focus;
    const Vec3 away =
        std::abs(way.x) > std::abs(way.z) ? Vec3{std::copysign(1.0f, way.x), 0, 0} : Vec3{0, 0, std::copysign(1.0f, way.z)};
    add_cloth(swab_shape(mesh.position, away, ground.y), 14, sample, true);
    add_cloth(cushion_shape(middle, away, -0.022f, 0.03f, box.low.y + 0.001f, ground.y), 14, sample, true);
  }
  make_needles_and_tools();
}

void Theatre::make_scenery(std::span<const Vec3> tissue) {
  std::vector<Vec3> sample;
  for (size_t i = 0; i < tissue.size(); i += 12) sample.push_back(tissue[i]);
  for (const Scenery& part : model_.scenery) {
    Shape shape;
    shape.position = part.position, shape.normal = part.normal, shape.color = part.color;
    shape.uv = part.uv, shape.triangle = part.triangle;
    for (const Vec3 n : part.normal) shape.tangent.push_back(any_perpendicular(n));
    switch (part.kind) {
      case SceneryKind::skin:
        add_cloth(shape, 0, sample, false);
        break;
      case SceneryKind::drape:
        add_cloth(shape, 22, sample, false);
        break;
      case SceneryKind::anoderm:
        scenery_.push_back(make_mesh(engine_, *scene_, shape, tissue_material_, true, true));
        break;
      case SceneryKind::steel:
        scenery_.push_back(make_mesh(engine_, *scene_, shape, tool_material_, true));
        break;
      case SceneryKind::elastic:
        scenery_.push_back(make_mesh(engine_, *scene_, shape, thread_material_, true));
        break;
    }
  }
}

// Only for a headset: a window's camera stays near the field.
void Theatre::make_room() {
  const Shape room =
      room_shape({model_.focus.x, model_.drape, model_.focus.z}, normalized(-kLampDirection), model_.scenery.empty());
  scenery_.push_back(make_mesh(engine_, *scene_, room, marker_material_, false));
}

void Theatre::make_needles_and_tools() {
  for (const SuturePicture& suture : model_.suture)
    needle_.push_back(make_mesh(engine_, *scene_, needle_shape(suture), needle_material_, true));
  for (const InstrumentPicture& instrument : model_.instrument) tool_.push_back(make_tool(instrument));
}

ToolView3d Theatre::make_tool(const InstrumentPicture& instrument) {
  ToolView3d tool;
  tool.shape = tool_shape(instrument);
  tool.part = {make_mesh(engine_, *scene_, tool.shape.body, tool_material_, true),
               make_mesh(engine_, *scene_, tool.shape.half, tool_material_, true),
               make_mesh(engine_, *scene_, mirrored_x(tool.shape.half), tool_material_, true),
               make_mesh(engine_, *scene_, tool.shape.gauze, thread_material_, true)};
  return tool;
}

void Theatre::show_scissors(const Snapshot& snapshot) {
  const std::optional<InstrumentView> seen = assistants_scissors(cuts_, model_, snapshot);
  if (seen && scissors_.shape.half.position.empty()) {
    InstrumentPicture kind;
    kind.kind = "scissors";
    scissors_ = make_tool(kind);
  }
  if (scissors_.shape.half.position.empty()) return;
  for (const GpuMesh& m : scissors_.part) {
    scene_->remove(m.entity);
    if (seen) scene_->addEntity(m.entity);
  }
  if (seen) move_tool(scissors_, *seen);
}

// A cloth's share of lamp and room light, computed once (see drape.mat): the room is darker low down beside tissue.
void Theatre::add_cloth(const Shape& cloth, float threads_per_cm, std::span<const Vec3> tissue, bool casts_shadow) {
  std::vector<VertexLook> look(cloth.position.size());
  const Vec3 toward = normalized(-kLampDirection);
  for (size_t i = 0; i < look.size(); ++i) {
    const Vec3 c = cloth.color[i], p = cloth.position[i], n = cloth.normal[i];
    float near = 1;
    for (const Vec3 t : tissue) near = std::min(near, length2(t - p));
    const float open = 1 - 0.5f * std::exp(-std::sqrt(near) / 0.012f);
    const float lamp = 0.86f * std::max(0.0f, dot(n, toward)) * (plain_ ? lit_past(p, toward, tissue) : 1),
                room = 0.42f * open * (0.5f + 0.5f * n.y);
    look[i] = {{c.x, c.y, c.z, threads_per_cm}, {cloth.uv[i][0], cloth.uv[i][1]}, {lamp + room, lamp / (lamp + room)}};
  }
  cloth_position_.insert(cloth_position_.end(), cloth.position.begin(), cloth.position.end());
  cloth_normal_.insert(cloth_normal_.end(), cloth.normal.begin(), cloth.normal.end());
  cloth_.push_back(make_mesh(engine_, *scene_, cloth, drape_material_, casts_shadow));
  set_look(engine_, cloth_.back(), look);
}

void Theatre::widen_needle(size_t i, float least_radius) {
  needle_least_.resize(needle_.size(), 0);
  const SuturePicture& suture = model_.suture[i];
  if (least_radius <= suture.needle_wire_radius) least_radius = 0;
  if (std::abs(least_radius - needle_least_[i]) <= 0.1f * needle_least_[i]) return;
  needle_least_[i] = least_radius;
  const Shape shape = needle_shape(suture, least_radius);
  set_surface(engine_, needle_[i], shape.position, shape.normal, shape.tangent);
}

void Theatre::move_tool(const ToolView3d& view, const InstrumentView& tool) {
  for (const size_t fixed : {0u, 3u}) catgut::set_pose(engine_, view.part[fixed], tool.pose);
  for (const float side : {1.0f, -1.0f}) {
    // The jaws lie on the -z side of the hinge: rotation about +y moves points at -z toward -x.
    const Quat turn = axis_angle({0, 1, 0}, -side * view.shape.opening * std::clamp(tool.jaw, 0.0f, 1.0f));
    const Pose hinge{Vec3{0, 0, view.shape.pivot} - rotate(turn, {0, 0, view.shape.pivot}), turn};
    catgut::set_pose(engine_, view.part[side > 0 ? 1 : 2], tool.pose * hinge);
  }
}

void Theatre::make_smoke() {
  if (std::none_of(model_.instrument.begin(), model_.instrument.end(), [](const auto& i) { return i.can(kCauterize); })) return;
  puff_look_.assign(4 * kMostPuffs, {{0.58f, 0.58f, 0.56f, 0}, {0, 0}, {0, 0}});
  std::vector<std::array<uint32_t, 3>> triangle;
  for (uint32_t k = 0; k < kMostPuffs; ++k) {
    for (uint32_t c = 0; c < 4; ++c)
      puff_look_[4 * k + c].uv0[0] = c == 1 || c == 2 ? 1.0f : 0.0f, puff_look_[4 * k + c].uv0[1] = c >= 2 ? 1.0f : 0.0f;
    triangle.push_back({4 * k, 4 * k + 1, 4 * k + 2}), triangle.push_back({4 * k, 4 * k + 2, 4 * k + 3});
  }
  smoke_ = make_mesh(engine_, *scene_, puff_look_, triangle, smoke_material_, false);
  scene_->remove(smoke_.entity);
}

void Theatre::show_smoke(const Snapshot& snapshot, const Camera& camera) {
  if (!smoke_.vertices) return;
  smoke_of(snapshot, puff_);
  scene_->remove(smoke_.entity);
  if (puff_.empty()) return;
  scene_->addEntity(smoke_.entity);
  const Vec3 ahead = normalized(camera.target - camera.eye, {0, 0, -1});
  const Vec3 right = normalized(cross(ahead, camera.up), any_perpendicular(ahead)), up = cross(right, ahead);
  // Far ones first: each hides what is behind it.
  std::sort(puff_.begin(), puff_.end(), [&](const Puff& a, const Puff& b) { return dot(a.at, ahead) > dot(b.at, ahead); });
  const Surface s = new_surface(4 * kMostPuffs);
  const PackedFrame frame = pack_frame(frame_of(-ahead, right));
  for (size_t i = 0; i < 4 * kMostPuffs; ++i) {
    const Puff& p = puff_[std::min(i / 4, puff_.size() - 1)];
    const float x = puff_look_[i].uv0[0] - 0.5f, y = puff_look_[i].uv0[1] - 0.5f;
    s.position[i] = p.at + (right * x + up * y) * (2 * p.radius), s.frame[i] = frame;
    puff_look_[i].color[3] = i / 4 < puff_.size() ? p.alpha : 0;
  }
  upload_surface(engine_, smoke_, s, bounds(s.position));
  set_look(engine_, smoke_, puff_look_);
  set_drawn(engine_, smoke_, static_cast<uint32_t>(2 * puff_.size()));
}

// Markers follow the suture points; they are few, so each is a separate drawable, hidden when unused.
void Theatre::show_markers(const Snapshot& snapshot, bool wanted) {
  const size_t count = wanted ? suture_point_count(snapshot) : 0;
  while (marker_.size() < 2 * count) {
    Shape ball;
    add_ball(ball, {}, 0.00045f, marker_.size() % 2 ? srgb(60, 220, 235) : srgb(250, 215, 60));
    marker_.push_back(make_mesh(engine_, *scene_, ball, marker_material_, false));
  }
  for (size_t i = 0; i < marker_.size(); ++i) {
    const bool shown = i / 2 < count && suture_point_at(snapshot, i / 2).exit == (i % 2 == 1);
    scene_->remove(marker_[i].entity);
    if (!shown) continue;
    catgut::set_pose(engine_, marker_[i], {suture_point_at(snapshot, i / 2).position, {}});
    scene_->addEntity(marker_[i].entity);
  }
}

}  // namespace catgut
