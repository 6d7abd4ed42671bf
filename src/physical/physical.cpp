// SPDX-License-Identifier: Apache-2.0
// physical: see the header. The order of a step is that of docs/physical.md.
#include "physical/physical.h"

#include <algorithm>

#include "core/archive.h"
#include "core/hash.h"
#include "physical/lacing.h"
#include "physical/landing.h"
#include "physical/reflect.h"

namespace catgut::physical {

Model make_model(const wall::Wall& wall, const thread::Settings& settings) {
  Model m;
  m.wall = wall.model, m.thread = settings;
  m.surface = make_surface(wall.model, wall.state);
  m.tear = make_tear(wall.model.layer);
  return m;
}

float mouth_offset(const Model& m, const Hole& hole) {
  const float half = 0.5f * m.wall.laminate.thickness, r = 0.5f * m.thread.material.diameter;
  const float out = hole.place.zeta >= 0.999f ? r : hole.place.zeta <= -0.999f ? -r : 0.0f;
  return hole.place.zeta * half + out;
}

Vec3 mouth(const Model& m, const State& s, const Hole& hole) {
  wall::Point mid = hole.place;
  mid.zeta = 0;
  const wall::Weights w = wall::weights(m.wall, s.wall.topology, mid);
  wall::Weights up = w;
  up.zeta = 1;
  const Vec3 at = wall::place(w, s.wall.motion);
  return at + normalized(wall::place(up, s.wall.motion) - at) * mouth_offset(m, hole);
}

Scratch::Scratch(const Model& m, const State& s) : wall(wall::make_scratch(m.wall, s.wall)), thread(s.thread.nodes()) {
  const uint32_t rows = wall::columns(s.wall) + wall::columns(s.wall) / 3 + 64;  // with those of later cuts
  coupling.inverse = wall::Inverse(rows);
  lips.inverse = wall::Inverse(rows);
  for (wall::Inverse* inverse : {&coupling.inverse, &lips.inverse}) inverse->need(s.wall.topology, {});  // takes its room
  const size_t n = thread::kMaxSoftPoints, columns = wall::columns(s.wall);
  contact.reserve(2 * n), foot.reserve(2 * n), moved.reserve(n), put.reserve(s.thread.nodes()),
      put_segment.reserve(s.thread.nodes()), tilt.reserve(16 * n);
  coupling.reserve(n);
  lips.reserve(3 * columns);
  search.reserve(m.wall, s.wall, s.thread.nodes());
  bodies.reserve(m.wall, s.wall);
  holds.reserve(256), marks.reserve(1024);
  awake.reserve(s);
  point.reserve(thread::kMaxSoftPoints), offset.reserve(thread::kMaxSoftPoints);
}

namespace {

constexpr float kFastestWall = 2;  // [m/s] that thread sees; hands move at 1 m/s
void cut_changed(const Model& m, State& s) {
  s.cut_surface = std::make_shared<const Surface>(make_surface(m.wall, s.wall));
  // Impulses that were remembered for columns that have other numbers now.
  s.lip.clear();
  after_cut(m, s);
  std::erase_if(s.bodies.memory, [](const RowMemory& r) { return r.key >> 60 < 3; });
  for (thread::SoftContact& c : s.contact) c.patch = wall::kNone;
}
}  // namespace

wall::CutResult cut(const Model& m, State& s, Scratch& k, std::span<const wall::Mark> marks) {
  const wall::CutResult result = wall::cut_links(m.wall, s.wall, k.wall, marks);
  // A cut along an edge of a face changes the surface before it divides anything: the same as after a load.
  const auto on_edge = [&](const wall::Mark& mark) {
    return mark.link >= wall::raster(m.wall.mesh.face[mark.face][3] != wall::kNone).inner;
  };
  if (result.divided || std::any_of(marks.begin(), marks.end(), on_edge)) cut_changed(m, s);
  return result;
}

void restore_cuts(const Model& m, State& s) {
  if (s.wall.topology.cut.empty()) {
    if (s.cut_surface) wall::restore(m.wall, s.wall.topology), s.cut_surface.reset();
    return;
  }
  wall::restore(m.wall, s.wall.topology);
  s.cut_surface = std::make_shared<const Surface>(make_surface(m.wall, s.wall));
}

uint64_t hash_state(const State& s) {
  uint64_t h = thread::hash_state(s.thread);
  h = hash_bytes(s.wall.motion.x.data(), s.wall.motion.x.size() * sizeof s.wall.motion.x[0], h);
  h = hash_bytes(s.wall.motion.v.data(), s.wall.motion.v.size() * sizeof s.wall.motion.v[0], h);
  for (const wall::FaceCut& c : s.wall.topology.cut) h = hash_bytes(c.bit.data(), sizeof c.bit, h);
  for (const Hole& o : s.hole) {
    for (const float v : {o.place.xi, o.place.eta, o.torn, o.load.x, o.load.y, o.load.z}) h = hash_bytes(&v, sizeof v, h);
    h = hash_bytes(&o.place.face, sizeof o.place.face, h);
  }
  for (const thread::SoftContact& c : s.contact) h = hash_bytes(&c.normal_impulse, sizeof c.normal_impulse, h);
  for (const wall::Contact& c : s.lip) h = hash_bytes(&c.impulse, sizeof c.impulse, h);
  for (const Sleep::Strand& k : s.sleep.strand) h = hash_bytes(&k.quiet, sizeof k.quiet, h);
  if (!s.bodies.body.empty()) {
    Hasher hasher;
    Writer<Hasher> write(hasher);
    write(s.bodies), write(s.needle);
    const uint64_t more = hasher.digest();
    h = hash_bytes(&more, sizeof more, h);
  }
  return h;
}

namespace {

// The thread's end at a swage, where the needle has made its hole: it follows the needle in. With a contact there it would
// stand before the hole and drag the wall along.
bool before_its_hole(const Model& m, const State& s, uint32_t node) {
  constexpr float kBeside = 1.2e-3f;  // [m] from the middle of the hole
  for (const Needle& n : s.needle) {
    if (n.thread_node != node) continue;
    for (uint32_t c = 0; c < n.channels; ++c) {
      const Vec3 hole = wall::place(wall::weights(m.wall, s.wall.topology, n.channel[c].point[0]), s.wall.motion);
      if (n.channel[c].entry_hole == wall::kNone && distance(hole, s.thread.position(node)) < kBeside) return true;
    }
  }
  return false;
}

constexpr float kSame = 1e-6f;       // [m] two places are one
constexpr float kCloseBy = 0.6e-3f;  // [m] beyond what can touch within a step: then a node's close faces are listed again

// [m] by which a node and the wall may have come nearer since its close faces were listed.
float way_since(const SurfaceSearch& k, uint32_t node, Vec3 p) {
  return static_cast<float>(k.moved - k.close[node].moved) + distance(p, k.close[node].node);
}
// All faces near a node that may be nearer to it than `reach` [m]; more, where the close ones are not known.
std::span<const uint32_t> faces_of(const SurfaceSearch& k, uint32_t node, Vec3 p, float reach) {
  if (k.close[node].within - way_since(k, node, p) >= reach) return {&k.close_face[kClose * node], k.close[node].count};
  return std::span(k.node_face).subspan(k.node_first[node], k.node_first[node + 1] - k.node_first[node]);
}

// Nodes near the surface: each gets the nearest point of the wall, on the side where it was. Neighbors share a point of the
// coupling, because every point answers every other.
void find_contacts(const Model& m, const State& s, Scratch& k, uint32_t& dropped) {
  const Surface& surface = surface_of(m, s);
  const float d = m.thread.material.diameter, r = 0.5f * d, h = m.wall.step;
  const float far_move = m.thread.max_move * d * static_cast<float>(m.thread.substeps);
  size_t eyelet = 0, old = 0;
  // Contacts that share a point: the first of them, how many, the node of the last one.
  size_t group = 0, shared = 0;
  uint32_t last_node = 0;
  constexpr float kApart = 0.01e-3f;  // [m]
  k.foot.clear();
  const auto add = [&](uint32_t node, const Foot& foot, const thread::SoftContact* memory, bool may_share) {
    thread::SoftContact c;
    c.node = node, c.patch = foot.patch, c.normal = foot.normal, c.friction = m.surface_friction;
    if (memory) {
      c.normal_impulse = memory->normal_impulse;
      c.friction_impulse = memory->friction_impulse, c.drift = memory->drift;
    }
    // A contact that presses has a point of its own: its friction elsewhere would turn the wall without turning the thread.
    const bool touches = c.normal_impulse > 0 || foot.gap - r < kApart;
    if (may_share && !touches && shared > 0 && shared < 3 && last_node + 1 == node && !s.thread.broken[last_node] &&
        dot(k.contact[group].normal, c.normal) > 0.95f) {
      c.point = k.contact[group].point;
      ++shared;
    } else {
      if (k.point.size() >= thread::kMaxSoftPoints) {
        ++dropped;
        return;
      }
      wall::Weights up = wall::weights(m.wall, s.wall.topology, foot.point), middle = up;
      up.zeta = 1, middle.zeta = 0;
      const float half = distance(wall::place(up, s.wall.motion), wall::place(middle, s.wall.motion));
      c.point = static_cast<uint32_t>(k.point.size());
      // One that does not press yet has no lever: most of the points are such.
      const bool presses = c.normal_impulse > 0;
      k.point.push_back(foot.point), k.offset.push_back(presses ? foot.point.zeta * half : 0);
      if (!presses) k.point.back().zeta = 0;
      if (may_share) group = k.contact.size(), shared = 1;
    }
    if (may_share) last_node = node;
    k.contact.push_back(c), k.foot.push_back(foot);
  };
  const bool asleep = s.sleep.any();
  for (uint32_t i = 0; i < s.thread.nodes(); ++i) {
    if (asleep && s.sleep.at(i)) continue;
    while (eyelet < s.thread.eyelet.size() && s.thread.eyelet[eyelet].segment < i) ++eyelet;
    // Between the mouths of a channel; also where the end of the thread has already left the first of them, or the last.
    const uint32_t behind = eyelet < s.thread.eyelet.size() ? s.thread.eyelet[eyelet].point : 0;
    if ((eyelet > 0 && s.hole[s.thread.eyelet[eyelet - 1].point].within) || (behind > 0 && s.hole[behind - 1].within)) continue;
    // Beside a hole its mouth keeps the thread off the wall. A contact there would stop the node like a bead before the hole.
    if ((eyelet > 0 && s.thread.eyelet[eyelet - 1].segment + 1 == i) ||
        (eyelet < s.thread.eyelet.size() && s.thread.eyelet[eyelet].segment == i))
      continue;
    if (k.search.node_first[i] == k.search.node_first[i + 1]) continue;
    while (old < s.contact.size() && s.contact[old].node < i) ++old;
    const thread::SoftContact* memory = nullptr;  // the one that presses most
    for (size_t q = old; q < s.contact.size() && s.contact[q].node == i; ++q)
      if (!memory || s.contact[q].normal_impulse > memory->normal_impulse) memory = &s.contact[q];
    const Vec3 p = s.thread.position(i);
    if (!memory && k.search.moved + static_cast<double>(distance(p, k.search.node_seen[i]) + 1.5f * h * k.search.speed) <
                       k.search.node_due[i])
      continue;
    NearestFoot nearest;
    Foot& best = nearest.best;
    float nearest_box = 1e9f;
    const auto look = [&](uint32_t patch) {
      if (least_of_part(surface, k.search, patch, p) > std::abs(best.gap) + 1e-6f) return;
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, patch, p, corners_in(k.search, patch));
      // A node that was pressed to one side is never looked at from the other.
      if (memory && memory->normal_impulse > 0 && dot(foot.facing, memory->normal) < -0.2f) return;
      nearest.offer(foot, p);
    };
    const uint32_t known = memory && memory->patch < surface.patch.size() ? memory->patch : wall::kNone;
    if (known != wall::kNone) look(known);  // most likely still the nearest: the others need not be searched
    // A node with a memory may be deep inside; another one counts only where it can touch within the step.
    const float fastest = memory ? 2 * k.search.margin : r + far_move + 1.5f * h * k.search.speed;
    const std::span<const uint32_t> faces =
        faces_of(k.search, i, p, std::max(r + far_move, std::min(fastest, std::abs(best.gap) + 1e-6f)));
    SurfaceSearch::Close& close = k.search.close[i];
    const bool all = faces.size() == k.search.node_first[i + 1] - k.search.node_first[i];
    if (all) close = {p, k.search.moved, r + far_move + kCloseBy, 0};
    else nearest_box = close.within - way_since(k.search, i, p);
    k.search.far.resize(faces.size());
    for (size_t f = 0; f < faces.size(); ++f) {
      const uint32_t face = faces[f];
      const FaceBox& box = box_of(m.wall, s.wall, k.search, face);
      const float reach = memory ? 2 * k.search.margin : r + far_move + 1.5f * h * box.speed;
      const float far = k.search.far[f] = least_distance(box, p, 0);
      nearest_box = std::min(nearest_box, far);
      if (all && far < close.within) {
        if (close.count < kClose) k.search.close_face[kClose * i + close.count] = face;
        ++close.count;
      }
      if (far > std::min(reach, std::abs(best.gap) + 1e-6f)) continue;
      for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q)
        if (q != known &&
            least_distance(m.wall, s.wall, surface, k.search, box, q, p) <= std::min(reach, std::abs(best.gap) + 1e-6f))
          look(q);
    }
    if (all && close.count > kClose) close.within = 0;
    nearest.settle_side(m.wall, s.wall, surface, p);
    constexpr float kSpare = 0.2e-3f;  // [m]
    k.search.node_seen[i] = p;
    k.search.node_due[i] = k.search.moved + static_cast<double>(nearest_box - r - far_move - kSpare);
    const wall::Weights w = best.gap < 1e8f ? wall::weights(m.wall, s.wall.topology, best.point) : wall::Weights{};
    if (best.gap > 1e8f || (!memory && best.gap < -d)) continue;  // a node deep inside was never outside
    const float closing = dot(wall::velocity(w, s.wall.motion), best.normal);
    if (before_its_hole(m, s, i)) continue;
    // A node can reach its limit of speed within a substep.
    if (best.gap - r > far_move + 1.5f * h * std::max(0.0f, closing)) continue;
    const auto memory_of = [&](Vec3 normal) -> const thread::SoftContact* {
      const thread::SoftContact* found = nullptr;
      float most = 0.5f;
      for (size_t q = old; q < s.contact.size() && s.contact[q].node == i; ++q)
        if (const float like = dot(s.contact[q].normal, normal); like > most) most = like, found = &s.contact[q];
      return found;
    };
    add(i, best, memory_of(best.normal), true);
    // In a fold the node may touch a second face, in front of which it is, with another normal; in a pit more of them.
    std::array<Foot, 3> more;
    for (Foot* other = more.begin(); other < more.end(); ++other) {
      other->gap = r + far_move;
      const auto like = [&](Vec3 normal) {
        return dot(normal, best.normal) >= 0.95f ||
               std::any_of(more.begin(), other, [&](const Foot& foot) { return dot(normal, foot.normal) >= 0.95f; });
      };
      for (size_t f = 0; f < faces.size(); ++f) {
        if (k.search.far[f] > other->gap) continue;
        const uint32_t face = faces[f];
        const FaceBox& box = box_of(m.wall, s.wall, k.search, face);
        for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
          const int side = surface.patch[q].side;
          const float useful = memory ? std::max(other->gap, d) : other->gap;  // in front of a face, or behind it in a fold
          if (q == best.patch || (side != 0 && dot(box.n, best.normal) * static_cast<float>(side) > 0.97f) ||
              least_distance(m.wall, s.wall, surface, k.search, box, q, p) > other->gap ||
              least_of_part(surface, k.search, q, p) > useful + 1e-6f)
            continue;
          const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, p, corners_in(k.search, q));
          // A little behind it, too, where the two faces make a fold: each lies before the other, or they meet at the foot.
          const Vec3 between = foot.at - best.at;
          // Not where they meet in a sharp edge and the node lies beyond that.
          const bool sharp = best.on_edge && best.gap > 0 && dot(foot.inward, best.facing) < 0;
          const bool meet = length2(between) < kSame * kSame && !sharp;
          const bool fold = foot.gap <= 0 && foot.gap > -d && memory && dot(between, best.facing) > -kSame &&
                            dot(between, foot.facing) < kSame && (!foot.on_edge || meet);
          // A sharp edge of the other side of a fold, to which the node was pressed.
          const bool sharp_edge = foot.gap > 0 && foot.on_edge && dot(foot.facing, best.facing) < 0.3f &&
                                  dot(between, best.facing) > kSame && dot(between, foot.normal) < -kSame;
          const thread::SoftContact* before = sharp_edge ? memory_of(foot.normal) : nullptr;
          const bool edge = before && before->normal_impulse > 0;
          if (((foot.gap > 0 && !foot.on_edge) || fold || edge) && foot.gap < other->gap &&
              !like(edge ? foot.normal : foot.facing))
            *other = foot;
        }
      }
      if (other->gap >= r + far_move) break;
      add(i, *other, memory_of(other->normal), false);
    }
  }
}

