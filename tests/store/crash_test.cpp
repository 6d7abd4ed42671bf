// SPDX-License-Identifier: Apache-2.0
// tests/store: nothing committed is lost. A child process stores sessions and reports each one after add() has returned; it is
// killed at random moments, dies at a given byte of the file, finds the disk full or read-only. Afterwards every reported
// session is there whole. CATGUT_LONG=1 (the nightly run) takes 200 kills instead of 8, and every 61st byte instead of every
// 4999th.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <thread>

#include "database.h"
#include "store/store.h"

namespace catgut::test {
namespace {

bool whole_range() { return std::getenv("CATGUT_LONG") != nullptr; }

Session numbered(int n) {
  Session s = some_session("T01", n);
  s.details = std::string(static_cast<size_t>(n % 5) * 3000, 'x');  // several pages
  return s;
}

StoreOptions at(const std::string& where) {
  StoreOptions options;
  options.where = where;
  return options;
}

// Stores sessions first, first + 1, ... and writes a byte to `report` after each. Never returns.
[[noreturn]] void store_many(const std::string& where, int first, int last, int report) {
  try {
    Store store(at(where));
    for (int n = first; n < last; ++n) {
      store.add(numbered(n));
      if (write(report, "+", 1) != 1) _exit(3);
    }
  } catch (const InputError& error) {
    if (write(report, error.what(), strlen(error.what())) < 0) _exit(3);
    _exit(2);
  }
  _exit(0);
}

struct Child {
  pid_t pid = 0;
  int report = -1;
  template <class Body>
  explicit Child(Body&& body) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    pid = fork();
    if (pid == 0) {
      close(ends[0]);
      body(ends[1]);
    }
    close(ends[1]);
    report = ends[0];
  }
  // Everything reported until its end.
  std::string wait(int* status = nullptr) {
    std::string all;
    char buffer[512];
    for (ssize_t n; (n = read(report, buffer, sizeof buffer)) > 0;) all.append(buffer, static_cast<size_t>(n));
    close(report);
    int result = 0;
    waitpid(pid, &result, 0);
    if (status) *status = result;
    return all;
  }
};

int count_plus(const std::string& report) { return static_cast<int>(std::count(report.begin(), report.end(), '+')); }

// All sessions are whole and the store is sound. Returns how many there are.
int expect_whole(const std::string& where) {
  const Store store(at(where));
  EXPECT_EQ(store.check(), "");
  const std::vector<Session> all = store.sessions();
  for (size_t i = 0; i < all.size(); ++i) expect_equal(numbered(static_cast<int>(i)), store.session(all[i].id));
  return static_cast<int>(all.size());
}

void kill_at_random_moments(const std::string& where, int kills) {
  std::mt19937 random(23);
  int stored = 0, cut_short = 0;
  for (int k = 0; k < kills; ++k) {
    Child child([&](int report) { store_many(where, stored, stored + 100000, report); });
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 200000));
    kill(child.pid, SIGKILL);
    const int reported = count_plus(child.wait());
    const int there = expect_whole(where);
    // One more may be stored and not yet reported.
    ASSERT_GE(there, stored + reported) << "kill " << k;
    ASSERT_LE(there, stored + reported + 1) << "kill " << k;
    cut_short += there == stored + reported;
    stored = there;
  }
  EXPECT_GT(stored, kills / 2) << "the child was always killed before it stored anything";
  testing::Test::RecordProperty("sessions", stored);
  std::printf("%d kills, %d sessions stored, none lost; %d kills before the next commit\n", kills, stored, cut_short);
}

TEST(Crash, kill_9_at_random_moments_loses_nothing_stored) {
  const Folder folder;
  kill_at_random_moments(folder / "sessions.db", whole_range() ? 200 : 8);
}

TEST(Crash, kill_9_at_random_moments_loses_nothing_stored_on_postgresql) {
  if (const std::string missing = Server::get().missing(); !missing.empty())
    GTEST_SKIP() << "left out on PostgreSQL: " << missing;
  kill_at_random_moments(Server::get().fresh_url(), whole_range() ? 200 : 8);
}

