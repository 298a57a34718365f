#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {

/// Takes the outcome of writing `path` in a format that cannot hold every map (OctoMap: 32768 cells from the
/// origin). A map that does not fit costs this file only: it is left out (false) with a warning, and an
/// earlier run's file of that name is removed. True when it was written; other errors pass.
Result<bool> written_unless_too_large(const std::filesystem::path& path, const Result<void>& written,
                                      std::vector<std::string>& warnings);

/// Files of a result, written one after the other and named in its list of outputs. After a failure the later
/// ones are left out.
class ResultFiles {
 public:
  ResultFiles(std::filesystem::path folder, std::vector<std::filesystem::path>& outputs,
              std::vector<std::string>& warnings)
      : folder_(std::move(folder)), outputs_(outputs), warnings_(warnings) {}
  /// `write(path)` returns a Result<void>.
  template <class Write>
  ResultFiles& file(const char* name, Write&& write) {
    if (!result_) return *this;
    result_ = write(folder_ / name);
    if (result_) outputs_.push_back(folder_ / name);
    return *this;
  }
  /// Writes a file, or adds a warning where its format cannot hold the map.
  template <class Write>
  ResultFiles& file_that_fits(const char* name, Write&& write) {
    if (!result_) return *this;
    const auto written = written_unless_too_large(folder_ / name, write(folder_ / name), warnings_);
    if (!written) result_ = forward_error(written);
    if (written && *written) outputs_.push_back(folder_ / name);
    return *this;
  }
  ResultFiles& text(const char* name, const std::string& text) {
    return file(name, [&](const auto& path) { return write_file_text(path, text); });
  }
  /// Names a file that was written already.
  ResultFiles& written(const char* name) {
    return file(name, [](const auto&) { return Result<void>(); });
  }
  void warn(std::string text) { warnings_.push_back(std::move(text)); }
  [[nodiscard]] Result<void> result() const { return result_; }

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path>& outputs_;
  std::vector<std::string>& warnings_;
  Result<void> result_;
};

/// A multi-volume map as what its files and figures are made of.
struct MapLayers {
  std::vector<OccupancyVoxel> voxels;
  TriangleMesh faces;                    ///< of the occupied voxels
  std::optional<OccupancyGrid2D> slice;  ///< nothing for an empty map
};

/// Writes map.mvog, map.bt (OctoMap), map.ply (faces of the occupied cells), map.yaml and map.pgm (the
/// slice). What a format cannot hold, and a slice that cannot be made, become warnings. Error: one of
/// writing.
Result<MapLayers> write_map_files(const MultiVolumeGrid& map, const Result<OccupancyGrid2D>& slice,
                                  const MeshWriteOptions& mesh, ResultFiles& files);

}  // namespace hm
