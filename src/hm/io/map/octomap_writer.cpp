#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hm/core/check.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/map/octree_format.hpp"

namespace hm {

using namespace octree;

namespace {

constexpr std::size_t kMaxTreeCells = std::size_t{1} << 28;

struct Cell {
  std::uint64_t code = 0;
  float log_odds = 0;
  Rgb8 color{};
};

/// Voxels to be written, and parameters.
struct Content {
  std::span<const OccupancyVoxel> voxels;
  std::span<const Rgb8> colors;  ///< empty, or one of each voxel
  double resolution_m = 0;
  Kind kind = Kind::kLogOdds;
};

float log_odds_of(const OccupancyVoxel& voxel) {
  const double p = std::clamp<double>(voxel.probability, kMinProbability, kMaxProbability);
  const auto value = static_cast<float>(std::log(p / (1 - p)));
  return voxel.state == Occupancy::kOccupied ? std::max(value, 0.0F) : std::min(value, -1e-3F);
}

/// First and last key whose cell centres lie in a voxel along an axis; nothing beyond the octree.
bool key_range(double centre, double size, std::int64_t& first, std::int64_t& last) {
  if (!std::isfinite(centre) || !(size > 0) || std::abs(centre) + size > 2.0 * kKeyOffset) return false;
  const double half = std::max(size, 1.0) / 2;
  first = static_cast<std::int64_t>(std::ceil(centre - half - 0.5 - 1e-3)) + kKeyOffset;
  last = static_cast<std::int64_t>(std::ceil(centre + half - 0.5 - 1e-3)) - 1 + kKeyOffset;
  last = std::max(first, last);
  return first >= 0 && last < 2 * kKeyOffset;
}

Result<std::vector<Cell>> cells_of(const Content& content, const std::string& where) {
  const double resolution_m = content.resolution_m;
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < content.voxels.size(); ++i) {
    const OccupancyVoxel& voxel = content.voxels[i];
    const Rgb8 color = content.colors.empty() ? Rgb8{} : content.colors[i];
    if (voxel.state == Occupancy::kUnknown) continue;
    std::array<std::int64_t, 3> first{}, last{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double centre =
          static_cast<double>(voxel.p_world_centre[static_cast<Eigen::Index>(axis)]) / resolution_m;
      if (!key_range(centre, static_cast<double>(voxel.size_m) / resolution_m, first[axis], last[axis]))
        return fail(ErrorCode::kInvalidValue, where,
                    "the voxel at ({}, {}, {}) m, {} m wide, lies beyond the {} m around the origin that an "
                    "octree of {} m cells can hold",
                    voxel.p_world_centre.x(), voxel.p_world_centre.y(), voxel.p_world_centre.z(),
                    voxel.size_m, kKeyOffset * resolution_m, resolution_m);
    }
    const float log_odds = log_odds_of(voxel);
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t x = first[0]; x <= last[0]; ++x) {
          if (cells.size() == kMaxTreeCells)
            return fail(ErrorCode::kInvalidValue, where, "the map has more than {} cells of {} m",
                        kMaxTreeCells, resolution_m);
          cells.push_back({code_of({x, y, z}), log_odds, color});
        }
  }
  std::ranges::stable_sort(cells, [](const Cell& a, const Cell& b) {
    return a.code != b.code ? a.code < b.code : a.log_odds > b.log_odds;
  });
  const auto doubles = std::ranges::unique(cells, {}, &Cell::code);
  cells.erase(doubles.begin(), doubles.end());
  return cells;
}

/// Writes nodes depth first, from cells in the order of their codes.
class Encoder {
 public:
  Encoder(Kind kind, bool colored) : kind_(kind), colored_(colored) {}
  [[nodiscard]] const std::vector<char>& bytes() const { return bytes_; }
  [[nodiscard]] std::size_t nodes() const { return nodes_; }

  void encode(std::span<const Cell> cells, int depth) {
    ++nodes_;
    const bool leaf = is_leaf(cells, depth);
    if (kind_ == Kind::kLogOdds) {
      const float value = std::ranges::max_element(cells, {}, &Cell::log_odds)->log_odds;
      for (const char byte : std::bit_cast<std::array<char, sizeof value>>(value)) bytes_.push_back(byte);
      if (colored_) push(mean_color(cells));
    }
    const auto children = leaf ? Children{} : children_of(cells, depth);
    if (kind_ == Kind::kLogOdds) {
      unsigned present = 0;
      for (unsigned i = 0; i < 8; ++i) present |= (children[i].empty() ? 0u : 1u) << i;
      bytes_.push_back(static_cast<char>(present));
    } else {
      unsigned states = 0;
      for (unsigned i = 0; i < 8; ++i)
        if (!children[i].empty()) states |= binary_state(children[i], depth + 1) << (2 * i);
      bytes_.push_back(static_cast<char>(states & 255u));
      bytes_.push_back(static_cast<char>(states >> 8u));
    }
    for (const auto& child : children) {
      if (child.empty()) continue;
      if (kind_ == Kind::kBinary && is_leaf(child, depth + 1))
        ++nodes_;  // counted with its parent
      else
        encode(child, depth + 1);
    }
  }

