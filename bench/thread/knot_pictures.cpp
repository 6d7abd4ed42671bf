// SPDX-License-Identifier: Apache-2.0
// bench/thread: close-ups of knots from the physical model: single throw, granny, square, surgeon's 2-1-1; wound, tight (0.3
// N on the tails), finished (2 N). Under each, the name from src/thread/observe.
//   knot_pictures FILE.png
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "render/capsule_picture.h"
#include "thread/observe.h"
#include "validation/knot_scenes.h"

int main(int argc, char** argv) {
  using namespace catgut;
  if (argc != 2) {
    std::fprintf(stderr, "knot_pictures: no file named; write: knot_pictures FILE.png\n");
    return 2;
  }
  const thread::Settings settings = validation::knot_settings(0.3f);
  const float r = 0.5f * settings.material.diameter;
  std::vector<SheetCell> cells;
  struct Kind {
    const char* name;
    validation::Throws throws;
  };
  const Kind kinds[] = {{"single throw", validation::single_throw()},
                        {"granny", validation::granny()},
                        {"square", validation::square()},
                        {"surgeon's 2-1-1", validation::surgeons_211()}};
  for (const Kind& kind : kinds) {
    // A single throw needs the pull of its bite from below; a pull in line would straighten it.
    const bool single = kind.throws.size() == 1, doubled = kind.throws[0].half_turns > 3;
    validation::Tightened t(validation::lay_knot(kind.throws, settings.material.diameter, 1.43f * settings.material.diameter,
                                                 15e-3f, 12e-3f, single ? 1.1f : 0.0f));
    if (single)
      for (Vec3* way : {&t.knot.tail_direction_a, &t.knot.tail_direction_b}) *way = normalized(*way + Vec3{0, 0, 0.9f});
    const thread::State& s = t.knot.state;
    auto picture = [&](const std::string& stage, float width) {
      std::vector<DrawnCapsule> capsules;
      for (uint32_t i = 0; i < s.segments(); ++i)
        if (!s.broken[i])
          capsules.push_back(
              {s.position(i), s.position(i + 1), r, i < t.knot.load_a ? Color{70, 120, 215, 255} : Color{214, 160, 60, 255}});
      // Midpoint of the contacts.
      Vec3 middle{};
      float count = 0;
      for (size_t k = 0; k < s.key.size(); ++k) {
        const uint32_t i = thread::segment_of(s.key[k]), j = thread::partner_of(s.key[k]);
        const Vec3 p = normalized(s.position(i + 1) - s.position(i)), q = normalized(s.position(j + 1) - s.position(j));
        if (s.crossing[k].gap < settings.material.diameter && std::abs(dot(cross(p, q), s.crossing[k].normal)) > 0.7f)
          middle += s.position(i) + s.position(j), count += 2;
      }
      CapsuleView view;
      view.center = count > 0 ? middle / count : Vec3{};
      view.toward = {0.05f, -1, 0.25f}, view.up = {0, 0, 1}, view.width = width;
      const thread::SeenKnot seen = thread::observe(settings, s);
      char text[160];
      std::snprintf(text, sizeof text, "%s, %s: seen as %s, %u throws, %u wraps, %.0f %% sure", kind.name, stage.c_str(),
                    std::string(thread::name_of(seen.name)).c_str(), seen.throws, seen.wraps, 100 * double{seen.confidence});
      cells.push_back({draw_capsules(capsules, view, 560, 420), text});
      std::printf("%s\n", text);
    };
    thread::Surroundings nothing;
    t.stepper.step(settings, t.knot.state, nothing);
    picture("wound", 9e-3f);
    // The loads tighten the double throw before the throws above lock it.
    auto draw = [&](float tails, float loads, int ticks) {
      if (!doubled)
        return validation::tighten(settings, t, tails, validation::Drawing::flat, 1e-3f * static_cast<float>(ticks), false);
      const thread::Pull pull[4] = {{t.knot.tail_a(), t.knot.tail_direction_a * tails},
                                    {t.knot.tail_b(), t.knot.tail_direction_b * tails},
                                    {t.knot.load_a, {-loads, 0, 0}},
                                    {t.knot.load_b, {loads, 0, 0}}};
      thread::Surroundings around;
      around.pulls = pull;
      for (int i = 0; i < ticks; ++i) t.stepper.step(settings, t.knot.state, around);
    };
    draw(doubled ? 0.1f : 0.3f, 0.6f, 120);
    picture("snug", doubled ? 8e-3f : 6e-3f);
    draw(2, 2, 300);
    picture("finished", doubled ? 7e-3f : 4.5e-3f);
  }
  write_png(contact_sheet(cells, 3), argv[1]);
  return 0;
}
