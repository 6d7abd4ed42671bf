// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: see bullet_side.h. Lengths are centimeters here: Bullet adds small constants (1e-4 in the moments of a
// cluster) that are negligible for lengths near 1, but too large for millimeters in meters.
#include "bullet_side.h"

#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <numeric>
#include <span>

namespace catgut {
namespace {

constexpr float kCentimeters = 100;
constexpr int kTool = 1, kTissue = 2, kThread = 4, kDrape = 8;  // collision groups
constexpr float kMatching = 0.1f;  // of a cluster: they are not averaged, and 14 of them move every particle

btVector3 scaled(Vec3 p) { return {p.x * kCentimeters, p.y * kCentimeters, p.z * kCentimeters}; }

btTransform placed(const Pose& pose, const Capsule& capsule) {
  const Vec3 a = transform(pose, capsule.a), b = transform(pose, capsule.b);
  btTransform t;
  t.setOrigin(scaled(0.5f * (a + b)));
  const Vec3 d = normalized(b - a);
  t.setRotation(shortestArcQuat(btVector3(0, 1, 0), btVector3(d.x, d.y, d.z)));  // Bullet's capsules lie along y
  return t;
}

}  // namespace

const bool kBulletIsSingle = sizeof(btScalar) == sizeof(float);

struct BulletSide::World {
  const Workload& work;
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  btSoftBodyWorldInfo tissue_info, thread_info;  // each with its own gravity
  std::vector<std::unique_ptr<btCollisionShape>> shape;
  std::vector<std::unique_ptr<btRigidBody>> rigid;  // the tool's capsules first
  size_t capsules = 0;
  std::vector<std::unique_ptr<btSoftBody>> soft;  // tissue, then the thread
  std::vector<btVector3> rest;                    // of the tissue, body by body
  std::vector<int> node_of;                       // of every tissue particle: its node in its soft body

  World(const Workload& w, BulletWay way) : work(w) {
    const Model& model = *work.model;
    const SolverModel& m = model.solver;
    world.setGravity({0, 0, 0});
    for (btSoftBodyWorldInfo* info : {&tissue_info, &thread_info}) {
      info->m_broadphase = &broadphase;
      info->m_dispatcher = &dispatcher;
      info->air_density = 0;
      info->m_sparsesdf.Initialize();
      info->m_sparsesdf.setDefaultVoxelsz(0.1f);
    }
    tissue_info.m_gravity = scaled(m.tissue_gravity);
    thread_info.m_gravity = scaled(m.gravity);

    for (const Capsule& c : m.body[0].capsule) {
      shape.push_back(std::make_unique<btCapsuleShape>(c.radius * kCentimeters, distance(c.a, c.b) * kCentimeters));
      add_rigid(placed(tool_pose(work, 0), c), kTool, kTissue | kThread);
    }
    capsules = rigid.size();
    shape.push_back(std::make_unique<btBoxShape>(btVector3(100, 1, 100)));
    add_rigid(btTransform(btQuaternion::getIdentity(), btVector3(0, m.ground * kCentimeters - 1, 0)), kDrape, kThread);

    // Disconnected parts become separate soft bodies: Bullet's tree of faces does not terminate for a body in two parts.
    node_of.assign(m.tissue, -1);
    for (const std::vector<uint32_t>& body : work.body) add_tissue(body, way);
    add_thread(way);
  }

  ~World() {
    for (auto& s : soft) world.removeSoftBody(s.get());
    for (auto& r : rigid) world.removeRigidBody(r.get());
  }

  void add_rigid(const btTransform& at, int group, int mask) {
    rigid.push_back(std::make_unique<btRigidBody>(0, nullptr, shape.back().get()));
    btRigidBody& body = *rigid.back();
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body.setActivationState(DISABLE_DEACTIVATION);
    body.setWorldTransform(at);
    world.addRigidBody(&body, group, mask);
  }

  btSoftBody& add_soft(btSoftBodyWorldInfo& info, std::span<const uint32_t> particle, float margin) {
    const Model& model = *work.model;
    std::vector<btVector3> at;
    std::vector<btScalar> mass;
    for (const uint32_t i : particle) {
      at.push_back(scaled(model.start[i]));
      mass.push_back(model.solver.inv_mass[i] > 0 ? 1 / model.solver.inv_mass[i] : 0);  // 0: pinned
    }
    soft.push_back(std::make_unique<btSoftBody>(&info, static_cast<int>(at.size()), at.data(), mass.data()));
    btSoftBody& body = *soft.back();
    body.getCollisionShape()->setMargin(margin * kCentimeters);
    body.m_cfg.piterations = 3;
    body.m_cfg.kKHR = 1;  // a moving tool does not sink in
    body.m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
    body.m_materials[0]->m_kLST = 1;
    body.setActivationState(DISABLE_DEACTIVATION);
    return body;
  }

