// SPDX-License-Identifier: Apache-2.0
// sim/model: everything about a scene that is constant during a run. Written by sim/build, read by every stage.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "anatomy/body.h"
#include "sim/physical.h"
#include "sim/scene.h"
#include "sim/simulation.h"
#include "solver/substep.h"
#include "suture/suture.h"
#include "technique/technique.h"

namespace catgut {

// Elastic cord of an instrument while that is parked.
struct Cord {
  Vec3 pull;          // [N] in place of the weight, where it was parked; zero: no cord
  float stretch = 0;  // [m] along the pull from there, at which the cord is slack and the weight is back; 0: never
};

// An instrument that is parked on tissue at the start of the scene.
struct ParkedStart {
  size_t instrument = 0;
  Pose pose;
  EmbeddedPoint point;    // of tissue, at the jaws
  uint32_t particle = 0;  // nearest to the jaws
};

// A tissue particle outside all cells (the unpaired one in mid-wall), and the cell that it follows.
struct LooseParticle {
  uint32_t particle = 0, cell = 0;
};

// The scene's model as built, or the model that sim/topology derives for divided tissue (with copies of particles).
struct Model {
  SceneSpec scene;
  SolverModel solver;
  SutureModel suture;
  TechniqueModel technique;
  std::vector<uint8_t> wall;   // per tissue particle: which bowel end, or which layer, it belongs to
  std::vector<uint8_t> layer;  // per tissue particle: TissueLayer, serosa outside, mucosa inside
  std::vector<Tet> cell;       // the volume of the tissue: three cells to each prism of its wall, one prism after the other
  std::vector<LooseParticle> loose;
  std::vector<Rim> rim;          // per wall: the opening that the procedure works on
  std::vector<uint32_t> source;  // per copy, the last of the tissue particles: what it is a copy of
  std::vector<uint32_t> piece;   // per tissue particle: the smallest particle of its connected piece
  uint32_t pieces = 0;
  float dt = 1.0f / 60;  // [s] tick
  int substeps = 8;
  std::vector<Vec3> start;                                               // [m] of every particle
  std::vector<Pose> tray;                                                // per instrument: its pose on the tray
  std::vector<Cord> cord;                                                // per instrument
  std::vector<ParkedStart> parked;                                       // instruments that hold tissue at the start
  std::array<Pose, kMaxHands> hand_start;                                // before a hand connects
  std::array<int, kMaxHands> hand_instrument{};                          // held by each hand at the start; -1: none
  std::vector<Pose> needle_start;                                        // body frame, per suture
  float hand_compliance = 1.0f / 3000, hand_angular_compliance = 0.05f;  // [m/N], [rad/(N m)] coupling of tool and hand
  PictureModel picture;
  std::shared_ptr<const PhysicalModel> physical;  // null: guided mechanics
};

// The scene's technique at these rims, which are in the order of the walls.
TechniqueModel make_technique(const SceneSpec& scene, std::span<const Rim> rim);

}  // namespace catgut
