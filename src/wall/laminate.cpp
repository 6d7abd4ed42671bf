// SPDX-License-Identifier: Apache-2.0
// wall/laminate: see the header.
#include "wall/laminate.h"

#include <cmath>

#include "core/check.h"

namespace catgut::wall {

namespace {

using Matrix3 = std::array<std::array<double, 3>, 3>;

// Plane-stress stiffness of a layer in the organ's directions.
Matrix3 reduced_stiffness(const Layer& layer) {
  const double e1 = layer.e_along, e2 = layer.e_around;
  const double nu12 = layer.poisson * std::sqrt(e1 / e2), nu21 = layer.poisson * std::sqrt(e2 / e1);
  const double scale = 1 / (1 - nu12 * nu21);
  const double g = layer.shear > 0 ? layer.shear : std::sqrt(e1 * e2) / (2 * (1 + layer.poisson));
  const Matrix3 q{{{e1 * scale, nu12 * e2 * scale, 0}, {nu12 * e2 * scale, e2 * scale, 0}, {0, 0, g}}};
  const double c = portable::cos(layer.angle), s = portable::sin(layer.angle);
  // Strain of the layer from strain of the organ (engineering shear).
  const Matrix3 t{{{c * c, s * s, c * s}, {s * s, c * c, -c * s}, {-2 * c * s, 2 * c * s, c * c - s * s}}};
  Matrix3 out{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) out[i][j] += t[k][i] * q[k][l] * t[l][j];
  return out;
}

void check(const Layer& layer, const std::string& where) {
  const auto fail = [&](const std::string& what, const std::string& next) {
    throw InputError(where + ", layer " + layer.name, what, next);
  };
  const auto modulus = [](float e) { return std::isfinite(e) && e >= 100 && e <= 1e9f; };
  if (!std::isfinite(layer.thickness) || layer.thickness < 1e-5f || layer.thickness > 0.05f)
    fail("a thickness of " + std::to_string(layer.thickness) + " m", "give 0.00001 to 0.05");
  if (!modulus(layer.e_along) || !modulus(layer.e_around))
    fail("a modulus outside 100 Pa to 1 GPa", "give pascals, e.g. 600000");
  const float ratio = layer.e_along / layer.e_around;
  if (ratio > 100 || ratio < 0.01f) fail("moduli that differ by more than 100 times", "give moduli closer to each other");
  if (!(layer.poisson >= 0 && layer.poisson < 0.5f)) fail("a Poisson's ratio outside 0 to 0.5", "give e.g. 0.45");
  if (layer.shear != 0 && !modulus(layer.shear)) fail("a shear modulus outside 100 Pa to 1 GPa", "give pascals, or 0");
  if (!std::isfinite(layer.angle)) fail("an angle that is not a number", "give radians");
  for (int k = 0; k < 2; ++k) {
    const float stiff = k == 0 ? layer.stiff_along : layer.stiff_around, toe = k == 0 ? layer.e_along : layer.e_around;
    const float knee = k == 0 ? layer.knee_along : layer.knee_around;
    if (stiff == 0) continue;
    if (!modulus(stiff) || stiff < toe) fail("a stiff modulus below the toe modulus", "give pascals above it, or 0 for none");
    if (!(knee >= 0 && knee <= 2)) fail("a knee outside a strain of 0 to 2", "give e.g. 0.3");
  }
}

}  // namespace

Laminate laminate(std::span<const Layer> layer, const std::string& where) {
  if (layer.empty()) throw InputError(where, "a wall without layers", "give at least one layer");
  Laminate out;
  double total = 0;
  for (const Layer& l : layer) check(l, where), total += l.thickness;
  out.thickness = static_cast<float>(total);
  double z = -0.5 * total, compliance1 = 0, compliance2 = 0, e_mean = 0;
  for (const Layer& l : layer) {
    const double top = z + l.thickness;
    const Matrix3 q = reduced_stiffness(l);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        out.a[i][j] += q[i][j] * (top - z);
        out.b[i][j] += q[i][j] * (top * top - z * z) / 2;
        out.d[i][j] += q[i][j] * (top * top * top - z * z * z) / 3;
      }
    // Transverse: layers in series under one shear stress.
    const double g1 = l.e_along / (2 * (1 + l.poisson)), g2 = l.e_around / (2 * (1 + l.poisson));
    const double c = portable::cos(l.angle), s = portable::sin(l.angle);
    compliance1 += l.thickness / (c * c * g1 + s * s * g2);
    compliance2 += l.thickness / (s * s * g1 + c * c * g2);
    const double nu = l.poisson / (1 - l.poisson);
    for (double& k : out.contraction) k += nu * l.thickness / total;
    e_mean += std::sqrt(static_cast<double>(l.e_along) * l.e_around) * l.thickness / total;
    // Fibers of the stiff branch run along and around only.
    const float stiff[2] = {l.stiff_along, l.stiff_around}, toe[2] = {l.e_along, l.e_around};
    const float knee[2] = {l.knee_along, l.knee_around};
    for (int k = 0; k < 2; ++k)
      if (stiff[k] > 0) {
        const double added = (stiff[k] - toe[k]) * static_cast<double>(l.thickness);
        out.knee[k] = (out.knee[k] * out.stiff[k] + knee[k] * added) / (out.stiff[k] + added + 1e-30);
        out.stiff[k] += added;
      }
    z = top;
  }
  out.shear = {5.0 / 6 * total * total / compliance1, 5.0 / 6 * total * total / compliance2};
  out.thick = 0.5 * e_mean * total;
  return out;
}

std::vector<Layer> bowel_layers(float thickness, float e_along, float e_around, float poisson) {
  // Share of the thickness and stiffness relative to the mean: mucosa, submucosa, muscle, serosa.
  const struct {
    const char* name;
    float thickness, stiffness;
  } part[] = {{"mucosa", 0.30f, 0.25f}, {"submucosa", 0.20f, 2.00f}, {"muscle", 0.45f, 1.00f}, {"serosa", 0.05f, 1.50f}};
  float mean = 0;
  for (const auto& p : part) mean += p.thickness * p.stiffness;
  std::vector<Layer> layer;
  for (const auto& p : part) {
    Layer l;
    l.name = p.name;
    l.thickness = thickness * p.thickness;
    l.e_along = e_along * p.stiffness / mean;
    l.e_around = e_around * p.stiffness / mean;
    l.poisson = poisson;
    layer.push_back(l);
  }
  return layer;
}

}  // namespace catgut::wall
