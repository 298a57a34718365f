#include "hm/io/map/occupancy_grid_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/text_lines.hpp"

namespace hm {
namespace {

constexpr int kMaxEdge = 1 << 20;
constexpr std::size_t kMaxGridCells = std::size_t{1} << 28;
constexpr std::uint8_t kOccupiedGray = 0, kFreeGray = 254, kUnknownGray = 205;

std::uint8_t gray_of(std::uint8_t cell, OccupancyGridMode mode) {
  if (mode == OccupancyGridMode::kRaw) return cell;
  return cell == OccupancyGrid2D::kUnknown ? kUnknownGray : cell >= 50 ? kOccupiedGray : kFreeGray;
}

Result<void> write_pgm(const std::filesystem::path& path, const OccupancyGrid2D& grid,
                       OccupancyGridMode mode) {
  OutputFile file(path);
  file.write(fmt::format("P5\n# {} m a cell\n{} {}\n255\n", grid.resolution_m, grid.cells.width(),
                         grid.cells.height()));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(grid.cells.width()));
  for (int y = grid.cells.height() - 1; y >= 0; --y) {
    std::ranges::transform(grid.cells.row(y), row.begin(),
                           [&](std::uint8_t cell) { return gray_of(cell, mode); });
    file.write(row.data(), row.size());
  }
  return file.finish();
}

/// Image of a PGM file: values from 0 to 1.
struct Gray {
  int width = 0, height = 0, maximum = 255;
  std::vector<std::uint8_t> values;
};

/// Reads PGM files of 8 bits.
class PgmReader {
 public:
  PgmReader(std::span<const std::uint8_t> bytes, std::string where)
      : bytes_(bytes), where_(std::move(where)) {}

  Result<Gray> read() {
    const bool binary = bytes_.size() > 2 && bytes_[0] == 'P' && bytes_[1] == '5';
    if (!binary && !(bytes_.size() > 2 && bytes_[0] == 'P' && bytes_[1] == '2'))
      return stop(ErrorCode::kCorrupted, "is not a PGM image");
    at_ = 2;
    Gray gray;
    if (!number(gray.width, kMaxEdge) || !number(gray.height, kMaxEdge) || !number(gray.maximum, 255) ||
        gray.width < 1 || gray.height < 1 || gray.maximum < 1)
      return stop(ErrorCode::kCorrupted, "width, height or maximum (1 to 255) is wrong");
    const std::size_t count = static_cast<std::size_t>(gray.width) * static_cast<std::size_t>(gray.height);
    if (count > kMaxGridCells) return stop(ErrorCode::kUnsupported, "is too large");
    if (binary) {
      ++at_;  // one blank
      if (at_ > bytes_.size() || bytes_.size() - at_ < count)
        return stop(ErrorCode::kTruncated, "ends too early");
      const auto first = bytes_.begin() + static_cast<std::ptrdiff_t>(at_);
      gray.values.assign(first, first + static_cast<std::ptrdiff_t>(count));
      return gray;
    }
    if (bytes_.size() / 2 < count) return stop(ErrorCode::kTruncated, "ends too early");
    for (std::size_t i = 0; i < count; ++i) {
      int value = 0;
      if (!number(value, gray.maximum)) return stop(ErrorCode::kCorrupted, "a value is missing or too large");
      gray.values.push_back(static_cast<std::uint8_t>(value));
    }
    return gray;
  }

