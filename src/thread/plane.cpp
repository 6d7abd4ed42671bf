// SPDX-License-Identifier: Apache-2.0
// thread/plane: contact of the thread with a plane that it lies on. Reads positions and the predicted motion; writes motion and
// the plane's columns of State. Each contact moves one node alone, so that a sweep is one loop over columns. The law is that
// of thread/contact, which applies these contacts after its own ones, or before them in a backward sweep.
#include <algorithm>
#include <bit>
#include <cmath>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

// Every loop without branches and with a pointer for each column: otherwise GCC does not vectorize it. Values are read before
// they are chosen: loads under a mask are slow.

// inverse: 0 where a node does not touch.
CATGUT_CLONES void find(size_t nodes, Vec3 n, float offset, float radius, float ready, const float* __restrict x,
                        const float* __restrict y, const float* __restrict z, const float* __restrict ux,
                        const float* __restrict uy, const float* __restrict uz, const float* __restrict w,
                        float* __restrict level, float* __restrict inverse, float* __restrict ln) {
  for (size_t i = 0; i < nodes; ++i) {
    const float moves = n.x * ux[i] + n.y * uy[i] + n.z * uz[i];
    const float movability = w[i], before = ln[i];
    const float gap = n.x * x[i] + n.y * y[i] + n.z * z[i] - offset - radius + moves;
    const float movable = movability > 0 ? movability : 1.0f, may = movability > 0 ? 1.0f : 0.0f,
                on = gap <= ready ? may : 0.0f;
    level[i] = gap - moves;
    inverse[i] = on / movable;
    ln[i] = on > 0 ? before : 0.0f;
  }
}

// What a node remembers of a contact: nothing where it does not touch. By bits, because stores under a mask are slow.
inline void keep_if(bool on, float& v) { v = std::bit_cast<float>(std::bit_cast<uint32_t>(v) & (on ? ~0u : 0u)); }
CATGUT_CLONES void forget_free(size_t nodes, const float* __restrict inverse, float* __restrict x, float* __restrict y,
                               float* __restrict z) {
  for (size_t i = 0; i < nodes; ++i) {
    const bool on = inverse[i] > 0;
    keep_if(on, x[i]), keep_if(on, y[i]), keep_if(on, z[i]);
  }
}
CATGUT_CLONES void flatten(size_t nodes, Vec3 n, float* __restrict x, float* __restrict y, float* __restrict z) {
  for (size_t i = 0; i < nodes; ++i) {
    const float along = x[i] * n.x + y[i] * n.y + z[i] * n.z;
    x[i] -= n.x * along, y[i] -= n.y * along, z[i] -= n.z * along;
  }
}

CATGUT_CLONES void warm(size_t nodes, Vec3 n, const float* __restrict w, const float* __restrict ln, const float* __restrict lx,
                        const float* __restrict ly, const float* __restrict lz, float* __restrict ux, float* __restrict uy,
                        float* __restrict uz) {
  for (size_t i = 0; i < nodes; ++i) {
    ux[i] += (n.x * ln[i] + lx[i]) * w[i];
    uy[i] += (n.y * ln[i] + ly[i]) * w[i];
    uz[i] += (n.z * ln[i] + lz[i]) * w[i];
  }
}

CATGUT_CLONES void sweep(size_t nodes, Vec3 n, float mu, float anchor, const float* __restrict w, const float* __restrict level,
                         const float* __restrict inverse, float* __restrict normal_impulse, float* __restrict slipped,
                         float* __restrict lx, float* __restrict ly, float* __restrict lz, const float* __restrict dx,
                         const float* __restrict dy, const float* __restrict dz, float* __restrict ux, float* __restrict uy,
                         float* __restrict uz) {
  for (size_t i = 0; i < nodes; ++i) {
    const float along = n.x * ux[i] + n.y * uy[i] + n.z * uz[i];
    const float pressed = normal_impulse[i] - (level[i] + along) * inverse[i], ln = pressed > 0 ? pressed : 0.0f;
    float x = lx[i] - (ux[i] - n.x * along + anchor * dx[i]) * inverse[i];
    float y = ly[i] - (uy[i] - n.y * along + anchor * dy[i]) * inverse[i];
    float z = lz[i] - (uz[i] - n.z * along + anchor * dz[i]) * inverse[i];
    const float limit = mu * ln, size2 = x * x + y * y + z * z;
    const bool slips = size2 > limit * limit;
    const float top = slips ? limit : 1.0f, below = slips ? size2 : 1.0f, part = top / std::sqrt(below);
    x *= part, y *= part, z *= part;
    const float change = ln - normal_impulse[i];
    ux[i] += (n.x * change + (x - lx[i])) * w[i];
    uy[i] += (n.y * change + (y - ly[i])) * w[i];
    uz[i] += (n.z * change + (z - lz[i])) * w[i];
    normal_impulse[i] = ln, lx[i] = x, ly[i] = y, lz[i] = z, slipped[i] = slips ? 1.0f : 0.0f;
  }
}

