#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/sqlite_database.hpp"
#include "hm/io/map/map_directory.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/io/map/map_page.hpp"
#include "hm/io/map/map_record.hpp"

namespace hm {

/// Open map file: its tables, its directory in memory, and access to one page at a time.
class MapStorage {
 public:
  /// Opens a file and checks it, see MapFile::open().
  static Result<MapStorage> open(const std::filesystem::path& path, MapOpenMode mode);
  /// Creates a file without pages at `path`, see MapFile::create().
  static Result<void> create(const std::filesystem::path& path, const MapHeader& header);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Header as of the last commit.
  [[nodiscard]] const MapHeader& header() const { return record_.header; }
  /// Directory including changes since the last commit.
  [[nodiscard]] const MapDirectory& directory() const { return directory_; }
  [[nodiscard]] bool lenient() const { return mode_ == MapOpenMode::kReadLenient; }
  /// Number of blocks lost when opening leniently, and descriptions of the damage.
  [[nodiscard]] std::uint64_t lost_blocks() const { return lost_blocks_; }
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

  /// Reads the blocks of a page, valid until the next call. Errors name the page.
  Result<MapPageBlocks> read_page(const MapPageKey& key, const MapPageEntry& entry);

  /// Starts a transaction unless one is open.
  Result<void> begin();
  Result<void> write_page(const MapPageKey& key, const MapPageBlocks& blocks);
  Result<void> remove_page(const MapPageKey& key);
  Result<void> remove_all_pages();
  /// Writes the header and ends the transaction.
  Result<void> commit(const MapHeader& header);
  /// Returns the outcome of a change; if it failed, first rolls back everything since the last commit.
  Result<void> settle(Result<void> outcome);

 private:
  Result<void> create_file();
  Result<void> connect();
  Result<void> check_version_and_size();
  Result<void> check_tables();
  Result<void> load();
  std::int64_t last_row_to_try();
  Result<void> check_whole_file();
  Result<void> prepare_statements();

  std::filesystem::path path_;
  MapOpenMode mode_ = MapOpenMode::kRead;
  SqliteDatabase database_;
  MapRecord record_;
  MapDirectory directory_;
  std::uint64_t lost_blocks_ = 0;
  std::vector<std::string> problems_;
  MapPageCodec codec_;
  SqliteStatement get_page_, put_page_, erase_page_;
};

}  // namespace hm
