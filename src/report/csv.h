// SPDX-License-Identifier: Apache-2.0
// report: comma-separated values (RFC 4180), read from files that others wrote and written for spreadsheets.
#pragma once
#include <string>
#include <vector>

#include "store/store.h"

namespace catgut {

using CsvRow = std::vector<std::string>;
// Rows of cells. Accepts quotes, CRLF, a byte order mark; separator 0: the more frequent of , ; and tab in the first row. Blank
// lines are skipped. Throws InputError with the line: an open quote, rows of different length, more than 200 columns or a
// million rows.
std::vector<CsvRow> read_csv(const std::string& text, const std::string& where, char separator = 0);
// A cell, quoted where needed. A text that a spreadsheet would take for a formula gets a leading apostrophe.
std::string csv_cell(const std::string& text);
std::string csv_number(double value);  // the fewest digits that read back to the same bits; empty: unknown

// A table of a learning curve as sessions. The mapping is a TOML file: docs/sessions.md describes its keys.
std::vector<Session> sessions_of_table(const std::string& csv, const std::string& where, const std::string& mapping,
                                       const std::string& mapping_where, std::vector<Person>* people);

// One row per session with a column for every metric; id, trainee, cohort, task, start, duration, score.
std::string sessions_csv(const Store& store, const SessionFilter& filter);

}  // namespace catgut
