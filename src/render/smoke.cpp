// SPDX-License-Identifier: Apache-2.0
// render/smoke: see smoke.h.
#include "render/smoke.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace catgut {
namespace {

constexpr double kEvery = 0.045, kLife = 1.5;        // [s] between puffs, and of each
constexpr float kRise = 0.032f;                      // [m/s] at first; it slows
constexpr float kDrift = 0.006f;                     // [m/s] sideways, at most
constexpr float kSmall = 0.0012f, kGrowth = 0.006f;  // [m], [m/s] of the radius
constexpr float kThick = 0.26f;                      // largest alpha

// -1 .. 1, the same for the same puff in every picture.
float chance(uint64_t puff, uint32_t which) {
  uint64_t h = (puff * 4 + which) * 0x9E3779B97F4A7C15ull;
  h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9ull;
  return static_cast<float>(h >> 40) / static_cast<float>(1u << 23) - 1;
}

}  // namespace

void smoke_of(const Snapshot& seen, std::vector<Puff>& out) {
  out.clear();
  for (const InstrumentView& pen : seen.instrument) {
    if (pen.pen == PenMode::off || pen.burning <= 0) continue;
    const double oldest = std::max(0.0, seen.time_s - std::min(kLife, static_cast<double>(pen.burning)));
    for (auto k = static_cast<uint64_t>(std::ceil(oldest / kEvery)); out.size() < kMostPuffs; ++k) {
      const double age_s = seen.time_s - static_cast<double>(k) * kEvery;
      if (age_s < 0) break;
      const float age = static_cast<float>(age_s), part = age / static_cast<float>(kLife);
      const float up = kRise * age * (1 - 0.3f * part), aside = kDrift * age;
      const Vec3 off{aside * chance(k, 0) + 0.25f * up, up * (1 + 0.2f * chance(k, 1)), aside * chance(k, 2)};
      const float fresh = std::min(1.0f, age / 0.12f), left = 1 - part;
      out.push_back({pen.pose.p + Vec3{0, 0.0008f, 0} + off, kSmall + kGrowth * age, kThick * fresh * left * left});
    }
  }
}

}  // namespace catgut
