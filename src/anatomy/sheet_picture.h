// SPDX-License-Identifier: Apache-2.0
// anatomy/sheet_picture: the visible mesh of a body that was thickened from a triangle sheet.
#pragma once
#include <span>

#include "anatomy/body.h"
#include "geometry/mesh.h"

namespace catgut {

// Outside, inside and rounded rim edges, smooth and through the particles. Sheet vertex v is particles 2 v and 2 v + 1. About
// 20,000 vertices where the sheet allows. along: [m] distance of each sheet vertex from the start of the organ. The texture
// runs along it and round the organ's center line. Bound to body.position.
VisibleMesh sheet_picture(const TriangleMesh& sheet, const BodyRest& body, std::span<const float> along);

}  // namespace catgut