constexpr float kOwnThread = 3e-3f;  // [m] of thread at a swage that has no contact with it

// A thread node that has slid along the wall within the step gets the plane where it is now.
struct SlidNodes {
  const Model& m;
  const State& s;
  Scratch& k;
  bool some_asleep;
};
void find_again(void* context, std::span<thread::SoftContact> contacts, size_t index, Vec3 node) {
  const SlidNodes& slid = *static_cast<const SlidNodes*>(context);
  const Surface& surface = surface_of(slid.m, slid.s);
  SurfaceSearch& search = slid.k.search;
  thread::SoftContact& c = contacts[index];
  const auto other_has = [&](uint32_t patch) {
    const auto has = [&](size_t i) { return contacts[i].node == c.node && contacts[i].patch == patch; };
    for (size_t i = index; i-- > 0 && contacts[i].node == c.node;)
      if (has(i)) return true;
    for (size_t i = index + 1; i < contacts.size() && contacts[i].node == c.node; ++i)
      if (has(i)) return true;
    return false;
  };
  constexpr float kInFront = 0.7f;  // cosine: in a pit, but not round a sharp edge there
  NearestFoot nearest;
  nearest.offer(nearest_on_patch(slid.m.wall, slid.s.wall, surface, c.patch, node), node);
  const Foot& best = nearest.best;
  bool in_pit = false;
  if (best.on_edge) {
    // Beyond the patch: another one that continues it.
    const Foot edge = best;
    const uint32_t i = slid.some_asleep ? slid.k.awake.node[c.node] : c.node;
    for (uint32_t f = search.node_first[i]; f < search.node_first[i + 1]; ++f) {
      const uint32_t face = search.node_face[f];
      const FaceBox& box = box_of(slid.m.wall, slid.s.wall, search, face);
      if (least_distance(box, node, 0) > std::abs(best.gap) + 1e-6f) continue;
      for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
        if (q == c.patch ||
            least_distance(slid.m.wall, slid.s.wall, surface, search, box, q, node) > std::abs(best.gap) + 1e-6f)
          continue;
        const Foot foot = nearest_on_patch(slid.m.wall, slid.s.wall, surface, q, node);
        if (c.normal_impulse > 0 && dot(foot.facing, c.normal) < 0.3f) continue;
        // In a pit the node touches several faces. If two contacts took the same one, it would pass the others.
        if (dot(foot.at - edge.at, edge.facing) > kSame && other_has(q)) {
          in_pit = true;
          continue;
        }
        // At the bottom of a pit, behind the faces that meet there, each contact keeps its own.
        if (edge.gap < 0 && foot.gap < 0 && length2(foot.at - edge.at) < kSame * kSame && other_has(q)) continue;
        nearest.offer(foot, node);
      }
    }
    nearest.settle_side(slid.m.wall, slid.s.wall, surface, node);
  }
  c.offset = best.at - slid.k.coupling.at[c.point], c.normal = in_pit && nearest.front > kInFront ? best.facing : best.normal;
  c.patch = best.patch;
}

