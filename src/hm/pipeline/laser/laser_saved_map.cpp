#include "hm/pipeline/laser/laser_saved_map.hpp"

#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/pipeline/common/mvog_file.hpp"

namespace hm {
namespace {

constexpr double kPlanarLayers = 2.5;

Result<OccupancyGrid2D> read_slice(const std::filesystem::path& path, const LaserRunParams& params) {
  const auto map = read_mvog(path);
  if (!map) return forward_error(map);
  return laser_slice(*map, params);
}

bool has_walls(const OccupancyGrid2D& grid) {
  for (int y = 0; y < grid.cells.height(); ++y)
    for (int x = 0; x < grid.cells.width(); ++x)
      if (grid.state(x, y) == Occupancy::kOccupied) return true;
  return false;
}

/// The file with the map in a folder of a run; the path itself when it is no folder.
std::filesystem::path map_file_of(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_directory(path, code)) return path;
  for (const char* name : {"map.yaml", "map.mvog"})
    if (std::filesystem::exists(path / name, code)) return path / name;
  return path;
}

}  // namespace

bool is_planar(const MultiVolumeGrid& map) {
  const Box3 bounds = map.bounds();
  return !bounds.isEmpty() && bounds.sizes().z() < kPlanarLayers * map.params().resolution_m;
}

Result<OccupancyGrid2D> laser_slice(const MultiVolumeGrid& map, const LaserRunParams& params) {
  if (!is_planar(map)) return map.slice(params.slice_bottom_m, params.slice_top_m);
  const Box3 bounds = map.bounds();
  return map.slice(bounds.min().z(), bounds.max().z());
}

Result<OccupancyGrid2D> read_saved_laser_map(const std::filesystem::path& path,
                                             const LaserRunParams& params) {
  const auto file = map_file_of(path);
  std::error_code code;
  if (!std::filesystem::exists(file, code))
    return fail(ErrorCode::kNotFound, path.string(), "there is no such map");
  if (file.extension() != ".yaml" && file.extension() != ".mvog")
    return fail(
        ErrorCode::kUnsupported, path.string(),
        "this is not a map to find a vehicle in: map.yaml, map.mvog, or a folder that `hm laser` wrote");
  auto grid = file.extension() == ".mvog" ? read_slice(file, params) : read_occupancy_grid(file);
  if (!grid) return grid;
  if (!has_walls(*grid))
    return fail(ErrorCode::kInvalidValue, file.string(), "nothing in this map is occupied{}",
                file.extension() == ".mvog" ? " between laser.slice_bottom_m and laser.slice_top_m" : "");
  return grid;
}

}  // namespace hm
