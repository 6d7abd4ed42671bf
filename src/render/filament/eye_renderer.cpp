// SPDX-License-Identifier: Apache-2.0
// render: the Filament renderer for a headset; see render/eyes.h. Two OpenGL contexts share their textures: Filament's own, on
// its thread, and the one that the headset's runtime receives, on the caller's thread.
#include "render/eyes.h"

#include <X11/Xlib.h>
#include <epoxy/egl.h>
#include <epoxy/glx.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <vector>

#undef None
#undef Status
#undef Success

#include <filagui/ImGuiHelper.h>
#include <filament/Engine.h>
#include <filament/MaterialInstance.h>
#include <filament/RenderTarget.h>
#include <filament/Renderer.h>
#include <filament/SwapChain.h>
#include <filament/Texture.h>
#include <filament/TextureSampler.h>
#include <filament/TransformManager.h>
#include <filament/View.h>
#include <filament/Viewport.h>
#include <imgui.h>
#include <math/mat4.h>
#include <utils/EntityManager.h>

#include "render/filament/egl_platform.h"
#include "render/filament/materials.h"
#include "render/filament/start_engine.h"
#include "render/filament/theatre.h"

namespace catgut {
namespace {

using filament::Texture;

// Boards and labels are parts of one picture: the panels above, below them a grid of labels.
constexpr int kSheetHeight = 1024, kLabelColumns = EyeRenderer::kBoardWidth / EyeRenderer::kLabelWidth;  // [pixels]
static_assert(kSheetHeight - EyeRenderer::kBoardHeight >=
              int(EyeRenderer::kMostLabels) / kLabelColumns * EyeRenderer::kLabelHeight);
const Vec3 kYellow = srgb(250, 215, 60), kCyan = srgb(60, 220, 235);  // entry and exit, as in theatre.cpp
constexpr float kRod = 0.012f;                                        // of a label's width: thickness of its rods
constexpr float kShell = 0.5f;  // [m] half width of the box around the head that fades the picture

// The runtime's context; Filament's engine shares its textures.
class Context {
 public:
  virtual ~Context() = default;
  virtual GlHandles handles() const = 0;
  virtual void make_current() = 0;
  virtual filament::Engine* start() = 0;
};

class EglContext final : public Context {
 public:
  EglContext() : pair_(make_egl_pair()) { make_current(); }
  ~EglContext() override {
    eglMakeCurrent(pair_.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroySurface(pair_.display, pair_.surface);
    eglDestroyContext(pair_.display, pair_.context);
  }
  GlHandles handles() const override {
    GlHandles h;
    h.display = pair_.display, h.config = pair_.config, h.context = pair_.context;
    h.get_proc_address = &address;
    return h;
  }
  void make_current() override {
    eglBindAPI(EGL_OPENGL_API);
    eglMakeCurrent(pair_.display, pair_.surface, pair_.surface, pair_.context);
  }
  filament::Engine* start() override { return start_engine(*pair_.platform); }

 private:
  static void (*address(const char* name))() { return eglGetProcAddress(name); }
  EglPair pair_;
};

class GlxContext final : public Context {
 public:
  GlxContext() : display_(XOpenDisplay(nullptr)) {
    if (!display_) throw std::runtime_error("no X server answers");
    const int wanted[] = {GLX_DRAWABLE_TYPE,
                          GLX_PBUFFER_BIT | GLX_WINDOW_BIT,
                          GLX_RENDER_TYPE,
                          GLX_RGBA_BIT,
                          GLX_RED_SIZE,
                          8,
                          GLX_GREEN_SIZE,
                          8,
                          GLX_BLUE_SIZE,
                          8,
                          GLX_DEPTH_SIZE,
                          24,
                          GLX_DOUBLEBUFFER,
                          True,
                          0};
    int count = 0;
    GLXFBConfig* configs = glXChooseFBConfig(display_, DefaultScreen(display_), wanted, &count);
    if (configs && count > 0) config_ = configs[0];
    if (configs) XFree(configs);
    const int core[] = {GLX_CONTEXT_MAJOR_VERSION_ARB,    4, GLX_CONTEXT_MINOR_VERSION_ARB, 1, GLX_CONTEXT_PROFILE_MASK_ARB,
                        GLX_CONTEXT_CORE_PROFILE_BIT_ARB, 0};
    if (config_) context_ = glXCreateContextAttribsARB(display_, config_, nullptr, True, core);
    if (!context_) {
      XCloseDisplay(display_);
      throw std::runtime_error("the X server has no OpenGL 4.1 core");
    }
    const int size[] = {GLX_PBUFFER_WIDTH, 1, GLX_PBUFFER_HEIGHT, 1, 0};
    drawable_ = glXCreatePbuffer(display_, config_, size);
    make_current();
  }
  ~GlxContext() override {
    glXMakeContextCurrent(display_, 0, 0, nullptr);
    glXDestroyContext(display_, context_);
    glXDestroyPbuffer(display_, drawable_);
    XCloseDisplay(display_);
  }
  GlHandles handles() const override {
    GlHandles h;
    h.binding = GlBinding::xlib;
    h.display = display_, h.config = config_, h.context = context_, h.drawable = drawable_;
    int visual = 0;
    glXGetFBConfigAttrib(display_, config_, GLX_VISUAL_ID, &visual);
    h.visual = static_cast<uint32_t>(visual);
    return h;
  }
  void make_current() override { glXMakeContextCurrent(display_, drawable_, drawable_, context_); }
  filament::Engine* start() override { return start_engine_on_glx(context_); }

