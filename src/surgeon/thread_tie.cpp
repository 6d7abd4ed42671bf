// SPDX-License-Identifier: Apache-2.0
// surgeon/thread_tie: see the header.
#include "surgeon/thread_tie.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "exchange/strand.h"
#include "exchange/tying.h"
#include "surgeon/reach.h"
#include "surgeon/tie_geometry.h"

namespace catgut {
namespace {

constexpr size_t kHolder = 0, kForceps = 1;
constexpr float kStrandAt = 18e-3f;  // [m] of the shaft, from the grasp point: above the wound
constexpr float kWindAt = 9e-3f;     // [m] of the shaft: plane of the winding hand, nearer the tip than the strand
constexpr float kSteepOnFlat = 3;    // rise of the shaft at a tail on flat tissue: a jaw beside the tail, none under it
constexpr float kTurns = 3;          // [1/s]
constexpr float kTurnLeft =
    2 * kPi - 2;                         // [rad] round the shaft, of a turn whose strands lead away to the knot and to the hand
constexpr float kShaft = 2.2e-3f;        // [m] radius that the turns lie on
constexpr float kJawsRound = 1.7e-3f;    // [m] the same of two turns, which take up no more than they must: round the jaws
constexpr float kNearest = 9e-3f;        // [m] of the winding hand from the shaft
constexpr float kLoose = 0.95f;          // of the strand that is left: nearly taut
constexpr float kWinding = 0.25f;        // [N] above which the winding hand yields
constexpr float kBetweenJaws = 0.6e-3f;  // [m] from the line midway between the jaws: they close on the tail there
constexpr float kJaws = 4.4e-3f;         // [m] of their length, that a tail is taken with: all but the very tips
constexpr float kHeldWell = 1.5e-3f;     // [m] the same of a tail that turns slide over; between jaws and tail they come off
constexpr float kBeside = 4e-3f;         // [m] of tail, on either side of the jaws
constexpr float kPatience = 2;           // [s]; then they close where they are
constexpr float kAhead = 4e-3f;          // [m] of the hand before the jaws, at most
// The same in a lumen: a wall or a finished stitch in the way bears 2.4 N.
constexpr float kGentle = 0.8e-3f;
constexpr float kNearTail = 20e-3f;  // [m] from the tail: a hand nearer than that is gentle
constexpr float kStands = 0.985f;    // cosine of the shaft to the direction in which it goes down
constexpr float kAbove = 15e-3f;     // [m] from the tail, until then
constexpr float kHalfOpen = 0.8f;    // of the jaws, to take the tail
constexpr float kNarrow = 0.5f;      // of the jaws with a turn on them: in a wider gap it falls between them, near the hinge
constexpr float kTaut = 1.2f;        // [N] above which a strand gives no more thread to crossing hands
constexpr float kReach = 0.85f;      // of the tail's length
constexpr float kSlideOff = 1.4f;    // [s]
constexpr float kDrawn = 0.5f;       // of the strand's length: height to which the tail is drawn at most
constexpr float kLow = 4e-3f;        // [m] above the stitch, where strands are pulled
// [N] of either strand before the pull. One strand that is tauter than the other straightens in the throws below, and the other
// one winds round it: they capsize into half hitches, which slide.
constexpr float kEasy = 0.12f;
constexpr float kGives = 0.2f;        // [m/s] per newton above that, by which a hand gives way
constexpr float kMostGiven = 20e-3f;  // [m]
constexpr float kLead = 0.05f;        // [N] by which a strand may be tauter than the other in a pull
constexpr float kEvens = 1.5f;        // [1/s] of what one strand has more slack than the other
constexpr float kFastest = 30e-3f;    // [m/s]
constexpr float kSeated = 0.6f;       // [s] of full tension
// The same of a ring's first throw, whose jaws go down to the stitch meanwhile. Hands above it hold the loop up, which is slack
// by as much when they let go; and thread slides through two turns for seconds.
constexpr float kSeatedFirst = 4, kLevel = 1e-3f, kLowers = 5e-3f;  // [s], [m], [m/s]
constexpr float kTight = 0.8f;        // [s] of a strand that gives no way; then the tail lies as far as it can
constexpr int kAgain = 5;             // times that a throw is wound again
constexpr int kEnough = 3;            // throws of a knot that holds; a further one that fails is left
constexpr int kMostMisses = 3;        // grasps at the tail with a turn on the jaws
constexpr float kBears = 3;           // [N] on a bite, above which the hands give way
constexpr float kOverDrape = 12e-3f;  // [m] of the swage: the needle, which hangs down from the forceps, would scrape on it
constexpr float kCaught = 1.5f, kCaughtFor = 0.2f;     // [N] on the hand more than the tail's tension, [s]
constexpr float kForeign = 1;                          // [N] more than a finished stitch bears while another is tied
constexpr float kStandsOn = 2;                         // [N] on jaws that have not reached the tail: a wall bears them
constexpr float kRises = 8e-3f, kNearlyThere = 2e-3f;  // [m] by which they rise then, and from where they go down again

SeenThrows look(const Snapshot& seen) {
  std::vector<Vec3> thread;
  for (size_t i = 0; i < seen.active().thread_order.size(); ++i) thread.push_back(node_at(seen, i));
  return see_throws(thread);
}

}  // namespace

ThreadTie::ThreadTie(const PictureModel& picture, std::array<ScriptedHand, 2>& hands, const ThreadTieSettings& settings)
    : picture_(picture),
      hands_(hands),
      how_(settings),
      line_{portable::cos(settings.aside), 0, portable::sin(settings.aside)} {}

std::string ThreadTie::doing() const {
  static constexpr const char* kName[] = {"reach for the tail",
                                          "take the tail",
                                          "lift the tail",
                                          "lay the tail",
                                          "let the tail go",
                                          "leave the tail",
                                          "to the strand",
                                          "under the strand",
                                          "wind",
                                          "open the jaws",
                                          "reach for the tail",
                                          "close on the tail",
                                          "draw the tail through",
                                          "cross the hands",
                                          "lower the hands",
                                          "pull",
                                          "hold both strands",
                                          "lay the tail",
                                          "let go",
                                          "leave",
                                          "done"};
  return kName[stage_];
}

float ThreadTie::held_tail() const { return tail_ - taken_; }

void ThreadTie::again(const Snapshot& seen, Stage after) {
  ++retries_, misses_ = 0;
  lost_ = after == drop_tail;
  snugs_ = after != to_work && throws_ == 2 && !keep_;  // an assistant holds the first throw of one that keeps
  if (++tries_ <= kAgain) return go(seen, after);
  const SeenThrows knot = look(seen);
  failed_ = !is_enough(knot), ends_ = true;
  wanted_ = std::min(wanted_, knot.alternating());
  go(seen, drop_tail);  // or hands that go away take it along
}

// A throw has failed again and again, and the knot holds without it.
bool ThreadTie::is_enough(const SeenThrows& knot) const { return tries_ >= kAgain && knot.alternating() >= kEnough; }

// What the knot lacks is wound from this side.
void ThreadTie::wind_next(const SeenThrows& knot) {
  laid_ = knot.next(first_laid_);
  sense_ = laid_ * side_;
}

// The throw is pulled tight and both hands have let go of it: winds again what is not there.
void ThreadTie::seated(const Snapshot& seen) {
  const SeenThrows knot = look(seen);
  if (knot.alternating() >= wanted_ || is_enough(knot)) {
    wanted_ = std::min(wanted_, knot.alternating()), stage_ = done;
    return;
  }
  side_ = -side_;
  wind_next(knot);
  measure(seen);
  again(seen, to_work);
}

void ThreadTie::begin(const Snapshot& seen, int wraps, int sense, bool first, bool keep) {
  keep_ = keep;
  wraps_ = wraps, first_ = first, failed_ = seen.active().suture_point.empty(), ends_ = false, misses_ = 0, tries_ = 0;
  if (failed_) return void(stage_ = done);
  origin_ = 0.5f * (seen.active().suture_point.front().position + seen.active().suture_point.back().position);
  if (++throws_ > 2) origin_ = knot_center(seen, origin_);
  const Vec3 swage = needle_swage(picture_, seen);
  // The long strand is on the side of its hole for the first throw; then the ends have crossed.
  if (first) {
    side_ = seen.active().suture_point.back().position.x > origin_.x ? 1.0f : -1.0f;
    const ToolView& forceps = seen.tool[kForceps];
    const Vec3 z = rotate(forceps.pose.q, {0, 0, 1});
    forceps_angle_ = portable::atan2(z.y, z.x);
    forceps_rest_ = axis_angle({0, 0, 1}, -forceps_angle_) * forceps.pose.q;
    swage_in_forceps_ = to_local(forceps.pose, swage);
    holder_turn_ = hands_[kHolder].pose.q;
    tip_ = hands_[kHolder].pose.p, hand_ = swage;
  } else {
    side_ = -side_;
  }
  const float way = static_cast<float>(sense);
  sense_ = first ? way : -way * laid_ * side_;
  laid_ = side_ * sense_;
  if (first) first_laid_ = laid_;
  if (first || sense > 0) ++wanted_;
  measure(seen);
  go(seen, first ? to_tail : to_work);
}

void ThreadTie::glide_to(Vec3 tip, Vec3 hand, float speed, float angle) {
  tip_from_ = tip_, tip_to_ = tip, hand_from_ = hand_, hand_to_ = hand;
  holder_from_ = holder_turn_, holder_to_ = holder_turn(shaft_from(side_));
  angle_from_ = forceps_angle_, angle_to_ = angle;
  done_ = 0, shaft_ = shaft_from(side_);
  const float turn = length(rotation_vector(holder_to_ * conjugate(holder_from_)));
  const float far =
      std::max({distance(tip_, tip), distance(hand_, hand), 0.03f * turn, 0.03f * std::abs(angle - forceps_angle_)});
  seconds_ = std::max(0.1f, 1.5f * far / speed);
}

bool ThreadTie::glide(float dt) {
  done_ += dt / seconds_;
  const float e = smooth(done_);
  tip_ = lerp(tip_from_, tip_to_, e), hand_ = lerp(hand_from_, hand_to_, e);
  if (stage_ == to_tail || stage_ == to_work) {
    // Over the stitch, the strand nearly taut all the way: slack thread that lags behind drifts between the jaws.
    const Vec3 from = hand_from_ - origin_, to = hand_to_ - origin_;
    const Vec3 way = lerp(normalized(from), normalized(to), e) + Vec3{0, 1.2f * e * (1 - e), 0};
    hand_ = origin_ + normalized(way) * (length(from) + (length(to) - length(from)) * std::min(1.0f, 4 * e));
  }
  holder_turn_ = nlerp(holder_from_, holder_to_, e);
  forceps_angle_ = angle_from_ + (angle_to_ - angle_from_) * e;
  return done_ >= 1;
}

// The hand goes no farther than this ahead of the jaws, which what lies in the way holds back.
void ThreadTie::lead_by(float most, Vec3 jaws) {
  tip_ = jaws + (tip_ - jaws) * std::min(1.0f, most / std::max(distance(tip_, jaws), 1e-6f));
}

void ThreadTie::place() {
  hand_.y = std::max(hand_.y, picture_.drape + kOverDrape);
  hands_[kHolder].pose = {tip_, holder_turn_};
  const Quat turn = axis_angle({0, 0, 1}, forceps_angle_) * forceps_rest_;
  hands_[kForceps].pose = {hand_ - rotate(turn, swage_in_forceps_), turn};
}

// Toward the knot, by as much as the strand in this hand asks for.
Vec3 ThreadTie::give(Vec3 at, float felt, float& given, float dt) const {
  given = std::clamp(given + dt * std::clamp(kGives * (felt - kEasy), -0.03f, 0.06f), 0.0f, kMostGiven);
  return at + normalized(origin_ - at) * given;
}

void ThreadTie::go(const Snapshot& seen, Stage stage) {
  stage_ = stage, waited_ = risen_ = caught_ = 0, tail_given_ = strand_given_ = 0;
  const Vec3 shaft = shaft_from(side_);
  const Vec3 work = origin_ + around(side_, 0.5f * kPi, shaft) * height_ - shaft * kStrandAt;
  const Vec3 aside = origin_ + Vec3{side_ * 0.28f, 0.50f, -0.72f} * strand_;  // of the strand: behind the work
  const float toward = side_ > 0 ? kPi - 0.15f : 0.15f;                       // the forceps faces the needle holder
  switch (stage) {
    case to_tail:
    case take_tail: {  // to lay the tail straight on the side away from the needle; it hangs in front, or down between walls
      const Vec3 at = tail_node(seen, tail_place(seen, kTailEnd + 3e-3f * static_cast<float>(misses_)));
      // From the front where nothing stands there, else from above.
      const Vec3 from[] = {normalized(Vec3{0.1f * side_, 0.35f, 0.93f}), normalized(Vec3{0.1f * side_, 1, 0.9f}),
                           normalized(Vec3{0.1f * side_, 1, 0.3f}),      normalized(Vec3{0.1f * side_, 1, -0.3f}),
                           normalized(Vec3{0.4f * side_, 1, 0}),         normalized(Vec3{-0.4f * side_, 1, 0})};
      const Vec3 z = how_.flat ? from[0] : from[clear_shaft(picture_, seen, at, from)],
                 along = node_at(seen, node_along(seen, 0, kTailEnd + 6e-3f, 1)) - tail_node(seen, kTailEnd);
      const Vec3 x = normalized(cross(z, along), {1, 0, 0});
      lost_ = false;
      glide_to(stage == to_tail ? at + z * 0.03f : at, aside,
               stage == to_tail ? how_.speed : (how_.lumen ? 0.25f : 0.5f) * how_.speed, forceps_angle_);
      holder_to_ = from_axes(x, cross(z, x), z);
      break;
    }
    case lift_tail:
      steady_ = 0;
      glide_to(origin_ + Vec3{-side_ * 0.5f * tail_, 0.5f * tail_, 0.5f * tail_}, aside, 0.5f * how_.speed, forceps_angle_);
      break;
    case lay_tail: {
      steady_ = 0;
      const Vec3 root = first_ ? seen.active().suture_point.front().position : origin_;
      glide_to(root - line_ * (side_ * (tail_ - kTailEnd - 2e-3f)) + Vec3{0, 1e-3f, 0},
               snugs_ ? origin_ + line_ * (side_ * 0.85f * strand_) + Vec3{0, 4e-3f + kLow, 0} : hand_, 0.4f * how_.speed,
               forceps_angle_);
      break;
    }
    case off_tail:
      glide_to(tip_ + shaft * (lost_ ? 0.06f : 0.03f), hand_, how_.speed, forceps_angle_);
      break;
    case to_work: {
      angle_ = sense_ > 0 ? 0 : kPi, turned_ = 0, slack_ = 1, snugs_ = false;
      const float drop = kStrandAt - kWindAt, taut = kLoose * strand_;
      radius_ = std::sqrt(std::max(kNearest * kNearest, taut * taut - height_ * height_ - drop * drop));
      // The needle holder comes from far behind: nothing of it touches the strand on the way.
      glide_to(work + shaft * 0.06f, work + shaft * kWindAt + around(side_, angle_, shaft) * radius_, how_.speed, toward);
      break;
    }
    case into_work:
      glide_to(work, hand_, how_.speed, toward);
      break;
    case fetch: {  // across the slope that the tail lies on; steeper where walls or other stitches are in the way
      const Vec3 goal = tail_node(seen, tail_place(seen, kTailEnd));
      const auto clear = [&](const auto& way) { return way[clear_shaft(picture_, seen, goal, way)]; };
      approach_ = how_.flat    ? normalized(Vec3{side_, kSteepOnFlat, 0})
                  : how_.lumen ? clear(ways_into_lumen(side_, goal.z - origin_.z))
                               : clear(ways_to_tail(side_, wall_normal(picture_, seen, goal)));
      taken_ = grasp_place(seen);
      break;
    }
    case draw: {
      drawn_ = slid_ = 0;
      // Out of the turn, no farther than the tail reaches.
      const Vec3 out = around(side_, 0.5f * kPi, shaft) * (kDrawn * strand_) + shaft * 16e-3f;
      tip_from_ = tip_, tip_to_ = origin_ + normalized(out) * std::min(length(out), kReach * (tail_ - kTailEnd));
      break;
    }
    // The strand first. A taut tail beside a slack strand would draw that into the loop below the knot.
    case cross_up:
      glide_to(origin_ + line_ * (side_ * 0.6f * held_tail()) + Vec3{0, 8e-3f + kLow, 0},
               origin_ - line_ * (side_ * std::min(24e-3f, 0.5f * strand_)) + Vec3{0, 12e-3f + kLow, 0}, 0.6f * how_.speed,
               forceps_angle_);
      break;
    case cross_down:
      glide_to(origin_ + line_ * (side_ * 0.75f * held_tail()) + Vec3{0, 2e-3f + kLow, 0},
               origin_ - line_ * (side_ * 0.85f * strand_) + Vec3{0, 4e-3f + kLow, 0}, 0.6f * how_.speed, forceps_angle_);
      break;
    case pull:
      steady_ = 0;
      break;
    case lay:
      pulled_ = std::min(felt_, tail_felt_);
      // Both strands alike, and slowly.
      glide_to(tip_ - line_ * (tail_side() * 2e-3f) - Vec3{0, 3e-3f, 0}, hand_ + line_ * (tail_side() * 2e-3f),
               0.06f * how_.speed, forceps_angle_);
      break;
    case away:
      glide_to(tip_ + shaft * 0.06f, hand_, how_.speed, forceps_angle_);
      break;
    default:
      break;
  }
}

bool ThreadTie::operate(const Snapshot& seen, float dt) {
  if (stage_ == done) return true;
  feel(seen);
  waited_ += dt;
  const Vec3 shaft = shaft_;
  ScriptedHand& holder = hands_[kHolder];
  const bool holds = seen.tool[kHolder].held == Held::thread;
  const bool tail = holds && node_of(seen, seen.tool[kHolder].held_slot) < first_point_node(seen);
  if (seen.tool[kForceps].held != Held::needle || seen.active().suture_point.empty()) {  // lost, or the bites torn out
    failed_ = true, stage_ = done;
    return true;
  }
  if (holds && (stage_ == to_work || stage_ == into_work || stage_ == wind)) {  // it stuck to the jaws
    again(seen, drop_tail), lost_ = false;
    return place(), stage_ == done;
  }
  switch (stage_) {
    case to_tail:
      move_jaw(holder, kHalfOpen, dt);
      if (glide(dt)) go(seen, take_tail);
      break;
    case take_tail:
    case close: {
      const bool there = stage_ == close || glide(dt);
      if (stage_ == take_tail && how_.lumen) lead_by(kGentle, seen.tool[kHolder].pose.p);
      if (!there) {
        move_jaw(holder, kHalfOpen, dt);
        waited_ = 0;
        break;
      }
      const bool shut = move_jaw(holder, 0, dt);
      const bool laying = stage_ == take_tail;
      const ToolView& jaws = seen.tool[kHolder];
      const bool well = (laying || length(from_jaws(jaws, node_at(seen, node_of(seen, jaws.held_slot)), kJaws)) < kHeldWell) &&
                        !pinches_strand(seen) && !catches_other_thread(picture_, seen, jaws);
      if (tail && well && waited_ > 0.3f) {
        if (laying) go(seen, lift_tail);
        else if (wound(seen) < kTurnLeft * static_cast<float>(wraps_)) again(seen, lift_tail);  // a turn has slid off
        else go(seen, draw);
      } else if (shut && waited_ > 0.5f) {
        if (++misses_ <= (laying ? 6 : kMostMisses)) go(seen, laying ? to_tail : open);
        else again(seen, laying ? to_tail : drop_tail);
      }
      break;
    }
    case lift_tail:
    case lay_tail: {  // no farther than both strands give way
      const float pace = std::clamp(1.5f - std::max(felt_, tail_felt_) / kWinding, 0.0f, 1.0f);
      steady_ = pace < 0.05f ? steady_ + dt : 0;
      const bool there = glide(pace * dt);
      // Hands that keep the strands taut here would open a throw below that has not tightened.
      if (throws_ > 1) tip_ = give(tip_, tail_felt_, tail_given_, dt), hand_ = give(hand_, felt_, strand_given_, dt);
      if (there || steady_ > kTight || waited_ > 2 * kPatience)
        go(seen, stage_ == lift_tail ? lay_tail : snugs_ ? pull : drop_tail);
      break;
    }
    case drop_tail:
      if (move_jaw(holder, kHalfOpen, dt) && waited_ > 0.2f) go(seen, off_tail);
      break;
    case off_tail:
      if (!glide(dt) || !move_jaw(holder, 0, dt)) break;
      if (holds && ++misses_ <= kMostMisses) go(seen, drop_tail);  // thread has stayed between the jaws
      else misses_ = 0, go(seen, ends_ ? done : lost_ ? to_tail : to_work);
      break;
    case to_work:
      move_jaw(holder, 0, dt);
      if (glide(dt)) go(seen, into_work);
      break;
    case into_work:
      if (glide(dt)) go(seen, wind);
      break;
    case wind: {
      const float want = 2 * kPi * static_cast<float>(wraps_);
      if (felt_ > kWinding) slack_ = std::max(0.7f, slack_ - 0.3f * dt);
      const float left = strand_ - height_ - (wraps_ > 1 ? kJawsRound : kShaft) * turned_;
      const float goal = std::max(kNearest, slack_ * kLoose * left);
      // From the straight strand at the beginning to one that leaves the shaft.
      const float direct = std::min(1.0f, turned_ / 1.5f);
      const float wanted = radius_ + (goal - radius_) * direct;
      radius_ = std::max(kNearest, radius_ + std::clamp(wanted - radius_, -0.1f * dt, 0.1f * dt));
      const float calm = felt_ > 2 * kWinding ? 0.2f : 1.0f;
      turned_ = std::min(want, turned_ + 0.8f * calm * how_.speed * dt / radius_);
      angle_ = (sense_ > 0 ? 0 : kPi) + sense_ * turned_;
      const float at = kWindAt - 3e-3f * std::max(0.0f, -portable::sin(angle_));
      hand_ = tip_ + shaft * at + around(side_, angle_, shaft) * radius_;
      if (turned_ >= want) go(seen, open);
      break;
    }
    case open:
      if (move_jaw(holder, std::min(kHalfOpen, kNarrow + 0.1f * static_cast<float>(misses_)), dt)) go(seen, fetch);
      break;
    case fetch: {
      // By sight of the jaws, which lag behind the hand.
      const float place = tail_place(seen, taken_);
      // Not down before the shaft stands as it shall: a jaw would meet the wall, and the tail in a lumen has walls beside it.
      const bool stands = dot(shaft_, approach_) > kStands;
      const Vec3 goal = tail_node(seen, place) + (stands ? Vec3{} : approach_ * kAbove) + shaft_ * risen_,
                 jaws = seen.tool[kHolder].pose.p;
      const Vec3 way = from_jaws(seen.tool[kHolder], goal, kJaws);
      const float left = length(way),
                  speed = std::min(0.7f * how_.speed, 0.01f + 4 * left) * (felt_ > 2 * kWinding ? 0.3f : 1.0f);
      tip_ += way * (std::min(speed * dt, left) / std::max(left, 1e-6f));
      // A jaw that stands on the wall beside the tail would plough both away: up once, and down again nearer to the knot.
      if (risen_ > 0 && left < kNearlyThere) risen_ = 0;
      caught_ = risen_ == 0 && length(seen.tool[kHolder].force) > kStandsOn ? caught_ + dt : 0;
      if (caught_ > kCaughtFor && left > kBetweenJaws && misses_ == 0) {
        ++misses_, risen_ = kRises, waited_ = caught_ = 0;
        taken_ = grasp_place(seen);
      }
      // Steeper, and turned until the tail passes between the jaws.
      shaft_ = normalized(lerp(shaft_, approach_, std::min(1.0f, kTurns * dt)));
      const Vec3 along = tail_node(seen, place + kBeside) - tail_node(seen, place - kBeside);
      const Vec3 across = normalized(cross(shaft_, along), {0, 0, 1});
      holder_turn_ = nlerp(holder_turn_, holder_turn(shaft_, across.z < 0 ? -across : across), std::min(1.0f, kTurns * dt));
      lead_by(how_.lumen && left < kNearTail ? kGentle : kAhead, jaws);
      // The winding hand goes along and keeps the turns on the jaws.
      if (felt_ > kWinding) radius_ = std::max(kNearest, radius_ - 0.06f * dt);
      else if (felt_ < 0.02f) radius_ = std::min(0.5f * strand_, radius_ + 0.1f * dt);
      hand_ = tip_ + shaft * kWindAt + around(side_, angle_, shaft) * radius_;
      if ((stands && left < kBetweenJaws) || waited_ > (how_.lumen ? 1.5f : 1.0f) * kPatience || felt_ > kTaut) go(seen, close);
      break;
    }
    case draw: {
      if ((!holds && waited_ > 0.2f) || foreign_ > kForeign) {  // the tail has slipped out; or more than it is held
        again(seen, drop_tail);
        break;
      }
      const float far = std::max(1e-3f, distance(tip_from_, tip_to_));
      const bool taut = tail_felt_ > (throws_ > 1 ? 2 * kEasy : 2 * kWinding);
      const float speed =
          std::min(0.7f * how_.speed, 0.02f + 4 * (far - drawn_)) * std::clamp(1.5f - tail_felt_ / 0.1f, 0.15f, 1.0f);
      if (!taut) drawn_ = std::min(far, drawn_ + speed * dt);
      tip_ = lerp(tip_from_, tip_to_, drawn_ / far);
      if (throws_ > 1) tip_ = give(tip_, tail_felt_, tail_given_, dt);
      // The winding hand pulls the turn off the jaws, which have gone on; it waits where the turn catches on them.
      caught_ = felt_ > kCaught ? caught_ + dt : 0;
      if (caught_ > kCaughtFor || waited_ > 5 * kPatience) {
        again(seen, drop_tail);
        break;
      }
      if (felt_ < kTaut) slid_ = std::min(1.0f, slid_ + dt / kSlideOff);
      const float turn = sense_ * 0.5f * kPi;
      const Vec3 middle = tip_from_ + shaft * kWindAt, past = middle - shaft * 26e-3f + Vec3{0, 8e-3f, 0};
      if (felt_ > 0.1f) radius_ = std::max(kNearest, radius_ - 0.06f * dt);
      else if (felt_ < 0.02f) radius_ = std::min(0.6f * strand_, radius_ + 0.2f * dt);
      hand_ = lerp(middle, past, slid_) + around(side_, angle_ + turn * slid_, shaft) * radius_;
      const Vec3 reach = hand_ - origin_;  // no farther than the strand, which is short for a late throw
      if (length(reach) > kLoose * strand_) hand_ = origin_ + normalized(reach) * (kLoose * strand_);
      if (slid_ >= 1 && (taut || drawn_ >= far || waited_ > 5)) go(seen, cross_up);
      break;
    }
    case cross_up:
    case cross_down: {
      const float most = std::max(felt_, tail_felt_);
      const bool there = glide(dt * std::clamp(1.2f - most / (4 * kEasy), 0.1f, 1.0f));
      tip_ = give(tip_, tail_felt_, tail_given_, dt), hand_ = give(hand_, felt_, strand_given_, dt);
      if (stage_ == cross_up && (there || (done_ > 0.6f && most > kTaut))) go(seen, cross_down);
      else if (stage_ == cross_down && (there || std::min(felt_, tail_felt_) > 0.5f || most > kTaut)) {
        // A turn that slid off without the tail in it, and a throw below that came undone, are seen before they are pulled on.
        const SeenThrows knot = look(seen);
        if (knot.alternating() < wanted_ && !is_enough(knot)) wind_next(knot), again(seen, lift_tail);
        else go(seen, pull);
      }
      break;
    }
    case pull:
    case hold: {
      // Neither pulls harder than the other: a strand that is tight while the other is slack becomes a post.
      float load = 0;  // [N] on a bite
      for (const SuturePointView& p : seen.active().suture_point) load = std::max({load, p.tension_needle, p.tension_free});
      const auto pace = [&](float felt, float other) {
        const float want = load > kBears ? 0.8f * felt : std::min(how_.pull, 1.2f * other + kLead);
        return dt * std::clamp((felt < kEasy ? 0.25f : 0.03f) * (want - felt), -0.02f, 0.02f);
      };
      // Before either is taut, the one with more slack is drawn in and the other one waits for it, for the same reason.
      const float easy = std::clamp(1 - std::min(felt_, tail_felt_) / kEasy, 0.0f, 1.0f);
      const float more = slack_of(seen, true) - slack_of(seen, false);
      const float even = stage_ == pull ? dt * std::clamp(kEvens * more, -kFastest, kFastest) * easy : 0.0f;
      const Vec3 out = line_ * tail_side();
      tip_ += out * (pace(tail_felt_, felt_) + even), hand_ -= out * (pace(felt_, tail_felt_) - even);
      steady_ = std::min(tail_felt_, felt_) > 0.9f * how_.pull ? steady_ + dt : 0;
      const bool down = how_.lumen && throws_ == 1;
      if (down && stage_ == pull && std::min(felt_, tail_felt_) > 0.7f * how_.pull)
        tip_.y = std::max(std::min(tip_.y, origin_.y + kLevel), tip_.y - kLowers * dt);
      const bool lost = !holds && waited_ > 0.2f;
      // More on the hand than on the tail: a turn has caught on the jaws, too.
      caught_ = holds && length(seen.tool[kHolder].force) > how_.pull + kCaught ? caught_ + dt : 0;
      if (caught_ > kCaughtFor) {
        again(seen, drop_tail);
        break;
      }
      if (stage_ == pull && (steady_ > (down ? kSeatedFirst : kSeated) || waited_ > 12 || lost))
        go(seen, !snugs_ && look(seen).alternating() >= wanted_ ? hold : lay);
      else if (stage_ == hold && (!keep_ || waited_ > 12)) go(seen, lay);
      break;
    }
    case lay:
      if (glide(dt)) go(seen, snugs_ ? drop_tail : release);
      break;
    case release:
      if (move_jaw(holder, kHalfOpen, dt)) go(seen, away);
      break;
    case away:
      if (glide(dt)) seated(seen);
      break;
    default:
      break;
  }
  place();
  return stage_ == done;
}

}  // namespace catgut
