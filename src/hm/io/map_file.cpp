#include "hm/io/map_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <system_error>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/io/input_file.hpp"
#include "hm/io/map_directory.hpp"
#include "hm/io/map_page.hpp"
#include "hm/io/map_record.hpp"
#include "hm/io/sqlite_database.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kApplicationId = 0x686d6170;  ///< "hmap", at byte 68 of the file
constexpr std::size_t kMaxProblems = 20;

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

/// Before SQLite sees the file: is it one of ours at all?
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

struct MapFile::Impl {
  fs::path path;
  MapOpenMode mode = MapOpenMode::kRead;
  SqliteDatabase database;
  MapRecord record;               ///< as of the last commit
  MapDirectory directory;         ///< including changes since
  std::uint64_t lost_blocks = 0;  ///< found missing when opening leniently
  std::vector<std::string> problems;
  mutable MapPageCodec codec;
  SqliteStatement put_page, erase_page;
  mutable SqliteStatement get_page;

  [[nodiscard]] std::string name() const { return path.string(); }
  [[nodiscard]] bool lenient() const { return mode == MapOpenMode::kReadLenient; }

  Result<void> connect();
  Result<void> check_size();
  Result<void> check_schema();
  Result<void> load();
  Result<void> prepare_statements();
  Result<void> begin();
  Result<MapPageBlocks> read_page(const MapPageKey& key, const MapPageEntry& entry) const;
  Result<void> write_page(const MapPageKey& key, const MapPageBlocks& blocks);
  Result<void> remove_page(const MapPageKey& key);
  Result<void> write_record(MapRecord next);
  Result<void> settle(Result<void> outcome);
};

// ---- opening ----

Result<void> MapFile::Impl::connect() {
  // Rolling back an interrupted save takes write access, even for a reader.
  const bool writable = ::access(path.c_str(), W_OK) == 0;
  if (mode == MapOpenMode::kReadWrite && !writable)
    return fail(ErrorCode::kUnreadable, name(), "no permission to write");
  auto opened = SqliteDatabase::open(name(), writable ? SqliteAccess::kReadWrite : SqliteAccess::kRead);
  if (!opened) return forward_error(opened);
  database = std::move(*opened);
  // A lenient reader takes a file that is shorter than it says, which SQLite otherwise refuses outright.
  if (lenient())
    if (const auto set = database.execute("PRAGMA writable_schema=ON"); !set) return set;
  return {};
}

Result<void> MapFile::Impl::check_size() {
  const auto version = database.query_integer("PRAGMA user_version");
  if (!version) {
    std::error_code ignored;
    const auto size = fs::file_size(path, ignored);
    Error error = version.error();
    error.message += fmt::format("; the file has {} bytes and may be truncated", size);
    return tl::make_unexpected(error);
  }
  if (*version > kMapFormatVersion)
    return fail(ErrorCode::kUnsupported, name(),
                "map format version {}; this program knows versions up to {}", *version, kMapFormatVersion);
  if (*version < 1) return fail(ErrorCode::kCorrupted, name(), "map format version {}", *version);
  const auto application = database.query_integer("PRAGMA application_id");
  if (!application) return forward_error(application);
  if (*application != kApplicationId) return fail(ErrorCode::kCorrupted, name(), "not a housemartin map");
  const auto pages = database.query_integer("PRAGMA page_count");
  const auto page_bytes = database.query_integer("PRAGMA page_size");
  if (!pages || !page_bytes)
    return fail(ErrorCode::kCorrupted, name(), "the size of the file is not readable");
  std::error_code code;
  const auto size = fs::file_size(path, code);
  if (!lenient() && (code || static_cast<std::uint64_t>(*pages * *page_bytes) > size))
    return fail(ErrorCode::kTruncated, name(), "ends at byte {} of {}", size, *pages * *page_bytes);
  return {};
}

Result<void> MapFile::Impl::check_schema() {
  for (const char* sql : {kHeaderSql, kPagesSql, kDirectorySql}) {
    auto found = database.prepare("SELECT count(*) FROM sqlite_schema WHERE sql = ?");
    if (!found) return forward_error(found);
    found->bind(0, std::string_view(sql));
    const auto row = found->step();
    if (!row) return forward_error(row);
    if (found->integer(0) != 1)
      return fail(ErrorCode::kCorrupted, name(), "the tables are not those of a map");
  }
  return {};
}

