// SPDX-License-Identifier: Apache-2.0
// render/pucker: see pucker.h.
#include "render/pucker.h"

#include <algorithm>
#include <cmath>

namespace catgut {

RoundOrgan round_organ(const VisibleMesh& mesh) {
  RoundOrgan out;
  const size_t n = mesh.position.size();
  if (mesh.uv.size() != n || mesh.layer.size() != n || mesh.normal.size() != n) return out;
  float low = 1e30f, high = -1e30f;
  for (const auto& c : mesh.uv) low = std::min(low, c[1]), high = std::max(high, c[1]);
  const float whole = high - low;
  if (!(whole > 0)) return out;
  out.next.assign(n, RoundOrgan::kNone), out.step.assign(n, 0), out.angle.assign(n, 0);
  for (size_t v = 0; v < n; ++v) out.angle[v] = (mesh.uv[v][1] - low) / whole;
  std::vector<float> best(n, 0.8f);  // an edge must run mostly round the organ
  for (const auto& t : mesh.triangle)
    for (size_t k = 0; k < 3; ++k)
      for (const size_t other : {(k + 1) % 3, (k + 2) % 3}) {
        const uint32_t a = t[k], b = t[other];
        const float dv = mesh.uv[b][1] - mesh.uv[a][1], du = mesh.uv[b][0] - mesh.uv[a][0];
        if (dv <= 0 || dv > 0.5f * whole) continue;
        const float straight = dv / std::hypot(dv, du);
        if (straight <= best[a]) continue;
        best[a] = straight, out.next[a] = b, out.step[a] = distance(mesh.position[a], mesh.position[b]);
      }
  // Length round the organ: mean of step per angle over the outside.
  double sum = 0;
  size_t count = 0;
  for (size_t v = 0; v < n; ++v) {
    if (out.next[v] == RoundOrgan::kNone || mesh.layer[v] != TissueLayer::serosa) continue;
    const float turn = out.angle[out.next[v]] - out.angle[v];
    if (turn > 1e-6f) sum += double(out.step[v] / turn), ++count;
  }
  out.length = count ? float(sum / double(count)) : 0;
  out.outward.resize(n);
  std::vector<uint32_t> outside;
  for (uint32_t v = 0; v < uint32_t(n); ++v)
    if (mesh.layer[v] == TissueLayer::serosa) outside.push_back(v);
  for (size_t v = 0; v < n; ++v) {
    out.outward[v] = mesh.layer[v] == TissueLayer::mucosa ? -mesh.normal[v] : mesh.normal[v];
    if (mesh.layer[v] != TissueLayer::cut_edge) continue;
    float least = 1e30f;
    for (const uint32_t w : outside)
      if (const float d = length2(mesh.position[w] - mesh.position[v]); d < least) least = d, out.outward[v] = mesh.normal[w];
  }
  return out;
}

Fold fold_at(std::span<const Gather> gather, float angle, float ratio, float round) {
  constexpr float deepest = 0.0016f, part = 0.75f;  // [m]; share of the missing length that the fold takes up
  if (!(ratio < 0.97f) || !(ratio > 0.02f)) return {};
  for (const Gather& g : gather) {
    float at = angle;
    if (at < g.from) at += 1;
    if (at < g.from || at > g.to || g.to - g.from < 1e-4f) continue;
    const float s = (at - g.from) / (g.to - g.from),
                width = ratio * (g.to - g.from) * round;  // [m] of half a wave, as it is now
    // A sine of half wavelength w and amplitude a is longer than w by the factor 1 + (pi a / w)^2 / 4.
    const float a = std::min(deepest, part * 2 * width / kPi * std::sqrt(1 / ratio - 1)), sign = g.in_wall ? 1.0f : -1.0f;
    return {sign * a * std::sin(kPi * s), sign * a * kPi / width * std::cos(kPi * s)};
  }
  return {};
}

}  // namespace catgut
