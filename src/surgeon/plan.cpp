// SPDX-License-Identifier: Apache-2.0
// surgeon/plan: the four techniques of paper 2.5 as lists of tasks. Reads the picture at rest; see plan.h.
#include "surgeon/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "surgeon/sight.h"

namespace catgut {
namespace {

constexpr int kBitesPerThread = 10;
constexpr float kRow = 0.004f;            // [m] between two rows of bites
constexpr float kStaysApart = 0.012f;     // [m] round the bowel, between stay sutures
constexpr float kStitchesApart = 0.005f;  // [m] round the bowel
constexpr float kPull = 2.6f;             // [N] on each strand of a physical throw: below what the bites bear
constexpr float kPullRunning = 2.2f;      // [N] the same of a running suture, whose bites are drawn, too
// [N] the same for bites through half of the wall: both strands pull at each, and with 1.7 N one tore out.
constexpr float kPullShallow = 0.9f;
constexpr float kPullThrough = 1.7f;    // [N] of bites in and out through a whole wall
constexpr float kApproximate = 0.003f;  // [m] of each clamp: the edges touch after 1.5 mm
// A shallow bite in a wall that is held by its edge: it gives way by this much before the tip enters, and springs back onto it.
// Then the needle is lifted; or turned about its tip, else it goes through the wall into the lumen (docs/closure.md).
constexpr float kGivesWay = 0.002f, kScoop = 0.003f;  // [m]
constexpr float kFlatten = 0.4f;                      // [rad]
// Of the wall, where a Lembert bite is lifted. Far from the edge the wall springs back onto the needle when the tip is in.
constexpr float kDeepFar = 0.25f, kDeepNear = 0.45f;
constexpr float kDeepest = 0.9f;        // of the wall: a deeper one is made again
constexpr float kTouch = 0.0003f;       // [m] by which the sides of a slit in skin are brought further than they meet
constexpr float kMobile = 0.0021f;      // [m] that a Lembert suture takes of each end: inverted edges make it shorter
constexpr float kGather = 2.5f;         // [N] of each end of a physical purse-string
constexpr float kGatherByThrow = 3.2f;  // [N] the same through a throw, whose friction takes a part
constexpr int kThrows = 3;
constexpr int kFirstWraps = 2;     // turns of a surgeon's throw, the first of a knot: it gives back less when the hands let go
constexpr int kRingThrows = 4;     // where no clamp draws the edges apart again: only a taut loop keeps two throws from opening
constexpr float kRingPull = 2.6f;  // [N] of its throws; with 1.7 N the loops are 0.2 mm wider
// [m] by which the needle's circle lies deeper than in a rigid wall: a soft one gives way, and the tip enters where it is
// square to it. Less deep, it slid along the serosa and came out through the cut edge.
constexpr float kYields = 0.002f;
constexpr float kYieldsThrough = 0.0045f;  // the same where the needle passes the wall twice, and nothing holds that against it
// The same between the two cut ends: with 2 mm their stitches gaped more when the bowel was pulled (docs/operation_log.md,
// Shallower bites).
constexpr float kRingYields = 0.00075f;
constexpr float kFreeDepth = 0.0045f;  // [m] depth below the rims of a sweep through two layers

// Depth of the needle's circle below a surface of radius `curved` [m] whose chord is `length`.
float depth_of(float length, float needle, float curved) { return length * length / 8 * (1 / needle + 1 / curved); }

// The serosa vertex nearest to the point at distance `edge` below the rim point `on_rim`.
void settle_on_serosa(const VisibleMesh& mesh, Vec3 on_rim, Vec3 axis, Vec3 sideways, float edge, BitePlace& place) {
  float best = std::numeric_limits<float>::max();
  uint32_t found = 0;
  for (uint32_t k = 0; k < mesh.position.size(); ++k) {
    if (mesh.layer[k] != TissueLayer::serosa) continue;
    const Vec3 d = mesh.position[k] - on_rim;
    const float below = length(d - sideways * dot(d, sideways)) - edge, side = dot(d, sideways);
    const float wrong_way = std::max(0.0f, dot(d, axis)), score = below * below + side * side + 4 * wrong_way * wrong_way;
    if (length2(d) < 4 * edge * edge + 1e-5f && score < best) best = score, found = k;
  }
  place.at = mesh.position[found];
  place.out = mesh.normal[found];
}

// `bites` bites round an opening, `edge` from the rim, evenly spaced in length, not in angle: an organ's rim is not circular.
// The first is `ahead` of a space beyond +x.
void places_round(const PictureModel& picture, const SurgeonSkill& skill, int bites, float edge, Plan& plan, float ahead = 0) {
  const OpeningShape o = opening_shape(picture, 0);
  const std::vector<uint32_t>& rim = picture.rim[0];
  const std::vector<Vec3>& rest = picture.particle_rest;
  const Vec3 u = normalized(Vec3{1, 0, 0} - o.axis * o.axis.x, any_perpendicular(o.axis)), v = cross(o.axis, u);
  const size_t n = rim.size();
  auto angle_of = [&](Vec3 p) { return portable::atan2(dot(p - o.center, v), dot(p - o.center, u)); };
  size_t start = 0;
  float turn = 0;
  for (size_t i = 0; i < n; ++i) {
    if (std::abs(angle_of(rest[rim[i]])) < std::abs(angle_of(rest[rim[start]]))) start = i;
    turn += dot(cross(rest[rim[i]] - o.center, rest[rim[(i + 1) % n]] - o.center), o.axis);
  }
  const bool counter = turn > 0;  // clockwise seen from above: the direction in which a right hand turns the needle
  auto rim_at = [&](size_t i) { return rest[rim[(start + (counter ? n - i % n : i % n)) % n]]; };
  std::vector<float> run{0};
  for (size_t i = 0; i < n; ++i) run.push_back(run.back() + distance(rim_at(i), rim_at(i + 1)));
  for (int b = 0; b < bites; ++b) {
    const float want = run.back() * (static_cast<float>(b) + ahead) / static_cast<float>(bites);
    size_t i = 0;
    while (i + 1 < n && run[i + 1] <= want) ++i;
    const Vec3 on_rim = lerp(rim_at(i), rim_at(i + 1), (want - run[i]) / std::max(run[i + 1] - run[i], 1e-6f));
    const Vec3 radial = normalized(on_rim - o.center - o.axis * dot(on_rim - o.center, o.axis));
    BitePlace p;
    settle_on_serosa(picture.body[0], on_rim, o.axis, cross(o.axis, radial), edge, p);
    p.up = o.axis;
    p.length = skill.bite_length;
    p.depth = depth_of(p.length, picture.suture[0].needle_radius, run.back() / (2 * kPi));
    p.level = true;
    plan.place.push_back(p);
  }
}

// A position on the upper side of bowel end `wall`, `angle` from the top and `edge` from the rim.
BitePlace on_top(const PictureModel& picture, uint32_t wall, float angle, float edge) {
  const OpeningShape o = opening_shape(picture, wall);
  const Vec3 top = normalized(Vec3{0, 1, 0} - o.axis * o.axis.y, any_perpendicular(o.axis)), side = cross(top, Vec3{1, 0, 0});
  BitePlace p;
  p.out = top * portable::cos(angle) - side * portable::sin(angle);
  float reach = 0;  // [m] of the rim from its center: less than the radius where the opening is a slit
  for (const uint32_t i : picture.rim[wall]) reach = std::max(reach, dot(picture.particle_rest[i] - o.center, p.out));
  p.at = o.center + p.out * (reach < 0.6f * o.radius ? reach : o.radius) - o.axis * edge;
  p.wall = wall;
  return p;
}

void add(Plan& plan, TaskKind kind, int which = 0, int way = 1) { plan.task.push_back({kind, which, way}); }

// One bite after the other with the same needle. held: the forceps holds the edge against it.
void add_bites(Plan& plan, int bites, bool held) {
  add(plan, TaskKind::pick_up);
  for (int b = 0; b < bites; ++b) {
    if (held) add(plan, TaskKind::hold_edge, b);
    add(plan, TaskKind::bite, b);
    add(plan, b == 0 ? TaskKind::pull_tail : TaskKind::pull_slack);
    if (b + 1 < bites) add(plan, TaskKind::hand_back);
  }
}

// 2-1-1 while clamps hold the edges together, which go back in the last throw: the hands hold it tight until the clamps have
// put the load on the knot. Then hands away.
void tie_and_leave(Plan& plan) {
  for (int i = 0; i < kThrows; ++i) plan.task.push_back({TaskKind::throw_, i == 0 ? kFirstWraps : 1, 1, i + 1 == kThrows});
  add(plan, TaskKind::cut_tail);
  add(plan, TaskKind::cut_long);
  add(plan, TaskKind::leave);
}

Plan purse_string_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.lift = 0.012f;
  places_round(picture, skill, skill.bites, skill.edge_distance, plan);
  add_bites(plan, skill.bites, false);
  add(plan, TaskKind::draw);
  add(plan, TaskKind::rest);
  return plan;
}

// The bites of the same with physical mechanics: the forceps holds the rim against the needle. The knot's place, between the
// last bite and the first one, is where the guided plan begins.
Plan sewn_round(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.lift = 0.012f;
  plan.driver_at = 0.2f, plan.beyond = 0.6f;
  plan.flatten = kFlatten;
  plan.pull = kGather, plan.jerk = 0.1f;
  places_round(picture, skill, skill.bites, skill.edge_distance, plan, 0.5f);
  // The wall gives way by kGivesWay before the tip enters.
  const float radius = picture.suture[0].needle_radius;
  for (BitePlace& p : plan.place) {
    p.depth += kGivesWay, p.deepest = 1;
    p.length = 2 * std::sqrt(p.depth * (2 * radius - p.depth));
  }
  add_bites(plan, skill.bites, true);
  return plan;
}

// The thread alone gathers it, and is let go untied.
Plan purse_string_thread_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = sewn_round(picture, skill);
  add(plan, TaskKind::gather);
  add(plan, TaskKind::leave);
  return plan;
}

