// SPDX-License-Identifier: Apache-2.0
// tests/cost: a tick does not allocate. An allocation is usually fast, but occasionally takes milliseconds that a
// hand feels. Every allocation of this program is counted (malloc itself, which new uses), but only inside `step`: planning of
// the surgeon, publishing and recording are excluded. The scripted surgeon runs the scenes; with
// CATGUT_LONG to their end.
#include <execinfo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/model.h"
#include "sim/state.h"
#include "validation/contact_scenes.h"
#include "validation/knot_scenes.h"
#include "validation/suture_scenes.h"

#if defined(__GLIBC__) && !defined(CATGUT_SANITIZED)
#define CATGUT_COUNTS_ALLOCATIONS 1
#endif

namespace {

constexpr size_t kSites = 8, kDepth = 12;
std::atomic<bool> counting{false};
std::atomic<uint64_t> allocations{0};
// Stack of the first one in a tick, for addr2line.
std::array<std::array<void*, kDepth>, kSites> site;
std::array<int, kSites> depth;

[[maybe_unused]] void counted() {  // sanitizers have their own allocator
  if (!counting.load(std::memory_order_relaxed)) return;
  const uint64_t n = allocations.fetch_add(1);
  if (n < kSites) depth[n] = backtrace(site[n].data(), kDepth);
}

}  // namespace

#ifdef CATGUT_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void* malloc(size_t n) noexcept { return counted(), __libc_malloc(n); }
void* calloc(size_t n, size_t size) noexcept { return counted(), __libc_calloc(n, size); }
void* realloc(void* p, size_t n) noexcept { return counted(), __libc_realloc(p, n); }
void* aligned_alloc(size_t align, size_t n) noexcept { return counted(), __libc_memalign(align, n); }
void* memalign(size_t align, size_t n) noexcept { return counted(), __libc_memalign(align, n); }
int posix_memalign(void** p, size_t align, size_t n) noexcept { return counted(), (*p = __libc_memalign(align, n)) ? 0 : 12; }
}
#endif

namespace catgut {
namespace {

// The allocations made by `work`.
template <typename Work>
uint64_t allocations_of(Work&& work) {
  allocations = 0;
  counting = true;
  work();
  counting = false;
  return allocations;
}

std::string sites() {
  std::string text;
  for (size_t k = 0; k < std::min<size_t>(kSites, allocations); ++k) {
    char** name = backtrace_symbols(site[k].data(), depth[k]);
    for (int i = 2; i < depth[k]; ++i) text += std::string("  ") + name[i] + "\n";
    text += "\n";
    std::free(name);
  }
  return text;
}

struct Counts {
  uint64_t ticks = 0, allocating = 0, allocations = 0;
  void add(uint64_t n) { ++ticks, allocating += n > 0, allocations += n; }
};

class TickAllocation : public testing::TestWithParam<const char*> {};

TEST_P(TickAllocation, none_from_when_the_hands_are_let_in) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations can be counted with glibc alone, and not under a sanitizer";
#endif
  void* room[4];
  backtrace(room, 4);  // its first call loads a library
  const SceneSpec scene = read_scene(GetParam());
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Jobs jobs(1);
  Snapshot seen;
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  const uint64_t settle = static_cast<uint64_t>(scene.settle / model->dt);
  const uint64_t last = std::getenv("CATGUT_LONG") ? 100000 : settle + static_cast<uint64_t>(40 / model->dt);
  // Ticks without an event; ticks with one; ticks in which a suture is baked, which allocates its own lists.
  Counts quiet, eventful, settling;
  std::string first;
  publish(*model, *state, seen);
  for (TickInput input; input.tick < last && !hands.surgeon->done(); ++input.tick) {
    if (input.tick < settle) {
      for (ToolInput& h : input.hand) h.connected = 0;
    } else {
      const TickInput wanted = hands.surgeon->operate(seen, model->dt);
      input.hand = wanted.hand, input.commands = wanted.commands;
    }
    const uint64_t n = allocations_of([&] { step(*model, *state, input, jobs); });
    if (input.tick >= settle) {
      const bool settles = std::any_of(state->event.begin(), state->event.end(),
                                       [](const Event& e) { return e.kind == EventKind::suture_loaded; });
      (state->event.empty() ? quiet : settles ? settling : eventful).add(n);
      if (n > 0 && !settles && first.empty())
        first = "tick " + std::to_string(input.tick) + ", " + std::to_string(state->event.size()) + " events:\n" + sites();
      if (n > 0 && std::getenv("CATGUT_SITES"))
        std::printf("tick %llu, %zu events\n%s", static_cast<unsigned long long>(input.tick), state->event.size(),
                    sites().c_str());
    }
    publish(*model, *state, seen);
  }
  const auto say = [](const char* which, const Counts& c) {
    std::printf("  %-28s %6llu ticks, %llu of them allocate (%llu times)\n", which, static_cast<unsigned long long>(c.ticks),
                static_cast<unsigned long long>(c.allocating), static_cast<unsigned long long>(c.allocations));
  };
  std::printf("%s\n", GetParam());
  say("without an event", quiet), say("with one", eventful), say("in which a suture settles", settling);
  EXPECT_GT(quiet.ticks, 1000u);
  EXPECT_GT(eventful.ticks, 5u) << "nothing was sewn";
  EXPECT_EQ(quiet.allocations, 0u) << first;
  EXPECT_EQ(eventful.allocations, 0u) << first;
}

INSTANTIATE_TEST_SUITE_P(Scenes, TickAllocation, testing::Values("purse_string", "connell", "stay", "lembert"),
                         [](const auto& scene) { return std::string(scene.param); });

// Distributing a stage to workers does not allocate either. Few ticks: on a busy machine workers wait for each other.
TEST(WorkerAllocation, none) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations can be counted with glibc alone, and not under a sanitizer";
#endif
  const std::shared_ptr<const Model> model = build_model(read_scene("lembert"));
  const StatePtr state = initial_state(*model);
  Jobs jobs(2);
  for (TickInput input; input.tick < 20; ++input.tick) {
    const uint64_t n = allocations_of([&] { step(*model, *state, input, jobs); });
    EXPECT_EQ(n, 0u) << "tick " << input.tick << "\n" << sites();
  }
}

