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

// Moves the nodes by the multipliers' steps.
CATGUT_CLONES void apply(size_t nodes, const float* __restrict nx, const float* __restrict ny, const float* __restrict nz,
                         const float* __restrict step, const float* __restrict w, float* __restrict ux, float* __restrict uy,
                         float* __restrict uz) {
  for (size_t k = 0; k < nodes; ++k) {
    const ptrdiff_t i = static_cast<ptrdiff_t>(k);
    ux[i] += w[i] * (nx[i - 1] * step[i - 1] - nx[i] * step[i]);
    uy[i] += w[i] * (ny[i - 1] * step[i - 1] - ny[i] * step[i]);
    uz[i] += w[i] * (nz[i - 1] * step[i - 1] - nz[i] * step[i]);
  }
}

CATGUT_CLONES void accumulate(size_t segments, float most, float* __restrict step, float* __restrict lambda) {
  for (size_t i = 0; i < segments; ++i) {
    const float sum = lambda[i] + step[i], within = std::min(most, std::max(-most, sum));
    step[i] = within == sum ? step[i] : within - lambda[i];
    lambda[i] = within;
  }
}

}  // namespace

void find_edges(const State& state, Scratch& s) {
  const size_t m = state.segments();
  edges(m, state.x.x.data(), state.fine.x.data(), s.e.x.data());
  edges(m, state.x.y.data(), state.fine.y.data(), s.e.y.data());
  edges(m, state.x.z.data(), state.fine.z.data(), s.e.z.data());
}

namespace {

// The rows are divided into kLanes runs of equal length with one row between neighbors ("substructuring"). The runs are
// eliminated side by side, one per lane: one chain of dependent operations of an eighth of the length. The rows between them
// form a small tridiagonal system of their own. Rows behind the last one are those of the unit matrix.
constexpr size_t kLanes = LaneSystem::kLanes;
size_t rows_of_lane(size_t m) { return m < kLanes ? 1 : m / kLanes; }

// One number of each lane. By reference: how a function returns so wide a register depends on the instruction set.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
#define CATGUT_INLINE inline __attribute__((always_inline))
CATGUT_INLINE void load(const float* from, Lanes& v) { __builtin_memcpy(&v, from, sizeof v); }
CATGUT_INLINE void store(const Lanes& v, float* to) { __builtin_memcpy(to, &v, sizeof v); }
// From and to columns in the order of the rows.
CATGUT_INLINE void gather(const float* from, size_t stride, Lanes& v) {
  v = Lanes{from[0],          from[stride],     from[2 * stride], from[3 * stride],
            from[4 * stride], from[5 * stride], from[6 * stride], from[7 * stride]};
}
CATGUT_INLINE void scatter(const Lanes& v, size_t stride, float* to) {
  for (size_t c = 0; c < kLanes; ++c) to[c * stride] = v[c];
}

CATGUT_CLONES void eliminate(size_t rows, const float* __restrict diag, const float* __restrict off, float* __restrict down,
                             float* __restrict inverse, float* __restrict first, float* __restrict left) {
  const size_t stride = rows + 1;
  Lanes spike{}, inv{}, o{}, diagonal{}, d{}, part{};
  gather(off - 1, stride, spike);
  spike[0] = 0;
  gather(diag, stride, diagonal);
  inv = 1 / diagonal;
  store(inv, inverse), store(spike, first);
  for (size_t a = 1; a < rows; ++a) {
    gather(off + a - 1, stride, o), gather(diag + a, stride, diagonal);
    d = o * inv;
    inv = 1 / (diagonal - d * o);
    spike = -d * spike;
    store(d, down + a * kLanes), store(inv, inverse + a * kLanes), store(spike, first + a * kLanes);
  }
  spike = spike * inv;
  store(spike, left + (rows - 1) * kLanes);
  for (size_t a = rows - 1; a-- > 0;) {
    load(first + a * kLanes, part), load(inverse + a * kLanes, inv), load(down + (a + 1) * kLanes, d);
    spike = part * inv - d * spike;
    store(spike, left + a * kLanes);
  }
}

CATGUT_CLONES void forward(size_t rows, const float* __restrict down, const float* __restrict left, const float* __restrict y,
                           float* __restrict swept, float* __restrict begin, float* __restrict end) {
  const size_t stride = rows + 1;
  Lanes run{}, sum{}, v{}, part{};
  gather(y, stride, run), load(left, part);
  store(run, swept);
  sum = part * run;
  for (size_t a = 1; a < rows; ++a) {
    gather(y + a, stride, v), load(left + a * kLanes, part);
    sum += part * v;
    load(down + a * kLanes, part);
    run = v - part * run;
    store(run, swept + a * kLanes);
  }
  store(sum, begin), store(run, end);
}

CATGUT_CLONES void backward(size_t rows, const float* __restrict down, const float* __restrict inverse,
                            const float* __restrict first, const float* __restrict swept, const float* __restrict before,
                            const float* __restrict behind, float* __restrict x) {
  const size_t stride = rows + 1, last = (rows - 1) * kLanes;
  Lanes run{}, from{}, spike{}, inv{}, entry{}, exit{};
  load(before, entry), load(behind, exit);
  load(swept + last, from), load(first + last, spike), load(inverse + last, inv);
  run = (from - spike * entry - exit) * inv;
  scatter(run, stride, x + rows - 1);
  for (size_t a = rows - 1; a-- > 0;) {
    const size_t at = a * kLanes;
    load(swept + at, from), load(first + at, spike), load(inverse + at, inv);
    from = (from - spike * entry) * inv;
    load(down + at + kLanes, spike);
    run = from - spike * run;
    scatter(run, stride, x + a);
  }
}

}  // namespace