// Tied with two throws. The first one gathers the rim; the assistant's forceps holds it until the second one lies on it. The
// knot is on the right.
Plan purse_string_tied_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = sewn_round(picture, skill);
  plan.pull = kGatherByThrow;
  plan.knot_turn = 0.5f * kPi;
  add(plan, TaskKind::regrip);
  plan.task.push_back({TaskKind::throw_, 1, 1, false, 1});
  plan.task.push_back({TaskKind::throw_, 1, 1, false, -1});
  add(plan, TaskKind::cut_tail);
  add(plan, TaskKind::cut_long);
  add(plan, TaskKind::leave);
  return plan;
}

// Running bites in one bowel end, row by row, with a new suture for every row: measures many sutures in one body (paper 3.5).
Plan running_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.lift = 0.012f;
  for (int done = 0, row = 0; done < skill.bites; ++row) {
    const int here = std::min(kBitesPerThread, skill.bites - done);
    places_round(picture, skill, here, skill.edge_distance + kRow * static_cast<float>(row), plan);
    if (row > 0) add(plan, TaskKind::fresh);
    add(plan, TaskKind::pick_up);
    for (int b = 0; b < here; ++b) {
      add(plan, TaskKind::bite, done + b);
      add(plan, b == 0 ? TaskKind::pull_tail : TaskKind::pull_slack);
      if (b + 1 < here) add(plan, TaskKind::hand_back);
    }
    add(plan, TaskKind::regrip);
    add(plan, TaskKind::lock_strand, 1, 1);
    add(plan, TaskKind::cut_long);
    done += here;
  }
  add(plan, TaskKind::rest);
  return plan;
}