void begin_bodies(const Model& m, State& s, Scratch& k, const Hands& hands) {
  const Surface& surface = surface_of(m, s);
  const float h = m.wall.step;
  s.bodies.memory.reserve(kMaxRows), s.hole.reserve(thread::kMaxEyelets);
  feel_thread(m.bodies, s.bodies, s.thread, hands.plane, m.thread.substep, h, k.bodies);
  predict_bodies(m.bodies, s.bodies, hands.targets, h, k.bodies);
  open_gently(m.bodies, s.bodies, s.thread, m.thread.material.diameter, h, k.bodies);
  skip_channels(m.needles, m.wall, s.wall, s.needle, s.bodies);
  find_pair_contacts(m.bodies, s.bodies, h, k.bodies);
  if (hands.plane) find_drape_contacts(m.bodies, s.bodies, *hands.plane, h, k.bodies);
  find_body_contacts(m.bodies, m.wall, s.wall, surface, s.bodies, h, k.search, k.bodies);
  find_grips(m.bodies, m.wall, s.wall, surface, s.thread, m.thread.material.diameter, s.bodies, hands.targets, h, k.bodies);
  find_needle_rows(m.needles, m.bodies, m.wall, s.wall, surface, s.thread, s.bodies, s.needle, h, k.bodies);
  warm_bodies(m.bodies, s.bodies, hands.targets, k.wall, h, k.bodies);
}

