// SPDX-License-Identifier: Apache-2.0
// thread/topology: see the header. Coloring matrix of the projection, its minor's determinant modulo a large prime.
#include "thread/topology.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace catgut::thread {
namespace {

constexpr uint64_t kPrime = 2147483647;

uint64_t power(uint64_t b, uint64_t e) {
  uint64_t r = 1;
  for (; e; e >>= 1, b = b * b % kPrime)
    if (e & 1) r = r * b % kPrime;
  return r;
}

struct Point2 {
  double x, y, z;
};

}  // namespace

std::vector<Projected> project(std::span<const Vec3> closed, Vec3 view) {
  const Vec3 w = normalized(view), u = any_perpendicular(w), v = cross(w, u);
  const size_t n = closed.size();
  std::vector<Point2> p(n);
  for (size_t i = 0; i < n; ++i) p[i] = {double{dot(closed[i], u)}, double{dot(closed[i], v)}, double{dot(closed[i], w)}};
  std::vector<Projected> found;
  for (size_t i = 0; i < n; ++i) {
    const Point2 &a = p[i], &b = p[(i + 1) % n];
    const double left = std::min(a.x, b.x), right = std::max(a.x, b.x), low = std::min(a.y, b.y), high = std::max(a.y, b.y);
    for (size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j + 1 == n) continue;
      const Point2 &c = p[j], &d = p[(j + 1) % n];
      if (std::max(c.x, d.x) < left || std::min(c.x, d.x) > right || std::max(c.y, d.y) < low || std::min(c.y, d.y) > high)
        continue;
      const double ex = b.x - a.x, ey = b.y - a.y, fx = d.x - c.x, fy = d.y - c.y, det = ex * fy - ey * fx;
      if (det == 0) continue;
      const double s = ((c.x - a.x) * fy - (c.y - a.y) * fx) / det, t = ((c.x - a.x) * ey - (c.y - a.y) * ex) / det;
      if (s < 0 || s >= 1 || t < 0 || t >= 1) continue;
      const bool first_over = a.z + s * (b.z - a.z) > c.z + t * (d.z - c.z);
      Projected x;
      x.over = first_over ? static_cast<double>(i) + s : static_cast<double>(j) + t;
      x.under = first_over ? static_cast<double>(j) + t : static_cast<double>(i) + s;
      x.sign = (det > 0) == first_over ? 1 : -1;
      found.push_back(x);
    }
  }
  return found;
}

uint64_t knot_determinant(std::span<const Vec3> closed) {
  std::vector<Projected> x = project(closed, {0.137f, 0.211f, 0.968f});
  std::sort(x.begin(), x.end(), [](const Projected& a, const Projected& b) { return a.under < b.under; });
  const size_t n = x.size();
  if (n < 3) return 1;
  // Arc k runs from undercrossing k - 1 to undercrossing k. Each crossing: 2 over - incoming - outgoing = 0.
  std::vector<std::vector<uint64_t>> m(n, std::vector<uint64_t>(n, 0));
  for (size_t k = 0; k < n; ++k) {
    size_t over = 0;
    while (over < n && x[over].under < x[k].over) ++over;
    m[k][over % n] = (m[k][over % n] + 2) % kPrime;
    m[k][k] = (m[k][k] + kPrime - 1) % kPrime;
    m[k][(k + 1) % n] = (m[k][(k + 1) % n] + kPrime - 1) % kPrime;
  }
  uint64_t det = 1;
  for (size_t c = 0; c + 1 < n; ++c) {
    size_t pivot = c;
    while (pivot + 1 < n && m[pivot][c] == 0) ++pivot;
    if (pivot + 1 == n) return 0;
    if (pivot != c) std::swap(m[pivot], m[c]), det = (kPrime - det) % kPrime;
    det = det * m[c][c] % kPrime;
    const uint64_t inverse = power(m[c][c], kPrime - 2);
    for (size_t r = c + 1; r + 1 < n; ++r) {
      if (m[r][c] == 0) continue;
      const uint64_t f = m[r][c] * inverse % kPrime;
      for (size_t k = c; k + 1 < n; ++k) m[r][k] = (m[r][k] + kPrime - f * m[c][k] % kPrime) % kPrime;
    }
  }
  return std::min(det, kPrime - det);
}