 private:
  Display* display_;
  GLXFBConfig config_ = nullptr;
  GLXContext context_ = nullptr;
  GLXPbuffer drawable_ = 0;
};

// ImGui has one current context; the window's must be the current one outside this room.
class BoardContext {
 public:
  explicit BoardContext(ImGuiContext* own) : was_(ImGui::GetCurrentContext()) { ImGui::SetCurrentContext(own); }
  ~BoardContext() { ImGui::SetCurrentContext(was_); }
  BoardContext(const BoardContext&) = delete;
  BoardContext& operator=(const BoardContext&) = delete;

 private:
  ImGuiContext* was_;
};

class FilamentEyes final : public EyeRenderer {
 public:
  FilamentEyes(std::unique_ptr<Context> context, const std::string& font)
      : context_(std::move(context)), engine_(context_->start()) {
    chain_ = engine_->createSwapChain(1u, 1u);
    renderer_ = engine_->createRenderer();
    make_board(font);
    make_lobby();
    context_->make_current();
  }
  ~FilamentEyes() override {
    drop_images();
    theatre_.reset();
    {
      const BoardContext own(imgui_);
      panels_.reset();  // destroys the ImGui context
    }
    for (GpuMesh* mesh : {&board_, &caption_, &ray_, &shell_}) destroy_mesh(*engine_, *lobby_, *mesh);
    for (LabelMesh& label : label_)
      for (GpuMesh* mesh : {&label.square, &label.rod[0], &label.rod[1]}) destroy_mesh(*engine_, *lobby_, *mesh);
    for (filament::MaterialInstance* look : {board_look_, ray_look_, shell_look_}) engine_->destroy(look);
    for (filament::Material* m : material_) engine_->destroy(m);
    engine_->destroy(panel_target_);
    engine_->destroy(panel_texture_);
    engine_->destroy(panel_view_);
    for (size_t i = 0; i < 2; ++i) {
      engine_->destroyCameraComponent(lobby_entity_[i]);
      utils::EntityManager::get().destroy(lobby_entity_[i]);
      engine_->destroy(lobby_view_[i]);
    }
    engine_->destroy(lobby_sky_);
    engine_->destroy(lobby_);
    engine_->destroy(renderer_);
    engine_->destroy(chain_);
    filament::Engine::destroy(&engine_);
  }

  GlHandles handles() const override { return context_->handles(); }
  void make_current() override { context_->make_current(); }

  void set_images(int eye, std::span<const uint32_t> texture, int width, int height) override {
    Images& images = images_[static_cast<size_t>(eye)];
    images.width = width, images.height = height;
    images.depth = Texture::Builder()
                       .width(uint32_t(width))
                       .height(uint32_t(height))
                       .levels(1)
                       .usage(Texture::Usage::DEPTH_ATTACHMENT)
                       .format(Texture::InternalFormat::DEPTH24)
                       .build(*engine_);
    for (const uint32_t name : texture) {
      images.color.push_back(Texture::Builder()
                                 .width(uint32_t(width))
                                 .height(uint32_t(height))
                                 .levels(1)
                                 .usage(Texture::Usage::COLOR_ATTACHMENT | Texture::Usage::SAMPLEABLE)
                                 .format(Texture::InternalFormat::SRGB8_A8)
                                 .import(name)
                                 .build(*engine_));
      images.target.push_back(filament::RenderTarget::Builder()
                                  .texture(filament::RenderTarget::AttachmentPoint::COLOR, images.color.back())
                                  .texture(filament::RenderTarget::AttachmentPoint::DEPTH, images.depth)
                                  .build(*engine_));
    }
  }

