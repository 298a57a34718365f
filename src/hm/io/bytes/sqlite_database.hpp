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

/// A prepared SQL statement. Parameters and columns count from 0. Values stay valid until the next step() or
/// reset().
class SqliteStatement {
 public:
  SqliteStatement() = default;

  void bind(int parameter, std::int64_t value);
  /// The text or bytes must live until the statement is reset.
  void bind(int parameter, std::string_view text);
  void bind(int parameter, std::span<const std::byte> bytes);

  /// True: a row is there; false: done (the statement is then reset).
  Result<bool> step();
  /// Runs a statement without rows to its end.
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

/// One connection to an SQLite file, hardened against hostile contents. Errors carry the file's name.
class SqliteDatabase {
 public:
  SqliteDatabase() = default;
  static Result<SqliteDatabase> open(const std::string& path, SqliteAccess access);

  Result<void> execute(const std::string& sql);
  Result<SqliteStatement> prepare(std::string_view sql);
  /// The first column of the first row; an error when there is no row.
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
