// SPDX-License-Identifier: Apache-2.0
// serve: who is signed in. Cookies hold random tokens; the server keeps what they stand for in memory, so a restart signs
// everybody out.
#pragma once
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "store/store.h"

namespace catgut {

struct Visitor {
  std::string name;  // pseudonym; empty: the store has no logins
  Role role = Role::staff;
  std::string token;  // of forms, against requests from other sites
  bool sees_all() const { return role != Role::trainee; }
};

std::string random_token();                                  // 256 bits, as text
bool same_text(const std::string& a, const std::string& b);  // in a time that does not depend on where they differ

class Visitors {
 public:
  using Clock = std::chrono::steady_clock;
  // Returns the cookie. They end after twelve hours.
  std::string enter(const std::string& name, Role role, Clock::time_point now);
  std::optional<Visitor> find(const std::string& cookie, Clock::time_point now);
  void leave(const std::string& cookie);
  // After five failures a name waits 30 s. Returns false while it waits.
  bool may_try(const std::string& name, Clock::time_point now);
  void failed(const std::string& name, Clock::time_point now);
  void succeeded(const std::string& name);

 private:
  struct Entry {
    Visitor visitor;
    Clock::time_point until;
  };
  struct Failures {
    int count = 0;
    Clock::time_point wait_until;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entry_;
  std::map<std::string, Failures> failure_;
};

}  // namespace catgut
