// SPDX-License-Identifier: Apache-2.0
// sim/save_state: serializes the state, restores it, and hashes it. The reflect functions list the fields of each type; this
// file has the archives over them and the validity checks of a loaded state.
#include <algorithm>
#include <cmath>

#include "core/archive.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

// Validates that every index is in range and every enumerator is known: the stages rely on it.
class Validator : public Archive<Validator> {
 public:
  explicit Validator(const SolverModel& m) {
    domain(IndexOf::particle, m.count);
    domain(IndexOf::tissue, m.tissue);
    domain(IndexOf::slot, m.count - m.tissue), first_[static_cast<size_t>(IndexOf::slot)] = m.tissue;
    domain(IndexOf::strand, m.strand.size());
    ClusterRotations rotation;
    rotation.reset(m.shape.clusters);
    domain(IndexOf::cluster, rotation.x.size());
    domain(IndexOf::body, m.body.size());
    domain(IndexOf::instrument, m.instruments());
    domain(IndexOf::triangle, m.collision.surface.size());
  }
  bool good() const { return good_; }

  template <typename T>
  void operator()(T& v) {
    if constexpr (!kLeaf<T>) visit(*this, v);
  }
  template <typename T, typename Alloc>
  void operator()(const std::vector<T, Alloc>& v) {
    if constexpr (!kLeaf<T>)
      for (const T& element : v) (*this)(element);
  }
  void index(auto& v, IndexOf of) {  // below `first` it wraps to a large number
    good_ = good_ && static_cast<uint32_t>(v) - first_[static_cast<size_t>(of)] < size_[static_cast<size_t>(of)];
  }
  void index_or_none(auto& v, IndexOf of) {
    if (v != -1) index(v, of);
  }
  void at_most(auto& v, auto last) { good_ = good_ && static_cast<uint64_t>(v) <= static_cast<uint64_t>(last); }
  void column(auto& v, IndexOf of) {
    good_ = good_ && v.size() == size_[static_cast<size_t>(of)];
    (*this)(v);
  }
  void permutation(auto& v, IndexOf of) {
    column(v, of);
    std::vector<bool> seen(size_[static_cast<size_t>(of)]);
    for (auto& each : v) {
      index(each, of);
      if (!good_) return;
      const size_t at = each - first_[static_cast<size_t>(of)];
      good_ = !seen[at];
      seen[at] = true;
    }
  }
  void domain(IndexOf of, size_t size) { size_[static_cast<size_t>(of)] = static_cast<uint32_t>(size); }

 private:
  std::array<uint32_t, static_cast<size_t>(IndexOf::count_)> first_{}, size_{};
  bool good_ = true;
};

// A strand has its own particles, each once; thread exists on both sides of a suture point.
bool strand_fits(const StrandModel& model, const Strand& s) {
  const size_t pairs = model.count > 0 ? model.count - 1 : 0;
  if (s.order.size() != model.count || s.rest.size() != pairs || s.cut.size() != pairs || s.tension.size() != pairs)
    return false;
  std::vector<bool> seen(model.count);
  for (const uint32_t slot : s.order) {
    if (!model.has(slot) || seen[slot - model.first_slot]) return false;
    seen[slot - model.first_slot] = true;
  }
  return std::all_of(s.hold.begin(), s.hold.end(), [&](const ThreadHold& h) { return model.has(h.slot); }) &&
         std::all_of(s.anchor.begin(), s.anchor.end(), [&](const ThreadAnchor& a) {
           return model.has(a.slot) && a.slot != s.order.front() && a.slot != s.order.back();
         });
}

bool knot_fits(const Strand& strand, const Knot& k) {
  const bool tightening = k.phase == KnotPhase::tightening;
  if (k.throws == 0 || k.begun + (tightening ? 1 : 0) > k.throws || (k.slots == 0 && (k.begun > 0 || !tightening)))
    return false;
  for (uint32_t i = 0; i < k.slots; ++i)
    if (!is_anchored(strand, k.slot[i])) return false;
  return !tightening || (is_anchored(strand, k.end[0]) && is_anchored(strand, k.end[1]));
}

