// SPDX-License-Identifier: Apache-2.0
// bench/thread: close-ups of knots from the physical model: single throw, granny, square, surgeon's 2-1-1; wound, snug (0.3
// N on the tails), finished (2 N), round a rod. Under each, the name from src/thread/observe.
//   knot_pictures FILE.png
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "knot_drawing.h"

namespace {
using namespace catgut;

// Of a knot as laid, where both strands are farthest out: round the rod, then where they turn back between a throw and the
// next one, from the bite upward.
std::vector<std::pair<uint32_t, uint32_t>> turning_points(const validation::LaidKnot& k) {
  std::vector<std::pair<uint32_t, uint32_t>> nodes;
  const auto x = [&](uint32_t i) { return k.state.position(i).x; };
  uint32_t farthest = k.load_a - 1;
  for (uint32_t i = k.load_a - 1; i > 1; --i) {
    if (x(i) * x(i - 1) <= 0) {  // a throw lies around the middle plane
      nodes.push_back({farthest, 2 * k.load_a - farthest});
      farthest = i - 1;
    } else if (std::abs(x(i)) > std::abs(x(farthest))) {
      farthest = i;
    }
  }
  return nodes;
}
}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "knot_pictures: no file named; write: knot_pictures FILE.png\n");
    return 2;
  }
  const thread::Settings settings = validation::knot_settings(0.3f);
  const float d = settings.material.diameter;
  std::vector<SheetCell> cells;
  for (const KnotKind& kind : knot_kinds()) {
    validation::Tightened t(validation::lay_on_rod(kind.laid, d, 1.43f * d, 20e-3f));
    const thread::State& s = t.knot.state;
    auto picture = [&](const std::string& stage) {
      std::vector<DrawnCapsule> drawn;
      add_thread(drawn, s, t.knot.load_a, 0.5f * d);
      const KnotPlace place = knot_place(settings, s);
      CapsuleView view;
      view.center = place.center, view.up = {0, 0, 1};
      view.width = std::max(3.6e-3f, 3.2f * place.radius);
      std::vector<DrawnCapsule> rods;
      for (const thread::ToolCapsule& rod : t.knot.rod)
        rods.push_back({lerp(rod.to_a, rod.to_b, 0.35f), lerp(rod.to_a, rod.to_b, 0.65f), rod.radius, kTissueColor});
      view.toward = clearest_view(drawn, rods, place, {0.05f, -1, 0.6f}, view.up);
      drawn.insert(drawn.end(), rods.begin(), rods.end());
      const std::string name = std::string(kind.name) + ", " + stage, seen = seen_text(thread::observe(settings, s));
      Image image = draw_capsules(drawn, view, 580, 420);
      draw_text(image, 10, 10, name, {20, 24, 26, 255}, 3);
      cells.push_back({image, "seen: " + seen});
      std::printf("%s: seen as %s\n", name.c_str(), seen.c_str());
    };
    // The tissue holds the middle of the bite: it does not run round the rod.
    std::vector<thread::Hold> hold(1);
    hold[0].node = t.knot.load_a, hold[0].from = hold[0].to = s.position(hold[0].node), hold[0].stiffness = 500;
    const auto step = [&](std::span<const thread::Pull> pulls, std::span<thread::Hold> holds) {
      thread::Surroundings around;
      around.pulls = pulls, around.holds = holds, around.tools = t.knot.rod;
      t.stepper.step(settings, t.knot.state, around);
    };
    const auto tails = [&](float force) {
      return std::array<thread::Pull, 2>{
          {{t.knot.tail_a(), t.knot.tail_direction_a * force}, {t.knot.tail_b(), t.knot.tail_direction_b * force}}};
    };
    const auto draw = [&](float from, float to, int ticks) {
      for (int i = 0; i < ticks; ++i) step(tails(from + (to - from) * std::min(1.0f, static_cast<float>(i) / 50)), hold);
    };
    // The hands draw each throw down before they lay the next one. Here all are laid at once, and the upper ones would lock
    // with air below. Two hands take the strands above the first throw and go apart until they feel 0.3 N.
    const auto draw_first_throw = [&](uint32_t node_a, uint32_t node_b) {
      std::vector<thread::Hold> hands{hold[0], hold[0], hold[0]};
      hands[1].node = node_a, hands[2].node = node_b;
      for (size_t k = 1; k < 3; ++k) hands[k].to = s.position(hands[k].node);
      for (int i = 0; i < 2000 && std::min(length(hands[1].force), length(hands[2].force)) < 0.3f; ++i) {
        for (size_t k = 1; k < 3; ++k) {
          hands[k].from = hands[k].to;
          if (length(hands[k].force) < 0.3f) hands[k].to.x += hands[k].to.x > 0 ? 20e-6f : -20e-6f;
        }
        step({}, hands);
      }
    };
    // Of three throws, the first is tightened by its loads, as the tissue does it, while the tails keep the others snug.
    const auto draw_by_loads = [&](uint32_t node_a, uint32_t node_b) {
      const Vec3 way{s.position(node_a).x > 0 ? 0.6f : -0.6f, 0, 0};
      const auto tail = tails(0.1f);
      const thread::Pull pull[4] = {{node_a, way}, {node_b, -way}, tail[0], tail[1]};
      for (int i = 0; i < 200; ++i) step(pull, hold);
    };
    draw(0, 0, 1);
    picture("wound");
    const auto turns = turning_points(t.knot);
    if (turns.size() > 2) draw_by_loads(turns[0].first, turns[0].second);
    else if (turns.size() > 1) draw_first_throw(turns[1].first, turns[1].second);
    draw(0, 0.3f, 200);
    picture("snug");
    draw(0.3f, 2, 400);
    picture("finished");
  }
  write_png(contact_sheet(cells, 3), argv[1]);
  return 0;
}
