// SPDX-License-Identifier: Apache-2.0
// thread/plane: contact of the thread with a plane that it lies on. Reads positions and the predicted motion; writes motion and
// the plane's columns of State. Each contact moves one node alone, so that a sweep is one loop over columns. The law is that
// of thread/contact, which applies these contacts after its own ones, or before them in a backward sweep.
#include <algorithm>
#include <cmath>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

// Three columns.
struct View {
  float *x, *y, *z;
};
View view(Columns3& c, size_t from) { return {c.x.data() + from, c.y.data() + from, c.z.data() + from}; }
View view(Padded3& c, size_t from) { return {c.x.data() + from, c.y.data() + from, c.z.data() + from}; }

// inverse: 0 where a node does not touch. bound: offset of the plane and radius of the thread.
CATGUT_CLONES void find(size_t nodes, Vec3 n, float offset, float radius, float ready, View at, View u,
                        const float* __restrict w, float* __restrict level, float* __restrict inverse, float* __restrict ln,
                        View lt, View drift) {
  const float* __restrict x = at.x, * __restrict y = at.y, * __restrict z = at.z;
  const float* __restrict ux = u.x, * __restrict uy = u.y, * __restrict uz = u.z;
  float* __restrict lx = lt.x, * __restrict ly = lt.y, * __restrict lz = lt.z;
  float* __restrict dx = drift.x, * __restrict dy = drift.y, * __restrict dz = drift.z;
  for (size_t i = 0; i < nodes; ++i) {
    const float moves = n.x * ux[i] + n.y * uy[i] + n.z * uz[i];
    const float gap = n.x * x[i] + n.y * y[i] + n.z * z[i] - offset - radius + moves;
    const bool on = gap <= ready && w[i] > 0;
    level[i] = gap - moves;
    inverse[i] = on ? 1 / w[i] : 0.0f;
    ln[i] = on ? ln[i] : 0.0f;
    const float along = lx[i] * n.x + ly[i] * n.y + lz[i] * n.z;
    lx[i] = on ? lx[i] - n.x * along : 0.0f, ly[i] = on ? ly[i] - n.y * along : 0.0f, lz[i] = on ? lz[i] - n.z * along : 0.0f;
    dx[i] = on ? dx[i] : 0.0f, dy[i] = on ? dy[i] : 0.0f, dz[i] = on ? dz[i] : 0.0f;
  }
}

CATGUT_CLONES void warm(size_t nodes, Vec3 n, const float* __restrict w, const float* __restrict ln, View lt, View u) {
  const float* __restrict lx = lt.x, * __restrict ly = lt.y, * __restrict lz = lt.z;
  float* __restrict ux = u.x, * __restrict uy = u.y, * __restrict uz = u.z;
  for (size_t i = 0; i < nodes; ++i) {
    ux[i] += (n.x * ln[i] + lx[i]) * w[i];
    uy[i] += (n.y * ln[i] + ly[i]) * w[i];
    uz[i] += (n.z * ln[i] + lz[i]) * w[i];
  }
}

CATGUT_CLONES void sweep(size_t nodes, Vec3 n, float mu, float anchor, const float* __restrict w, const float* __restrict level,
                         const float* __restrict inverse, float* __restrict normal_impulse, float* __restrict slipped, View lt,
                         View drift, View u) {
  float* __restrict lx = lt.x, * __restrict ly = lt.y, * __restrict lz = lt.z;
  const float* __restrict dx = drift.x, * __restrict dy = drift.y, * __restrict dz = drift.z;
  float* __restrict ux = u.x, * __restrict uy = u.y, * __restrict uz = u.z;
  for (size_t i = 0; i < nodes; ++i) {
    const float along = n.x * ux[i] + n.y * uy[i] + n.z * uz[i];
    const float pressed = normal_impulse[i] - (level[i] + along) * inverse[i], ln = pressed > 0 ? pressed : 0.0f;
    float x = lx[i] - (ux[i] - n.x * along + anchor * dx[i]) * inverse[i];
    float y = ly[i] - (uy[i] - n.y * along + anchor * dy[i]) * inverse[i];
    float z = lz[i] - (uz[i] - n.z * along + anchor * dz[i]) * inverse[i];
    const float limit = mu * ln, size2 = x * x + y * y + z * z;
    const bool slips = size2 > limit * limit;
    const float part = slips ? limit / std::sqrt(size2) : 1.0f;
    x *= part, y *= part, z *= part;
    const float change = ln - normal_impulse[i];
    ux[i] += (n.x * change + (x - lx[i])) * w[i];
    uy[i] += (n.y * change + (y - ly[i])) * w[i];
    uz[i] += (n.z * change + (z - lz[i])) * w[i];
    normal_impulse[i] = ln, lx[i] = x, ly[i] = y, lz[i] = z, slipped[i] = slips ? 1.0f : 0.0f;
  }
}

