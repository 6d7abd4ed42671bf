// SPDX-License-Identifier: Apache-2.0
// app/window: what becomes of a finished session: into the store, with the trainee's learning curve back; and the answers of a
// questionnaire. A program built without the store keeps nothing and says so.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "runtime/live.h"

namespace catgut {

struct KeepOptions {
  std::string trainee;   // pseudonym; empty: nothing is kept
  std::string store;     // file or URL; empty: the default
  std::string task;      // procedure or scene
  std::string settings;  // of the session, as JSON
};

struct KeptSession {
  std::string line;           // "stored as session 41 of T07", or why not; empty: nothing was kept
  bool bad = false;           // not stored
  std::vector<double> curve;  // [%] scores of this trainee in this task, oldest first, this session last
};

bool can_keep();  // built with the store
// Throws InputError when sessions of this trainee or answers to this survey cannot be kept; empty: nothing to keep.
void check_keeping(const std::string& trainee, const std::string& survey);
// Never throws: a fault is the line.
KeptSession keep_session(const LiveResult& result, const KeepOptions& options);

// A questionnaire to fill in.
struct SurveyForm {
  struct Question {
    std::string key, text;
    bool free = false;
    int rating = 0;  // 0: no answer
    std::string words;
  };
  std::string name, version, title, intro;
  int low = 1, high = 5;
  std::map<int, std::string> label;
  std::vector<std::string> groups;
  std::string group;
  std::vector<Question> question;
  bool complete() const;  // a group, and an answer to every rated question
};
SurveyForm open_survey(const std::string& name);  // throws InputError
// Throws InputError. respondent: a pseudonym; empty: one is made.
void keep_answers(const SurveyForm& form, const std::string& respondent, const std::string& store);

}  // namespace catgut
