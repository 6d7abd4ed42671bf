// SPDX-License-Identifier: Apache-2.0
// assess: see feedback.h.
#include "assess/feedback.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "assess/metrics.h"
#include "core/elementary.h"

namespace catgut::assess {
namespace {

constexpr double kMm = 1000, kDegrees = 180 / 3.14159265358979323846;
constexpr float kNear = 0.006f;     // [m] of the tip from the serosa: a bite is being aimed
constexpr double kAimed = 20;       // [mm] farther from the edge none is
constexpr float kTearShare = 0.8f;  // of kTearForce
constexpr size_t kMostCues = 6;

const RubricItem* item_of(const Rubric& rubric, std::string_view metric) {
  for (const RubricItem& i : rubric.item)
    if (i.metric == metric) return &i;
  return nullptr;
}

std::string range(const Band& b) {
  if (b.low <= 0) return fmt::format("at most {:g}", b.high);
  return b.high < 1e6 ? fmt::format("{:g} to {:g}", b.low, b.high) : fmt::format("at least {:g}", b.low);
}

struct Cues {
  const Rubric& rubric;
  std::vector<Cue> cue;
  void say(std::string text, bool good) {
    if (cue.size() < kMostCues) cue.push_back({std::move(text), good});
  }
  void judge(std::string_view metric, const char* name, double value, const char* unit, int digits) {
    const RubricItem* item = item_of(rubric, metric);
    if (!item || !std::isfinite(value)) return;
    say(fmt::format("{} {:.{}f}{} ({})", name, value, digits, unit, range(item->full)), item->full.holds(value));
  }
};

// Distances and angle of a bite that would begin at the tip.
void aim(Cues& cues, const CueSource& source, const PictureModel& picture, const Snapshot& seen, Vec3 tip, Vec3 heading) {
  SurfacePoint best;
  uint32_t wall = 0;
  Quat turned{};
  float nearest = kNear;
  for (uint32_t w = 0; w < picture.rim.size(); ++w) {
    Quat q{};
    const Vec3 rest = at_rest(picture, seen, w, tip, &q);
    const SurfacePoint s = source.rest[0].serosa(w, rest);
    if (const float off = s.valid ? distance(s.point, rest) : kNear; off < nearest)
      nearest = off, best = s, wall = w, turned = q;
  }
  if (!best.valid || wall >= source.edge.size() || source.edge[wall].point.empty()) return;
  const StitchEdge& edge = source.edge[wall];
  const OnEdge here = nearest_on(edge, best.point);
  const double off = static_cast<double>(here.distance) * kMm;
  if (off > kAimed) return;
  const RubricItem *near = item_of(cues.rubric, "edge_near"), *far = item_of(cues.rubric, "edge_far");
  if (near && far)  // of a bite across the edge, the tip enters at one of both ends
    cues.say(fmt::format("edge {:.1f} mm ({} or {})", off, range(near->full), range(far->full)),
             near->full.holds(off) || far->full.holds(off));
  else cues.judge("edge_in", "edge", off, " mm", 1);
  const std::vector<BiteView>& bites = seen.active().bite;
  const auto before =
      std::find_if(bites.rbegin(), bites.rend(), [&](const BiteView& b) { return b.complete && b.wall == wall; });
  if (before != bites.rend()) {
    const float in = nearest_on(edge, at_rest(picture, seen, wall, before->entry)).along;
    const float out = nearest_on(edge, at_rest(picture, seen, wall, before->exit)).along;
    cues.judge("spacing", "spacing", static_cast<double>(between(edge.length(), in, out, here.along, here.along)) * kMm, " mm",
               1);
  }
  const double sine = std::abs(static_cast<double>(dot(rotate(conjugate(turned), heading), best.normal)));
  cues.judge("entry_angle", "entry angle", portable::asin(std::min(1.0, sine)) * kDegrees, "\u00b0", 0);
}

bool of_a_stitch(std::string_view group) { return group == "bite" || group == "needle" || group == "knot"; }

}  // namespace

CueSource cue_source(const PictureModel& picture, double wall_mm) {
  CueSource s;
  s.wall = wall_mm;
  s.edge = start_map(picture, 1.0 / 60).edge;
  s.rest.emplace_back(picture);
  return s;
}

std::vector<Cue> cues_now(const Rubric& rubric, const CueSource& source, const PictureModel& picture, const Snapshot& seen) {
  Cues cues{rubric, {}};
  const SutureView& suture = seen.active();
  float load = 0;
  for (const SuturePointView& p : suture.suture_point) load = std::max({load, p.tension_needle, p.tension_free});
  if (load > kTearShare * kTearForce)
    cues.say(fmt::format("thread {:.1f} N (bowel tears from {:.1f})", load, kTearForce), false);
  for (const ToolView& tool : seen.tool) {
    if (tool.held == Held::tissue && tool.instrument >= 0 && static_cast<size_t>(tool.instrument) < seen.instrument.size())
      cues.judge("grasp_force", "pull on tissue",
                 static_cast<double>(length(seen.instrument[static_cast<size_t>(tool.instrument)].pull)), " N", 1);
    if (tool.held != Held::needle || tool.held_suture != seen.active_suture) continue;
    if (suture.needle.in_tissue) continue;  // too late for another grasp
    cues.judge("grasp_at", "needle held at", static_cast<double>(tool.held_at), "", 2);
  }
  if (seen.active_suture >= picture.suture.size()) return cues.cue;
  const SuturePicture& shape = picture.suture[seen.active_suture];
  const Vec3 out{portable::cos(shape.needle_arc), portable::sin(shape.needle_arc), 0};
  const Vec3 tip = transform(suture.needle.pose, shape.needle_radius * out);
  if (suture.needle.in_tissue && suture.needle.bite < suture.bite.size()) {
    const BiteView& bite = suture.bite[suture.needle.bite];
    const SurfacePoint s = source.rest[0].serosa(bite.wall, at_rest(picture, seen, bite.wall, tip));
    if (s.valid && !bite.has_exit)
      cues.judge("depth", "depth of the wall", static_cast<double>(std::max(s.below, bite.depth)) * kMm / source.wall, "", 2);
  } else if (std::any_of(seen.tool.begin(), seen.tool.end(),
                         [&](const ToolView& t) { return t.held == Held::needle && t.held_suture == seen.active_suture; })) {
    aim(cues, source, picture, seen, tip, rotate(suture.needle.pose.q, {-out.y, out.x, 0}));
  }
  return cues.cue;
}

std::vector<Remark> remarks_since(const Rubric& rubric, const Facts& facts, uint64_t after) {
  Rubric part = rubric;
  part.whole = {};  // each stitch for itself
  std::erase_if(part.item, [](const RubricItem& i) {
    const MetricRow* row = find_metric(i.metric);
    return !i.each || !row || !of_a_stitch(row->group);
  });
  const Score score = mark(part, measure_stitches(facts));
  std::vector<Remark> out;
  for (const LostPoint& l : score.lost)
    if (l.tick > after && std::isfinite(l.value)) {
      const size_t note = l.why.find(" (band not validated)");
      out.push_back({l.tick, l.why.substr(0, note), false});
    }
  if (!out.empty()) return out;
  for (const Bite& b : facts.bite)
    if (b.tick > after) out.push_back({b.tick, fmt::format("bite {}: all within the bands", b.number + 1), true});
  for (const Knot& k : facts.knot)
    if (k.tick > after) out.push_back({k.tick, fmt::format("throw {}: all within the bands", k.thrown.size()), true});
  return out;
}

}  // namespace catgut::assess