// 2.5.2: sweeps along the edge, each outside in and inside out again on one bowel, then straight across to the other. The first
// crossing is tied like a stay suture, so that the thread is held against pull. The last throw locks the running thread. More
// bites than one thread allows continue in a second row, with a new suture.
Plan connell_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  const float radius = opening_shape(picture, 0).radius;
  const float turn = 2 * portable::asin(0.5f * skill.bite_length / radius);
  const int all = (skill.bites + 1) / 2;
  for (int done = 0, row = 0; done < all; ++row) {
    const int sweeps = std::min(kBitesPerThread / 2, all - done);
    for (int s = 0; s < sweeps; ++s) {
      const float angle = turn * (0.5f * static_cast<float>(sweeps - 1) - static_cast<float>(s));
      BitePlace p = on_top(picture, static_cast<uint32_t>(s % 2), angle, skill.edge_distance + kRow * static_cast<float>(row));
      p.up = {1, 0, 0};
      p.length = skill.bite_length;
      p.depth = depth_of(p.length, picture.suture[0].needle_radius, radius);
      p.walls = 2;
      plan.place.push_back(p);
    }
    if (row > 0) add(plan, TaskKind::fresh);
    add(plan, TaskKind::pick_up);
    for (int s = 0; s < sweeps; ++s) {
      add(plan, TaskKind::bite, done + s);
      if (s == 0) add(plan, TaskKind::pull_tail);
      else if (s > 1) add(plan, TaskKind::pull_together);
      if (s == 1) {
        add(plan, TaskKind::pull_slack);
        add(plan, TaskKind::draw);
        add(plan, TaskKind::regrip);
        add(plan, TaskKind::throw_, 1, 1);
        add(plan, TaskKind::throw_, 1, -1);
      }
      if (s + 1 < sweeps) add(plan, TaskKind::hand_back);
    }
    add(plan, TaskKind::regrip);
    add(plan, TaskKind::lock_strand, 1, 1);
    done += sweeps;
    if (done < all) add(plan, TaskKind::cut_long);
  }
  add(plan, TaskKind::rest);
  return plan;
}