// The counter itself: it sees all ways to allocate.
TEST(AllocationCount, sees_new_aligned_new_and_malloc) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations can be counted with glibc alone, and not under a sanitizer";
#endif
  void* room[4];
  backtrace(room, 4);
  std::vector<int> plain;
  Column<float> aligned;
  void* raw = nullptr;
  EXPECT_EQ(allocations_of([&] { plain.resize(100); }), 1u);
  EXPECT_EQ(allocations_of([&] { aligned.resize(100); }), 1u);
  EXPECT_EQ(allocations_of([&] { raw = std::malloc(100); }), 1u);
  EXPECT_EQ(allocations_of([&] { plain.resize(50), aligned.clear(); }), 0u);
  std::free(raw);
}

// The physical thread, while a knot is tightened and the pair list is refreshed.
TEST(Allocation, a_thread_that_is_knotted_asks_for_none) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations are not counted here";
#endif
  const thread::Settings settings = validation::knot_settings(0.3f);
  validation::Tightened t(validation::lay_knot(validation::surgeons_211(), settings.material.diameter, 0.5e-3f));
  thread::State& state = t.knot.state;
  const thread::Pull pull[2] = {{t.knot.tail_a(), t.knot.tail_direction_a * 2}, {t.knot.tail_b(), t.knot.tail_direction_b * 2}};
  thread::ToolCapsule tool;
  tool.a = tool.to_a = {0, -0.02f, -3e-3f}, tool.b = tool.to_b = {0, 0.02f, -3e-3f}, tool.radius = 1e-3f;
  thread::Surroundings around;
  around.pulls = pull, around.tools = {&tool, 1};
  const uint64_t count = allocations_of([&] {
    for (int i = 0; i < 60; ++i) t.stepper.step(settings, state, around);
  });
  EXPECT_GT(state.refreshes, 5u);
  EXPECT_EQ(count, 0u) << sites();
}

