#include "hm/pipeline/common/map_export.hpp"

#include <fmt/format.h>

#include <system_error>

#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/report/map_figures.hpp"

namespace hm {

Result<bool> written_unless_too_large(const std::filesystem::path& path, const Result<void>& written,
                                      std::vector<std::string>& warnings) {
  if (written) return true;
  if (written.error().code != ErrorCode::kInvalidValue) return forward_error(written);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  warnings.push_back(fmt::format("no {}: {}", path.filename().string(), written.error().message));
  return false;
}

Result<MapLayers> write_map_files(const MultiVolumeGrid& map, const Result<OccupancyGrid2D>& slice,
                                  const MeshWriteOptions& mesh, ResultFiles& files) {
  const double size_m = map.params().resolution_m;
  MapLayers layers{map.voxels(), {}, {}};
  layers.faces = occupied_faces(layers.voxels, size_m);
  const std::vector<std::byte> bytes = map.serialise();
  files
      .file("map.mvog",
            [&](const auto& path) {
              return write_file_bytes(path,
                                      {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
            })
      .file_that_fits("map.bt", [&](const auto& path) { return write_octomap(path, layers.voxels, size_m); })
      .file("map.ply", [&](const auto& path) { return write_mesh(path, layers.faces, mesh); });
  if (!slice)
    files.warn("no map.pgm: " + to_string(slice.error()));
  else if (slice->cells.empty())
    files.warn("no map.pgm: the map is empty");
  else
    files.file("map.yaml", [&](const auto& path) { return write_occupancy_grid(path, *slice); })
        .written("map.pgm");
  if (!files.result()) return forward_error(files.result());
  if (slice && !slice->cells.empty()) layers.slice = *slice;
  return layers;
}

}  // namespace hm
