// SPDX-License-Identifier: Apache-2.0
// tests/serve: conditions under which the page starts, passwords, rights. The pages themselves are tested in a browser:
// tools/check_page.sh.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/check.h"
#include "serve/login.h"
#include "serve/server.h"

namespace catgut {
namespace {

struct Scratch {
  std::filesystem::path folder;
  ServeOptions options;
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "catgut-serve-XXXXXX").string();
    folder = mkdtemp(name.data());
    options.store.where = (folder / "sessions.db").string();
    options.port = 0;
  }
  ~Scratch() { std::filesystem::remove_all(folder); }
};

std::string fault_of(const ServeOptions& options) {
  try {
    const PageServer server(options);
  } catch (const InputError& error) { return error.what(); }
  return "";
}

TEST(Serve, starts_on_this_machine_without_login) {
  const Scratch s;
  const PageServer server(s.options);
  EXPECT_EQ(server.url().rfind("http://127.0.0.1:", 0), 0u) << server.url();
}

TEST(Serve, beyond_this_machine_only_with_login_and_tls) {
  Scratch s;
  s.options.host = "0.0.0.0";
  EXPECT_NE(fault_of(s.options).find("the store has no login; make one first: catgut store person"), std::string::npos)
      << fault_of(s.options);
  Store store(s.options.store);
  store.put_person({"E1", Role::educator, "", "", 0});
  store.put_login("E1", hash_password("correct horse"));
  EXPECT_NE(fault_of(s.options).find("passwords would cross the network in clear text; give --tls-cert"), std::string::npos);
  s.options.certificate = s.options.key = "/nonexistent.pem";
  EXPECT_NE(fault_of(s.options).find("certificate or key cannot be used"), std::string::npos);
  s.options.key.clear();
  EXPECT_NE(fault_of(s.options).find("a certificate needs its key"), std::string::npos);
}

std::string output_of(const std::string& command) {
  std::string out;
  std::FILE* pipe = popen(command.c_str(), "r");
  for (int c; pipe && (c = std::fgetc(pipe)) != EOF;) out += static_cast<char>(c);
  if (pipe) pclose(pipe);
  return out;
}

// A certificate as a center makes one; the client checks it, plain HTTP gets no page, and old versions of TLS are refused.
TEST(Serve, a_client_that_trusts_the_certificate_reads_the_page_over_tls) {
  Scratch s;
  const std::string cert = (s.folder / "cert.pem").string(), key = (s.folder / "key.pem").string();
  const std::string make =
      "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext "
      "subjectAltName=DNS:localhost,IP:127.0.0.1 -out '" +
      cert + "' -keyout '" + key + "' 2>/dev/null";
  if (std::system("command -v curl >/dev/null") != 0 || std::system(make.c_str()) != 0)
    GTEST_SKIP() << "openssl or curl is missing";
  Store store(s.options.store);
  store.put_person({"E1", Role::educator, "", "", 0});
  store.put_login("E1", hash_password("correct horse"));
  s.options.certificate = cert, s.options.key = key;
  const PageServer server(s.options);
  const std::string url = server.url();
  ASSERT_EQ(url.rfind("https://", 0), 0u) << url;
  const std::string curl = "curl -s --max-time 5 --noproxy '*' -o /dev/null -w '%{http_code}' ";
  EXPECT_EQ(output_of(curl + "--cacert '" + cert + "' '" + url + "'"), "303") << "to the login";
  EXPECT_EQ(output_of(curl + "'" + url + "'"), "000") << "a certificate that the client does not trust";
  EXPECT_EQ(output_of(curl + "--cacert '" + cert + "' --tls-max 1.1 '" + url + "'"), "000") << "an old version of TLS";
  EXPECT_EQ(output_of(curl + "'http" + url.substr(5) + "'"), "000") << "clear text";
}

TEST(Serve, a_port_in_use_is_one_line) {
  Scratch s;
  const PageServer first(s.options);
  const std::string url = first.url();
  s.options.port = std::stoi(url.substr(url.rfind(':') + 1));
  EXPECT_NE(fault_of(s.options).find("cannot listen there"), std::string::npos);
}

TEST(Login, passwords_are_hashed_with_salt_and_checked) {
  const std::string hash = hash_password("correct horse");
  EXPECT_EQ(hash.rfind("$argon2id$", 0), 0u);
  EXPECT_NE(hash, hash_password("correct horse")) << "salt";
  EXPECT_TRUE(password_matches(hash, "correct horse"));
  EXPECT_FALSE(password_matches(hash, "correct horsf"));
  EXPECT_FALSE(password_matches("", ""));
  EXPECT_FALSE(password_matches(hash, std::string(5000, 'a')));
  EXPECT_THROW(hash_password("short"), InputError);
}

TEST(Login, cookies_end_and_names_wait_after_failures) {
  Visitors visitors;
  const auto now = Visitors::Clock::now();
  const std::string cookie = visitors.enter("T01", Role::trainee, now);
  ASSERT_TRUE(visitors.find(cookie, now).has_value());
  EXPECT_FALSE(visitors.find(cookie, now)->sees_all());
  EXPECT_FALSE(visitors.find(cookie + "0", now).has_value());
  EXPECT_FALSE(visitors.find("", now).has_value());
  EXPECT_FALSE(visitors.find(cookie, now + std::chrono::hours(13)).has_value());
  visitors.leave(cookie);
  EXPECT_FALSE(visitors.find(cookie, now).has_value());
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(visitors.may_try("E1", now));
    visitors.failed("E1", now);
  }
  EXPECT_FALSE(visitors.may_try("E1", now));
  EXPECT_TRUE(visitors.may_try("E2", now));
  EXPECT_TRUE(visitors.may_try("E1", now + std::chrono::seconds(31)));
  EXPECT_TRUE(same_text("abc", "abc"));
  EXPECT_FALSE(same_text("abc", "abd"));
  EXPECT_FALSE(same_text("abc", "ab"));
}

TEST(Serve, loopback_is_known) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "localhost", "::1"}) EXPECT_TRUE(is_loopback(host));
  for (const char* host : {"0.0.0.0", "::", "192.168.1.2", "example.org"}) EXPECT_FALSE(is_loopback(host));
}

}  // namespace
}  // namespace catgut
