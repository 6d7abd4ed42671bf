// SPDX-License-Identifier: Apache-2.0
// thread/bending: bending of a stated stiffness B, as a force evaluated at the start of the substep. Energy of node i:
// B / (2 l) |e_i / l_i - e_i-1 / l_i-1|^2 with l the mean length of its two segments (Bergou et al.
// 2008, 10.1145/1360612.1360662, without twist, small angles between segments). Reads edges; adds to the forces; writes
// State::kept. Not a constraint. A rod at rest is a fixed point of the step for any solver settings, and B is exactly the given
// value. It requires a minimum mass (bending_density).
//
// A bend sharper than the material's elastic curvature stays: elastic, perfectly plastic, as a fold in a suture does. Only its
// amount is kept, not its direction, so that it turns with the thread without a frame along it.
#include <tuple>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

CATGUT_CLONES void hinges(size_t nodes, float stiffness, float elastic_curvature, const float* __restrict rest,
                          const float* __restrict keep, float* __restrict hinge, float* __restrict yields) {
  for (size_t i = 1; i + 1 < nodes; ++i) {
    const float both = rest[i] + rest[i - 1];
    hinge[i] = keep[i] * keep[i - 1] * 2 * stiffness / both;
    yields[i] = elastic_curvature * both / 2;
  }
}

// Bends, and the part of each that resists: what is kept follows it at a distance of at most `yields`. A bend that is gone
// leaves nothing: twice the bend is the most that is kept, which would bend the thread further on.
CATGUT_CLONES void bends(size_t nodes, const float* __restrict ex, const float* __restrict ey, const float* __restrict ez,
                         const float* __restrict inverse, const float* __restrict hinge, const float* __restrict yields,
                         float* __restrict kept, float* __restrict mx, float* __restrict my, float* __restrict mz) {
  for (size_t i = 1; i + 1 < nodes; ++i) {
    const float x = ex[i] * inverse[i] - ex[i - 1] * inverse[i - 1], y = ey[i] * inverse[i] - ey[i - 1] * inverse[i - 1],
                z = ez[i] * inverse[i] - ez[i - 1] * inverse[i - 1], bend = std::sqrt(x * x + y * y + z * z);
    const float least = bend - yields[i], most = bend + yields[i] < 2 * bend ? bend + yields[i] : 2 * bend;
    const float more = kept[i] > least ? kept[i] : least, now = more < most ? more : most;
    const float resists = hinge[i] * (1 - now / (bend + 1e-20f));
    kept[i] = now;
    mx[i] = resists * x, my[i] = resists * y, mz[i] = resists * z;
  }
}

CATGUT_CLONES void forces(size_t nodes, const float* __restrict moment, const float* __restrict inverse, float* __restrict f) {
  for (size_t k = 0; k < nodes; ++k) {
    const ptrdiff_t i = static_cast<ptrdiff_t>(k);
    f[i] += (moment[i] - moment[i - 1]) * inverse[i - 1] - (moment[i + 1] - moment[i]) * inverse[i];
  }
}

}  // namespace

void begin_bending(const Settings& settings, const State& state, Scratch& s) {
  const Properties& m = settings.material;
  hinges(state.nodes(), m.bending_stiffness, m.elastic_curvature > 0 ? m.elastic_curvature : 1e9f, s.rest.data(), s.keep.data(),
         s.hinge.data(), s.yields.data());
}

void add_bending(State& state, Scratch& s) {
  const size_t nodes = state.nodes();
  const float* inverse = s.inverse_rest.data();
  bends(nodes, s.e.x.data(), s.e.y.data(), s.e.z.data(), inverse, s.hinge.data(), s.yields.data(), state.kept.data(),
        s.moment.x.data(), s.moment.y.data(), s.moment.z.data());
  // The corner in a hole is a hinge: bending spread over the nodes beside it would hold the thread wherever a node lies well.
  // None is kept there: the nodes do not know how sharply the thread turns in the hole.
  for (const Eyelet& eyelet : state.eyelet)
    for (const size_t i : {eyelet.segment, eyelet.segment + 1}) s.moment.set(i, {}), state.kept[i] = 0;
  for (auto [moment, f] :
       {std::tuple{&s.moment.x, &s.force.x}, std::tuple{&s.moment.y, &s.force.y}, std::tuple{&s.moment.z, &s.force.z}}) {
    (*moment)[nodes - 1] = (*moment)[nodes] = 0;
    forces(nodes, moment->data(), inverse, f->data());
  }
}

float bending_density(const Settings& settings, float l) {
  // The stiffest wave has frequency^2 = 16 B / (l^3 m); a step is stable below 4 / h^2. 1 / h^2 leaves room for contact.
  const float h = settings.substep;
  return 16 * settings.material.bending_stiffness * h * h / (l * l * l * l);
}

}  // namespace catgut::thread