void end_bodies(const Model& m, State& s, Scratch& k) {
  const Surface& surface = surface_of(m, s);
  settle_grips(m.bodies, m.wall, s.wall, s.thread, s.bodies, k.bodies);
  advance_needles(m.needles, m.wall, s.wall, surface, s.bodies, s.needle, m.wall.step, k.bodies);
  if (m.tear.on) tear_channels(m, s, k.bodies);
  lace_threads(m, s);
}

// The thread in its holes and on the surface, on points that travel with the wall.
void step_thread(const Model& m, State& s, Scratch& k, const Hands& hands) {
  AwakeThread& awake = k.awake;
  const bool some_asleep = s.sleep.any();
  if (some_asleep) gather(s, awake);
  thread::State& t = some_asleep ? awake.part : s.thread;
  // Points of the holes; those of sleeping strands need none.
  awake.point_of.assign(s.hole.size(), wall::kNone);
  for (const thread::Eyelet& e : t.eyelet) awake.point_of[e.point] = 0;
  for (uint32_t i = 0; i < s.hole.size(); ++i) {
    if (some_asleep && awake.point_of[i] == wall::kNone) continue;
    awake.point_of[i] = static_cast<uint32_t>(k.point.size());
    k.point.push_back(s.hole[i].place), k.offset.push_back(mouth_offset(m, s.hole[i]));
  }
  const size_t holes = k.point.size();
  for (thread::Eyelet& e : t.eyelet) e.point = awake.point_of[e.point];
  if (m.surface_contact) find_contacts(m, s, k, t.overflow);
  k.coupling.set_points(m.wall, s.wall.topology, k.point, k.offset);
  k.coupling.begin(m.wall, s.wall);
  for (size_t i = 0; i < k.contact.size(); ++i) k.contact[i].offset = k.foot[i].at - k.coupling.at[k.contact[i].point];
  k.tilt.clear();
  for (const wall::Coupling::Tilt& tilt : k.coupling.tilt) k.tilt.push_back({tilt.other, tilt.value});
  // Before the bodies are solved, the wall may move as only their impulses of the last step would make it: jaws that let a fold
  // slip have one side of a squeeze left, and 20 m/s. Thread that is carried along so fast breaks at once.
  for (Vec3& v : k.coupling.speed)
    if (length2(v) > kFastestWall * kFastestWall) v = normalized(v) * kFastestWall;
  thread::SoftPoints soft;
  soft.step = m.wall.step;
  soft.at = k.coupling.at, soft.speed = k.coupling.speed, soft.axis = k.coupling.axis, soft.w = k.coupling.w;
  soft.tilt_first = k.coupling.tilt_first, soft.tilt = k.tilt, soft.impulse = k.coupling.impulse;
  k.moved.resize(k.point.size());
  soft.moved = k.moved;
  // A needle's swage has no contact with the thread that begins in it.
  for (size_t i = 0; i < k.bodies.tool.size(); ++i)
    for (uint32_t n = 0; n < s.needle.size(); ++n) {
      const bool swage =
          k.bodies.tool_body[i] == m.needles.needle[n].body && (i == 0 || k.bodies.tool_body[i - 1] != k.bodies.tool_body[i]);
      const uint32_t node = s.needle[n].thread_node;
      if (!swage || node == wall::kNone || node == 0) continue;
      const uint32_t last = (some_asleep ? awake.part_node[node] : node);
      if (last == wall::kNone || last == 0) continue;
      thread::ToolCapsule& tool = k.bodies.tool[i];
      tool.own_last = last - 1;
      float length = t.rest[last - 1];
      for (tool.own_first = last - 1; tool.own_first > 0 && length < kOwnThread; --tool.own_first)
        length += t.rest[tool.own_first - 1];
    }
  thread::Surroundings around;
  around.plane = hands.plane;
  around.tools = k.bodies.tool, around.bodies = k.bodies.loose, around.soft = &soft, around.soft_contacts = k.contact;
  around.holds = k.holds, around.pulls = hands.pulls;
  SlidNodes slid{m, s, k, some_asleep};
  around.soft_surface = {&slid, find_again};
  if (some_asleep) {
    show_awake(k.holds, hands.pulls, k.contact, awake);
    around.holds = awake.hold, around.pulls = awake.pull;
  }
  k.thread.step(m.thread, t, around);
  // Back to the numbers of the whole thread.
  awake.hole_of.assign(holes, 0);
  for (uint32_t i = 0; i < s.hole.size(); ++i)
    if (awake.point_of[i] != wall::kNone) awake.hole_of[awake.point_of[i]] = i;
  for (thread::Eyelet& e : t.eyelet) e.point = awake.hole_of[e.point];
  if (some_asleep) {
    scatter(s, awake);
    for (thread::SoftContact& c : k.contact) c.node = awake.node[c.node];
    for (size_t i = 0; i < awake.hold.size(); ++i) k.holds[awake.hold_of[i]].force = awake.hold[i].force;
  }
  if (some_asleep) hold_asleep(s.sleep, k.holds, k.bodies.tool);
  const bool quiet = find_quiet(m, s, hands, k.holds, k.bodies.tool, awake);
  k.coupling.end(s.wall, k.wall);
  note_loads(m, s, k.coupling, k.wall, awake, k.contact);
  if (quiet) fall_asleep(m, s, awake, k.holds, k.bodies.tool);
  if (m.tear.on && m.surface_contact) {
    awake.impulse.assign(s.hole.size(), {});
    for (size_t i = 0; i < holes; ++i) awake.impulse[awake.hole_of[i]] = k.coupling.impulse[i];
    tear_bites(m, s, awake.impulse, k.search);
  }
  // Contacts of sleeping strands stay as they are.
  awake.contact.clear();
  size_t old = 0;
  const auto keep_until = [&](uint32_t node) {
    for (; old < s.contact.size() && s.contact[old].node < node; ++old)
      if (some_asleep && awake.part_node[s.contact[old].node] == wall::kNone) awake.contact.push_back(s.contact[old]);
  };
  for (const thread::SoftContact& c : k.contact) keep_until(c.node), awake.contact.push_back(c);
  keep_until(wall::kNone);
  s.contact.assign(awake.contact.begin(), awake.contact.end());
}

}  // namespace

