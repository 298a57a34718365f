#include "hm/io/map/map_storage.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/output_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kApplicationId = 0x686d6170;  ///< "hmap", at byte 68 of the file
constexpr int kFilePageBytes = 4096;

constexpr const char* kHeaderSql =
    "CREATE TABLE header(id INTEGER PRIMARY KEY, checksum INTEGER NOT NULL, content TEXT NOT NULL)";
constexpr const char* kPagesSql =
    "CREATE TABLE pages(id INTEGER PRIMARY KEY, z INTEGER NOT NULL, y INTEGER NOT NULL, x INTEGER NOT NULL, "
    "blocks INTEGER NOT NULL, colors INTEGER NOT NULL, checksum INTEGER NOT NULL, content BLOB NOT NULL)";
constexpr const char* kDirectorySql =
    "CREATE UNIQUE INDEX directory ON pages(z, y, x, blocks, colors, checksum)";

std::int64_t now_unix_ms() {
  using std::chrono::duration_cast, std::chrono::milliseconds, std::chrono::system_clock;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

fs::path with_suffix(fs::path path, const char* suffix) { return path += suffix; }

/// Checks the file's signature before opening it with SQLite.
Result<void> check_signature(const fs::path& path) {
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  std::array<char, 100> start{};
  if (file->size() == 0) return fail(ErrorCode::kTruncated, path.string(), "the file is empty");
  const std::size_t have = std::min<std::size_t>(start.size(), file->size());
  if (!file->read(start.data(), have)) return fail(ErrorCode::kUnreadable, path.string(), "cannot be read");
  if (std::string_view(start.data(), std::min<std::size_t>(have, 16)) !=
      std::string_view("SQLite format 3\0", 16).substr(0, have))
    return fail(ErrorCode::kCorrupted, file->at_byte(0), "not a housemartin map");
  if (have < start.size()) return fail(ErrorCode::kTruncated, path.string(), "ends after {} bytes", have);
  if (std::string_view(start.data() + 68, 4) != "hmap")
    return fail(ErrorCode::kCorrupted, file->at_byte(68), "an SQLite file, but not a housemartin map");
  return {};
}

}  // namespace

// ---- opening ----

Result<void> MapStorage::connect() {
  // Rolling back an interrupted save requires write access, even for a reader.
  const bool writable = ::access(path_.c_str(), W_OK) == 0;
  if (mode_ == MapOpenMode::kReadWrite && !writable)
    return fail(ErrorCode::kUnreadable, path_.string(), "no permission to write");
  auto opened =
      SqliteDatabase::open(path_.string(), writable ? SqliteAccess::kReadWrite : SqliteAccess::kRead);
  if (!opened) return forward_error(opened);
  database_ = std::move(*opened);
  // A lenient reader accepts a file shorter than its header says, which SQLite would reject.
  if (lenient())
    if (const auto set = database_.execute("PRAGMA writable_schema=ON"); !set) return set;
  return {};
}

Result<void> MapStorage::check_version_and_size() {
  const auto version = database_.query_integer("PRAGMA user_version");
  if (!version) {
    std::error_code ignored;
    const auto size = fs::file_size(path_, ignored);
    Error error = version.error();
    error.message += fmt::format("; the file has {} bytes and may be truncated", size);
    return tl::make_unexpected(error);
  }
  if (*version > kMapFormatVersion)
    return fail(ErrorCode::kUnsupported, path_.string(),
                "map format version {}; this program knows versions up to {}", *version, kMapFormatVersion);
  if (*version < 1) return fail(ErrorCode::kCorrupted, path_.string(), "map format version {}", *version);
  const auto application = database_.query_integer("PRAGMA application_id");
  if (!application) return forward_error(application);
  if (*application != kApplicationId)
    return fail(ErrorCode::kCorrupted, path_.string(), "not a housemartin map");
  const auto pages = database_.query_integer("PRAGMA page_count");
  const auto page_bytes = database_.query_integer("PRAGMA page_size");
  if (!pages || !page_bytes)
    return fail(ErrorCode::kCorrupted, path_.string(), "the size of the file is not readable");
  std::error_code code;
  const auto size = fs::file_size(path_, code);
  if (!lenient() && (code || static_cast<std::uint64_t>(*pages * *page_bytes) > size))
    return fail(ErrorCode::kTruncated, path_.string(), "ends at byte {} of {}", size, *pages * *page_bytes);
  return {};
}

Result<void> MapStorage::check_tables() {
  for (const char* sql : {kHeaderSql, kPagesSql, kDirectorySql}) {
    auto found = database_.prepare("SELECT count(*) FROM sqlite_schema WHERE sql = ?");
    if (!found) return forward_error(found);
    found->bind(0, std::string_view(sql));
    const auto row = found->step();
    if (!row) return forward_error(row);
    if (found->integer(0) != 1)
      return fail(ErrorCode::kCorrupted, path_.string(), "the tables are not those of a map");
  }
  return {};
}