CATGUT_CLONES void remember(size_t nodes, Vec3 n, float limit, const float* __restrict ln, const float* __restrict slipped,
                            float* __restrict dx, float* __restrict dy, float* __restrict dz, const float* __restrict ux,
                            const float* __restrict uy, const float* __restrict uz) {
  for (size_t i = 0; i < nodes; ++i) {
    const float x = dx[i] + ux[i], y = dy[i] + uy[i], z = dz[i] + uz[i], along = x * n.x + y * n.y + z * n.z;
    const float tx = x - n.x * along, ty = y - n.y * along, tz = z - n.z * along, size = std::sqrt(tx * tx + ty * ty + tz * tz);
    const bool far = size > limit;
    const float top = far ? limit : 1.0f, below = far ? size : 1.0f, pressed = ln[i] > 0 ? top / below : 0.0f;
    const float part = slipped[i] > 0 ? 0.0f : pressed;
    dx[i] = tx * part, dy[i] = ty * part, dz[i] = tz * part;
  }
}

}  // namespace

void begin_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane) {
  const float d = settings.material.diameter;
  const size_t n = state.nodes();
  find(n, plane.normal, plane.offset, 0.5f * d, kReady * d, state.x.x.data(), state.x.y.data(), state.x.z.data(), s.u.x.data(),
       s.u.y.data(), s.u.z.data(), s.w.data(), s.plane_level.data(), s.plane_inverse.data(), state.plane_normal.data());
  Columns3 &friction = state.plane_friction, &drift = state.plane_drift;
  flatten(n, plane.normal, friction.x.data(), friction.y.data(), friction.z.data());
  forget_free(n, s.plane_inverse.data(), friction.x.data(), friction.y.data(), friction.z.data());
  forget_free(n, s.plane_inverse.data(), drift.x.data(), drift.y.data(), drift.z.data());
  const float* on = s.plane_inverse.data();
  size_t &first = s.plane_first, &end = s.plane_end;
  for (end = n; end > 0 && on[end - 1] == 0; --end) continue;
  for (first = 0; first < end && on[first] == 0; ++first) continue;
}

void warm_plane(State& state, Scratch& s, const Plane& plane) {
  const size_t a = s.plane_first;
  const Columns3& friction = state.plane_friction;
  warm(s.plane_end - a, plane.normal, s.w.data() + a, state.plane_normal.data() + a, friction.x.data() + a,
       friction.y.data() + a, friction.z.data() + a, s.u.x.data() + a, s.u.y.data() + a, s.u.z.data() + a);
}

void sweep_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane) {
  const size_t a = s.plane_first;
  Columns3 &friction = state.plane_friction, &drift = state.plane_drift;
  sweep(s.plane_end - a, plane.normal, plane.friction, settings.anchor, s.w.data() + a, s.plane_level.data() + a,
        s.plane_inverse.data() + a, state.plane_normal.data() + a, s.plane_slipped.data() + a, friction.x.data() + a,
        friction.y.data() + a, friction.z.data() + a, drift.x.data() + a, drift.y.data() + a, drift.z.data() + a,
        s.u.x.data() + a, s.u.y.data() + a, s.u.z.data() + a);
}

void end_plane(const Settings& settings, State& state, Scratch& s, Plane& plane) {
  const size_t a = s.plane_first;
  Columns3& drift = state.plane_drift;
  remember(s.plane_end - a, plane.normal, 0.2f * settings.material.diameter, state.plane_normal.data() + a,
           s.plane_slipped.data() + a, drift.x.data() + a, drift.y.data() + a, drift.z.data() + a, s.u.x.data() + a,
           s.u.y.data() + a, s.u.z.data() + a);
  Vec3 sum{};
  for (size_t i = a; i < s.plane_end; ++i) {
    sum += plane.normal * state.plane_normal[i] + state.plane_friction.at(i);
    if (state.plane_normal[i] <= 0) continue;
    s.touched[i] |= kOnOther, s.touched[i + 1 < state.nodes() ? i + 1 : i - 1] |= kOnOther;
  }
  plane.force -= sum * (1 / (settings.substep * settings.substep * static_cast<float>(settings.substeps)));
}

}  // namespace catgut::thread