void factor_tridiagonal(Scratch& s, size_t m) {
  LaneSystem& t = s.lanes;
  const size_t rows = rows_of_lane(m), stride = rows + 1;
  float *diag = s.diag.data(), *off = s.off.data();
  if (m > 0) off[m - 1] = 0;
  for (size_t i = m; i < kLanes * stride; ++i) diag[i] = 1, off[i] = 0;
  eliminate(rows, diag, off, t.down.data(), t.inverse.data(), t.first.data(), t.left.data());
  const float *inverse = t.inverse.data() + (rows - 1) * kLanes, *left = t.left.data(), *far = left + (rows - 1) * kLanes;
  for (size_t c = 0; c < kLanes; ++c) t.off_end[c] = c + 1 < kLanes ? off[c * stride + rows - 1] : 0.0f;
  // Between the lanes: L D L^T.
  float inv = 0;
  for (size_t c = 0; c + 1 < kLanes; ++c) {
    const size_t row = c * stride + rows;
    float d = diag[row] - t.off_end[c] * t.off_end[c] * inverse[c] - off[row] * left[c + 1];
    t.between_down[c] = c > 0 ? -t.off_end[c] * far[c] * inv : 0.0f;
    if (c > 0) d += t.between_down[c] * t.off_end[c] * far[c];
    t.between_inverse[c] = inv = 1 / d;
  }
}

void solve_tridiagonal(Scratch& s, size_t m, float* y, float* x) {
  LaneSystem& t = s.lanes;
  const size_t rows = rows_of_lane(m), stride = rows + 1;
  for (size_t i = m; i < kLanes * stride; ++i) y[i] = 0;
  float begin[kLanes], end[kLanes], between[kLanes + 1];
  forward(rows, t.down.data(), t.left.data(), y, t.swept.data(), begin, end);
  const float* inverse = t.inverse.data() + (rows - 1) * kLanes;
  for (size_t c = 0; c + 1 < kLanes; ++c) {
    const float v = y[c * stride + rows] - t.off_end[c] * (end[c] * inverse[c]) - begin[c + 1];
    between[c + 1] = v - (c > 0 ? t.between_down[c] * between[c] : 0.0f);
  }
  between[0] = 0;
  float behind[kLanes];
  behind[kLanes - 1] = 0;
  for (size_t c = kLanes - 1; c-- > 0;) {
    between[c + 1] = between[c + 1] * t.between_inverse[c] - (c + 2 < kLanes ? t.between_down[c + 1] * between[c + 2] : 0.0f);
    behind[c] = t.off_end[c] * between[c + 1];
  }
  backward(rows, t.down.data(), t.inverse.data(), t.first.data(), t.swept.data(), between, behind, x);
  for (size_t c = 0; c + 1 < kLanes; ++c) x[c * stride + rows] = between[c + 1];
  for (size_t i = m; i < kLanes * stride; ++i) x[i] = 0;
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
  if (corners) solve_corners(settings, state, s);
  accumulate(m, most_multiplier(settings), x, s.lambda.data());
  apply(m + 1, s.n.x.data(), s.n.y.data(), s.n.z.data(), x, s.w.data(), s.u.x.data(), s.u.y.data(), s.u.z.data());
  if (corners) apply_corners(state, s, *soft, settings.substep);
}

}  // namespace catgut::thread
