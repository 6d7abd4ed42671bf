// SPDX-License-Identifier: Apache-2.0
// render/filament/mesh: one drawable: buffers of the graphics library, refilled from plain vectors when its shape changes.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <filament/Engine.h>
#include <filament/IndexBuffer.h>
#include <filament/MaterialInstance.h>
#include <filament/Scene.h>
#include <filament/VertexBuffer.h>
#include <utils/Entity.h>

#include "core/math.h"
#include "render/shapes.h"

namespace catgut {

// Constant attributes of a vertex. Eight floats, uploaded once.
struct VertexLook {
  float color[4];  // linear
  float uv0[2];
  float uv1[2];
};

// Slowly changing attributes of a vertex, each 0..255: ischemia by tension, blood on it, and char.
// Meshes with these are created with `live`.
struct VertexLive {
  uint8_t blanched = 0, bloody = 0, charred = 0;
  uint8_t listed = 0;  // 1: in TissueView::pressed; the shader does not read it
};

struct GpuMesh {
  filament::VertexBuffer* vertices = nullptr;
  filament::IndexBuffer* indices = nullptr;
  utils::Entity entity;
  uint32_t vertex_count = 0;
};

struct Box3 {
  Vec3 low, high;
};
Box3 bounds(std::span<const Vec3> points);

// Capacity look.size() vertices; the triangles are fixed, positions come with upload_surface.
GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, std::span<const VertexLook> look,
                  std::span<const std::array<uint32_t, 3>> triangle, filament::MaterialInstance* material, bool casts_shadow,
                  bool live = false);
// A mesh with the surface of `shape`.
GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, const Shape& shape, filament::MaterialInstance* material,
                  bool casts_shadow, bool live = false);
void destroy_mesh(filament::Engine& engine, filament::Scene& scene, GpuMesh& mesh);

// The rotation that takes x to the tangent and z to the normal, in the format of the shaders.
using PackedFrame = std::array<int16_t, 4>;
// mirrored: the texture runs clockwise there.
PackedFrame pack_frame(Quat frame, bool mirrored = false);
Quat frame_of(Vec3 normal, Vec3 tangent);  // tangent need not be orthogonal to normal

// A part of a mesh's next surface, written in place: per-frame uploads reuse their memory, so that rendering does not
// allocate. Each one must be passed to upload_surface once.
struct Surface {
  std::span<Vec3> position;
  std::span<PackedFrame> frame;
};
Surface new_surface(uint32_t vertices);
void upload_surface(filament::Engine& engine, const GpuMesh& mesh, const Surface& surface, Box3 box);

// Uploads the surface of shapes that seldom change.
void set_surface(filament::Engine& engine, const GpuMesh& mesh, std::span<const Vec3> position, std::span<const Vec3> normal,
                 std::span<const Vec3> tangent);
// The first vertices of a mesh created with at least as many.
void set_look(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLook> look);
void set_live(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLive> live);
// Draws the first `triangles` of its triangles.
void set_drawn(filament::Engine& engine, const GpuMesh& mesh, uint32_t triangles);
void set_pose(filament::Engine& engine, const GpuMesh& mesh, const Pose& pose);

}  // namespace catgut
