#include <cmath>
#include <cstring>
#include <optional>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/map/octree_format.hpp"

namespace hm {

using namespace octree;

namespace octree {

Result<Kind> kind_of(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".bt") return Kind::kBinary;
  if (extension == ".ot") return Kind::kLogOdds;
  return fail(ErrorCode::kUsage, path.string(), "an OctoMap file ends in .bt or .ot");
}

std::string_view first_line(Kind kind) {
  return kind == Kind::kBinary ? "# Octomap OcTree binary file" : "# Octomap OcTree file";
}

}  // namespace octree

namespace {

struct Header {
  Kind kind = Kind::kBinary;
  std::string id;
  double size = -1, resolution_m = 0;
  std::size_t end = 0;  ///< offset of the first node
};

/// Reads the nodes of a file.
class Decoder {
 public:
  Decoder(std::span<const std::uint8_t> bytes, const Header& header, std::string where)
      : bytes_(bytes), header_(header), at_(header.end), where_(std::move(where)) {}

  Result<std::vector<OccupancyVoxel>> decode() {
    if (header_.size > 0) {
      const bool good = header_.kind == Kind::kBinary ? binary_node({}, 0) : log_odds_node({}, 0);
      if (!good) return fail(code_, fmt::format("{}, byte {}", where_, at_), "{}", why_);
    }
    if (static_cast<double>(nodes_) != header_.size)
      return fail(ErrorCode::kCorrupted, fmt::format("{}, byte {}", where_, at_),
                  "{} nodes, the header says {}", nodes_, header_.size);
    if (at_ != bytes_.size())
      return fail(ErrorCode::kCorrupted, fmt::format("{}, byte {}", where_, at_), "{} bytes too many",
                  bytes_.size() - at_);
    return std::move(voxels_);
  }

 private:
  using Key = std::array<std::int64_t, 3>;

  bool stop(ErrorCode code, std::string_view why) {
    code_ = code;
    why_ = why;
    return false;
  }
  static Key child_key(const Key& key, unsigned place, int depth) {
    Key child = key;
    for (unsigned axis = 0; axis < 3; ++axis)
      child[axis] |= static_cast<std::int64_t>(place >> axis & 1u) << (kDepth - 1 - depth);
    return child;
  }
  void add_leaf(const Key& key, int depth, double probability) {
    const std::int64_t side = std::int64_t{1} << (kDepth - depth);
    OccupancyVoxel voxel;
    for (std::size_t axis = 0; axis < 3; ++axis)
      voxel.p_world_centre[static_cast<Eigen::Index>(axis)] =
          static_cast<float>((static_cast<double>(key[axis] - kKeyOffset) + static_cast<double>(side) / 2) *
                             header_.resolution_m);
    voxel.size_m = static_cast<float>(static_cast<double>(side) * header_.resolution_m);
    voxel.probability = static_cast<float>(probability);
    voxel.state = probability >= 0.5 ? Occupancy::kOccupied : Occupancy::kFree;
    voxels_.push_back(voxel);
  }
  bool binary_node(const Key& key, int depth) {
    ++nodes_;
    if (depth == kDepth) return stop(ErrorCode::kCorrupted, "a cell of the smallest size has children");
    if (bytes_.size() - at_ < 2) return stop(ErrorCode::kTruncated, "ends inside of a node");
    const unsigned states = bytes_[at_] | static_cast<unsigned>(bytes_[at_ + 1]) << 8u;
    at_ += 2;
    for (unsigned i = 0; i < 8; ++i) {
      const unsigned state = states >> (2 * i) & 3u;
      if (state == kFreeLeaf || state == kOccupiedLeaf) {
        add_leaf(child_key(key, i, depth), depth + 1, state == kFreeLeaf ? kMinProbability : kMaxProbability);
        ++nodes_;
      }
    }
    for (unsigned i = 0; i < 8; ++i)
      if ((states >> (2 * i) & 3u) == kInner && !binary_node(child_key(key, i, depth), depth + 1))
        return false;
    return true;
  }
  bool log_odds_node(const Key& key, int depth) {
    ++nodes_;
    float log_odds = 0;
    if (bytes_.size() - at_ < sizeof log_odds + 1)
      return stop(ErrorCode::kTruncated, "ends inside of a node");
    std::memcpy(&log_odds, &bytes_[at_], sizeof log_odds);
    const unsigned children = bytes_[at_ + sizeof log_odds];
    if (std::isnan(log_odds)) return stop(ErrorCode::kCorrupted, "log-odds that are not a number");
    at_ += sizeof log_odds + 1;
    if (children == 0) add_leaf(key, depth, 1 / (1 + std::exp(-static_cast<double>(log_odds))));
    if (children != 0 && depth == kDepth)
      return stop(ErrorCode::kCorrupted, "a cell of the smallest size has children");
    for (unsigned i = 0; i < 8; ++i)
      if ((children >> i & 1u) && !log_odds_node(child_key(key, i, depth), depth + 1)) return false;
    return true;
  }

  std::span<const std::uint8_t> bytes_;
  const Header& header_;
  std::size_t at_, nodes_ = 0;
  std::string where_, why_;
  ErrorCode code_ = ErrorCode::kCorrupted;
  std::vector<OccupancyVoxel> voxels_;
};

Result<Header> read_header(std::span<const std::uint8_t> bytes, const std::string& where) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Header header;
  if (text.starts_with(first_line(Kind::kLogOdds)))
    header.kind = Kind::kLogOdds;
  else if (!text.starts_with(first_line(Kind::kBinary)))
    return fail(ErrorCode::kCorrupted, where, "is not an OctoMap file");
  std::size_t line_number = 0;
  while (header.end < text.size()) {
    ++line_number;
    const std::size_t newline = text.find('\n', header.end);
    if (newline == std::string_view::npos || newline - header.end > 4096) break;
    const auto word = words(text.substr(header.end, newline - header.end));
    header.end = newline + 1;
    if (word.empty() || word[0].starts_with('#')) continue;
    if (word[0] == "data") {
      if (header.id != "OcTree")
        return fail(ErrorCode::kUnsupported, where, "a tree of type '{}', not OcTree", header.id);
      if (!(header.resolution_m > 0) || !std::isfinite(header.resolution_m) || !(header.size >= 0))
        return fail(ErrorCode::kCorrupted, where, "size or res is missing in its header");
      return header;
    }
    if (word.size() < 2)
      return fail(ErrorCode::kCorrupted, fmt::format("{}:{}", where, line_number), "'{}'", word[0]);
    if (word[0] == "id") header.id = word[1];
    if (word[0] == "size") header.size = parse_number(word[1]).value_or(-1);
    if (word[0] == "res") header.resolution_m = parse_number(word[1]).value_or(0);
  }
  return fail(ErrorCode::kTruncated, where, "its header has no line 'data'");
}

}  // namespace

Result<OctomapContent> read_octomap(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  const auto header = read_header(*bytes, path.string());
  if (!header) return forward_error(header);
  auto voxels = Decoder(*bytes, *header, path.string()).decode();
  if (!voxels) return forward_error(voxels);
  return OctomapContent{header->resolution_m, std::move(*voxels)};
}

}  // namespace hm
