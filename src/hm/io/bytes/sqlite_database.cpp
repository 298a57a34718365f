#include "hm/io/bytes/sqlite_database.hpp"

#include <sqlite3.h>

#include "hm/core/check.hpp"

namespace hm {
namespace {

ErrorCode code_of(int sqlite_code) {
  switch (sqlite_code & 0xff) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_SCHEMA:
    case SQLITE_FORMAT:
      return ErrorCode::kCorrupted;
    case SQLITE_NOMEM:
      return ErrorCode::kOutOfMemory;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PERM:
    case SQLITE_READONLY:
    case SQLITE_IOERR:
    case SQLITE_FULL:
    case SQLITE_CANTOPEN:
      return ErrorCode::kUnreadable;
    default:
      return ErrorCode::kInternal;
  }
}

tl::unexpected<Error> database_error(int sqlite_code, sqlite3* database, const std::string& name) {
  const char* details = database ? sqlite3_errmsg(database) : sqlite3_errstr(sqlite_code);
  const bool busy = (sqlite_code & 0xff) == SQLITE_BUSY;
  return fail(code_of(sqlite_code), name, "{}{} (SQLite {})", busy ? "in use by another program: " : "",
              details, sqlite_code);
}

constexpr int kBusyTimeoutMs = 3000;

}  // namespace

void SqliteStatement::Finalizer::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
void SqliteDatabase::Closer::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

void SqliteStatement::bind(int parameter, std::int64_t value) {
  const int code = sqlite3_bind_int64(statement_.get(), parameter + 1, value);
  HM_CHECK(code == SQLITE_OK, "parameter {}: {}", parameter, sqlite3_errstr(code));
}

void SqliteStatement::bind(int parameter, std::string_view text) {
  const int code = sqlite3_bind_text64(statement_.get(), parameter + 1, text.data(), text.size(),
                                       SQLITE_STATIC, SQLITE_UTF8);
  HM_CHECK(code == SQLITE_OK, "parameter {}: {}", parameter, sqlite3_errstr(code));
}

void SqliteStatement::bind(int parameter, std::span<const std::byte> bytes) {
  const int code =
      sqlite3_bind_blob64(statement_.get(), parameter + 1, bytes.data(), bytes.size(), SQLITE_STATIC);
  HM_CHECK(code == SQLITE_OK, "parameter {}: {}", parameter, sqlite3_errstr(code));
}

Result<bool> SqliteStatement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) {
    auto error = database_error(code, sqlite3_db_handle(statement_.get()), name_);
    reset();
    return error;
  }
  reset();
  return false;
}

Result<void> SqliteStatement::run() {
  while (true) {
    const auto row = step();
    if (!row) return forward_error(row);
    if (!*row) return {};
  }
}

void SqliteStatement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t SqliteStatement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string_view SqliteStatement::text(int column) const {
  const auto* begin = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  return begin ? std::string_view(begin,
                                  static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)))
               : std::string_view();
}

std::span<const std::byte> SqliteStatement::bytes(int column) const {
  const auto* begin = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  return {begin, begin ? static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)) : 0};
}

Result<SqliteDatabase> SqliteDatabase::open(const std::string& path, SqliteAccess access) {
  SqliteDatabase database;
  database.name_ = path;
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  flags |= access == SqliteAccess::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  if (access == SqliteAccess::kCreate) flags |= SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  database.database_.reset(handle);
  if (code != SQLITE_OK) return database_error(code, handle, path);
  sqlite3_busy_timeout(handle, kBusyTimeoutMs);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  const auto hardened = database.execute("PRAGMA cell_size_check=ON; PRAGMA mmap_size=0");
  if (!hardened) return forward_error(hardened);
  return database;
}

Result<void> SqliteDatabase::execute(const std::string& sql) {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return database_error(code, database_.get(), name_);
  return {};
}

Result<SqliteStatement> SqliteDatabase::prepare(std::string_view sql) {
  sqlite3_stmt* handle = nullptr;
  const int code =
      sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &handle, nullptr);
  if (code != SQLITE_OK) return database_error(code, database_.get(), name_);
  SqliteStatement statement;
  statement.statement_.reset(handle);
  statement.name_ = name_;
  return statement;
}

Result<SqliteStatement> SqliteDatabase::first_row(std::string_view sql) {
  auto statement = prepare(sql);
  if (!statement) return statement;
  const auto row = statement->step();
  if (!row) return forward_error(row);
  if (!*row) return fail(ErrorCode::kCorrupted, name_, "nothing found by \"{}\"", sql);
  return statement;
}

Result<std::int64_t> SqliteDatabase::query_integer(std::string_view sql) {
  return first_row(sql).map([](const SqliteStatement& row) { return row.integer(0); });
}

Result<std::string> SqliteDatabase::query_text(std::string_view sql) {
  return first_row(sql).map([](const SqliteStatement& row) { return std::string(row.text(0)); });
}

bool SqliteDatabase::in_transaction() const { return sqlite3_get_autocommit(database_.get()) == 0; }

}  // namespace hm
