// SPDX-License-Identifier: Apache-2.0
// render/filament: the contents of an image, for any output: theatre light, tissue, thread, needle, tools and drape. Reads the
// PictureModel once and a Snapshot per frame; writes a view of the engine passed to it.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include <filament/Camera.h>
#include <filament/ColorGrading.h>
#include <filament/Engine.h>
#include <filament/LightManager.h>
#include <filament/Material.h>
#include <filament/Scene.h>
#include <filament/Skybox.h>
#include <filament/View.h>

#include "render/assistant.h"
#include "render/filament/environment.h"
#include "render/filament/mesh.h"
#include "render/filament/thread_view.h"
#include "render/filament/tissue_view.h"
#include "render/renderer.h"
#include "render/smoke.h"

namespace catgut {

struct ToolView3d {
  ToolShape shape;
  std::array<GpuMesh, 4> part;  // body, the half toward +x, the half toward -x, gauze
};

class Theatre {
 public:
  // eyes: number of views of the same field, two for a headset.
  Theatre(filament::Engine& engine, const PictureModel& model, Quality quality, int eyes = 1);
  ~Theatre();
  Theatre(const Theatre&) = delete;
  Theatre& operator=(const Theatre&) = delete;

  // Moves everything to the snapshot's state, once for all eyes; the next frame that renders view() shows it. One camera
  // per eye.
  void show(const Snapshot& snapshot, std::span<const Camera> camera, int width, int height, bool suture_points);
  void show(const Snapshot& snapshot, const Camera& camera, int width, int height, bool suture_points) {
    show(snapshot, std::span(&camera, 1), width, height, suture_points);
  }
  // Renders the field at `part` of the resolution in each direction and upscales it: for windows on machines without a graphics
  // card.
  void set_resolution_scale(float part);
  // From the next frame on; the caller renders inset_view() after view(). height: [pixels] of the whole picture.
  void set_inset(const std::optional<Inset>& inset, int height);
  filament::View* inset_view() const { return inset_shown_ ? inset_.view : nullptr; }
  filament::Scene& scene() const { return *scene_; }
  filament::View* view(int eye = 0) const { return eye_[size_t(eye)].view; }

 private:
  struct Eye {
    filament::View* view = nullptr;
    filament::Camera* camera = nullptr;
    utils::Entity entity;
  };
  Eye make_eye(Quality quality);
  void set_quality(filament::View& view, Quality quality);
  void set_light(Quality quality);
  void set_tones();
  filament::MaterialInstance* instance_of(std::span<const uint8_t> package);
  void make_materials();
  void make_stage();
  void make_scenery(std::span<const Vec3> tissue);
  void make_room();
  void make_needles_and_tools();
  void add_tissue(const VisibleMesh& mesh);
  // Rebuilds the tissue's surface after a cut has changed it.
  void follow_topology(const TopologyView& topology);
  void add_cloth(const Shape& cloth, float threads_per_cm, std::span<const Vec3> tissue, bool casts_shadow);
  // Without multisampling a thin wire far away would show as dots, or not at all.
  void widen_needle(size_t i, float least_radius);
  void move_tool(const ToolView3d& view, const InstrumentView& tool);
  ToolView3d make_tool(const InstrumentPicture& instrument);
  void show_scissors(const Snapshot& snapshot);
  void make_smoke();
  void show_smoke(const Snapshot& snapshot, const Camera& camera);
  void show_markers(const Snapshot& snapshot, bool wanted);

  float coarse_ = 1;
  // Low quality in a window: materials of one lamp that convert to the screen's colors themselves, without passes over the
  // whole picture.
  const bool plain_;
  const PictureModel model_;  // a copy: the theatre outlives its source
  SkyCache sky_known_;
  DividedPicture divided_;  // of the snapshot that was shown last; false: model_
  filament::Engine& engine_;
  filament::Scene* scene_ = nullptr;
  std::vector<Eye> eye_;
  Eye inset_;  // made when it is needed
  bool inset_shown_ = false;
  utils::Entity lamp_;
  filament::LightManager::ShadowOptions shadow_;
  filament::ColorGrading* grading_ = nullptr;
  filament::Skybox* skybox_ = nullptr;
  Environment environment_;
  TissueTextures textures_;
  std::vector<filament::Material*> material_;
  filament::MaterialInstance *tissue_material_ = nullptr, *thread_material_ = nullptr, *needle_material_ = nullptr,
                             *tool_material_ = nullptr, *drape_material_ = nullptr, *marker_material_ = nullptr,
                             *mark_material_ = nullptr, *smoke_material_ = nullptr;
  Motions motion_;  // of every particle, in the current frame
  std::vector<TissueView> tissue_;
  ThreadView thread_;
  MarkView mark_;
  std::vector<ToolView3d> tool_;  // like PictureModel::instrument
  ToolView3d scissors_;           // the assistant's; made at the first cut
  CutWatch cuts_;
  std::vector<GpuMesh> needle_;      // per suture
  std::vector<float> needle_least_;  // [m] minimum radius of each as drawn
  GpuMesh bed_;
  std::vector<GpuMesh> scenery_;
  std::vector<GpuMesh> cloth_;
  std::vector<Vec3> cloth_position_, cloth_normal_;  // of all cloth, until the thread has them
  std::vector<GpuMesh> marker_;
  GpuMesh smoke_;  // squares, four vertices each; only of a scene with a pen
  std::vector<Puff> puff_;
  std::vector<VertexLook> puff_look_;
};

}  // namespace catgut
