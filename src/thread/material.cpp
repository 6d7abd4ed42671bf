// SPDX-License-Identifier: Apache-2.0
// thread/material: the table and the formulas that fill it.
//
// Diameters: middle of the range of USP <861> (4-0 0.150-0.199, 3-0 0.200-0.249, 2-0 0.300-0.339, 0 0.350-0.399 mm).
// Knot-pull strength: minimum averages of USP <861>: absorbable synthetic 9.3 / 17.4 / 26.3 / 38.2 N and nonabsorbable class I
// 5.9 / 9.4 / 14.1 / 21.2 N for 4-0 / 3-0 / 2-0 / 0.
// Straight strength: knot-pull strength divided by the knot efficiency of Kim et al. 2007 (J Mater Sci Mater Med 18:2363):
// about 0.85. Tensile modulus: silk 8.70 GPa, polyglactin 9.32 GPa (Naleway et al. 2015, 10.1002/jbm.b.33171); polypropylene 2
// GPa, polydioxanone 1 GPa: ESTIMATES from supplier data. Bending: a monofilament is a solid rod, B = E pi d^4 / 64. A braid
// bends like its loose fibres: 1 % of the solid value, as measured on a polyethylene braid (data beside Johanns et al.
// 2023, 10.1126/sciadv.adg8861): ESTIMATE for silk and polyglactin. Sharpest bend that springs back: a radius of four
// diameters, an ESTIMATE for all; docs/thread.md says what it is judged by. Friction: braids hold more than monofilaments,
// coating lowers it, and it falls with tension (Surg Gynecol Obstet 1985;161:12 gives the order). The values are ESTIMATES in
// the range 0.15-0.3 of capstan rigs (Zhang et al. 2017, 10.1007/s40544-017-0140-3) and nitinol knots (0.119; Jawed et al.
// 2015, 10.1103/PhysRevLett.115.118302), taken at a load of 0.3 N: an ESTIMATE. Polypropylene has the value at which five
// throws of an elastic thread hold and four slide; monofilaments need about six. docs/thread.md says at which friction each
// knot locks here.
#include "thread/material.h"

#include <array>

namespace catgut::thread {
namespace {

constexpr float kPi = 3.14159265f;
constexpr std::array<float, 4> kDiameter{0.175e-3f, 0.225e-3f, 0.32e-3f, 0.375e-3f};
constexpr std::array<float, 4> kAbsorbable{9.3f, 17.4f, 26.3f, 38.2f}, kNonabsorbable{5.9f, 9.4f, 14.1f, 21.2f};
constexpr float kKnotEfficiency = 0.85f, kBraidBending = 0.01f;
constexpr float kElasticRadius = 4;    // diameters
constexpr float kFrictionLoad = 0.3f;  // [N]

struct Family {
  Material material;
  std::array<std::string_view, 4> name;
  float modulus;  // [Pa]
  float density;  // [kg/m3]
  float friction;
  bool braided, absorbable;
};
constexpr std::array<Family, 4> kFamily{{
    {Material::silk, {"silk 4-0", "silk 3-0", "silk 2-0", "silk 0"}, 8.70e9f, 1330, 0.30f, true, false},
    {Material::polyglactin_910,
     {"polyglactin 4-0", "polyglactin 3-0", "polyglactin 2-0", "polyglactin 0"},
     9.32e9f,
     1600,
     0.25f,
     true,
     true},
    {Material::polydioxanone,
     {"polydioxanone 4-0", "polydioxanone 3-0", "polydioxanone 2-0", "polydioxanone 0"},
     1.0e9f,
     1300,
     0.20f,
     false,
     true},
    {Material::polypropylene,
     {"polypropylene 4-0", "polypropylene 3-0", "polypropylene 2-0", "polypropylene 0"},
     2.0e9f,
     910,
     0.20f,
     false,
     false},
}};

constexpr std::array<Properties, 16> make_table() {
  std::array<Properties, 16> table{};
  for (size_t f = 0; f < 4; ++f)
    for (size_t s = 0; s < 4; ++s) {
      const Family& family = kFamily[f];
      const float d = kDiameter[s], area = kPi * d * d / 4;
      Properties& p = table[4 * f + s];
      p.material = family.material;
      p.size = static_cast<Size>(s);
      p.name = family.name[s];
      p.diameter = d;
      p.line_density = family.density * area;
      p.axial_stiffness = family.modulus * area;
      p.bending_stiffness = family.modulus * kPi * d * d * d * d / 64 * (family.braided ? kBraidBending : 1.0f);
      p.elastic_curvature = 1 / (kElasticRadius * d);
      p.friction = family.friction;
      p.friction_load = kFrictionLoad;
      p.knot_strength = (family.absorbable ? kAbsorbable : kNonabsorbable)[s];
      p.straight_strength = p.knot_strength / kKnotEfficiency;
      p.braided = family.braided;
    }
  return table;
}
constexpr std::array<Properties, 16> kTable = make_table();

}  // namespace

std::span<const Properties> materials() { return kTable; }

const Properties& properties(Material material, Size size) {
  return kTable[4 * static_cast<size_t>(material) + static_cast<size_t>(size)];
}

const Properties* find_material(std::string_view name) {
  for (const Properties& p : kTable)
    if (p.name == name || (p.size == Size::usp_3_0 && p.name.substr(0, p.name.find(' ')) == name)) return &p;
  return nullptr;
}

}  // namespace catgut::thread
