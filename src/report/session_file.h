// SPDX-License-Identifier: Apache-2.0
// report: sessions as JSON: reads what `catgut assess`, an interactive session and an export write; writes exports.
#pragma once
#include <string>
#include <vector>

#include "store/store.h"

namespace catgut {

// Adds what `json` holds to the session. Accepts an exported session, a result of `catgut assess`, and session_json
// (runtime/report: stitches and tension); several files of one session may be read one after the other. Throws InputError.
void read_session_json(const std::string& json, const std::string& where, Session& session);
// The sessions of an export: one object, or an object with a list `sessions`.
std::vector<Session> read_sessions_json(const std::string& json, const std::string& where);

std::string session_to_json(const Session& session);
// Everything about a person: role, cohort, sessions, answers.
std::string person_to_json(const Store& store, const std::string& pseudonym);
std::string sessions_to_json(const Store& store, const SessionFilter& filter);
// xAPI 1.0.3: a list of statements, one per session: actor (account with the pseudonym), verb, task, score, duration.
// home: the IRI under which this institution names accounts and tasks.
std::string sessions_to_xapi(const Store& store, const SessionFilter& filter, const std::string& home);

}  // namespace catgut
