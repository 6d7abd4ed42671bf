// SPDX-License-Identifier: Apache-2.0
// bench/thread: films of whole ties with a needle holder (validation/tool_ties): single throw, granny, square, surgeon's 2-1-1.
// Every picture is a state of the mechanics. Every moment has its share of the film, fast or slow. The caption has the
// moment and the name from src/thread/observe.
//   knot_films FOLDER [KIND...]     KIND: single, granny, square, surgeons
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "knot_drawing.h"
#include "render/video.h"

namespace {
using namespace catgut;

constexpr int kWidth = 800, kHeight = 600, kBand = 62, kSeen = kHeight - kBand;  // band: the caption, below the picture
constexpr double kRate = 25;                                                     // pictures a second
constexpr double kClosing = 3;                                                   // [s] the finished knot, turned a little
constexpr float kTurn = 0.35f;                                                   // [rad] to either side
const Vec3 kUp{0, 1, 0};
const Vec3 kFront = normalized(Vec3{0.08f, 0.4f, 1});

// What a phase is called, and its share of the film's time, whatever time it takes.
struct Phase {
  const char* phase;
  const char* shown;
  double share;
};
constexpr Phase kPhases[] = {{"to work", "needle holder over the wound", 0.45},
                             {"wind", "winding", 1.0},
                             {"wind again", "winding again", 0.5},
                             {"open", "jaws open", 0.2},
                             {"fetch", "jaws go to the tail", 0.4},
                             {"close", "jaws close on the tail", 0.2},
                             {"draw through", "turns slide off the jaws", 0.6},
                             {"cross", "ends to their sides", 0.45},
                             {"pull", "pulled tight", 1.1},
                             {"lay", "tail laid down", 0.25},
                             {"let go", "jaws let go", 0.25}};
const Phase& phase_of(std::string_view name) {
  for (const Phase& p : kPhases)
    if (name == p.phase) return p;
  return kPhases[0];
}

struct Look {
  Vec3 center;
  float width = 0.05f;  // [m]
};
struct Moment {
  const Phase* phase = nullptr;
  int number = 0;  // of the throw, from 1
  Look look;
};

// Where to look, before smoothing: wound and hands while the strand is wound, the knot when it is drawn.
Look wanted_look(const thread::Settings& settings, const thread::State& s, std::span<const thread::ToolCapsule> tools,
                 std::string_view phase) {
  const thread::ToolCapsule& forceps = tools[tools.size() - 2];
  const Vec3 tip = tools[0].to_a, shaft = normalized(tools[0].to_b - tools[0].to_a);
  const KnotPlace knot = knot_place(settings, s);
  const Vec3 knot_center =
      knot.radius > 0 ? Vec3{std::clamp(knot.center.x, -8e-3f, 8e-3f), std::clamp(knot.center.y, 0.0f, 8e-3f), 0} : Vec3{};
  if (phase == "pull") return {knot_center, std::clamp(5 * knot.radius, 9e-3f, 20e-3f)};
  if (phase == "lay") return {knot_center, 10e-3f};
  if (phase == "let go") return {knot_center, 30e-3f};
  if (phase == "cross") return {knot_center, 30e-3f};
  std::vector<Vec3> shown{{0, -5e-3f, 0}, tip + shaft * 16e-3f, tip};
  shown.push_back(forceps.to_a);
  const Vec3 w = kFront, u = normalized(cross(kUp, w)), v = cross(w, u);
  float left = 1, right = -1, low = 1, high = -1;
  for (const Vec3& p : shown) {
    left = std::min(left, dot(p, u)), right = std::max(right, dot(p, u));
    low = std::min(low, dot(p, v)), high = std::max(high, dot(p, v));
  }
  const float width = std::max(right - left, (high - low) * kWidth / kSeen);
  return {u * (0.5f * (left + right)) + v * (0.5f * (low + high)), std::clamp(1.2f * width, 20e-3f, 110e-3f)};
}

// The middle of the long rod: its front end would hide the knot.
DrawnCapsule drawn_tissue(const thread::ToolCapsule& rod) {
  return {{rod.to_a.x, rod.to_a.y, -6e-3f}, {rod.to_a.x, rod.to_a.y, 4e-3f}, rod.radius, kTissueColor};
}

void draw_tools(std::vector<DrawnCapsule>& to, std::span<const thread::ToolCapsule> tools) {
  const size_t n = tools.size();
  const Color steel{168, 174, 184, 255};
  for (size_t k = 0; k + 2 < n; ++k) to.push_back({tools[k].to_a, tools[k].to_b, tools[k].radius, steel});
  // Each jaw is two rods in the mechanics; its flat between them is drawn only.
  for (const size_t k : {0, 2})
    for (const float t : {0.25f, 0.5f, 0.75f})
      to.push_back(
          {lerp(tools[k].to_a, tools[k + 1].to_a, t), lerp(tools[k].to_b, tools[k + 1].to_b, t), tools[k].radius, steel});
  // The forceps' capsule ends behind the strand; its two fine tips reach it.
  const thread::ToolCapsule& forceps = tools[n - 2];
  const Color dark{104, 116, 128, 255};
  const Vec3 back = normalized(forceps.to_b - forceps.to_a), side = any_perpendicular(back) * 0.35e-3f;
  to.push_back({forceps.to_a, forceps.to_b, forceps.radius, dark});
  for (const Vec3& s : {side, -side})
    to.push_back({forceps.to_a + s, forceps.to_a - back * (validation::kForcepsReach + 0.4e-3f) + s, 0.3e-3f, dark});
  to.push_back(drawn_tissue(tools[n - 1]));
}

Image picture(const thread::Settings& settings, const thread::State& s, std::span<const thread::ToolCapsule> tools,
              const CapsuleView& view, uint32_t middle, std::string_view name, std::string_view above, std::string_view below) {
  // Never thinner than three pixels.
  const float real = 0.5f * settings.material.diameter, radius = std::max(real, 1.5f * view.width / kWidth);
  std::vector<DrawnCapsule> drawn;
  add_thread(drawn, s, middle, radius);
  draw_tools(drawn, tools);
  Image image = make_image(kWidth, kHeight, {24, 28, 30, 255});
  paste(image, draw_capsules(drawn, view, kWidth, kSeen), 0, 0);
  const auto line = [&](int y, std::string_view text, Color color) {
    draw_text(image, 10, y, text, color, text_width(text, 3) > kWidth - 12 ? 2 : 3);
  };
  line(10, name, {20, 24, 26, 255});
  line(kSeen + 6, above, {240, 244, 240, 255});
  line(kSeen + 34, below, {236, 190, 90, 255});
  return image;
}

void make_film(const KnotKind& kind, const std::string& folder) {
  const thread::Settings settings = validation::knot_settings(0.25f);
  validation::TieSettings how;
  how.speed = 0.2f, how.seed = kind.seed;
  // Once to learn when what happens, and once to draw: a tie repeats to the bit.
  std::vector<Moment> moments;
  uint32_t middle = 0;
  std::string last;
  validation::tie_with_tools(
      settings, kind.tied, how,
      [&](const thread::State& s, std::span<const thread::ToolCapsule> tools, double, const std::string& phase) {
        Moment m;
        m.phase = &phase_of(phase);
        m.number = moments.empty() ? 1 : moments.back().number + (phase == "to work" && last == "let go");
        m.look = wanted_look(settings, s, tools, phase);
        if (moments.empty())
          for (uint32_t i = 0; i < s.nodes(); ++i)
            if (s.position(i).y < s.position(middle).y) middle = i;
        last = phase;
        moments.push_back(m);
      });
  // Ticks of each phase of each throw.
  std::map<std::pair<int, const Phase*>, int> ticks;
  for (const Moment& m : moments) ++ticks[{m.number, m.phase}];
  double whole = 0;
  for (const auto& [key, count] : ticks) whole += key.second->share;
  const double length = 3 + 4 * static_cast<double>(kind.tied.size());
  std::vector<size_t> shown;  // tick of each picture
  double at = 0;
  for (size_t i = 0; i < moments.size(); ++i) {
    if (at * kRate >= static_cast<double>(shown.size())) shown.push_back(i);
    at += length / whole * moments[i].phase->share / ticks[{moments[i].number, moments[i].phase}];
  }
  // The camera is as quick as 0.4 s of film.
  const auto look_at = [&](size_t k) {
    Look mean{{}, 0};
    float weights = 0;
    for (int o = -20; o <= 20; ++o) {
      const size_t i = static_cast<size_t>(std::clamp(static_cast<int>(k) + o, 0, static_cast<int>(shown.size()) - 1));
      const float weight = std::exp(-0.5f * static_cast<float>(o * o) / 64);
      mean.center += moments[shown[i]].look.center * weight;
      mean.width += std::log(moments[shown[i]].look.width) * weight, weights += weight;
    }
    return Look{mean.center / weights, std::exp(mean.width / weights)};
  };
  VideoWriter film(folder + "/" + kind.file + ".mp4", kWidth, kHeight, kRate);
  std::string seen;
  size_t tick = 0, next = 0;
  std::vector<thread::ToolCapsule> last_tools;
  const validation::TiedKnot knot = validation::tie_with_tools(
      settings, kind.tied, how,
      [&](const thread::State& s, std::span<const thread::ToolCapsule> tools, double time, const std::string&) {
        last_tools.assign(tools.begin(), tools.end());
        if (next < shown.size() && shown[next] == tick) {
          if (next % 5 == 0) seen = seen_text(thread::observe(settings, s));
          const Moment& m = moments[tick];
          const Look look = look_at(next);
          char above[120];
          std::snprintf(above, sizeof above, "throw %d: %s", m.number, m.phase->shown);
          film.add(
              picture(settings, s, tools, {look.center, kFront, kUp, look.width}, middle, kind.name, above, "seen: " + seen));
          if (next % 25 == 0) std::printf("%s %.2f s: %s; %s\n", kind.file, time, above, seen.c_str());
          ++next;
        }
        ++tick;
      });
  // The finished knot, from where it is seen best, turned to either side.
  const Look from = look_at(shown.size() - 1);
  const KnotPlace place = knot_place(settings, knot.state);
  std::vector<DrawnCapsule> thread;
  add_thread(thread, knot.state, middle, 0.5f * settings.material.diameter);
  const DrawnCapsule tissue[] = {drawn_tissue(last_tools.back())};
  const Vec3 best = clearest_view(thread, tissue, place, kFront, kUp);
  const thread::SeenKnot final_seen = thread::observe(settings, knot.state);
  seen = seen_text(final_seen);
  std::printf("%s: determinant %llu, seen as %s, %.1f s\n", kind.file, static_cast<unsigned long long>(knot.determinant),
              seen.c_str(), knot.seconds);
  const int pictures = static_cast<int>(kClosing * kRate);
  for (int i = 0; i < pictures; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(pictures - 1), near = std::min(1.0f, 3 * t);
    const float e = near * near * (3 - 2 * near);
    const float turn = kTurn * std::sin(2 * kPi * std::clamp(1.5f * t - 0.5f, 0.0f, 1.0f));
    CapsuleView view;
    view.toward = rotate(axis_angle(kUp, turn), normalized(lerp(kFront, best, e)));
    view.up = kUp, view.center = lerp(from.center, place.center, e);
    view.width = std::exp(lerp({std::log(from.width), 0, 0}, {std::log(std::max(4e-3f, 4 * place.radius)), 0, 0}, e).x);
    film.add(picture(settings, knot.state, last_tools, view, middle, kind.name, "finished", "seen: " + seen));
  }
  film.finish();
}
}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "knot_films: no folder named; write: knot_films FOLDER [single|granny|square|surgeons...]\n");
    return 2;
  }
  if (!std::filesystem::is_directory(argv[1])) {
    std::fprintf(stderr, "knot_films: %s is no folder; make it first\n", argv[1]);
    return 2;
  }
  const auto named = [&](int i) {
    return [name = "knot_" + std::string(argv[i])](const KnotKind& kind) { return kind.file == name; };
  };
  const auto kinds = knot_kinds();
  for (int i = 2; i < argc; ++i)
    if (std::none_of(kinds.begin(), kinds.end(), named(i))) {
      std::fprintf(stderr, "knot_films: there is no knot \"%s\"; the knots are: single, granny, square, surgeons\n", argv[i]);
      return 2;
    }
  try {
    for (const KnotKind& kind : kinds) {
      bool wanted = argc == 2;
      for (int i = 2; i < argc; ++i) wanted = wanted || named(i)(kind);
      if (wanted) make_film(kind, argv[1]);
    }
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
  }
  return 0;
}