 private:
  tl::unexpected<Error> stop(ErrorCode code, std::string_view why) const {
    return fail(code, fmt::format("{}, byte {}", where_, at_), "{}", why);
  }
  static bool is_blank(std::uint8_t c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  /// Next integer; skips white space and comments before it.
  bool number(int& value, int limit) {
    while (at_ < bytes_.size() && (is_blank(bytes_[at_]) || bytes_[at_] == '#')) {
      if (bytes_[at_] == '#')
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      else
        ++at_;
    }
    const std::size_t begin = at_;
    value = 0;
    for (; at_ < bytes_.size() && bytes_[at_] >= '0' && bytes_[at_] <= '9'; ++at_) {
      value = value * 10 + (bytes_[at_] - '0');
      if (value > limit) return false;
    }
    return at_ > begin;
  }

  std::span<const std::uint8_t> bytes_;
  std::string where_;
  std::size_t at_ = 0;
};

/// Contents of a map's YAML file.
struct MapDescription {
  std::string image, mode = "trinary";
  double resolution_m = 0, occupied_thresh = 0.65, free_thresh = 0.196;
  std::array<double, 3> origin{};
  bool negate = false;
};

struct Value {
  std::string text;
  std::size_t line = 0;
};

/// Value of a key without quotes, with brackets and commas of lists replaced by spaces.
std::string plain(std::string_view text) {
  if (const auto comment = text.find(" #"); comment != std::string_view::npos) text = text.substr(0, comment);
  std::string result(text);
  std::ranges::replace_if(
      result, [](char c) { return c == '[' || c == ']' || c == ','; }, ' ');
  const auto first = result.find_first_not_of(" \t\"'"), last = result.find_last_not_of(" \t\"'");
  return first == std::string::npos ? "" : result.substr(first, last - first + 1);
}

/// The keys of a map's YAML file, `key: value` a line, and what errors say about them.
class MapYaml {
 public:
  static Result<MapYaml> read(const std::filesystem::path& path) {
    const auto file = TextFile::read(path);
    if (!file) return forward_error(file);
    MapYaml yaml;
    yaml.where_ = file->where();
    Value* last = nullptr;
    for (const TextLine& line : file->lines()) {
      if (line.text.starts_with('-') && last) {  // a list, one entry a line
        last->text += ' ' + plain(line.text.substr(1));
        continue;
      }
      const std::size_t colon = line.text.find(':');
      if (colon == std::string_view::npos)
        return fail(ErrorCode::kCorrupted, file->where(line), "is not 'key: value'");
      last = &yaml.values_[std::string(line.text.substr(0, colon))];
      *last = {plain(line.text.substr(colon + 1)), line.number};
    }
    return yaml;
  }

  [[nodiscard]] std::string text(std::string_view key, std::string otherwise) const {
    const auto value = values_.find(key);
    return value == values_.end() ? std::move(otherwise) : value->second.text;
  }
  /// Place of a key, or of the file without it.
  [[nodiscard]] std::string where(std::string_view key) const {
    const auto value = values_.find(key);
    return value == values_.end() ? where_ : fmt::format("{}:{}", where_, value->second.line);
  }
  /// The numbers of a key, separated by spaces. Error: one of them is none.
  [[nodiscard]] Result<std::vector<double>> numbers(std::string_view key) const {
    std::vector<double> result;
    const std::string all = text(key, "");
    for (const std::string_view word : words(all)) {
      const auto parsed = parse_number(word);
      if (!parsed || !std::isfinite(*parsed))
        return fail(ErrorCode::kInvalidValue, where(key), "{}: '{}' is no number", key, word);
      result.push_back(*parsed);
    }
    return result;
  }
  /// Leaves `target` as it is where the key is missing.
  [[nodiscard]] Result<void> number(std::string_view key, double& target) const {
    if (!values_.contains(key)) return {};
    const auto values = numbers(key);
    if (!values) return forward_error(values);
    if (values->size() != 1)
      return fail(ErrorCode::kInvalidValue, where(key), "{}: one number is needed", key);
    target = values->front();
    return {};
  }