// The system kills a process that writes past this size of a file: the write is cut at exactly that byte, in the journal or in
// the database, whichever grows first.
TEST(Crash, death_at_any_byte_loses_nothing_stored) {
  const Folder folder;
  const std::string start = folder / "start.db";
  {
    Store store(at(start));
    for (int n = 0; n < 3; ++n) store.add(numbered(n));
  }
  const uintmax_t size = fs::file_size(start), step = whole_range() ? 61 : 4999;
  int died = 0, tries = 0;
  for (uintmax_t limit = 512; limit < size + 60000; limit += step, ++tries) {
    const std::string where = folder / "copy.db";
    fs::remove(where + "-journal");
    fs::copy_file(start, where, fs::copy_options::overwrite_existing);
    Child child([&](int report) {
      const rlimit most{limit, limit};
      const rlimit none{0, 0};
      setrlimit(RLIMIT_CORE, &none);
      setrlimit(RLIMIT_FSIZE, &most);
      store_many(where, 3, 12, report);
    });
    int status = 0;
    const int reported = count_plus(child.wait(&status));
    died += WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ;
    ASSERT_GE(expect_whole(where), 3 + reported) << "at byte " << limit;
  }
  EXPECT_GT(died, tries / 2);
  std::printf("%d places, died at %d of them, nothing lost\n", tries, died);
}

TEST(Crash, a_write_that_fails_is_one_line_and_loses_nothing) {
  const Folder folder;
  const std::string where = folder / "sessions.db";
  { Store(at(where)).add(numbered(0)); }
  Child child([&](int report) {
    signal(SIGXFSZ, SIG_IGN);  // the write then fails
    const rlimit most{fs::file_size(where) + 8192, fs::file_size(where) + 8192};
    setrlimit(RLIMIT_FSIZE, &most);
    store_many(where, 1, 100, report);
  });
  int status = 0;
  const std::string report = child.wait(&status);
  EXPECT_EQ(WEXITSTATUS(status), 2) << report;
  EXPECT_NE(report.find("was not stored"), std::string::npos) << report;
  EXPECT_EQ(report.find('\n'), std::string::npos);
  EXPECT_GE(expect_whole(where), 1 + count_plus(report.substr(0, report.find(':'))));
}

// A real file system of half a megabyte, in a mount namespace of the child's own.
TEST(Crash, a_full_disk_is_one_line_and_loses_nothing) {
  const Folder folder;
  fs::create_directory(folder.path / "disk");
  const std::string disk = folder / "disk", where = disk + "/sessions.db", copy = folder / "copy.db";
  Child child([&](int report) {
    const bool root = geteuid() == 0;
    const auto refuse = [&] { _exit(write(report, "no mount", 8) == 8 ? 77 : 3); };
    if (unshare(CLONE_NEWNS | (root ? 0 : CLONE_NEWUSER)) != 0) refuse();
    if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) refuse();
    if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=512k") != 0) refuse();
    int code = 0;
    std::string said;
    try {
      Store store(at(where));
      for (int n = 0; n < 1000; ++n) {
        store.add(numbered(n));
        said += "+";
      }
    } catch (const InputError& error) {
      said += error.what();
      code = 2;
    }
    // The file system ends with this process: the store leaves it.
    fs::copy_file(where, copy);
    if (fs::exists(where + "-journal")) fs::copy_file(where + "-journal", copy + "-journal");
    _exit(write(report, said.data(), said.size()) < 0 ? 3 : code);
  });
  int status = 0;
  const std::string report = child.wait(&status);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "left out: this user may not mount a file system";
  EXPECT_EQ(WEXITSTATUS(status), 2) << report;
  const size_t text = report.find_first_not_of('+');
  ASSERT_NE(text, std::string::npos);
  EXPECT_NE(report.find("the disk is full, so the last change was not stored; free some space"), std::string::npos) << report;
  EXPECT_EQ(report.find('\n'), std::string::npos);
  EXPECT_GT(text, 3u);
  EXPECT_EQ(expect_whole(copy), static_cast<int>(text));
}