  void drop_images() override {
    for (int i = 0; i < 2; ++i) {
      if (theatre_) theatre_->view(i)->setRenderTarget(nullptr);
      lobby_view_[size_t(i)]->setRenderTarget(nullptr);
      Images& images = images_[size_t(i)];
      for (filament::RenderTarget* t : images.target) engine_->destroy(t);
      for (Texture* t : images.color) engine_->destroy(t);
      if (images.depth) engine_->destroy(images.depth);
      images = {};
    }
    engine_->flushAndWait();
  }

  void stage(const PictureModel* model, Quality quality) override {
    hide_board();
    theatre_.reset();
    if (model) theatre_ = std::make_unique<Theatre>(*engine_, *model, quality, 2);
  }

  bool draw(const Frame& frame) override {
    for (size_t i = 0; i < 2; ++i)
      if (frame.image[i] >= images_[i].target.size()) return false;
    // Before the frame begins: the engine uploads parameters then. Light as it is seen is about the square root of light as it
    // is calculated.
    shell_look_->setParameter("dark", 1 - frame.brightness * frame.brightness);
    bool begun = false;
    for (int i = 0; i < 20 && !begun; ++i)
      if (!(begun = renderer_->beginFrame(chain_))) engine_->flushAndWait();
    if (!begun) return false;
    const bool field = theatre_ && frame.snapshot;
    if (field) theatre_->show(*frame.snapshot, frame.camera, frame.width, frame.height, frame.suture_points);
    filament::Scene& scene = field ? theatre_->scene() : *lobby_;
    place_board(frame, scene);
    place_labels(frame, scene);
    fade(frame, scene);
    if ((frame.board || frame.caption || !frame.label.empty()) && frame.panels) draw_panels(frame);
    for (size_t i = 0; i < 2; ++i) {
      filament::View* view = field ? theatre_->view(int(i)) : lobby_view_[i];
      if (!field) aim_lobby(i, frame);
      view->setRenderTarget(images_[i].target[frame.image[i]]);
      renderer_->render(view);
      if (!frame.copy) continue;
      Image& image = (*frame.copy)[i];
      image = make_image(frame.width, frame.height, {0, 0, 0, 255});
      renderer_->readPixels(images_[i].target[frame.image[i]], 0, 0, uint32_t(frame.width), uint32_t(frame.height),
                            {image.rgba.data(), image.rgba.size(), Texture::Format::RGBA, Texture::Type::UBYTE});
    }
    // On GLX nothing else waits for the last pixel before the runtime reads the images; see also egl_platform.cpp.
    if (!frame.copy && handles().binding == GlBinding::xlib)
      renderer_->readPixels(images_[1].target[frame.image[1]], 0, 0, 1, 1,
                            {one_pixel_.data(), one_pixel_.size(), Texture::Format::RGBA, Texture::Type::UBYTE});
    renderer_->endFrame();
    engine_->flushAndWait();
    if (frame.copy)
      for (Image& image : *frame.copy)
        for (size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    return true;
  }

 private:
  struct Images {
    std::vector<Texture*> color;
    std::vector<filament::RenderTarget*> target;
    Texture* depth = nullptr;
    int width = 0, height = 0;
  };

  struct LabelMesh {
    GpuMesh square;
    std::array<GpuMesh, 2> rod;
  };

  void make_board(const std::string& font) {
    panel_texture_ = Texture::Builder()
                         .width(kBoardWidth)
                         .height(kSheetHeight)
                         .levels(5)
                         .usage(Texture::Usage::COLOR_ATTACHMENT | Texture::Usage::SAMPLEABLE)
                         .format(Texture::InternalFormat::RGBA8)
                         .build(*engine_);
    panel_target_ = filament::RenderTarget::Builder()
                        .texture(filament::RenderTarget::AttachmentPoint::COLOR, panel_texture_)
                        .build(*engine_);
    panel_view_ = engine_->createView();
    panel_view_->setPostProcessingEnabled(false);
    panel_view_->setShadowingEnabled(false);
    panel_view_->setBlendMode(filament::View::BlendMode::OPAQUE);
    panel_view_->setViewport({0, 0, kBoardWidth, kSheetHeight});
    panel_view_->setRenderTarget(panel_target_);
    imgui_ = ImGui::CreateContext();
    const BoardContext own(imgui_);
    panels_ = std::make_unique<filagui::ImGuiHelper>(engine_, panel_view_, utils::Path(), imgui_);
    ImFontAtlas& letters = *ImGui::GetIO().Fonts;
    letters.Clear();
    ImFontConfig built_in;
    built_in.SizePixels = kBoardText;
    if (!font.empty() && std::filesystem::exists(font)) letters.AddFontFromFileTTF(font.c_str(), kBoardText);
    else letters.AddFontDefault(&built_in);
    panels_->createAtlasTexture(engine_);
    panels_->setDisplaySize(kBoardWidth, kSheetHeight);
    ImGui::GetIO().MouseDrawCursor = true;
    ImGui::GetIO().IniFilename = nullptr;
  }

  void make_lobby() {
    lobby_ = engine_->createScene();
    lobby_sky_ = filament::Skybox::Builder().color({0.012f, 0.03f, 0.028f, 1}).build(*engine_);
    lobby_->setSkybox(lobby_sky_);
    for (size_t i = 0; i < 2; ++i) {
      lobby_entity_[i] = utils::EntityManager::get().create();
      lobby_camera_[i] = engine_->createCamera(lobby_entity_[i]);
      lobby_view_[i] = engine_->createView();
      lobby_view_[i]->setScene(lobby_);
      lobby_view_[i]->setCamera(lobby_camera_[i]);
      lobby_view_[i]->setShadowingEnabled(false);
      filament::View::BloomOptions bloom;  // never off, see theatre.cpp
      bloom.enabled = true;
      bloom.strength = 0.02f, bloom.resolution = 16, bloom.levels = 3;
      lobby_view_[i]->setBloomOptions(bloom);
    }
    board_look_ = instance_of(board_material());
    filament::TextureSampler sharp(filament::TextureSampler::MinFilter::LINEAR_MIPMAP_LINEAR,
                                   filament::TextureSampler::MagFilter::LINEAR);
    sharp.setAnisotropy(8);
    board_look_->setParameter("panels", panel_texture_, sharp);
    ray_look_ = instance_of(marker_material());
    shell_look_ = instance_of(fade_material());
    square_.position = {{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}};
    square_.normal.assign(4, {0, 0, 1});
    square_.tangent.assign(4, {1, 0, 0});
    square_.uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};  // images start at their upper left corner
    square_.color.assign(4, {1, 1, 1});
    square_.triangle = {{0, 1, 2}, {0, 2, 3}};
    board_ = make_mesh(*engine_, *lobby_, square_, board_look_, false);
    caption_ = make_mesh(*engine_, *lobby_, square_, board_look_, false);
    show_part(board_, {0, 0, 1, 1});
    ray_ = make_rod(kCyan);
    Shape shell;
    add_ball(shell, {}, kShell, {0, 0, 0});
    shell_ = make_mesh(*engine_, *lobby_, shell, shell_look_, false);
    for (const GpuMesh* mesh : {&board_, &caption_, &shell_}) lobby_->remove(mesh->entity);
  }

