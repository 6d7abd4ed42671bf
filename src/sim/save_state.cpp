// sim/save_state: the whole state as bytes, and its hash. One list of fields serves saving, loading and hashing, so that none
// can forget one.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "core/check.h"
#include "core/hash.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

// Structs made of four-byte members only: no padding, so their bytes are their value.
template <typename T>
constexpr bool kPlain = std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, Vec3> || std::is_same_v<T, Vec4> ||
                        std::is_same_v<T, Quat> || std::is_same_v<T, Pose> || std::is_same_v<T, TissuePoint> ||
                        std::is_same_v<T, BiteEnd> || std::is_same_v<T, Weld> || std::is_same_v<T, Attachment> ||
                        std::is_same_v<T, ChannelPoint> || std::is_same_v<T, RigidBody> || std::is_same_v<T, ThreadHold> ||
                        std::is_same_v<T, ClosurePlan::Pull> || std::is_same_v<T, ClosurePlan::Pair> ||
                        std::is_same_v<T, TissuePin> || std::is_same_v<T, SettledNode> || std::is_same_v<T, KnotThrow> ||
                        std::is_same_v<T, SeamRow> || std::is_same_v<T, LembertStitch> || std::is_same_v<T, LembertRow>;
static_assert(sizeof(Weld) % 4 == 0 && sizeof(Weld) == 4 * (2 + 3 * 7 + 2 + 6));
static_assert(sizeof(TissuePoint) == 4 * (1 + 16 + 16));
static_assert(sizeof(Attachment) == sizeof(TissuePoint) + 4 * (1 + 3 + 1 + 3));
static_assert(sizeof(ChannelPoint) == sizeof(TissuePoint) + 4 * (4 + 3 + 1));
static_assert(sizeof(RigidBody) == 4 * (3 + 4 + 3 + 3 + 3 + 4));
static_assert(sizeof(TissuePin) == 2 * sizeof(TissuePoint) + 4 * 4 && sizeof(SettledNode) == 4 * 4 &&
              sizeof(KnotThrow) == 4 * 5 && sizeof(ClosurePlan::Pair) == 2 * sizeof(TissuePoint) + 4 * 4);
static_assert(sizeof(SeamRow) == 4 * 5 && sizeof(LembertStitch) == 4 * 3 && sizeof(LembertRow) == 4 * 3);
static_assert(sizeof(ThreadHold) == 4 * 6 && sizeof(BiteEnd) == sizeof(TissuePoint) + 4 * 4 &&
              sizeof(ClosurePlan::Pull) == sizeof(TissuePoint) + 4 * 6);

