// SPDX-License-Identifier: Apache-2.0
// anatomy/organ: makes a soft body at rest from the surface of an organ in a mesh file.
#pragma once
#include <string>

#include "anatomy/body.h"

namespace catgut {

struct OrganImport {
  std::string name = "organ";
  std::string mesh;              // path[#node] of a .glb, .gltf, .obj or .stl in meters
  int particles = 1228;          // exact; odd counts get one particle at mid-wall
  float wall = 0.0025f;          // [m] thickness, built inward from the file's surface
  int rim = -1;                  // working opening: 0 the longest, 1 the next ...; -1 the longest
  Vec3 position;                 // [m] target position of that rim's center (no opening: of the surface's center)
  Vec3 axis{0, 1, 0};            // direction that the rim faces (no opening: unused, the file's orientation is kept)
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.008f;  // [m] fixed length, see below; 0: none
};

// The surface (geometry/mesh_io) is moved into place, brought to particles / 2 evenly spaced vertices (geometry/remesh) and
// thickened inward (anatomy/wall). rim[0] is the chosen opening, the others follow. A closed surface has none. Particles run
// outward in rings from rim[0], outer and inner side alternating. Fixed: everything within pinned_length of any other opening.
// With one opening, what is farthest from it along the surface; with none, the lowest part.
// visible: about 20,000 vertices (up to some 2500 particles a side; more beyond), smooth through the particles.
// Throws InputError for parameters out of range, everything read_mesh and remesh refuse, and a wall too thick for the surface.
BodyRest import_organ(const OrganImport& import);

}  // namespace catgut
