// SPDX-License-Identifier: Apache-2.0
// serve: passwords and who is signed in; see login.h.
#include "serve/login.h"

#include <sodium.h>

#include "core/check.h"
#include "serve/server.h"

namespace catgut {
namespace {

void start_sodium() {
  if (sodium_init() < 0) throw InputError("libsodium", "cannot start", "reinstall it");
}

}  // namespace

std::string hash_password(const std::string& password) {
  start_sodium();
  if (password.size() < 8) throw InputError("password", "has fewer than 8 characters", "choose a longer one");
  if (password.size() > 1024) throw InputError("password", "has more than 1024 bytes", "choose a shorter one");
  char hash[crypto_pwhash_STRBYTES];
  if (crypto_pwhash_str(hash, password.data(), password.size(), crypto_pwhash_OPSLIMIT_INTERACTIVE,
                        crypto_pwhash_MEMLIMIT_INTERACTIVE) != 0)
    throw InputError("password", "cannot be hashed: 64 MB of memory are needed", "free some memory");
  return hash;
}

bool password_matches(const std::string& hash, const std::string& password) {
  start_sodium();
  return hash.size() < crypto_pwhash_STRBYTES && password.size() <= 1024 &&
         crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
}

std::string random_token() {
  start_sodium();
  unsigned char bytes[32];
  randombytes_buf(bytes, sizeof bytes);
  char text[2 * sizeof bytes + 1];
  return sodium_bin2hex(text, sizeof text, bytes, sizeof bytes);
}

bool same_text(const std::string& a, const std::string& b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string Visitors::enter(const std::string& name, Role role, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::erase_if(entry_, [&](const auto& e) { return e.second.until < now; });
  const std::string cookie = random_token();
  entry_[cookie] = {{name, role, random_token()}, now + std::chrono::hours(12)};
  return cookie;
}

std::optional<Visitor> Visitors::find(const std::string& cookie, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = entry_.find(cookie);
  if (found == entry_.end() || found->second.until < now) return std::nullopt;
  return found->second.visitor;
}

void Visitors::leave(const std::string& cookie) {
  const std::lock_guard lock(mutex_);
  entry_.erase(cookie);
}

bool Visitors::may_try(const std::string& name, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = failure_.find(name);
  return found == failure_.end() || found->second.wait_until <= now;
}

void Visitors::failed(const std::string& name, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (failure_.size() > 10000) failure_.clear();
  Failures& f = failure_[name];
  if (++f.count >= 5) f.wait_until = now + std::chrono::seconds(30);
}

void Visitors::succeeded(const std::string& name) {
  const std::lock_guard lock(mutex_);
  failure_.erase(name);
}

}  // namespace catgut
