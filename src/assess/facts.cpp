// SPDX-License-Identifier: Apache-2.0
// assess: see facts.h.
#include "assess/facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "assess/motion.h"
#include "core/elementary.h"

namespace catgut::assess {
namespace {

constexpr double kMm = 1000, kDegrees = 180 / 3.14159265358979323846;
constexpr double kSampleRate = 60;  // [1/s] of the hands, at least
constexpr float kOpenJaw = 0.5f, kClosedJaw = 0.15f;
constexpr double kTremorApart = 1.0 / 30;  // [s]
constexpr double kGraspTime = 0.1;         // [s] closed on nothing; a surgeon who sees it opens the jaws at once
constexpr double kLeastTurn = 0.2;         // [rad] a needle that turned less was pushed

double degrees_to_surface(Vec3 direction, Vec3 normal) {
  return portable::asin(std::min(1.0, std::abs(static_cast<double>(dot(direction, normal))))) * kDegrees;
}

double angle_between(Quat a, Quat b) {  // [rad]; also where rounding has changed their lengths
  const Quat d = conjugate(a) * b;
  return 2 * portable::atan2(static_cast<double>(length(Vec3{d.x, d.y, d.z})), std::abs(static_cast<double>(d.w)));
}

// Every `step` seconds of `ticks`.
bool sampled(const Facts& f, uint64_t ticks, double step) {
  const auto every = std::max<uint64_t>(1, static_cast<uint64_t>(step / f.setup.tick_s + 0.5));
  return ticks % every == 0;
}
double turn_since(Quat& last, Quat now) {  // [rad]
  const double turn = angle_between(last, now);
  last = now;
  return turn;
}

double wander_of(const std::vector<Vec3>& center) {  // [m]
  if (center.empty()) return 0;
  std::array<double, 3> mean{};
  double squares = 0;
  const double n = static_cast<double>(center.size());
  for (const Vec3& c : center)
    for (size_t axis = 0; axis < 3; ++axis) mean[axis] += static_cast<double>(c[static_cast<int>(axis)]) / n;
  for (const Vec3& c : center)
    for (size_t axis = 0; axis < 3; ++axis) {
      const double off = static_cast<double>(c[static_cast<int>(axis)]) - mean[axis];
      squares += off * off;
    }
  return std::sqrt(squares / n);
}

// From the middle of the places before and after: steady motion, also with the tissue, counts as none; 8 Hz counts by 1.1.
double tremor_of(const std::vector<Vec3>& center, double tick_s) {  // [m]
  const auto apart = static_cast<size_t>(kTremorApart / tick_s + 0.5);
  if (apart == 0 || center.size() < 2 * apart + 5) return kNotObserved;
  double squares = 0;
  for (size_t i = apart; i + apart < center.size(); ++i)
    squares += static_cast<double>(length2(center[i] - 0.5f * (center[i - apart] + center[i + apart])));
  return std::sqrt(squares / static_cast<double>(center.size() - 2 * apart));
}

// Path of the tip over its distance, from where it last came nearer than kApproach to its place now.
double approach_of(const std::vector<Vec3>& tip) {
  double path = 0;
  if (tip.empty()) return kNotObserved;
  for (size_t i = tip.size() - 1; i > 0; --i) {
    path += static_cast<double>(distance(tip[i], tip[i - 1]));
    const float left = distance(tip[i - 1], tip.back());
    if (left >= kApproach) return path / static_cast<double>(left);
  }
  return kNotObserved;
}

Vec3 tip_of(const NeedleView& needle, const SuturePicture& shape) {
  return transform(needle.pose,
                   shape.needle_radius * Vec3{portable::cos(shape.needle_arc), portable::sin(shape.needle_arc), 0});
}

SutureFacts& suture_of(Facts& f, uint32_t which) {
  if (which >= f.suture.size()) f.suture.resize(which + 1);
  return f.suture[which];
}

Sample happening(const Event& e, std::string of = {}, double value = 1) { return {value, e.tick, e.where, std::move(of)}; }

// Direction of the needle where its circle passes `at`, in the world.
Vec3 tangent_at(const NeedleView& needle, Vec3 at) {
  const Vec3 v = to_local(needle.pose, at);
  return rotate(needle.pose.q, normalized(Vec3{-v.y, v.x, 0}, {0, 1, 0}));
}

double angle_of(const Facts& f, const PictureModel& picture, const Snapshot& seen, const NeedleView& needle, uint32_t wall,
                Vec3 at) {
  Quat turned{};
  const Vec3 rest = at_rest(picture, seen, wall, at, &turned);
  const SurfacePoint s = f.rest[0].nearest(wall, rest);
  return s.valid ? degrees_to_surface(rotate(conjugate(turned), tangent_at(needle, at)), s.normal) : kNotObserved;
}

int layers_of(double fraction, bool through) {
  // Borders of the layers in parts of the wall, from outside: estimates (docs/assessment.md, "Depth and layers").
  return through || fraction >= 0.9 ? 4 : fraction >= 0.6 ? 3 : fraction >= 0.1 ? 2 : 1;
}

void start_bite(Facts& f, const PictureModel& picture, const Snapshot& seen, const Event& e) {
  SutureFacts& suture = suture_of(f, e.suture);
  ++suture.entries;
  if (e.suture >= seen.suture.size() || e.which >= seen.suture[e.suture].bite.size()) return;
  const SutureView& view = seen.suture[e.suture];
  const BiteView& bite = view.bite[e.which];
  OpenBite open;
  open.suture = e.suture, open.number = e.which, open.entered = e.tick;
  open.entry_angle = angle_of(f, picture, seen, view.needle, bite.wall, bite.entry);
  open.turned = open.turning = view.needle.pose.q;
  open.hole = bite.entry;
  open.approach = approach_of(suture.tip);
  for (const ToolView& tool : seen.tool)
    if (tool.held == Held::needle && tool.held_suture == e.suture && e.suture < picture.suture.size()) {
      open.grasp_at = static_cast<double>(tool.held_at);
      const float phi = tool.held_at * picture.suture[e.suture].needle_arc;
      const Vec3 along = rotate(view.needle.pose.q, {-portable::sin(phi), portable::cos(phi), 0});
      const Vec3 shaft = rotate(tool.pose.q, {0, 0, 1});
      open.grasp_angle = portable::acos(std::min(1.0, std::abs(static_cast<double>(dot(along, shaft))))) * kDegrees;
      break;
    }
  std::erase_if(f.open, [&](const OpenBite& o) { return o.suture == open.suture && o.number == open.number; });
  f.open.push_back(open);
}

// The way of each needle's tip to its next entry.
void follow_tips(Facts& f, const PictureModel& picture, const Snapshot& seen) {
  const auto most = static_cast<size_t>(kApproachTime / f.setup.tick_s);
  for (uint32_t k = 0; k < seen.suture.size() && k < picture.suture.size(); ++k) {
    std::vector<Vec3>& tip = suture_of(f, k).tip;
    if (seen.suture[k].needle.in_tissue) {
      tip.clear();
      continue;
    }
    if (tip.size() >= 2 * most) tip.erase(tip.begin(), tip.end() - static_cast<std::ptrdiff_t>(most));
    tip.push_back(tip_of(seen.suture[k].needle, picture.suture[k]));
  }
}

void follow_bites(Facts& f, const PictureModel& picture, const Snapshot& seen) {
  for (OpenBite& open : f.open) {
    if (open.suture >= seen.suture.size() || open.suture >= picture.suture.size()) continue;
    const SutureView& view = seen.suture[open.suture];
    if (open.number >= view.bite.size()) continue;
    open.shift = std::max(open.shift, distance(view.bite[open.number].entry, open.hole));
    if (open.out) continue;
    const SuturePicture& shape = picture.suture[open.suture];
    open.center.push_back(view.needle.pose.p);
    if (sampled(f, seen.tick - open.entered, kTurnStep)) open.turn += turn_since(open.turning, view.needle.pose.q);
    const Vec3 tip = tip_of(view.needle, shape);
    open.tip.push_back(tip);
    const uint32_t wall = view.bite[open.number].wall;
    const SurfacePoint s = f.rest[0].serosa(wall, at_rest(picture, seen, wall, tip));
    if (s.valid) open.depth = std::max(open.depth, s.below);
  }
}

void finish_bite(Facts& f, const PictureModel& picture, const Snapshot& seen, const Event& e) {
  SutureFacts& suture = suture_of(f, e.suture);
  if (e.suture >= seen.suture.size() || e.which >= seen.suture[e.suture].bite.size()) return;
  const BiteView& view = seen.suture[e.suture].bite[e.which];
  Bite b;
  b.tick = e.tick, b.suture = e.suture, b.load = suture.load, b.number = e.which, b.wall = view.wall;
  b.entry = at_rest(picture, seen, view.wall, view.entry);
  b.exit = at_rest(picture, seen, view.wall, view.exit);
  b.where = 0.5f * (view.entry + view.exit);
  b.length = static_cast<double>(distance(b.entry, b.exit)) * kMm;
  b.entry_inside = view.entry_inside, b.exit_inside = view.exit_inside;
  float depth = view.depth;
  const auto open = std::find_if(f.open.begin(), f.open.end(),
                                 [&](const OpenBite& o) { return o.suture == e.suture && o.number == e.which; });
  if (open != f.open.end()) {
    depth = std::max(depth, open->depth);
    b.entered = open->entered;
    b.entry_angle = open->entry_angle, b.exit_angle = open->exit_angle;
    b.grasp_at = open->grasp_at, b.grasp_angle = open->grasp_angle;
    b.drive_speed = open->drive_speed;
    b.wander = wander_of(open->center) * kMm;
    b.tremor = tremor_of(open->center, f.setup.tick_s) * kMm;
    b.ldlj = ldlj(low_pass(open->tip, kMotionCutoff, 1 / f.setup.tick_s), 1 / f.setup.tick_s);
    const double net = angle_between(open->turned, open->turning);
    if (net > kLeastTurn) b.turn_excess = open->turn / net;
    b.approach = open->approach;
    b.shift = static_cast<double>(open->shift) * kMm;
    if (open->out) b.withdrawal = static_cast<double>(e.tick - open->left) * f.setup.tick_s;
    f.open.erase(open);
  } else {
    b.entered = e.tick;
  }
  b.seconds = static_cast<double>(b.tick - b.entered) * f.setup.tick_s;
  b.depth = static_cast<double>(depth) * kMm;
  b.depth_fraction = b.depth / f.setup.wall;
  if (b.entry_inside != b.exit_inside) b.depth_fraction = std::max(b.depth_fraction, 1.0);
  b.layers = layers_of(b.depth_fraction, b.entry_inside != b.exit_inside);
  b.attempts = std::max(1u, suture.entries), b.grasps = suture.grasps;
  suture.entries = suture.grasps = 0;
  if (b.wall < f.edge.size() && !f.edge[b.wall].point.empty()) {
    const StitchEdge& edge = f.edge[b.wall];
    const OnEdge in = nearest_on(edge, b.entry), out = nearest_on(edge, b.exit);
    b.along_in = static_cast<double>(in.along) * kMm, b.along_out = static_cast<double>(out.along) * kMm;
    b.edge_in = static_cast<double>(in.distance) * kMm, b.edge_out = static_cast<double>(out.distance) * kMm;
    const auto before = std::find_if(f.bite.rbegin(), f.bite.rend(), [&](const Bite& o) { return o.wall == b.wall; });
    const float mm = 1e-3f;
    if (before != f.bite.rend())
      b.spacing = static_cast<double>(between(edge.length(), static_cast<float>(before->along_in) * mm,
                                              static_cast<float>(before->along_out) * mm, in.along, out.along)) *
                  kMm;
    // The edge's direction at the middle of the bite; its chord over 2 mm, so that the corners of the row do not count.
    const Vec3 middle = 0.5f * (b.entry + b.exit), way = normalized(b.exit - b.entry);
    const OnEdge near = nearest_on(edge, middle);
    const auto point_at = [&](float s) {
      const float all = edge.length();
      s -= all * std::floor(s / all);
      size_t i = 0;
      while (i + 2 < edge.along.size() && edge.along[i + 1] <= s) ++i;
      const float span = std::max(edge.along[i + 1] - edge.along[i], 1e-9f);
      return lerp(edge.point[i], edge.point[(i + 1) % edge.point.size()], (s - edge.along[i]) / span);
    };
    const Vec3 along = normalized(point_at(near.along + 0.001f) - point_at(near.along - 0.001f));
    b.edge_angle = portable::acos(std::min(1.0, std::abs(static_cast<double>(dot(along, way))))) * kDegrees;
  }
  f.bite.push_back(b);
}

void note_throw(Facts& f, const Snapshot& seen, const Event& e) {
  SutureFacts& suture = suture_of(f, e.suture);
  if (e.suture >= seen.suture.size() || e.which >= seen.suture[e.suture].knot.size()) return;
  const KnotView& view = seen.suture[e.suture].knot[e.which];
  auto knot = std::find_if(f.knot.begin(), f.knot.end(),
                           [&](const Knot& k) { return k.suture == e.suture && k.load == suture.load && k.number == e.which; });
  if (knot == f.knot.end()) knot = f.knot.insert(f.knot.end(), Knot{0, e.suture, suture.load, e.which, {}, {}, {}});
  knot->tick = e.tick;
  knot->where = view.position;
  for (size_t t = knot->thrown.size(); t < std::min<size_t>(view.throws, view.thrown.size()); ++t) {
    const KnotThrow& k = view.thrown[t];
    Throw row;
    row.tick = e.tick, row.wraps = k.wraps, row.hand = k.chirality;
    row.tension = static_cast<double>(k.tension), row.gap = static_cast<double>(k.gap) * kMm;
    if (suture.throw_began) row.seconds = static_cast<double>(e.tick - suture.throw_began) * f.setup.tick_s;
    knot->thrown.push_back(row);
  }
  knot->kind = kind_of(knot->thrown);
  suture.throw_began = 0;
  suture.tied = true;
}

void note_event(Facts& f, const PictureModel& picture, const Snapshot& seen, const Event& e) {
  switch (e.kind) {
    case EventKind::tip_entered:
      return start_bite(f, picture, seen, e);
    case EventKind::tip_exited:
      for (OpenBite& o : f.open)
        if (o.suture == e.suture && o.number == e.which && e.suture < seen.suture.size() &&
            e.which < seen.suture[e.suture].bite.size()) {
          const BiteView& bite = seen.suture[e.suture].bite[e.which];
          const NeedleView& needle = seen.suture[e.suture].needle;
          o.exit_angle = angle_of(f, picture, seen, needle, bite.wall, bite.exit);
          if (!o.out && e.tick > o.entered && e.suture < picture.suture.size())
            o.drive_speed = angle_between(o.turned, needle.pose.q) *
                            static_cast<double>(picture.suture[e.suture].needle_radius) * kMm /
                            (static_cast<double>(e.tick - o.entered) * f.setup.tick_s);
          if (!o.out) o.left = e.tick;
          o.out = true;
        }
      return;
    case EventKind::bite_completed:
      return finish_bite(f, picture, seen, e);
    case EventKind::bite_withdrawn:
      std::erase_if(f.open, [&](const OpenBite& o) { return o.suture == e.suture && o.number == e.which; });
      f.withdrawn.push_back(happening(e, fmt::format("bite {}", e.which + 1)));
      return;
    case EventKind::throw_started:
      suture_of(f, e.suture).throw_began = e.tick;
      return;
    case EventKind::throw_locked:
      return note_throw(f, seen, e);
    case EventKind::throw_undone:
    case EventKind::loop_released:
      f.undone_throw.push_back(happening(e));
      return;
    case EventKind::loop_rejected:
      f.rejected_loop.push_back(happening(e, loop_reason_name(e.reason)));
      return;
    case EventKind::thread_cut:
      if (e.value >= 0 && (f.setup.physical || suture_of(f, e.suture).tied))
        f.tail.push_back(happening(e, {}, static_cast<double>(e.value) * kMm));
      return;
    case EventKind::suture_loaded: {
      SutureFacts& s = suture_of(f, e.suture);
      ++s.load;
      s.entries = s.grasps = 0, s.tied = false, s.throw_began = 0;
      std::erase_if(f.open, [&](const OpenBite& o) { return o.suture == e.suture; });
      return;
    }
    case EventKind::needle_grasped:
      ++suture_of(f, e.suture).grasps;
      return;
    case EventKind::needle_released:
    case EventKind::thread_released:
      if (e.value > 0) f.needle_slip.push_back(happening(e, e.kind == EventKind::needle_released ? "needle" : "thread"));
      return;
    case EventKind::tissue_grasped:
      f.tissue_grasp.push_back(happening(e));
      return;
    case EventKind::tissue_released:
      if (e.value > 0) f.tissue_slip.push_back(happening(e));
      return;
    case EventKind::bite_out_of_order:
      f.order_error.push_back(happening(e, "bite out of order"));
      return;
    case EventKind::technique_fault: {
      std::string name = fault_name(e.fault);
      std::replace(name.begin(), name.end(), '_', ' ');
      const bool order = e.fault == Fault::wrong_body || e.fault == Fault::wrong_layer || e.fault == Fault::one_wall_only;
      (order ? f.order_error : f.fault).push_back(happening(e, name));
      return;
    }
    default:
      return;
  }
}

void note_hand(Facts& f, size_t k, const PictureModel& picture, const Snapshot& seen, const TickInput& input) {
  HandFacts& hand = f.hand[k];
  const ToolView& tool = seen.tool[k];
  const double dt = f.setup.tick_s;
  if ((seen.tick - f.first) % f.stride == 0) {
    const bool here = input.hand[k].connected != 0;
    f.path[k].push_back(here || f.path[k].empty() ? input.hand[k].pose.p : f.path[k].back());
  }
  if (seen.tick == f.first) hand.turning = input.hand[k].pose.q;
  else if (sampled(f, seen.tick - f.first, kTurnStep)) hand.turn += turn_since(hand.turning, input.hand[k].pose.q);
  const float strain = length(tool.force);
  if (strain > hand.strain) hand.strain = strain, hand.strain_tick = seen.tick, hand.strain_where = tool.pose.p;
  const size_t which = static_cast<size_t>(tool.instrument);
  if (tool.instrument < 0 || which >= seen.instrument.size()) return;
  if (tool.held == Held::tissue) {
    const float pull = length(seen.instrument[which].pull);
    hand.impulse += static_cast<double>(pull) * dt;
    if (pull > hand.peak) hand.peak = pull, hand.peak_tick = seen.tick, hand.peak_where = tool.pose.p;
  }
  const uint32_t can = which < picture.instrument.size() ? picture.instrument[which].capabilities : 0;
  if ((can & (kHoldNeedle | kHoldThread | kHoldTissue)) == 0) return;
  if (tool.jaw > kOpenJaw) hand.was_open = true, hand.judged = false;
  if (tool.jaw > kClosedJaw) hand.closed_for = 0;
  else if (tool.held != Held::nothing || tool.loop_wraps > 0) hand.judged = true;  // a loop is closed over on purpose
  else hand.closed_for += dt;
  if (hand.was_open && !hand.judged && hand.closed_for >= kGraspTime) {
    hand.judged = true, hand.was_open = false;
    f.missed_grasp.push_back({1, seen.tick, tool.pose.p, k == 0 ? "right hand" : "left hand"});
  }
}

void note_tension(Facts& f, const Snapshot& seen) {
  for (uint32_t k = 0; k < seen.suture.size(); ++k) {
    SutureFacts& suture = suture_of(f, k);
    float most = 0;
    Vec3 where;
    for (const SuturePointView& p : seen.suture[k].suture_point) {
      const float t = std::max(p.tension_needle, p.tension_free);
      if (t > most) most = t, where = p.position;
    }
    suture.impulse += static_cast<double>(most) * f.setup.tick_s;
    if (sampled(f, seen.tick - f.first, kForceStep)) {
      const double change = static_cast<double>(most - suture.before) / kForceStep;
      if (most > 0 || suture.before > 0) suture.change2 += change * change, ++suture.changes;
      suture.before = most;
    }
    if (most > suture.peak) suture.peak = most, suture.peak_tick = seen.tick, suture.peak_where = where;
    if (most > kTearForce && !suture.overloaded) f.overload.push_back({static_cast<double>(most), seen.tick, where, "thread"});
    if (most > kTearForce) suture.overloaded = true;
    else if (most < 0.8f * kTearForce) suture.overloaded = false;
  }
}

}  // namespace

std::string_view knot_kind_name(KnotKind kind) {
  constexpr std::string_view names[] = {"none", "single throw", "granny", "square", "surgeon's", "mixed", "sliding"};
  return names[static_cast<size_t>(kind)];
}

KnotKind kind_of(const std::vector<Throw>& thrown) {
  if (thrown.empty()) return KnotKind::none;
  if (std::any_of(thrown.begin(), thrown.end(), [](const Throw& t) { return t.sliding; })) return KnotKind::sliding;
  if (thrown.size() == 1) return KnotKind::single_throw;
  bool alternating = true, alike = true;
  for (size_t i = 1; i < thrown.size(); ++i) (thrown[i].hand == thrown[i - 1].hand ? alternating : alike) = false;
  if (alternating) return thrown[0].wraps >= 2 ? KnotKind::surgeons : KnotKind::square;
  return alike ? KnotKind::granny : KnotKind::mixed;
}

double rim_area(const PictureModel& picture, const std::vector<Vec3>& particle, size_t wall) {
  const std::vector<uint32_t>& rim = picture.rim[wall];
  Vec3 center{}, sum{};
  for (const uint32_t i : rim) center += particle[i] / static_cast<float>(rim.size());
  for (size_t i = 0; i < rim.size(); ++i) sum += cross(particle[rim[i]] - center, particle[rim[(i + 1) % rim.size()]] - center);
  return 0.5 * static_cast<double>(length(sum));
}

Facts begin_facts(const PictureModel& picture, const Setup& setup) {
  Facts f;
  f.setup = setup;
  f.edge = start_map(picture, setup.tick_s).edge;
  f.rest.emplace_back(picture);
  f.stride = std::max(1u, static_cast<uint32_t>(1 / (kSampleRate * setup.tick_s) + 1e-6));
  return f;
}

void note(Facts& f, const PictureModel& picture, const Snapshot& seen, const TickInput& input) {
  if (!f.begun) {
    if (std::none_of(input.hand.begin(), input.hand.end(), [](const ToolInput& h) { return h.connected != 0; })) return;
    f.begun = true;
    f.first = seen.tick;
    f.opening = seen.opening_area;
    for (size_t w = 0; w < picture.rim.size(); ++w) f.lumen.push_back(rim_area(picture, seen.particle, w));
  }
  f.last = seen.tick;
  for (const Event& e : seen.event) note_event(f, picture, seen, e);
  follow_bites(f, picture, seen);
  follow_tips(f, picture, seen);
  for (size_t k = 0; k < f.hand.size(); ++k) note_hand(f, k, picture, seen, input);
  note_tension(f, seen);
  note_pen(f.pen, picture, seen, input, f.setup.tick_s);
}

void rewind(Facts& f, const Tally& then) {
  static_cast<Tally&>(f) = then;
  const size_t samples = then.begun ? static_cast<size_t>((then.last - then.first) / f.stride) + 1 : 0;
  for (std::vector<Vec3>& path : f.path) path.resize(std::min(path.size(), samples));
}

}  // namespace catgut::assess