template <typename A>
void fields(A& a, ThreadAnchor& t) {
  a(t.slot), a(t.point), a(t.offset), a(t.knotted), a(t.friction), a(t.capstan), a(t.slipping), a(t.blocked_needle),
      a(t.blocked_free), a(t.tension_needle), a(t.tension_free);
}
template <typename A>
void fields(A& a, Bite& b) {
  a(b.entry), a(b.exit), a(b.depth), a(b.has_exit), a(b.complete), a(b.cancelled), a(b.nearest);
}
template <typename A>
void fields(A& a, OpenBite& o) {
  a(o.bite), a(o.phase), a(o.drawn), a(o.told);
}
template <typename A>
void fields(A& a, SuturePoint& p) {
  a(p.bite), a(p.exit), a(p.anchor);
}
template <typename A>
void fields(A& a, HandState& h) {
  a(h.held), a(h.slot), a(h.at), a(h.jaw);
}
template <typename A>
void fields(A& a, ToolLoop& l) {
  a(l.wraps), a(l.handed), a(l.first), a(l.last), a(l.told), a(l.spent), a(l.jaw);
}
template <typename A>
void fields(A& a, Knot& k) {
  a(k.phase), a(k.hand), a(k.begun), a(k.target), a(k.from), a(k.left), a(k.hand_from), a(k.strand), a(k.end[0]), a(k.end[1]),
      a(k.slot[0]), a(k.slot[1]), a(k.slots), a(k.snug), a(k.throws), a(k.told);
  for (KnotThrow& t : k.thrown) a(t);
}
template <typename A>
void fields(A& a, SettledStitch& s) {
  a(s.node), a(s.knot);
}
template <typename A>
void fields(A& a, State& s) {
  a(s.tick);
  a(s.solver.x), a(s.solver.v);
  a(s.solver.rotation.x), a(s.solver.rotation.y), a(s.solver.rotation.z), a(s.solver.rotation.w);
  a(s.solver.body);
  a(s.solver.thread.order), a(s.solver.thread.rest), a(s.solver.thread.anchor), a(s.solver.thread.hold),
      a(s.solver.thread.tension), a(s.solver.thread.cut);
  a(s.solver.weld), a(s.solver.attach), a(s.solver.pin), a(s.solver.channel), a(s.solver.thread_collides),
      a(s.solver.body_collides);
  a(s.suture.bite), a(s.suture.point), a(s.suture.open), a(s.suture.tip_inside), a(s.suture.attached);
  a(s.suture.attached_from), a(s.suture.hand[0]), a(s.suture.hand[1]);
  for (ToolLoop& l : s.suture.loop) a(l);
  a(s.suture.knot), a(s.suture.settled), a(s.suture.buttons[0]), a(s.suture.buttons[1]), a(s.suture.taken);
  PurseStringState& p = s.technique.purse_string;
  a(p.ring_complete), a(p.closing), a(p.finished), a(p.path_start), a(p.path_end), a(p.checked), a(p.area_start);
  SeamState& m = s.technique.seam;
  a(m.row), a(m.first_row), a(m.taken), a(m.points), a(m.passes), a(m.throws), a(m.told);
  LembertState& l = s.technique.lembert;
  a(l.stitch), a(l.row), a(l.taken), a(l.throws), a(l.knot), a(l.tied), a(l.told);
  a(s.plan.pull), a(s.plan.progress), a(s.plan.compliance), a(s.plan.pair);
  a(s.hand[0]), a(s.hand[1]), a(s.hand_known[0]), a(s.hand_known[1]);
}

struct Writer {
  std::vector<std::byte>& out;
  void bytes(const void* p, size_t n) {
    const std::byte* b = static_cast<const std::byte*>(p);
    out.insert(out.end(), b, b + n);
  }
  template <typename T>
  void operator()(T& v) {
    if constexpr (kPlain<T>) bytes(&v, sizeof v);
    else fields(*this, v);
  }
  template <typename T, typename Alloc>
  void operator()(std::vector<T, Alloc>& v) {
    const uint64_t n = v.size();
    bytes(&n, sizeof n);
    if constexpr (kPlain<T>) bytes(v.data(), n * sizeof(T));
    else
      for (T& e : v) (*this)(e);
  }
};

struct Reader {
  const std::vector<std::byte>& in;
  size_t at = 0;
  void bytes(void* p, size_t n) {
    if (n > in.size() - at)
      throw InputError("saved state", "it ends too early", "the file was cut or belongs to another scene");
    if (n == 0) return;  // an empty array has no place to copy to
    std::memcpy(p, in.data() + at, n);
    at += n;
  }
  template <typename T>
  void operator()(T& v) {
    if constexpr (std::is_same_v<T, bool>) {  // a byte that is neither 0 nor 1 is no bool
      uint8_t byte = 0;
      bytes(&byte, 1);
      if (byte > 1) throw InputError("saved state", "a flag is neither on nor off", "the file is damaged");
      v = byte != 0;
    } else if constexpr (kPlain<T>) {
      bytes(&v, sizeof v);
    } else {
      fields(*this, v);
    }
  }
  template <typename T, typename Alloc>
  void operator()(std::vector<T, Alloc>& v) {
    uint64_t n = 0;
    bytes(&n, sizeof n);
    // Memory is asked for only when the file is long enough to fill it: no row takes more than twice its bytes there.
    if (n > (in.size() - at) / std::max<size_t>(1, sizeof(T) / 2))
      throw InputError("saved state", "an array has an impossible length", "the file is damaged");
    v.resize(n);
    if constexpr (kPlain<T>) bytes(v.data(), n * sizeof(T));
    else
      for (T& e : v) (*this)(e);
  }
};