// 2.5.3: one bite through each bowel end, across the gap; equalized, tied, the needle cut off, both ends held. With several
// needles: one stay suture with each, side by side from the far side to the near one. All but the last are cut short.
Plan stay_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  const int sutures = static_cast<int>(picture.suture.size());
  const float turn = kStaysApart / opening_shape(picture, 0).radius;
  for (int s = 0; s < sutures; ++s) {
    const float angle = turn * (static_cast<float>(s) - 0.5f * static_cast<float>(sutures - 1));
    for (uint32_t wall = 0; wall < 2; ++wall) {
      BitePlace p = on_top(picture, wall, angle, skill.edge_distance + 0.5f * skill.bite_length);
      p.up = {0, 0.0f - portable::sin(angle), portable::cos(angle)};
      p.length = skill.bite_length;
      p.suture = static_cast<uint32_t>(s);
      p.depth = depth_of(p.length, picture.suture[p.suture].needle_radius, 1e9f);
      plan.place.push_back(p);
    }
    add(plan, TaskKind::pick_up, s);
    add(plan, TaskKind::bite, 2 * s);
    add(plan, TaskKind::hand_back);
    add(plan, TaskKind::bite, 2 * s + 1);
    add(plan, TaskKind::pull_tail);
    add(plan, TaskKind::draw);
    add(plan, TaskKind::regrip);
    add(plan, TaskKind::throw_, 1, 1);
    add(plan, TaskKind::throw_, 1, -1);
    if (s + 1 == sutures) break;
    add(plan, TaskKind::cut_long);
    add(plan, TaskKind::cut_tail);
    add(plan, TaskKind::discard);
  }
  add(plan, TaskKind::take_both);
  add(plan, TaskKind::cut_needle);
  add(plan, TaskKind::rest);
  return plan;
}

// One stitch over the gap between two bowel ends, without a technique: the needle enters `edge_distance` from the edge on one
// side, passes through the whole wall into the gap, and comes out on the other side at the same distance.
Plan stitch_over_gap(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  // A deep bite: a third of the arc from the swage, the jaws would press on the tissue before the tip is out.
  plan.driver_at = 0.15f, plan.beyond = 0.5f;
  const OpeningShape left = opening_shape(picture, 0), right = opening_shape(picture, 1);
  BitePlace p = on_top(picture, 0, 0, 0);
  const Vec3 across = right.center - left.center;
  p.at += across * 0.5f;
  p.up = cross(normalized(across, {1, 0, 0}), p.out);  // so that cross(out, up) leads across
  p.length = length(across) + 2 * skill.edge_distance;
  const float radius = picture.suture[0].needle_radius, half = std::min(0.5f * p.length, 0.95f * radius);
  p.depth = radius - std::sqrt(radius * radius - half * half);
  p.walls = 2;
  plan.place.push_back(p);
  add(plan, TaskKind::pick_up);
  add(plan, TaskKind::bite);
  add(plan, TaskKind::pull_tail);
  add(plan, TaskKind::regrip);
  add(plan, TaskKind::rest);
  return plan;
}

// With physical mechanics.
Plan interrupted_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = stitch_over_gap(picture, skill);
  plan.place[0].depth += kYields;
  plan.pull = kPull;
  return plan;
}

