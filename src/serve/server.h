// SPDX-License-Identifier: Apache-2.0
// serve: the educator's page over HTTP (cpp-httplib): overview, reports, surveys, assignments, exports. Reads and writes the
// store only.
//
// Who may see what. While the store has no login, only this machine can connect, and its user sees everything: that
// person could read the file as well. As soon as one login exists, everybody signs in: trainees see their own sessions,
// educators and staff see all. Listening beyond this machine needs a login, and TLS here or in a proxy.
#pragma once
#include <memory>
#include <string>

#include "store/store.h"

namespace catgut {

struct ServeOptions {
  StoreOptions store;
  std::string host = "127.0.0.1";
  int port = 8470;                              // 0: any free one
  std::string certificate, key;                 // PEM files: TLS
  bool behind_proxy = false;                    // a proxy on this machine or a trusted network adds TLS
  std::string home = "https://catgut.invalid";  // as sessions_to_xapi
};

class PageServer {
 public:
  // Binds and answers from threads of its own until destruction. Throws InputError (port in use, no login, no TLS).
  explicit PageServer(const ServeOptions& options);
  ~PageServer();
  std::string url() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

bool is_loopback(const std::string& host);
// Argon2id, by libsodium. Throws InputError for fewer than 8 characters.
std::string hash_password(const std::string& password);
bool password_matches(const std::string& hash, const std::string& password);

}  // namespace catgut
