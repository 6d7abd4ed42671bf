// render/filament/mesh: one drawable: buffers on the graphics side, refilled from plain vectors when its shape changes.
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

// What of a vertex never moves. Eight floats, uploaded once.
struct VertexLook {
  float colour[4];  // linear
  float uv0[2];
  float uv1[2];
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

// Room for vertex_count vertices; the triangles are fixed, positions come with set_surface.
GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, std::span<const VertexLook> look,
                  std::span<const std::array<uint32_t, 3>> triangle, filament::MaterialInstance* material, bool casts_shadow);
// A mesh whose surface is that of `shape`.
GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, const Shape& shape, filament::MaterialInstance* material,
                  bool casts_shadow);
void destroy_mesh(filament::Engine& engine, filament::Scene& scene, GpuMesh& mesh);

// Uploads the surface for the next picture. tangent need not be at right angles to normal. mirrored: per vertex, whether the
// texture runs clockwise there; may be empty.
void set_surface(filament::Engine& engine, const GpuMesh& mesh, std::span<const Vec3> position, std::span<const Vec3> normal,
                 std::span<const Vec3> tangent, std::span<const uint8_t> mirrored = {});
// Replaces everything of a mesh that was made with at least as many vertices; draws `triangles` of its triangles from the
// first.
void set_look(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLook> look);
void set_drawn(filament::Engine& engine, const GpuMesh& mesh, uint32_t triangles);
void set_pose(filament::Engine& engine, const GpuMesh& mesh, const Pose& pose);

}  // namespace catgut