// Over and over with physical mechanics: `bites` stitches side by side, each one sweep through both walls, from the near side
// to the far one, from which the forceps comes. Clamps hold the ends together while both ends of the thread are drawn.
Plan over_and_over_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = interrupted_plan(picture, skill);
  plan.pull = kPullRunning;
  plan.task.clear();
  const BitePlace middle = plan.place[0];
  plan.place.clear();
  const float turn = kStitchesApart / opening_shape(picture, 0).radius;
  for (int s = 0; s < skill.bites; ++s) {
    const Quat by =
        axis_angle(cross(middle.out, middle.up), turn * (0.5f * static_cast<float>(skill.bites - 1) - static_cast<float>(s)));
    const Vec3 center = middle.at - middle.out * opening_shape(picture, 0).radius;
    BitePlace p = middle;
    p.at = center + rotate(by, middle.at - center), p.out = rotate(by, middle.out), p.up = rotate(by, middle.up);
    plan.place.push_back(p);
  }
  add(plan, TaskKind::pick_up);
  for (int s = 0; s < skill.bites; ++s) {
    add(plan, TaskKind::bite, s);
    add(plan, s == 0 ? TaskKind::pull_tail : TaskKind::pull_slack);
    if (s + 1 < skill.bites) add(plan, TaskKind::hand_back);
  }
  plan.approximate = kApproximate;
  add(plan, TaskKind::approximate);
  add(plan, TaskKind::gather);
  add(plan, TaskKind::regrip);
  tie_and_leave(plan);
  return plan;
}

// One stitch, tied with a surgeon's knot while clamps hold the ends together.
Plan interrupted_tied_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = interrupted_plan(picture, skill);
  plan.approximate = kApproximate;
  plan.task.pop_back();
  add(plan, TaskKind::approximate);
  tie_and_leave(plan);
  return plan;
}

// The same in a pad of skin. Flat edges that are pressed slide over each other: they are brought together until they touch.
Plan skin_tied_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = interrupted_tied_plan(picture, skill);
  plan.flat = true;
  plan.approximate = 0.5f * distance(opening_shape(picture, 0).center, opening_shape(picture, 1).center) + kTouch;
  return plan;
}

// Lembert stitches with physical mechanics, side by side from the near side to the far one, with one thread. Each is a bite in
// and out on the outer face of one bowel end, across the wound, then one of the other end: far, near, near, far. The thread
// passes over both edges, which turn inward when it is drawn.
Plan lembert_thread_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  plan.driver_at = 0.15f, plan.beyond = 0.5f;
  plan.scoop = kScoop, plan.pull = kPullShallow, plan.jerk = 0.1f;
  const float radius = picture.suture[0].needle_radius, turn = kStitchesApart / opening_shape(picture, 0).radius;
  const int bites = 2 * skill.bites;
  for (int b = 0; b < bites; ++b) {
    const float angle = turn * (0.5f * static_cast<float>(skill.bites - 1) - static_cast<float>(b / 2));
    BitePlace p = on_top(picture, static_cast<uint32_t>(b % 2), angle, skill.edge_distance + 0.5f * skill.bite_length);
    p.up = cross(Vec3{1, 0, 0}, p.out);  // so that cross(out, up) leads across
    p.depth = depth_of(skill.bite_length, radius, 1e9f) + kGivesWay;
    p.deep = b % 2 == 0 ? kDeepFar : kDeepNear, p.deepest = kDeepest;
    p.length = 2 * std::sqrt(p.depth * (2 * radius - p.depth));
    plan.place.push_back(p);
  }
  add_bites(plan, bites, false);
  plan.approximate = kApproximate, plan.stay = kMobile;
  add(plan, TaskKind::approximate);
  if (skill.bites > 1) add(plan, TaskKind::gather);
  add(plan, TaskKind::regrip);
  tie_and_leave(plan);
  return plan;
}

// One loop of a Connell suture with physical mechanics: outside in and inside out again along the edge of one bowel end,
// straight across, and backhand the same in the other one. The thread runs in the lumen along both edges, and is tied where it
// began.
Plan connell_thread_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  plan.driver_at = 0.15f, plan.beyond = 0.5f;
  plan.tip_lean = 3;  // from above: the needle is turned by half a circle under the forceps before the second bite
  plan.pull = kPullThrough, plan.jerk = 0.1f;
  const float radius = picture.suture[0].needle_radius;
  for (uint32_t wall = 0; wall < 2; ++wall) {
    const OpeningShape o = opening_shape(picture, wall);
    BitePlace p = on_top(picture, wall, 0, skill.edge_distance);
    p.up = o.axis;
    p.depth = depth_of(skill.bite_length, radius, o.radius) + kYieldsThrough;
    p.length = 2 * std::sqrt(p.depth * (2 * radius - p.depth));
    p.walls = 2;
    p.backhand = wall == 1;
    plan.place.push_back(p);
  }
  add_bites(plan, 2, false);
  plan.approximate = kApproximate, plan.stay = 0.5f * kApproximate;  // pressed harder, one edge slides under the other
  add(plan, TaskKind::approximate);
  add(plan, TaskKind::regrip);
  tie_and_leave(plan);
  return plan;
}

