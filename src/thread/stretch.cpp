// SPDX-License-Identifier: Apache-2.0
// thread/stretch: solves the stretch of the whole thread at once. One Newton step on all lengths is tridiagonal; solved
// directly, a pull reaches the far end within the substep for any number of segments. Reads positions and motion of a
// substep; writes the motion and the multipliers. XPBD: Macklin et al. 2016, 10.1145/2994258.2994272.
#include <cmath>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

CATGUT_CLONES void edges(size_t segments, const float* __restrict x, const float* __restrict fine, float* __restrict e) {
  for (size_t i = 0; i < segments; ++i) e[i] = (x[i + 1] - x[i]) + (fine[i + 1] - fine[i]);
}

CATGUT_CLONES void directions(size_t segments, const float* __restrict ex, const float* __restrict ey,
                              const float* __restrict ez, const float* __restrict ux, const float* __restrict uy,
                              const float* __restrict uz, float* __restrict nx, float* __restrict ny, float* __restrict nz) {
  for (size_t i = 0; i < segments; ++i) {
    const float dx = ex[i] + (ux[i + 1] - ux[i]), dy = ey[i] + (uy[i + 1] - uy[i]), dz = ez[i] + (uz[i + 1] - uz[i]);
    const float inverse = 1.0f / std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f);
    nx[i] = dx * inverse, ny[i] = dy * inverse, nz[i] = dz * inverse;
  }
}

CATGUT_CLONES void matrix(size_t segments, const float* __restrict nx, const float* __restrict ny, const float* __restrict nz,
                          const float* __restrict w, const float* __restrict keep, const float* __restrict alpha,
                          float* __restrict diag, float* __restrict off) {
  for (size_t i = 0; i < segments; ++i) {
    diag[i] = keep[i] * (w[i] + w[i + 1] + alpha[i]) + (1 - keep[i]);
    off[i] = -keep[i] * keep[i + 1] * w[i + 1] * (nx[i] * nx[i + 1] + ny[i] * ny[i + 1] + nz[i] * nz[i + 1]);
  }
}

CATGUT_CLONES void residuals(size_t segments, const float* __restrict ex, const float* __restrict ey,
                             const float* __restrict ez, const float* __restrict ux, const float* __restrict uy,
                             const float* __restrict uz, const float* __restrict rest, const float* __restrict keep,
                             const float* __restrict alpha, const float* __restrict lambda, float* __restrict residual) {
  for (size_t i = 0; i < segments; ++i) {
    const float dx = ex[i] + (ux[i + 1] - ux[i]), dy = ey[i] + (uy[i + 1] - uy[i]), dz = ez[i] + (uz[i + 1] - uz[i]);
    const float l2 = dx * dx + dy * dy + dz * dz, length = std::sqrt(l2);
    residual[i] = keep[i] * ((rest[i] - length) - alpha[i] * lambda[i]);
  }
}

CATGUT_CLONES void apply(size_t nodes, const float* __restrict nx, const float* __restrict step, const float* __restrict w,
                         float* __restrict ux) {
  for (size_t i = 0; i < nodes; ++i) {
    const float before = nx[static_cast<ptrdiff_t>(i) - 1] * step[static_cast<ptrdiff_t>(i) - 1];
    ux[i] += w[i] * (before - nx[i] * step[i]);
  }
}

CATGUT_CLONES void accumulate(size_t segments, const float* __restrict step, float* __restrict lambda) {
  for (size_t i = 0; i < segments; ++i) lambda[i] += step[i];
}

}  // namespace

void find_edges(const State& state, Scratch& s) {
  const size_t m = state.segments();
  edges(m, state.x.x.data(), state.fine.x.data(), s.e.x.data());
  edges(m, state.x.y.data(), state.fine.y.data(), s.e.y.data());
  edges(m, state.x.z.data(), state.fine.z.data(), s.e.z.data());
}

