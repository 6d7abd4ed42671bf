// SPDX-License-Identifier: Apache-2.0
// store: the tables; see schema.h. Times are texts in UTC (ISO 8601), which sort as times and mean the same in every database.
#include "store/schema.h"

namespace catgut {

const std::vector<std::vector<std::string>>& schema_versions() {
  static const std::vector<std::vector<std::string>> kVersions{
      // 1: sessions, people, cohorts, assignments.
      {"CREATE TABLE cohort (id {id}, name TEXT NOT NULL UNIQUE)",
       "CREATE TABLE person (id {id}, pseudonym TEXT NOT NULL UNIQUE,"
       " role TEXT NOT NULL CHECK (role IN ('trainee', 'educator', 'staff')),"
       " cohort_id BIGINT REFERENCES cohort(id) ON DELETE SET NULL, level TEXT NOT NULL, created TEXT NOT NULL)",
       "CREATE TABLE session (id {id}, uid TEXT NOT NULL UNIQUE,"
       " person_id BIGINT NOT NULL REFERENCES person(id) ON DELETE CASCADE, task TEXT NOT NULL, started TEXT NOT NULL,"
       " duration_s DOUBLE PRECISION NOT NULL, score DOUBLE PRECISION, score_max DOUBLE PRECISION, passed INTEGER NOT NULL,"
       " rubric TEXT NOT NULL, settings TEXT NOT NULL, program TEXT NOT NULL, station TEXT NOT NULL, recording TEXT NOT NULL,"
       " details TEXT NOT NULL)",
       "CREATE INDEX session_person ON session (person_id)",
       "CREATE TABLE metric (session_id BIGINT NOT NULL REFERENCES session(id) ON DELETE CASCADE, name TEXT NOT NULL,"
       " value DOUBLE PRECISION NOT NULL, unit TEXT NOT NULL, low DOUBLE PRECISION, high DOUBLE PRECISION,"
       " PRIMARY KEY (session_id, name))",
       "CREATE INDEX metric_name ON metric (name)",
       "CREATE TABLE event (session_id BIGINT NOT NULL REFERENCES session(id) ON DELETE CASCADE, ordinal INTEGER NOT NULL,"
       " at_s DOUBLE PRECISION NOT NULL, kind TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (session_id, ordinal))",
       "CREATE TABLE lost (session_id BIGINT NOT NULL REFERENCES session(id) ON DELETE CASCADE, ordinal INTEGER NOT NULL,"
       " item TEXT NOT NULL, reason TEXT NOT NULL, place TEXT NOT NULL, points DOUBLE PRECISION NOT NULL,"
       " at_s DOUBLE PRECISION, critical INTEGER NOT NULL, PRIMARY KEY (session_id, ordinal))",
       "CREATE TABLE assignment (id {id}, cohort_id BIGINT NOT NULL REFERENCES cohort(id) ON DELETE CASCADE,"
       " task TEXT NOT NULL, goal DOUBLE PRECISION, runs INTEGER NOT NULL, due TEXT NOT NULL)"},
      // 2: surveys, logins of the web page, and a log of who did what.
      {"CREATE TABLE answer (id {id}, survey TEXT NOT NULL, version TEXT NOT NULL, respondent TEXT NOT NULL,"
       " panel TEXT NOT NULL, answered TEXT NOT NULL, question TEXT NOT NULL, value DOUBLE PRECISION, body TEXT NOT NULL)",
       "CREATE INDEX answer_survey ON answer (survey)",
       "CREATE TABLE login (person_id BIGINT NOT NULL PRIMARY KEY REFERENCES person(id) ON DELETE CASCADE, hash TEXT NOT NULL)",
       "CREATE TABLE entry (id {id}, at TEXT NOT NULL, who TEXT NOT NULL, action TEXT NOT NULL, about TEXT NOT NULL)"},
  };
  return kVersions;
}

const std::vector<Table>& schema_tables() {
  static const std::vector<Table> kTables{
      {"cohort", true, {{'n', "id"}, {'t', "name"}}},
      {"person", true, {{'n', "id"}, {'t', "pseudonym"}, {'t', "role"}, {'n', "cohort_id"}, {'t', "level"}, {'t', "created"}}},
      {"session",
       true,
       {{'n', "id"},
        {'t', "uid"},
        {'n', "person_id"},
        {'t', "task"},
        {'t', "started"},
        {'r', "duration_s"},
        {'r', "score"},
        {'r', "score_max"},
        {'n', "passed"},
        {'t', "rubric"},
        {'t', "settings"},
        {'t', "program"},
        {'t', "station"},
        {'t', "recording"},
        {'t', "details"}}},
      {"metric", false, {{'n', "session_id"}, {'t', "name"}, {'r', "value"}, {'t', "unit"}, {'r', "low"}, {'r', "high"}}},
      {"event", false, {{'n', "session_id"}, {'n', "ordinal"}, {'r', "at_s"}, {'t', "kind"}, {'t', "body"}}},
      {"lost",
       false,
       {{'n', "session_id"},
        {'n', "ordinal"},
        {'t', "item"},
        {'t', "reason"},
        {'t', "place"},
        {'r', "points"},
        {'r', "at_s"},
        {'n', "critical"}}},
      {"assignment", true, {{'n', "id"}, {'n', "cohort_id"}, {'t', "task"}, {'r', "goal"}, {'n', "runs"}, {'t', "due"}}},
      {"answer",
       true,
       {{'n', "id"},
        {'t', "survey"},
        {'t', "version"},
        {'t', "respondent"},
        {'t', "panel"},
        {'t', "answered"},
        {'t', "question"},
        {'r', "value"},
        {'t', "body"}}},
      {"login", false, {{'n', "person_id"}, {'t', "hash"}}},
      {"entry", true, {{'n', "id"}, {'t', "at"}, {'t', "who"}, {'t', "action"}, {'t', "about"}}},
  };
  return kTables;
}

}  // namespace catgut
