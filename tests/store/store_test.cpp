// SPDX-License-Identifier: Apache-2.0
// tests/store: the same statements on SQLite and on PostgreSQL. Without a PostgreSQL server its half is skipped with a message.
#include "store/store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <thread>

#include "database.h"

namespace catgut::test {
namespace {

class Stores : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "postgresql") {
      if (const std::string missing = Server::get().missing(); !missing.empty())
        GTEST_SKIP() << "left out on PostgreSQL: " << missing;
      where_ = Server::get().fresh_url();
    } else {
      where_ = folder_ / "sessions.db";
    }
  }
  Store open() const {
    StoreOptions options;
    options.where = where_;
    return Store(options);
  }
  Folder folder_;
  std::string where_;
};

TEST_P(Stores, a_session_reads_back_as_it_was_stored) {
  Session s = some_session();
  s.details = "{\"text\": \"\xc3\xa9\xe2\x82\xac\xf0\x9f\x99\x82 '; DROP TABLE session; --\"}";
  int64_t id = 0;
  {
    Store store = open();
    id = store.add(s);
  }
  const Store again = open();
  expect_equal(s, again.session(id));
  ASSERT_EQ(again.sessions().size(), 1u);
  EXPECT_EQ(again.sessions()[0].score, s.score);
  EXPECT_EQ(again.people().size(), 1u);
}

// The stitches and the tension of a long operation.
TEST_P(Stores, two_megabytes_of_details_read_back) {
  Session s = some_session();
  for (int k = 0; s.details.size() < 2u << 20; ++k)
    s.details += "{\"tension\": " + std::to_string(k) + ", \"text\": \"\xc3\xa9'\\\\\"}";
  Store store = open();
  EXPECT_EQ(store.session(store.add(s)).details, s.details);
}

TEST_P(Stores, what_was_not_measured_stays_unknown) {
  Store store = open();
  Session s = some_session();
  s.score = s.score_max = kUnknown;
  s.passed = -1;
  const Session back = store.session(store.add(s));
  EXPECT_TRUE(std::isnan(back.score) && std::isnan(back.score_max));
  EXPECT_EQ(back.passed, -1);
}

TEST_P(Stores, the_same_session_twice_is_stored_once) {
  Store store = open();
  std::string note;
  const int64_t id = store.add(some_session());
  EXPECT_EQ(store.add(some_session(), &note), id);
  EXPECT_NE(note.find("already"), std::string::npos);
  EXPECT_EQ(store.sessions().size(), 1u);
}

TEST_P(Stores, a_clock_set_back_is_reported_and_keeps_the_order) {
  Store store = open();
  Session first = some_session("T01", 1), second = some_session("T01", 2);
  second.started = "2019-01-01T00:00:00Z";
  std::string note;
  store.add(first, &note);
  EXPECT_EQ(note, "");
  store.add(second, &note);
  EXPECT_NE(note.find("check the clock"), std::string::npos);
  EXPECT_EQ(note.find('\n'), std::string::npos);
  ASSERT_EQ(store.sessions().size(), 2u);
  EXPECT_EQ(store.sessions()[0].uid, first.uid);
}

