// haptic/passivity: see the header.
#include "haptic/passivity.h"

namespace catgut {

Vec3 keep_passive(Passivity& p, Vec3 x, Vec3 v, Vec3 force, float most, float dt, const PassivityOptions& o) {
  if (p.any) {
    const double given = double{dot(p.force, x - p.last)};
    p.energy += given;
    p.total += given;
  }
  p.most = std::max(p.most, p.energy);
  p.last = x;
  p.braking = false;

  Vec3 out = force;
  const double speed2 = double{length2(v)};
  if (p.energy > o.allowance && speed2 > 1e-8) {
    const double alpha = std::min((p.energy - o.allowance) / (speed2 * double{dt}), double{o.damping});
    out -= v * static_cast<float>(alpha);
    p.braking = true;
  }
  if (length(out) > most) out *= most / length(out);
  const Vec3 change = out - p.force;
  const float step = o.slew * std::min(dt, o.slew_time);
  if (length(change) > step) out = p.force + change * (step / length(change));

  p.quiet = length(out) < o.small_force ? p.quiet + dt : 0;
  if (p.quiet > o.quiet_time) p.energy = 0;
  p.force = out;
  p.any = true;
  return out;
}

}  // namespace catgut