 private:
  std::string where_;
  std::map<std::string, Value, std::less<>> values_;
};

Result<MapDescription> read_description(const std::filesystem::path& path) {
  const auto yaml = MapYaml::read(path);
  if (!yaml) return forward_error(yaml);
  MapDescription map;
  double negate = 0;
  for (const auto& done :
       {yaml->number("resolution", map.resolution_m), yaml->number("negate", negate),
        yaml->number("occupied_thresh", map.occupied_thresh), yaml->number("free_thresh", map.free_thresh)})
    if (!done) return forward_error(done);
  map.negate = negate != 0;
  map.image = yaml->text("image", "");
  map.mode = yaml->text("mode", map.mode);
  if (yaml->text("resolution", "").empty())
    return fail(ErrorCode::kNotFound, yaml->where(""), "has no 'resolution'");
  if (!(map.resolution_m > 0))
    return fail(ErrorCode::kInvalidValue, yaml->where("resolution"), "a resolution of {}", map.resolution_m);
  if (map.image.empty()) return fail(ErrorCode::kNotFound, yaml->where(""), "names no image");
  if (map.mode != "trinary" && map.mode != "scale" && map.mode != "raw")
    return fail(ErrorCode::kUnsupported, yaml->where("mode"), "mode '{}'", map.mode);
  const auto origin = yaml->numbers("origin");
  if (!origin) return forward_error(origin);
  if (origin->size() != 3)
    return fail(ErrorCode::kInvalidValue, yaml->where("origin"), "'origin' is not [x, y, yaw]");
  std::ranges::copy(*origin, map.origin.begin());
  if (map.origin[2] != 0)
    return fail(ErrorCode::kUnsupported, yaml->where("origin"), "a map turned by {} rad", map.origin[2]);
  return map;
}

std::uint8_t cell_of(std::uint8_t gray, int maximum, const MapDescription& map) {
  if (map.mode == "raw") return gray <= 100 ? gray : OccupancyGrid2D::kUnknown;
  const double light = static_cast<double>(gray) / maximum, p = map.negate ? light : 1 - light;
  if (p > map.occupied_thresh) return 100;
  if (p < map.free_thresh) return 0;
  if (map.mode == "trinary") return OccupancyGrid2D::kUnknown;
  return static_cast<std::uint8_t>(
      std::lround(1 + 98 * (p - map.free_thresh) / std::max(1e-9, map.occupied_thresh - map.free_thresh)));
}

}  // namespace

Result<OccupancyGridFiles> occupancy_grid_files(const std::filesystem::path& path) {
  OccupancyGridFiles files{path, path};
  const std::string extension = lower_extension(path);
  if (extension == ".yaml" || extension == ".yml")
    files.image.replace_extension(".pgm");
  else if (extension == ".pgm")
    files.description.replace_extension(".yaml");
  else
    return fail(ErrorCode::kUsage, path.string(), "a map of map_server ends in .yaml, .yml or .pgm");
  return files;
}

Result<void> write_occupancy_grid(const std::filesystem::path& path, const OccupancyGrid2D& grid,
                                  OccupancyGridMode mode) {
  const auto files = occupancy_grid_files(path);
  if (!files) return forward_error(files);
  if (grid.cells.empty()) return fail(ErrorCode::kInvalidValue, path.string(), "the map is empty");
  if (const auto done = write_pgm(files->image, grid, mode); !done) return forward_error(done);
  OutputFile file(files->description);
  file.write(
      fmt::format("image: {}\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
                  "free_thresh: 0.196\nmode: {}\n",
                  files->image.filename().string(), grid.resolution_m, grid.origin_m.x(), grid.origin_m.y(),
                  mode == OccupancyGridMode::kRaw ? "raw" : "trinary"));
  return file.finish();
}

Result<OccupancyGrid2D> read_occupancy_grid(const std::filesystem::path& path) {
  const auto map = read_description(path);
  if (!map) return forward_error(map);
  const std::filesystem::path picture = path.parent_path() / map->image;
  const auto bytes = read_file_bytes(picture);
  if (!bytes) return forward_error(bytes);
  const auto gray = PgmReader(*bytes, picture.string()).read();
  if (!gray) return forward_error(gray);
  OccupancyGrid2D grid;
  grid.resolution_m = map->resolution_m;
  grid.origin_m = {map->origin[0], map->origin[1]};
  grid.cells = {gray->width, gray->height, OccupancyGrid2D::kUnknown};
  std::size_t from = 0;
  for (int y = gray->height - 1; y >= 0; --y)
    for (std::uint8_t& cell : grid.cells.row(y)) cell = cell_of(gray->values[from++], gray->maximum, *map);
  return grid;
}

}  // namespace hm