// Whether every index in a state that was read leads somewhere: the stages trust them. `fresh`: a state of the same model.
bool fits(const Model& model, const State& s, const State& fresh) {
  const SolverModel& m = model.solver;
  const SolverState &a = s.solver, &b = fresh.solver;
  if (a.x.size() != b.x.size() || a.v.size() != b.v.size() || a.body.size() != b.body.size() ||
      a.rotation.x.size() != b.rotation.x.size() || a.rotation.y.size() != b.rotation.y.size() ||
      a.rotation.z.size() != b.rotation.z.size() || a.rotation.w.size() != b.rotation.w.size() ||
      a.thread.order.size() != b.thread.order.size() || a.thread.rest.size() != b.thread.rest.size() ||
      a.thread.tension.size() != b.thread.tension.size() || a.thread.cut.size() != b.thread.cut.size() ||
      a.thread_collides.size() != b.thread_collides.size() || a.body_collides.size() != b.body_collides.size())
    return false;
  // Every thread particle once.
  const uint32_t first = m.thread.first_slot, count = m.thread.count;
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> node(count, kNone);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t slot = a.thread.order[i] - first;  // wraps to a large number below the first
    if (slot >= count || node[slot] != kNone) return false;
    node[slot] = i;
  }
  const int bodies = static_cast<int>(a.body.size());
  const auto point_ok = [&](const TissuePoint& p) {
    if (p.count > TissuePoint::kMost) return false;
    for (uint32_t k = 0; k < p.count; ++k)
      if (p.particle[k] >= m.tissue) return false;
    return true;
  };
  const auto end_ok = [&](const BiteEnd& e) { return e.triangle < m.collision.surface.size() && point_ok(e.point); };
  for (const ThreadAnchor& t : a.thread.anchor) {  // the thread goes on to both sides of a suture point
    if (t.slot - first >= count || !point_ok(t.point)) return false;
    const uint32_t i = node[t.slot - first];
    if (i == 0 || i + 1 == count) return false;
  }
  for (const ThreadHold& h : a.thread.hold)
    if (h.slot - first >= count || h.body < 0 || h.body >= bodies || h.kind > HoldKind::loop) return false;
  for (const TissuePin& p : a.pin)
    if (!point_ok(p.a) || !point_ok(p.b) || p.owner > PinOwner::passage) return false;
  if (a.weld.size() < 2) return false;
  for (size_t k = 0; k < a.weld.size(); ++k) {  // the first two hold the tools to their hands
    const Weld& w = a.weld[k];
    if (w.a < 0 || w.a >= bodies || w.b < -1 || w.b >= bodies || (k < 2 && (w.a != static_cast<int>(k) || w.b != -1)))
      return false;
  }
  bool tip_attached = false;
  for (const Attachment& t : a.attach) {
    if (t.body < -1 || t.body >= bodies || !point_ok(t.point)) return false;
    tip_attached = tip_attached || t.body == static_cast<int>(kNeedle);
  }
  for (const ChannelPoint& c : a.channel)
    if (!point_ok(c.point)) return false;
  const SutureState& u = s.suture;
  for (const Bite& bite : u.bite)
    if (bite.nearest >= m.tissue || !end_ok(bite.entry) || !end_ok(bite.exit)) return false;
  for (const SuturePoint& p : u.point)
    if (p.bite >= u.bite.size() || p.anchor >= a.thread.anchor.size()) return false;
  for (const OpenBite& o : u.open)
    if (o.phase == NeedlePhase::outside || o.phase > NeedlePhase::back_in || o.bite >= u.bite.size()) return false;
  if (u.attached && (!tip_attached || phase_of(u) != NeedlePhase::tip_in)) return false;
  const bool back_in = std::any_of(u.open.begin(), u.open.end(), [](auto& o) { return o.phase == NeedlePhase::back_in; });
  if (back_in && u.point.empty()) return false;
  for (const HandState& h : u.hand)
    if (h.held > Held::tissue || (h.held == Held::thread && h.slot - first >= count) ||
        (h.held == Held::tissue && h.slot >= m.tissue))
      return false;
  for (const ToolLoop& l : u.loop)
    if (l.told >= LoopReason::count_ || (l.wraps > 0 && (l.first - first >= count || l.last - first >= count))) return false;
  for (const Knot& k : u.knot) {
    const bool tightening = k.phase == KnotPhase::tightening;
    if (k.phase > KnotPhase::locked || k.hand > 1 || !point_ok(k.target) || k.throws > k.thrown.size() || k.throws == 0 ||
        k.begun + (tightening ? 1 : 0) > k.throws || k.slots > 2 || (k.slots == 0 && (k.begun > 0 || !tightening)))
      return false;
    const auto anchored = [&](uint32_t slot) {
      return std::any_of(a.thread.anchor.begin(), a.thread.anchor.end(), [&](const ThreadAnchor& t) { return t.slot == slot; });
    };
    for (uint32_t i = 0; i < k.slots; ++i)
      if (!anchored(k.slot[i])) return false;
    if (tightening && (!anchored(k.end[0]) || !anchored(k.end[1]))) return false;
    if (k.strand - first >= count) return false;
  }
  for (const SettledStitch& stitch : u.settled) {
    for (const SettledNode& n : stitch.node)
      if (n.particle >= m.tissue) return false;
    for (const SettledNode& n : stitch.knot)
      if (n.particle >= m.tissue) return false;
  }
  for (const ClosurePlan::Pair& p : s.plan.pair)
    if (!point_ok(p.a) || !point_ok(p.b)) return false;
  for (const ClosurePlan::Pull& p : s.plan.pull)
    if (!point_ok(p.point)) return false;
  const size_t pairs = s.plan.pair.size();
  const SeamState& seam = s.technique.seam;
  const bool seams = model.technique.kind == TechniqueKind::connell || model.technique.kind == TechniqueKind::stay;
  if (seams ? seam.row.size() != pairs : !seam.row.empty()) return false;
  if (seam.first_row > seam.row.size()) return false;
  for (uint32_t r = 0; r < seam.row.size(); ++r)
    if (seam.row[r].leader > r || seam.row[r].hold > SeamHold::nothing) return false;
  const LembertState& l = s.technique.lembert;
  if (model.technique.kind == TechniqueKind::lembert ? l.row.size() != pairs : !l.row.empty()) return false;
  if (l.tied > 1 || (l.tied && l.stitch.empty())) return false;
  for (const LembertStitch& stitch : l.stitch)
    if (stitch.row >= pairs) return false;
  for (const LembertRow& row : l.row)
    if (row.one >= l.stitch.size() || row.other >= l.stitch.size()) return false;
  return s.technique.purse_string.checked <= u.point.size();
}

}  // namespace

