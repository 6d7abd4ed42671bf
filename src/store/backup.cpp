// SPDX-License-Identifier: Apache-2.0
// store: backup and restore. A backup is a SQLite store with the rows of all tables, whatever the database: so it can be
// opened, checked and moved between SQLite and PostgreSQL.
#include <fmt/format.h>

#include <filesystem>

#include "core/check.h"
#include "store/schema.h"
#include "store/sql.h"

namespace catgut {
namespace {
using soci::into;
using soci::use;

// One value of a row, of any type.
struct Cell {
  char type = 't';
  long long whole = 0;
  double real = 0;
  std::string text;
  soci::indicator is = soci::i_null;
};

void copy_table(const Table& table, soci::session& from, soci::session& to) {
  std::string columns, places;
  std::vector<Cell> row(table.column.size());
  for (size_t i = 0; i < row.size(); ++i) {
    row[i].type = table.column[i].first;
    columns += (i ? ", " : "") + table.column[i].second;
    places += fmt::format("{}:c{}", i ? ", " : "", i);
  }
  soci::statement read(from), write(to);
  for (Cell& c : row) {
    if (c.type == 'n') read.exchange(into(c.whole, c.is)), write.exchange(use(c.whole, c.is));
    if (c.type == 'r') read.exchange(into(c.real, c.is)), write.exchange(use(c.real, c.is));
    if (c.type == 't') read.exchange(into(c.text, c.is)), write.exchange(use(c.text, c.is));
  }
  read.alloc();
  read.prepare("SELECT " + columns + " FROM " + table.name + " ORDER BY 1");
  read.define_and_bind();
  write.alloc();
  write.prepare("INSERT INTO " + table.name + " (" + columns + ") VALUES (" + places + ")");
  write.define_and_bind();
  read.execute();
  while (read.fetch()) write.execute(true);
}

void copy_all(const Store::Work& from, const Store::Work& to) {
  from.read([&] {
    to.write([&] {
      for (const Table& table : schema_tables()) {
        long long rows = 0;
        to.sql << "SELECT count(*) FROM " + table.name, into(rows);
        if (rows > 0) throw InputError(to.name, "is not empty", "restore into a new store");
        copy_table(table, from.sql, to.sql);
        if (!to.sqlite && table.key)  // keys continue after the largest one
          to.sql << "SELECT setval(pg_get_serial_sequence('" + table.name +
                        "', 'id'), COALESCE(max(id), 1), max(id) IS NOT NULL) FROM " + table.name;
      }
    });
  });
}

}  // namespace

void Store::backup(const std::string& path) const {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(path, error)) throw InputError(path, "exists already", "name a new file");
  const std::string part = path + ".part";
  fs::remove(part, error);
  try {
    {
      StoreOptions options;
      options.where = part;
      const Store target(options);
      copy_all(*work_, *target.work_);
      if (const std::string fault = target.check(); !fault.empty()) throw InputError(part, fault, "check the disk");
    }
    fs::rename(part, path);
  } catch (const fs::filesystem_error&) {
    fs::remove(part, error);
    throw InputError(path, "cannot be written", "choose another path");
  } catch (...) {
    fs::remove(part, error);
    fs::remove(part + "-journal", error);
    throw;
  }
}

void Store::restore(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  StoreOptions options;
  options.where = path;
  options.read_only = true;
  // A backup of an older program is migrated in a copy: the backup itself is not changed.
  int found = 0;
  {
    Work old(options);
    try {
      found = old.version();
    } catch (const soci::soci_error& fault) { old.fail(fault); }
  }
  if (found == 0) throw InputError(path, "is not a backup of a session store", "name another file");
  std::string copy;
  if (found < schema_version()) {
    copy = (fs::temp_directory_path() / fmt::format("catgut-restore-{}.db", static_cast<const void*>(this))).string();
    fs::copy_file(path, copy, fs::copy_options::overwrite_existing);
    options.where = copy;
    options.read_only = false;
  }
  try {
    const Store source(options);
    copy_all(*source.work_, *work_);
  } catch (...) {
    if (!copy.empty()) fs::remove(copy, error);
    throw;
  }
  if (!copy.empty()) fs::remove(copy, error);
}

std::string Store::check() const {
  if (!work_->sqlite) return "";
  std::string result;
  work_->read([&] { work_->sql << "PRAGMA integrity_check(1)", into(result); });
  return result == "ok" ? "" : "is damaged: " + result;
}

}  // namespace catgut