namespace {

// Laurent polynomial. Coefficients modulo 2^64: exact as long as those of the result are small, which Jones polynomials' are.
struct Laurent {
  int low = 0;
  std::vector<uint64_t> c;
  bool is_one() const { return low == 0 && c.size() == 1 && c[0] == 1; }
};

void trim(Laurent& p) {
  while (!p.c.empty() && p.c.back() == 0) p.c.pop_back();
  const auto first = std::find_if(p.c.begin(), p.c.end(), [](uint64_t c) { return c != 0; });
  p.low += static_cast<int>(first - p.c.begin());
  p.c.erase(p.c.begin(), first);
}

// p += sign * A^shift * q
void add(Laurent& p, const Laurent& q, int shift, int sign) {
  if (q.c.empty()) return;
  const int low = q.low + shift;
  if (p.c.empty()) p.low = low;
  if (low < p.low) p.c.insert(p.c.begin(), static_cast<size_t>(p.low - low), 0), p.low = low;
  const size_t at = static_cast<size_t>(low - p.low);
  p.c.resize(std::max(p.c.size(), at + q.c.size()), 0);
  for (size_t k = 0; k < q.c.size(); ++k) p.c[at + k] += sign < 0 ? 0 - q.c[k] : q.c[k];
}

// p /= q, where q begins with 1 or -1; false and unchanged if something would remain.
bool divide(Laurent& p, const Laurent& q) {
  if (p.c.size() < q.c.size()) return false;
  Laurent result{p.low - q.low, std::vector<uint64_t>(p.c.size() - q.c.size() + 1)};
  std::vector<uint64_t> rest = p.c;
  for (size_t k = 0; k < result.c.size(); ++k) {
    const uint64_t f = result.c[k] = rest[k] * q.c[0];
    for (size_t j = 0; j < q.c.size(); ++j) rest[k + j] -= f * q.c[j];
  }
  if (std::any_of(rest.begin(), rest.end(), [](uint64_t c) { return c != 0; })) return false;
  p = std::move(result);
  trim(p);
  return true;
}

// Gauss code: the crossings in the order in which the curve passes them, over and under.
struct Pass {
  uint32_t crossing = 0;
  bool over = false;
};
struct GaussCode {
  std::vector<Pass> pass;
  std::vector<int> sign;  // per crossing
};

GaussCode gauss_code(std::span<const Vec3> closed) {
  const Vec3 views[] = {{0.137f, 0.211f, 0.968f}, {0.968f, 0.137f, 0.211f}, {0.211f, 0.968f, 0.137f}, {0.6f, 0.57f, -0.55f}};
  std::vector<Projected> best;
  for (const Vec3& view : views) {
    std::vector<Projected> x = project(closed, view);
    if (&view == views || x.size() < best.size()) best = std::move(x);
  }
  std::vector<std::pair<double, Pass>> order;
  GaussCode code;
  for (uint32_t k = 0; k < best.size(); ++k) {
    order.push_back({best[k].over, {k, true}}), order.push_back({best[k].under, {k, false}});
    code.sign.push_back(best[k].sign);
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [where, pass] : order) code.pass.push_back(pass);
  return code;
}

// Reidemeister moves I (a crossing passed twice in a row) and II (one strand twice in a row over another) until none is left.
void reduce(GaussCode& code) {
  std::vector<Pass>& pass = code.pass;
  auto remove = [&](uint32_t a, uint32_t b) {
    pass.erase(std::remove_if(pass.begin(), pass.end(), [&](const Pass& p) { return p.crossing == a || p.crossing == b; }),
               pass.end());
  };
  for (bool again = true; again;) {
    again = false;
    std::vector<size_t> under(code.sign.size());
    for (size_t k = 0; k < pass.size(); ++k)
      if (!pass[k].over) under[pass[k].crossing] = k;
    for (size_t i = 0; i < pass.size() && !again; ++i) {
      const size_t n = pass.size();
      const Pass p = pass[i], q = pass[(i + 1) % n];
      const size_t a = under[p.crossing], b = under[q.crossing];
      again = p.crossing == q.crossing ||
              (p.over && q.over && code.sign[p.crossing] != code.sign[q.crossing] && ((a + 1) % n == b || (b + 1) % n == a));
      if (again) remove(p.crossing, q.crossing);
    }
  }
}

// Ends of arcs that are still open, two by two.
using Pairing = std::vector<std::pair<uint32_t, uint32_t>>;

// Lays an arc from a to b; true if that closes a loop.
bool join(Pairing& pairing, uint32_t a, uint32_t b) {
  if (a == b) return true;
  uint32_t end[2] = {a, b};
  for (uint32_t& e : end)
    for (size_t k = 0; k < pairing.size(); ++k) {
      const auto [x, y] = pairing[k];
      if (x != e && y != e) continue;
      e = x == e ? y : x;
      pairing.erase(pairing.begin() + static_cast<std::ptrdiff_t>(k));
      if (&e == end && e == b) return true;
      break;
    }
  pairing.push_back(std::minmax(end[0], end[1]));
  return false;
}

// Jones polynomial in t; empty if too many arcs are open at once. Crossing by crossing: a sum over the ways in which the arcs
// laid so far join the open ends.
Laurent jones(const GaussCode& code) {
  constexpr size_t kMaxStates = 2000;
  const uint32_t n = static_cast<uint32_t>(code.pass.size());
  if (n == 0) return {0, {1}};
  struct Ends {
    uint32_t e[4];  // arcs around the crossing, counterclockwise from the incoming under
  };
  std::vector<Ends> crossing;
  int writhe = 0;
  for (uint32_t over = 0; over < n; ++over) {
    if (!code.pass[over].over) continue;
    uint32_t under = 0;
    while (code.pass[under].crossing != code.pass[over].crossing || code.pass[under].over) ++under;
    const int sign = code.sign[code.pass[over].crossing];
    const uint32_t out = (over + 1) % n;  // arc k enters pass k
    crossing.push_back({{under, sign > 0 ? out : over, (under + 1) % n, sign > 0 ? over : out}});
    writhe += sign;
  }
  std::map<Pairing, Laurent> states{{Pairing{}, Laurent{0, {1}}}};
  std::vector<uint8_t> open(n, 0), done(crossing.size(), 0);
  for (size_t step = 0; step < crossing.size(); ++step) {
    size_t next = 0;  // the crossing most of whose arcs are open already
    int most = -1;
    for (size_t k = 0; k < crossing.size(); ++k) {
      const int count =
          done[k] ? -1 : open[crossing[k].e[0]] + open[crossing[k].e[1]] + open[crossing[k].e[2]] + open[crossing[k].e[3]];
      if (count > most) most = count, next = k;
    }
    done[next] = 1;
    const auto& e = crossing[next].e;
    for (uint32_t arc : e) open[arc] ^= 1;
    std::map<Pairing, Laurent> after;
    for (const auto& [pairing, weight] : states)
      for (const int smoothing : {1, -1}) {
        Pairing p = pairing;
        int loops = smoothing > 0 ? join(p, e[0], e[1]) + join(p, e[2], e[3]) : join(p, e[0], e[3]) + join(p, e[1], e[2]);
        Laurent w = weight;
        for (; loops > 0; --loops) {  // a loop is worth -A^2 - A^-2
          Laurent twice;
          add(twice, w, 2, -1), add(twice, w, -2, -1);
          w = std::move(twice);
        }
        std::sort(p.begin(), p.end());
        add(after[p], w, smoothing, 1);
      }
    states.swap(after);
    if (states.size() > kMaxStates) return {};
  }
  Laurent bracket = states.begin()->second;
  trim(bracket);
  const Laurent loop{-2, {uint64_t(0) - 1, 0, 0, 0, uint64_t(0) - 1}};
  if (!divide(bracket, loop)) return {};
  // Times (-A^3)^-writhe; t = A^-4.
  const int low = bracket.low - 3 * writhe, high = low + static_cast<int>(bracket.c.size()) - 1;
  Laurent v{-high / 4, {}};
  if (high % 4 != 0) return {};
  for (int k = high; k >= low; k -= 4) {
    const uint64_t c = bracket.c[static_cast<size_t>(k - low)];
    v.c.push_back(writhe % 2 != 0 ? 0 - c : c);
  }
  return v;
}

// t^w (1 + t^2 - t^3 + ... - t^(2w + 1)), or with 1/t for the left hand.
Laurent jones_of_throw(int wraps, int hand) {
  const size_t n = 2 * static_cast<size_t>(wraps) + 1;
  Laurent p{wraps, std::vector<uint64_t>(n + 1)};
  p.c[0] = 1;
  for (size_t k = 2; k <= n; ++k) p.c[k] = k % 2 ? uint64_t(0) - 1 : 1;
  if (hand < 0) std::reverse(p.c.begin(), p.c.end()), p.low = -3 * wraps - 1;
  return p;
}

}  // namespace

