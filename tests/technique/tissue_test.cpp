// SPDX-License-Identifier: Apache-2.0
// tests/technique: the techniques' plans on real tissue: the bodies of the scenes, tethers instead of thread, no
// hands. That a plan closes is the plan's part; that tissue follows it to half a millimeter and stays at rest is tested here.
#include <gtest/gtest.h>

#include <cstdio>

#include "procedure/scene_file.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace catgut {
namespace {

// A scene in which the test itself provides the stitches.
class Field {
 public:
  explicit Field(const char* scene) : model_(build_model(read_scene(scene))), state_(initial_state(*model_)), jobs_(1) {
    for (ToolInput& h : in_.hand) h.connected = 0;
  }
  const Model& model() const { return *model_; }
  State& state() { return *state_; }
  Vec3 at(uint32_t i) const { return xyz(state_->solver.x[i]); }

  // A bite through `wall` at the points nearest to two positions.
  void pass(uint32_t wall, Vec3 entry, Vec3 exit) {
    Bite b;
    b.complete = b.has_exit = true;
    b.entry = nearest(wall, entry), b.exit = nearest(wall, exit);
    bite_.push_back(b);
    for (const bool out : {false, true}) {
      StitchPoint p;
      p.point = (out ? b.exit : b.entry).point;
      p.bite = static_cast<uint32_t>(bite_.size()) - 1, p.wall = wall, p.exit = out;
      p.inside = out != (bite_.size() % 2 == 0);  // in, out, in, out
      p.span = 0.1f;
      point_.push_back(p);
    }
  }
  float& span(size_t k) { return point_[k].span; }
  void tie() {
    Knot k;
    k.phase = KnotPhase::locked;
    k.throws = 2;
    knot_ = {k};
  }
  void fresh() { ++taken_, knot_.clear(), point_.clear(), bite_.clear(); }

  void ticks(int n) {
    for (int i = 0; i < n; ++i) {
      for (StitchPoint& p : point_) p.at = position_of(p.point, state_->solver.x.data());
      TechniqueView view;
      view.point = point_, view.bite = bite_, view.knot = knot_, view.x = state_->solver.x.data();
      view.suture_index = taken_, view.dt = model_->dt;
      EventList events;
      technique(model_->technique, technique_, view, state_->plan[0], events);
      for (const Event& e : events) EXPECT_NE(e.kind, EventKind::technique_fault) << fault_name(e.fault);
      step(*model_, *state_, in_, jobs_);
    }
  }
  // [m] of the widest pair; midpoints only, or all.
  float gap(bool all) const {
    float most = 0;
    for (const ClosurePlan::Pair& p : state_->plan[0].pair)
      if (all || p.midpoint)
        most = std::max(most, distance(position_of(p.a, state_->solver.x.data()), position_of(p.b, state_->solver.x.data())));
    return most;
  }
  float moved() const {
    float most = 0;
    for (uint32_t i = 0; i < model_->solver.tissue; ++i) most = std::max(most, distance(at(i), model_->start[i]));
    return most;
  }

 private:
  BiteEnd nearest(uint32_t wall, Vec3 p) const {
    BiteEnd end;
    float best = 1e30f;
    const auto& surface = model_->solver.collision.surface;
    for (uint32_t f = 0; f < surface.size(); ++f) {
      if (model_->wall[surface[f][0]] != wall) continue;
      const ClosestOnTriangle c = closest_on_triangle(p, at(surface[f][0]), at(surface[f][1]), at(surface[f][2]));
      if (length2(c.point - p) >= best) continue;
      best = length2(c.point - p);
      end.triangle = f;
      end.weight = c.weight;
    }
    spread(model_->solver, end);
    return end;
  }

