// SPDX-License-Identifier: Apache-2.0
// assess: see metrics.h. One function per group fills the samples of its metrics; the table below names them.
#include "assess/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "assess/motion.h"
#include "assess/tied.h"
#include "core/elementary.h"

namespace catgut::assess {
namespace {

constexpr double kMm = 1000, kDegrees = 180 / 3.14159265358979323846;
using enum Better;
using enum Summary;

constexpr const char* kBowelBite = "EAGLE safe-anastomosis module 5: 3 to 5 mm, submucosa in every bite";
constexpr const char* kEase = "sub-skills of suturing: EASE, PMC10923136";
constexpr const char* kSeki = "suture tracks: Seki 1993, 10.1007/BF00311623";
constexpr const char* kErrors = "observed suturing errors: Van Sickle, PMC7709379";
constexpr const char* kSmooth = "Balasubramanian 2015, 10.1186/s12984-015-0090-9";
constexpr const char* kMotion = "hand motion: Sensors 2023 23:3146 and Singh 2021, 10.3389/frobt.2021.625003";
constexpr const char* kStay = "hand-sutured anastomosis: Sankaranarayanan 2023, 10.1007/s00464-022-09584-1";
constexpr const char* kDatta = "number of movements and time in bowel anastomosis: Datta 2001, 10.1016/s1072-7515(01)01041-9";
constexpr const char* kTracked = "velocity, acceleration, jerk of tracked hands: PMC12953238";
constexpr const char* kPhases = "segments of a suturing task: Farcas 2017, Surg Endosc 31(8)";
constexpr const char* kJudkins = "curvature of paths: Judkins 2009, 10.1007/s00464-008-9933-9";
constexpr const char* kTrejos = "integral and derivative of force: Trejos 2014, 10.1007/s00464-014-3442-9";
constexpr const char* kOwn = "Catgut";

// clang-format off
constexpr MetricRow kRow[] = {
    {"edge_in", "entry from the edge", "bite", "mm", target, mean, "distance of the entry from the cut edge, on the tissue at rest", kBowelBite},
    {"edge_out", "exit from the edge", "bite", "mm", target, mean, "distance of the exit from the cut edge, on the tissue at rest", kBowelBite},
    {"edge_near", "near end of a bite", "bite", "mm", target, mean, "smaller of the edge distances of entry and exit", "Lembert: in 8, out 4 mm from the edge (veterinary); EAGLE module 5"},
    {"edge_far", "far end of a bite", "bite", "mm", target, mean, "larger of the edge distances of entry and exit", "Lembert: in 8, out 4 mm from the edge (veterinary); EAGLE module 5"},
    {"edge_spread", "evenness of the edge distance", "bite", "mm", lower, spread, "mean distance of entry and exit of a bite from the edge", kOwn},
    {"edge_symmetry", "symmetry of a bite along the edge", "bite", "mm", lower, mean, "difference of the edge distances of entry and exit; bites at less than 45 degrees to the edge", kEase},
    {"mirror_edge", "symmetry of the two sides", "bite", "mm", lower, mean, "difference of the mean edge distances of two successive bites in opposite walls", kEase},
    {"mirror_offset", "offset of the two sides", "bite", "mm", lower, mean, "distance along the edge between the exit of a bite and the entry of the next in the opposite wall", kEase},
    {"bite_length", "bite length", "bite", "mm", target, mean, "distance from entry to exit on the tissue at rest", kOwn},
    {"spacing", "spacing", "bite", "mm", target, mean, "along the edge, from a bite to the nearest end of the bite before it in the same wall", kBowelBite},
    {"spacing_spread", "evenness of the spacing", "bite", "mm", lower, spread, "as spacing", kEase},
    {"depth", "depth as a part of the wall", "bite", "", target, mean, "greatest distance of the needle's tip below the serosa, over the wall's thickness; 1 or more: the lumen was entered", kBowelBite},
    {"depth_spread", "evenness of the depth", "bite", "", lower, spread, "as depth", kOwn},
    {"layers", "layers crossed", "bite", "", target, mean, "1 serosa, 2 and muscularis, 3 and submucosa, 4 and mucosa", kBowelBite},
    {"entry_angle", "entry angle", "bite", "deg", target, mean, "angle of the needle to the surface where it enters; 90: perpendicular", kEase},
    {"exit_angle", "exit angle", "bite", "deg", target, mean, "angle of the needle to the surface where it exits", kEase},
    {"edge_angle", "bite to edge angle", "bite", "deg", target, mean, "angle of the line from entry to exit to the edge; 0 along it, 90 across", kOwn},
    {"edge_angle_spread", "evenness of the direction", "bite", "deg", lower, spread, "as edge_angle", kOwn},

    {"drive_time", "time of a bite", "needle", "s", lower, mean, "from the tip's entry until the needle has left the wall", kMotion},
    {"drive_speed", "speed of the needle", "needle", "mm/s", target, mean, "turn of the needle from the tip's entry to its exit, times its radius, over the time between", kMotion},
    {"bite_time", "time for a bite", "needle", "s", lower, mean, "from the bite or knot before, or the start, until the bite is complete", kDatta},
    {"needle_wander", "needle off its curve", "needle", "mm", lower, mean, "root mean square distance of the needle circle's center from its mean while the tip is in tissue", kSeki},
    {"needle_tremor", "tremor of the needle", "needle", "mm", lower, mean, "root mean square distance of the needle circle's center from the middle of its places 1/30 s before and after, while the tip is in tissue", "Riviere 1997, kilthub.cmu.edu/articles/6621335"},
    {"drive_ldlj", "smoothness of driving", "needle", "", higher, mean, "log dimensionless jerk of the needle's tip from its entry to its exit", kEase},
    {"drive_turn", "turn of the needle over what is needed", "needle", "", lower, mean, "sum of the needle's turns, every 0.1 s from the tip's entry to its exit, over its net turn; 1: in one sweep", kEase},
    {"handling_time", "time of needle handling", "needle", "s", lower, mean, "from the bite or knot before, or the start, until the tip enters", kPhases},
    {"withdrawal_time", "time of withdrawal", "needle", "s", lower, mean, "from the tip's exit until the needle has left the wall", kPhases},
    {"approach", "approach to the entry", "needle", "", lower, mean, "path of the needle's tip over the last 10 mm to its entry, over the distance; 1: straight", kOwn},
    {"attempts", "attempts per bite", "needle", "", lower, mean, "entries of the tip until the bite is complete", kErrors},
    {"withdrawn", "withdrawn bites", "needle", "", lower, count, "the needle was withdrawn from an unfinished bite", kErrors},
    {"needle_grasps", "grasps of the needle per bite", "needle", "", lower, mean, "times that a jaw closed on the needle since the bite before", kErrors},
    {"grasp_at", "position of the grasp", "needle", "", target, mean, "of the jaws on the needle at entry: 0 swage, 1 tip", kEase},
    {"grasp_angle", "angle of the grasp", "needle", "deg", target, mean, "between shaft and needle at the jaws at entry; 90: perpendicular", kEase},
    {"slips", "slips of needle and thread", "needle", "", lower, count, "the jaws lost needle or thread under load", kErrors},

    {"throws", "throws of a knot", "knot", "", target, mean, "locked throws of each knot", "instrument tie, at least 2-1-1: ATLAS task 6"},
    {"first_wraps", "wraps of the first throw", "knot", "", target, mean, "turns of thread around the instrument", "instrument tie, at least 2-1-1: ATLAS task 6"},
    {"square", "square throws", "knot", "", higher, mean, "share of a knot's throws, from the second, whose chirality differs from the one below; 0: granny", "ATLAS task 6; 10.1073/pnas.1205918109"},
    {"knot_tension", "tension at the lock", "knot", "N", target, mean, "tension of the pulled strand when a throw locks", "force in thread: Horeman 2013, 10.1371/journal.pone.0084466"},
    {"knot_tension_spread", "evenness of the knot tension", "knot", "N", lower, spread, "as knot_tension", kOwn},
    {"knot_gap", "gap to the tissue", "knot", "mm", lower, maximum, "distance of the first throw of a knot to the tissue when it locks: air knot", "ATLAS task 6"},
    {"throw_gap", "gap between throws", "knot", "mm", lower, maximum, "distance of a throw to the one below when it locks", "ATLAS task 6"},
    {"tail", "length of tails", "knot", "mm", target, mean, "thread from a cut to the nearest suture point or knot of a tied suture", "3 to 5 mm on bowel: unpublished convention"},
    {"throw_time", "time of a throw", "knot", "s", lower, mean, "from the pull through the loop to the lock", kMotion},
    {"knot_time", "time for a knot", "knot", "s", lower, mean, "from the last bite, or the knot before, to the lock of the last throw", kDatta},
    {"finish_time", "time of finishing", "knot", "s", lower, mean, "from the lock of the last throw to the cut of the thread", kPhases},
    {"undone_throws", "lost loops and throws", "knot", "", lower, count, "a loop came off, or a throw was released before its lock", kErrors},
    {"rejected_loops", "failed loops", "knot", "", lower, count, "thread around an instrument that did not make a loop", kErrors},

    {"gap", "apposition gap", "line", "mm", lower, maximum, "distance of two points that the technique closes, at the end", "ATLAS task 6"},
    {"gap_mean", "mean apposition gap", "line", "mm", lower, mean, "as gap", "ATLAS task 6"},
    {"eversion", "everted edge", "line", "", lower, mean, "share of a wall's edge that leans outward by more than 30 degrees, at the end", kOwn},
    {"inversion", "inversion of the edge", "line", "deg", target, mean, "mean angle by which a wall's edge leans inward, at the end", kOwn},
    {"lumen", "lumen that is left", "line", "", target, mean, "area of a wall's edge at the end over its area at the start", kOwn},
    {"closure", "closure of the opening", "line", "", target, only, "0 open to 1 at the anvil", kOwn},
    {"slack", "slack of the thread", "line", "mm", lower, maximum, "thread between two successive bites beyond their distance, at the end", kOwn},
    {"bites", "completed bites", "line", "", target, count, "bites with entry and exit", kOwn},
    {"order_errors", "errors of order", "line", "", lower, count, "a bite out of the technique's order, in the wrong wall or layer, or a stitch through one wall only", kErrors},
    {"faults", "other faults", "line", "", lower, count, "knot without a bite, needle in tissue, thread cut in a stitch or before a knot, too few throws", kErrors},
    {"tension_spread", "evenness of the line's tension", "line", "N", lower, spread, "larger tension at each suture point at the end", "force in thread: Horeman 2013, 10.1371/journal.pone.0084466"},

    {"cut_edge", "cut from the edge", "cut", "mm", target, mean, "distance of the cut from the rim, on the tissue at rest; one per millimeter of the rim", kOwn},
    {"cut_spread", "evenness of the cut", "cut", "mm", lower, spread, "as cut_edge; a spiral is uneven", kOwn},
    {"bridges", "bridges left", "cut", "mm", lower, sum, "stretch of the rim beside which the wall is not divided; a single 0: divided all round", kOwn},
    {"pieces", "pieces of tissue", "cut", "", target, only, "connected parts of all walls at the end", kOwn},
    {"energy_time", "time with energy", "cut", "s", lower, only, "an electrosurgical pen is switched on", kOwn},
    {"blood_loss", "blood loss", "cut", "ml", lower, sum, "from each vessel that a cut has opened", "intraoperative bleeding: Lewis 2017, 10.1016/j.surg.2016.09.022"},
    {"thermal_spread", "thermal spread", "cut", "mm", lower, only, "largest distance of heat-damaged tissue from the path of the pen's tip", "lateral thermal spread: Sutton 2010, 10.1002/bjs.6901"},
    {"burnt_area", "burnt area", "cut", "mm^2", lower, only, "surface of heat-damaged tissue", kOwn},

    {"thread_force", "peak force at a bite", "tissue", "N", lower, maximum, "largest tension of a suture's thread at a suture point", "tear-out: Gong 2023, 10.1115/1.4063951"},
    {"thread_impulse", "integrated force at bites", "tissue", "N s", lower, sum, "integral over time of a suture's largest tension at a suture point", "force metrics: 10.3389/fmed.2022.897219"},
    {"force_rate", "rate of force at bites", "tissue", "N/s", lower, maximum, "root mean square of the change of a suture's largest tension at a suture point, every 0.1 s while it pulls", kTrejos},
    {"tissue_shift", "displacement of tissue", "tissue", "mm", lower, mean, "largest distance of a bite's entry, while the needle is in the wall, from where the tip entered", "deformation of the tissue: SutureCoach, 10.3389/fmed.2022.897219"},
    {"overloads", "overloads of a bite", "tissue", "", lower, count, "tension at a suture point above 3.22 N, where human small bowel begins to tear", "tear-out: Gong 2023, 10.1115/1.4063951"},
    {"grasp_force", "peak force of a grasp", "tissue", "N", lower, maximum, "of a hand's instrument on the tissue that it holds", kStay},
    {"grasp_impulse", "integrated force of grasps", "tissue", "N s", lower, sum, "integral over time of that force", "force metrics: 10.3389/fmed.2022.897219"},
    {"tissue_grasps", "grasps of tissue", "tissue", "", lower, count, "times that a jaw closed on tissue", kErrors},
    {"tissue_slips", "tissue torn from a grasp", "tissue", "", lower, count, "tissue slipped out of the jaws under load", kErrors},
    {"missed_grasps", "missed grasps", "tissue", "", lower, count, "jaws closed for 0.1 s on nothing", kErrors},
    {"hand_force", "peak force on a hand", "tissue", "N", lower, maximum, "computed, not the force that a device renders", "force metrics: 10.3389/fmed.2022.897219"},

    {"time", "time", "hands", "s", lower, only, "from the first tick with hands to the last", kStay},
    {"path", "path of both hands", "hands", "m", lower, sum, "length of a hand's filtered path", "Azari 2018, scholars.duke.edu/display/pub1534663"},
    {"path_per_bite", "path per bite", "hands", "mm", lower, only, "path of both hands over completed bites", "Azari 2018, scholars.duke.edu/display/pub1534663"},
    {"idle", "idle hands", "hands", "", lower, mean, "share of the time in which the voluntary motion of a hand, below 2 Hz, is slower than 5 mm/s", kMotion},
    {"pause", "both hands idle", "hands", "", lower, only, "share of the time in which both hands are idle", kMotion},
    {"hesitations", "hesitations", "hands", "", lower, count, "both hands are idle for at least 0.5 s", "\"frequently stopped operating\": flow of operation in OSATS, Martin 1997"},
    {"movements", "movements", "hands", "", lower, count, "a hand is not idle for at least 0.3 s", kDatta},
    {"hand_speed", "speed of a hand", "hands", "mm/s", target, mean, "mean speed of each movement", kTracked},
    {"acceleration", "acceleration of a hand", "hands", "m/s^2", lower, mean, "root mean square of each movement", kTracked},
    {"jerk", "jerk of a hand", "hands", "m/s^3", lower, mean, "root mean square of each movement", kTracked},
    {"ldlj", "log dimensionless jerk", "hands", "", higher, mean, "of each movement: a hand not idle for at least 0.3 s", kSmooth},
    {"sparc", "spectral arc length", "hands", "", higher, mean, "of each movement's speed, to 10 Hz, threshold 0.05", kSmooth},
    {"submovements", "speed peaks", "hands", "1/s", lower, mean, "maxima of a hand's speed in its movements that stand out by 5 % of the movement's peak, over their time", kSmooth},
    {"curvature", "curvature of a hand's path", "hands", "1/m", lower, mean, "median of each movement", kJudkins},
    {"directness", "directness of a hand's path", "hands", "", higher, mean, "distance from beginning to end of each movement over its path", kMotion},
    {"rotation", "turn of a hand", "hands", "deg", lower, sum, "sum of a hand's turns, every 0.1 s", "rotation of the needle driver: SutureCoach, 10.3389/fmed.2022.897219"},
    {"volume", "volume of motion", "hands", "cm^3", lower, sum, "ellipsoid of one standard deviation of a hand's places", "motion volume: PMC10359367"},
    {"tremor", "tremor", "hands", "mm", lower, mean, "root mean square of a hand's position less its path below 5 Hz, where the hand is idle for 0.1 s before and after", "Riviere 1997, kilthub.cmu.edu/articles/6621335"},
    {"bimanual", "bimanual coordination", "hands", "", higher, only, "Pearson's correlation of the speeds of voluntary motion of both hands, while any moves", kMotion},
    {"together", "both hands moving", "hands", "", higher, only, "time in which both hands move over the time in which any moves", kMotion},
};
// clang-format on

class Sheet {
 public:
  Sheet() {
    for (const MetricRow& r : kRow) metric_.push_back({r.key, kNotObserved, {}});
  }
  Metric& operator[](std::string_view key) {
    for (Metric& m : metric_)
      if (m.key == key) return m;
    throw std::logic_error("no metric " + std::string(key));
  }
  void add(std::string_view key, double value, uint64_t tick, Vec3 where, std::string of = {}) {
    if (std::isfinite(value)) (*this)[key].sample.push_back({value, tick, where, std::move(of)});
  }
  void add_all(std::string_view key, const std::vector<Sample>& samples) {
    auto& s = (*this)[key].sample;
    s.insert(s.end(), samples.begin(), samples.end());
  }
  std::vector<Metric> take();