Result<void> MapStorage::load() {
  auto row = database_.prepare("SELECT checksum, content FROM header WHERE id = 1");
  if (!row) return forward_error(row);
  const auto found = row->step();
  if (!found) return forward_error(found);
  if (!*found) return fail(ErrorCode::kCorrupted, path_.string(), "the header is missing");
  if (record_checksum(row->text(1)) != row->integer(0))
    return fail(ErrorCode::kCorrupted, path_.string(), "the header is damaged (checksum)");
  auto parsed = parse_record(row->text(1), path_.string());
  if (!parsed) return forward_error(parsed);
  record_ = std::move(*parsed);

  auto read = read_directory(database_, path_.string());
  if (read && summarise(*read) == record_.summary) {
    directory_ = std::move(*read);
    return {};
  }
  if (!lenient()) {
    if (!read) return forward_error(read);
    return fail(ErrorCode::kCorrupted, path_.string(),
                "the directory is damaged: {} blocks in {} pages instead of {} in {}",
                summarise(*read).blocks, read->size(), record_.summary.blocks, record_.summary.pages);
  }
  directory_ = salvage_directory(database_, last_row_to_try());
  const std::uint64_t saved = summarise(directory_).blocks;
  lost_blocks_ = record_.summary.blocks - std::min(saved, record_.summary.blocks);
  problems_.push_back(fmt::format("the directory is damaged; {} of {} blocks found without it", saved,
                                  record_.summary.blocks));
  return {};
}

std::int64_t MapStorage::last_row_to_try() {
  // A crafted header may contain any number: skips rows beyond the last one of the file and, where that is
  // damaged, beyond the file's size.
  constexpr std::int64_t kLeastRowBytes = 64;
  std::error_code ignored;
  const auto by_size = static_cast<std::int64_t>(fs::file_size(path_, ignored)) / kLeastRowBytes;
  const auto in_file = database_.query_integer("SELECT max(id) FROM pages NOT INDEXED");
  return std::min(record_.summary.last_row, std::max(by_size, in_file.value_or(0)));
}

Result<void> MapStorage::prepare_statements() {
  auto get = database_.prepare("SELECT content FROM pages NOT INDEXED WHERE id = ?");
  if (!get) return forward_error(get);
  get_page_ = std::move(*get);
  if (mode_ != MapOpenMode::kReadWrite) return {};
  auto put = database_.prepare(
      "INSERT OR REPLACE INTO pages(id, z, y, x, blocks, colors, checksum, content) VALUES(?, ?, ?, ?, ?, ?, "
      "?, ?)");
  auto erase_one = database_.prepare("DELETE FROM pages WHERE id = ?");
  if (!put || !erase_one) return put ? forward_error(erase_one) : forward_error(put);
  put_page_ = std::move(*put);
  erase_page_ = std::move(*erase_one);
  return {};
}

Result<void> MapStorage::check_whole_file() {
  const auto verdict = database_.query_text("PRAGMA quick_check(1)");
  if (!verdict) return forward_error(verdict);
  if (*verdict != "ok") return fail(ErrorCode::kCorrupted, path_.string(), "{}", *verdict);
  return {};
}

Result<MapStorage> MapStorage::open(const fs::path& path, MapOpenMode mode) {
  if (const auto ours = check_signature(path); !ours) return forward_error(ours);
  MapStorage storage;
  storage.path_ = path;
  storage.mode_ = mode;
  using Step = Result<void> (MapStorage::*)();
  std::vector<Step> steps{&MapStorage::connect, &MapStorage::check_version_and_size,
                          &MapStorage::check_tables, &MapStorage::load};
  // Writing into a damaged file would spread the damage.
  if (mode == MapOpenMode::kReadWrite) steps.push_back(&MapStorage::check_whole_file);
  steps.push_back(&MapStorage::prepare_statements);
  for (const Step step : steps)
    if (const auto done = (storage.*step)(); !done) return forward_error(done);
  return storage;
}

Result<void> MapStorage::create_file() {
  auto opened = SqliteDatabase::open(path_.string(), SqliteAccess::kCreate);
  if (!opened) return forward_error(opened);
  database_ = std::move(*opened);
  const auto made = database_.execute(
      fmt::format("PRAGMA page_size={}; PRAGMA application_id={}; PRAGMA user_version={}; BEGIN; {}; {}; {}",
                  kFilePageBytes, kApplicationId, kMapFormatVersion, kHeaderSql, kPagesSql, kDirectorySql));
  if (!made) return made;
  return commit(record_.header);
}

