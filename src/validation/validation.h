// SPDX-License-Identifier: Apache-2.0
// validation: compares the solver with mechanics: closed forms, published numbers and invariances. Every line
// runs the kernels of the simulation itself and can fail; `catgut validate` prints them, tests/validation asserts them.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace catgut {

struct ValidationLine {
  std::string name;
  double expected = 0, got = 0;
  double error = 0;      // relative if the expected value is not 0, else absolute
  double tolerance = 0;  // of the error
  std::string unit;      // of expected and got
  std::string source;    // of the expected value
  bool ok = false;
};

// Runs every check, half a minute in all; nightly: the whole ranges of the long ones, many minutes. only: the groups whose
// names begin with it, such as "closure" or "knot/ties"; InputError when there is none. Calls on_line with each line when it is
// available.
std::vector<ValidationLine> run_validation(const std::function<void(const ValidationLine&)>& on_line = {}, bool nightly = false,
                                           const std::string& only = {});

}  // namespace catgut