// Thread and wall together: a stitch is drawn until its lips touch.
TEST(Allocation, a_stitch_that_is_drawn_asks_for_none) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations are not counted here";
#endif
  validation::Stitch near;
  near.gap = 0.5e-3f;
  validation::Sewn s = validation::interrupted(near);
  s.run(0.002f);  // columns of the inverse get their room in the first step
  physical::Hands hands;
  hands.holds = s.hold;
  size_t most_contacts = 0;
  const uint64_t count = allocations_of([&] {
    for (int i = 0; i < 150; ++i) {
      for (thread::Hold& h : s.hold) h.from = h.to, h.to = h.to + Vec3{1.2e-4f, 0, 0};
      physical::step(s.model, s.state, *s.scratch, hands, *s.jobs);
      most_contacts = std::max(most_contacts, s.state.contact.size());
    }
  });
  EXPECT_GT(s.state.lip.size(), 0u);
  EXPECT_GT(most_contacts, 0u);
  EXPECT_EQ(count, 0u) << sites();
}

// Tissue that is warm and bleeds, after a pen. A tick in which the drawn surface gets another shape allocates that picture.
TEST(Allocation, a_tick_of_warm_and_bleeding_tissue_asks_for_none) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations are not counted here";
#endif
  void* room[4];
  backtrace(room, 4);
  const std::shared_ptr<const Model> model = build_model(read_scene("excision"));
  const StatePtr state = initial_state(*model);
  const physical::Model& world = model->physical->world;
  Cutting& c = state->physical.cutting;
  physical::Scratch scratch(world, state->physical.world);
  const wall::Weights at = wall::weights(world.wall, state->physical.world.wall.topology, {40, 0, 0, 1});
  physical::Pen pen;
  pen.tip = wall::place(at, state->physical.world.wall.motion), pen.power = 30, pen.coagulate = true;
  for (int i = 0; i < 100; ++i) physical::use_pen(kExciseLaw, world, state->physical.world, scratch, c.excision, pen, 0.001f);
  for (const uint32_t face : {38u, 40u, 60u}) {
    physical::Bleed b;
    b.at = {face, 0, 0, 0}, b.open = physical::vessel_flow(kExciseLaw.bleed, 0.2e-3f), b.on_wall = 1e-10f;
    c.excision.bleed.push_back(b);
  }
  Jobs jobs(1);
  uint64_t ticks = 0, count = 0;
  std::string first;
  for (TickInput input; input.tick < 90; ++input.tick) {
    const DividedPicture before = c.picture;
    const uint64_t n = allocations_of([&] { step(*model, *state, input, jobs); });
    if (input.tick < 6 || !(c.picture == before)) continue;
    ++ticks, count += n;
    if (n > 0 && first.empty()) first = "tick " + std::to_string(input.tick) + "\n" + sites();
  }
  EXPECT_GT(ticks, 45u);
  EXPECT_FALSE(c.excision.heat.warm.empty());
  EXPECT_GT(c.excision.bleed.front().lost, 0.0f);
  EXPECT_EQ(count, 0u) << first;
}

// Tool and needle on the wall, and a thread across the tool's way.
TEST(Allocation, tools_and_a_needle_on_the_wall_ask_for_none) {
#ifndef CATGUT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations are not counted here";
#endif
  validation::ContactBench b(11);
  const auto step = [&](float y) {
    const Vec3 z{0, 1, 0}, x{1, 0, 0};
    b.target[0] = {{{0, y, -0.02f}, from_axes(x, cross(z, x), z)}, true, 0, 0};
    physical::Hands hands;
    hands.targets = b.target;
    physical::step(b.model, b.state, *b.scratch, hands, b.jobs);
  };
  physical::move_body(b.model, b.state, 0, {{0, 0.026f, -0.02f}, axis_angle({1, 0, 0}, -0.5f * kPi)}, 0);
  physical::move_body(b.model, b.state, 1, {{0.004f, 0.024f, -0.03f}, {}}, 0);
  step(0.026f);
  const uint64_t count = allocations_of([&] {
    for (int i = 0; i < 150; ++i) step(0.026f - 6e-5f * static_cast<float>(i));
  });
  EXPECT_GT(b.scratch->bodies.row.size(), 0u);
  EXPECT_EQ(count, 0u) << sites();
}

}  // namespace
}  // namespace catgut
