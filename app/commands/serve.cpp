// SPDX-License-Identifier: Apache-2.0
// app: `catgut serve`: the educator's page; and `catgut store login`, the passwords for it.
#include "serve/server.h"

#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <thread>

#include "commands/commands.h"
#include "core/check.h"

namespace catgut {
namespace {

int serve(const ServeOptions& o) {
  const std::atomic<bool>& stop = stop_on_interrupt();
  const PageServer server(o);
  std::printf("educator's page: %s   (Ctrl-C ends)\n", server.url().c_str());
  std::fflush(stdout);
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return 0;
}

// From the terminal without echo, or the first line of standard input.
std::string read_password() {
  termios old{};
  const bool terminal = isatty(STDIN_FILENO) && tcgetattr(STDIN_FILENO, &old) == 0;
  if (terminal) {
    termios silent = old;
    silent.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    std::fprintf(stderr, "password: ");
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &silent);
  }
  std::string line;
  std::getline(std::cin, line);
  if (terminal) {
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &old);
    std::fputc('\n', stderr);
  }
  return line;
}

}  // namespace

void add_serve(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<ServeOptions>();
  CLI::App* command = app.add_subcommand("serve", "the educator's page in a browser");
  command->add_option("--port", o->port, "0: any free one")->check(CLI::Range(0, 65535))->capture_default_str();
  command->add_option("--listen", o->host, "address; beyond this machine only with logins and TLS")
      ->type_name("ADDRESS")
      ->capture_default_str();
  command->add_option("--tls-cert", o->certificate, "certificate")->type_name("FILE.pem");
  command->add_option("--tls-key", o->key, "its private key")->type_name("FILE.pem");
  command->add_flag("--behind-tls-proxy", o->behind_proxy, "a proxy in front of this program adds TLS");
  command->add_option("--home", o->home, "IRI of your institution in xAPI exports")->type_name("IRI");
  command->add_option("--store", o->store.where, "as in catgut store")->type_name("FILE|URL");
  command->callback([o, &exit_code] { exit_code = serve(*o); });

  struct Login {
    std::string name, store;
    bool remove = false;
  };
  auto l = std::make_shared<Login>();
  CLI::App* login = app.get_subcommand("store")->add_subcommand(
      "login", "set the password of a person for the page; from then on everybody signs in");
  login->add_option("name", l->name, "pseudonym")->required();
  login->add_flag("--remove", l->remove, "remove the login");
  login->add_option("--store", l->store, "as in catgut store")->type_name("FILE|URL");
  login->callback([l, &exit_code] {
    StoreOptions options;
    options.where = l->store;
    Store store(options);
    const Person p = store.person(l->name);
    store.put_login(l->name, l->remove ? "" : hash_password(read_password()));
    store.log("command line", l->remove ? "no login" : "login", l->name);
    std::printf("%s (%s) %s\n", p.pseudonym.c_str(), role_name(p.role), l->remove ? "has no login" : "can sign in");
    exit_code = 0;
  });
}

}  // namespace catgut