Result<void> MapStorage::create(const fs::path& path, const MapHeader& header) {
  const fs::path fresh = with_suffix(path, ".partial");
  std::error_code code;
  fs::remove(with_suffix(path, ".partial-journal"), code);
  // SQLite takes an empty file for a new database; made here, it is never the target of a link.
  const int made_empty = create_exclusively(fresh);
  if (made_empty < 0) {
    code.assign(errno, std::generic_category());
    return fail(ErrorCode::kUnreadable, fresh.string(), "cannot be created: {}", code.message());
  }
  ::close(made_empty);
  {
    MapStorage storage;
    storage.path_ = fresh;
    storage.mode_ = MapOpenMode::kReadWrite;
    storage.record_.header = header;
    if (header.created_unix_ms == 0) storage.record_.header.created_unix_ms = now_unix_ms();
    if (const auto made = storage.create_file(); !made)
      return fail(made.error().code, path.string(), "{}", made.error().message);
  }
  // The old map is removed before its journal, so that a map is never paired with another map's journal.
  fs::remove(path, code);
  fs::remove(with_suffix(path, "-journal"), code);
  fs::rename(fresh, path, code);
  if (!code) code.assign(sync_to_disk(path.parent_path()), std::generic_category());
  if (code) return fail(ErrorCode::kUnreadable, path.string(), "cannot be written: {}", code.message());
  return {};
}

// ---- pages ----

Result<MapPageBlocks> MapStorage::read_page(const MapPageKey& key, const MapPageEntry& entry) {
  const auto damaged = [&](const std::string& why) {
    return fail(ErrorCode::kCorrupted, path_.string(), "{} (row {}) is damaged: {}", to_string(key),
                entry.row, why);
  };
  get_page_.bind(0, entry.row);
  const auto found = get_page_.step();
  if (!found) return damaged(found.error().message);
  if (!*found) return damaged("there is no such row");
  auto blocks = codec_.decode(get_page_.bytes(0), key, entry);
  get_page_.reset();
  if (!blocks) return damaged(blocks.error().message);
  return blocks;
}

Result<void> MapStorage::settle(Result<void> outcome) {
  if (outcome) return outcome;
  // Reload the in-memory state from the file.
  get_page_.reset();
  if (database_.in_transaction()) (void)database_.execute("ROLLBACK");
  if (const auto loaded = load(); !loaded) directory_.clear();
  return outcome;
}

Result<void> MapStorage::begin() {
  HM_CHECK(mode_ == MapOpenMode::kReadWrite, "{} is open for reading only", path_.string());
  if (database_.in_transaction()) return {};
  return database_.execute("BEGIN IMMEDIATE");
}

Result<void> MapStorage::write_page(const MapPageKey& key, const MapPageBlocks& blocks) {
  MapPageEntry entry;
  const auto packed = codec_.encode(key, blocks, entry);
  const auto place = directory_.find(key);
  entry.row = place != directory_.end() ? place->second.row : record_.summary.last_row + 1;
  put_page_.bind(0, entry.row);
  put_page_.bind(1, key.z);
  put_page_.bind(2, key.y);
  put_page_.bind(3, key.x);
  put_page_.bind(4, std::bit_cast<std::int64_t>(entry.blocks));
  put_page_.bind(5, std::bit_cast<std::int64_t>(entry.colors));
  put_page_.bind(6, std::int64_t{entry.checksum});
  put_page_.bind(7, packed);
  if (const auto stored = put_page_.run(); !stored) return stored;
  record_.summary.last_row = std::max(record_.summary.last_row, entry.row);
  directory_[key] = entry;
  return {};
}

Result<void> MapStorage::remove_page(const MapPageKey& key) {
  const auto place = directory_.find(key);
  erase_page_.bind(0, place->second.row);
  if (const auto removed = erase_page_.run(); !removed) return removed;
  directory_.erase(place);
  return {};
}

Result<void> MapStorage::remove_all_pages() {
  if (const auto emptied = database_.execute("DELETE FROM pages"); !emptied) return emptied;
  directory_.clear();
  return {};
}

Result<void> MapStorage::commit(const MapHeader& header) {
  MapRecord next{header, summarise(directory_)};
  next.header.format_version = kMapFormatVersion;
  next.header.created_unix_ms = record_.header.created_unix_ms;
  next.header.updated_unix_ms = now_unix_ms();
  const std::string text = to_text(next);
  auto statement = database_.prepare("INSERT OR REPLACE INTO header(id, checksum, content) VALUES(1, ?, ?)");
  if (!statement) return forward_error(statement);
  statement->bind(0, record_checksum(text));
  statement->bind(1, text);
  if (const auto stored = statement->run(); !stored) return stored;
  if (const auto committed = database_.execute("COMMIT"); !committed) return committed;
  record_ = std::move(next);
  return {};
}

}  // namespace hm
