// SPDX-License-Identifier: Apache-2.0
// sim/stitch_pull: see the header.
#include "sim/stitch_pull.h"

#include <algorithm>
#include <vector>

#include "core/check.h"
#include "exchange/snapshot.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"
#include "sim/topology.h"

namespace catgut {
namespace {

constexpr float kGrows = 0.5f, kFollows = 0.25f, kStays = 1;  // [s]

// The first hole of the second wall.
size_t second_wall(const std::vector<SuturePointView>& point) {
  for (size_t i = 1; i < point.size(); ++i)
    if (point[i].wall != point.front().wall) return i;
  return point.size() / 2;
}

Vec3 apart(const std::vector<SuturePointView>& point, size_t second) {
  Vec3 one, other;
  for (size_t i = 0; i < point.size(); ++i) (i < second ? one : other) += point[i].position;
  return other / static_cast<float>(point.size() - second) - one / static_cast<float>(second);
}

}  // namespace

StitchPull pull_stitch(const Model& model, const State& state, size_t suture, float force, Jobs& jobs) {
  const StatePtr copy = initial_state(model);
  load_state(model, *copy, save_state(model, state));
  Snapshot seen;
  publish(model, *copy, seen);
  const auto view = [&]() -> const SutureView& { return seen.suture[suture]; };
  CATGUT_CHECK(view().suture_point.size() >= 2);
  const size_t second = second_wall(view().suture_point), holes = view().suture_point.size();
  const Vec3 way = normalized(apart(view().suture_point, second));
  TickInput input;
  input.hand = no_hands();
  std::vector<physical::Hands::WallPull> pull(holes);
  const float dt = current_model(model, *copy).dt;
  StitchPull result;
  float before = 0;
  for (float t = 0; t < kGrows + kFollows + kStays; t += dt) {
    const Model& now = current_model(model, *copy);
    const physical::State& world = copy->physical.world;
    for (size_t i = 0; i < holes; ++i) {
      const physical::Hole& hole = world.hole[copy->physical.suture[suture].hole[i]];
      pull[i].at = wall::weights(now.physical->world.wall, world.wall.topology, hole.place);
      const float share = i < second ? -1 / static_cast<float>(second) : 1 / static_cast<float>(holes - second);
      pull[i].force = way * (force * std::min(1.0f, t / kGrows) * share);
    }
    input.tick = copy->tick;
    copy->event.start(copy->tick);
    step_physical(now, *copy, input, jobs, nullptr, pull);
    publish(model, *copy, seen);
    if (view().suture_point.size() != holes) return result;
    const float gap = dot(apart(view().suture_point, second), way);
    if (t < kGrows + kFollows) before = gap;
    result.slip = gap - before;
  }
  const auto at = [&](const SuturePointView& p) {
    return std::find(view().thread_order.begin(), view().thread_order.end(), p.anchored) - view().thread_order.begin();
  };
  const auto one = at(view().suture_point.front()), other = at(view().suture_point.back());
  for (auto i = std::min(one, other); i < std::max(one, other); ++i)
    result.tension = std::max(result.tension, view().thread_tension[static_cast<size_t>(i)]);
  return result;
}

}  // namespace catgut