CATGUT_CLONES void remember(size_t nodes, Vec3 n, float limit, const float* __restrict ln, const float* __restrict slipped,
                            View drift, View u) {
  float* __restrict dx = drift.x, * __restrict dy = drift.y, * __restrict dz = drift.z;
  const float* __restrict ux = u.x, * __restrict uy = u.y, * __restrict uz = u.z;
  for (size_t i = 0; i < nodes; ++i) {
    const float x = dx[i] + ux[i], y = dy[i] + uy[i], z = dz[i] + uz[i], along = x * n.x + y * n.y + z * n.z;
    const float tx = x - n.x * along, ty = y - n.y * along, tz = z - n.z * along, size = std::sqrt(tx * tx + ty * ty + tz * tz);
    const bool sticks = ln[i] > 0 && slipped[i] == 0;
    const float part = sticks ? (size > limit ? limit / size : 1.0f) : 0.0f;
    dx[i] = tx * part, dy[i] = ty * part, dz[i] = tz * part;
  }
}

}  // namespace

void begin_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane) {
  const float d = settings.material.diameter;
  const size_t n = state.nodes();
  find(n, plane.normal, plane.offset, 0.5f * d, kReady * d, view(state.x, 0), view(s.u, 0), s.w.data(), s.plane_level.data(),
       s.plane_inverse.data(), state.plane_normal.data(), view(state.plane_friction, 0), view(state.plane_drift, 0));
  const float* on = s.plane_inverse.data();
  size_t &first = s.plane_first, &end = s.plane_end;
  for (end = n; end > 0 && on[end - 1] == 0; --end) continue;
  for (first = 0; first < end && on[first] == 0; ++first) continue;
}

void warm_plane(State& state, Scratch& s, const Plane& plane) {
  const size_t a = s.plane_first;
  warm(s.plane_end - a, plane.normal, s.w.data() + a, state.plane_normal.data() + a, view(state.plane_friction, a),
       view(s.u, a));
}

void sweep_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane) {
  const size_t a = s.plane_first;
  sweep(s.plane_end - a, plane.normal, plane.friction, settings.anchor, s.w.data() + a, s.plane_level.data() + a,
        s.plane_inverse.data() + a, state.plane_normal.data() + a, s.plane_slipped.data() + a, view(state.plane_friction, a),
        view(state.plane_drift, a), view(s.u, a));
}

void end_plane(const Settings& settings, State& state, Scratch& s, Plane& plane) {
  const size_t a = s.plane_first;
  remember(s.plane_end - a, plane.normal, 0.2f * settings.material.diameter, state.plane_normal.data() + a,
           s.plane_slipped.data() + a, view(state.plane_drift, a), view(s.u, a));
  Vec3 sum{};
  for (size_t i = a; i < s.plane_end; ++i) {
    sum += plane.normal * state.plane_normal[i] + state.plane_friction.at(i);
    if (state.plane_normal[i] <= 0) continue;
    s.touched[i] = 1, s.touched[i + 1 < state.nodes() ? i + 1 : i - 1] = 1;
  }
  plane.force -= sum * (1 / (settings.substep * settings.substep * static_cast<float>(settings.substeps)));
}

}  // namespace catgut::thread