std::vector<std::byte> save_state(const Model&, const State& state) {
  std::vector<std::byte> out;
  out.reserve(size_t{64} * state.solver.x.size());
  Writer w{out};
  fields(w, const_cast<State&>(state));  // the writer only reads; the list of fields is shared with the reader
  return out;
}

void load_state(const Model& model, State& state, const std::vector<std::byte>& bytes) {
  StatePtr fresh = initial_state(model);
  Reader r{bytes};
  fields(r, *fresh);
  if (r.at != bytes.size() || !fits(model, *fresh, *initial_state(model)))
    throw InputError("saved state", "it does not fit this scene", "use the scene and the version it was saved with");
  state = std::move(*fresh);
}

uint64_t hash_state(const Model& model, const State& state) {
  const std::vector<std::byte> bytes = save_state(model, state);
  return hash_bytes(bytes.data(), bytes.size());
}

bool state_is_sane(const Model& model, const State& state, float limit) {
  auto ok = [limit](Vec3 p) { return is_finite(p) && length2(p) <= limit * limit; };
  for (uint32_t i = 0; i < model.solver.count; ++i)
    if (!ok(xyz(state.solver.x[i])) || !is_finite(xyz(state.solver.v[i]))) return false;
  for (const RigidBody& b : state.solver.body)
    if (!is_finite(b.x) || !is_finite(b.v) || !std::isfinite(b.q.w + b.q.x + b.q.y + b.q.z)) return false;
  return true;
}

double kinetic_energy(const Model& model, const State& state) {
  double e = 0;
  for (uint32_t i = 0; i < model.solver.count; ++i)
    if (model.solver.inv_mass[i] > 0) e += 0.5 * double{length2(xyz(state.solver.v[i]))} / model.solver.inv_mass[i];
  return e;
}

}  // namespace catgut