void step(const Model& m, State& s, Scratch& k, const Hands& hands, Jobs& jobs) {
  const Surface& surface = surface_of(m, s);
  s.contact.reserve(2 * thread::kMaxSoftPoints), s.lip.reserve(3 * wall::columns(s.wall));
  reserve(s, s.sleep);
  for (const Hands::WallPull& pull : hands.wall_pulls) wall::add_to(k.wall.external, pull.at, pull.force);
  watch_wall(s.wall, k.search);
  if (m.surface_contact || m.lip_contact) find_near(m.wall, s.wall, surface, s.thread, k.search);
  if (m.lip_contact) {
    k.lips.contact.assign(s.lip.begin(), s.lip.end());
    wall::find_contacts(m.wall, s.wall, {}, k.lips);
    find_lips(m.wall, s.wall, surface, k.search, m.lip_friction, k.lips);
    wall::warm_start(m.wall, k.wall, k.lips);
  }
  const bool bodies = !s.bodies.body.empty();
  if (bodies) begin_bodies(m, s, k, hands);
  wall::begin_step(m.wall, s.wall, k.wall, jobs);

  k.point.clear(), k.offset.clear(), k.contact.clear();
  k.holds.assign(hands.holds.begin(), hands.holds.end());
  if (bodies) {
    show_bodies(m.bodies, s.bodies, hands.plane, m.wall.step, k.bodies);
    k.holds.insert(k.holds.end(), k.bodies.hold.begin(), k.bodies.hold.end());
  }
  wake_strands(m, s, hands, k.holds, k.bodies.tool, k.search.moved, k.awake);
  press_asleep(s.sleep, k.awake, s.wall, k.wall);
  if (s.sleep.all()) hold_asleep(s.sleep, k.holds, k.bodies.tool);
  else step_thread(m, s, k, hands);
  for (size_t i = 0; i < k.holds.size(); ++i)
    (i < hands.holds.size() ? hands.holds[i] : k.bodies.hold[i - hands.holds.size()]).force = k.holds[i].force;
  if (bodies) take_thread_forces(m.bodies, s.bodies, k.bodies);

  if (m.lip_contact) {
    wall::solve_contacts(m.wall, s.wall, k.wall, {}, k.lips);
    s.lip.assign(k.lips.contact.begin(), k.lips.contact.end());
  }
  if (bodies) solve_bodies(m.bodies, m.wall, s.wall, k.wall, s.bodies, hands.targets, k.bodies);
  wall::keep_volumes(m.wall, s.wall, k.wall);
  wall::finish_step(m.wall, s.wall, jobs);
  if (bodies) {
    put_tools_out(m, s, k);
    end_bodies(m, s, k);
  }
  put_thread_out(m, s, k, hands);
  // Lips and bodies have moved the wall after the thread saw it move. To a node on it, that is drift: its friction returns it.
  size_t at = 0;
  for (const thread::SoftContact& c : k.contact) {
    while (s.contact[at].node < c.node) ++at;
    const Vec3 beside = k.coupling.now(c.point, s.wall) - (k.coupling.at[c.point] + k.moved[c.point]);
    if (c.normal_impulse > 0) s.contact[at].drift -= beside - c.normal * dot(beside, c.normal);
    ++at;
  }
  k.landing = 0;
  for (size_t i = 0; i < k.point.size(); ++i)
    k.landing = std::max(k.landing, distance(k.coupling.now(i, s.wall), k.coupling.at[i] + k.moved[i]));
}

}  // namespace catgut::physical
