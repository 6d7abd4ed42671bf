// SPDX-License-Identifier: Apache-2.0
// store: stores and reads sessions with their metrics, events and lost points.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>

#include "core/check.h"
#include "store/sql.h"

namespace catgut {
namespace {
using soci::into;
using soci::use;

constexpr size_t kMostRows = 100000;        // of metrics, events or lost points in a session
constexpr size_t kMostDetails = 64u << 20;  // [bytes]

std::string random_uid() {  // a UUID of version 4 without dashes
  std::random_device device;
  std::string uid;
  for (int i = 0; i < 4; ++i) uid += fmt::format("{:08x}", device());
  uid[12] = '4';
  uid[16] = "89ab"[device() % 4];
  return uid;
}

// "2026-11-22T21:05:00Z", with the ranges of a date.
void check_time(const std::string& text) {
  static const std::string kForm = "0000-00-00T00:00:00Z";
  bool good = text.size() == kForm.size();
  for (size_t i = 0; good && i < kForm.size(); ++i)
    good = kForm[i] == '0' ? text[i] >= '0' && text[i] <= '9' : text[i] == kForm[i];
  const auto number = [&](size_t at, size_t digits) { return good ? std::stoi(text.substr(at, digits)) : 0; };
  good = good && number(5, 2) >= 1 && number(5, 2) <= 12 && number(8, 2) >= 1 && number(8, 2) <= 31 && number(11, 2) < 24 &&
         number(14, 2) < 60 && number(17, 2) <= 60;
  if (!good) throw InputError(fmt::format("time \"{:.40}\"", text), "is not a time in UTC", "write it as 2026-11-22T21:05:00Z");
}

void check_session(const Session& s) {
  check_name(s.trainee, "trainee");
  check_name(s.task, "task");
  if (!s.uid.empty()) check_name(s.uid, "uid");
  check_time(s.started);
  check_finite(s.duration_s, "duration");
  if (s.duration_s < 0) throw InputError("duration", "is negative", "check the file");
  for (const auto& [text, what] : {std::pair{&s.rubric, "rubric"},
                                   {&s.settings, "settings"},
                                   {&s.program, "program"},
                                   {&s.station, "station"},
                                   {&s.recording, "recording"}})
    check_text(*text, what, 1u << 16);
  check_text(s.details, "details", kMostDetails);
  if (s.metric.size() > kMostRows || s.event.size() > kMostRows || s.lost.size() > kMostRows)
    throw InputError("session", fmt::format("has more than {} metrics, events or lost points", kMostRows), "check the file");
  std::vector<std::string> names;
  for (const Metric& m : s.metric) {
    check_text(m.name, "name of a metric", 128);
    if (m.name.empty()) throw InputError("metric", "has no name", "name it");
    check_text(m.unit, "unit of a metric", 32);
    check_finite(m.value, m.name.c_str());
    names.push_back(m.name);
  }
  std::sort(names.begin(), names.end());
  if (const auto twice = std::adjacent_find(names.begin(), names.end()); twice != names.end())
    throw InputError("metric " + *twice, "is there twice", "check the file");
  for (const SessionEvent& e : s.event) {
    check_text(e.kind, "kind of an event", 128);
    check_text(e.text, "text of an event");
    check_finite(e.at_s, "time of an event");
  }
  for (const LostPoints& l : s.lost) {
    check_text(l.item, "item of lost points", 256);
    check_text(l.reason, "reason of lost points");
    check_text(l.place, "place of lost points");
    check_finite(l.points, "lost points");
  }
}

void insert_rows(soci::session& sql, const Session& s, long long id) {
  {
    std::string name, unit;
    double value = 0;
    Nullable low, high;
    soci::statement st =
        (sql.prepare << "INSERT INTO metric (session_id, name, value, unit, low, high) VALUES (:s, :n, :v, :u, :l, :h)",
         use(id), use(name), use(value), use(unit), use(low.value, low.is), use(high.value, high.is));
    for (const Metric& m : s.metric) {
      name = m.name, value = m.value, unit = m.unit;
      low = Nullable(m.low), high = Nullable(m.high);
      st.execute(true);
    }
  }
  int ordinal = 0;
  {
    std::string kind, body;
    double at = 0;
    soci::statement st =
        (sql.prepare << "INSERT INTO event (session_id, ordinal, at_s, kind, body) VALUES (:s, :o, :a, :k, :b)", use(id),
         use(ordinal), use(at), use(kind), use(body));
    for (const SessionEvent& e : s.event) {
      at = e.at_s, kind = e.kind, body = e.text;
      st.execute(true);
      ++ordinal;
    }
  }
  ordinal = 0;
  std::string item, reason, place;
  double points = 0;
  Nullable at;
  int critical = 0;
  soci::statement st =
      (sql.prepare << "INSERT INTO lost (session_id, ordinal, item, reason, place, points, at_s, critical)"
                      " VALUES (:s, :o, :i, :r, :p, :n, :a, :c)",
       use(id), use(ordinal), use(item), use(reason), use(place), use(points), use(at.value, at.is), use(critical));
  for (const LostPoints& l : s.lost) {
    item = l.item, reason = l.reason, place = l.place, points = l.points, critical = l.critical;
    at = Nullable(l.at_s);
    st.execute(true);
    ++ordinal;
  }
}

int64_t insert(soci::session& sql, Session s, const std::string& created, std::vector<std::string>* notes) {
  const auto note = [&](const std::string& text) {
    if (notes) notes->push_back(text);
  };
  long long id = 0;
  if (s.uid.empty()) s.uid = random_uid();
  sql << "SELECT id FROM session WHERE uid = :u", use(s.uid), into(id);
  if (sql.got_data()) {
    note("session " + s.uid + " is in the store already");
    return id;
  }
  sql << "INSERT INTO person (pseudonym, role, level, created) VALUES (:p, 'trainee', '', :c) ON CONFLICT (pseudonym) DO "
         "NOTHING",
      use(s.trainee), use(created);
  long long person = 0;
  sql << "SELECT id FROM person WHERE pseudonym = :p", use(s.trainee), into(person);
  std::string last;
  soci::indicator has_last = soci::i_null;
  sql << "SELECT max(started) FROM session WHERE person_id = :p", use(person), into(last, has_last);
  if (has_last == soci::i_ok && s.started < last)
    note(
        fmt::format("the session of {} starts at {}, before the last one stored ({}): check the clock of this machine. "
                    "Sessions keep the order in which they were stored",
                    s.trainee, s.started, last));
  Nullable score(s.score), most(s.score_max);
  const int passed = s.passed < 0 ? -1 : s.passed > 0;
  sql << "INSERT INTO session (uid, person_id, task, started, duration_s, score, score_max, passed, rubric, settings, program,"
         " station, recording, details) VALUES (:u, :p, :t, :a, :d, :s, :m, :ok, :r, :e, :g, :n, :c, :x) RETURNING id",
      use(s.uid), use(person), use(s.task), use(s.started), use(s.duration_s), use(score.value, score.is),
      use(most.value, most.is), use(passed), use(s.rubric), use(s.settings), use(s.program), use(s.station), use(s.recording),
      use(s.details), into(id);
  insert_rows(sql, s, id);
  return id;
}

// The condition of a filter, for a query over session s, person p and cohort c. Each value is named once, by a
// query of constants, so that it can be bound by name everywhere.
const char* const kFiltered =
    " FROM session s JOIN person p ON p.id = s.person_id LEFT JOIN cohort c ON c.id = p.cohort_id"
    " WHERE (:trainee = '' OR p.pseudonym = :trainee) AND (:cohort = '' OR c.name = :cohort) AND (:task = '' OR s.task = :task)"
    " AND (:from = '' OR s.started >= :from) AND (:before = '' OR s.started < :before)";

}  // namespace

int64_t Store::add(const Session& given, std::string* note) {
  std::vector<std::string> notes;
  const int64_t id = add_all({given}, &notes)[0];
  if (note) *note = notes.empty() ? "" : notes[0];
  return id;
}

std::vector<int64_t> Store::add_all(const std::vector<Session>& sessions, std::vector<std::string>* notes) {
  for (const Session& s : sessions) check_session(s);
  std::vector<int64_t> ids;
  work_->write([&] {
    for (const Session& s : sessions) ids.push_back(insert(work_->sql, s, work_->options.now(), notes));
  });
  return ids;
}

std::vector<Session> Store::sessions(const SessionFilter& f) const {
  std::vector<Session> all;
  work_->read([&] {
    Session s;
    long long id = 0;
    Nullable score, most;
    soci::statement st =
        (work_->sql.prepare << std::string(
                                   "SELECT s.id, s.uid, p.pseudonym, s.task, s.started, s.duration_s, s.score, s.score_max,"
                                   " s.passed, s.rubric, s.settings, s.program, s.station, s.recording") +
                                   kFiltered + " ORDER BY s.id",
         into(id), into(s.uid), into(s.trainee), into(s.task), into(s.started), into(s.duration_s), into(score.value, score.is),
         into(most.value, most.is), into(s.passed), into(s.rubric), into(s.settings), into(s.program), into(s.station),
         into(s.recording), use(f.trainee, "trainee"), use(f.cohort, "cohort"), use(f.task, "task"), use(f.from, "from"),
         use(f.before, "before"));
    st.execute();
    while (st.fetch()) {
      s.id = id, s.score = score.get(), s.score_max = most.get();
      all.push_back(s);
    }
  });
  return all;
}

Session Store::session(int64_t wanted) const {
  Session s;
  work_->read([&] {
    soci::session& sql = work_->sql;
    const long long id = wanted;
    Nullable score, most;
    sql << "SELECT s.uid, p.pseudonym, s.task, s.started, s.duration_s, s.score, s.score_max, s.passed, s.rubric, s.settings,"
           " s.program, s.station, s.recording, s.details FROM session s JOIN person p ON p.id = s.person_id WHERE s.id = :i",
        use(id), into(s.uid), into(s.trainee), into(s.task), into(s.started), into(s.duration_s), into(score.value, score.is),
        into(most.value, most.is), into(s.passed), into(s.rubric), into(s.settings), into(s.program), into(s.station),
        into(s.recording), into(s.details);
    if (!sql.got_data())
      throw InputError(work_->name, fmt::format("there is no session {}", wanted), "catgut store list shows the sessions");
    s.id = wanted, s.score = score.get(), s.score_max = most.get();
    {
      Metric m;
      Nullable low, high;
      soci::statement st =
          (sql.prepare << "SELECT name, value, unit, low, high FROM metric WHERE session_id = :i ORDER BY name", use(id),
           into(m.name), into(m.value), into(m.unit), into(low.value, low.is), into(high.value, high.is));
      st.execute();
      while (st.fetch()) {
        m.low = low.get(), m.high = high.get();
        s.metric.push_back(m);
      }
    }
    {
      SessionEvent e;
      soci::statement st = (sql.prepare << "SELECT at_s, kind, body FROM event WHERE session_id = :i ORDER BY ordinal", use(id),
                            into(e.at_s), into(e.kind), into(e.text));
      st.execute();
      while (st.fetch()) s.event.push_back(e);
    }
    LostPoints l;
    Nullable at;
    int critical = 0;
    soci::statement st =
        (sql.prepare << "SELECT item, reason, place, points, at_s, critical FROM lost WHERE session_id = :i ORDER BY ordinal",
         use(id), into(l.item), into(l.reason), into(l.place), into(l.points), into(at.value, at.is), into(critical));
    st.execute();
    while (st.fetch()) {
      l.at_s = at.get(), l.critical = critical != 0;
      s.lost.push_back(l);
    }
  });
  return s;
}

std::vector<Store::Value> Store::values(const std::string& metric, const SessionFilter& f) const {
  std::vector<Value> all;
  work_->read([&] {
    long long id = 0;
    double value = 0;
    soci::statement st =
        (work_->sql.prepare << std::string("SELECT m.session_id, m.value FROM metric m JOIN (SELECT s.id") + kFiltered +
                                   ") k ON k.id = m.session_id WHERE m.name = :metric ORDER BY m.session_id",
         into(id), into(value), use(f.trainee, "trainee"), use(f.cohort, "cohort"), use(f.task, "task"), use(f.from, "from"),
         use(f.before, "before"), use(metric, "metric"));
    st.execute();
    while (st.fetch()) all.push_back({id, value});
  });
  return all;
}

std::vector<Metric> Store::metric_names(const SessionFilter& f) const {
  std::vector<Metric> all;
  work_->read([&] {
    Metric m;
    long long rows = 0;
    soci::statement st =
        (work_->sql.prepare << std::string("SELECT m.name, min(m.unit), count(*) FROM metric m JOIN (SELECT s.id") + kFiltered +
                                   ") k ON k.id = m.session_id GROUP BY m.name ORDER BY m.name",
         into(m.name), into(m.unit), into(rows), use(f.trainee, "trainee"), use(f.cohort, "cohort"), use(f.task, "task"),
         use(f.from, "from"), use(f.before, "before"));
    st.execute();
    while (st.fetch()) {
      m.value = static_cast<double>(rows);
      all.push_back(m);
    }
  });
  return all;
}

std::vector<LostPoints> Store::frequent_losses(const SessionFilter& f) const {
  std::vector<LostPoints> all;
  work_->read([&] {
    LostPoints l;
    long long rows = 0;
    int critical = 0;
    soci::statement st =
        (work_->sql.prepare << std::string("SELECT l.item, count(*), max(l.critical) FROM lost l JOIN (SELECT s.id") +
                                   kFiltered + ") k ON k.id = l.session_id GROUP BY l.item ORDER BY count(*) DESC, l.item",
         into(l.item), into(rows), into(critical), use(f.trainee, "trainee"), use(f.cohort, "cohort"), use(f.task, "task"),
         use(f.from, "from"), use(f.before, "before"));
    st.execute();
    while (st.fetch()) {
      l.points = static_cast<double>(rows), l.critical = critical != 0;
      all.push_back(l);
    }
  });
  return all;
}

std::vector<std::string> Store::tasks() const {
  std::vector<std::string> all;
  work_->read([&] {
    std::string task;
    soci::statement st = (work_->sql.prepare << "SELECT DISTINCT task FROM session ORDER BY task", into(task));
    st.execute();
    while (st.fetch()) all.push_back(task);
  });
  return all;
}

}  // namespace catgut