TEST(Crash, a_read_only_store_can_be_read_and_refuses_changes_in_one_line) {
  const Folder folder;
  const std::string where = folder / "sessions.db";
  { Store(at(where)).add(numbered(0)); }
  fs::permissions(where, fs::perms(0444));
  fs::permissions(folder.path, fs::perms(0555));
  Child child([&](int report) {
    if (geteuid() == 0 && setuid(65534) != 0) _exit(77);  // root may write everywhere
    {
      StoreOptions options = at(where);
      options.read_only = true;
      const Store store(options);
      if (store.sessions().size() != 1) _exit(4);
    }
    store_many(where, 1, 2, report);
  });
  int status = 0;
  const std::string report = child.wait(&status);
  fs::permissions(folder.path, fs::perms(0755));
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "left out: cannot become another user";
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_NE(report.find("is read-only; give this user write permission"), std::string::npos) << report;
  EXPECT_EQ(expect_whole(where), 1);
}

TEST(Files, the_wrong_file_is_one_line) {
  const Folder folder;
  const auto fault = [&](const std::string& where) { return fault_of([&] { Store store(at(where)); }); };
  EXPECT_NE(fault(folder.path.string()).find("is a folder"), std::string::npos);
  EXPECT_NE(fault("/proc/none/x.db").find("cannot be opened"), std::string::npos) << fault("/proc/none/x.db");
  std::ofstream(folder / "text.db") << std::string(5000, 'a');
  EXPECT_NE(fault(folder / "text.db").find("is not a session store"), std::string::npos) << fault(folder / "text.db");
  // A store of which a part was overwritten.
  const std::string where = folder / "sessions.db";
  {
    Store store(at(where));
    for (int n = 0; n < 20; ++n) store.add(numbered(n));
  }
  fs::resize_file(where, fs::file_size(where) / 2);
  const std::string damaged = fault_of([&] {
    Store store(at(where));
    for (const Session& s : store.sessions()) (void)store.session(s.id);
    if (!store.check().empty()) throw InputError(where, "the file is damaged", "restore a backup");
  });
  EXPECT_NE(damaged.find("damaged"), std::string::npos) << damaged;
}

TEST(Files, another_program_that_writes_for_too_long_is_one_line) {
  const Folder folder;
  const std::string where = folder / "sessions.db";
  Store store(at(where));
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  Child holder([&](int) {
    // As SQLite's own lock of a writer: the RESERVED byte of the file.
    const int file = open(where.c_str(), O_RDWR);
    struct flock lock = {};
    lock.l_type = F_WRLCK, lock.l_whence = SEEK_SET, lock.l_start = 0x40000001, lock.l_len = 1;
    const char done = fcntl(file, F_SETLK, &lock) == 0 ? 'y' : 'n';
    if (write(ready[1], &done, 1) != 1) _exit(3);
    pause();
    _exit(0);
  });
  char done = 0;
  ASSERT_EQ(read(ready[0], &done, 1), 1);
  ASSERT_EQ(done, 'y');
  StoreOptions options = at(where);
  options.wait_s = 1;
  Store other(options);
  const std::string fault = fault_of([&] { other.add(numbered(0)); });
  kill(holder.pid, SIGKILL);
  holder.wait();
  EXPECT_NE(fault.find("another program has been writing for more than 1 s"), std::string::npos) << fault;
  other.add(numbered(0));
  EXPECT_EQ(other.sessions().size(), 1u);
}

TEST(Migration, a_store_of_every_older_schema_is_migrated) {
  for (int version = 1; version < schema_version(); ++version) {
    const Folder folder;
    const std::string where = folder / "old.db";
    create_store_of_schema(where, version);
    StoreOptions reading = at(where);
    reading.read_only = true;
    const std::string fault = fault_of([&] { Store store(reading); });
    EXPECT_NE(fault.find("has the older schema 1 and is opened for reading only; open it once with write permission"),
              std::string::npos)
        << fault;
    Store store(at(where));
    store.add(numbered(0));
    store.log("E1", "export", "T01");
    EXPECT_EQ(expect_whole(where), 1);
  }
}

TEST(Migration, a_newer_schema_is_refused_in_one_line) {
  const Folder folder;
  const std::string where = folder / "new.db";
  create_store_of_schema(where, 99);
  const std::string fault = fault_of([&] { Store store(at(where)); });
  EXPECT_NE(fault.find("was written by a newer Catgut (schema 10"), std::string::npos) << fault;
}

}  // namespace
}  // namespace catgut::test
