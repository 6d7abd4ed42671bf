// SPDX-License-Identifier: Apache-2.0
// report: what pages show, as JSON; and pages, as HTML with that JSON inside. Numbers are computed here; the browser only
// draws. A page loads nothing from elsewhere.
#pragma once
#include <string>

#include "report/survey.h"
#include "store/store.h"

namespace catgut {

std::string session_data(const Store& store, int64_t id);
std::string trainee_data(const Store& store, const std::string& pseudonym);
// All people, sessions (as columns), assignments with progress.
std::string overview_data(const Store& store, const SessionFilter& filter = {});
std::string metric_data(const Store& store, const std::string& metric, const SessionFilter& filter = {});
std::string survey_data(const Questionnaire& q, const SurveyResult& result);

// A self-contained HTML page: style, D3 and charts inside. kind: "session", "trainee", "survey", "educator", "form", "login";
// data: JSON. nonce: for the server's content policy; empty: the file has its own, which allows only what is inside.
std::string html_page(const std::string& kind, const std::string& title, const std::string& data,
                      const std::string& nonce = "");
std::string html_escape(const std::string& text);

}  // namespace catgut