  void add_tissue(const std::vector<uint32_t>& particle, BulletWay way) {
    const SolverModel& m = work.model->solver;
    btSoftBody& body = add_soft(tissue_info, particle, m.collision.tool_radius);
    body.m_cfg.kDP = m.damping * m.h;
    std::vector<uint8_t> here(m.tissue, 0);
    for (size_t i = 0; i < particle.size(); ++i) {
      node_of[particle[i]] = static_cast<int>(i);
      here[particle[i]] = 1;
      rest.push_back(body.m_nodes[static_cast<int>(i)].m_x);
    }
    if (way == BulletWay::links) {
      for (const auto& [a, b] : work.edge)
        if (here[a]) body.appendLink(node_of[a], node_of[b]);
      for (const Triangle& t : m.collision.surface)
        if (here[t[0]]) body.appendFace(node_of[t[0]], node_of[t[1]], node_of[t[2]]);
      body.m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
    } else {
      std::vector<uint8_t> made(m.shape.clusters, 0);
      for (const uint32_t i : particle) {
        const uint32_t c = m.shape.cluster_of[i];
        if (way == BulletWay::fewer_clusters && made[c]) continue;
        made[c] = 1;
        add_cluster(body, &m.shape.member[size_t{c} * m.shape.cluster_stride], m.shape.cluster_stride, here);
      }
      body.initializeClusters();
    }
    world.addSoftBody(&body, kTissue, way == BulletWay::links ? kTool | kTissue | kThread : kTool);
  }

  // Its own generator makes disjoint clusters; overlapping ones can be set.
  void add_cluster(btSoftBody& body, const uint32_t* member, uint32_t stride, const std::vector<uint8_t>& here) {
    bool all_pinned = true;
    auto* c = new (btAlignedAlloc(sizeof(btSoftBody::Cluster), 16)) btSoftBody::Cluster();
    for (uint32_t k = 0; k < stride; ++k)
      if (member[k] < here.size() && here[member[k]]) {  // padding is beyond the last particle
        btSoftBody::Node& n = body.m_nodes[node_of[member[k]]];
        c->m_nodes.push_back(&n);
        all_pinned = all_pinned && n.m_im == 0;
      }
    if (all_pinned) {
      c->~Cluster();
      btAlignedFree(c);
      return;
    }
    c->m_collide = false;
    c->m_matching = kMatching;
    c->m_idmass = 0;
    c->m_nvimpulses = c->m_ndimpulses = 0;
    c->m_clusterIndex = body.m_clusters.size();
    body.m_clusters.push_back(c);
  }

  void add_thread(BulletWay way) {
    const SolverModel& m = work.model->solver;
    std::vector<uint32_t> particle(m.thread.count);
    std::iota(particle.begin(), particle.end(), m.tissue);
    btSoftBody& body = add_soft(thread_info, particle, m.thread.radius);
    body.m_cfg.kDP = m.thread_damping * m.h;
    for (int i = 0; i + 1 < body.m_nodes.size(); ++i) body.appendLink(i, i + 1);
    body.setMass(body.m_nodes.size() - 1, 0);  // held by the needle
    if (way == BulletWay::links) body.m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
    world.addSoftBody(&body, kThread, way == BulletWay::links ? kTool | kDrape | kTissue : kTool | kDrape);
  }

  template <typename F>
  void each_tissue_node(F&& f) {
    size_t i = 0;
    for (size_t b = 0; b + 1 < soft.size(); ++b)
      for (int k = 0; k < soft[b]->m_nodes.size(); ++k, ++i) f(soft[b]->m_nodes[k], rest[i]);
  }
};

BulletSide::BulletSide(const Workload& work, BulletWay way) : world_(std::make_unique<World>(work, way)) {}
BulletSide::~BulletSide() = default;

void BulletSide::tick(float time) {
  World& w = *world_;
  const Model& model = *w.work.model;
  for (int s = 1; s <= model.substeps; ++s) {
    const Pose pose = tool_pose(w.work, time - model.dt + static_cast<float>(s) * model.solver.h);
    for (size_t k = 0; k < w.capsules; ++k) w.rigid[k]->setWorldTransform(placed(pose, model.solver.body[0].capsule[k]));
    w.world.stepSimulation(model.solver.h, 0);
  }
}

void BulletSide::put_back_pinned() {
  world_->each_tissue_node([](btSoftBody::Node& n, const btVector3& at) {
    if (n.m_im == 0) n.m_x = n.m_q = at;
  });
}

double BulletSide::carried_off() const {
  double sum = 0, count = 0;
  world_->each_tissue_node([&](btSoftBody::Node& n, const btVector3& at) {
    if (n.m_im > 0) sum += static_cast<double>((n.m_x - at).length()), ++count;
  });
  return sum / count / static_cast<double>(kCentimeters);
}

size_t BulletSide::contacts() const {
  int n = 0;
  for (const auto& s : world_->soft) n += s->m_rcontacts.size() + s->m_scontacts.size();
  return static_cast<size_t>(n);
}

}  // namespace catgut
