// SPDX-License-Identifier: Apache-2.0
// store: the connection, transactions and faults as one line; known to this room only.
#pragma once
#include <soci/soci.h>

#include <cmath>
#include <functional>
#include <string>

#include "store/store.h"

namespace catgut {

struct Store::Work {
  Work(const StoreOptions& options);
  Work(const Work&) = delete;

  mutable soci::session sql;
  StoreOptions options;
  std::string name;  // without password
  bool sqlite = true;

  // Runs `body` in a transaction that writes: all of it is stored, or nothing. Every database fault leaves as InputError.
  void write(const std::function<void()>& body) const;
  // The same for several reads that must see one state.
  void read(const std::function<void()>& body) const;
  void migrate(int up_to);
  int version() const;  // 0: an empty database
  [[noreturn]] void fail(const std::exception& error) const;
};

// A number that may be NULL, as SOCI binds it.
struct Nullable {
  double value = 0;
  soci::indicator is = soci::i_null;
  Nullable() = default;
  explicit Nullable(double v) : value(std::isfinite(v) ? v : 0), is(std::isfinite(v) ? soci::i_ok : soci::i_null) {}
  double get() const { return is == soci::i_ok ? value : kUnknown; }
};

// Texts of a fixed meaning, from outside. what: for the message.
void check_text(const std::string& text, const char* what, size_t most = 4096);
void check_name(const std::string& text, const char* what);  // 1 to 64 of A-Z a-z 0-9 . _ -
void check_finite(double value, const char* what);

}  // namespace catgut
