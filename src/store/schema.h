// SPDX-License-Identifier: Apache-2.0
// store: tables of the database and their versions. A version is a list of statements that turn the version before into it;
// each is applied in one transaction. A released version is never edited: a change is a new version.
#pragma once
#include <string>
#include <vector>

namespace catgut {

// {id} stands for the type of a key that counts up, which differs between databases.
const std::vector<std::vector<std::string>>& schema_versions();

// Tables in an order in which their rows can be inserted, with their columns: n whole number, r number, t text. The first
// column of a table with `key` counts up.
struct Table {
  std::string name;
  bool key;
  std::vector<std::pair<char, std::string>> column;
};
const std::vector<Table>& schema_tables();

}  // namespace catgut