 private:
  std::vector<Metric> metric_;
};

double summarize(Summary how, const std::vector<Sample>& s) {
  if (how == count) return static_cast<double>(s.size());
  if (s.empty()) return kNotObserved;
  double total = 0, most = s[0].value;
  for (const Sample& x : s) total += x.value, most = std::max(most, x.value);
  const double n = static_cast<double>(s.size()), average = total / n;
  if (how == sum) return total;
  if (how == maximum) return most;
  if (how != spread) return average;
  if (s.size() < 2) return kNotObserved;
  double squares = 0;
  for (const Sample& x : s) squares += (x.value - average) * (x.value - average);
  return std::sqrt(squares / (n - 1));
}

std::vector<Metric> Sheet::take() {
  for (size_t i = 0; i < metric_.size(); ++i) metric_[i].value = summarize(kRow[i].summary, metric_[i].sample);
  return std::move(metric_);
}

std::string bite_name(const Bite& b) { return fmt::format("bite {}", b.number + 1); }

void measure_bites(const Facts& f, Sheet& sheet) {
  for (size_t i = 0; i < f.bite.size(); ++i) {
    const Bite& b = f.bite[i];
    const std::string of = f.suture.size() > 1 || b.load > 0
                               ? fmt::format("suture {} bite {}", b.suture + b.load + 1, b.number + 1)
                               : bite_name(b);
    const auto add = [&](std::string_view key, double value) { sheet.add(key, value, b.tick, b.where, of); };
    add("edge_in", b.edge_in);
    add("edge_out", b.edge_out);
    add("edge_near", std::min(b.edge_in, b.edge_out));
    add("edge_far", std::max(b.edge_in, b.edge_out));
    add("edge_spread", 0.5 * (b.edge_in + b.edge_out));
    if (b.edge_angle < 45) add("edge_symmetry", std::abs(b.edge_in - b.edge_out));
    add("bite_length", b.length);
    add("spacing", b.spacing);
    add("spacing_spread", b.spacing);
    add("depth", b.depth_fraction);
    add("depth_spread", b.depth_fraction);
    add("layers", b.layers);
    add("entry_angle", b.entry_angle);
    add("exit_angle", b.exit_angle);
    add("edge_angle", b.edge_angle);
    add("edge_angle_spread", b.edge_angle);
    add("drive_time", b.seconds);
    add("drive_speed", b.drive_speed);
    uint64_t since = i > 0 ? std::max(f.first, f.bite[i - 1].tick) : f.first;
    for (const Knot& k : f.knot)
      if (k.tick <= b.tick) since = std::max(since, k.tick);
    add("bite_time", static_cast<double>(b.tick - since) * f.setup.tick_s);
    add("handling_time", static_cast<double>(std::max(b.entered, since) - since) * f.setup.tick_s);
    add("withdrawal_time", b.withdrawal);
    add("approach", b.approach);
    add("drive_ldlj", b.ldlj);
    add("drive_turn", b.turn_excess);
    add("tissue_shift", b.shift);
    add("needle_wander", b.wander);
    add("needle_tremor", b.tremor);
    add("attempts", b.attempts);
    add("needle_grasps", b.grasps);
    add("grasp_at", b.grasp_at);
    add("grasp_angle", b.grasp_angle);
    add("bites", 1);
    if (i == 0) continue;
    const Bite& a = f.bite[i - 1];
    const bool tied = std::any_of(f.knot.begin(), f.knot.end(), [&](const Knot& k) {
      return k.suture == b.suture && k.tick > a.tick && k.tick <= b.entered;
    });
    if (a.suture != b.suture || a.load != b.load || a.wall == b.wall || tied) continue;
    add("mirror_edge", std::abs(0.5 * (a.edge_in + a.edge_out) - 0.5 * (b.edge_in + b.edge_out)));
    if (a.wall >= f.edge.size()) continue;
    // Both ends of the crossing, seen from the edge of the first wall.
    const StitchEdge& edge = f.edge[a.wall];
    const double all = static_cast<double>(edge.length());
    if (!(all > 0)) continue;
    double apart = static_cast<double>(nearest_on(edge, b.entry).along - nearest_on(edge, a.exit).along) / all;
    apart -= std::floor(apart + 0.5);
    add("mirror_offset", std::abs(apart) * all * kMm);
  }
}

void measure_knots(const Facts& f, const std::vector<Knot>& knots, Sheet& sheet) {
  for (const Knot& k : knots) {
    const std::string of = fmt::format("knot {} ({})", k.suture + k.load + k.number + 1, knot_kind_name(k.kind));
    sheet.add("throws", static_cast<double>(k.thrown.size()), k.tick, k.where, of);
    size_t opposite = 0;
    for (size_t t = 0; t < k.thrown.size(); ++t) {
      const Throw& row = k.thrown[t];
      const std::string one = fmt::format("{}, throw {}", of, t + 1);
      if (t == 0) sheet.add("first_wraps", row.wraps, row.tick, k.where, one);
      sheet.add(t == 0 ? "knot_gap" : "throw_gap", row.gap, row.tick, k.where, one);
      sheet.add("knot_tension", row.tension, row.tick, k.where, one);
      sheet.add("knot_tension_spread", row.tension, row.tick, k.where, one);
      if (row.seconds > 0) sheet.add("throw_time", row.seconds, row.tick, k.where, one);
      if (t > 0) opposite += row.hand != k.thrown[t - 1].hand && !row.sliding;
    }
    uint64_t since = f.first;
    for (const Bite& b : f.bite)
      if (b.tick <= k.tick) since = std::max(since, b.tick);
    for (const Knot& before : knots)
      if (before.tick < k.tick) since = std::max(since, before.tick);
    if (!f.setup.physical) sheet.add("knot_time", static_cast<double>(k.tick - since) * f.setup.tick_s, k.tick, k.where, of);
    if (k.thrown.size() > 1)
      sheet.add("square", static_cast<double>(opposite) / static_cast<double>(k.thrown.size() - 1), k.tick, k.where, of);
  }
  if (!f.setup.physical || !knots.empty()) sheet.add_all("tail", f.tail);  // of a tied suture
  for (const Sample& cut : f.tail) {
    uint64_t locked = 0;
    for (const Knot& k : f.knot)
      if (k.tick <= cut.tick) locked = std::max(locked, k.tick);
    if (locked > 0) sheet.add("finish_time", static_cast<double>(cut.tick - locked) * f.setup.tick_s, cut.tick, cut.where);
  }
  sheet.add_all("undone_throws", f.undone_throw);
  sheet.add_all("rejected_loops", f.rejected_loop);
}

// Thread between two nodes, along its order [m].
double thread_between(const Snapshot& seen, const SutureView& s, uint32_t a, uint32_t b) {
  const auto at = [&](uint32_t slot) {
    return static_cast<size_t>(std::find(s.thread_order.begin(), s.thread_order.end(), slot) - s.thread_order.begin());
  };
  size_t i = at(a), j = at(b);
  if (i > j) std::swap(i, j);
  if (j >= s.thread_order.size()) return kNotObserved;
  double sum_of = 0;
  for (; i < j; ++i) {
    if (i < s.thread_cut.size() && s.thread_cut[i]) return kNotObserved;
    sum_of += static_cast<double>(distance(seen.particle[s.thread_order[i]], seen.particle[s.thread_order[i + 1]]));
  }
  return sum_of;
}

void measure_line(const Facts& f, const PictureModel& picture, const Snapshot& seen, Sheet& sheet) {
  const uint64_t tick = seen.tick;
  for (const SutureView& s : seen.suture) {
    size_t pair = 0;
    for (const SeamView& p : s.seam) {
      const double gap = static_cast<double>(distance(p.a, p.b)) * kMm;
      const std::string of = fmt::format("pair {}", ++pair);
      sheet.add("gap", gap, tick, 0.5f * (p.a + p.b), of);
      sheet.add("gap_mean", gap, tick, 0.5f * (p.a + p.b), of);
    }
    for (size_t i = 0; i < s.suture_point.size(); ++i) {
      const SuturePointView& p = s.suture_point[i];
      sheet.add("tension_spread", static_cast<double>(std::max(p.tension_needle, p.tension_free)), tick, p.position,
                fmt::format("suture point {}", i + 1));
      if (i == 0 || s.suture_point[i - 1].bite == p.bite) continue;
      const SuturePointView& before = s.suture_point[i - 1];
      const double thread = thread_between(seen, s, before.anchored, p.anchored);
      sheet.add("slack", std::max(0.0, (thread - static_cast<double>(distance(before.position, p.position))) * kMm), tick,
                p.position, fmt::format("span {} to {}", i, i + 1));
    }
  }
  for (size_t w = 0; w < picture.rim.size(); ++w) {
    const std::vector<uint32_t>& rim = picture.rim[w];
    if (rim.size() < 3 || w >= f.lumen.size()) continue;
    const std::string of = fmt::format("edge {}", w + 1);
    Vec3 center{}, axis{}, body{};
    size_t counted = 0;
    for (const uint32_t i : rim) center += picture.particle_rest[i] / static_cast<float>(rim.size());
    for (size_t i = 0; i < rim.size(); ++i)
      axis += cross(picture.particle_rest[rim[i]] - center, picture.particle_rest[rim[(i + 1) % rim.size()]] - center);
    for (size_t i = 0; i < picture.particle_rest.size(); ++i)
      if (i >= picture.wall.size() || picture.wall[i] == w) body += picture.particle_rest[i], ++counted;
    axis = normalized(axis);
    if (counted > 0 && dot(axis, center - body / static_cast<float>(counted)) < 0) axis = -axis;  // out of the opening
    size_t everted = 0;
    double lean = 0;
    for (const uint32_t i : rim) {
      if (i >= seen.rotation.size()) continue;
      const Vec3 from = picture.particle_rest[i] - center, out = normalized(from - axis * dot(from, axis));
      const double outward = static_cast<double>(dot(rotate(seen.rotation[i], axis), out));
      everted += outward > 0.5;
      lean -= portable::asin(std::clamp(outward, -1.0, 1.0)) * kDegrees;
    }
    const double n = static_cast<double>(rim.size());
    sheet.add("eversion", static_cast<double>(everted) / n, tick, center, of);
    sheet.add("inversion", lean / n, tick, center, of);
    if (f.lumen[w] > 0) sheet.add("lumen", rim_area(picture, seen.particle, w) / f.lumen[w], tick, center, of);
  }
  sheet.add("closure", static_cast<double>(seen.closure), tick, picture.focus);
  sheet.add_all("order_errors", f.order_error);
  sheet.add_all("faults", f.fault);
}

void measure_cuts(const Facts& f, const PictureModel& picture, const Snapshot& seen, Sheet& sheet) {
  if (!has_pen(picture)) return;
  if (f.begun) sheet.add("energy_time", f.pen.seconds, f.last, {});
  if (seen.topology.pieces > 0) sheet.add("pieces", seen.topology.pieces, seen.tick, {});
  for (const BleedingView& b : seen.wound.bleeding) sheet.add("blood_loss", static_cast<double>(b.lost) * 1e6, seen.tick, b.at);
  if (f.begun && seen.wound.bleeding.empty()) sheet.add("blood_loss", 0, seen.tick, {});
  if (f.begun) sheet.add("thermal_spread", static_cast<double>(seen.wound.thermal_spread) * kMm, seen.tick, {});
  if (f.begun) sheet.add("burnt_area", static_cast<double>(seen.wound.damaged) * kMm * kMm, seen.tick, {});
  const CutPlaces cut = cut_places(f.edge, f.rest[0], seen);
  sheet.add_all("cut_edge", cut.distance);
  sheet.add_all("cut_spread", cut.distance);
  sheet.add_all("bridges", cut.bridge);
}

void measure_tissue(const Facts& f, Sheet& sheet) {
  for (size_t k = 0; k < f.suture.size(); ++k) {
    const SutureFacts& s = f.suture[k];
    const std::string of = f.suture.size() > 1 ? fmt::format("suture {}", k + 1) : "";
    sheet.add("thread_force", static_cast<double>(s.peak), s.peak_tick, s.peak_where, of);
    sheet.add("thread_impulse", s.impulse, s.peak_tick, s.peak_where, of);
    if (s.changes > 0) sheet.add("force_rate", std::sqrt(s.change2 / s.changes), s.peak_tick, s.peak_where, of);
  }
  for (size_t k = 0; k < f.hand.size(); ++k) {
    const HandFacts& h = f.hand[k];
    const std::string of = k == 0 ? "right hand" : "left hand";
    sheet.add("grasp_force", static_cast<double>(h.peak), h.peak_tick, h.peak_where, of);
    sheet.add("grasp_impulse", h.impulse, h.peak_tick, h.peak_where, of);
    sheet.add("hand_force", static_cast<double>(h.strain), h.strain_tick, h.strain_where, of);
  }
  sheet.add_all("overloads", f.overload);
  sheet.add_all("tissue_grasps", f.tissue_grasp);
  sheet.add_all("tissue_slips", f.tissue_slip);
  sheet.add_all("missed_grasps", f.missed_grasp);
  sheet.add_all("withdrawn", f.withdrawn);
  sheet.add_all("slips", f.needle_slip);
}

void measure_hands(const Facts& f, Sheet& sheet) {
  if (!f.begun) return;
  const double rate = 1 / (f.setup.tick_s * f.stride);
  const auto tick_of = [&](size_t i) { return f.first + static_cast<uint64_t>(i) * f.stride; };
  sheet.add("time", static_cast<double>(f.last - f.first) * f.setup.tick_s, f.last, {});
  std::array<std::vector<double>, 2> speed, voluntary;
  double path = 0;
  for (size_t k = 0; k < 2; ++k) {
    const std::vector<Vec3>& raw = f.path[k];
    if (raw.size() < 5) continue;
    const std::string of = k == 0 ? "right hand" : "left hand";
    const std::vector<Vec3> smooth = low_pass(raw, kMotionCutoff, rate), slow = low_pass(raw, 5, rate);
    speed[k] = speed_of(smooth, rate);
    voluntary[k] = speed_of(low_pass(raw, kVoluntaryCutoff, rate), rate);
    double own = 0, shake = 0;
    size_t idle = 0, idle_for = 0, still = 0, peaks = 0, moving = 0;
    const auto margin = static_cast<size_t>(kSettled * rate);
    for (size_t i = 0; i < raw.size(); ++i) {
      if (i > 0) own += static_cast<double>(distance(smooth[i], smooth[i - 1]));
      idle += voluntary[k][i] < kIdleSpeed;
      idle_for = voluntary[k][i] < kIdleSpeed ? idle_for + 1 : 0;
      if (idle_for <= 2 * margin) continue;
      shake += static_cast<double>(length2(raw[i - margin] - slow[i - margin])), ++still;
    }
    path += own;
    const uint64_t end = tick_of(raw.size() - 1);
    sheet.add("path", own, end, raw.back(), of);
    sheet.add("idle", static_cast<double>(idle) / static_cast<double>(raw.size()), end, raw.back(), of);
    sheet.add("rotation", f.hand[k].turn * kDegrees, end, raw.back(), of);
    sheet.add("volume", ellipsoid_of(smooth) * 1e6, end, raw.back(), of);
    if (still > 0) sheet.add("tremor", std::sqrt(shake / static_cast<double>(still)) * kMm, end, raw.back(), of);
    for (const Stretch& m : movements(voluntary[k], rate)) {
      const size_t n = m.end - m.first;
      sheet.add("movements", static_cast<double>(n) / rate, tick_of(m.first), smooth[m.first], of);
      const Roughness rough = roughness(std::span(smooth).subspan(m.first, n), rate);
      sheet.add("hand_speed", rough.speed * kMm, tick_of(m.first), smooth[m.first], of);
      sheet.add("acceleration", rough.acceleration, tick_of(m.first), smooth[m.first], of);
      sheet.add("jerk", rough.jerk, tick_of(m.first), smooth[m.first], of);
      sheet.add("ldlj", ldlj(std::span(smooth).subspan(m.first, n), rate), tick_of(m.first), smooth[m.first], of);
      sheet.add("sparc", sparc(std::span(speed[k]).subspan(m.first, n), rate), tick_of(m.first), smooth[m.first], of);
      const Course course = course_of(std::span(smooth).subspan(m.first, n), rate);
      sheet.add("curvature", course.curvature, tick_of(m.first), smooth[m.first], of);
      sheet.add("directness", course.directness, tick_of(m.first), smooth[m.first], of);
      peaks += peaks_of(std::span(speed[k]).subspan(m.first, n), kPeakShare);
      moving += n;
    }
    if (moving > 0)
      sheet.add("submovements", static_cast<double>(peaks) * rate / static_cast<double>(moving), end, raw.back(), of);
  }
  if (!f.bite.empty()) sheet.add("path_per_bite", path * kMm / static_cast<double>(f.bite.size()), f.last, {});
  const size_t n = std::min(speed[0].size(), speed[1].size());
  size_t none = 0, any = 0, both = 0, still_for = 0;
  std::array<std::vector<double>, 2> active;  // without the pauses, in which both hands rest alike
  for (size_t i = 0; i < n; ++i) {
    const bool r = voluntary[0][i] >= kIdleSpeed, l = voluntary[1][i] >= kIdleSpeed;
    none += !r && !l, any += r || l, both += r && l;
    if (r || l) active[0].push_back(voluntary[0][i]), active[1].push_back(voluntary[1][i]);
    if (!r && !l && ++still_for && i + 1 < n) continue;
    const double seconds = static_cast<double>(std::exchange(still_for, 0)) / rate;
    if (seconds >= kHesitation)
      sheet.add("hesitations", seconds, tick_of(i) - static_cast<uint64_t>(seconds / f.setup.tick_s), f.path[0][i]);
  }
  if (n > 0) sheet.add("pause", static_cast<double>(none) / static_cast<double>(n), f.last, {});
  if (any > 0) sheet.add("together", static_cast<double>(both) / static_cast<double>(any), f.last, {});
  sheet.add("bimanual", correlation(active[0], active[1]), f.last, {});
}

}  // namespace

const char* better_name(Better better) {
  constexpr const char* name[] = {"higher", "lower", "a band"};
  return name[static_cast<size_t>(better)];
}
const char* summary_name(Summary summary) {
  constexpr const char* name[] = {"mean", "standard deviation", "maximum", "sum", "count", "value"};
  return name[static_cast<size_t>(summary)];
}

std::span<const MetricRow> metric_rows() { return kRow; }

const MetricRow* find_metric(std::string_view key) {
  for (const MetricRow& r : kRow)
    if (key == r.key) return &r;
  return nullptr;
}

Result measure(const Facts& f, const PictureModel& picture, const Snapshot& seen) {
  Result r;
  r.technique = f.setup.technique;
  r.tick_s = f.setup.tick_s;
  r.first_tick = f.first;
  r.ticks = seen.tick;
  r.time_s = f.begun ? static_cast<double>(f.last - f.first) * f.setup.tick_s : 0;
  r.filter = fmt::format("Butterworth, order 2, both ways, {} Hz", kMotionCutoff);
  r.bite = f.bite;
  r.knot = f.setup.physical ? tied_knots(picture, seen) : f.knot;
  Sheet sheet;
  measure_bites(f, sheet);
  measure_knots(f, r.knot, sheet);
  measure_line(f, picture, seen, sheet);
  measure_cuts(f, picture, seen, sheet);
  measure_tissue(f, sheet);
  measure_hands(f, sheet);
  r.metric = sheet.take();
  for (Metric& m : r.metric)
    std::stable_sort(m.sample.begin(), m.sample.end(), [](const Sample& a, const Sample& b) { return a.tick < b.tick; });
  return r;
}

Result measure_stitches(const Facts& f) {
  Result r;
  r.technique = f.setup.technique;
  r.tick_s = f.setup.tick_s;
  r.ticks = f.last;
  Sheet sheet;
  measure_bites(f, sheet);
  measure_knots(f, f.knot, sheet);
  r.metric = sheet.take();
  return r;
}

std::string metrics_markdown() {
  std::string out =
      "| key | metric | unit | summary | better | definition of a sample | source |\n|---|---|---|---|---|---|---|\n";
  const char* group = "";
  for (const MetricRow& r : kRow) {
    if (std::string_view(group) != r.group) out += fmt::format("| **{}** | | | | | | |\n", group = r.group);
    out += fmt::format("| `{}` | {} | {} | {} | {} | {} | {} |\n", r.key, r.name, r.unit, summary_name(r.summary),
                       better_name(r.better), r.definition, r.source);
  }
  return out;
}

}  // namespace catgut::assess
