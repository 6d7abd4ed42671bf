// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: a workload in Bullet's soft bodies.
#pragma once
#include <memory>

#include "workload.h"

namespace catgut {

enum class BulletWay {
  clusters,        // shape matching with one cluster per particle: itself and its neighbors
  fewer_clusters,  // the same without clusters with equal members, which Catgut merges too
  links            // links along the edges, and contact of vertices with faces between soft bodies
};

extern const bool kBulletIsSingle;  // precision of the linked library

class BulletSide {
 public:
  BulletSide(const Workload& work, BulletWay way);
  ~BulletSide();
  void tick(float time);   // 1/60 s, which ends at `time` [s]
  void put_back_pinned();  // its clusters displace pinned particles slightly
  // Of tissue that is not pinned: mean distance from its start [m]; NaN if any is.
  double carried_off() const;
  size_t contacts() const;  // in the last substep

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace catgut
