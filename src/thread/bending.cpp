// SPDX-License-Identifier: Apache-2.0
// thread/bending: elastic bending of a stated stiffness B, as a force evaluated at the start of the substep. Energy of node i:
// B / (2 l) |e_i / l_i - e_i-1 / l_i-1|^2 with l the mean length of its two segments (Bergou et al.
// 2008, 10.1145/1360612.1360662, without twist, small angles between segments). Reads edges; adds to the forces. Not a
// constraint. A rod at rest is a fixed point of the step for any solver settings, and B is exactly the given value. It requires
// a minimum mass (bending_density).
#include <tuple>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

CATGUT_CLONES void hinges(size_t nodes, float stiffness, const float* __restrict rest, const float* __restrict keep,
                          float* __restrict hinge) {
  for (size_t i = 1; i + 1 < nodes; ++i) hinge[i] = keep[i] * keep[i - 1] * 2 * stiffness / (rest[i] + rest[i - 1]);
}
CATGUT_CLONES void moments(size_t nodes, const float* __restrict hinge, const float* __restrict e,
                           const float* __restrict inverse, float* __restrict moment) {
  for (size_t i = 1; i + 1 < nodes; ++i) {
    const float bend = e[i] * inverse[i] - e[i - 1] * inverse[i - 1];
    moment[i] = hinge[i] * bend;
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
  hinges(state.nodes(), settings.material.bending_stiffness, s.rest.data(), s.keep.data(), s.hinge.data());
}

void add_bending(const State& state, Scratch& s) {
  const size_t nodes = state.nodes();
  const float* inverse = s.inverse_rest.data();
  for (auto [e, moment, f] : {std::tuple{&s.e.x, &s.moment.x, &s.force.x}, std::tuple{&s.e.y, &s.moment.y, &s.force.y},
                              std::tuple{&s.e.z, &s.moment.z, &s.force.z}}) {
    moment->operator[](nodes - 1) = moment->operator[](nodes) = 0;
    moments(nodes, s.hinge.data(), e->data(), inverse, moment->data());
    // The corner in a hole is a hinge: bending spread over the nodes beside it would hold the thread wherever a node lies well.
    for (const Eyelet& eyelet : state.eyelet) moment->operator[](eyelet.segment) = moment->operator[](eyelet.segment + 1) = 0;
    forces(nodes, moment->data(), inverse, f->data());
  }
}

float bending_density(const Settings& settings, float l) {
  // The stiffest wave has frequency^2 = 16 B / (l^3 m); a step is stable below 4 / h^2. 1 / h^2 leaves room for contact.
  const float h = settings.substep;
  return 16 * settings.material.bending_stiffness * h * h / (l * l * l * l);
}

}  // namespace catgut::thread