Result<void> MapFile::Impl::load() {
  auto row = database.prepare("SELECT checksum, content FROM header WHERE id = 1");
  if (!row) return forward_error(row);
  const auto found = row->step();
  if (!found) return forward_error(found);
  if (!*found) return fail(ErrorCode::kCorrupted, name(), "the header is missing");
  if (record_checksum(row->text(1)) != row->integer(0))
    return fail(ErrorCode::kCorrupted, name(), "the header is damaged (checksum)");
  auto parsed = parse_record(row->text(1), name());
  if (!parsed) return forward_error(parsed);
  record = std::move(*parsed);

  auto read = read_directory(database, name());
  if (read && summarise(*read) == record.summary) {
    directory = std::move(*read);
    return {};
  }
  if (!lenient()) {
    if (!read) return forward_error(read);
    return fail(ErrorCode::kCorrupted, name(),
                "the directory is damaged: {} blocks in {} pages instead of {} in {}",
                summarise(*read).blocks, read->size(), record.summary.blocks, record.summary.pages);
  }
  directory = salvage_directory(database, record.summary.last_row);
  const std::uint64_t saved = summarise(directory).blocks;
  lost_blocks = record.summary.blocks - std::min(saved, record.summary.blocks);
  problems.push_back(fmt::format("the directory is damaged; {} of {} blocks found without it", saved,
                                 record.summary.blocks));
  return {};
}

Result<void> MapFile::Impl::prepare_statements() {
  auto get = database.prepare("SELECT content FROM pages NOT INDEXED WHERE id = ?");
  if (!get) return forward_error(get);
  get_page = std::move(*get);
  if (mode != MapOpenMode::kReadWrite) return {};
  auto put = database.prepare(
      "INSERT OR REPLACE INTO pages(id, z, y, x, blocks, colors, checksum, content) VALUES(?, ?, ?, ?, ?, ?, "
      "?, ?)");
  auto erase_one = database.prepare("DELETE FROM pages WHERE id = ?");
  if (!put || !erase_one) return put ? forward_error(erase_one) : forward_error(put);
  put_page = std::move(*put);
  erase_page = std::move(*erase_one);
  return {};
}

Result<MapFile> MapFile::open(const fs::path& path, MapOpenMode mode) {
  if (const auto ours = check_signature(path); !ours) return forward_error(ours);
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->mode = mode;
  using Step = Result<void> (Impl::*)();
  for (const Step step : {Step{&Impl::connect}, &Impl::check_size, &Impl::check_schema, &Impl::load})
    if (const auto done = (impl.get()->*step)(); !done) return forward_error(done);
  if (mode == MapOpenMode::kReadWrite) {
    const auto verdict = impl->database.query_text("PRAGMA quick_check(1)");
    if (!verdict) return forward_error(verdict);
    if (*verdict != "ok") return fail(ErrorCode::kCorrupted, path.string(), "{}", *verdict);
  }
  if (const auto prepared = impl->prepare_statements(); !prepared) return forward_error(prepared);
  return MapFile(std::move(impl));
}

Result<MapFile> MapFile::create(const fs::path& path, const MapHeader& header) {
  if (!(header.voxel_size_m > 0) || !(header.sdf_unit_m > 0) ||
      !std::isfinite(header.voxel_size_m + header.sdf_unit_m))
    return fail(ErrorCode::kInvalidValue, path.string(), "voxel size {} m, distance unit {} m",
                header.voxel_size_m, header.sdf_unit_m);
  const fs::path fresh = with_suffix(path, ".partial");
  std::error_code code;
  for (const char* suffix : {".partial", ".partial-journal"}) fs::remove(with_suffix(path, suffix), code);
  {
    Impl impl;
    impl.path = fresh;
    auto opened = SqliteDatabase::open(fresh.string(), SqliteAccess::kCreate);
    if (!opened) return fail(opened.error().code, path.string(), "{}", opened.error().message);
    impl.database = std::move(*opened);
    const auto made = impl.database.execute(fmt::format(
        "PRAGMA page_size=16384; PRAGMA application_id={}; PRAGMA user_version={}; BEGIN; {}; {}; {}",
        kApplicationId, kMapFormatVersion, kHeaderSql, kPagesSql, kDirectorySql));
    if (!made) return forward_error(made);
    MapRecord record{header, {}};
    record.header.format_version = kMapFormatVersion;
    if (record.header.created_unix_ms == 0) record.header.created_unix_ms = now_unix_ms();
    if (const auto written = impl.write_record(std::move(record)); !written) return forward_error(written);
  }
  // The old map goes before its journal, so that no moment pairs a map with another map's journal.
  fs::remove(path, code);
  fs::remove(with_suffix(path, "-journal"), code);
  fs::rename(fresh, path, code);
  if (code) return fail(ErrorCode::kUnreadable, path.string(), "cannot be written: {}", code.message());
  return open(path, MapOpenMode::kReadWrite);
}

