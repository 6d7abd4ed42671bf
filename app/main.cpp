// app: the program `catgut`. Reads the command line, runs one command, and turns every fault into one line on standard error.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "commands/commands.h"
#include "core/check.h"

namespace {

int report(std::string what) {
  catgut::end_progress_line();
  std::replace(what.begin(), what.end(), '\n', ' ');
  std::fprintf(stderr, "catgut: %s\n", what.c_str());
  return 2;
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
  catgut::add_bench(app, exit_code);
  catgut::add_validate(app, exit_code);
  catgut::add_devices(app, exit_code);
  catgut::add_bridge(app, exit_code);
  catgut::add_describe(app, exit_code);
  try {
    if (argc == 1) return catgut::play_without_arguments();
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {  // --help, --version
    return app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    return report(std::string("command line: ") + error.what() + "; catgut --help explains");
  } catch (const std::exception& error) { return report(error.what()); }
  return exit_code;
}