// A simple interrupted suture over a slit: one sweep through both edges, tied with two throws, both ends cut.
Plan simple_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan = stitch_over_gap(picture, skill);
  plan.task.pop_back();  // rest
  add(plan, TaskKind::draw);
  add(plan, TaskKind::regrip);
  add(plan, TaskKind::throw_, 1, 1);
  add(plan, TaskKind::throw_, 1, -1);
  add(plan, TaskKind::cut_long);
  add(plan, TaskKind::cut_tail);
  add(plan, TaskKind::rest);
  return plan;
}

// Anastomosis of a cut edge with the inner tube's rim, after surgeon/operation has excised the prolapse: with each suture of
// the scene one stitch, from outside through the outer tube into the gap, and through the inner tube into the lumen. All are at
// the same angle: the surgeon turns the field.
Plan altemeier_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  plan.driver_at = 0.15f, plan.beyond = 0.8f;
  plan.tip_lean = 1.6f, plan.tip_psi = 1.2f, plan.tip_open = 0.4f;  // the tip is in the lumen: from above, over the edges
  plan.pull = kRingPull, plan.rise = true, plan.jerk = 0.1f, plan.lumen = true, plan.aside = kPi / 8;
  const OpeningShape outer = opening_shape(picture, 0), inner = opening_shape(picture, 1);
  const Vec3 radial = -normalized(Vec3{1, 0, 0} - inner.axis * inner.axis.x, any_perpendicular(inner.axis));
  BitePlace p;
  p.at = inner.center + radial * (0.5f * (outer.radius + inner.radius - skill.wall));
  p.out = inner.axis;
  p.up = cross(-radial, inner.axis);  // so that cross(out, up) points inward
  p.length = outer.radius - inner.radius + skill.wall;
  p.depth = kFreeDepth + kRingYields;
  p.wall = 1;
  p.walls = 2;
  for (uint32_t s = 0; s < picture.suture.size(); ++s) {
    const int which = static_cast<int>(s);
    p.suture = s;
    plan.place.push_back(p);
    add(plan, TaskKind::pick_up, which);
    add(plan, TaskKind::hold_edge, which);
    add(plan, TaskKind::bite, which);
    add(plan, TaskKind::pull_tail);
    add(plan, TaskKind::regrip);
    for (int i = 0; i < kRingThrows; ++i) add(plan, TaskKind::throw_, i == 0 ? kFirstWraps : 1, 1);
    add(plan, TaskKind::cut_tail);
    add(plan, TaskKind::cut_long);
    add(plan, TaskKind::leave);
  }
  return plan;
}

// surgeon/excision and surgeon/slit carry them out: nothing of them is a task of the needle.
Plan excision_plan(const PictureModel&, const SurgeonSkill&) { return {}; }

// 2.5.4: single stitches through outer and inner layer round the ring, each tied and cut, with a new suture for the next.
Plan lembert_plan(const PictureModel& picture, const SurgeonSkill& skill) {
  Plan plan;
  plan.forceps_side = -1;
  const OpeningShape outer = opening_shape(picture, 0), inner = opening_shape(picture, 1);
  const Vec3 u = normalized(Vec3{0, 0, 1} - outer.axis * outer.axis.z, any_perpendicular(outer.axis)), v = cross(outer.axis, u);
  // The cut edge exposes the wall's thickness: from the outer rim inward to the mucosa.
  const float wall = skill.wall;
  for (int b = 0; b < skill.bites; ++b) {
    const float angle = 2 * kPi * static_cast<float>(b) / static_cast<float>(skill.bites);
    const Vec3 radial = u * portable::cos(angle) + v * portable::sin(angle);
    BitePlace p;
    const float middle = 0.5f * (outer.radius + inner.radius - wall);
    p.at = outer.center + radial * middle;
    p.out = outer.axis;
    p.up = cross(-radial, outer.axis);  // so that cross(out, up) points inward
    p.length = outer.radius - inner.radius + wall;
    p.depth = kFreeDepth;
    p.walls = 2;
    plan.place.push_back(p);
    add(plan, TaskKind::pick_up);
    add(plan, TaskKind::bite, b);
    add(plan, TaskKind::pull_tail);
    add(plan, TaskKind::regrip);
    add(plan, TaskKind::throw_, 1, 1);
    add(plan, TaskKind::throw_, 1, -1);
    add(plan, TaskKind::cut_long);
    add(plan, TaskKind::cut_tail);
    if (b + 1 < skill.bites) add(plan, TaskKind::fresh);
  }
  add(plan, TaskKind::rest);
  return plan;
}

}  // namespace