MapFile::MapFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MapFile::~MapFile() = default;
MapFile::MapFile(MapFile&&) noexcept = default;
MapFile& MapFile::operator=(MapFile&&) noexcept = default;

// ---- reading ----

const MapHeader& MapFile::header() const { return impl_->record.header; }
const fs::path& MapFile::path() const { return impl_->path; }
const std::vector<std::string>& MapFile::problems() const { return impl_->problems; }
std::uint64_t MapFile::block_count() const { return summarise(impl_->directory).blocks; }
std::optional<MapKeyBox> MapFile::key_bounds() const { return bounds(impl_->directory); }

std::uint64_t MapFile::file_bytes() const {
  std::error_code ignored;
  const auto size = fs::file_size(impl_->path, ignored);
  return ignored ? 0 : size;
}

Result<MapPageBlocks> MapFile::Impl::read_page(const MapPageKey& key, const MapPageEntry& entry) const {
  const auto damaged = [&](const std::string& why) {
    return fail(ErrorCode::kCorrupted, name(), "{} (row {}) is damaged: {}", to_string(key), entry.row, why);
  };
  get_page.bind(0, entry.row);
  const auto found = get_page.step();
  if (!found) return damaged(found.error().message);
  if (!*found) return damaged("there is no such row");
  auto blocks = codec.decode(get_page.bytes(0), key, entry);
  get_page.reset();
  if (!blocks) return damaged(blocks.error().message);
  return blocks;
}

Result<MapReadReport> MapFile::for_each_block(const std::optional<MapKeyBox>& box,
                                              const std::function<bool(const MapBlockView&)>& visit) const {
  MapReadReport report;
  report.problems = impl_->problems;
  if (!box) report.blocks_skipped = impl_->lost_blocks;
  for (const auto& [page, entry] : impl_->directory) {
    const std::uint64_t chosen = box ? blocks_in(*box, page, entry.blocks) : entry.blocks;
    if (chosen == 0) continue;
    const auto blocks = impl_->read_page(page, entry);
    if (!blocks) {
      if (!impl_->lenient()) return forward_error(blocks);
      report.blocks_skipped += static_cast<std::uint64_t>(std::popcount(chosen));
      if (report.problems.size() < kMaxProblems) report.problems.push_back(blocks.error().message);
      continue;
    }
    for (std::uint64_t left = chosen; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      MapBlockView view{block_key(page, static_cast<int>(i)), {blocks->voxels[i], kMapBlockVoxels}, {}};
      if (blocks->colors[i]) view.colors = {blocks->colors[i], kMapBlockVoxels};
      ++report.blocks_read;
      if (visit(view)) continue;
      report.complete = false;
      return report;
    }
  }
  return report;
}

// ---- writing ----

/// After a failed change the transaction is given up, and memory follows the file again.
Result<void> MapFile::Impl::settle(Result<void> outcome) {
  if (outcome) return outcome;
  get_page.reset();
  if (database.in_transaction()) (void)database.execute("ROLLBACK");
  if (const auto loaded = load(); !loaded) directory.clear();
  return outcome;
}

Result<void> MapFile::Impl::begin() {
  HM_CHECK(mode == MapOpenMode::kReadWrite, "{} is open for reading only", name());
  if (database.in_transaction()) return {};
  return database.execute("BEGIN IMMEDIATE");
}

Result<void> MapFile::Impl::write_page(const MapPageKey& key, const MapPageBlocks& blocks) {
  MapPageEntry entry;
  const auto packed = codec.encode(key, blocks, entry);
  const auto place = directory.find(key);
  entry.row = place != directory.end() ? place->second.row : record.summary.last_row + 1;
  put_page.bind(0, entry.row);
  put_page.bind(1, key.z);
  put_page.bind(2, key.y);
  put_page.bind(3, key.x);
  put_page.bind(4, std::bit_cast<std::int64_t>(entry.blocks));
  put_page.bind(5, std::bit_cast<std::int64_t>(entry.colors));
  put_page.bind(6, std::int64_t{entry.checksum});
  put_page.bind(7, packed);
  if (const auto stored = put_page.run(); !stored) return stored;
  record.summary.last_row = std::max(record.summary.last_row, entry.row);
  directory[key] = entry;
  return {};
}

Result<void> MapFile::Impl::remove_page(const MapPageKey& key) {
  const auto place = directory.find(key);
  erase_page.bind(0, place->second.row);
  if (const auto removed = erase_page.run(); !removed) return removed;
  directory.erase(place);
  return {};
}