// Suture `which`, and the hands and loops that refer to it.
bool suture_fits(const SolverModel& model, const SolverState& solver, const SutureState& state, size_t which) {
  const Suture& u = state.suture[which];
  const Strand& strand = solver.strand[which];
  if (!strand_fits(model.strand[which], strand)) return false;
  const int needle = static_cast<int>(model.needle_body(which));
  const bool tip_attached =
      std::any_of(solver.attach.begin(), solver.attach.end(), [&](const Attachment& t) { return t.body == needle; });
  if (u.attached && (!tip_attached || phase_of(u) != NeedlePhase::tip_in)) return false;
  for (const OpenBite& open : u.open)
    if (open.phase == NeedlePhase::outside || (open.phase == NeedlePhase::back_in && u.point.empty())) return false;
  for (const SuturePoint& p : u.point)
    if (p.anchor >= strand.anchor.size()) return false;
  const auto has = [&](uint32_t slot) { return model.strand[which].has(slot); };
  for (const InstrumentState& h : state.instrument)
    if (h.suture == which && h.held == Held::thread && !has(h.slot)) return false;
  for (const ToolLoop& l : state.loop)
    if (l.suture == which && l.wraps > 0 && (!has(l.first) || !has(l.last))) return false;
  return std::all_of(u.knot.begin(), u.knot.end(), [&](const Knot& k) { return knot_fits(strand, k) && has(k.strand); });
}

// The first welds hold the instruments; a hand and its instrument refer to each other.
bool hands_fit(uint32_t instruments, const State& s) {
  if (s.solver.weld.size() < instruments) return false;
  for (uint32_t i = 0; i < instruments; ++i) {
    const Weld& w = s.solver.weld[i];
    if (w.a != static_cast<int>(i) || w.b != -1) return false;
    const InstrumentState& tool = s.suture.instrument[i];
    const bool in_hand = tool.place == InstrumentPlace::hand;
    if (in_hand ? tool.hand >= kMaxHands || s.hand[tool.hand].instrument != w.a : tool.hand != kNoHand) return false;
  }
  for (size_t k = 0; k < kMaxHands; ++k)
    if (const int i = s.hand[k].instrument; i >= 0 && s.suture.instrument[static_cast<size_t>(i)].hand != k) return false;
  return true;
}

bool fits(const Model& model, const State& s) {
  if (model.physical && !physical_fits(model, s.physical)) return false;
  Validator indices(model.solver);
  indices(s);
  if (!indices.good() || !hands_fit(model.solver.instruments(), s)) return false;
  for (size_t k = 0; k < s.solver.strand.size(); ++k)
    if (!suture_fits(model.solver, s.solver, s.suture, k) ||
        (model.physical && s.physical.suture[k].hole.size() != s.suture.suture[k].point.size()) ||
        !technique_fits(model.technique, s.technique[k], s.plan[k].pair.size(), s.suture.suture[k].point.size()))
      return false;
  return true;
}

}  // namespace

std::vector<std::byte> save_state(const Model&, const State& state) {
  std::vector<std::byte> out;
  out.reserve(size_t{80} * state.solver.x.size());
  ByteSink sink{out};
  Writer write(sink);
  write(state);
  return out;
}

void load_state(const Model& model, State& state, const std::vector<std::byte>& bytes) {
  StatePtr fresh = initial_state(model);
  Reader read(bytes, "saved state");
  read(*fresh);
  if (const std::string error = topology_error(model, fresh->topology); !error.empty())
    throw InputError("saved state", "its topology does not fit this scene: " + error,
                     "use the scene and the version it was saved with");
  if (fresh->topology.version > 0) apply_topology(model, *fresh);
  if (model.physical) restore_physical(model, fresh->physical);
  if (read.at != bytes.size() || !fits(current_model(model, *fresh), *fresh))
    throw InputError("saved state", "it does not fit this scene", "use the scene and the version it was saved with");
  if (model.physical) renew_cut_picture(model, *fresh);
  state = std::move(*fresh);
}

uint64_t hash_state(const Model&, const State& state) {
  Hasher hasher;
  Writer hash(hasher);
  hash(state);
  return hasher.digest();
}

bool state_is_valid(const Model& built, const State& state, float limit) {
  const Model& model = current_model(built, state);
  auto ok = [limit](Vec3 p) { return is_finite(p) && length2(p) <= limit * limit; };
  for (uint32_t i = 0; i < model.solver.count; ++i)
    if (!ok(xyz(state.solver.x[i])) || !is_finite(xyz(state.solver.v[i]))) return false;
  for (const RigidBody& b : state.solver.body)
    if (!is_finite(b.x) || !is_finite(b.v) || !std::isfinite(b.q.w + b.q.x + b.q.y + b.q.z)) return false;
  return true;
}

uint32_t dropped_contacts(const State& state) {
  return state.physical.world.thread.overflow + state.physical.world.bodies.overflow;
}

double kinetic_energy(const Model& built, const State& state) {
  const Model& model = current_model(built, state);
  double e = 0;
  for (uint32_t i = 0; i < model.solver.count; ++i)
    if (model.solver.inv_mass[i] > 0) e += 0.5 * double{length2(xyz(state.solver.v[i]))} / model.solver.inv_mass[i];
  return e;
}

}  // namespace catgut
