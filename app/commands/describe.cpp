// SPDX-License-Identifier: Apache-2.0
// app: `catgut describe [KEY]`: the manual of scene files.
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "procedure/measures.h"
#include "procedure/scene_reference.h"

namespace catgut {

void add_describe(CLI::App& app, int& exit_code) {
  struct Options {
    std::string key;
    bool markdown = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("describe", "explain the keys of scene files");
  command->add_option("key", o->key, "a key or a section, or procedure; all when left out")->type_name("KEY");
  command->add_flag("--markdown", o->markdown, "the whole reference page (docs/scene_reference.md)");
  command->callback([o, &exit_code] {
    write_output("-", o->markdown ? reference_markdown() : o->key == "procedure" ? measures_text() : describe(o->key));
    exit_code = 0;
  });
}

}  // namespace catgut
