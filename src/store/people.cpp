// SPDX-License-Identifier: Apache-2.0
// store: people, cohorts, assignments, logins, and the log of who did what.
#include <fmt/format.h>

#include <algorithm>

#include "core/check.h"
#include "store/sql.h"

namespace catgut {
namespace {
using soci::into;
using soci::use;

const char* const kRoles[] = {"trainee", "educator", "staff"};

// Its id; made when missing. The name may contain blanks, unlike a pseudonym.
long long cohort_id(soci::session& sql, const std::string& name) {
  check_text(name, "name of a cohort", 64);
  sql << "INSERT INTO cohort (name) VALUES (:n) ON CONFLICT (name) DO NOTHING", use(name);
  long long id = 0;
  sql << "SELECT id FROM cohort WHERE name = :n", use(name), into(id);
  return id;
}

void insert_entry(soci::session& sql, const std::string& at, const std::string& who, const std::string& action,
                  const std::string& about) {
  sql << "INSERT INTO entry (at, who, action, about) VALUES (:t, :w, :a, :b)", use(at), use(who), use(action), use(about);
}

}  // namespace

const char* role_name(Role role) { return kRoles[static_cast<size_t>(role)]; }

Role role_of(const std::string& name) {
  for (size_t i = 0; i < std::size(kRoles); ++i)
    if (name == kRoles[i]) return static_cast<Role>(i);
  throw InputError(fmt::format("role \"{:.32}\"", name), "is unknown", "use trainee, educator or staff");
}

void Store::put_person(const Person& p) {
  check_name(p.pseudonym, "pseudonym");
  check_text(p.level, "level", 64);
  work_->write([&] {
    soci::session& sql = work_->sql;
    const std::string role = role_name(p.role), created = work_->options.now();
    long long cohort = 0;
    soci::indicator has = soci::i_null;
    if (!p.cohort.empty()) cohort = cohort_id(sql, p.cohort), has = soci::i_ok;
    sql << "INSERT INTO person (pseudonym, role, cohort_id, level, created) VALUES (:p, :r, :c, :l, :t)"
           " ON CONFLICT (pseudonym) DO UPDATE SET role = excluded.role, cohort_id = excluded.cohort_id, level = "
           "excluded.level",
        use(p.pseudonym), use(role), use(cohort, has), use(p.level), use(created);
  });
}

std::vector<Person> Store::people() const {
  std::vector<Person> all;
  work_->read([&] {
    Person p;
    std::string role;
    long long sessions = 0;
    soci::statement st = (work_->sql.prepare << "SELECT p.pseudonym, p.role, COALESCE(c.name, ''), p.level,"
                                                " (SELECT count(*) FROM session s WHERE s.person_id = p.id)"
                                                " FROM person p LEFT JOIN cohort c ON c.id = p.cohort_id ORDER BY p.pseudonym",
                          into(p.pseudonym), into(role), into(p.cohort), into(p.level), into(sessions));
    st.execute();
    while (st.fetch()) {
      p.role = role_of(role), p.sessions = sessions;
      all.push_back(p);
    }
  });
  return all;
}

Person Store::person(const std::string& pseudonym) const {
  for (const Person& p : people())
    if (p.pseudonym == pseudonym) return p;
  throw InputError(work_->name, fmt::format("there is no person {:.64}", pseudonym), "catgut store people lists them");
}

std::vector<std::string> Store::cohorts() const {
  std::vector<std::string> all;
  work_->read([&] {
    std::string name;
    soci::statement st = (work_->sql.prepare << "SELECT name FROM cohort ORDER BY name", into(name));
    st.execute();
    while (st.fetch()) all.push_back(name);
  });
  return all;
}

std::vector<std::string> Store::remove_person(const std::string& pseudonym, const std::string& who) {
  std::vector<std::string> recordings;
  work_->write([&] {
    soci::session& sql = work_->sql;
    long long id = 0;
    sql << "SELECT id FROM person WHERE pseudonym = :p", use(pseudonym), into(id);
    if (!sql.got_data())
      throw InputError(work_->name, fmt::format("there is no person {:.64}", pseudonym), "catgut store people lists them");
    {
      std::string path;
      soci::statement st =
          (sql.prepare << "SELECT recording FROM session WHERE person_id = :p AND recording <> ''", use(id), into(path));
      st.execute();
      while (st.fetch()) recordings.push_back(path);
    }
    sql << "DELETE FROM answer WHERE respondent = :p", use(pseudonym);
    sql << "DELETE FROM person WHERE id = :i", use(id);  // with sessions and login
    sql << "UPDATE entry SET about = '(deleted)' WHERE about = :p", use(pseudonym);
    sql << "UPDATE entry SET who = '(deleted)' WHERE who = :p", use(pseudonym);
    insert_entry(sql, work_->options.now(), who == pseudonym ? "(deleted)" : who, "delete", "(deleted)");
  });
  return recordings;
}

int64_t Store::add_assignment(const Assignment& a) {
  check_name(a.task, "task");
  if (a.cohort.empty()) throw InputError("assignment", "names no cohort", "name one");
  if (a.runs < 1 || a.runs > 1000) throw InputError("assignment", "the number of runs is not 1 to 1000", "change it");
  const bool is_date = a.due.size() == 10 && a.due.find_first_not_of("0123456789-") == std::string::npos;
  if (!a.due.empty() && !is_date) throw InputError("assignment", "the due date is not a date", "write it as 2026-12-24");
  long long id = 0;
  work_->write([&] {
    const long long cohort = cohort_id(work_->sql, a.cohort);
    Nullable goal(a.goal);
    work_->sql << "INSERT INTO assignment (cohort_id, task, goal, runs, due) VALUES (:c, :t, :g, :r, :d) RETURNING id",
        use(cohort), use(a.task), use(goal.value, goal.is), use(a.runs), use(a.due), into(id);
  });
  return id;
}

void Store::remove_assignment(int64_t wanted) {
  const long long id = wanted;
  work_->write([&] { work_->sql << "DELETE FROM assignment WHERE id = :i", use(id); });
}

std::vector<Assignment> Store::assignments() const {
  std::vector<Assignment> all;
  work_->read([&] {
    Assignment a;
    long long id = 0;
    Nullable goal;
    soci::statement st = (work_->sql.prepare << "SELECT a.id, c.name, a.task, a.goal, a.runs, a.due FROM assignment a"
                                                " JOIN cohort c ON c.id = a.cohort_id ORDER BY a.id",
                          into(id), into(a.cohort), into(a.task), into(goal.value, goal.is), into(a.runs), into(a.due));
    st.execute();
    while (st.fetch()) {
      a.id = id, a.goal = goal.get();
      all.push_back(a);
    }
  });
  return all;
}

void Store::put_login(const std::string& pseudonym, const std::string& hash) {
  person(pseudonym);
  work_->write([&] {
    soci::session& sql = work_->sql;
    sql << "DELETE FROM login WHERE person_id = (SELECT id FROM person WHERE pseudonym = :p)", use(pseudonym);
    if (!hash.empty())
      sql << "INSERT INTO login (person_id, hash) SELECT id, :h FROM person WHERE pseudonym = :p", use(hash, "h"),
          use(pseudonym, "p");
  });
}

std::string Store::login(const std::string& pseudonym) const {
  std::string hash;
  work_->read([&] {
    work_->sql << "SELECT l.hash FROM login l JOIN person p ON p.id = l.person_id WHERE p.pseudonym = :p", use(pseudonym),
        into(hash);
  });
  return hash;
}

int64_t Store::logins() const {
  long long count = 0;
  work_->read([&] { work_->sql << "SELECT count(*) FROM login", into(count); });
  return count;
}

void Store::log(const std::string& who, const std::string& action, const std::string& about) {
  for (const std::string* text : {&who, &action, &about}) check_text(*text, "log", 256);
  work_->write([&] { insert_entry(work_->sql, work_->options.now(), who, action, about); });
}

std::vector<LogEntry> Store::log_entries() const {
  std::vector<LogEntry> all;
  work_->read([&] {
    LogEntry e;
    soci::statement st = (work_->sql.prepare << "SELECT at, who, action, about FROM entry ORDER BY id", into(e.at), into(e.who),
                          into(e.action), into(e.about));
    st.execute();
    while (st.fetch()) all.push_back(e);
  });
  return all;
}

void Store::add_answers(const std::vector<SurveyAnswer>& answers) {
  for (const SurveyAnswer& a : answers) {
    check_name(a.survey, "survey");
    check_name(a.question, "question");
    check_text(a.version, "version", 64);
    check_text(a.respondent, "respondent", 64);
    check_text(a.group, "group", 64);
    check_text(a.at, "time", 40);
    check_text(a.text, "answer");
  }
  work_->write([&] {
    for (const SurveyAnswer& a : answers) {
      Nullable value(a.value);
      work_->sql << "INSERT INTO answer (survey, version, respondent, panel, answered, question, value, body)"
                    " VALUES (:s, :e, :r, :g, :t, :q, :v, :b)",
          use(a.survey), use(a.version), use(a.respondent), use(a.group), use(a.at), use(a.question),
          use(value.value, value.is), use(a.text);
    }
  });
}

std::vector<SurveyAnswer> Store::answers(const std::string& survey) const {
  std::vector<SurveyAnswer> all;
  work_->read([&] {
    SurveyAnswer a;
    Nullable value;
    soci::statement st = (work_->sql.prepare << "SELECT survey, version, respondent, panel, answered, question, value, body"
                                                " FROM answer WHERE survey = :s ORDER BY id",
                          use(survey), into(a.survey), into(a.version), into(a.respondent), into(a.group), into(a.at),
                          into(a.question), into(value.value, value.is), into(a.text));
    st.execute();
    while (st.fetch()) {
      a.value = value.get();
      all.push_back(a);
    }
  });
  return all;
}

std::vector<std::string> Store::surveys() const {
  std::vector<std::string> all;
  work_->read([&] {
    std::string name;
    soci::statement st = (work_->sql.prepare << "SELECT DISTINCT survey FROM answer ORDER BY survey", into(name));
    st.execute();
    while (st.fetch()) all.push_back(name);
  });
  return all;
}

}  // namespace catgut