// L D L^T from both ends toward the middle: two dependency chains instead of one of twice the length.
void factor_tridiagonal(Scratch& s, size_t m) {
  const size_t k = m / 2;
  const float *diag = s.diag.data(), *off = s.off.data();
  float *down = s.down.data(), *up = s.up.data(), *inverse = s.inverse_diag.data();
  inverse[0] = 1 / diag[0];
  inverse[m - 1] = 1 / diag[m - 1];
  for (size_t a = 1, b = m - 2; a < k || b > k; ++a, --b) {
    if (a < k) {
      down[a] = off[a - 1] * inverse[a - 1];
      inverse[a] = 1 / (diag[a] - down[a] * off[a - 1]);
    }
    if (b > k) {
      up[b] = off[b] * inverse[b + 1];
      inverse[b] = 1 / (diag[b] - up[b] * off[b]);
    }
  }
  float middle = diag[k];
  if (k > 0) down[k] = off[k - 1] * inverse[k - 1], middle -= down[k] * off[k - 1];
  if (k + 1 < m) up[k] = off[k] * inverse[k + 1], middle -= up[k] * off[k];
  inverse[k] = 1 / middle;
}

void solve_tridiagonal(const Scratch& s, size_t m, float* y, float* x) {
  const float *down = s.down.data(), *up = s.up.data(), *inverse = s.inverse_diag.data();
  const size_t k = m / 2, upper = m - 1 - k;  // k rows below the middle one, `upper` above; upper is k or k - 1
  float below = y[0], above = y[m - 1];
  const size_t both = upper < k ? upper : k;
  for (size_t a = 1; a < both; ++a) {
    const size_t b = m - 1 - a;
    y[a] = below = y[a] - down[a] * below;
    y[b] = above = y[b] - up[b] * above;
  }
  for (size_t a = both < 1 ? 1 : both; a < k; ++a) y[a] = below = y[a] - down[a] * below;
  float center = y[k];
  if (k > 0) center -= down[k] * below;
  if (upper > 0) center -= up[k] * above;
  x[k] = center * inverse[k];
  float left = x[k], right = x[k];
  for (size_t c = 1; c <= both; ++c) {
    const size_t a = k - c, b = k + c;
    x[a] = left = y[a] * inverse[a] - down[a + 1] * left;
    x[b] = right = y[b] * inverse[b] - up[b - 1] * right;
  }
  for (size_t c = both + 1; c <= k; ++c) x[k - c] = left = y[k - c] * inverse[k - c] - down[k - c + 1] * left;
  x[m] = 0;
}

void prepare_stretch(const Settings&, const State& state, Scratch& s, const SoftPoints* soft) {
  const size_t m = state.segments();
  directions(m, s.e.x.data(), s.e.y.data(), s.e.z.data(), s.u.x.data(), s.u.y.data(), s.u.z.data(), s.n.x.data(), s.n.y.data(),
             s.n.z.data());
  if (!state.eyelet.empty()) find_corners(state, s, *soft);
  matrix(m, s.n.x.data(), s.n.y.data(), s.n.z.data(), s.w.data(), s.keep.data(), s.alpha.data(), s.diag.data(), s.off.data());
  if (state.eyelet.empty()) factor_tridiagonal(s, m);
  else prepare_corners(state, s, *soft);
}

void solve_stretch(const Settings& settings, const State& state, Scratch& s, SoftPoints* soft) {
  const size_t m = state.segments();
  const bool corners = !state.eyelet.empty();
  residuals(m, s.e.x.data(), s.e.y.data(), s.e.z.data(), s.u.x.data(), s.u.y.data(), s.u.z.data(), s.rest.data(), s.keep.data(),
            s.alpha.data(), s.lambda.data(), s.residual.data());
  float* x = s.step.data();
  if (corners) take_corner_residuals(state, s, *soft);
  solve_tridiagonal(s, m, s.residual.data(), x);
  if (corners) solve_corners(state, s);
  accumulate(m, x, s.lambda.data());
  apply(m + 1, s.n.x.data(), x, s.w.data(), s.u.x.data());
  apply(m + 1, s.n.y.data(), x, s.w.data(), s.u.y.data());
  apply(m + 1, s.n.z.data(), x, s.w.data(), s.u.z.data());
  if (corners) apply_corners(state, s, *soft, settings.substep);
}

}  // namespace catgut::thread
