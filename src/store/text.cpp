// SPDX-License-Identifier: Apache-2.0
// store: checks of what is to be stored. A database that stores anything would fail later, in another program: PostgreSQL
// refuses NUL and invalid UTF-8, and a page would show them.
#include <fmt/format.h>

#include "core/check.h"
#include "store/sql.h"

namespace catgut {
namespace {

// RFC 3629: no overlong forms, no surrogates, no NUL.
bool is_utf8(const std::string& text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  for (size_t i = 0; i < text.size();) {
    const unsigned char c = byte(i);
    if (c == 0) return false;
    const size_t more = c < 0x80 ? 0 : c >= 0xc2 && c < 0xe0 ? 1 : c >= 0xe0 && c < 0xf0 ? 2 : c >= 0xf0 && c < 0xf5 ? 3 : 4;
    if (more == 4 || i + more >= text.size()) return false;
    for (size_t k = 1; k <= more; ++k)
      if ((byte(i + k) & 0xc0) != 0x80) return false;
    if ((c == 0xe0 && byte(i + 1) < 0xa0) || (c == 0xed && byte(i + 1) > 0x9f) || (c == 0xf0 && byte(i + 1) < 0x90) ||
        (c == 0xf4 && byte(i + 1) > 0x8f))
      return false;
    i += more + 1;
  }
  return true;
}

}  // namespace

void check_text(const std::string& text, const char* what, size_t most) {
  if (text.size() > most) throw InputError(what, fmt::format("is longer than {} bytes", most), "shorten it");
  if (!is_utf8(text)) throw InputError(what, "is not valid UTF-8 text", "save the file as UTF-8");
}

void check_name(const std::string& text, const char* what) {
  constexpr size_t kMost = 64;
  const bool plain =
      text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") == std::string::npos;
  if (text.empty() || text.size() > kMost || !plain)
    throw InputError(fmt::format("{} \"{:.64}\"", what, text), "is not 1 to 64 of the characters A-Z a-z 0-9 . _ -",
                     "choose such a name; a pseudonym, not a person's name");
}

void check_finite(double value, const char* what) {
  if (!std::isfinite(value)) throw InputError(what, "is not a finite number", "leave it out when it was not measured");
}

}  // namespace catgut
