// SPDX-License-Identifier: Apache-2.0
// render/filament/mesh: see mesh.h.
#include "render/filament/mesh.h"

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

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

float3 f3(Vec3 v) { return {v.x, v.y, v.z}; }

// Filament's own thread reads buffers later, so each upload is a separate copy. Copies of a size used before are
// reused.
class Copies {
 public:
  void* take(size_t bytes) {
    const std::lock_guard lock(mutex_);
    std::vector<void*>& free = free_[bytes];
    if (free.empty()) return std::malloc(std::max<size_t>(1, bytes));
    void* p = free.back();
    free.pop_back();
    return p;
  }
  void give_back(void* p, size_t bytes) {
    const std::lock_guard lock(mutex_);
    std::vector<void*>& free = free_[bytes];
    // More than this are in flight only during loading.
    if (free.size() < 8) free.push_back(p);
    else std::free(p);
  }
  ~Copies() {
    for (auto& [bytes, free] : free_)
      for (void* p : free) std::free(p);
  }

 private:
  std::mutex mutex_;
  std::map<size_t, std::vector<void*>> free_;
};
Copies copies;

VertexBuffer::BufferDescriptor hand_over(void* data, size_t bytes) {
  return {data, bytes, [](void* p, size_t size, void*) { copies.give_back(p, size); }};
}

template <class T>
VertexBuffer::BufferDescriptor copy_of(std::span<const T> data) {
  void* copy = copies.take(data.size_bytes());
  if (!data.empty()) std::memcpy(copy, data.data(), data.size_bytes());
  return hand_over(copy, data.size_bytes());
}

filament::Box to_box(Box3 b) {
  // Filament's box is center and half extent. Never flat: culling would drop a plane.
  const Vec3 half = 0.5f * (b.high - b.low) + Vec3{1e-4f, 1e-4f, 1e-4f};
  return {f3(0.5f * (b.low + b.high)), f3(half)};
}

}  // namespace

Box3 bounds(std::span<const Vec3> points) {
  Box3 b{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
  bool any = false;
  for (const Vec3 p : points) {
    if (!is_finite(p)) continue;  // one invalid particle must not remove the whole mesh from the image
    any = true;
    b.low = {std::min(b.low.x, p.x), std::min(b.low.y, p.y), std::min(b.low.z, p.z)};
    b.high = {std::max(b.high.x, p.x), std::max(b.high.y, p.y), std::max(b.high.z, p.z)};
  }
  return any ? b : Box3{};
}

GpuMesh make_mesh(filament::Engine& engine, filament::Scene& scene, std::span<const VertexLook> look,
                  std::span<const std::array<uint32_t, 3>> triangle, filament::MaterialInstance* material, bool casts_shadow,
                  bool live) {
  GpuMesh mesh;
  mesh.vertex_count = uint32_t(look.size());
  VertexBuffer::Builder builder;
  builder.vertexCount(std::max(1u, mesh.vertex_count))
      .bufferCount(live ? 4 : 3)
      .attribute(VertexAttribute::POSITION, 0, VertexBuffer::AttributeType::FLOAT3)
      .attribute(VertexAttribute::TANGENTS, 1, VertexBuffer::AttributeType::SHORT4)
      .normalized(VertexAttribute::TANGENTS)
      .attribute(VertexAttribute::COLOR, 2, VertexBuffer::AttributeType::FLOAT4, 0, sizeof(VertexLook))
      .attribute(VertexAttribute::UV0, 2, VertexBuffer::AttributeType::FLOAT2, 16, sizeof(VertexLook))
      .attribute(VertexAttribute::UV1, 2, VertexBuffer::AttributeType::FLOAT2, 24, sizeof(VertexLook));
  if (live)
    builder.attribute(VertexAttribute::CUSTOM0, 3, VertexBuffer::AttributeType::UBYTE4).normalized(VertexAttribute::CUSTOM0);
  mesh.vertices = builder.build(engine);
  mesh.vertices->setBufferAt(engine, 2, copy_of(look));
  if (live) set_live(engine, mesh, std::vector<VertexLive>(std::max<size_t>(1, look.size())));
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
                  bool casts_shadow, bool live) {
  std::vector<VertexLook> look(shape.position.size());
  for (size_t i = 0; i < look.size(); ++i) {
    const Vec3 c = shape.color[i];
    const float hatched = i < shape.hatched.size() ? shape.hatched[i] : 0;
    look[i] = {{c.x, c.y, c.z, 1 - hatched}, {shape.uv[i][0], shape.uv[i][1]}, {1, 0}};
  }
  const GpuMesh mesh = make_mesh(engine, scene, look, shape.triangle, material, casts_shadow, live);
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

PackedFrame pack_frame(Quat q, bool mirrored) {
  // The sign of w states the direction of the texture, so w must never round to 0.
  constexpr float least = 1.0f / 32767;
  float s = q.w < 0 ? -1.0f : 1.0f;
  float w = s * q.w;
  if (w < least) {
    w = least;
    s *= std::sqrt(1 - least * least);
  }
  if (mirrored) s = -s, w = -w;
  // Rounded manually: lround is a function call.
  const auto pack = [](float x) { return static_cast<int16_t>(static_cast<int>(x * 32767.0f + 32768.5f) - 32768); };
  return {pack(s * q.x), pack(s * q.y), pack(s * q.z), pack(w)};
}

Quat frame_of(Vec3 n, Vec3 tangent) {
  const Vec3 t = normalized(tangent - n * dot(tangent, n), any_perpendicular(n));
  return from_axes(t, cross(n, t), n);
}

Surface new_surface(uint32_t vertices) {
  return {{static_cast<Vec3*>(copies.take(vertices * sizeof(Vec3))), vertices},
          {static_cast<PackedFrame*>(copies.take(vertices * sizeof(PackedFrame))), vertices}};
}

void upload_surface(filament::Engine& engine, const GpuMesh& mesh, const Surface& surface, Box3 box) {
  mesh.vertices->setBufferAt(engine, 0, hand_over(surface.position.data(), surface.position.size_bytes()));
  mesh.vertices->setBufferAt(engine, 1, hand_over(surface.frame.data(), surface.frame.size_bytes()));
  RenderableManager& manager = engine.getRenderableManager();
  manager.setAxisAlignedBoundingBox(manager.getInstance(mesh.entity), to_box(box));
}

void set_surface(filament::Engine& engine, const GpuMesh& mesh, std::span<const Vec3> position, std::span<const Vec3> normal,
                 std::span<const Vec3> tangent) {
  const Surface surface = new_surface(uint32_t(position.size()));
  for (size_t i = 0; i < position.size(); ++i) {
    surface.position[i] = position[i];
    surface.frame[i] = pack_frame(frame_of(normal[i], tangent[i]));
  }
  upload_surface(engine, mesh, surface, bounds(position));
}

void set_look(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLook> look) {
  mesh.vertices->setBufferAt(engine, 2, copy_of(look));
}

void set_live(filament::Engine& engine, const GpuMesh& mesh, std::span<const VertexLive> live) {
  mesh.vertices->setBufferAt(engine, 3, copy_of(live));
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
