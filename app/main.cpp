// SPDX-License-Identifier: Apache-2.0
// app: the program `catgut`. Reads the command line, runs one command, and turns every error into one line on standard error.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "commands/commands.h"
#include "core/check.h"
#include "procedure/scene_fields.h"

namespace {

int report(std::string what) {
  catgut::end_progress_line();
  std::replace(what.begin(), what.end(), '\n', ' ');
  std::fprintf(stderr, "catgut: %s\n", what.c_str());
  return 2;
}

// For tests of command lines in the documentation: ends after everything is parsed, before a command is carried out.
void parse_only(CLI::App& app) {
  app.parse_complete_callback([] { throw CLI::Success(); });
}

// CLI11 only reports that an argument was not expected; the most similar command or option is more helpful.
std::string parse_fault(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  std::vector<std::string> commands;
  const CLI::App* used = &app;
  int depth = 1;  // of the word that would be the next command
  for (std::vector<CLI::App*> given = app.get_subcommands(); !given.empty(); given = given.back()->get_subcommands(), ++depth)
    used = given.back();
  for (const CLI::App* c : used->get_subcommands([](const CLI::App*) { return true; })) commands.push_back(c->get_name());
  std::string nearest;
  if (!commands.empty() && argc > depth && argv[depth][0] != '-' &&
      std::find(commands.begin(), commands.end(), argv[depth]) == commands.end()) {
    nearest = catgut::nearest_word(argv[depth], commands);
    const std::string help = used == &app ? "catgut --help" : "catgut " + used->get_name() + " --help";
    return (used == &app ? "no command \"" : used->get_name() + " has no command \"") + std::string(argv[depth]) + "\"; " +
           (nearest.empty() ? help + " lists them" : "did you mean \"" + nearest + "\"?");
  }
  std::vector<std::string> options;
  for (const CLI::Option* o : used->get_options())
    for (const std::string& name : o->get_lnames()) options.push_back("--" + name);
  for (int i = 1; i < argc; ++i) {
    const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
    if (word.rfind("--", 0) != 0 || std::find(options.begin(), options.end(), word) != options.end()) continue;
    nearest = catgut::nearest_word(word, options);
    return "no option " + word + "; " + (nearest.empty() ? "catgut --help lists them" : "did you mean " + nearest + "?");
  }
  return std::string(error.what()) + "; see catgut --help";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Catgut: a real-time simulator of open-surgery suturing", "catgut");
  app.set_version_flag("--version", std::string("catgut ") + catgut::catgut_version());
  app.require_subcommand(0, 1);
  app.footer("Exit codes: 0 done, 1 the expectation or check failed, 2 bad input, 130 interrupted.");
  int exit_code = 0;
  catgut::add_play(app, exit_code);
  catgut::add_view(app, exit_code);
  catgut::add_run(app, exit_code);
  catgut::add_replay(app, exit_code);
  catgut::add_assess(app, exit_code);
  catgut::add_study(app, exit_code);
  catgut::add_bench(app, exit_code);
  catgut::add_validate(app, exit_code);
  catgut::add_devices(app, exit_code);
  catgut::add_bridge(app, exit_code);
  catgut::add_describe(app, exit_code);
#ifdef CATGUT_WITH_STORE
  catgut::add_records(app, exit_code);
  catgut::add_serve(app, exit_code);
#endif
  try {
    if (argc == 1) return catgut::play_without_arguments();
    if (std::string(argv[1]) == "--parse-only") parse_only(app), --argc, ++argv;
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {  // --help, --version
    return app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    return report("command line: " + parse_fault(app, error, argc, argv));
  } catch (const std::exception& error) { return report(error.what()); }
  return exit_code;
}