 private:
  using Children = std::array<std::span<const Cell>, 8>;

  void push(const Rgb8& color) {
    for (const std::uint8_t part : {color.r, color.g, color.b}) bytes_.push_back(static_cast<char>(part));
  }
  /// Mean colour of the occupied cells, or of all if there are none; shown by viewers for nodes that are not
  /// expanded.
  static Rgb8 mean_color(std::span<const Cell> cells) {
    const bool occupied = std::ranges::any_of(cells, [](const Cell& cell) { return cell.log_odds >= 0; });
    std::array<std::size_t, 3> sum{};
    std::size_t count = 0;
    for (const Cell& cell : cells) {
      if (occupied && cell.log_odds < 0) continue;
      sum[0] += cell.color.r, sum[1] += cell.color.g, sum[2] += cell.color.b;
      ++count;
    }
    const auto mean = [&](std::size_t i) { return static_cast<std::uint8_t>((sum[i] + count / 2) / count); };
    return {mean(0), mean(1), mean(2)};
  }
  [[nodiscard]] bool same(const Cell& a, const Cell& b) const {
    if (kind_ == Kind::kBinary) return (a.log_odds >= 0) == (b.log_odds >= 0);
    return a.log_odds == b.log_odds && a.color == b.color;
  }
  /// True for a single cell, or a cube full of equal ones.
  [[nodiscard]] bool is_leaf(std::span<const Cell> cells, int depth) const {
    if (depth == kDepth) return true;
    const int levels = 3 * (kDepth - depth);
    if (levels > 28 || cells.size() != std::size_t{1} << levels) return false;
    return std::ranges::all_of(cells, [&](const Cell& cell) { return same(cell, cells.front()); });
  }
  [[nodiscard]] unsigned binary_state(std::span<const Cell> cells, int depth) const {
    return !is_leaf(cells, depth) ? kInner : cells.front().log_odds >= 0 ? kOccupiedLeaf : kFreeLeaf;
  }
  static Children children_of(std::span<const Cell> cells, int depth) {
    Children children;
    const int shift = 3 * (kDepth - 1 - depth);
    std::size_t begin = 0;
    for (std::uint64_t i = 0; i < 8; ++i) {
      const auto end = static_cast<std::size_t>(
          std::ranges::partition_point(cells.subspan(begin),
                                       [&](const Cell& c) { return (c.code >> shift & 7u) <= i; }) -
          cells.begin());
      children[i] = cells.subspan(begin, end - begin);
      begin = end;
    }
    return children;
  }

  Kind kind_;
  bool colored_ = false;
  std::vector<char> bytes_;
  std::size_t nodes_ = 0;
};

Result<void> write_content(const std::filesystem::path& path, const Content& content) {
  if (!(content.resolution_m > 0) || !std::isfinite(content.resolution_m))
    return fail(ErrorCode::kInvalidValue, path.string(), "a resolution of {} m", content.resolution_m);
  const auto cells = cells_of(content, path.string());
  if (!cells) return forward_error(cells);
  const bool colored = !content.colors.empty();
  Encoder encoder(content.kind, colored);
  if (!cells->empty()) encoder.encode(*cells, 0);
  OutputFile file(path);
  file.write(fmt::format(
      "{}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
      "id {}\nsize {}\nres {}\ndata\n",
      first_line(content.kind), colored ? "ColorOcTree" : "OcTree", encoder.nodes(), content.resolution_m));
  file.write(encoder.bytes().data(), encoder.bytes().size());
  return file.finish();
}

}  // namespace

Result<void> write_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                           double resolution_m) {
  const auto kind = kind_of(path);
  if (!kind) return forward_error(kind);
  return write_content(path, {voxels, {}, resolution_m, *kind});
}

Result<void> write_color_octomap(const std::filesystem::path& path, std::span<const OccupancyVoxel> voxels,
                                 std::span<const Rgb8> colors, double resolution_m) {
  HM_CHECK(colors.size() == voxels.size(), "{} colours of {} voxels", colors.size(), voxels.size());
  const auto kind = kind_of(path);
  if (!kind) return forward_error(kind);
  if (*kind != Kind::kLogOdds)
    return fail(ErrorCode::kUnsupported, path.string(), "only .ot files of OctoMap hold colours");
  return write_content(path, {voxels, colors, resolution_m, *kind});
}

}  // namespace hm