  // Of unit length along +z, and of unit thickness; in no scene.
  GpuMesh make_rod(Vec3 color) {
    Shape rod;
    const Vec3 ends[] = {{0, 0, 0}, {0, 0, 1}};
    const float radius[] = {0.5f, 0.5f};
    add_tube(rod, ends, radius, 6, color);
    const GpuMesh mesh = make_mesh(*engine_, *lobby_, rod, ray_look_, false);
    lobby_->remove(mesh.entity);
    return mesh;
  }

  // part: left, top, right, bottom of the panels' picture.
  void show_part(const GpuMesh& mesh, const std::array<float, 4>& part) {
    constexpr float kTall = float(kBoardHeight) / kSheetHeight;
    const float u[] = {part[0], part[2], part[2], part[0]},
                v[] = {kTall * part[3], kTall * part[3], kTall * part[1], kTall * part[1]};
    std::vector<VertexLook> look;
    for (size_t i = 0; i < 4; ++i) look.push_back({{1, 1, 1, 1}, {u[i], v[i]}, {0, 0}});
    set_look(*engine_, mesh, look);
  }

  filament::MaterialInstance* instance_of(std::span<const uint8_t> package) {
    material_.push_back(filament::Material::Builder().package(package.data(), package.size()).build(*engine_));
    return material_.back()->createInstance();
  }