BiteFrame bite_frame(const PictureModel& picture, const Snapshot& seen, const BitePlace& b) {
  BiteFrame f;
  Quat turned;
  f.at = live_place(picture, seen, b.at, b.wall, &turned);
  if (b.walls > 1 && picture.rim.size() > 1 && picture.body.size() == 1) {
    // Between two layers: the mean of the positions on either.
    f.at = 0.5f * (f.at + live_place(picture, seen, b.at, 1, nullptr));
    f.out = b.out;
  } else {
    f.out = rotate(turned, b.out);
  }
  if (b.level) f.out = normalized(f.out - b.up * (0.5f * dot(f.out, b.up)));
  f.up = normalized(b.up - f.out * dot(b.up, f.out));
  f.along = cross(f.out, f.up);
  return f;
}

namespace {

struct PlanRow {
  const char* name;
  size_t walls;  // open rims that it needs
  Plan (*make)(const PictureModel&, const SurgeonSkill&);
};
constexpr PlanRow kPlan[] = {{"purse_string", 1, purse_string_plan},
                             {"connell", 2, connell_plan},
                             {"stay", 2, stay_plan},
                             {"lembert", 2, lembert_plan},
                             {"running", 1, running_plan},
                             {"interrupted", 2, interrupted_plan},
                             {"interrupted_tied", 2, interrupted_tied_plan},
                             {"over_and_over", 2, over_and_over_plan},
                             {"purse_string_thread", 1, purse_string_thread_plan},
                             {"purse_string_tied", 1, purse_string_tied_plan},
                             {"lembert_thread", 2, lembert_thread_plan},
                             {"connell_thread", 2, connell_thread_plan},
                             {"skin_tied", 2, skin_tied_plan},
                             {"simple", 2, simple_plan},
                             {"excision", 1, excision_plan},
                             {"slit", 1, excision_plan},
                             {"altemeier", 2, altemeier_plan}};

}  // namespace

std::span<const char* const> plan_names() {
  static constexpr auto kName = [] {
    std::array<const char*, std::size(kPlan)> names{};
    for (size_t i = 0; i < names.size(); ++i) names[i] = kPlan[i].name;
    return names;
  }();
  return kName;
}

std::span<const char* const> task_names() {
  static constexpr const char* kName[] = {"pick_up",       "hold_edge",   "bite",       "draw_out",  "pull_tail", "pull_slack",
                                          "pull_together", "hand_back",   "regrip",     "draw",      "throw",     "lock_strand",
                                          "cut_long",      "cut_tail",    "cut_needle", "take_both", "discard",   "fresh",
                                          "gather",        "approximate", "remove",     "leave",     "rest"};
  static_assert(std::size(kName) == static_cast<size_t>(TaskKind::rest) + 1);
  return kName;
}

Plan make_plan(const std::string& name, const PictureModel& picture, const SurgeonSkill& skill) {
  const auto row = std::find_if(std::begin(kPlan), std::end(kPlan), [&](const PlanRow& r) { return r.name == name; });
  if (row == std::end(kPlan)) throw std::invalid_argument("there is no scripted surgeon for \"" + name + "\"");
  for (size_t w = 0; w < row->walls; ++w)
    if (picture.body.empty() || w >= picture.rim.size() || picture.rim[w].empty())
      throw std::invalid_argument("the scene does not have the openings that \"" + name + "\" works on");
  return row->make(picture, skill);
}

}  // namespace catgut