TEST_P(Stores, filters_choose_by_person_cohort_task_and_time) {
  Store store = open();
  store.put_person({"T01", Role::trainee, "autumn class", "PGY1", 0});
  store.put_person({"T02", Role::trainee, "spring", "PGY2", 0});
  for (int n = 0; n < 4; ++n) store.add(some_session("T01", n));
  for (int n = 0; n < 3; ++n) {
    Session s = some_session("T02", n);
    s.task = n == 0 ? "stay" : "purse_string";
    store.add(s);
  }
  const auto count = [&](SessionFilter f) { return store.sessions(f).size(); };
  EXPECT_EQ(count({"T01", "", "", "", ""}), 4u);
  EXPECT_EQ(count({"", "spring", "", "", ""}), 3u);
  EXPECT_EQ(count({"", "spring", "stay", "", ""}), 1u);
  EXPECT_EQ(count({"", "", "", "2026-11-22T21:05:02Z", ""}), 3u);
  EXPECT_EQ(count({"", "", "", "", "2026-11-22T21:05:01Z"}), 2u);
  EXPECT_EQ(count({"' OR 1=1 --", "", "", "", ""}), 0u);
  EXPECT_EQ(store.values("path_length", {"T01", "", "", "", ""}).size(), 4u);
  EXPECT_EQ(store.values("path_length", {"T01", "", "", "", ""})[2].value, 5.5);
  ASSERT_EQ(store.metric_names().size(), 3u);
  EXPECT_EQ(store.metric_names()[0].name, "bites");
  EXPECT_EQ(store.metric_names()[0].value, 7);
  EXPECT_EQ(store.tasks(), (std::vector<std::string>{"purse_string", "stay"}));
  EXPECT_EQ(store.cohorts(), (std::vector<std::string>{"autumn class", "spring"}));
  EXPECT_EQ(store.frequent_losses({})[0].points, 7);
}

TEST_P(Stores, people_change_role_and_cohort) {
  Store store = open();
  store.put_person({"E1", Role::educator, "", "", 0});
  EXPECT_EQ(store.person("E1").role, Role::educator);
  store.put_person({"E1", Role::staff, "night", "x", 0});
  EXPECT_EQ(store.person("E1").role, Role::staff);
  EXPECT_EQ(store.person("E1").cohort, "night");
  EXPECT_NE(fault_of([&] { (void)store.person("E2"); }).find("no person E2"), std::string::npos);
}

