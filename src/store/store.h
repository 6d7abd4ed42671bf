// SPDX-License-Identifier: Apache-2.0
// store: sessions in a database: who trained what and when, the score with its reasons, metrics, events, and where the
// recording is. SQLite in a file by default, PostgreSQL by URL when several stations share one store; both through SOCI.
// Reads and writes the database only; reports and web pages (rooms report and serve) read from here and from nothing else.
//
// Promises: a session is stored whole or not at all, and once add() has returned it survives a crash at any moment. Every
// fault is one InputError: which store, what is wrong, what to do. People are known by pseudonyms; names are not stored.
// A Store is for one thread at a time; any number of programs may have the same store open.
#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace catgut {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();  // a number that was not measured; NULL in the database

struct Metric {
  std::string name;
  double value = 0;
  std::string unit;                        // "mm", "N", "s", "1"
  double low = kUnknown, high = kUnknown;  // target band; kUnknown: open on that side
};

struct SessionEvent {
  double at_s = 0;  // [s] since the start
  std::string kind, text;
};

// Why points were lost: shown on the report, with the moment to replay.
struct LostPoints {
  std::string item, reason, place;
  double points = 0;
  double at_s = kUnknown;  // [s] since the start
  bool critical = false;
};

struct Session {
  int64_t id = 0;         // given by the store, ascending in the order of storing
  std::string uid;        // unique; empty: add() makes one. A session that is added twice is stored once
  std::string trainee;    // pseudonym
  std::string task;       // scene or procedure
  std::string started;    // UTC, "2026-11-22T21:05:00Z"
  double duration_s = 0;  // [s]
  double score = kUnknown, score_max = kUnknown;
  int passed = -1;        // 1, 0, or -1: not judged
  std::string rubric;     // name and version
  std::string settings;   // JSON: device profile, feedback, ...; empty: none
  std::string program;    // versions of program and physics
  std::string station;    // machine
  std::string recording;  // path; empty: none
  std::string details;    // JSON as `session_json` (runtime/report) writes it: edges, stitches, tension; empty: none
  std::vector<Metric> metric;
  std::vector<SessionEvent> event;
  std::vector<LostPoints> lost;
};

enum class Role : uint8_t { trainee, educator, staff };
const char* role_name(Role role);
Role role_of(const std::string& name);  // throws InputError

struct Person {
  std::string pseudonym;
  Role role = Role::trainee;
  std::string cohort;  // empty: none
  std::string level;   // of training, free text: "PGY2"
  int64_t sessions = 0;
};

// A task for a cohort: `runs` sessions with at least `goal` points, until `due`.
struct Assignment {
  int64_t id = 0;
  std::string cohort, task;
  double goal = kUnknown;  // points
  int runs = 1;
  std::string due;  // "2026-12-24"; empty: none
};

struct SurveyAnswer {
  std::string survey, version;  // of the questionnaire
  std::string respondent;       // pseudonym, or any identifier of the study
  std::string group;            // "novice", "expert", ...
  std::string at;               // UTC
  std::string question;
  double value = 0;  // the rating
  std::string text;  // of a free question
};

// Empty fields match everything.
struct SessionFilter {
  std::string trainee, cohort, task;
  std::string from, before;  // start of the session, UTC: from <= started < before
};

struct LogEntry {
  std::string at, who, action, about;
};

std::string utc_now();  // "2026-11-22T21:05:00Z"
// The file that is used when none is named: CATGUT_STORE from the environment (a path or a URL), else
// catgut/sessions.db in XDG_DATA_HOME (else ~/.local/share).
std::string default_store();

struct StoreOptions {
  std::string where;       // path of a SQLite file or postgresql://...; empty: default_store()
  bool read_only = false;  // SQLite: fails when the file is missing
  int wait_s = 10;         // [s] for other programs that write
  std::string (*now)() = utc_now;
};

class Store {
 public:
  // Creates file and folder when missing, and migrates an older schema. Throws InputError.
  explicit Store(const StoreOptions& options);
  ~Store();
  Store(Store&&) noexcept;

  const std::string& name() const;  // path, or URL without password
  bool is_file() const;             // SQLite

  // Returns the id. note: receives a remark for the user (the clock was set back, ...); may be null. Throws InputError for
  // texts that are not UTF-8, numbers that are not finite, an empty pseudonym or task.
  int64_t add(const Session& session, std::string* note = nullptr);
  // The same for many sessions: all of them, or none.
  std::vector<int64_t> add_all(const std::vector<Session>& sessions, std::vector<std::string>* notes = nullptr);
  Session session(int64_t id) const;  // throws InputError
  // In the order of storing, which a clock that was set back does not change. Without metrics, events, lost points, details.
  std::vector<Session> sessions(const SessionFilter& filter = {}) const;
  struct Value {
    int64_t session = 0;
    double value = 0;
  };
  std::vector<Value> values(const std::string& metric, const SessionFilter& filter = {}) const;
  std::vector<Metric> metric_names(const SessionFilter& filter = {}) const;  // name and unit of each; value: number of rows
  std::vector<std::string> tasks() const;
  // The lost points of many sessions: item, count in `points`. Most frequent first.
  std::vector<LostPoints> frequent_losses(const SessionFilter& filter) const;

  void put_person(const Person& person);  // adds or changes; the cohort is created when missing
  std::vector<Person> people() const;
  Person person(const std::string& pseudonym) const;  // throws InputError
  std::vector<std::string> cohorts() const;
  // Deletes the person with everything stored. Returns the paths of recordings that were stored; the files are the caller's.
  std::vector<std::string> remove_person(const std::string& pseudonym, const std::string& who);

  int64_t add_assignment(const Assignment& assignment);
  void remove_assignment(int64_t id);
  std::vector<Assignment> assignments() const;

  void add_answers(const std::vector<SurveyAnswer>& answers);  // all or none
  std::vector<SurveyAnswer> answers(const std::string& survey) const;
  std::vector<std::string> surveys() const;  // those with answers

  // Logins of the web page. hash: as libsodium's crypto_pwhash_str writes it; empty removes the login.
  void put_login(const std::string& pseudonym, const std::string& hash);
  std::string login(const std::string& pseudonym) const;  // empty: none
  int64_t logins() const;

  // Who did what: exports, deletions, roles, logins.
  void log(const std::string& who, const std::string& action, const std::string& about);
  std::vector<LogEntry> log_entries() const;

  // Everything, as a SQLite file that can be opened as a store. The target must not exist.
  void backup(const std::string& path) const;
  // Reads a backup (or any store) into this store, which must be empty. From SQLite to PostgreSQL too.
  void restore(const std::string& path);
  std::string check() const;  // "" or what SQLite found damaged

  struct Work;

 private:
  std::unique_ptr<Work> work_;
};

// Version of the schema written by this program.
int schema_version();
// Creates a store of another version, for tests: an older one has the tables of its time, a newer one only the number.
void create_store_of_schema(const std::string& path, int version);

}  // namespace catgut
