// SPDX-License-Identifier: Apache-2.0
// tests/store: an empty database for a test, on SQLite and on a PostgreSQL server that the tests start.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/check.h"
#include "store/store.h"

namespace catgut::test {
namespace fs = std::filesystem;

// A folder that is removed at the end.
struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "catgut-store-XXXXXX").string();
    path = mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code error;
    fs::remove_all(path, error);
  }
  std::string operator/(const std::string& name) const { return (path / name).string(); }
};

inline std::string newest_postgres() {  // folder of its programs; empty: not installed
  std::string newest;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/usr/lib/postgresql", error))
    if (fs::exists(entry.path() / "bin/initdb")) newest = std::max(newest, (entry.path() / "bin").string());
  return newest;
}

// A server on a socket in a folder of its own: it listens on no port.
class Server {
 public:
  static Server& get() {  // one for the whole program
    static Server server;
    return server;
  }
  // Of another one, a folder `small` is a file system of this size, in a mount namespace of the server's own.
  explicit Server(int small_megabytes = 0) { start(small_megabytes); }
  ~Server() {
    if (running_ && std::system(as("pg_ctl -s -m immediate -D " + (folder_ / "data") + " stop >/dev/null 2>&1").c_str()))
      std::fputs("the PostgreSQL server of the tests could not be stopped\n", stderr);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  bool run(const std::string& sql) const {
    return std::system(as("psql -q -h " + folder_.path.string() + " -U postgres -d postgres -c \"" + sql + "\"").c_str()) == 0;
  }
  std::string url(const std::string& name) const { return "postgresql://postgres@/" + name + "?host=" + folder_.path.string(); }
  std::string small() const { return folder_ / "small"; }
  const std::string& missing() const { return missing_; }  // why there is none; empty: it runs
  std::string fresh_url() {
    const std::string name = "t" + std::to_string(getpid()) + "_" + std::to_string(++count_);
    if (!run("CREATE DATABASE " + name)) throw std::runtime_error("no database");
    return url(name);
  }

 private:
  void start(int small_megabytes) {
    bin_ = newest_postgres();
    if (bin_.empty()) {
      missing_ = "postgresql is not installed";
      return;
    }
    // The server refuses to run as root.
    if (geteuid() == 0) {
      user_ = "runuser -u postgres -- ";
      if (std::system(("chown postgres " + folder_.path.string()).c_str())) missing_ = "there is no user postgres";
    }
    const std::string data = folder_ / "data", log = folder_ / "server.log";
    std::string begin = as("pg_ctl -s -w -D " + data + " -l " + log + " -o \"-c listen_addresses= -k " + folder_.path.string() +
                           "\" start >/dev/null 2>&1");
    if (small_megabytes > 0) {
      fs::create_directory(small());
      begin = "unshare -m sh -c 'mount -t tmpfs -o size=" + std::to_string(small_megabytes) + "m none " + small() +
              " 2>/dev/null && chown postgres " + small() + " && " + begin + "' 2>/dev/null";
    }
    if (!missing_.empty() || std::system(as("initdb -A trust -U postgres -N -D " + data + " >/dev/null 2>&1").c_str()) ||
        std::system(begin.c_str())) {
      if (missing_.empty()) missing_ = "the server does not start";
      return;
    }
    running_ = true;
  }
  std::string as(const std::string& command) const { return "cd / && " + user_ + bin_ + "/" + command; }

  Folder folder_;
  std::string bin_, user_, missing_;
  int count_ = 0;
  bool running_ = false;
};

inline Session some_session(const std::string& trainee = "T01", int n = 0) {
  Session s;
  s.uid = trainee + "-" + std::to_string(n);
  s.trainee = trainee;
  s.task = "purse_string";
  s.started = "2026-11-22T21:05:" + std::string(n % 60 < 10 ? "0" : "") + std::to_string(n % 60) + "Z";
  s.duration_s = 312.5;
  s.score = 71.25 + n % 7;
  s.score_max = 100;
  s.passed = 1;
  s.rubric = "purse_string 1";
  s.program = "0.1.0";
  s.metric = {{"bites", 12, "1", 10, kUnknown},
              {"spacing_median", 4.25, "mm", 3, 5},
              {"path_length", 3.5 + n, "m", kUnknown, kUnknown}};
  s.event = {{1.5, "bite_completed", "first"}, {9.25, "thread_broken", "\"quoted\", <b> and ;"}};
  s.lost = {{"spacing", "bites 3 and 4 are 7.1 mm apart", "rim, 40 mm", 5, 44.0, false},
            {"full thickness", "the lumen was reached", "", 10, kUnknown, true}};
  return s;
}

inline void expect_equal(const Session& a, const Session& b) {
  EXPECT_EQ(a.uid, b.uid);
  EXPECT_EQ(a.trainee, b.trainee);
  EXPECT_EQ(a.task, b.task);
  EXPECT_EQ(a.started, b.started);
  EXPECT_EQ(a.duration_s, b.duration_s);
  EXPECT_EQ(a.score, b.score);
  EXPECT_EQ(a.passed, b.passed);
  EXPECT_EQ(a.details, b.details);
  const auto same = [](double x, double y) { return x == y || (x != x && y != y); };
  ASSERT_EQ(a.metric.size(), b.metric.size());
  for (const Metric& m : a.metric) {  // the store sorts by name
    const auto found = std::find_if(b.metric.begin(), b.metric.end(), [&](const Metric& o) { return o.name == m.name; });
    ASSERT_NE(found, b.metric.end()) << m.name;
    EXPECT_EQ(m.value, found->value);
    EXPECT_EQ(m.unit, found->unit);
    EXPECT_TRUE(same(m.low, found->low) && same(m.high, found->high)) << m.name;
  }
  ASSERT_EQ(a.event.size(), b.event.size());
  for (size_t i = 0; i < a.event.size(); ++i) {
    EXPECT_EQ(a.event[i].at_s, b.event[i].at_s);
    EXPECT_EQ(a.event[i].kind, b.event[i].kind);
    EXPECT_EQ(a.event[i].text, b.event[i].text);
  }
  ASSERT_EQ(a.lost.size(), b.lost.size());
  for (size_t i = 0; i < a.lost.size(); ++i) {
    EXPECT_EQ(a.lost[i].item, b.lost[i].item);
    EXPECT_EQ(a.lost[i].reason, b.lost[i].reason);
    EXPECT_EQ(a.lost[i].points, b.lost[i].points);
    EXPECT_TRUE(same(a.lost[i].at_s, b.lost[i].at_s));
    EXPECT_EQ(a.lost[i].critical, b.lost[i].critical);
  }
}

// The message of the InputError that `body` throws; empty: none.
template <class Body>
std::string fault_of(Body&& body) {
  try {
    body();
  } catch (const InputError& error) { return error.what(); }
  return "";
}

}  // namespace catgut::test
