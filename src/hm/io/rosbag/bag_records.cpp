#include "hm/io/rosbag/bag_records.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "hm/io/bytes/byte_cursor.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/rosbag/bag_chunk.hpp"
#include "hm/io/rosbag/bag_format.hpp"

namespace hm::detail {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Fields of a record's header.
class Fields {
 public:
  /// Parses a header; nothing when it is inconsistent.
  static std::optional<Fields> parse(Bytes header) {
    Fields fields;
    ByteCursor cursor(header);
    while (cursor.remaining() > 0) {
      const std::string field = cursor.text();
      const std::size_t equals = field.find('=');
      if (!cursor.ok() || equals == std::string::npos) return std::nullopt;
      fields.values_[field.substr(0, equals)] = field.substr(equals + 1);
    }
    return fields;
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string() : found->second;
  }
  template <class T>
  [[nodiscard]] std::optional<T> number(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end() || found->second.size() != sizeof(T)) return std::nullopt;
    T value{};
    std::memcpy(&value, found->second.data(), sizeof(T));
    return value;
  }

 private:
  std::map<std::string, std::string> values_;
};

std::optional<Time> time_of(const Fields& fields) {
  const auto both = fields.number<std::uint64_t>("time");
  if (!both) return std::nullopt;
  return Time{static_cast<std::int64_t>(*both & 0xffffffffU) * 1'000'000'000 +
              static_cast<std::int64_t>(*both >> 32U)};
}

/// Size limit of a header.
constexpr std::uint32_t kMaxHeaderBytes = 1U << 20U;

/// Limits of decompression, for each chunk and in total: a file of 600 bytes must not expand to a gigabyte.
/// Recorders close a chunk near one megabyte; sensor data compress to a tenth at best.
constexpr std::uint64_t kMaxGrowth = 100, kMaxChunkBytes = std::uint64_t{256} << 20U;
constexpr std::uint64_t kFreeChunkBytes = std::uint64_t{16} << 20U, kFreeBagBytes = std::uint64_t{64} << 20U;

/// Record outside chunks.
struct Record {
  std::uint64_t begin = 0;
  Fields fields = {};
  std::uint8_t op = 0;
  std::uint32_t size = 0;  ///< of the data
};

/// Size of a skipped record. Recorders of 2010 wrote a wrong size for the index after each chunk; its number
/// of entries is correct.
std::uint32_t true_size(const Record& record) {
  constexpr std::uint32_t kEntryBytes = 12, kMostEntries = 0xffffffffU / kEntryBytes;
  if (record.op != static_cast<std::uint8_t>(BagOp::kIndex)) return record.size;
  const auto version = record.fields.number<std::uint32_t>("ver");
  const auto count = record.fields.number<std::uint32_t>("count");
  const bool known = version == std::uint32_t{1} && count && *count <= kMostEntries;
  return known ? *count * kEntryBytes : record.size;
}

class BagReader {
 public:
  BagReader(InputFile file, const std::function<void(const BagMessage&)>& use)
      : file_(std::move(file)), use_(use) {}
  Result<BagSummary> read();

 private:
  std::optional<Record> next_record();
  Result<void> read_record(const Record& record);
  /// Reads the connections repeated in the index, so that those of a damaged chunk are known.
  void read_connections(std::uint64_t index_position);
  void read_chunk(const Record& record);
  /// Decompresses a chunk within the limits; `size` is its expected size, or nothing if unknown.
  DecompressedChunk decompress(const std::string& compression, Bytes data, std::optional<std::uint32_t> size);
  /// Reads the records of a chunk; returns the offset of the first invalid one, if any.
  std::optional<std::size_t> read_records(Bytes bytes);
  void read_inner(const Fields& fields, Bytes data);
  void add_connection(const Fields& fields, Bytes data);
  void add_message(const Fields& fields, Bytes data);
  std::vector<std::uint8_t> read_data(std::uint32_t size);
  void problem(std::string text) { summary_.problems.push_back(std::move(text)); }

