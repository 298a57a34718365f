#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "hm/core/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace hm {

/// Prepared SQL statement. Parameters and columns count from 0. Values stay valid until the next step() or
/// reset().
class SqliteStatement {
 public:
  SqliteStatement() = default;

  void bind(int parameter, std::int64_t value);
  /// Binds without copying: the text or bytes must outlive the statement's use, up to reset().
  void bind(int parameter, std::string_view text);
  void bind(int parameter, std::span<const std::byte> bytes);

  /// Advances to the next row: true if there is one; false when done (the statement is then reset).
  Result<bool> step();
  /// Runs a statement that returns no rows.
  Result<void> run();
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] std::span<const std::byte> bytes(int column) const;

 private:
  friend class SqliteDatabase;
  struct Finalizer {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalizer> statement_;
  std::string name_;
};

enum class SqliteAccess { kRead, kReadWrite, kCreate };

/// Connection to an SQLite file, hardened against malicious contents. Errors name the file.
class SqliteDatabase {
 public:
  SqliteDatabase() = default;
  static Result<SqliteDatabase> open(const std::string& path, SqliteAccess access);

  Result<void> execute(const std::string& sql);
  Result<SqliteStatement> prepare(std::string_view sql);
  /// First column of the first row; error when there is no row.
  Result<std::int64_t> query_integer(std::string_view sql);
  Result<std::string> query_text(std::string_view sql);
  [[nodiscard]] bool in_transaction() const;

 private:
  struct Closer {
    void operator()(sqlite3* database) const;
  };
  Result<SqliteStatement> first_row(std::string_view sql);
  std::unique_ptr<sqlite3, Closer> database_;
  std::string name_;
};

}  // namespace hm