  void hide_board() {
    for (filament::Scene* scene : {lobby_, theatre_ ? &theatre_->scene() : lobby_}) {
      for (const GpuMesh* mesh : {&board_, &caption_, &ray_, &shell_}) scene->remove(mesh->entity);
      for (const LabelMesh& label : label_)
        for (const GpuMesh* mesh : {&label.square, &label.rod[0], &label.rod[1]}) scene->remove(mesh->entity);
    }
  }

  void place(const GpuMesh& mesh, const Pose& pose, Vec3 size) {
    const auto column = [](Vec3 v, float w) { return filament::math::float4{v.x, v.y, v.z, w}; };
    const filament::math::mat4f at{column(rotate(pose.q, {size.x, 0, 0}), 0), column(rotate(pose.q, {0, size.y, 0}), 0),
                                   column(rotate(pose.q, {0, 0, size.z}), 0), column(pose.p, 1)};
    filament::TransformManager& transforms = engine_->getTransformManager();
    transforms.setTransform(transforms.getInstance(mesh.entity), at);
  }

  void place_board(const Frame& frame, filament::Scene& scene) {
    hide_board();
    if (frame.caption) {
      const Board& c = *frame.caption;
      if (c.part != caption_part_) show_part(caption_, caption_part_ = c.part);
      place(caption_, c.pose, {c.width, height_of(c), c.width});
      scene.addEntity(caption_.entity);
    }
    if (!frame.board) return;
    const Board& b = *frame.board;
    place(board_, b.pose, {b.width, height_of(b), b.width});
    scene.addEntity(board_.entity);
    place_rod(ray_, b.ray_from, b.ray_to, 0.006f * b.width, scene);
  }

  void place_rod(const GpuMesh& rod, Vec3 from, Vec3 to, float thickness, filament::Scene& scene) {
    const Vec3 along = to - from;
    if (length(along) < 1e-4f) return;
    const Vec3 z = normalized(along), x = any_perpendicular(z);
    place(rod, {from, from_axes(x, cross(z, x), z)}, {thickness, thickness, length(along)});
    scene.addEntity(rod.entity);
  }

  // [pixels] of the sheet: upper left corner of a label.
  static std::array<int, 2> corner_of(size_t label) {
    return {int(label) % kLabelColumns * kLabelWidth, kBoardHeight + int(label) / kLabelColumns * kLabelHeight};
  }

  void place_labels(const Frame& frame, filament::Scene& scene) {
    const size_t count = frame.panels ? std::min(frame.label.size(), kMostLabels) : 0;
    while (label_.size() < count) {
      const auto at = corner_of(label_.size());
      const float left = float(at[0]) / kBoardWidth, top = float(at[1]) / kBoardHeight;
      LabelMesh fresh{make_mesh(*engine_, *lobby_, square_, board_look_, false), {make_rod(kYellow), make_rod(kCyan)}};
      lobby_->remove(fresh.square.entity);
      show_part(fresh.square, {left, top, left + float(kLabelWidth) / kBoardWidth, top + float(kLabelHeight) / kBoardHeight});
      label_.push_back(fresh);
    }
    for (size_t i = 0; i < count; ++i) {
      const Label& label = frame.label[i];
      place(label_[i].square, label.pose, {label.width, label.width * kLabelHeight / kLabelWidth, label.width});
      scene.addEntity(label_[i].square.entity);
      // From the edge that is nearer to the point, so that no rod crosses the text.
      const float half = 0.5f * label.width * kLabelHeight / kLabelWidth;
      for (size_t k = 0; k < 2; ++k) {
        const float edge = std::copysign(half, to_local(label.pose, label.point[k]).y);
        place_rod(label_[i].rod[k], transform(label.pose, {0, edge, 0}), label.point[k], kRod * label.width, scene);
      }
    }
  }

