// SPDX-License-Identifier: Apache-2.0
// app/window: see keeping.h.
#include "window/keeping.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "core/check.h"
#include "window/settings.h"
#ifdef CATGUT_WITH_STORE
#include "commands/keep.h"
#include "report/survey.h"
#endif

namespace catgut {

bool SurveyForm::complete() const {
  const bool rated = std::all_of(question.begin(), question.end(), [](const Question& q) { return q.free || q.rating > 0; });
  return rated && (groups.empty() || !group.empty());
}

void check_keeping(const std::string& trainee, const std::string& survey) {
  if (!trainee.empty() && !is_pseudonym(trainee))
    throw InputError("--trainee " + trainee, "this is not a pseudonym",
                     "use letters, digits, dot, dash and underscore, at most 64");
  if (!trainee.empty() && !can_keep())
    throw InputError("--trainee", "this program was built without the store", "build with -DCATGUT_STORE=ON");
  if (!survey.empty()) open_survey(survey);
}

#ifdef CATGUT_WITH_STORE

bool can_keep() { return true; }

KeptSession keep_session(const LiveResult& result, const KeepOptions& o) {
  KeptSession kept;
  if (o.trainee.empty()) return kept;
  try {
    StoreOptions where;
    where.where = o.store;
    Store store(where);
    Session s = session_of(result.assessment, result.map, "session");
    s.trainee = o.trainee, s.task = o.task, s.settings = o.settings;
    char host[65]{};
    if (gethostname(host, sizeof host - 1) == 0) s.station = host;
    s.started = utc_now();
    s.uid = session_uid(o.trainee, o.task);
    // An undone bite begins another file; the last one holds the end that was scored.
    if (!result.recorded.empty()) s.recording = keep_recording(store, result.recorded.back(), s.uid);
    std::string note;
    const int64_t id = store.add(s, &note);
    kept.line = fmt::format("stored as session {} of {}", id, o.trainee) + (note.empty() ? "" : "; " + note);
    SessionFilter mine;
    mine.trainee = o.trainee, mine.task = o.task;
    for (const Session& earlier : store.sessions(mine))
      if (earlier.score_max > 0) kept.curve.push_back(100 * earlier.score / earlier.score_max);
  } catch (const std::exception& error) {
    kept.line = std::string("not stored: ") + error.what();
    kept.bad = true;
  }
  return kept;
}

SurveyForm open_survey(const std::string& name) {
  const Questionnaire q = read_questionnaire(name);
  SurveyForm f;
  f.name = q.name, f.version = q.version, f.title = q.title, f.intro = q.intro;
  f.low = q.low, f.high = q.high, f.label = q.label, f.groups = q.groups;
  for (const Question& one : q.question) f.question.push_back({one.key, one.text, one.free, 0, ""});
  return f;
}

void keep_answers(const SurveyForm& f, const std::string& respondent, const std::string& where) {
  StoreOptions o;
  o.where = where;
  Store store(o);
  std::vector<SurveyAnswer> all;
  const std::string at = utc_now();
  std::string who = respondent.empty() ? "guest-" + at : respondent;
  std::erase(who, ':');
  for (const SurveyForm::Question& q : f.question) {
    if (q.free ? q.words.empty() : q.rating == 0) continue;
    all.push_back({f.name, f.version, who, f.group, at, q.key, q.free ? kUnknown : static_cast<double>(q.rating), q.words});
  }
  check_answers(read_questionnaire(f.name), all);
  store.add_answers(all);
}

#else

bool can_keep() { return false; }
KeptSession keep_session(const LiveResult&, const KeepOptions& o) {
  if (o.trainee.empty()) return {};
  return {"not stored: this program was built without the store", true, {}};
}
SurveyForm open_survey(const std::string& name) {
  throw InputError(name, "this program was built without the store", "build with -DCATGUT_STORE=ON");
}
void keep_answers(const SurveyForm&, const std::string&, const std::string&) {}

#endif

}  // namespace catgut