  InputFile file_;
  const std::function<void(const BagMessage&)>& use_;
  std::map<std::uint32_t, BagConnection> connections_;
  BagSummary summary_;
  std::uint64_t decompressed_ = 0;  ///< bytes that came out of compressed chunks
};

Result<BagSummary> BagReader::read() {
  std::string magic(kBagMagic.size(), '\0');
  if (!file_.read(magic.data(), magic.size()) || magic != kBagMagic) {
    if (magic.starts_with("#ROSBAG V") || magic.starts_with("#ROSRECORD"))
      return fail(ErrorCode::kUnsupported, file_.name(), "a bag of version `{}`; only V2.0 is read",
                  magic.substr(0, magic.find('\n')));
    return fail(ErrorCode::kCorrupted, file_.name(), "not a bag: it does not start with `#ROSBAG V2.0`");
  }
  while (file_.remaining() > 0) {
    const auto record = next_record();
    if (!record) break;
    if (auto done = read_record(*record); !done) return forward_error(done);
  }
  return std::move(summary_);
}

std::optional<Record> BagReader::next_record() {
  Record record{.begin = file_.offset()};
  const auto stop = [&](std::string_view why) {
    problem(fmt::format("read up to byte {} of {}: {}", record.begin, file_.size(), why));
    return std::nullopt;
  };
  std::uint32_t header_size = 0;
  if (!file_.read_value(header_size)) return stop("the file is cut off");
  if (header_size > kMaxHeaderBytes) return stop(fmt::format("no record header has {} bytes", header_size));
  const auto header = read_data(header_size);
  if (header.size() < header_size || !file_.read_value(record.size)) return stop("the file is cut off");
  auto fields = Fields::parse(header);
  const auto op = fields ? fields->number<std::uint8_t>("op") : std::nullopt;
  if (!op) return stop("the record there is damaged");
  record.fields = std::move(*fields);
  record.op = *op;
  return record;
}

std::vector<std::uint8_t> BagReader::read_data(std::uint32_t size) {
  std::vector<std::uint8_t> data(static_cast<std::size_t>(std::min<std::uint64_t>(size, file_.remaining())));
  if (!file_.read(data.data(), data.size())) data.clear();
  return data;
}

Result<void> BagReader::read_record(const Record& record) {
  switch (static_cast<BagOp>(record.op)) {
    case BagOp::kBagHeader:
      if (!record.fields.text("encryptor").empty())
        return fail(ErrorCode::kUnsupported, file_.name(), "the bag is encrypted ({})",
                    record.fields.text("encryptor"));
      summary_.indexed = record.fields.number<std::uint64_t>("index_pos").value_or(0) != 0;
      if (summary_.indexed) read_connections(*record.fields.number<std::uint64_t>("index_pos"));
      break;
    case BagOp::kChunk:
      read_chunk(record);
      return {};
    case BagOp::kConnection:
    case BagOp::kMessage: {
      // Outside a chunk: the last chunk of a recorder that was killed, whose size was never written.
      const auto data = read_data(record.size);
      if (data.size() < record.size)
        problem(fmt::format("read up to byte {} of {}: the file is cut off", record.begin, file_.size()));
      else
        read_inner(record.fields, data);
      return {};
    }
    default:
      break;  // the index is not needed, and unknown records may be skipped
  }
  const std::uint32_t size = true_size(record);
  if (size > file_.remaining())
    problem(fmt::format("read up to byte {} of {}: the file is cut off", record.begin, file_.size()));
  file_.seek(file_.offset() + size);
  return {};
}

void BagReader::read_connections(std::uint64_t index_position) {
  const std::uint64_t back = file_.offset();
  const std::size_t problems = summary_.problems.size();
  file_.seek(index_position);
  while (file_.remaining() > 0) {
    const auto record = next_record();
    if (!record || record->op != static_cast<std::uint8_t>(BagOp::kConnection)) break;
    add_connection(record->fields, read_data(record->size));
  }
  summary_.problems.resize(problems);  // errors there are reported when they are reached
  file_.seek(back);
}

