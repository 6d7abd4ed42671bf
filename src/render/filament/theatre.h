// render/filament: what is in a picture, however it is shown: theatre light, tissue, thread, needle, tools and drape. Reads the
// PictureModel once and a Snapshot per picture; writes a view of the engine that it was made for.
#pragma once
#include <array>
#include <span>
#include <vector>

#include <filament/Camera.h>
#include <filament/ColorGrading.h>
#include <filament/Engine.h>
#include <filament/Material.h>
#include <filament/Scene.h>
#include <filament/Skybox.h>
#include <filament/View.h>

#include "render/filament/environment.h"
#include "render/filament/mesh.h"
#include "render/filament/thread_view.h"
#include "render/filament/tissue_view.h"
#include "render/renderer.h"

namespace catgut {

struct ToolView3d {
  ToolShape shape;
  std::array<GpuMesh, 3> part;  // body, the half toward +x, the half toward -x
};

class Theatre {
 public:
  Theatre(filament::Engine& engine, const PictureModel& model, Quality quality);
  ~Theatre();
  Theatre(const Theatre&) = delete;
  Theatre& operator=(const Theatre&) = delete;

  // Moves everything to where the snapshot has it; the next frame that renders view() shows it.
  void show(const Snapshot& snapshot, const Camera& camera, int width, int height, bool suture_points);
  // Draws the field with `part` of the picture's points each way and stretches it: for windows on machines without a graphics
  // card.
  void draw_coarser(float part);
  filament::View* view() const { return view_; }

 private:
  void set_quality(Quality quality);
  void set_light(Quality quality);
  filament::MaterialInstance* instance_of(std::span<const uint8_t> package);
  void make_materials();
  void make_stage();
  void move_tool(const ToolView3d& view, const ToolView& tool);
  void show_markers(const Snapshot& snapshot, bool wanted);

  float coarse_ = 1;
  const PictureModel model_;  // a copy: the theatre outlives whatever built it
  filament::Engine& engine_;
  filament::Scene* scene_ = nullptr;
  filament::View* view_ = nullptr;
  filament::Camera* camera_ = nullptr;
  utils::Entity camera_entity_, lamp_;
  filament::ColorGrading* grading_ = nullptr;
  filament::Skybox* skybox_ = nullptr;
  Environment environment_;
  TissueTextures textures_;
  std::vector<filament::Material*> material_;
  filament::MaterialInstance *tissue_material_ = nullptr, *thread_material_ = nullptr, *needle_material_ = nullptr,
                             *tool_material_ = nullptr, *drape_material_ = nullptr, *shadow_material_ = nullptr,
                             *marker_material_ = nullptr;
  std::vector<TissueView> tissue_;
  ThreadView thread_;
  std::array<ToolView3d, 2> tool_;
  GpuMesh needle_, drape_, drape_shadow_, bed_;
  std::vector<GpuMesh> marker_;
};

}  // namespace catgut