  void write_labels(std::span<const Label> labels) {
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    for (size_t i = 0; i < std::min(labels.size(), kMostLabels); ++i) {
      const auto corner = corner_of(i);
      const ImVec2 at{float(corner[0]), float(corner[1])}, end{at.x + kLabelWidth, at.y + kLabelHeight};
      list.AddRectFilled(at, end, 0xff140d09u);
      list.AddRectFilled(at, {at.x + 8, end.y}, labels[i].color);
      for (size_t k = 0; k < 2; ++k)
        list.AddText({at.x + 14, at.y + 3 + kBoardText * float(k)}, k == 0 ? 0xfff2f2edu : 0xffc9c4b2u,
                     labels[i].text[k].c_str());
    }
  }

  // A dark shell around the head covers everything, boards too.
  void fade(const Frame& frame, filament::Scene& scene) {
    if (frame.brightness >= 1) return;
    place(shell_, {0.5f * (frame.camera[0].eye + frame.camera[1].eye), {}}, {1, 1, 1});
    scene.addEntity(shell_.entity);
  }

  void draw_panels(const Frame& frame) {
    const BoardContext own(imgui_);
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = frame.pointer ? ImVec2((*frame.pointer)[0], (*frame.pointer)[1]) : ImVec2(-1e6f, -1e6f);
    io.MouseDown[0] = frame.pointer && frame.pressed;
    panels_->render(frame.dt, [&](filament::Engine*, filament::View*) {
      io.DisplaySize.y = kBoardHeight;  // panels fill their part of the sheet
      frame.panels();
      io.DisplaySize.y = kSheetHeight;
      write_labels(frame.label);
    });
    renderer_->render(panel_view_);
    panel_texture_->generateMipmaps(*engine_);
  }

  void aim_lobby(size_t eye, const Frame& frame) {
    const Camera& c = frame.camera[eye];
    const Frustum& f = c.frustum;
    const double n = 0.05, far_plane = 12;
    lobby_view_[eye]->setViewport({0, 0, uint32_t(frame.width), uint32_t(frame.height)});
    lobby_camera_[eye]->setCustomProjection(filament::math::mat4::frustum(n * double(f.left), n * double(f.right),
                                                                          n * double(f.down), n * double(f.up), n, far_plane),
                                            n, far_plane);
    lobby_camera_[eye]->lookAt({c.eye.x, c.eye.y, c.eye.z}, {c.target.x, c.target.y, c.target.z}, {c.up.x, c.up.y, c.up.z});
  }

  std::unique_ptr<Context> context_;
  filament::Engine* engine_ = nullptr;
  filament::SwapChain* chain_ = nullptr;
  filament::Renderer* renderer_ = nullptr;
  std::array<Images, 2> images_;
  std::array<uint8_t, 4> one_pixel_{};
  std::unique_ptr<Theatre> theatre_;

  Texture* panel_texture_ = nullptr;
  filament::RenderTarget* panel_target_ = nullptr;
  filament::View* panel_view_ = nullptr;
  ImGuiContext* imgui_ = nullptr;
  std::unique_ptr<filagui::ImGuiHelper> panels_;

  // Shown while no scene is staged: darkness with the board.
  filament::Scene* lobby_ = nullptr;
  filament::Skybox* lobby_sky_ = nullptr;
  std::array<filament::View*, 2> lobby_view_{};
  std::array<filament::Camera*, 2> lobby_camera_{};
  std::array<utils::Entity, 2> lobby_entity_;
  std::vector<filament::Material*> material_;
  filament::MaterialInstance *board_look_ = nullptr, *ray_look_ = nullptr, *shell_look_ = nullptr;
  Shape square_;  // of unit size; faces +z
  GpuMesh board_, caption_, ray_, shell_;
  std::vector<LabelMesh> label_;
  std::array<float, 4> caption_part_{};
};

}  // namespace

std::unique_ptr<EyeRenderer> make_eye_renderer(GlBinding binding, const std::string& font) {
  std::unique_ptr<Context> context;
  if (binding == GlBinding::egl) context = std::make_unique<EglContext>();
  else context = std::make_unique<GlxContext>();
  return std::make_unique<FilamentEyes>(std::move(context), font);
}

}  // namespace catgut
