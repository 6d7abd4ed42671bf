// render/filament/mesh: see mesh.h.
#include "render/filament/mesh.h"

#include <cstdlib>
#include <cstring>

#include <filament/RenderableManager.h>
#include <filament/TransformManager.h>
#include <math/mat3.h>
#include <math/mat4.h>
#include <utils/EntityManager.h>

namespace catgut {
namespace {

using filament::RenderableManager;
using filament::VertexAttribute;
using filament::VertexBuffer;
using filament::math::float3;
using filament::math::mat3f;
using filament::math::mat4f;
using filament::math::short4;

float3 f3(Vec3 v) { return {v.x, v.y, v.z}; }

// Buffers are read on Filament's own thread some time later, so each upload is a copy that frees itself.
template <class T>
VertexBuffer::BufferDescriptor copy_of(std::span<const T> data) {
  void* copy = std::malloc(std::max<size_t>(1, data.size_bytes()));
  if (!data.empty()) std::memcpy(copy, data.data(), data.size_bytes());
  return {copy, data.size_bytes(), [](void* p, size_t, void*) { std::free(p); }};
}

filament::Box to_box(Box3 b) {
  // Filament's box is centre and half extent. Never flat: a plane would drop out of its culling.
  const Vec3 half = 0.5f * (b.high - b.low) + Vec3{1e-4f, 1e-4f, 1e-4f};
  return {f3(0.5f * (b.low + b.high)), f3(half)};
}

}  // namespace

Box3 bounds(std::span<const Vec3> points) {
  Box3 b{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
  bool any = false;
  for (const Vec3 p : points) {
    if (!is_finite(p)) continue;  // one particle gone astray must not take the whole mesh out of the picture
    any = true;
    b.low = {std::min(b.low.x, p.x), std::min(b.low.y, p.y), std::min(b.low.z, p.z)};
    b.high = {std::max(b.high.x, p.x), std::max(b.high.y, p.y), std::max(b.high.z, p.z)};
  }
  return any ? b : Box3{};
}

GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, std::span<const VertexLook> look,
                  std::span<const std::array<uint32_t, 3>> triangle, filament::MaterialInstance* material, bool casts_shadow) {
  GpuMesh mesh;
  mesh.vertex_count = uint32_t(look.size());
  mesh.vertices = VertexBuffer::Builder()
                      .vertexCount(std::max(1u, mesh.vertex_count))
                      .bufferCount(3)
                      .attribute(VertexAttribute::POSITION, 0, VertexBuffer::AttributeType::FLOAT3)
                      .attribute(VertexAttribute::TANGENTS, 1, VertexBuffer::AttributeType::SHORT4)
                      .normalized(VertexAttribute::TANGENTS)
                      .attribute(VertexAttribute::COLOR, 2, VertexBuffer::AttributeType::FLOAT4, 0, sizeof(VertexLook))
                      .attribute(VertexAttribute::UV0, 2, VertexBuffer::AttributeType::FLOAT2, 16, sizeof(VertexLook))
                      .attribute(VertexAttribute::UV1, 2, VertexBuffer::AttributeType::FLOAT2, 24, sizeof(VertexLook))
                      .build(engine);
  mesh.vertices->setBufferAt(engine, 2, copy_of(look));
  mesh.indices = filament::IndexBuffer::Builder()
                     .indexCount(uint32_t(std::max<size_t>(1, triangle.size()) * 3))
                     .bufferType(filament::IndexBuffer::IndexType::UINT)
                     .build(engine);
  mesh.indices->setBuffer(engine, copy_of(triangle));
  mesh.entity = utils::EntityManager::get().create();
  RenderableManager::Builder(1)
      .boundingBox(to_box({}))
      .material(0, material)
      .geometry(0, RenderableManager::PrimitiveType::TRIANGLES, mesh.vertices, mesh.indices, 0, triangle.size() * 3)
      .castShadows(casts_shadow)
      .receiveShadows(true)
      .build(engine, mesh.entity);
  scene.addEntity(mesh.entity);
  return mesh;
}

GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, const Shape& shape, filament::MaterialInstance* material,
                  bool casts_shadow) {
  std::vector<VertexLook> look(shape.position.size());
  for (size_t i = 0; i < look.size(); ++i) {
    const Vec3 c = shape.colour[i];
    look[i] = {{c.x, c.y, c.z, 1}, {shape.uv[i][0], shape.uv[i][1]}, {1, 0}};
  }
  const GpuMesh mesh = make_mesh(engine, scene, look, shape.triangle, material, casts_shadow);
  set_surface(engine, mesh, shape.position, shape.normal, shape.tangent);
  return mesh;
}

void destroy_mesh(filament::Engine& engine, filament::Scene& scene, GpuMesh& mesh) {
  if (!mesh.vertices) return;
  scene.remove(mesh.entity);
  engine.destroy(mesh.entity);
  utils::EntityManager::get().destroy(mesh.entity);
  engine.destroy(mesh.vertices);
  engine.destroy(mesh.indices);
  mesh = {};
}

void set_surface(filament::Engine& engine, const GpuMesh& mesh, std::span<const Vec3> position, std::span<const Vec3> normal,
                 std::span<const Vec3> tangent, std::span<const uint8_t> mirrored) {
  std::vector<short4> frame(position.size());
  for (size_t i = 0; i < position.size(); ++i) {
    const Vec3 n = normal[i];
    const Vec3 t = normalized(tangent[i] - n * dot(tangent[i], n), any_perpendicular(n));
    const Vec3 b = !mirrored.empty() && mirrored[i] ? cross(t, n) : cross(n, t);
    const auto q = mat3f::packTangentFrame(mat3f{f3(t), f3(b), f3(n)});
    const auto pack = [](float x) { return int16_t(std::lround(std::clamp(x, -1.0f, 1.0f) * 32767.0f)); };
    frame[i] = {pack(q.x), pack(q.y), pack(q.z), pack(q.w)};
  }
  mesh.vertices->setBufferAt(engine, 0, copy_of(position));
  mesh.vertices->setBufferAt(engine, 1, copy_of(std::span<const short4>(frame)));
  RenderableManager& manager = engine.getRenderableManager();
  manager.setAxisAlignedBoundingBox(manager.getInstance(mesh.entity), to_box(bounds(position)));
}

void set_look(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLook> look) {
  mesh.vertices->setBufferAt(engine, 2, copy_of(look));
}

void set_drawn(filament::Engine& engine, const GpuMesh& mesh, uint32_t triangles) {
  RenderableManager& manager = engine.getRenderableManager();
  manager.setGeometryAt(manager.getInstance(mesh.entity), 0, RenderableManager::PrimitiveType::TRIANGLES, mesh.vertices,
                        mesh.indices, 0, size_t(triangles) * 3);
}

void set_pose(filament::Engine& engine, const GpuMesh& mesh, const Pose& pose) {
  const Vec3 x = rotate(pose.q, {1, 0, 0}), y = rotate(pose.q, {0, 1, 0}), z = rotate(pose.q, {0, 0, 1});
  filament::TransformManager& manager = engine.getTransformManager();
  manager.setTransform(manager.getInstance(mesh.entity), mat4f(mat3f{f3(x), f3(y), f3(z)}, f3(pose.p)));
}

}  // namespace catgut