Result<void> MapFile::Impl::write_record(MapRecord next) {
  next.summary = summarise(directory);
  next.header.updated_unix_ms = now_unix_ms();
  const std::string text = to_text(next);
  auto statement = database.prepare("INSERT OR REPLACE INTO header(id, checksum, content) VALUES(1, ?, ?)");
  if (!statement) return forward_error(statement);
  statement->bind(0, record_checksum(text));
  statement->bind(1, text);
  if (const auto stored = statement->run(); !stored) return stored;
  if (const auto committed = database.execute("COMMIT"); !committed) return committed;
  record = std::move(next);
  return {};
}

namespace {

/// The items' places, grouped by page; of items in one page the later come later.
template <class Item, class KeyOf>
std::vector<std::pair<MapPageKey, std::size_t>> by_page(std::span<const Item> items, KeyOf key_of) {
  std::vector<std::pair<MapPageKey, std::size_t>> order;
  order.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) order.emplace_back(page_of(key_of(items[i])), i);
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace

Result<void> MapFile::put_blocks(std::span<const MapBlockView> blocks) {
  if (const auto begun = impl_->begin(); !begun) return begun;
  const auto order = by_page(blocks, [](const MapBlockView& block) { return block.key; });
  for (std::size_t i = 0; i < order.size();) {
    const MapPageKey page = order[i].first;
    MapPageBlocks fresh;
    std::uint64_t replaced = 0;
    for (; i < order.size() && order[i].first == page; ++i) {
      const MapBlockView& block = blocks[order[i].second];
      HM_CHECK(block.voxels.size() == kMapBlockVoxels, "{} voxels", block.voxels.size());
      HM_CHECK(block.colors.empty() || block.colors.size() == kMapBlockVoxels, "{} colours",
               block.colors.size());
      const auto place = static_cast<std::size_t>(block_in_page(block.key));
      fresh.voxels[place] = block.voxels.data();
      fresh.colors[place] = block.colors.empty() ? nullptr : block.colors.data();
      replaced |= std::uint64_t{1} << place;
    }
    const auto old = impl_->directory.find(page);
    if (old != impl_->directory.end() && (old->second.blocks & ~replaced) != 0) {
      const auto kept = impl_->read_page(page, old->second);
      if (!kept) return impl_->settle(forward_error(kept));
      for (std::size_t place = 0; place < kMapPageBlocks; ++place) {
        if (replaced >> place & 1u) continue;
        fresh.voxels[place] = kept->voxels[place];
        fresh.colors[place] = kept->colors[place];
      }
    }
    if (const auto written = impl_->write_page(page, fresh); !written) return impl_->settle(written);
  }
  return {};
}

Result<void> MapFile::erase(std::span<const MapBlockKey> keys) {
  if (const auto begun = impl_->begin(); !begun) return begun;
  const auto order = by_page(keys, [](const MapBlockKey& key) { return key; });
  for (std::size_t i = 0; i < order.size();) {
    const MapPageKey page = order[i].first;
    std::uint64_t doomed = 0;
    for (; i < order.size() && order[i].first == page; ++i)
      doomed |= std::uint64_t{1} << static_cast<unsigned>(block_in_page(keys[order[i].second]));
    const auto entry = impl_->directory.find(page);
    if (entry == impl_->directory.end() || (entry->second.blocks & doomed) == 0) continue;
    if ((entry->second.blocks & ~doomed) == 0) {
      if (const auto removed = impl_->remove_page(page); !removed) return impl_->settle(removed);
      continue;
    }
    auto kept = impl_->read_page(page, entry->second);
    if (!kept) return impl_->settle(forward_error(kept));
    for (std::size_t place = 0; place < kMapPageBlocks; ++place)
      if (doomed >> place & 1u) kept->voxels[place] = kept->colors[place] = nullptr;
    if (const auto written = impl_->write_page(page, *kept); !written) return impl_->settle(written);
  }
  return {};
}

Result<void> MapFile::clear() {
  if (const auto begun = impl_->begin(); !begun) return begun;
  const auto emptied = impl_->database.execute("DELETE FROM pages");
  if (!emptied) return impl_->settle(emptied);
  impl_->directory.clear();
  return {};
}

Result<void> MapFile::commit(const std::string& state_json) {
  MapHeader next = header();
  next.state_json = state_json;
  return commit(next);
}

Result<void> MapFile::commit(const MapHeader& header) {
  HM_CHECK(
      header.voxel_size_m == this->header().voxel_size_m && header.sdf_unit_m == this->header().sdf_unit_m,
      "the voxels of a map keep their size and unit");
  if (const auto begun = impl_->begin(); !begun) return begun;
  MapRecord next{header, {}};
  next.header.format_version = kMapFormatVersion;
  next.header.created_unix_ms = this->header().created_unix_ms;
  return impl_->settle(impl_->write_record(std::move(next)));
}

}  // namespace hm
