// SPDX-License-Identifier: Apache-2.0
// app: `catgut validate`: compares the solver with closed forms and published numbers.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.h"
#include "core/file.h"
#include "validation/validation.h"

namespace catgut {
namespace {

std::string json_of(const std::vector<ValidationLine>& lines) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const ValidationLine& l : lines)
    all.push_back({{"name", l.name},
                   {"expected", l.expected},
                   {"got", l.got},
                   {"error", l.error},
                   {"tolerance", l.tolerance},
                   {"unit", l.unit},
                   {"source", l.source},
                   {"ok", l.ok}});
  return all.dump(2) + "\n";
}

void print_line(const ValidationLine& l, bool with_heading) {
  if (with_heading)
    std::printf("%-4s  %-46s %11s %11s  %-9s %9s %9s  %s\n", "", "check", "expected", "got", "unit", "error", "tolerance",
                "source");
  std::printf("%-4s  %-46s %11.5g %11.5g  %-9s %9.2g %9.2g  %s\n", l.ok ? "ok" : "FAIL", l.name.c_str(), l.expected, l.got,
              l.unit == "1" ? "" : l.unit.c_str(), l.error, l.tolerance, l.source.c_str());
  std::fflush(stdout);
}

int validate(const std::string& json, bool nightly, const std::string& only) {
  check_suffix(json, ".json", "--json");
  prepare_output(json);
  const bool table = json != "-";
  size_t shown = 0;
  const auto show = [&](const ValidationLine& l) {
    if (table) print_line(l, shown++ == 0);
  };
  const std::vector<ValidationLine> lines = run_validation(show, nightly, only);
  if (!json.empty()) write_output(json, json_of(lines));
  size_t failed = 0;
  for (const ValidationLine& l : lines) failed += !l.ok;
  if (table) std::printf("%zu of %zu checks hold\n", lines.size() - failed, lines.size());
  return failed == 0 ? 0 : 1;
}

}  // namespace

void add_validate(CLI::App& app, int& exit_code) {
  auto json = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("validate", "check the physics against closed forms and published numbers");
  command->add_option("--json", *json, "the same lines as JSON; - for standard output")->type_name("FILE|-");
  auto nightly = std::make_shared<bool>(false);
  command->add_flag("--nightly", *nightly, "whole ranges of the checks that are shortened otherwise; many minutes");
  auto only = std::make_shared<std::string>();
  command->add_option("--only", *only, "the groups of checks whose names begin so, e.g. closure, knot/ties, wall")
      ->type_name("GROUP");
  command->callback([json, nightly, only, &exit_code] { exit_code = validate(*json, *nightly, *only); });
}

}  // namespace catgut