KnotType knot_type(std::span<const Vec3> closed) {
  constexpr uint8_t kMaxWraps = 6;
  GaussCode code = gauss_code(closed);
  reduce(code);
  Laurent v = jones(code);
  KnotType type;
  for (uint8_t wraps = kMaxWraps; wraps > 0; --wraps)
    for (const int8_t hand : {int8_t{1}, int8_t{-1}})
      for (const Laurent factor = jones_of_throw(wraps, hand); divide(v, factor);) type.factors.push_back({wraps, hand});
  type.known = v.is_one();
  return type;
}

KnotVote vote_knot(std::span<const Vec3> open, float far, bool quick) {
  // Fixed and spread over the sphere.
  constexpr Vec3 kAway[] = {{0.36f, 0.48f, 0.8f},   {-0.8f, 0.36f, 0.48f},  {0.48f, -0.8f, 0.36f}, {-0.36f, -0.48f, 0.8f},
                            {0.8f, -0.36f, -0.48f}, {-0.48f, 0.8f, -0.36f}, {0.36f, 0.48f, -0.8f}, {-0.64f, -0.6f, -0.48f}};
  std::vector<Vec3> closed(open.begin(), open.end());
  closed.resize(open.size() + 2);
  std::vector<KnotType> seen;
  KnotVote best;
  size_t most = 0;
  for (const Vec3& away : kAway) {
    closed[open.size()] = open.back() + away * far, closed[open.size() + 1] = open.front() + away * far;
    seen.push_back(knot_type(closed));
    const size_t count = static_cast<size_t>(std::count(seen.begin(), seen.end(), seen.back()));
    if (count > most) most = count, best.type = seen.back();
    if (quick && seen.size() == 3 && most == 3) break;
  }
  best.share = static_cast<float>(most) / static_cast<float>(seen.size());
  return best;
}

double mean_writhe(std::span<const Vec3> closed) {
  const Vec3 views[] = {{0.1f, 0.2f, 1}, {1, 0.15f, 0.1f}, {0.2f, 1, 0.1f}, {1, 1, 0.2f},
                        {-1, 1, 0.3f},   {1, 0.1f, 1},     {-1, 0.2f, 1}};
  double sum = 0;
  for (Vec3 view : views)
    for (const Projected& x : project(closed, view)) sum += x.sign;
  return sum / std::size(views);
}

std::vector<Vec3> close_curve(std::span<const Vec3> thread, Vec3 first_away, Vec3 last_away) {
  std::vector<Vec3> c(thread.begin(), thread.end());
  c.push_back(thread.back() + last_away);
  c.push_back(thread.back() + last_away - Vec3{0, 3, 0});
  c.push_back(thread.front() + first_away - Vec3{0, 3, 0});
  c.push_back(thread.front() + first_away);
  return c;
}

}  // namespace catgut::thread