void BagReader::read_chunk(const Record& record) {
  ++summary_.chunks;
  const std::string compression = record.fields.text("compression");
  const bool never_closed = record.size == 0 && compression != "none";
  const auto wanted =
      never_closed
          ? static_cast<std::uint32_t>(std::min<std::uint64_t>(file_.remaining(), std::uint32_t{0xffffffff}))
          : record.size;
  if (wanted == 0) return;  // plain and never closed: its records follow
  const auto data = read_data(wanted);
  const auto chunk =
      decompress(compression, data,
                 never_closed ? std::nullopt
                              : std::optional(record.fields.number<std::uint32_t>("size").value_or(wanted)));
  const std::string where = fmt::format("the chunk at byte {}", record.begin);
  std::string damage = chunk.problem;
  if (const auto at = read_records(chunk.bytes); at && damage.empty())
    damage = fmt::format("no record at {} of its {} bytes", *at, chunk.bytes.size());
  if (data.size() < wanted || never_closed)
    problem(fmt::format("the file ends inside of {}", where));
  else if (!damage.empty())
    problem(fmt::format("{} is damaged: {}", where, damage));
}

DecompressedChunk BagReader::decompress(const std::string& compression, Bytes data,
                                        std::optional<std::uint32_t> size) {
  if (compression == "none") return decompress_chunk(compression, data, size.value_or(0));
  const std::uint64_t in_all = std::max(kFreeBagBytes, file_.size() * kMaxGrowth);
  const std::uint64_t most = std::min({std::max(kFreeChunkBytes, data.size() * kMaxGrowth), kMaxChunkBytes,
                                       in_all - std::min(in_all, decompressed_)});
  if (size && *size > most)
    return {{}, fmt::format("{} bytes that become {}: more than the {} allowed", data.size(), *size, most)};
  auto chunk = decompress_chunk(compression, data, size.value_or(static_cast<std::uint32_t>(most)));
  decompressed_ += chunk.bytes.size();
  return chunk;
}

std::optional<std::size_t> BagReader::read_records(Bytes bytes) {
  ByteCursor cursor(bytes);
  while (cursor.remaining() > 0) {
    const std::size_t at = bytes.size() - cursor.remaining();
    const Bytes header = cursor.take(cursor.value<std::uint32_t>());
    const Bytes data = cursor.take(cursor.value<std::uint32_t>());
    const auto fields = cursor.ok() ? Fields::parse(header) : std::nullopt;
    if (!fields) return at;
    read_inner(*fields, data);
  }
  return std::nullopt;
}

void BagReader::read_inner(const Fields& fields, Bytes data) {
  const auto op = fields.number<std::uint8_t>("op").value_or(0);
  if (op == static_cast<std::uint8_t>(BagOp::kConnection)) add_connection(fields, data);
  if (op == static_cast<std::uint8_t>(BagOp::kMessage)) add_message(fields, data);
}

void BagReader::add_connection(const Fields& fields, Bytes data) {
  const auto id = fields.number<std::uint32_t>("conn");
  const auto about = Fields::parse(data);
  if (!id || !about) return;  // its messages will be counted as lost
  connections_[*id] = {*id, fields.text("topic"), about->text("type"), about->text("md5sum")};
}

void BagReader::add_message(const Fields& fields, Bytes data) {
  const auto id = fields.number<std::uint32_t>("conn");
  const auto received = time_of(fields);
  const auto connection = id ? connections_.find(*id) : connections_.end();
  if (connection == connections_.end() || !received) {
    ++summary_.lost_messages;
    return;
  }
  ++summary_.messages;
  use_({connection->second, *received, data});
}

}  // namespace

Result<BagSummary> read_bag(const std::filesystem::path& path,
                            const std::function<void(const BagMessage&)>& use) {
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  return BagReader(std::move(*file), use).read();
}

}  // namespace hm::detail
