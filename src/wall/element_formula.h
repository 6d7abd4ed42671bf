// SPDX-License-Identifier: Apache-2.0
// wall/element_formula: the element's energy and force, written once for any number type. This file has no include guard. It is
// included inside a namespace that defines above, absolute, larger, square_root and any for the number type: once for doubles
// (element.h) and once for each instruction set (force.cpp). Formulas and sources: element.h.

template <class S>
struct Vec3Of {
  S x, y, z;
};
template <class S>
inline Vec3Of<S> operator+(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class S>
inline Vec3Of<S> operator-(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S>
inline Vec3Of<S> operator*(const Vec3Of<S>& a, const S& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class S>
inline S dot(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S>
inline Vec3Of<S> cross(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// A quaternion of lanes: the element's frame.
template <class S>
struct Turn {
  S x, y, z, w;
};

// Positions of the columns in the element's natural coordinates, or forces on them. Quad, corners (-1,-1) (1,-1) (1,1) (-1,1):
//   mid = m0 + xi a1 + eta a2 + xi eta h1,   director = a3 + xi h2 + eta h3 + xi eta h4
// Triangle, corners (0,0) (2,0) (0,2) about their mean: h1 = h4 = 0.
template <class S>
struct Modes {
  Vec3Of<S> a1, a2, a3, h1, h2, h3, h4;
};

template <class S>
inline Modes<S> quad_modes(const Vec3Of<S> (&mid)[4], const Vec3Of<S> (&dir)[4], const S& quarter) {
  const Vec3Of<S> p = mid[2] - mid[0], q = mid[1] - mid[3], s = mid[0] + mid[2], t = mid[1] + mid[3];
  const Vec3Of<S> dp = dir[2] - dir[0], dq = dir[1] - dir[3], ds = dir[0] + dir[2], dt = dir[1] + dir[3];
  return {(p + q) * quarter,   (p - q) * quarter,   (ds + dt) * quarter, (s - t) * quarter,
          (dp + dq) * quarter, (dp - dq) * quarter, (ds - dt) * quarter};
}
// The transpose: forces on the corners from forces on the modes.
template <class S>
inline void quad_corners(const Modes<S>& f, const S& quarter, Vec3Of<S> (&mid)[4], Vec3Of<S> (&dir)[4]) {
  const Vec3Of<S> p = (f.a1 + f.a2) * quarter, q = (f.a1 - f.a2) * quarter, h = f.h1 * quarter;
  mid[0] = h - p, mid[2] = h + p, mid[1] = q - h, mid[3] = Vec3Of<S>(q * S(-1.0f)) - h;
  const Vec3Of<S> dp = (f.h2 + f.h3) * quarter, dq = (f.h2 - f.h3) * quarter;
  const Vec3Of<S> even = (f.a3 + f.h4) * quarter, odd = (f.a3 - f.h4) * quarter;
  dir[0] = even - dp, dir[2] = even + dp, dir[1] = odd + dq, dir[3] = odd - dq;
}
template <class S>
inline Modes<S> triangle_modes(const Vec3Of<S> (&mid)[4], const Vec3Of<S> (&dir)[4], const S& half, const S& third) {
  const Vec3Of<S> none{S(0.0f), S(0.0f), S(0.0f)};
  return {(mid[1] - mid[0]) * half,
          (mid[2] - mid[0]) * half,
          (dir[0] + dir[1] + dir[2]) * third,
          none,
          (dir[1] - dir[0]) * half,
          (dir[2] - dir[0]) * half,
          none};
}
template <class S>
inline void triangle_corners(const Modes<S>& f, const S& half, const S& third, Vec3Of<S> (&mid)[4], Vec3Of<S> (&dir)[4]) {
  const Vec3Of<S> f1 = f.a1 * half, f2 = f.a2 * half, d1 = f.h2 * half, d2 = f.h3 * half, d = f.a3 * third;
  const Vec3Of<S> none{S(0.0f), S(0.0f), S(0.0f)};
  mid[0] = none - f1 - f2, mid[1] = f1, mid[2] = f2, mid[3] = none;
  dir[0] = d - d1 - d2, dir[1] = d + d1, dir[2] = d + d2, dir[3] = none;
}

template <class S>
struct Frame {  // columns of the rotation
  Vec3Of<S> x, y, z;
};
template <class S>
inline Frame<S> frame_of(const Turn<S>& q) {
  const S one(1.0f), two(2.0f);
  const S x2 = two * q.x, y2 = two * q.y, z2 = two * q.z;
  const S xx = q.x * x2, yy = q.y * y2, zz = q.z * z2, xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
  const S wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  return {{one - yy - zz, xy + wz, xz - wy}, {xy - wz, one - xx - zz, yz + wx}, {xz + wy, yz - wx, one - xx - yy}};
}
template <class S>
inline Vec3Of<S> to_local(const Frame<S>& r, const Vec3Of<S>& v) {
  return {dot(r.x, v), dot(r.y, v), dot(r.z, v)};
}
template <class S>
inline Vec3Of<S> to_world(const Frame<S>& r, const Vec3Of<S>& v) {
  return r.x * v.x + r.y * v.y + r.z * v.z;
}

// Solves (tr(S) 1 - S) y = v for the symmetric part of S (columns s1, s2, s3). Where the matrix is nearly singular (an element
// turned inside out) `safe` is 0 and y is the damped step of Mueller et al. 2016 (doi 10.1145/2994258.2994269).
template <class S>
inline Vec3Of<S> polar_solve(const Vec3Of<S>& s1, const Vec3Of<S>& s2, const Vec3Of<S>& s3, const Vec3Of<S>& v, S& safe) {
  const S half(0.5f), one(1.0f);
  const S a = s2.y + s3.z, b = s1.x + s3.z, c = s1.x + s2.y;
  const S d = half * (s2.x + s1.y), e = half * (s3.x + s1.z), f = half * (s3.y + s2.z);  // minus the entries off the diagonal
  const S c11 = b * c - f * f, c12 = d * c + e * f, c13 = d * f + e * b;
  const S c22 = a * c - e * e, c23 = a * f + d * e, c33 = a * b - d * d;
  const S det = a * c11 - d * c12 - e * c13;
  const S trace = s1.x + s2.y + s3.z;
  // Positive definite with some room: at rest a = b = c = 2 and det = 8.
  safe = above(det, S(0.4f)) * above(c11, S(0.1f)) * above(a, S(0.1f));
  const S inv = safe / (det * safe + (one - safe));
  const S damped = (one - safe) / (absolute(trace) + S(1e-3f));
  return {(c11 * v.x + c12 * v.y + c13 * v.z) * inv + v.x * damped, (c12 * v.x + c22 * v.y + c23 * v.z) * inv + v.y * damped,
          (c13 * v.x + c23 * v.y + c33 * v.z) * inv + v.z * damped};
}

// Force of an element on its modes, and optionally its stored energy [J]. `q` is turned `steps` Newton steps to the rotation
// of the mean deformation (analytic polar decomposition, Kugelstadt et al. 2018, doi 10.1111/cgf.13520). One step suffices in a
// simulation, whose frames are warm-started.
template <class S, class Get>
inline Modes<S> element_force(const Get& c, const Modes<S>& m, Turn<S>& q, int steps, S* energy = nullptr) {
  const S half(0.5f), one(1.0f);
  const S g11 = c(kG11), g12 = c(kG12), g21 = c(kG21), g22 = c(kG22);
  // Columns of the mean deformation from the rest's local frame.
  const Vec3Of<S> f1 = m.a1 * g11 + m.a2 * g21, f2 = m.a1 * g12 + m.a2 * g22;
  const Vec3Of<S> f3 = (m.a3 - f1 * c(kD0x) - f2 * c(kD0y)) * c(kInvD0z);

  Frame<S> r = frame_of(q);
  Vec3Of<S> s1, s2, s3;
  S safe;
  for (int k = 0; k < steps; ++k) {
    s1 = to_local(r, f1), s2 = to_local(r, f2), s3 = to_local(r, f3);
    const Vec3Of<S> skew{s2.z - s3.y, s3.x - s1.z, s1.y - s2.x};
    const Vec3Of<S> w = polar_solve(s1, s2, s3, skew, safe);
    // At most about 0.7 rad per step.
    const S shrink = half / square_root(one + dot(w, w));
    const S x = w.x * shrink, y = w.y * shrink, z = w.z * shrink;
    const Turn<S> t{q.x + q.w * x + q.y * z - q.z * y, q.y + q.w * y + q.z * x - q.x * z, q.z + q.w * z + q.x * y - q.y * x,
                    q.w - q.x * x - q.y * y - q.z * z};
    const S norm = one / square_root(t.x * t.x + t.y * t.y + t.z * t.z + t.w * t.w);
    q = {t.x * norm, t.y * norm, t.z * norm, t.w * norm};
    r = frame_of(q);
  }
  s1 = to_local(r, f1), s2 = to_local(r, f2), s3 = to_local(r, f3);

  const Vec3Of<S> q1 = to_local(r, m.h1) - (s1 * c(kH1x) + s2 * c(kH1y) + s3 * c(kH1z));
  const Vec3Of<S> q2 = to_local(r, m.h2) - (s1 * c(kH2x) + s2 * c(kH2y) + s3 * c(kH2z));
  const Vec3Of<S> q3 = to_local(r, m.h3) - (s1 * c(kH3x) + s2 * c(kH3y) + s3 * c(kH3z));
  const Vec3Of<S> q4 = to_local(r, m.h4) - (s1 * c(kH4x) + s2 * c(kH4y) + s3 * c(kH4z));

  // Strains: membrane, transverse shear, thickness, bending per zeta.
  const S e1 = s1.x - one, e2 = s2.y - one, e3 = s3.z - one;
  const S e12 = s2.x + s1.y, e13 = s3.x + s1.z, e23 = s3.y + s2.z;
  const S k1 = q2.x * g11 + q3.x * g21, k2 = q2.y * g12 + q3.y * g22;
  const S k12 = q2.x * g12 + q3.x * g22 + q2.y * g11 + q3.y * g21;
  // Contraction saturates, so that no stretch inverts the cross-section.
  const S u1 = one / square_root(one + e1 * e1), u2 = one / square_root(one + e2 * e2);
  const S p1 = e1 * u1, p2 = e2 * u2, d1 = u1 * u1 * u1, d2 = u2 * u2 * u2;

  // Straightened fibers: their own stretch, not the frame's strain, which a tilted director would reduce. Measured along the
  // frame, a wall stretched to 40 % softened by tilting.
  const S long1 = square_root(dot(s1, s1) + S(1e-12f)), long2 = square_root(dot(s2, s2) + S(1e-12f));
  const S over1 = larger(long1 - one - c(kKnee1), S(0.0f)), over2 = larger(long2 - one - c(kKnee2), S(0.0f));
  const S thick = c(kThick) * (e3 + c(kContract1) * p1 + c(kContract2) * p2);

  const S a12 = c(kA12), a16 = c(kA16), a26 = c(kA26);
  const S b11 = c(kB11), b12 = c(kB12), b22 = c(kB22), b16 = c(kB16), b26 = c(kB26), b66 = c(kB66);
  const S n1 = c(kA11) * e1 + a12 * p2 * d1 + a16 * e12 + b11 * k1 + b12 * k2 + b16 * k12 + thick * c(kContract1) * d1;
  const S n2 = c(kA22) * e2 + a12 * p1 * d2 + a26 * e12 + b12 * k1 + b22 * k2 + b26 * k12 + thick * c(kContract2) * d2;
  const S n12 = c(kA66) * e12 + a16 * e1 + a26 * e2 + b16 * k1 + b26 * k2 + b66 * k12;
  const S n13 = c(kShear1) * e13, n23 = c(kShear2) * e23;
  const S m1 = c(kE11) * k1 + c(kE12) * k2 + c(kE16) * k12 + b11 * e1 + b12 * e2 + b16 * e12;
  const S m2 = c(kE12) * k1 + c(kE22) * k2 + c(kE26) * k12 + b12 * e1 + b22 * e2 + b26 * e12;
  const S m12 = c(kE16) * k1 + c(kE26) * k2 + c(kE66) * k12 + b16 * e1 + b26 * e2 + b66 * e12;

  // Shear that varies along the edges.
  const S edge1 = q1.x * c(kD0x) + q1.y * c(kD0y) + q1.z * c(kD0z) + q3.x * c(kA1x) + q3.y * c(kA1y);
  const S edge2 = q1.x * c(kD0x) + q1.y * c(kD0y) + q1.z * c(kD0z) + q2.x * c(kA2x) + q2.y * c(kA2y);
  const S t1 = c(kEdge11) * edge1 + c(kEdge12) * edge2, t2 = c(kEdge12) * edge1 + c(kEdge22) * edge2, t = t1 + t2;

  const Vec3Of<S> r1{c(kInPlane11) * q1.x + c(kInPlane12) * q1.y + t * c(kD0x),
                     c(kInPlane12) * q1.x + c(kInPlane22) * q1.y + t * c(kD0y), t * c(kD0z)};
  const Vec3Of<S> r2{m1 * g11 + m12 * g12 + t2 * c(kA2x), m2 * g12 + m12 * g11 + t2 * c(kA2y), c(kThick2) * q2.z};
  const Vec3Of<S> r3{m1 * g21 + m12 * g22 + t1 * c(kA1x), m2 * g22 + m12 * g21 + t1 * c(kA1y), c(kThick3) * q3.z};
  const Vec3Of<S> r4{c(kTwist11) * q4.x + c(kTwist12) * q4.y, c(kTwist12) * q4.x + c(kTwist22) * q4.y, c(kThick4) * q4.z};

  if (energy) {
    const S th = e3 + c(kContract1) * p1 + c(kContract2) * p2;
    *energy = half * (c(kA11) * e1 * e1 + c(kA22) * e2 * e2 + c(kA66) * e12 * e12) + a12 * p1 * p2 + a16 * e1 * e12 +
              a26 * e2 * e12 + e1 * (b11 * k1 + b12 * k2 + b16 * k12) + e2 * (b12 * k1 + b22 * k2 + b26 * k12) +
              e12 * (b16 * k1 + b26 * k2 + b66 * k12) + half * (c(kE11) * k1 * k1 + c(kE22) * k2 * k2 + c(kE66) * k12 * k12) +
              c(kE12) * k1 * k2 + c(kE16) * k1 * k12 + c(kE26) * k2 * k12 +
              half * (c(kStiff1) * over1 * over1 + c(kStiff2) * over2 * over2 + c(kThick) * th * th) +
              half * (c(kShear1) * e13 * e13 + c(kShear2) * e23 * e23) +
              half * (c(kInPlane11) * q1.x * q1.x + c(kInPlane22) * q1.y * q1.y) + c(kInPlane12) * q1.x * q1.y +
              half * (c(kTwist11) * q4.x * q4.x + c(kTwist22) * q4.y * q4.y) + c(kTwist12) * q4.x * q4.y +
              half * (c(kEdge11) * edge1 * edge1 + c(kEdge22) * edge2 * edge2) + c(kEdge12) * edge1 * edge2 +
              half * (c(kThick2) * q2.z * q2.z + c(kThick3) * q3.z * q3.z + c(kThick4) * q4.z * q4.z);
  }

  // Local gradient with respect to the columns of F at a fixed frame, then the contribution of the frame's rotation.
  const Vec3Of<S> sig1 = Vec3Of<S>{n1, n12, n13} + s1 * (c(kStiff1) * over1 / long1);
  const Vec3Of<S> sig2 = Vec3Of<S>{n12, n2, n23} + s2 * (c(kStiff2) * over2 / long2);
  const Vec3Of<S> sig3{n13, n23, thick};
  const Vec3Of<S> torque =
      cross(s1, sig1) + cross(s2, sig2) + cross(s3, sig3) + cross(q1, r1) + cross(q2, r2) + cross(q3, r3) + cross(q4, r4);
  const Vec3Of<S> solved = polar_solve(s1, s2, s3, torque, safe);
  const Vec3Of<S> y = solved * safe;
  Vec3Of<S> l1{sig1.x, sig1.y - y.z, sig1.z + y.y}, l2{sig2.x + y.z, sig2.y, sig2.z - y.x},
      l3{sig3.x - y.y, sig3.y + y.x, sig3.z};
  l1 = l1 - r1 * c(kH1x) - r2 * c(kH2x) - r3 * c(kH3x) - r4 * c(kH4x);
  l2 = l2 - r1 * c(kH1y) - r2 * c(kH2y) - r3 * c(kH3y) - r4 * c(kH4y);
  l3 = l3 - r1 * c(kH1z) - r2 * c(kH2z) - r3 * c(kH3z) - r4 * c(kH4z);
  l3 = l3 * c(kInvD0z);
  l1 = l1 - l3 * c(kD0x);
  l2 = l2 - l3 * c(kD0y);
  // Forces are minus the gradient.
  const S minus(-1.0f);
  const Vec3Of<S> w1 = to_world(r, l1) * minus, w2 = to_world(r, l2) * minus;
  return {w1 * g11 + w2 * g12,     w1 * g21 + w2 * g22,     to_world(r, l3) * minus, to_world(r, r1) * minus,
          to_world(r, r2) * minus, to_world(r, r3) * minus, to_world(r, r4) * minus};
}

// No formula above bounds a corner's volume: pressed or bent far enough, it turns inside out, and nothing can lie against it.
// So the volume that its edges and its director span resists below a part of what it is at rest, four times as stiff as the
// thickness. Adds to the forces on the element's N corners, and to the energy. True where one has less than kFlat of it left.
constexpr float kLeastVolume = 0.5f, kGuard = 4, kFlat = 0.2f, kFlatAtRest = 0.3f;
template <size_t N, class S, class Get>
inline bool guard_corners(const Get& c, const Vec3Of<S> (&mid)[4], const Vec3Of<S> (&dir)[4], Vec3Of<S> (&mid_force)[4],
                          Vec3Of<S> (&dir_force)[4], S* energy = nullptr) {
  // Few elements need more than the first test, against the volume at rest in their middle.
  const S zero(0.0f), span(4.0f);
  const S middle = span * (c(kA1x) * c(kA2y) - c(kA1y) * c(kA2x)) * c(kD0z);
  Vec3Of<S> area[N];
  S volume[N], low(0.0f);
  for (size_t k = 0; k < N; ++k) {
    area[k] = cross(mid[(k + 1) % N] - mid[k], mid[(k + N - 1) % N] - mid[k]);
    volume[k] = dot(area[k], dir[k]);
    low = low + above(middle * S(0.8f), volume[k]);
  }
  if (!any(low)) return false;
  S flat(0.0f);
  constexpr float kXi[] = {-1, 1, 1, -1}, kEta[] = {-1, -1, 1, 1};
  for (size_t k = 0; k < N; ++k) {
    S rest = middle;
    if (N == 4) {
      const S xi(kXi[k]), eta(kEta[k]), both(kXi[k] * kEta[k]);
      const Vec3Of<S> h1{c(kH1x), c(kH1y), c(kH1z)}, h4{c(kH4x), c(kH4y), c(kH4z)};
      const Vec3Of<S> d0{c(kD0x), c(kD0y), c(kD0z)}, h2{c(kH2x), c(kH2y), c(kH2z)}, h3{c(kH3x), c(kH3y), c(kH3z)};
      const Vec3Of<S> a1{c(kA1x), c(kA1y), zero}, a2{c(kA2x), c(kA2y), zero};
      rest = span * dot(cross(a1 + h1 * eta, a2 + h1 * xi), d0 + h2 * xi + h3 * eta + h4 * both);
    }
    // A corner that is nearly flat already at rest is left as it is.
    const S counts = above(rest, middle * S(kFlatAtRest));
    const S missing = larger(S(kLeastVolume) * rest - volume[k], zero) * counts;
    flat = flat + above(S(kFlat) * rest, volume[k]) * counts;
    const S stiff = S(kGuard / static_cast<float>(N)) * c(kThick) / larger(rest * rest, S(1e-30f)), f = stiff * missing;
    const size_t next = (k + 1) % N, last = (k + N - 1) % N;
    const Vec3Of<S> on_next = cross(mid[last] - mid[k], dir[k]) * f, on_last = cross(dir[k], mid[next] - mid[k]) * f;
    dir_force[k] = dir_force[k] + area[k] * f;
    mid_force[next] = mid_force[next] + on_next, mid_force[last] = mid_force[last] + on_last;
    mid_force[k] = mid_force[k] - on_next - on_last;
    if (energy) *energy = *energy + S(0.5f) * f * missing;
  }
  return any(flat);
}
