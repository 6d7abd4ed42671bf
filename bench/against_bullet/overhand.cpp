// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: the same overhand knot in Bullet: a chain of rigid capsules, joined end to end, with friction, pulled
// tight by its ends; beside it the thread of src/thread from the same start. Results: knot determinant (3: an
// overhand knot, 1: none), minimum distance of strands, force at the ends, milliseconds per simulated millisecond.
//   against_bullet_overhand [SUBSTEPS_PER_MS] [ITERATIONS]     of Bullet; 20 and 10
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "thread/topology.h"
#include "validation/knot_scenes.h"

namespace {
using namespace catgut;

constexpr float kDiameter = 0.35e-3f, kSegment = 0.7e-3f, kFriction = 0.3f, kSpeed = 0.05f,
                kScale = 1000;  // Bullet in millimeters
constexpr int kMilliseconds = 1000;

// One overhand knot round a loop of 40 mm, tails along x.
std::vector<Vec3> overhand() {
  const float r = 0.8f * kDiameter, loop = 40e-3f, circle = loop / (2 * kPi), half = 3e-3f, turns = 3 * kPi;
  std::vector<Vec3> p;
  auto line = [&](Vec3 a, Vec3 b) {
    for (int i = 0; i < 1000; ++i) p.push_back(lerp(a, b, static_cast<float>(i) / 1000));
  };
  auto helix = [&](float phase) {
    for (int i = 0; i < 1000; ++i) {
      const float x = half * (2 * static_cast<float>(i) / 1000 - 1), a = phase + turns * x / (2 * half);
      p.push_back({x, r * std::cos(a), r * std::sin(a)});
    }
  };
  const float phase = kPi + 0.5f * turns, height = r + std::sqrt(circle * circle - half * half);
  line({-half - 25e-3f, -r, 0}, {-half, -r, 0});
  helix(phase);
  const float from = std::atan2(r - height, half), to = std::atan2(r - height, -half) + 2 * kPi;
  for (int i = 0; i < 3000; ++i) {
    const float a = from + (to - from) * static_cast<float>(i) / 3000;
    p.push_back({circle * std::cos(a), height + circle * std::sin(a), 0});
  }
  helix(phase + kPi);
  line({half, -r, 0}, {half + 25e-3f, -r, 0});
  return validation::resample(p, kSegment);
}

uint64_t determinant(const std::vector<Vec3>& p) {
  return thread::knot_determinant(thread::close_curve(p, {-1, 0, 0}, {1, 0, 0}));
}

float nearest(const std::vector<Vec3>& p) {
  float least = 1;
  for (size_t i = 0; i + 1 < p.size(); ++i)
    for (size_t j = i + 4; j + 1 < p.size(); ++j)
      for (int k = 0; k <= 8; ++k)
        for (int l = 0; l <= 8; ++l)
          least = std::min(least, distance(lerp(p[i], p[i + 1], static_cast<float>(k) / 8),
                                           lerp(p[j], p[j + 1], static_cast<float>(l) / 8)));
  return least / kDiameter;
}

double now() { return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void report(const char* name, int ms, const std::vector<Vec3>& p, double cost, double rest) {
  double length = 0;
  for (size_t i = 0; i + 1 < p.size(); ++i) length += double{distance(p[i], p[i + 1])};
  std::printf("%-8s after %3d ms: determinant %llu, nearest strands %.2f d, length %+.1f %%, %.2f ms per ms\n", name, ms,
              static_cast<unsigned long long>(determinant(p)), double{nearest(p)}, 100 * (length / rest - 1), cost);
  std::fflush(stdout);
}

void ours(const std::vector<Vec3>& path) {
  thread::Settings settings = validation::knot_settings(kFriction);
  thread::State state = thread::make_state(path);
  thread::Stepper stepper(path.size());
  thread::Hold hold[2];
  hold[0].node = 0, hold[1].node = static_cast<uint32_t>(path.size()) - 1;
  for (thread::Hold& h : hold) h.from = h.to = state.position(h.node);
  double spent = 0;
  for (int ms = 1; ms <= kMilliseconds; ++ms) {
    for (thread::Hold& h : hold) h.from = h.to;
    hold[0].to.x -= 0.5e-3f * kSpeed, hold[1].to.x += 0.5e-3f * kSpeed;
    thread::Surroundings around;
    around.holds = hold;
    const double start = now();
    stepper.step(settings, state, around);
    spent += now() - start;
    if (ms % 100) continue;
    std::vector<Vec3> p;
    for (size_t i = 0; i < state.nodes(); ++i) p.push_back(state.position(i));
    report("Catgut", ms, p, spent / ms, double{kSegment} * static_cast<double>(path.size() - 1));
  }
}

void bullet(const std::vector<Vec3>& path, int substeps, int iterations) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, 0, 0});
  world.getSolverInfo().m_numIterations = iterations;
  btCapsuleShape shape(0.5f * kDiameter * kScale, kSegment * kScale);
  shape.setMargin(0.5f * kDiameter * kScale);
  std::vector<std::unique_ptr<btRigidBody>> body;
  std::vector<std::unique_ptr<btTypedConstraint>> joint;
  const btScalar mass = 0.05f * kSegment;  // the same line mass as Catgut's [kg]
  btVector3 inertia;
  shape.calculateLocalInertia(mass, inertia);
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 middle = 0.5f * kScale * (path[i] + path[i + 1]), d = normalized(path[i + 1] - path[i]);
    btTransform at(shortestArcQuat(btVector3(0, 1, 0), btVector3(d.x, d.y, d.z)), btVector3(middle.x, middle.y, middle.z));
    const bool end = i == 0 || i + 2 == path.size();
    body.push_back(std::make_unique<btRigidBody>(end ? 0 : mass, nullptr, &shape, end ? btVector3(0, 0, 0) : inertia));
    btRigidBody& b = *body.back();
    b.setWorldTransform(at), b.setInterpolationWorldTransform(at);
    b.setFriction(std::sqrt(kFriction));  // Bullet multiplies the two
    b.setDamping(0.005f, 0.02f);
    b.setActivationState(DISABLE_DEACTIVATION);
    if (end) b.setCollisionFlags(b.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    world.addRigidBody(&b);
  }
  const btVector3 tip(0, 0.5f * kSegment * kScale, 0);
  for (size_t i = 0; i + 1 < body.size(); ++i) {
    joint.push_back(std::make_unique<btPoint2PointConstraint>(*body[i], *body[i + 1], tip, -tip));
    world.addConstraint(joint.back().get(), true);
    for (size_t j = i + 2; j < std::min(body.size(), i + 4); ++j) body[i]->setIgnoreCollisionCheck(body[j].get(), true);
  }
  double spent = 0;
  const btScalar h = 1e-3f / static_cast<float>(substeps);
  for (int ms = 1; ms <= kMilliseconds; ++ms) {
    const double start = now();
    for (int k = 0; k < substeps; ++k) {
      for (size_t e : {size_t{0}, body.size() - 1}) {
        btTransform at = body[e]->getWorldTransform();
        const btScalar v = (e == 0 ? -0.5f : 0.5f) * kSpeed * kScale;
        at.setOrigin(at.getOrigin() + btVector3(v * h, 0, 0));
        body[e]->setWorldTransform(at), body[e]->setLinearVelocity({v, 0, 0});
      }
      world.stepSimulation(h, 0);
    }
    spent += now() - start;
    if (ms % 100) continue;
    std::vector<Vec3> p;
    for (size_t i = 0; i < body.size(); ++i) {
      const btVector3 a = body[i]->getWorldTransform() * -tip;
      p.push_back(Vec3{a.x(), a.y(), a.z()} / kScale);
    }
    const btVector3 last = body.back()->getWorldTransform() * tip;
    p.push_back(Vec3{last.x(), last.y(), last.z()} / kScale);
    report("Bullet", ms, p, spent / ms, double{kSegment} * static_cast<double>(path.size() - 1));
  }
  for (auto& j : joint) world.removeConstraint(j.get());
  for (auto& b : body) world.removeRigidBody(b.get());
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<Vec3> path = overhand();
  std::printf("%zu segments, determinant at the start %llu\n", path.size() - 1,
              static_cast<unsigned long long>(determinant(path)));
  ours(path);
  bullet(path, argc > 1 ? std::atoi(argv[1]) : 20, argc > 2 ? std::atoi(argv[2]) : 10);
  return 0;
}
