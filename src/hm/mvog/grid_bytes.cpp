// A MultiVolumeGrid to bytes and back (docs/file_formats.md).
#include <cstring>

#include "hm/core/hash.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/multi_volume_grid_impl.hpp"

namespace hm {

using namespace mvog;

namespace {

constexpr std::array<char, 8> kMagic{'H', 'M', 'M', 'V', 'O', 'G', '\r', '\n'};
constexpr std::uint32_t kVersion = 1;

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t tiles = 0;
  double resolution_m = 0, occupied_ratio = 0, same_view_distance_cell = 0, merge_sigmas = 0;
  std::int32_t evidence_cap = 0, same_view_cap = 0, glancing_period = 0, fill_slivers = 0, max_map_mb = 0;
  std::uint32_t view_count = 0;
  std::uint64_t revision = 0, scans = 0;
  std::array<double, 12> views{};
};
static_assert(sizeof(Header) == 184);

struct TileHeader {
  std::int32_t x = 0, y = 0;
  std::uint64_t revision = 0;
  std::uint64_t units = 0;  ///< of the block that follows
};
static_assert(sizeof(TileHeader) == 24);

template <class T>
void append(std::vector<std::byte>& out, const T* values, std::size_t count) {
  const std::size_t at = out.size();
  out.resize(at + count * sizeof(T));
  std::memcpy(out.data() + at, values, count * sizeof(T));
}

/// Appends the checksum of everything from `begin` on.
void seal(std::vector<std::byte>& out, std::size_t begin) {
  const std::uint64_t sum = fnv1a(std::span(out).subspan(begin));
  append(out, &sum, 1);
}

/// Reads values from bytes, front to back.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t offset() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  template <class T>
  bool read(T* values, std::size_t count) {
    if (left() / sizeof(T) < count) return false;
    if (count > 0)
      std::memcpy(values, bytes_.data() + at_, count * sizeof(T));  // an empty vector's data may be null
    at_ += count * sizeof(T);
    return true;
  }
  /// Reads the checksum of the bytes since `begin` and compares it.
  bool check_seal(std::size_t begin) {
    const std::uint64_t want = fnv1a(bytes_.subspan(begin, at_ - begin));
    std::uint64_t sum = 0;
    return read(&sum, 1) && sum == want;
  }
  template <class... Args>
  auto fail_at(ErrorCode code, std::size_t offset, fmt::format_string<Args...> format, Args&&... args) const {
    return fail(code, fmt::format("multi-volume grid, byte {}", offset), format, std::forward<Args>(args)...);
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

/// True for a column as ColumnUpdater writes it.
bool is_column(ColumnUnits column) {
  if (column.empty()) return true;
  if (column.size() < 2 || run_code(column[1]) == kUnknownCode || run_code(column.back()) == kUnknownCode)
    return false;
  int top = base_level(column[0]);
  for (const std::uint16_t unit : column.subspan(1)) {
    if (run_length(unit) == 0 || !is_valid_code(run_code(unit))) return false;
    top += run_length(unit);
  }
  return top <= kMaxLevel + 1;
}

/// True for a tile's block with only valid columns.
bool is_block(std::span<const std::uint16_t> block) {
  if (block.size() < kOffsets || block[0] != kOffsets || block[kTileColumns] != block.size()) return false;
  for (std::size_t place = 0; place < kTileColumns; ++place)
    if (block[place] > block[place + 1]) return false;
  for (std::size_t place = 0; place < kTileColumns; ++place)
    if (!is_column(block.subspan(block[place], static_cast<std::size_t>(block[place + 1] - block[place]))))
      return false;
  return true;
}

bool is_key(TileKey key) {
  constexpr double kMax = 1 << 25;  // MultiVolumeGrid::Impl::kMaxColumn / kTileSide
  return std::abs(double{1} * key.x) <= kMax && std::abs(double{1} * key.y) <= kMax;
}

Result<Header> read_header(Reader& in) {
  Header header;
  if (!in.read(&header, 1))
    return in.fail_at(ErrorCode::kTruncated, in.offset(), "ends inside of the header");
  if (header.magic != kMagic) return in.fail_at(ErrorCode::kCorrupted, 0, "is not a multi-volume grid");
  if (header.version != kVersion)
    return in.fail_at(ErrorCode::kUnsupported, sizeof kMagic, "version {}, this program knows {}",
                      header.version, kVersion);
  if (in.left() < sizeof(std::uint64_t))
    return in.fail_at(ErrorCode::kTruncated, in.offset(), "ends inside of the header");
  if (!in.check_seal(0)) return in.fail_at(ErrorCode::kCorrupted, 0, "the header's checksum is wrong");
  return header;
}

/// Copies between the header and the parameters, whose members have the same names.
template <class From, class To>
void copy_params(const From& from, To& to) {
  to.resolution_m = from.resolution_m;
  to.occupied_ratio = from.occupied_ratio;
  to.evidence_cap = from.evidence_cap;
  to.same_view_cap = from.same_view_cap;
  to.same_view_distance_cell = from.same_view_distance_cell;
  to.merge_sigmas = from.merge_sigmas;
  to.glancing_period = from.glancing_period;
  to.fill_slivers = from.fill_slivers != 0;
  to.max_map_mb = from.max_map_mb;
}

Result<MvogParams> params_of(const Header& header, const Reader& in) {
  MvogParams params;
  copy_params(header, params);
  if (const auto good = check_params(params); !good)
    return in.fail_at(ErrorCode::kCorrupted, 0, "parameters: {}", to_string(good.error()));
  return params;
}

}  // namespace

std::vector<std::byte> MultiVolumeGrid::serialise() const {
  Header header;
  header.tiles = static_cast<std::uint32_t>(impl_->store.tiles().size());
  copy_params(impl_->params, header);
  header.revision = impl_->revision;
  header.scans = impl_->scans;
  header.view_count = static_cast<std::uint32_t>(impl_->view_count);
  for (std::size_t i = 0; i < impl_->view_count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      header.views[3 * i + axis] = impl_->views[i][static_cast<Eigen::Index>(axis)];
  std::vector<std::byte> out;
  append(out, &header, 1);
  seal(out, 0);
  // Oldest change first, so that reading them in restores that order too.
  std::vector<const Tile*> tiles;
  for (const Tile* tile = impl_->store.latest(); tile; tile = impl_->store.older(*tile))
    tiles.push_back(tile);
  for (auto tile = tiles.rbegin(); tile != tiles.rend(); ++tile) {
    const std::size_t begin = out.size();
    const TileHeader tile_header{(*tile)->key.x, (*tile)->key.y, (*tile)->revision, (*tile)->units().size()};
    append(out, &tile_header, 1);
    append(out, (*tile)->units().data(), (*tile)->units().size());
    seal(out, begin);
  }
  return out;
}

Result<MultiVolumeGrid> MultiVolumeGrid::parse(std::span<const std::byte> bytes) {
  Reader in(bytes);
  const auto header = read_header(in);
  if (!header) return forward_error(header);
  const auto params = params_of(*header, in);
  if (!params) return forward_error(params);
  MultiVolumeGrid grid(*params);
  grid.impl_->revision = header->revision;
  grid.impl_->scans = header->scans;
  if (header->view_count > Impl::kViews)
    return in.fail_at(ErrorCode::kCorrupted, 0, "{} views", header->view_count);
  grid.impl_->view_count = header->view_count;
  for (std::size_t i = 0; i < grid.impl_->view_count; ++i)
    grid.impl_->views[i] = Eigen::Vector3d(&header->views[3 * i]);
  std::vector<std::uint16_t> block;
  std::uint64_t last_revision = 0;
  for (std::uint32_t i = 0; i < header->tiles; ++i) {
    const std::size_t begin = in.offset();
    TileHeader tile;
    if (!in.read(&tile, 1))
      return in.fail_at(ErrorCode::kTruncated, begin, "ends before tile {} of {}", i, header->tiles);
    if (tile.units > std::numeric_limits<std::uint16_t>::max())
      return in.fail_at(ErrorCode::kCorrupted, begin, "tile {} claims {} units", i, tile.units);
    block.resize(static_cast<std::size_t>(tile.units));
    if (!in.read(block.data(), block.size()) || in.left() < sizeof(std::uint64_t))
      return in.fail_at(ErrorCode::kTruncated, in.offset(), "ends inside of tile {} of {}", i, header->tiles);
    if (!in.check_seal(begin))
      return in.fail_at(ErrorCode::kCorrupted, begin, "the checksum of tile {} is wrong", i);
    const TileKey key{tile.x, tile.y};
    const bool good = is_block(block) && is_key(key) && !grid.impl_->store.find(key) &&
                      tile.revision >= last_revision && tile.revision <= header->revision;
    if (!good) return in.fail_at(ErrorCode::kCorrupted, begin, "tile {} contradicts the format", i);
    last_revision = tile.revision;
    grid.impl_->store.write(key, block, tile.revision, std::numeric_limits<std::size_t>::max());
  }
  if (in.left() > 0) return in.fail_at(ErrorCode::kCorrupted, in.offset(), "{} bytes too many", in.left());
  return grid;
}

}  // namespace hm