TEST_P(Stores, deleting_a_person_leaves_nothing_of_them) {
  Store store = open();
  Session s = some_session("GONE-7", 1);
  s.recording = "/data/x.cgrec";
  store.add(s);
  store.add(some_session("T02", 1));
  store.put_login("GONE-7", "hash");
  store.add_answers({{"rectal_prolapse", "1", "GONE-7", "novice", "2026-11-22T21:05:00Z", "Q1", 4, ""}});
  store.log("GONE-7", "export", "GONE-7");
  EXPECT_EQ(store.remove_person("GONE-7", "E1"), (std::vector<std::string>{"/data/x.cgrec"}));
  EXPECT_EQ(store.people().size(), 1u);
  EXPECT_EQ(store.sessions().size(), 1u);
  EXPECT_EQ(store.logins(), 0);
  EXPECT_TRUE(store.answers("rectal_prolapse").empty());
  for (const LogEntry& e : store.log_entries()) EXPECT_TRUE(e.who != "GONE-7" && e.about != "GONE-7");
  // The bytes are overwritten too.
  if (store.is_file()) {
    std::ifstream file(where_, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    EXPECT_NE(bytes.find("T02-1"), std::string::npos);
    EXPECT_EQ(bytes.find("GONE-7"), std::string::npos);
  }
}

TEST_P(Stores, assignments_and_answers) {
  Store store = open();
  const int64_t id = store.add_assignment({0, "autumn", "stay", 80, 2, "2026-12-24"});
  store.add_assignment({0, "autumn", "lembert", kUnknown, 1, ""});
  ASSERT_EQ(store.assignments().size(), 2u);
  EXPECT_EQ(store.assignments()[0].goal, 80);
  EXPECT_TRUE(std::isnan(store.assignments()[1].goal));
  store.remove_assignment(id);
  EXPECT_EQ(store.assignments().size(), 1u);
  EXPECT_NE(fault_of([&] { store.add_assignment({0, "autumn", "stay", 80, 2, "soon"}); }), "");
  store.add_answers({{"s", "1", "a", "novice", "t", "Q1", 4, ""}, {"s", "1", "a", "novice", "t", "Q2", kUnknown, "good"}});
  ASSERT_EQ(store.answers("s").size(), 2u);
  EXPECT_EQ(store.answers("s")[1].text, "good");
  EXPECT_EQ(store.surveys(), std::vector<std::string>{"s"});
}

TEST_P(Stores, bad_input_is_refused_and_stores_nothing) {
  Store store = open();
  const auto refused = [&](auto change) {
    Session s = some_session();
    change(s);
    const std::string fault = fault_of([&] { store.add(s); });
    EXPECT_NE(fault, "");
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
  };
  refused([](Session& s) { s.trainee = ""; });
  refused([](Session& s) { s.trainee = "Jane Doe"; });
  refused([](Session& s) { s.task = "a/b"; });
  refused([](Session& s) { s.started = "yesterday"; });
  refused([](Session& s) { s.started = "2026-13-01T00:00:00Z"; });
  refused([](Session& s) { s.duration_s = -1; });
  refused([](Session& s) { s.duration_s = kUnknown; });
  refused([](Session& s) { s.metric[0].value = kUnknown; });
  refused([](Session& s) { s.metric[1].name = s.metric[0].name; });
  refused([](Session& s) { s.event[0].text = std::string("a\0b", 3); });
  refused([](Session& s) { s.lost[0].reason = "\xff\xfe"; });
  refused([](Session& s) { s.details = "\xed\xa0\x80"; });  // a surrogate
  EXPECT_TRUE(store.sessions().empty());
  EXPECT_TRUE(store.people().empty());
}

TEST_P(Stores, two_stations_write_at_once) {
  open();
  const auto work = [&](const std::string& who) {
    Store store = open();
    for (int n = 0; n < 12; ++n) store.add(some_session(who, n));
  };
  std::thread a(work, "T01"), b(work, "T02"), c(work, "T01b");
  a.join(), b.join(), c.join();
  const Store store = open();
  EXPECT_EQ(store.sessions().size(), 36u);
  for (const Session& s : store.sessions()) EXPECT_EQ(store.session(s.id).metric.size(), 3u);
}

TEST_P(Stores, two_stations_make_the_store_at_once) {
  std::vector<std::thread> all;
  std::vector<std::string> fault(4);
  for (size_t i = 0; i < fault.size(); ++i)
    all.emplace_back([&, i] { fault[i] = fault_of([&] { open().add(some_session("T" + std::to_string(i))); }); });
  for (std::thread& t : all) t.join();
  for (const std::string& f : fault) EXPECT_EQ(f, "");
  EXPECT_EQ(open().sessions().size(), fault.size());
}

TEST_P(Stores, a_backup_is_a_store_and_restores_into_an_empty_one) {
  Store store = open();
  store.put_person({"T01", Role::trainee, "autumn", "PGY1", 0});
  for (int n = 0; n < 5; ++n) store.add(some_session("T01", n));
  store.add_assignment({0, "autumn", "stay", kUnknown, 2, ""});
  store.add_answers({{"s", "1", "a", "novice", "t", "Q1", 4, ""}});
  const std::string file = folder_ / "backup.db";
  store.backup(file);
  EXPECT_NE(fault_of([&] { store.backup(file); }).find("exists already"), std::string::npos);
  EXPECT_NE(fault_of([&] { store.restore(file); }).find("not empty"), std::string::npos);
  if (GetParam() == "postgresql") where_ = Server::get().fresh_url();
  else where_ = folder_ / "restored.db";
  Store back = open();
  back.restore(file);
  ASSERT_EQ(back.sessions().size(), 5u);
  for (size_t i = 0; i < 5; ++i) expect_equal(store.session(store.sessions()[i].id), back.session(back.sessions()[i].id));
  EXPECT_EQ(back.person("T01").cohort, "autumn");
  EXPECT_EQ(back.assignments().size(), 1u);
  EXPECT_EQ(back.answers("s").size(), 1u);
  EXPECT_GT(back.add(some_session("T09", 1)), back.sessions()[4].id) << "keys continue";
}

INSTANTIATE_TEST_SUITE_P(Databases, Stores, testing::Values("sqlite", "postgresql"), [](const auto& all) { return all.param; });

class OnServer : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = Server::get().missing(); !missing.empty())
      GTEST_SKIP() << "left out on PostgreSQL: " << missing;
  }
  static StoreOptions at(const std::string& url) {
    StoreOptions options;
    options.where = url;
    return options;
  }
};

