// SPDX-License-Identifier: Apache-2.0
// render: the operating field for a headset: two views into images that the headset's runtime owns, and panels on a board in
// space. The caller speaks to the runtime (app/xr); here its images are OpenGL texture names. Panels use Dear ImGui in a
// context separate from the window's.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/renderer.h"

namespace catgut {

enum class GlBinding : uint8_t {
  egl,   // needs no X server
  xlib,  // GLX, on the X server named by the environment
};

// The OpenGL context that the runtime receives; the renderer's own shares its textures. Pointers are the binding's types.
struct GlHandles {
  GlBinding binding = GlBinding::egl;
  void* display = nullptr;  // EGLDisplay, or Display*
  void* config = nullptr;   // EGLConfig, or GLXFBConfig
  void* context = nullptr;  // EGLContext, or GLXContext
  uint32_t visual = 0;      // xlib: XVisualID
  uint64_t drawable = 0;    // xlib: GLXDrawable
  void (*(*get_proc_address)(const char*))() = nullptr;
};

// A board with panels.
struct Board {
  Pose pose;                              // its center, in the world; it faces its +z
  float width = 0.5f;                     // [m] in the world
  Vec3 ray_from, ray_to;                  // [m] a thin rod from the pointing hand; equal: none
  std::array<float, 4> part{0, 0, 1, 1};  // of the panels' picture: left, top, right, bottom
};

// A small board with two lines of text, and a thin rod from it to each of two points.
struct Label {
  Pose pose;                        // as of a Board
  float width = 0.04f;              // [m] in the world
  std::array<Vec3, 2> point;        // [m] ends of the rods: entry (yellow), exit (cyan)
  std::array<std::string, 2> text;  // lines
  uint32_t color = 0xffffffffu;     // of its left edge; ImGui's order: 0xAABBGGRR
};

// Belongs to the thread that created it.
class EyeRenderer {
 public:
  static constexpr int kBoardWidth = 1280, kBoardHeight = 720;  // [pixels]
  static constexpr float kBoardText = 22;                       // [pixels] line height
  static constexpr int kLabelWidth = 250, kLabelHeight = 50;    // [pixels]
  static constexpr size_t kMostLabels = 30;                     // per frame; more are not drawn
  virtual ~EyeRenderer() = default;

  virtual GlHandles handles() const = 0;
  // Makes the runtime's context current on this thread. Call it before every group of calls to the runtime: some runtimes leave
  // another one.
  virtual void make_current() = 0;

  // The runtime's images of an eye, sRGB. drop_images() before the runtime destroys them.
  virtual void set_images(int eye, std::span<const uint32_t> texture, int width, int height) = 0;
  virtual void drop_images() = 0;

  virtual void stage(const PictureModel* model, Quality quality) = 0;

  struct Frame {
    const Snapshot* snapshot = nullptr;  // null: the field is not drawn
    std::array<Camera, 2> camera;        // left, right, each with its frustum
    std::array<uint32_t, 2> image{};     // index of set_images
    int width = 0, height = 0;           // [pixels] the part of the image, from its lower left corner
    bool suture_points = false;
    float brightness = 1;                         // 0: black, boards included
    float dt = 1.0f / 90;                         // [s] since the last frame, for the panels
    std::optional<Board> board;                   // none: not shown
    std::optional<Board> caption;                 // a second one with the same contents; its ray is not drawn
    std::span<const Label> label;                 // shown while there are panels
    std::function<void()> panels;                 // calls ImGui; empty: the board keeps its previous contents
    std::optional<std::array<float, 2>> pointer;  // [pixels] of the board, from its upper left corner
    bool pressed = false;                         // the pointer's button
    std::array<Image, 2>* copy = nullptr;         // not null: receives a copy of both images
  };
  // Returns when the images may be given back to the runtime. False: the driver refused the frame.
  virtual bool draw(const Frame& frame) = 0;
};

// [m] in the world
inline float height_of(const Board& b) {
  return b.width * (b.part[3] - b.part[1]) * EyeRenderer::kBoardHeight / ((b.part[2] - b.part[0]) * EyeRenderer::kBoardWidth);
}

// font: as make_window_renderer. Throws std::runtime_error with one line.
std::unique_ptr<EyeRenderer> make_eye_renderer(GlBinding binding, const std::string& font);

}  // namespace catgut
