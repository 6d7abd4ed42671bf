// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: a workload in Bullet's soft bodies.
#pragma once
#include <memory>

#include "workload.h"

namespace catgut {

enum class BulletWay {
  clusters,        // shape matching of one cluster a particle: itself and its neighbors
  fewer_clusters,  // the same without clusters that have the same members as another, which Catgut leaves out too
  links            // links along the edges, and contact of vertices with faces between soft bodies
};

extern const bool kBulletIsSingle;  // precision of the library that was linked

class BulletSide {
 public:
  BulletSide(const Workload& work, BulletWay way);
  ~BulletSide();
  void tick(float time);   // 1/60 s, which ends at `time` [s]
  void put_back_pinned();  // its clusters carry pinned particles a little with them
  // Of the tissue that is not pinned: how far it is from where it began [m], on average; NaN once something is.
  double carried_off() const;
  size_t contacts() const;  // in the last substep

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace catgut
