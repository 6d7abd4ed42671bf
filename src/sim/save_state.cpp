// sim/save_state: the whole state as bytes, and its hash. One list of fields serves saving, loading and hashing, so that none
// can forget one.
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
constexpr bool kPlain =
    std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, Vec3> || std::is_same_v<T, Vec4> ||
    std::is_same_v<T, Quat> || std::is_same_v<T, Pose> || std::is_same_v<T, TissuePoint> || std::is_same_v<T, BiteEnd> ||
    std::is_same_v<T, Weld> || std::is_same_v<T, Attachment> || std::is_same_v<T, ChannelPoint> ||
    std::is_same_v<T, RigidBody> || std::is_same_v<T, ThreadHold> || std::is_same_v<T, ClosurePlan::Pull>;
static_assert(sizeof(Weld) % 4 == 0 && sizeof(Weld) == 4 * (2 + 3 * 7 + 2 + 6));
static_assert(sizeof(TissuePoint) == 4 * (1 + 16 + 16));
static_assert(sizeof(Attachment) == sizeof(TissuePoint) + 4 * (1 + 3 + 1 + 3));
static_assert(sizeof(ChannelPoint) == sizeof(TissuePoint) + 4 * (3 + 3 + 1));
static_assert(sizeof(RigidBody) == 4 * (3 + 4 + 3 + 3 + 3 + 4));
static_assert(sizeof(ThreadHold) == 4 * 5 && sizeof(BiteEnd) == sizeof(TissuePoint) + 4 * 4 &&
              sizeof(ClosurePlan::Pull) == sizeof(TissuePoint) + 4 * 6);

template <typename A>
void fields(A& a, ThreadAnchor& t) {
  a(t.slot), a(t.point), a(t.friction), a(t.capstan), a(t.slipping), a(t.blocked_needle), a(t.blocked_free),
      a(t.tension_needle), a(t.tension_free);
}
template <typename A>
void fields(A& a, Bite& b) {
  a(b.entry), a(b.exit), a(b.depth), a(b.has_exit), a(b.complete), a(b.cancelled), a(b.nearest);
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
void fields(A& a, State& s) {
  a(s.tick);
  a(s.solver.x), a(s.solver.v);
  a(s.solver.rotation.x), a(s.solver.rotation.y), a(s.solver.rotation.z), a(s.solver.rotation.w);
  a(s.solver.body);
  a(s.solver.thread.order), a(s.solver.thread.rest), a(s.solver.thread.anchor), a(s.solver.thread.hold),
      a(s.solver.thread.tension);
  a(s.solver.weld), a(s.solver.attach), a(s.solver.channel), a(s.solver.thread_collides), a(s.solver.body_collides);
  a(s.suture.bite), a(s.suture.point), a(s.suture.phase), a(s.suture.current), a(s.suture.tip_inside), a(s.suture.attached);
  a(s.suture.attached_from), a(s.suture.hand[0]), a(s.suture.hand[1]);
  a(s.purse_string.ring_complete), a(s.purse_string.closing), a(s.purse_string.finished), a(s.purse_string.path_start);
  a(s.purse_string.path_end), a(s.purse_string.checked), a(s.purse_string.area_start);
  a(s.plan.pull), a(s.plan.progress), a(s.plan.compliance);
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
    std::memcpy(p, in.data() + at, n);
    at += n;
  }
  template <typename T>
  void operator()(T& v) {
    if constexpr (kPlain<T>) bytes(&v, sizeof v);
    else fields(*this, v);
  }
  template <typename T, typename Alloc>
  void operator()(std::vector<T, Alloc>& v) {
    uint64_t n = 0;
    bytes(&n, sizeof n);
    if (n > in.size()) throw InputError("saved state", "an array has an impossible length", "the file is damaged");
    v.resize(n);
    if constexpr (kPlain<T>) bytes(v.data(), n * sizeof(T));
    else
      for (T& e : v) (*this)(e);
  }
};

// Every index that a stage follows without asking lies within this scene: bytes of another scene or a damaged file must never
// become a crash later.
bool fits(const Model& model, const State& s) {
  const SolverModel& m = model.solver;
  const SolverState& v = s.solver;
  const Thread& t = v.thread;
  const size_t bodies = m.body.size();
  if (v.x.size() != m.count || v.v.size() != m.count || v.body.size() != bodies || v.body_collides.size() != bodies)
    return false;
  ClusterRotations rotation;
  rotation.reset(m.shape.clusters);
  for (const auto* r : {&v.rotation.x, &v.rotation.y, &v.rotation.z, &v.rotation.w})
    if (r->size() != rotation.x.size()) return false;
  if (t.order.size() != m.thread.count || v.thread_collides.size() != m.thread.count) return false;
  const size_t pairs = m.thread.count > 0 ? m.thread.count - 1 : 0;
  if (t.rest.size() != pairs || t.tension.size() != pairs) return false;
  std::vector<uint8_t> found(m.thread.count);
  auto is_slot = [&](uint32_t slot) { return slot >= m.thread.first_slot && slot - m.thread.first_slot < m.thread.count; };
  for (uint32_t slot : t.order)
    if (!is_slot(slot) || found[slot - m.thread.first_slot]++) return false;
  auto is_point = [&](const TissuePoint& p) {
    if (p.count > TissuePoint::kMost) return false;
    for (uint32_t k = 0; k < p.count; ++k)
      if (p.particle[k] >= m.tissue) return false;
    return true;
  };
  auto is_body = [&](int b) { return b >= 0 && static_cast<size_t>(b) < bodies; };
  for (const ThreadAnchor& a : t.anchor)
    if (!is_slot(a.slot) || !is_point(a.point)) return false;
  for (const ThreadHold& h : t.hold)
    if (!is_slot(h.slot) || !is_body(h.body)) return false;
  if (v.weld.size() < 2) return false;  // each tool on its hand
  for (const Weld& w : v.weld)
    if (!is_body(w.a) || (w.b >= 0 && !is_body(w.b))) return false;
  bool tip = false;
  for (const Attachment& a : v.attach) {
    if (!is_point(a.point) || (a.body >= 0 && !is_body(a.body))) return false;
    tip = tip || a.body == static_cast<int>(kNeedle);
  }
  for (const ChannelPoint& c : v.channel)
    if (!is_point(c.point)) return false;
  for (const Bite& b : s.suture.bite)
    if (!is_point(b.entry.point) || !is_point(b.exit.point) || b.nearest >= m.tissue) return false;
  for (const SuturePoint& p : s.suture.point)
    if (p.anchor >= t.anchor.size() || p.bite >= s.suture.bite.size()) return false;
  if (s.suture.phase > NeedlePhase::back_in || (s.suture.attached && !tip)) return false;
  if (s.suture.phase != NeedlePhase::outside && s.suture.current >= s.suture.bite.size()) return false;
  if (s.suture.phase == NeedlePhase::through && v.channel.size() != 2) return false;
  if (s.suture.phase == NeedlePhase::back_in && s.suture.point.empty()) return false;
  for (const HandState& h : s.suture.hand)
    if (h.held > Held::thread) return false;
  for (const ClosurePlan::Pull& p : s.plan.pull)
    if (!is_point(p.point)) return false;
  return true;
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
  if (r.at != bytes.size() || !fits(model, *fresh))
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