TEST_F(OnServer, a_store_of_every_older_schema_is_migrated_on_postgresql) {
  for (int version = 1; version < schema_version(); ++version) {
    const std::string url = Server::get().fresh_url();
    create_store_of_schema(url, version);
    StoreOptions reading = at(url);
    reading.read_only = true;
    EXPECT_NE(fault_of([&] { Store store(reading); }).find("has the older schema"), std::string::npos) << version;
    Store store(at(url));
    store.add(some_session());
    store.log("E1", "export", "T01");
    EXPECT_EQ(store.sessions().size(), 1u);
  }
  const std::string url = Server::get().fresh_url();
  create_store_of_schema(url, 99);
  EXPECT_NE(fault_of([&] { Store store(at(url)); }).find("was written by a newer Catgut (schema 10"), std::string::npos);
}

TEST_F(OnServer, a_read_only_server_refuses_changes_in_one_line_on_postgresql) {
  const std::string url = Server::get().fresh_url(), name = url.substr(url.find("@/") + 2, url.find('?') - url.find("@/") - 2);
  { Store(at(url)).add(some_session("T01", 0)); }
  ASSERT_TRUE(Server::get().run("ALTER DATABASE " + name + " SET default_transaction_read_only = on"));
  StoreOptions reading = at(url);
  reading.read_only = true;
  EXPECT_EQ(Store(reading).sessions().size(), 1u);
  const std::string fault = fault_of([&] { Store(at(url)).add(some_session("T01", 1)); });
  EXPECT_NE(fault.find("the server accepts no changes: it is read-only; use the main server"), std::string::npos) << fault;
  EXPECT_EQ(fault.find('\n'), std::string::npos);
  EXPECT_EQ(Store(reading).sessions().size(), 1u);
}

// The database in a file system of 16 MB, which ends with its server.
TEST_F(OnServer, a_full_disk_is_one_line_and_loses_nothing_on_postgresql) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "another server: set CATGUT_LONG=1 (the nightly run)";
  Server server(16);
  if (!server.missing().empty()) GTEST_SKIP() << "left out: this user may not mount a file system";
  ASSERT_TRUE(server.run("CREATE TABLESPACE small LOCATION '" + server.small() + "'"));
  ASSERT_TRUE(server.run("CREATE DATABASE sessions TABLESPACE small"));
  Store store(at(server.url("sessions")));
  size_t stored = 0;
  std::minstd_rand letter(1);  // text that cannot be compressed
  const std::string fault = fault_of([&] {
    for (; stored < 1000; ++stored) {
      Session s = some_session("T01", static_cast<int>(stored));
      for (size_t k = 0; k < 200000; ++k) s.details += static_cast<char>('0' + letter() % 64);
      store.add(s);
    }
  });
  EXPECT_NE(fault.find("the server's disk is full, so the last change was not stored; free some space"), std::string::npos)
      << fault;
  EXPECT_EQ(fault.find('\n'), std::string::npos);
  EXPECT_GT(stored, 3u);
  EXPECT_EQ(Store(at(server.url("sessions"))).sessions().size(), stored);
  for (const Session& s : store.sessions())
    expect_equal(some_session("T01", std::stoi(s.uid.substr(4))), [&] {
      Session whole = store.session(s.id);
      EXPECT_EQ(whole.details.size(), 200000u);
      whole.details.clear();
      return whole;
    }());
}

TEST(Postgres, a_server_that_is_not_there_is_one_line_without_the_password) {
  StoreOptions options;
  options.where = "postgresql://user:secret@127.0.0.1:1/catgut?connect_timeout=2&password=secret2";
  const std::string fault = fault_of([&] { Store store(options); });
  EXPECT_NE(fault.find("no connection to the database server"), std::string::npos) << fault;
  EXPECT_EQ(fault.find("secret"), std::string::npos) << fault;
  EXPECT_EQ(fault.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace catgut::test