  std::shared_ptr<const Model> model_;
  StatePtr state_;
  Jobs jobs_;
  TickInput in_;
  TechniqueState technique_;  // the scene's own has no input
  std::vector<StitchPoint> point_;
  std::vector<Bite> bite_;
  std::vector<Knot> knot_;
  uint32_t taken_ = 0;
};

TEST(Scenes, lie_calmly_when_nobody_touches_them) {
  for (const char* scene : {"connell", "lembert"}) {
    SCOPED_TRACE(scene);
    Field f(scene);
    f.ticks(30);
    const double early = kinetic_energy(f.model(), f.state());
    f.ticks(90);
    EXPECT_TRUE(state_is_valid(f.model(), f.state()));
    EXPECT_LT(kinetic_energy(f.model(), f.state()), 0.5 * early);
    EXPECT_LT(f.moved(), 0.0005f) << "they sag less than half a millimeter";
    float lowest = 1;
    for (uint32_t i = 0; i < f.model().solver.tissue; ++i)
      if (f.model().solver.inv_mass[i] > 0) lowest = std::min(lowest, f.at(i).y);
    EXPECT_GE(lowest, f.model().picture.drape) << "what is free to move lies above the drape";
  }
}

// Ten passes, four crossings, 4 mm from the edges: both walls fold inward between them (2.5.2).
TEST(Tissue, connell_edges_come_together_and_turn_inward) {
  Field f("connell");
  f.ticks(30);
  const float radius = 0.020f, edge = 0.004f, turn = 0.3f;
  const auto place = [&](uint32_t wall, float angle) {
    return Vec3{(wall ? 1.0f : -1.0f) * (0.0045f + edge), radius * std::cos(angle), radius * std::sin(angle)};
  };
  for (uint32_t sweep = 0; sweep < 5; ++sweep) {
    const float a = turn * (2.5f - static_cast<float>(sweep));
    f.pass(sweep % 2, place(sweep % 2, a), place(sweep % 2, a - 0.5f * turn));
    f.pass(sweep % 2, place(sweep % 2, a - 0.5f * turn), place(sweep % 2, a - turn));
    if (sweep == 0) continue;
    const size_t crossing = 4 * sweep - 1;
    f.ticks(1);
    for (int i = 0; i < 90; ++i) f.span(crossing) = std::max(0.0005f, 0.02f - 0.0003f * static_cast<float>(i)), f.ticks(1);
  }
  f.ticks(90);
  EXPECT_TRUE(state_is_valid(f.model(), f.state()));
  EXPECT_LT(f.gap(false), 0.001f);
  EXPECT_LT(f.gap(true), 0.001f);
  EXPECT_LT(kinetic_energy(f.model(), f.state()), 1e-8);
  // The cut edges lie below the points that the thread joined.
  Vec3 joined{};
  size_t midpoints = 0;
  for (const ClosurePlan::Pair& p : f.state().plan[0].pair)
    if (p.midpoint) joined += position_of(p.a, f.state().solver.x.data()), ++midpoints;
  ASSERT_EQ(midpoints, 4u);
  joined = joined / 4.0f;
  for (const auto& rim : f.model().technique.seam.rim)
    for (uint32_t i : rim)
      if (std::abs(f.at(i).z - joined.z) < 0.003f && f.at(i).y > 0) { EXPECT_LT(f.at(i).y, joined.y) << i; }
}

// Five stitches (3.4) close the ring completely (2.5.4).
TEST(Tissue, lembert_ring_closes) {
  Field f("lembert");
  f.ticks(30);
  for (int s = 0; s < 5; ++s) {
    const float a = 2 * kPi * static_cast<float>(s) / 5;
    const Vec3 out{std::sin(a), 0, std::cos(a)}, down{0, -0.0035f, 0};
    f.pass(0, out * 0.020f + down, out * 0.0178f + down);
    f.pass(1, out * 0.0125f + down, out * 0.0103f + down);
    f.ticks(1);
    f.tie();
    f.ticks(75);
    f.fresh();
  }
  f.ticks(60);
  EXPECT_TRUE(state_is_valid(f.model(), f.state()));
  EXPECT_LT(f.gap(true), 0.001f);
  EXPECT_LT(kinetic_energy(f.model(), f.state()), 1e-8);
  // No point of the two facing edges was left out.
  for (const auto* group : {&f.model().technique.lembert.outer, &f.model().technique.lembert.inner})
    for (uint32_t i : *group) {
      const auto& pair = f.state().plan[0].pair;
      EXPECT_TRUE(std::any_of(pair.begin(), pair.end(), [&](auto& p) { return p.a.particle[0] == i || p.b.particle[0] == i; }));
    }
}

}  // namespace
}  // namespace catgut
