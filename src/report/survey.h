// SPDX-License-Identifier: Apache-2.0
// report: questionnaires as data (surveys/NAME.toml), answers as CSV, and their statistics: box plots, medians, percentages
// (paper 3.6, table 5 and figure 27).
#pragma once
#include <map>
#include <string>
#include <vector>

#include "report/statistics.h"
#include "store/store.h"

namespace catgut {

struct Question {
  std::string key, text;
  bool free = false;  // a text instead of a rating
};

struct Questionnaire {
  std::string name, version, title, intro, source;
  int low = 1, high = 5;             // of the scale
  int favorable = 3;                 // ratings from here count as favorable
  std::map<int, std::string> label;  // of points of the scale
  std::vector<std::string> groups;   // to choose from; empty: free
  std::vector<Question> question;
};

// A name from surveys/ or a path. Throws InputError with file and line.
Questionnaire read_questionnaire(const std::string& name_or_path);
Questionnaire parse_questionnaire(const std::string& toml, const std::string& where, const std::string& name);
std::vector<std::string> questionnaire_names();

// Throws InputError for a rating outside the scale, or a question that is not in the questionnaire.
void check_answers(const Questionnaire& q, const std::vector<SurveyAnswer>& answers);

// CSV with one row per respondent: respondent, group, and a column for every question; an empty cell: not answered.
std::vector<SurveyAnswer> answers_of_csv(const Questionnaire& q, const std::string& csv, const std::string& where,
                                         const std::string& now);
std::string answers_csv(const Questionnaire& q, const std::vector<SurveyAnswer>& answers);

struct QuestionResult {
  std::string key, text, group;  // group empty: all respondents
  Box box;
  size_t favorable = 0;       // ratings at or above the questionnaire's limit
  std::vector<size_t> count;  // of each rating from low to high
};
struct SurveyResult {
  std::vector<QuestionResult> row;  // every question for all, then for each group
  std::map<std::string, double> p;  // of the first two groups' difference, by question (exact Mann-Whitney)
  std::map<std::string, std::vector<std::string>> text;  // free answers by question
  size_t respondents = 0;
};
SurveyResult evaluate(const Questionnaire& q, const std::vector<SurveyAnswer>& answers);
std::string survey_summary(const Questionnaire& q, const SurveyResult& result);  // lines for a terminal

}  // namespace catgut
