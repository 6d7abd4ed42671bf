// SPDX-License-Identifier: Apache-2.0
// validation: the physical thread (src/thread): belt friction on a cylinder, tightening of overhand knots, what knots hold.
#include <algorithm>
#include <cmath>
#include <string>

#include "thread/observe.h"
#include "validation/checks.h"
#include "validation/knot_scenes.h"
#include "validation/swept.h"
#include "validation/tool_ties.h"

namespace catgut::validation {
namespace {

using thread::Hold;
using thread::Plane;
using thread::Pull;
using thread::Settings;
using thread::State;
using thread::Stepper;
using thread::Surroundings;
using thread::ToolCapsule;

// Thread over a fixed cylinder of radius 4.5 mm (40 segments a turn), drawn at `speed` [m/s] against a constant force at its
// other end, or released at that speed. `load` [N] is the larger of the two tensions. Returns ln(T2 / T1) / (mu angle).
double capstan_exponent(float degrees, float mu, float load, bool drawn, float speed = 10e-3f) {
  Settings settings = knot_settings(mu);
  settings.material.bending_stiffness = 1e-9f;  // limp: bending stiffness would carry part of a load without friction
  settings.damping = 0;
  const float angle = degrees * kPi / 180, radius = 4.5e-3f, r = radius + 0.5f * settings.material.diameter, l = 0.7e-3f;
  const float pitch = degrees > 300 ? 0.6e-3f : 0;  // a helix beyond one turn
  auto at = [&](float a) { return Vec3{r * std::cos(a), r * std::sin(a), pitch * a / (2 * kPi)}; };
  const Vec3 first{0, -1, 0}, last{-std::sin(angle), std::cos(angle), 0};
  const int lead = 17, tail = 28, wound = std::max(1, static_cast<int>(std::lround(angle * r / l)));
  std::vector<Vec3> path;
  for (int i = lead; i > 0; --i) path.push_back(at(0) + first * (l * static_cast<float>(i)));
  for (int i = 0; i <= wound; ++i) path.push_back(at(angle * static_cast<float>(i) / static_cast<float>(wound)));
  for (int i = 1; i <= tail; ++i) path.push_back(at(angle) + last * (l * static_cast<float>(i)));
  State state = thread::make_state(path);
  Stepper stepper(path.size());
  ToolCapsule cylinder;
  cylinder.a = cylinder.to_a = {0, 0, -0.03f}, cylinder.b = cylinder.to_b = {0, 0, 0.03f};
  cylinder.radius = radius, cylinder.friction = mu;
  Hold hold;
  hold.node = 0, hold.from = hold.to = path[0];
  const float weight = drawn ? load * std::exp(-mu * angle) : load;
  const Pull pull{static_cast<uint32_t>(path.size()) - 1, last * weight};
  Surroundings around;
  around.holds = {&hold, 1}, around.pulls = {&pull, 1}, around.tools = {&cylinder, 1};
  // It slides by 5 mm until it does so all round, and by 5 mm while the force is taken.
  const int rest = 100, slide = static_cast<int>(std::lround(5 / speed));
  double sum = 0;
  for (int i = 0; i < rest + 2 * slide; ++i) {
    hold.from = hold.to;
    if (i >= rest) hold.to += first * (drawn ? 1e-3f * speed : -1e-3f * speed);
    stepper.step(settings, state, around);
    if (i >= rest + slide) sum += double{length(hold.force)};
  }
  return std::log(sum / slide / double{weight}) / double{mu * angle} * (drawn ? 1 : -1);
}

// Thread over a straight, fixed thread along z, whose end at `curve`'s beginning is drawn along `way` against `weight` [N]
// along `down` at the other one. Returns the mean force [N] at the drawn end, from `slide` to `slide` + `count` [ms] of
// drawing.
double draw_over_thread(Settings settings, const std::vector<Vec3>& curve, float coarse, Vec3 way, float speed, Vec3 down,
                        float weight, int slide, int count) {
  settings.damping = 0;
  const float l = coarse * settings.material.diameter;
  const uint32_t bar = 41;
  std::vector<Vec3> path;
  for (uint32_t i = 0; i < bar; ++i) path.push_back({0, 0, l * (static_cast<float>(i) - 19.63f)});
  for (const Vec3& p : resample(curve, l)) path.push_back(p);
  State state = thread::make_state(path);
  state.broken[bar - 1] = 1;
  Stepper stepper(path.size());
  std::vector<Hold> hold(bar + 1);  // of the bar; of the drawn end
  for (uint32_t i = 0; i <= bar; ++i) hold[i].node = i, hold[i].from = hold[i].to = path[i];
  const Pull pull{static_cast<uint32_t>(path.size()) - 1, down * weight};
  Surroundings around;
  around.holds = hold, around.pulls = {&pull, 1};
  const int rest = 100;
  double sum = 0;
  for (int i = 0; i < rest + slide + count; ++i) {
    hold[bar].from = hold[bar].to;
    if (i >= rest) hold[bar].to += way * (1e-3f * speed);
    stepper.step(settings, state, around);
    if (i >= rest + slide) sum += double{length(hold[bar].force)};
  }
  return sum / count;
}

// By half a turn, segments of `coarse` diameters: there only two to four contacts bear the load. Returns the exponent as above.
double over_thread_exponent(float coarse, float mu) {
  Settings settings = knot_settings(mu);
  settings.material.friction_load = 0;
  settings.material.bending_stiffness = 1e-9f;
  const float d = settings.material.diameter;
  std::vector<Vec3> curve;
  for (int i = 0; i < 2000; ++i) curve.push_back({d, -15e-3f * (1 - static_cast<float>(i) / 2000), 0});
  for (int i = 0; i < 2000; ++i) {
    const float a = kPi * static_cast<float>(i) / 2000;
    curve.push_back({d * std::cos(a), d * std::sin(a), 0});
  }
  for (int i = 0; i < 2000; ++i) curve.push_back({-d, -25e-3f * static_cast<float>(i) / 2000, 0});
  const float weight = 2 * std::exp(-mu * kPi);
  const Vec3 down{0, -1, 0};
  return std::log(draw_over_thread(settings, curve, coarse, down, 20e-3f, down, weight, 150, 350) / double{weight}) /
         double{mu * kPi};
}

// By 60 degrees, at 5 mm/s. Returns friction over mu N (0.3 N / N)^(1/8), where N bears the two tensions.
double power_law_ratio(float weight) {
  constexpr float kMu = 0.3f, kAngle = kPi / 3;
  Settings settings = knot_settings(kMu);
  settings.material.bending_stiffness = 1e-11f, settings.material.elastic_curvature = 0;
  const float d = settings.material.diameter, sine = std::sin(kAngle / 2), cosine = std::cos(kAngle / 2);
  const Vec3 top{0, d / cosine, 0}, right{cosine, -sine, 0}, left{-cosine, -sine, 0};
  std::vector<Vec3> curve;
  for (int i = 0; i < 2000; ++i) curve.push_back(top + right * (15e-3f * (1 - static_cast<float>(i) / 2000)));
  for (int i = 0; i <= 2000; ++i) curve.push_back(top + left * (25e-3f * static_cast<float>(i) / 2000));
  // It slides all round after 1 mm. Then six nodes of 1.43 diameters pass the bar.
  const double taut = draw_over_thread(settings, curve, 1.43f, right, 5e-3f, left, weight, 200, 600), slack = double{weight};
  // The normal forces of the arc add up to angle T, their vector sum N is 2 sin(angle / 2) T.
  const double load = (taut + slack) * double{sine};
  return std::log(taut / slack) / (double{kMu * kAngle} * std::pow(0.3 / load, 0.125));
}

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

// Arithmetic-geometric mean: complete elliptic integrals of parameter m.
void elliptic(double m, double& k, double& e) {
  double a = 1, b = std::sqrt(1 - m), power = 0.5, sum = power * m;
  for (int i = 0; i < 40; ++i) {
    const double c = 0.5 * (a - b), next = 0.5 * (a + b);
    b = std::sqrt(a * b), a = next, power *= 2;
    sum += power * c * c;
  }
  k = double{kPi} / (2 * a), e = k * (1 - sum);
}

// Force [N] that tightens an overhand knot of n turns, thread radius r, end-to-end shortening e: Jawed et al. 2015, eq. 5.
double overhand_force(int n, double r, double shortening, double mu, double stiffness) {
  const double c = std::sqrt(3.0) * double{kPi} * double{kPi}, want = n * n * r / shortening;
  double low = 1e-9, high = 0.9999, x = 0;
  for (int i = 0; i < 100; ++i) {
    const double m = 0.5 * (low + high);
    double k, e;
    elliptic(m, k, e);
    x = 8 * (k - e) / m - 4 * k;
    (x * x / (x + 4 * k) / (8 * c) < want ? low : high) = m;
  }
  return mu * x * x * x / (96 * c) * stiffness / (n * n * r * r);
}

struct Overhand {
  double worst = 1;         // ratio of measured to expected force that differs most from 1
  double from = 0, to = 0;  // [m] range of the shortening
};

// An overhand knot of n turns around a loop of 200 mm, tightened at 50 mm/s; ratios every 5 mm of shortening, in steady
// motion.
Overhand tighten_overhand(int n, float mu, double end) {
  Settings settings = knot_settings(mu);
  settings.material.bending_stiffness = 1e-5f;
  settings.material.elastic_curvature = 0, settings.material.friction_load = 0;  // as in the formula
  settings.substep = 25e-6f, settings.substeps = 40, settings.iterations = 2;
  const float d = settings.material.diameter, l = 1e-3f, loop = 0.2f, big = loop / (2 * kPi), r = 0.7f * d;
  const float turns = static_cast<float>(2 * n + 1) * kPi;
  const float braid = std::min(3.75f * static_cast<float>(n) * std::sqrt(std::sqrt(12.0f) * d * big), 0.6f * loop),
              w = 0.5f * braid;
  std::vector<Vec3> fine;
  auto line = [&](Vec3 from, Vec3 to) {
    for (int i = 0; i < 1000; ++i) fine.push_back(lerp(from, to, static_cast<float>(i) / 1000));
  };
  auto helix = [&](float phase) {
    for (int i = 0; i < 1000; ++i) {
      const float x = braid * (static_cast<float>(i) / 1000 - 0.5f), angle = phase + turns * x / braid;
      fine.push_back({x, r * std::cos(angle), r * std::sin(angle)});
    }
  };
  const float lead = 0.06f, phase = kPi + 0.5f * turns;
  line({-w - lead, -r, 0}, {-w, -r, 0});
  helix(phase);
  const float circle = std::max(big, 1.05f * w), height = r + std::sqrt(circle * circle - w * w);
  const float from = std::atan2(r - height, w), to = std::atan2(r - height, -w) + 2 * kPi;
  for (int i = 0; i < 3000; ++i) {
    const float a = from + (to - from) * static_cast<float>(i) / 3000;
    fine.push_back({circle * std::cos(a), height + circle * std::sin(a), 0});
  }
  helix(phase + kPi);
  line({w, -r, 0}, {w + lead, -r, 0});
  const std::vector<Vec3> path = resample(fine, l);
  State state = thread::make_state(path);
  Stepper stepper(path.size());
  Hold hold[2];
  hold[0].node = 0, hold[1].node = static_cast<uint32_t>(path.size()) - 1;
  for (Hold& h : hold) h.from = h.to = state.position(h.node);
  double total = 0;
  for (float rest : state.rest) total += double{rest};
  Overhand result;
  double sum = 0;
  for (int i = 1;; ++i) {
    for (Hold& h : hold) h.from = h.to;
    if (i > 100) hold[1].to.x += 50e-6f * std::min(1.0f, static_cast<float>(i) / 200);
    Surroundings around;
    around.holds = hold;
    stepper.step(settings, state, around);
    sum += 0.5 * double{hold[1].force.x - hold[0].force.x};
    if (i % 100 != 0) continue;
    const double shortening = total - double{hold[1].to.x - hold[0].to.x};
    const double ratio = sum / 100 / overhand_force(n, 0.5 * double{d}, shortening, double{mu}, 1e-5);
    sum = 0;
    if (i < 800) continue;  // the laid braid settles first
    if (result.from == 0) result.from = shortening;
    result.to = shortening;
    const double off = std::max(ratio, 1 / ratio);
    if (off > result.worst) result.worst = off;
    if (shortening < end) return result;
  }
}

struct Kind {
  const char* name;
  Throws throws;
};

// `place`: where the nodes lie along the thread, in segments.
Holding hold_knot(const Throws& throws, const Settings& settings, float tails, Drawing drawing = Drawing::flat, float limit = 8,
                  float place = 0) {
  const float l = 1.43f * settings.material.diameter;
  Tightened t(lay_knot(throws, settings.material.diameter, l, 15e-3f + place * l));
  tighten(settings, t, 2, drawing);
  return pull_apart(settings, t, tails, 0.02f, limit);
}

}  // namespace

void check_capstan(Lines& out, bool nightly) {
  auto line = [&](float degrees, float mu, float load, bool drawn) {
    out.add("capstan/" + number(double{degrees}) + " deg, mu " + number(double{mu}) + ", " + number(double{load}) +
                (drawn ? " N, drawn" : " N, let go"),
            1, capstan_exponent(degrees, mu, load, drawn), 0.03, "exponent", "Euler-Eytelwein: T2 = T1 exp(mu angle)");
  };
  for (float coarse : {1.0f, 1.43f, 2.0f})
    out.add("capstan/180 deg over a thread, mu 0.3, 2 N, drawn, segments of " + number(double{coarse}) + " diameters", 1,
            over_thread_exponent(coarse, 0.3f), 0.15, "exponent", "Euler-Eytelwein; two to four contacts for the whole arc");
  for (const float weight : {0.2f, 0.8f, 3.2f})
    out.add(
        "capstan/60 deg over a thread, friction as load to the power 7/8, mu 0.3 at 0.3 N, " + number(double{weight}) + " N", 1,
        power_law_ratio(weight), 0.05, "", "F = mu N (0.3 N / N)^(1/8); Howell and Mazur 1953");
  if (!nightly) {
    line(90, 0.1f, 0.5f, true), line(180, 0.4f, 10, false), line(360, 0.2f, 2, true), line(360, 0.3f, 2, false),
        line(720, 0.3f, 10, true);
    return;
  }
  for (float degrees : {90.0f, 180.0f, 360.0f, 720.0f})
    for (float mu : {0.1f, 0.2f, 0.3f, 0.4f})
      for (float load : {0.5f, 2.0f, 10.0f})
        for (bool drawn : {true, false}) line(degrees, mu, load, drawn);
  // The slack end of the last one carries 3.3 mN, and the inner damping brakes thread that slides round a curve. The law knows
  // no speed: half of it, half of the error.
  out.add("capstan/720 deg, mu 0.4, 0.5 N, let go at 5 mm/s", 1, capstan_exponent(720, 0.4f, 0.5f, false, 5e-3f), 0.03,
          "exponent", "Euler-Eytelwein: T2 = T1 exp(mu angle)");
}

void check_overhand(Lines& out, bool nightly) {
  auto line = [&](int n, float mu, double end) {
    const Overhand knot = tighten_overhand(n, mu, end);
    out.add("knot/overhand, " + number(n) + " turns, mu " + number(double{mu}) + ", shortening " +
                number(std::round(1e3 * knot.from)) + " to " + number(std::round(1e3 * knot.to)) + " mm",
            1, knot.worst, 0.25, "of the force",
            "Jawed et al. 2015, 10.1103/PhysRevLett.115.118302; worst of the range, ratio or inverse");
  };
  if (!nightly) return line(2, 0.3f, 0.16);
  for (int n : {2, 3})
    for (float mu : {0.1f, 0.3f}) line(n, mu, 0.1);
}

void check_holding(Lines& out, bool nightly) {
  // Below the friction at which they lock, with free tails: only the knot holds.
  // A knot's peak depends on where its nodes lie: mean of three places.
  const float mu = 0.14f;
  const Settings settings = knot_settings(mu);
  const auto peak = [&](const Throws& throws) {
    float sum = 0;
    for (const float place : {0.0f, 0.33f, 0.67f}) sum += hold_knot(throws, settings, 0, Drawing::flat, 8, place).peak / 3;
    return sum;
  };
  const float single = peak(single_throw()), two_granny = peak(granny()), two = peak(square()), three = peak(three_throws());
  const std::string source = "order known to every surgeon; Patil et al. 2020, 10.1126/science.aaz0135";
  auto below = [&](const std::string& name, float less, float more) {
    out.add("knot/" + name + ", share of the stronger at mu 0.14, mean of three places of the nodes", 0, double{less / more},
            0.9, "", source);
  };
  below("single throw below granny", single, two_granny);
  below("granny below square", two_granny, two);
  below("two square throws below three", two, three);

  // Halving the substep: force while it slides, with 0.2 N on the tails (free tails make the result bistable).
  for (const Kind& kind : {Kind{"granny", granny()}, Kind{"square", square()}}) {
    if (!nightly && kind.throws[1].hand < 0) continue;
    for (float m : {0.08f, 0.1f}) {  // near 0.15 it depends on trifles whether they lock, and a locked knot tests nothing
      if (!nightly && m < 0.09f) continue;
      Settings whole = knot_settings(m), half = whole;
      half.substep *= 0.5f, half.substeps *= 2;
      const float expected = hold_knot(kind.throws, whole, 0.2f).mean, got = hold_knot(kind.throws, half, 0.2f).mean;
      out.add(std::string("knot/") + kind.name + ", force while sliding at half the substep, mu " + number(double{m}),
              double{expected}, double{got}, 0.1, "N", "invariance");
    }
  }

  // Drabble et al. 2021, polyglactin 2-0: flat 1.2 mm, hands uncrossed 18.5 mm, tied under tension 50.6 mm of slip. Here at
  // most 8 mm; mean of five frictions round that at which the square knot locks, and of places of its nodes.
  const std::string drabble = "order of Drabble et al. 2021, 10.1136/bmjsit-2021-000091: 1.2, 18.5, 50.6 mm";
  const int placed = nightly ? 6 : 2;
  auto slip = [&](Drawing drawing) {
    double sum = 0;
    for (float m : {0.2f, 0.25f, 0.3f, 0.35f, 0.4f})
      for (int k = 0; k < placed; ++k) {
        Settings braid;
        braid.material = thread::properties(thread::Material::polyglactin_910, thread::Size::usp_2_0);
        braid.material.friction = m, braid.breaks = false;
        const float place = static_cast<float>(k) / static_cast<float>(placed);
        sum += 1e3 * double{hold_knot(square(), braid, 0, drawing, 3, place).slip};
      }
    return sum / (5 * placed);
  };
  const double flat = slip(Drawing::flat), uncrossed = slip(Drawing::uncrossed);
  out.add("knot/slip to 3 N, mm: flat square " + number(flat) + " as a share of uncrossed " + number(uncrossed), 0,
          flat / uncrossed, 0.9, "", drabble);
  if (nightly) {  // the two differ by less than single knots do
    const double tense = slip(Drawing::under_tension);
    out.add("knot/slip to 3 N, mm: uncrossed as a share of tied under tension " + number(tense), 0, uncrossed / tense, 0.9, "",
            drabble);
  }

  const Settings held = knot_settings(0.3f);
  auto creeps = [&](float coarse, float load, double seconds) {
    Tightened t(lay_knot(square(), held.material.diameter, coarse * held.material.diameter));
    tighten(held, t, 2);
    out.add("knot/creep of a square knot at " + number(double{load}) + " N for " + number(seconds) + " s, segments of " +
                number(double{coarse}) + " diameters",
            0, 1e6 * creep(held, t, load, seconds, seconds / 2), 1, "um/s", "a knot that holds does not creep");
  };
  // It may settle in the first seconds. At mu 0.3 the knot is near the friction at which it locks.
  for (const float coarse : {1.0f, 1.43f, 2.0f})
    for (const float load : {0.3f, 1.0f, 3.0f}) {
      if (nightly) creeps(coarse, load, 60);
      else if (coarse == 1.43f ? load == 3 : coarse == 2 && load == 1) creeps(coarse, load, 8);
    }

  // Square knots of the friction from which all hold, laid with their nodes at different places along the thread.
  const Settings locks = knot_settings(0.34f);
  int count = 0, kept = 0;
  for (float coarse : {1.0f, 1.43f, 2.0f})
    for (int k = 0; k < 4; ++k) {
      if (!nightly && (coarse < 1.2f || k % 2 > 0)) continue;
      const float d = locks.material.diameter, l = coarse * d;
      Tightened t(lay_knot(square(), d, l, 15e-3f + 0.25f * static_cast<float>(k) * l));
      tighten(locks, t, 2);
      kept += pull_apart(locks, t).held, ++count;
    }
  out.add("knot/square knots at mu 0.34 that hold 8 N, of " + number(count) + ": segments of " +
              (nightly ? "1, 1.43 and 2" : "1.43 and 2") + " diameters, nodes at different places",
          count, kept, 0, "", "holding does not depend on the segments");
}

void check_shaking(Lines& out, bool nightly) {
  for (const Kind& kind : {Kind{"square", square()}, Kind{"granny", granny()}}) {
    if (!nightly && kind.throws[1].hand > 0) continue;
    Settings settings = knot_settings(0.4f);
    Tightened t(lay_knot(kind.throws, settings.material.diameter, 1.43f * settings.material.diameter));
    tighten(settings, t, 2);
    const int cycles = nightly ? 100 : 6;
    const Shaken shaken = shake(settings, t, cycles, 0.5f, 5);
    const std::string name = std::string("knot/") + kind.name + " shaken " + number(cycles) + " times at 0.5 m/s and 5 N, ";
    out.add(name + "strands that pass through each other", 0, shaken.passes, 0, "", "motion of every pair in every substep");
    out.add(name + "strands nearer than a diameter by", 0, 1 - double{shaken.nearest}, 0.2, "diameters", "nothing passes");
  }
}

// How many of `places` knots, laid with their nodes at so many places along the thread, hold `limit` [N] with free tails.
// `coarse`: diameters in a segment.
int holding(const Throws& throws, const Settings& settings, float limit, float coarse, int places) {
  const float d = settings.material.diameter, l = coarse * d;
  int held = 0;
  for (int k = 0; k < places; ++k) {
    Tightened t(lay_knot(throws, d, l, 15e-3f + l * static_cast<float>(k) / static_cast<float>(places)));
    tighten(settings, t, 2);
    held += pull_apart(settings, t, 0, 0.02f, limit).held;
  }
  return held;
}

// On record: the friction from which each knot holds 8 N, and how many throws of each thread hold.
void check_locking(Lines& out) {
  struct Expected {
    Kind kind;
    int places, step;  // step of the friction [percent]
    float coarse;      // diameters in a segment
    double one, all;   // friction from which one of the laid holds, and all hold
  };
  const Kind two{"square", square()}, slip{"granny", granny()};
  for (const Expected& e :
       {Expected{two, 4, 2, 1, 0.28, 0.30}, Expected{two, 4, 2, 1.43f, 0.26, 0.34}, Expected{two, 4, 2, 2, 0.22, 0.26},
        Expected{slip, 3, 4, 1, 0.38, 0.42}, Expected{slip, 3, 4, 1.43f, 0.34, 0.34}, Expected{slip, 3, 4, 2, 0.34, 0.34}}) {
    // Downward, because single frictions below the threshold may hold by chance.
    const int first = e.step == 2 ? 38 : 42;
    int one = first, all = first;
    for (int percent = first; percent >= 22; percent -= e.step) {
      const int held = holding(e.kind.throws, knot_settings(0.01f * static_cast<float>(percent)), 8, e.coarse, e.places);
      if (held == e.places && all == percent + (percent < first ? e.step : 0)) all = percent;
      if (held == 0) break;
      one = percent;
    }
    const std::string what =
        " of " + number(e.places) + " laid hold 8 N (segments of " + number(double{e.coarse}) + " diameters; 0.22: or less)";
    out.add(std::string("knot/") + e.kind.name + ", friction from which all" + what, e.all, 0.01 * all, 0.15, "",
            "on record: docs/thread.md");
    out.add(std::string("knot/") + e.kind.name + ", friction from which one" + what, e.one, 0.01 * one, 0.15, "",
            "on record: docs/thread.md");
  }

  // Throws of a square knot that hold 5 N in each material of 3-0, laid, tightened at 2 N, free tails; 7: none up to six.
  struct Held {
    thread::Material material;
    double throws, coarser;  // with segments of 1.43 and of 2 diameters
  };
  for (const Held& e : {Held{thread::Material::silk, 2, 2}, Held{thread::Material::polyglactin_910, 3, 2},
                        Held{thread::Material::polypropylene, 6, 5}, Held{thread::Material::polydioxanone, 7, 7}})
    for (const float coarse : {1.43f, 2.0f}) {
      Settings settings;
      settings.material = thread::properties(e.material, thread::Size::usp_3_0);
      settings.breaks = false;
      Throws throws = single_throw();
      bool held = false;
      while (!held && throws.size() < 7) {
        throws.push_back({3, -throws.back().hand});
        held = throws.size() < 7 && holding(throws, settings, 5, coarse, 3) == 3;
      }
      out.add("knot/throws of " + std::string(settings.material.name) + " that hold 5 N, segments of " +
                  number(double{coarse}) + " diameters (7: more than six)",
              coarse < 2 ? e.throws : e.coarser, static_cast<double>(throws.size()), 0.25, "", "on record: docs/thread.md");
    }
}

// Knots of all kinds laid round a rod, right and left, wound, snug and finished: named by `observe`.
void check_names(Lines& out, bool nightly) {
  struct Case {
    Throws throws;
    thread::KnotName name;
  };
  using thread::KnotName;
  const Case cases[] = {{single_throw(), KnotName::single_throw},
                        {{{5, 1}}, KnotName::single_throw},
                        {granny(), KnotName::granny},
                        {square(), KnotName::square},
                        {surgeons(), KnotName::surgeons},
                        {{{3, 1}, {5, -1}}, KnotName::square},
                        {three_throws(), KnotName::square},
                        {{{3, 1}, {3, 1}, {3, 1}}, KnotName::granny},
                        {{{3, 1}, {3, 1}, {3, -1}}, KnotName::mixed},
                        {{{3, 1}, {3, -1}, {3, -1}}, KnotName::mixed},
                        {surgeons_211(), KnotName::surgeons},
                        {{{3, 1}, {3, -1}, {3, 1}, {3, -1}}, KnotName::square}};
  const Settings settings = knot_settings(0.3f);
  int named = 0, all = 0;
  for (const Case& c : cases)
    for (const int mirror : {1, -1}) {
      if (!nightly && (mirror < 0 || c.throws.size() < 3)) continue;
      Throws throws = c.throws;
      for (Throw& t : throws) t.hand *= mirror;
      Tightened t(lay_on_rod(throws, settings.material.diameter, 1.43f * settings.material.diameter));
      for (const float tails : {0.0f, 0.3f, 2.0f}) {
        // Drawn straight, a single throw slips off its ends and is gone.
        if (throws.size() == 1 && tails > 0) continue;
        if (tails > 0) tighten(settings, t, tails, Drawing::flat, 0.2f, false);
        const thread::SeenKnot seen = thread::observe(settings, t.knot.state);
        bool right = seen.name == c.name && seen.throws == throws.size();
        for (uint32_t k = 0; right && k < seen.throws; ++k)
          right = static_cast<int>(seen.item[k].half_turns) == throws[k].half_turns && seen.item[k].hand == throws[k].hand;
        named += right, ++all;
      }
    }
  out.add("knot/named right of " + number(all) + " laid knots, every throw with its wraps and hand", all, named, 0, "",
          "as laid");

  // With a cut bite that lies along the tails, these end between the bite's ends, and led away they make another knot. Nothing
  // has passed through anything.
  Settings fine = settings;
  fine.substeps = 1;
  Tightened cut(lay_knot(surgeons_211(), settings.material.diameter, 1.43f * settings.material.diameter));
  const LaidKnot& k = cut.knot;
  std::vector<thread::Hold> hold(2);
  hold[0].node = k.load_a, hold[1].node = k.load_b;
  for (thread::Hold& h : hold) h.from = h.to = k.state.position(h.node), h.stiffness = 500;
  std::vector<Place> before = places(k.state);
  int passed = 0;
  const int steps = nightly ? 16000 : 5000;
  for (int i = 0; i < steps; ++i) {
    const float force = std::min(2.0f, 1e-3f * static_cast<float>(i));
    const std::vector<thread::Pull> pull{{k.tail_a(), k.tail_direction_a * force}, {k.tail_b(), k.tail_direction_b * force}};
    thread::Surroundings around;
    around.holds = hold, around.pulls = pull;
    cut.stepper.step(fine, cut.knot.state, around);
    std::vector<Place> after = places(k.state);
    passed += count_passes(before, after, k.state.broken);
    before = std::move(after);
  }
  out.add("knot/segments that passed through each other while a 2-1-1 was drawn to 2 N, in " + number(steps) + " substeps", 0,
          passed, 0, "", "motion of every pair in every substep");
}

void check_ties(Lines& out, bool nightly) {
  struct Case {
    const char* name;
    Tie tie;
    uint64_t determinant;
    thread::KnotName seen;
  };
  const Case cases[] = {{"single throw", {{1}}, 3, thread::KnotName::single_throw},
                        {"double throw", {{2}}, 5, thread::KnotName::single_throw},
                        {"square knot", {{1}, {1}}, 9, thread::KnotName::square},
                        {"granny", {{1}, {1, false}}, 9, thread::KnotName::granny},
                        {"surgeon's 2-1", {{2}, {1}}, 15, thread::KnotName::surgeons},
                        {"three throws", {{1}, {1}, {1}}, 27, thread::KnotName::square},
                        {"surgeon's 2-1-1", {{2}, {1}, {1}}, 45, thread::KnotName::surgeons}};
  const std::string source = "determinant of the knot that the hands' paths make; Burde et al. 2014, 10.1515/9783110270785";
  const Settings settings = knot_settings(0.25f);
  double nearest = 1, missed = 0;
  int named = 0, sliding = 0, ties = 0, rewound = 0;
  // Every seed counts, none is repeated.
  auto row = [&](const Case& c, int speed, int first, int count) {
    int right = 0;
    for (int k = 0; k < count; ++k) {
      TieSettings how;
      how.seed = static_cast<uint64_t>(first + k);
      how.speed = 0.1f * static_cast<float>(speed);
      const TiedKnot knot = tie_with_tools(settings, c.tie, how);
      nearest = std::min(nearest, double{knot.nearest});
      missed += knot.missed;
      rewound += knot.rewound;
      right += knot.determinant == c.determinant;
      const thread::SeenKnot seen = thread::observe(settings, knot.state);
      uint32_t wraps = 0;
      for (const TiedThrow& tied : c.tie) wraps += static_cast<uint32_t>(tied.wraps);
      named += seen.name == c.seen && seen.throws == c.tie.size() && seen.wraps == wraps;
      sliding += seen.sliding;
      ++ties;
    }
    out.add("knot/right of " + number(count) + " ties with tools at " + number(0.1 * speed) + " m/s: " + c.name, count, right,
            0, "", source);
  };
  if (!nightly) {
    row(cases[1], 3, 0, 1);
    row(cases[2], 2, 19, 1);  // its strand once ran out of the fingers and caught the tail
  } else {
    constexpr int kTies = 7;
    for (const Case& c : cases)
      for (int speed = 1; speed <= 5; ++speed) row(c, speed, kTies * speed, kTies);
  }
  out.add("knot/named right of " + number(ties) + " ties with tools, of which " + number(sliding) +
              " seen to have capsized into half hitches; made again: " + number(rewound),
          ties, named, 0, "", "throws and wraps that the hands made");
  out.add("knot/jaws closed beside the tail, in all ties", 0, missed, 0, "",
          "the needle holder takes what lies between its jaws");
  out.add("knot/smallest distance of strands in all ties, missing from a diameter", 0, 1 - nearest, 0.2, "diameters",
          "nothing passes: two thicknesses cannot share a place");
}

}  // namespace catgut::validation
