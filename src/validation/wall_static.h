// SPDX-License-Identifier: Apache-2.0
// validation: a static reference solution of the wall: the same elements and loads, no time, Newton's
// method in double precision with a numeric Jacobian. It shares the element's formula with the simulation. So it tests the
// step, the coupling and single precision. tests/wall/reference_test.cpp tests the element against other elements.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "wall/points.h"

namespace catgut::validation {

struct StaticLoad {
  wall::Weights at;
  Eigen::Vector3d force;  // [N]
};

// A frictionless string through points of the wall, closed to a loop, or open from one fixed end to the other.
struct StaticString {
  std::vector<wall::Weights> through;
  std::vector<Eigen::Vector3d> end{};  // none, or two
  double length = 0;                   // [m] unloaded
  double stiffness = 1e7;              // [N/m]: nearly inextensible
};

class StaticWall {
 public:
  explicit StaticWall(const wall::Wall& wall);
  // Newton's method then starts from the simulated equilibrium: of several solutions (folds) it finds that one.
  void start_from(const wall::State& state);
  // Loads grow in `steps` equal steps, strings shorten from `string_from` [m]. Returns the residual relative to the loads.
  double solve(const std::vector<StaticLoad>& load, const std::vector<StaticString>& string, double string_from, int steps);
  Eigen::Vector3d at(const wall::Weights& w) const;
  double tension(const StaticString& s) const;  // [N]
  double length(const StaticString& s) const;   // [m]

 private:
  // Pairs that a string joins: indices in `through`, or -1 and -2 for its fixed ends.
  static std::vector<std::array<long, 2>> links(const StaticString& s);
  double energy_and_force(const Eigen::VectorXd& x, Eigen::VectorXd* force, bool keep_turns);
  const wall::Wall& wall_;
  std::vector<wall::ElementRest> rest_;
  std::vector<wall::scalar::Turn<double>> turn_;
  std::vector<std::vector<uint32_t>> corner_;
  std::vector<uint8_t> held_;  // per column
  Eigen::VectorXd x_;          // 6 per column
  std::vector<StaticLoad> load_;
  std::vector<StaticString> string_;
};

}  // namespace catgut::validation
